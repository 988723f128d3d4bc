"""Findings of `load` for the parts of an MJCF file that a kinematic tree cannot represent."""

from __future__ import annotations

from typing import TYPE_CHECKING

from urdfkin.urdf.findings import NOTE, WARNING, Finding, Rule

if TYPE_CHECKING:
    from urdfkin.urdf.mjcf import Listed

LEFT_OUT_MOTION = Rule("MJCF101", "left-out-motion", WARNING)
LEFT_OUT = Rule("MJCF102", "left-out", NOTE)


def left_out(one: Listed, file: str) -> Finding:
    """Return a finding for a part of an MJCF file that the tree does not represent.

    The finding is a warning if the part affects the motion, otherwise a note.
    """
    rule = LEFT_OUT_MOTION if one.moves else LEFT_OUT
    message = one.what if one.where is None else f"{one.where}: {one.what}"
    return Finding(rule.id, rule.severity, message, file=file)
