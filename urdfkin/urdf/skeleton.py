"""A URDF reduced to what kinematics needs, for a reader that stumbles over the rest.

Shapes, materials, inertials and extensions are left out, numbers stand as they were read, and a quaternion of
URDF 1.1 becomes roll, pitch and yaw. Nothing in the result needs a lenient reader: there is no declaration,
no comment, no entity, no namespace, and no element twice.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from urdfkin.kinematics.inputs import FloatArray
from urdfkin.kinematics.rotation.euler import rpy_of
from urdfkin.kinematics.rotation.quaternion import rotation_of
from urdfkin.urdf.records import JointRecord, LimitRecord, RobotRecord
from urdfkin.urdf.writer import attribute, numbers


def skeleton(robot: RobotRecord) -> bytes:
    """The links and joints of a URDF without errors as a plain document."""
    lines = [f'<robot name="{attribute(robot.element.attributes.get("name", ""))}">']
    lines += [f'<link name="{attribute(link)}"/>' for link in robot.links]
    for joint in robot.joints:
        lines += _joint(joint)
    lines.append("</robot>")
    return "\n".join(lines).encode()


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
