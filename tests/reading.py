"""Functions that read records and trees from texts, import files, and check for None."""

import importlib.util
from pathlib import Path
from types import ModuleType
from typing import TypeVar

from urdfkin.model.tree import KinematicTree
from urdfkin.urdf.findings import Reporter
from urdfkin.urdf.lint import UrdfError
from urdfkin.urdf.lint.runner import read_urdf
from urdfkin.urdf.reader import read_tree
from urdfkin.urdf.records import RobotRecord

T = TypeVar("T")


def present(value: T | None) -> T:
    assert value is not None
    return value


def module_of(path: Path) -> ModuleType:
    spec = present(importlib.util.spec_from_file_location(path.stem, path))
    found = importlib.util.module_from_spec(spec)
    present(spec.loader).exec_module(found)
    return found


def records(data: bytes) -> RobotRecord:
    """Return the records of a URDF."""
    report = Reporter("<text>", data)
    urdf = read_urdf(report)
    if urdf is None:
        raise UrdfError(report.findings())
    return urdf


def tree_of(data: bytes, *, mimic: bool = True, root_joint: str | None = None) -> KinematicTree:
    """Return the kinematic tree of a URDF."""
    return read_tree(records(data), mimic=mimic, root_joint=root_joint)
