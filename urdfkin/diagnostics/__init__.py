"""Strict, located, coded findings about a URDF, before anything else is asked to read it."""

from urdfkin.diagnostics.check import check_text
from urdfkin.diagnostics.document import DEFAULT_LIMITS, Limits
from urdfkin.diagnostics.finding import Finding, Oracle, Severity, UrdfError, UrdfWarning

__all__ = [
    "DEFAULT_LIMITS",
    "Finding",
    "Limits",
    "Oracle",
    "Severity",
    "UrdfError",
    "UrdfWarning",
    "check_text",
]
