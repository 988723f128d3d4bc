"""What an MJCF file says that the tree made of it does not hold: said by `load`, never dropped in silence."""

from __future__ import annotations

from urdfkin.lint.rule import NOTE, WARNING, Rule

LEFT_OUT_MOTION = Rule("MJCF101", "left-out-motion", WARNING)
LEFT_OUT = Rule("MJCF102", "left-out", NOTE)
