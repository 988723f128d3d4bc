"""What a Universal Robots arm was calibrated to in the factory, from the YAML that its ROS driver writes.

The controller keeps Denavit-Hartenberg parameters: of two axes a milliradian from parallel, so that d is
hundreds of metres and the next d takes them back. `ur_calibration` draws the links in along their axes and
writes what is left as x, y, z, roll, pitch, yaw of each joint in the one before.

Two orders of turns are met there. The driver takes the angles from R = Rx(roll) Ry(pitch) Rz(yaw) (Eigen's
`eulerAngles(0, 1, 2)`), the robot description hands them to a URDF, which reads Rz(yaw) Ry(pitch) Rx(roll).
Where one angle is a quarter of a turn and another small, the two differ by the small one, 1e-5 to 1e-4 rad.
"driver" is what the robot's controller computes, "urdf" what the ROS description makes of the same file.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from urdfkin.calibration.calibrate import fitted_model
from urdfkin.calibration.write_back import Rewritten
from urdfkin.errors import InputError, UnknownNameError
from urdfkin.errors.numbers import parse_float
from urdfkin.kinematics.rotation import rotation_from_euler
from urdfkin.loading import load
from urdfkin.model.chain import FrameChain, chain
from urdfkin.model.pose import pose
from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree, build_tree
from urdfkin.robot import Robot
from urdfkin.system.files import read_text
from urdfkin.urdf.sources import Source
from urdfkin.verify.certificate import Certificate

#: The links of the file in the order of the arm, and the joint that each hangs from.
LINKS = {
    "shoulder": "shoulder_pan_joint",
    "upper_arm": "shoulder_lift_joint",
    "forearm": "elbow_joint",
    "wrist_1": "wrist_1_joint",
    "wrist_2": "wrist_2_joint",
    "wrist_3": "wrist_3_joint",
}
#: SciPy's names of the two orders; the letters of the second turn about the axes as they were.
ORDERS = {"driver": "XYZ", "urdf": "xyz"}
_SIX = ("x", "y", "z", "roll", "pitch", "yaw")
#: Configurations that the other model is asked for.
_FITTED = 40
#: Seeds: what was fitted on some of them is held against others.
_FITTED_SEED, _HELD_SEED = 2, 3
#: Metres and radians that may be left: what a file of nine digits leaves.
_LEFT = 1e-8
#: Configurations on which two calibrations are compared.
_COMPARED = 1000


def read_calibration(path: Path, order: str = "driver") -> dict[str, FloatArray]:
    """(4, 4) origins by the names of joints, without a prefix.

    Args:
        path: The driver's YAML, or a `default_kinematics.yaml` of its robot description.
        order: "driver" or "urdf": in which order the angles turn.

    Raises:
        SourceError: the file cannot be read.
        InputError: no such file; a link or a number is missing.
        UnknownNameError: another order.
    """
    if order not in ORDERS:
        raise UnknownNameError("order of turns", order, ORDERS)
    try:
        data = yaml.safe_load(read_text(path, pipes=True))
    except (yaml.YAMLError, RecursionError) as error:
        raise InputError("no YAML", where=str(path), found=" ".join(str(error).split())[:100]) from None
    kinematics = data.get("kinematics") if isinstance(data, Mapping) else None
    if not isinstance(kinematics, Mapping):
        raise InputError(
            "no calibration of a Universal Robots arm",
            where=str(path),
            remedy="the driver writes kinematics: shoulder: x: ...",
        )
    return {joint: _origin(kinematics, link, ORDERS[order], str(path)) for link, joint in LINKS.items()}


def _origin(kinematics: Mapping[Any, Any], link: str, sequence: str, where: str) -> FloatArray:
    entry = kinematics.get(link)
    if not isinstance(entry, Mapping):
        raise InputError("a link is missing", where=where, found=f"no {link}")
    six = []
    for name in _SIX:
        # YAML 1.1 takes 1e-05, which the driver writes for 0.00001, for a word; and a list of lists that are
        # one another's may be short in the file and endless when it is written out.
        value = entry.get(name)
        number = parse_float(str(value)) if isinstance(value, int | float | str) else None
        if number is None:
            found = repr(value)[:60] if isinstance(value, float | str) else type(value).__name__
            raise InputError("not a finite number", where=f"{where}, {link} {name}", found=found)
        six.append(number)
    return pose(rotation_from_euler(sequence, six[3:]), six[:3])


def calibrated_tree(origins: Mapping[str, FloatArray]) -> KinematicTree:
    """The arm of a calibration alone: `base` to `tool0`, six joints that turn about z."""
    z, rows, parent = np.array([0.0, 0.0, 1.0]), [], "base"
    for joint, T in origins.items():
        child = "tool0" if joint == "wrist_3_joint" else f"{joint}_link"
        rows.append((Joint(joint, JointKind.CONTINUOUS, 0, T, z), parent, child))
        parent = child
    return build_tree("calibration", "base", rows)


def universal_robots(robot: Robot | Source, path: Path, order: str = "driver") -> Rewritten:
    """A Universal Robots arm with the calibration that its ROS driver wrote.

    In a URDF of the ROS description, whose six joints turn about z, origins are the file's; in another one,
    such as the older description, they are those with which it moves as the calibrated arm does, from `base`
    to `tool0`.

    Args:
        robot: The arm.
        path: The driver's YAML.
        order: "driver": what the robot's controller computes; "urdf": what the ROS description makes of the
            file (`urdfkin.calibration.universal_robots`).

    Raises:
        SourceError, InputError, UnknownNameError: as `read_calibration`; the robot is no such arm.
    """
    robot = robot if isinstance(robot, Robot) else load(robot)
    origins = read_calibration(path, order)
    prefix = _prefix(robot)
    calibrated = chain(calibrated_tree(origins), "tool0", "base")
    if _is_the_descriptions(robot, prefix):
        result = Rewritten(robot, {prefix + joint: T for joint, T in origins.items()})
    else:
        result = _fit_origins(robot, calibrated, f"{prefix}tool0", f"{prefix}base")
    return replace(result, certificate=_held(result, calibrated, prefix))


def _fit_origins(robot: Robot, calibrated: FrameChain, tip: str, base: str) -> Rewritten:
    """Fit the robot's origins to the calibrated arm's poses, measured without noise."""
    own = robot.chain(tip, base).coupling
    if len(own.names) != len(calibrated.joint_names):
        raise InputError(
            "the robot's path has not as many coordinates as the calibrated arm",
            where=f"{robot.name}, {base} to {tip}",
            found=f"{len(own.names)} and {len(calibrated.joint_names)}",
            remedy="use a URDF of ur_description, with base and tool0",
        )
    q = robot.sample(_FITTED, seed=_FITTED_SEED)
    values = own.select(robot.tree, q)
    if set(own.names) == set(calibrated.joint_names):
        values = values[:, [own.names.index(name) for name in calibrated.joint_names]]
    found = fitted_model(robot, q, calibrated.placement(values), tip=tip, base=base, judged=False)
    left = np.abs(found.fitted.errors).max() if found.fitted is not None else 0.0
    if left > _LEFT:
        raise InputError(
            "no origins make the robot move like the calibrated arm",
            where=f"{robot.name}, {base} to {tip}",
            found=f"{left:.3g} m or rad are left",
            remedy="compare the joints' order, kinds and senses with a nominal arm: urdfkin same",
        )
    return found.written


def _prefix(robot: Robot) -> str:
    first = next(iter(LINKS.values()))
    prefixes = [name.removesuffix(first) for name in robot.joint_names if name.endswith(first)]
    if len(prefixes) != 1 or any(prefixes[0] + joint not in robot.joint_names for joint in LINKS.values()):
        raise InputError(
            "the robot is no Universal Robots arm",
            where=robot.name,
            found=f"joints {', '.join(robot.joint_names[:8])}",
            remedy=f"the six are {', '.join(LINKS.values())}, with one prefix",
        )
    return prefixes[0]


def _is_the_descriptions(robot: Robot, prefix: str) -> bool:
    axes = [robot.tree.joints[robot.tree.joint_index(prefix + joint)].axis for joint in LINKS.values()]
    return all(axis.tolist() == [0.0, 0.0, 1.0] for axis in axes)


def _held(result: Rewritten, calibrated: FrameChain, prefix: str) -> Certificate:
    """Hold the written text, as Pinocchio reads it, against the file's own product."""
    written = result.loaded
    q = written.sample(_FITTED, seed=_HELD_SEED)
    T = written.placement(q, [f"{prefix}base", f"{prefix}tool0"])
    values = q[:, [written.coordinate_names.index(prefix + joint) for joint in LINKS.values()]]
    away = float(np.abs(np.linalg.solve(T[:, 0], T[:, 1]) - calibrated.placement(values)).max())
    if away > _LEFT:
        raise InputError(
            "the URDF's other frames are not those of the calibration",
            where=result.robot.name,
            found=f"base to tool0 is off by {away:.3g} m or rad",
            remedy="use a URDF of ur_description, with base and tool0",
        )
    return written.certificate()


def distance(one: Mapping[str, FloatArray], other: Mapping[str, FloatArray]) -> tuple[float, float]:
    """How far (m, rad) two calibrations put the tool apart, at most on samples."""
    paths = [chain(calibrated_tree(origins), "tool0", "base") for origins in (one, other)]
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (_COMPARED, len(LINKS)))
    T, S = (path.placement(q) for path in paths)
    turn = T[:, :3, :3].swapaxes(-1, -2) @ S[:, :3, :3]
    angle = np.linalg.norm(turn - np.eye(3), axis=(-2, -1)) / np.sqrt(2.0)
    return float(np.linalg.norm(T[:, :3, 3] - S[:, :3, 3], axis=1).max()), float(angle.max())
