"""What tests read: robots whatever is found in them, records and trees of texts, and modules of files."""

from __future__ import annotations

import importlib.util
import warnings
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

import urdfkin
from urdfkin.model.tree import KinematicTree
from urdfkin.robot import Robot
from urdfkin.urdf.findings import Reporter
from urdfkin.urdf.lint import UrdfError
from urdfkin.urdf.lint.runner import read_urdf
from urdfkin.urdf.reader import read_tree
from urdfkin.urdf.records import RobotRecord
from urdfkin.urdf.writer import to_urdf

T = TypeVar("T")


def present(value: T | None) -> T:
    """Return a value that must not be None."""
    assert value is not None
    return value


def loaded(source: Any, **options: Any) -> Robot:
    """Load a robot or a tree, and ignore the warnings about it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", urdfkin.UrdfWarning)
        robot: Robot = urdfkin.load(
            to_urdf(source) if isinstance(source, KinematicTree) else source, **options
        )
        return robot


def module_of(path: Path) -> ModuleType:
    """Import a file."""
    spec = present(importlib.util.spec_from_file_location(path.stem, path))
    found = importlib.util.module_from_spec(spec)
    present(spec.loader).exec_module(found)
    return found


def records(data: bytes) -> RobotRecord:
    """What a text says."""
    report = Reporter("<text>", data)
    urdf = read_urdf(report)
    if urdf is None:
        raise UrdfError(report.findings())
    return urdf


def tree_of(data: bytes, *, mimic: bool = True, root_joint: str | None = None) -> KinematicTree:
    """The tree that it stands for."""
    return read_tree(records(data), mimic=mimic, root_joint=root_joint)
