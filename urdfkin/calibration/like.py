"""A robot that takes another model's kinematics and keeps its own frames, names and meshes.

The other model is measured like an arm on a bench, without noise: its poses at some configurations are what
the robot's origins are fitted to. What stands still in a fit stays where it was, so that lengths which cancel
in the other model (d of a hundred metres in a calibrated table) are never seen here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from urdfkin.calibration.calibrate import Calibration, fitted_model
from urdfkin.calibration.universal_robots import LINKS, calibrated_tree, read_calibration
from urdfkin.calibration.write_back import Rewritten
from urdfkin.dh.table import DHTable
from urdfkin.errors import InputError
from urdfkin.loading import load
from urdfkin.model.chain import FrameChain, chain
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.urdf.sources import Source
from urdfkin.verify.certificate import Certificate

#: Configurations that the other model is asked for.
_ASKED = 40
#: Seeds: what was fitted on some of them is held against others.
_FITTED_SEED, _HELD_SEED = 2, 3
#: Metres and radians that may be left: what a file of nine digits leaves.
_LEFT = 1e-8
#: Configurations on which two calibrations are compared.
_COMPARED = 1000


def calibrate_like(
    source: Robot | Source,
    other: Robot | Source | DHTable,
    *,
    tip: str | None = None,
    base: str | None = None,
) -> Calibration:
    """A robot that moves as another model does, between two frames.

    Args:
        source: The robot whose text is kept.
        other: The model: a robot, what `load` takes, or a table. Its path goes between the frames of the same
            names, or between its own base and tip where it has none of these names.
        tip: A link's or joint's name; the robot's tip when None.
        base: Likewise; the robot's base frame when None.

    Raises:
        InputError: the two have not as many coordinates, or no origins make one of the other.
    """
    robot = source if isinstance(source, Robot) else load(source)
    theirs = other if isinstance(other, Robot) else load(other)
    ends = tip or robot.tip_frame, base or robot.base_frame
    known = theirs.frame_names
    path = theirs.chain(*(end if end in known else None for end in ends))
    return _like(robot, path, *ends)


def _like(robot: Robot, path: FrameChain, tip: str, base: str) -> Calibration:
    own = robot.chain(tip, base).coupling
    if len(own.names) != len(path.joint_names):
        raise InputError(
            "the two models have not as many coordinates",
            where=robot.name,
            found=f"{len(own.names)} and {len(path.joint_names)}",
        )
    q = robot.sample(_ASKED, seed=_FITTED_SEED)
    values = own.select(robot.tree, q)
    if set(own.names) == set(path.joint_names):
        values = values[:, [own.names.index(name) for name in path.joint_names]]
    found = fitted_model(robot, q, path.placement(values), tip=tip, base=base, judged=False)
    left = np.abs(found.fitted.errors).max() if found.fitted is not None else 0.0
    if left > _LEFT:
        raise InputError(
            "no origins make the one model of the other",
            where=f"{robot.name}, {base} to {tip}",
            found=f"{left:.3g} m or rad are left",
            remedy="compare the joints' order, kinds and senses: urdfkin same",
        )
    return found


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
        result = _like(robot, calibrated, f"{prefix}tool0", f"{prefix}base").written
    return replace(result, certificate=_held(result, calibrated, prefix))


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
    q = written.sample(_ASKED, seed=_HELD_SEED)
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
