"""Check a URDF and return findings, each with a code and a position. `load` checks every URDF."""

from urdfkin.urdf.findings import Finding, PinocchioReading, Severity, UrdfError, UrdfWarning
from urdfkin.urdf.lint.runner import check, check_text
from urdfkin.urdf.records import DEFAULT_SIZE_LIMITS, SizeLimits

__all__ = [
    "DEFAULT_SIZE_LIMITS",
    "Finding",
    "PinocchioReading",
    "Severity",
    "SizeLimits",
    "UrdfError",
    "UrdfWarning",
    "check",
    "check_text",
]
