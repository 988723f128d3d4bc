"""Robot kinematics from any URDF, with the textbook's equations; every result is checked with Pinocchio.

>>> import urdfkin
>>> robot = urdfkin.load("ur5")
>>> J = robot.jacobian(robot.neutral(), "tool0")
>>> J.shape, robot.certificate().verified
((6, 6), True)
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from urdfkin.system.lazy_import import lazy_import, register_hook

if TYPE_CHECKING:
    from urdfkin.calibration.calibrate import calibrate
    from urdfkin.comparison.diff import diff
    from urdfkin.comparison.verdict import same
    from urdfkin.dh import DHRow, DHTable, read_table, table_from_rows
    from urdfkin.errors import DegreesWarning, InputError, SourceError, UnknownNameError, UrdfkinError
    from urdfkin.model.base_motion import BaseMotion
    from urdfkin.model.chain import FrameChain
    from urdfkin.model.reference import Reference
    from urdfkin.robot import Robot
    from urdfkin.robot.frame_motion import frame_motion
    from urdfkin.robot.loading import load
    from urdfkin.robot.trajectory import read_trajectory
    from urdfkin.urdf.catalogue import robots
    from urdfkin.urdf.lint import Finding, UrdfError, UrdfWarning, check
    from urdfkin.validation.campaign import validate
    from urdfkin.validation.functions import verify_function
    from urdfkin.verify.certificate import Certificate, VerificationError
    from urdfkin.verify.tables import TableError
    from urdfkin.verify.verifier import NotVerifiedWarning

# These names are imported at their first use: `import urdfkin` loads no NumPy, no Pinocchio and no compiler.
_HOMES = {
    "BaseMotion": "urdfkin.model.base_motion",
    "Certificate": "urdfkin.verify.certificate",
    "DHRow": "urdfkin.dh",
    "DHTable": "urdfkin.dh",
    "DegreesWarning": "urdfkin.errors",
    "Finding": "urdfkin.urdf.lint",
    "FrameChain": "urdfkin.model.chain",
    "InputError": "urdfkin.errors",
    "NotVerifiedWarning": "urdfkin.verify.verifier",
    "Reference": "urdfkin.model.reference",
    "Robot": "urdfkin.robot",
    "SourceError": "urdfkin.errors",
    "TableError": "urdfkin.verify.tables",
    "UnknownNameError": "urdfkin.errors",
    "UrdfError": "urdfkin.urdf.lint",
    "UrdfWarning": "urdfkin.urdf.lint",
    "UrdfkinError": "urdfkin.errors",
    "VerificationError": "urdfkin.verify.certificate",
    "calibrate": "urdfkin.calibration.calibrate",
    "check": "urdfkin.urdf.lint",
    "diff": "urdfkin.comparison.diff",
    "frame_motion": "urdfkin.robot.frame_motion",
    "load": "urdfkin.robot.loading",
    "read_table": "urdfkin.dh",
    "read_trajectory": "urdfkin.robot.trajectory",
    "robots": "urdfkin.urdf.catalogue",
    "same": "urdfkin.comparison.verdict",
    "table_from_rows": "urdfkin.dh",
    "validate": "urdfkin.validation.campaign",
    "verify_function": "urdfkin.validation.functions",
}

# A package imports only from packages that are earlier in the list of docs/architecture.md.
# A hook lets a package call a function of a higher package without importing that package.
register_hook("a table in a form", lazy_import("urdfkin.dh.export:export"))
register_hook("code of a robot", lazy_import("urdfkin.export.forms:make_robot_code"))
register_hook("code of a chain", lazy_import("urdfkin.export.forms:make_chain_code"))
register_hook("a robot of a source", lazy_import("urdfkin.robot.loading:load"))
register_hook("code in a language", lazy_import("urdfkin.export:write"))
register_hook("a report as a page", lazy_import("urdfkin.report.html:as_html"))
register_hook("a report as a comment", lazy_import("urdfkin.report.markdown:as_markdown"))
register_hook("a comparison as a document", lazy_import("urdfkin.report.same:as_document"))
register_hook("a robot in a cell", lazy_import("urdfkin.report.html:NotebookView"))

__all__ = [
    "BaseMotion",
    "Certificate",
    "DHRow",
    "DHTable",
    "DegreesWarning",
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
    "frame_motion",
    "load",
    "read_table",
    "read_trajectory",
    "robots",
    "same",
    "table_from_rows",
    "validate",
    "verify_function",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'urdfkin' has no attribute {name!r}")
    return getattr(importlib.import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return __all__
