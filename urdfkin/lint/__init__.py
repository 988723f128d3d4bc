"""Check a URDF: each finding has a code and a position. Every URDF is checked before it is used."""

from urdfkin.lint.finding import Finding, PinocchioReading, Severity, UrdfError, UrdfWarning
from urdfkin.lint.limits import DEFAULT_LIMITS, Limits
from urdfkin.lint.runner import check, check_text

__all__ = [
    "DEFAULT_LIMITS",
    "Finding",
    "Limits",
    "PinocchioReading",
    "Severity",
    "UrdfError",
    "UrdfWarning",
    "check",
    "check_text",
]
