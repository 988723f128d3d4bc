"""A text read as `urdfkin.load` reads it, whatever is found in it."""

from urdfkin.model.tree import KinematicTree
from urdfkin.urdf.findings import Reporter
from urdfkin.urdf.lint import UrdfError
from urdfkin.urdf.lint.runner import read_urdf
from urdfkin.urdf.reader import read_tree
from urdfkin.urdf.records import RobotRecord


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
