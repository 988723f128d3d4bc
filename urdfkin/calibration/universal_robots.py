"""Apply the factory calibration of a Universal Robots arm, from the YAML file of its ROS driver.

The controller stores Denavit-Hartenberg parameters. The angle between two nominally parallel axes of the arm
is about a milliradian, so their common normal is far away. The parameters d of consecutive rows can therefore
be hundreds of metres, and cancel each other. The driver's program `ur_calibration` shifts the link frames
along their axes, so that all offsets become small. The program writes the pose of each joint in the frame of
the previous joint: x, y, z, roll, pitch and yaw.

The order of the rotations is ambiguous:

    driver               R = Rx(roll) Ry(pitch) Rz(yaw)      Eigen's `eulerAngles(0, 1, 2)`
    ROS description      R = Rz(yaw) Ry(pitch) Rx(roll)      angles copied into a URDF

    example: the angles are a quarter turn, a small angle (1e-5 to 1e-4 rad), and 0
    difference of the two products: about 1.4 times the small angle

With the order "driver", the result agrees with the robot's controller. With the order "urdf", the result
agrees with the URDF that the ROS package generates from the file.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from urdfkin.calibration.calibrate import fit_model
from urdfkin.calibration.write_back import UpdatedURDF
from urdfkin.errors import InputError, UnknownNameError
from urdfkin.errors.numbers import parse_float
from urdfkin.kinematics.rotation import rotation_from_euler
from urdfkin.model.chain import FrameChain, make_chain
from urdfkin.model.configuration import sample_uniform
from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree, build_tree, pose
from urdfkin.robot import Robot
from urdfkin.robot.loading import as_robot
from urdfkin.system.files import read_text
from urdfkin.urdf.sources import Source
from urdfkin.verify.certificate import Certificate

#: Parent joint of each link in the calibration file, from base to tip.
PARENT_JOINTS = {
    "shoulder": "shoulder_pan_joint",
    "upper_arm": "shoulder_lift_joint",
    "forearm": "elbow_joint",
    "wrist_1": "wrist_1_joint",
    "wrist_2": "wrist_2_joint",
    "wrist_3": "wrist_3_joint",
}
#: Order of the rotations by roll, pitch and yaw, in SciPy's notation. Uppercase letters mean moving axes, and
#: lowercase letters mean fixed axes.
ROTATION_ORDERS = {"driver": "XYZ", "urdf": "xyz"}
_ORIGIN_KEYS = ("x", "y", "z", "roll", "pitch", "yaw")
#: Number of random configurations for the fit of the joint origins, and for the check of the new URDF.
_FIT_SAMPLES = 40
_FIT_SEED, _CHECK_SEED = 2, 3
#: Largest residual of the fit, and largest difference of the new URDF's poses (m and rad). If the joint
#: origins can represent the calibrated arm, the residual is a rounding error of about 1e-15.
_MAX_RESIDUAL = 1e-8
_DISPLACEMENT_SAMPLES = 1000


class _UniqueKeyLoader(yaml.SafeLoader):  # type: ignore[misc]
    """Load YAML without repeated keys; PyYAML itself silently uses the last value."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen = set[str]()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode) and key.value in seen:
                where = f"{key.start_mark.name}:{key.start_mark.line + 1}"
                raise InputError("the calibration file contains a key twice", where=where, found=key.value)
            seen.add(str(key.value))
        return dict(super().construct_mapping(node, deep))


def read_calibrated_origins(path: Path, order: str = "driver") -> dict[str, FloatArray]:
    """Return joint origins (4, 4) by joint name, from a calibration file or a `default_kinematics.yaml`."""
    if order not in ROTATION_ORDERS:
        raise UnknownNameError("order of rotations", order, ROTATION_ORDERS)
    try:
        loader = _UniqueKeyLoader(read_text(path, pipes=True))
        loader.name = str(path)
        data = loader.get_single_data()
    except (yaml.YAMLError, RecursionError) as error:
        raise InputError(
            "this is not a YAML file", where=str(path), found=" ".join(str(error).split())[:100]
        ) from None
    kinematics = data.get("kinematics") if isinstance(data, Mapping) else None
    if not isinstance(kinematics, Mapping):
        raise InputError(
            "this file is not a calibration of a Universal Robots arm",
            where=str(path),
            remedy="use the calibration file of the driver, which begins with kinematics: shoulder: x: ...",
        )
    return {
        joint: _parse_origin(kinematics, link, ROTATION_ORDERS[order], str(path))
        for link, joint in PARENT_JOINTS.items()
    }


def _parse_origin(kinematics: Mapping[Any, Any], link: str, rotation_order: str, where: str) -> FloatArray:
    entry = kinematics.get(link)
    if not isinstance(entry, Mapping):
        raise InputError("the calibration file lacks a link", where=where, found=f"no {link}")
    six = []
    for name in _ORIGIN_KEYS:
        # The driver writes 0.00001 as 1e-05, which YAML 1.1 reads as a string. The message names only the
        # type of a list, because a list with YAML references can be very long.
        value = entry.get(name)
        number = parse_float(str(value)) if isinstance(value, int | float | str) else None
        if number is None:
            found = repr(value)[:60] if isinstance(value, float | str) else type(value).__name__
            raise InputError("this is not a finite number", where=f"{where}, {link} {name}", found=found)
        six.append(number)
    return pose(rotation_from_euler(rotation_order, six[3:]), six[:3])


def make_calibrated_tree(origins: Mapping[str, FloatArray]) -> KinematicTree:
    z, rows, parent = np.array([0.0, 0.0, 1.0]), [], "base"
    for joint, T in origins.items():
        child = "tool0" if joint == "wrist_3_joint" else f"{joint}_link"
        rows.append((Joint(joint, JointKind.CONTINUOUS, 0, T, z), parent, child))
        parent = child
    return build_tree("calibration", "base", rows)


def apply_factory_calibration(robot: Robot | Source, path: Path, order: str = "driver") -> UpdatedURDF:
    """Apply a calibration file to the URDF of a Universal Robots arm.

    If all joints turn about z, the joint origins are copied from the file. If a joint of the URDF has another
    axis, the origins are fitted to the calibrated arm's poses of `tool0` in `base`.
    """
    robot = as_robot(robot)
    origins = read_calibrated_origins(path, order)
    prefix = _prefix(robot)
    calibrated = make_chain(make_calibrated_tree(origins), "tool0", "base")
    if _all_turn_about_z(robot, prefix):
        result = UpdatedURDF(robot, {prefix + joint: T for joint, T in origins.items()})
    else:
        result = _fit_origins(robot, calibrated, f"{prefix}tool0", f"{prefix}base")
    return replace(result, certificate=_verify_written(result, calibrated, prefix))


def _fit_origins(robot: Robot, calibrated: FrameChain, tip: str, base: str) -> UpdatedURDF:
    own = robot.chain(tip, base).coupling
    if len(own.names) != len(calibrated.joint_names):
        raise InputError(
            "the robot's path and the calibrated arm have different numbers of coordinates",
            where=f"{robot.name}, {base} to {tip}",
            found=f"{len(own.names)} and {len(calibrated.joint_names)}",
            remedy="use a URDF of ur_description, which has the frames base and tool0",
        )
    q = robot.sample(_FIT_SAMPLES, seed=_FIT_SEED)
    values = own.select(robot.tree, q)
    if set(own.names) == set(calibrated.joint_names):
        values = values[:, [own.names.index(name) for name in calibrated.joint_names]]
    found = fit_model(robot, q, calibrated.placement(values), tip=tip, base=base, check=False)
    residual = np.abs(found.full_fit.residuals).max() if found.full_fit is not None else 0.0
    if residual > _MAX_RESIDUAL:
        raise InputError(
            "no choice of joint origins makes the robot move like the calibrated arm",
            where=f"{robot.name}, {base} to {tip}",
            found=f"a residual of {residual:.3g} m or rad",
            remedy="compare with the URDF of an uncalibrated arm of this type: urdfkin same A.urdf B.urdf",
        )
    return found.updated_urdf


def _prefix(robot: Robot) -> str:
    first = next(iter(PARENT_JOINTS.values()))
    prefixes = [name.removesuffix(first) for name in robot.joint_names if name.endswith(first)]
    if len(prefixes) != 1 or any(
        prefixes[0] + joint not in robot.joint_names for joint in PARENT_JOINTS.values()
    ):
        raise InputError(
            "the robot is not a Universal Robots arm",
            where=robot.name,
            found=f"joints {', '.join(robot.joint_names[:8])}",
            remedy=f"its joints must be {', '.join(PARENT_JOINTS.values())}, with one common prefix",
        )
    return prefixes[0]


def _all_turn_about_z(robot: Robot, prefix: str) -> bool:
    axes = [
        robot.tree.joints[robot.tree.joint_index(prefix + joint)].axis for joint in PARENT_JOINTS.values()
    ]
    return all(axis.tolist() == [0.0, 0.0, 1.0] for axis in axes)


def _verify_written(result: UpdatedURDF, calibrated: FrameChain, prefix: str) -> Certificate:
    """Compare `tool0` poses of the new URDF with poses computed from the calibration file."""
    written = result.new_robot
    q = written.sample(_FIT_SAMPLES, seed=_CHECK_SEED)
    T = written.placement(q, [f"{prefix}base", f"{prefix}tool0"])
    values = q[:, [written.coordinate_names.index(prefix + joint) for joint in PARENT_JOINTS.values()]]
    error = float(np.abs(np.linalg.solve(T[:, 0], T[:, 1]) - calibrated.placement(values)).max())
    if error > _MAX_RESIDUAL:
        raise InputError(
            "the URDF's frames base and tool0 differ from those of the calibration",
            where=result.robot.name,
            found=f"the pose of tool0 in base is off by {error:.3g} m or rad",
            remedy="use a URDF of ur_description, which has the frames base and tool0",
        )
    return written.certificate()


def largest_tip_displacement(
    first_origins: Mapping[str, FloatArray], second_origins: Mapping[str, FloatArray]
) -> tuple[float, float]:
    """Return the largest distance (m) and angle (rad) between the `tool0` frames of two arms.

    The configurations are random samples. Instead of the angle, 2 sin(angle / 2) is returned, which is
    accurate only for small angles.
    """
    paths = [
        make_chain(make_calibrated_tree(origins), "tool0", "base")
        for origins in (first_origins, second_origins)
    ]
    q = sample_uniform([(-np.pi, np.pi)] * len(PARENT_JOINTS), _DISPLACEMENT_SAMPLES)
    T, S = (path.placement(q) for path in paths)
    turn = T[:, :3, :3].swapaxes(-1, -2) @ S[:, :3, :3]
    angle = np.linalg.norm(turn - np.eye(3), axis=(-2, -1)) / np.sqrt(2.0)
    return float(np.linalg.norm(T[:, :3, 3] - S[:, :3, 3], axis=1).max()), float(angle.max())
