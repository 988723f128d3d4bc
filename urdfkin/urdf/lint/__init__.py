"""Check a URDF and return findings, each with a code and a position. `load` checks every URDF."""

from urdfkin.urdf.findings import Finding, PinocchioReading, Severity, UrdfError, UrdfWarning
from urdfkin.urdf.lint.runner import check, check_text
from urdfkin.urdf.records import DEFAULT_LIMITS, Limits

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
