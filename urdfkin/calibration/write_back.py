"""Write new joint origins into a URDF; all other bytes stay the same."""

from __future__ import annotations

import codecs
import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from urdfkin.comparison.diff import Changes, diff
from urdfkin.errors import InputError
from urdfkin.kinematics.rotation import log_rotation, quaternion_of, rpy_of
from urdfkin.kinematics.roundings import ANGLE_ROUNDINGS, EPS
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.robot.loading import load
from urdfkin.system.files import Edit, apply_edits
from urdfkin.urdf.findings import Reporter, Severity
from urdfkin.urdf.lint.runner import read_urdf
from urdfkin.urdf.records import JointRecord, Vector
from urdfkin.urdf.writer import format_numbers, make_attribute_edits, make_insertion_before_element
from urdfkin.verify.certificate import Certificate

#: Written metres and radians have 15 decimals, the precision of a double near 1.
_DECIMALS = 15
_ROUNDING = 10.0**-_DECIMALS


def with_origins(data: bytes, origins: Mapping[str, FloatArray]) -> bytes:
    """Write new joint origins into a URDF.

    A number in the attribute xyz or rpy keeps its digits if it changes only by rounding.

    Args:
        data: The original URDF.
        origins: The new origin (4, 4) of each changed joint, by joint name.
    """
    report = Reporter("<text>", data)
    urdf = read_urdf(report, mimic=False)  # Mimic rules do not affect origins.
    if urdf is None or report.has_errors:
        errors = [one for one in report.findings() if one.severity is Severity.ERROR]
        raise InputError("a URDF with errors is not edited", found=str(errors[0]))
    mark = codecs.BOM_UTF8 if data.startswith(codecs.BOM_UTF8) else b""
    edits = list[Edit]()
    for name, T in origins.items():
        if (joint := urdf.joints_by_name.get(name)) is None:
            raise InputError("the URDF has no such joint", found=repr(name))
        edits += _edits(report.data, joint, T)
    return mark + apply_edits(report.data, edits)


def _edits(data: bytes, joint: JointRecord, T: FloatArray) -> list[Edit]:
    values = {"xyz": _three_numbers(joint, "xyz", T[:3, 3], joint.xyz)}
    if joint.quaternion is None:
        values["rpy"] = _three_numbers(joint, "rpy", nearest_rpy(T[:3, :3], joint.rpy), joint.rpy)
    else:
        quaternion = quaternion_of(T[:3, :3])
        sign = math.copysign(1.0, float(quaternion @ np.asarray(joint.quaternion)))
        values["quat_xyzw"] = format_numbers((sign * quaternion).round(_DECIMALS))
    if joint.origin_element is not None:
        return list(make_attribute_edits(data, joint.origin_element, values))
    written = " ".join(f'{name}="{value}"' for name, value in values.items())
    # A valid <joint> element contains <parent> and <child>.
    return [make_insertion_before_element(data, joint.element.children[0], f"<origin {written}/>")]


def _three_numbers(joint: JointRecord, name: str, new: FloatArray, old: Vector) -> str:
    """Format three numbers; a number that is equal to `old` up to rounding keeps its digits."""
    origin = joint.origin_element
    words = (origin.attributes.get(name, "") if origin is not None else "").split() or ["0"] * 3
    return " ".join(
        word
        if abs(x - was) <= max(_ROUNDING, ANGLE_ROUNDINGS * EPS * abs(was))
        else format_numbers([round(x, _DECIMALS)])
        for word, x, was in zip(words, new.tolist(), old, strict=True)
    )


def nearest_rpy(R: FloatArray, old: Vector) -> FloatArray:
    """Return the roll, pitch and yaw (3,) of a rotation that are nearest to the angles `old`.

    >>> from urdfkin.kinematics.rotation import rotation_from_rpy
    >>> nearest_rpy(rotation_from_rpy([3.1, 3.0, 3.1]), (3.1, 3.0, 3.1)).round(12).tolist()
    [3.1, 3.0, 3.1]
    """
    roll, pitch, yaw = rpy_of(R).tolist()
    # At pitch ±90 degrees, roll and yaw turn about the same axis, so roll can keep its old value.
    if math.cos(pitch) <= ANGLE_ROUNDINGS * EPS:
        roll, yaw = old[0], yaw + (old[0] - roll) * math.copysign(1.0, pitch)
    turns = ([roll, pitch, yaw], [roll + math.pi, math.pi - pitch, yaw + math.pi])
    wrapped = [
        [x + 2.0 * math.pi * round((was - x) / (2.0 * math.pi)) for x, was in zip(rpy, old, strict=True)]
        for rpy in turns
    ]
    return np.array(min(wrapped, key=lambda rpy: sum(abs(x - was) for x, was in zip(rpy, old, strict=True))))


@dataclass(frozen=True, eq=False)
class UpdatedURDF:
    """A URDF with new joint origins.

    Attributes:
        robot: The robot before the change.
        origins: The new origin (4, 4) of each changed joint, by joint name.
        certificate: Result of Pinocchio's check of the new URDF; None if not checked.
    """

    robot: Robot
    origins: Mapping[str, FloatArray]
    certificate: Certificate | None = None

    @cached_property
    def text(self) -> bytes:
        return with_origins(self.robot.urdf.encode(), self.origins)

    @cached_property
    def new_robot(self) -> Robot:
        mimic = self.robot.verifier.mimic
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # The first load gave these warnings.
            lock = dict(self.robot.origin.lock)
            return load(self.text, mimic=mimic, root_joint=self.robot.root_joint, lock=lock)

    @cached_property
    def changes(self) -> Changes:
        return diff(self.robot, self.new_robot)

    @cached_property
    def displacements(self) -> dict[str, tuple[float, float]]:
        """The distance (m) and the angle (rad) between the old and the new origin, by joint name."""
        tree = self.robot.tree
        old = {name: tree.joints[tree.joint_index(name)].original.T_parent_joint for name in self.origins}
        return {
            name: (
                float(np.linalg.norm(T[:3, 3] - old[name][:3, 3])),
                float(np.linalg.norm(log_rotation(old[name][:3, :3].T @ T[:3, :3]))),
            )
            for name, T in self.origins.items()
        }
