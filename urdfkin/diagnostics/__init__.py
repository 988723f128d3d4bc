"""Strict, located, coded findings about a URDF, before anything else is asked to read it."""

from urdfkin.diagnostics.check import check_text
from urdfkin.diagnostics.finding import Finding, PinocchioReading, Severity, UrdfError, UrdfWarning
from urdfkin.diagnostics.limits import DEFAULT_LIMITS, Limits

__all__ = [
    "DEFAULT_LIMITS",
    "Finding",
    "Limits",
    "PinocchioReading",
    "Severity",
    "UrdfError",
    "UrdfWarning",
    "check_text",
]
