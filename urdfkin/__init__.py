"""Textbook kinematics from any URDF, every number checked against Pinocchio.

>>> import urdfkin
>>> robot = urdfkin.load("ur5")
>>> J = robot.jacobian(robot.neutral(), "tool0")
>>> J.shape, robot.certificate().verified
((6, 6), True)
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from urdfkin.system.asking import answer
from urdfkin.system.later import later

if TYPE_CHECKING:
    from urdfkin.dh import DHRow, DHTable, read_table, table_from_rows
    from urdfkin.errors import InputError, SourceError, UnknownNameError, UrdfkinError
    from urdfkin.lint import Finding, UrdfError, UrdfWarning, check
    from urdfkin.loading import load
    from urdfkin.model.base_motion import BaseMotion
    from urdfkin.model.chain import FrameChain
    from urdfkin.model.reference import Reference
    from urdfkin.robot import Robot
    from urdfkin.sameness.calibration.calibrate import calibrate
    from urdfkin.sameness.changes import diff
    from urdfkin.sameness.judging import same
    from urdfkin.urdf.catalogue import robots
    from urdfkin.validation.campaign import validate
    from urdfkin.verify.certificate import Certificate, VerificationError
    from urdfkin.verify.tables import TableError
    from urdfkin.verify.verifier import NotVerifiedWarning

# Loaded when first asked for: `import urdfkin` needs no numpy, no Pinocchio and no compiler.
_HOMES = {
    "BaseMotion": "urdfkin.model.base_motion",
    "Certificate": "urdfkin.verify.certificate",
    "DHRow": "urdfkin.dh",
    "DHTable": "urdfkin.dh",
    "Finding": "urdfkin.lint",
    "FrameChain": "urdfkin.model.chain",
    "InputError": "urdfkin.errors",
    "NotVerifiedWarning": "urdfkin.verify.verifier",
    "Reference": "urdfkin.model.reference",
    "Robot": "urdfkin.robot",
    "SourceError": "urdfkin.errors",
    "TableError": "urdfkin.verify.tables",
    "UnknownNameError": "urdfkin.errors",
    "UrdfError": "urdfkin.lint",
    "UrdfWarning": "urdfkin.lint",
    "UrdfkinError": "urdfkin.errors",
    "VerificationError": "urdfkin.verify.certificate",
    "calibrate": "urdfkin.sameness.calibration.calibrate",
    "check": "urdfkin.lint",
    "diff": "urdfkin.sameness.changes",
    "load": "urdfkin.loading",
    "read_table": "urdfkin.dh",
    "robots": "urdfkin.urdf.catalogue",
    "same": "urdfkin.sameness.judging",
    "table_from_rows": "urdfkin.dh",
    "validate": "urdfkin.validation.campaign",
}

# What an object is asked to show and a higher room draws: no room imports what stands above it.
answer("a table in a form", later("urdfkin.dh.export:export"))
answer("a report as a page", later("urdfkin.report.html:as_html"))
answer("a report as a comment", later("urdfkin.report.markdown:as_markdown"))
answer("a robot in a cell", later("urdfkin.report.cell:Cell"))

__all__ = [
    "BaseMotion",
    "Certificate",
    "DHRow",
    "DHTable",
    "Finding",
    "FrameChain",
    "InputError",
    "NotVerifiedWarning",
    "Reference",
    "Robot",
    "SourceError",
    "TableError",
    "UnknownNameError",
    "UrdfError",
    "UrdfWarning",
    "UrdfkinError",
    "VerificationError",
    "calibrate",
    "check",
    "diff",
    "load",
    "read_table",
    "robots",
    "same",
    "table_from_rows",
    "validate",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'urdfkin' has no attribute {name!r}")
    return getattr(importlib.import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return __all__
