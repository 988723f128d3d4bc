"""What an MJCF file says that the tree made of it does not hold: said by `load`, never dropped in silence."""

from __future__ import annotations

from typing import TYPE_CHECKING

from urdfkin.lint.finding import Finding
from urdfkin.lint.rule import NOTE, WARNING, Rule

if TYPE_CHECKING:
    from urdfkin.urdf.mjcf import Listed

LEFT_OUT_MOTION = Rule("MJCF101", "left-out-motion", WARNING)
LEFT_OUT = Rule("MJCF102", "left-out", NOTE)


def left_out(one: Listed, file: str) -> Finding:
    """One thing that the tree does not hold, as a finding: a warning where motion depends on it."""
    rule = LEFT_OUT_MOTION if one.moves else LEFT_OUT
    message = one.what if one.where is None else f"{one.where}: {one.what}"
    return Finding(rule.id, rule.severity, message, file=file)
