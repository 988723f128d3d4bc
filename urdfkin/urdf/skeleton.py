"""A URDF reduced to what kinematics needs, for a reader that stumbles over the rest.

Shapes, materials, inertials and extensions are left out, numbers stand as they were read, and a quaternion of
URDF 1.1 becomes roll, pitch and yaw. Nothing in the result needs a lenient reader: there is no declaration,
no comment, no entity, no namespace, and no element twice.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from urdfkin.lint.finding import UrdfError
from urdfkin.lint.limits import DEFAULT_LIMITS, Limits
from urdfkin.lint.reporter import Reporter
from urdfkin.lint.rules import axes as joints
from urdfkin.lint.rules.dialect import check_dialect
from urdfkin.lint.rules.document import Element, parse
from urdfkin.lint.rules.encoding import utf8_bytes
from urdfkin.lint.rules.joints import JointRecord, LimitRecord, RobotRecord, read_robot
from urdfkin.rotation.arrays import FloatArray
from urdfkin.rotation.euler import rpy_of
from urdfkin.rotation.quaternion import rotation_of
from urdfkin.urdf.writer import attribute, numbers


def skeleton(data: bytes, limits: Limits = DEFAULT_LIMITS) -> bytes:
    """The links and joints of a URDF as a plain document.

    Args:
        data: The file's bytes, already found free of errors by `urdfkin.lint`.
        limits: The limits it was checked with.

    Raises:
        UrdfError: the file has errors that keep it from being read at all.
    """
    root, robot = _records(data, limits)
    lines = [f'<robot name="{attribute(root.attributes.get("name", ""))}">']
    lines += [f'<link name="{attribute(link)}"/>' for link in robot.links]
    for joint in robot.joints:
        lines += _joint(joint)
    lines.append("</robot>")
    return "\n".join(lines).encode()


def tilts(data: bytes) -> dict[str, float]:
    """How far off (rad) the axes are that Pinocchio takes for x, y or z, by joint: see URDF514.

    Args:
        data: As for `skeleton`.
    """
    return joints.tilts(_records(data, DEFAULT_LIMITS)[1])


def _records(data: bytes, limits: Limits) -> tuple[Element, RobotRecord]:
    report = Reporter("<text>", data, limits)
    text = utf8_bytes(report, data)
    report.data = text or b""
    root = None if text is None else parse(report, text)
    version = None if root is None else check_dialect(report, root)
    if root is None or version is None:
        raise UrdfError(report.findings())
    return root, read_robot(report, root, version)


def rpy_of_quaternion(quaternion: Sequence[float]) -> FloatArray:
    """Roll, pitch and yaw of a quaternion (x, y, z, w) of any length, as URDF 1.1 writes it."""
    scaled = np.asarray(quaternion) / np.abs(quaternion).max()
    return rpy_of(rotation_of(scaled / np.linalg.norm(scaled)))


def _joint(joint: JointRecord) -> Iterable[str]:
    yield f'<joint name="{attribute(joint.name)}" type="{joint.kind}">'
    yield f'<parent link="{attribute(joint.parent or "")}"/><child link="{attribute(joint.child or "")}"/>'
    rpy = joint.rpy if joint.quaternion is None else rpy_of_quaternion(joint.quaternion)
    yield f'<origin xyz="{numbers(joint.xyz)}" rpy="{numbers(rpy)}"/>'
    if joint.axis is not None:
        yield f'<axis xyz="{numbers(joint.axis)}"/>'
    if joint.limit is not None:
        yield _limit(joint.limit)
    if joint.mimic is not None:
        rule = joint.mimic
        multiplier, offset = f'multiplier="{rule.multiplier!r}"', f'offset="{rule.offset!r}"'
        yield f'<mimic joint="{attribute(rule.leader)}" {multiplier} {offset}/>'
    yield "</joint>"


def _limit(limit: LimitRecord) -> str:
    named = {"lower": limit.lower, "upper": limit.upper, "effort": limit.effort, "velocity": limit.velocity}
    written = [f'{name}="{value!r}"' for name, value in named.items() if value is not None]
    return f"<limit {' '.join(written)}/>"
