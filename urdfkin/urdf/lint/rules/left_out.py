"""Findings of `load` about MJCF and USD: parts that a tree cannot represent, and probable mistakes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from urdfkin.urdf.findings import NOTE, WARNING, Finding, Rule

if TYPE_CHECKING:
    from urdfkin.urdf.mjcf import Listed
    from urdfkin.urdf.usd import Remark

LEFT_OUT_MOTION = Rule("MJCF101", "left-out-motion", WARNING)
LEFT_OUT = Rule("MJCF102", "left-out", NOTE)
ANGLE_UNIT = Rule("MJCF201", "angle-unit", WARNING)

LEFT_OUT_OF_USD = Rule("USD101", "left-out-of-usd", WARNING)
UNUSED_IN_USD = Rule("USD102", "unused-in-usd", NOTE)
MISSING_LAYER = Rule("USD103", "missing-layer", WARNING)
TIME_SAMPLES = Rule("USD104", "time-samples", WARNING)
OUTSIDE_JOINT = Rule("USD201", "outside-joint", WARNING)
LOOSE_BODY = Rule("USD202", "loose-body", WARNING)
LOST_MIMIC = Rule("USD203", "lost-mimic", WARNING)
UNIT_SCALE = Rule("USD301", "unit-scale", WARNING)
UP_AXIS = Rule("USD302", "up-axis", WARNING)
LIMIT_UNIT = Rule("USD303", "limit-unit", WARNING)
REST_POSE = Rule("USD304", "rest-pose", WARNING)
MIRRORED_BODY = Rule("USD305", "mirrored-body", WARNING)


def left_out(one: Listed, file: str) -> Finding:
    """Return a finding for a part of an MJCF file that the tree does not represent, or for a mistake.

    The finding is a warning if the part affects the motion or is a probable mistake, otherwise a note.
    """
    rule = LEFT_OUT_MOTION if one.moves else LEFT_OUT if one.remedy is None else ANGLE_UNIT
    message = one.what if one.where is None else f"{one.where}: {one.what}"
    return Finding(rule.id, rule.severity, message, remedy=one.remedy, file=file)


def of_usd(one: Remark, file: str) -> Finding:
    """Convert a remark about a USD stage to a finding. The finding contains the path of the prim."""
    rule = next(rule for rule in globals().values() if isinstance(rule, Rule) and rule.slug == one.kind)
    element, name = ("prim", one.where) if one.where else (None, None)
    return Finding(rule.id, rule.severity, one.what, remedy=one.remedy, file=file, element=element, name=name)
