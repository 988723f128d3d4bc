"""Real and generated robots for the laws, with all joint kinds, mimic joints and branches."""

import numpy as np
import pinocchio as pin

from tests.robots.against_pinocchio import coupling, model_of
from tests.robots.odd_urdfs import urdf_of
from tests.urdfs import loaded
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot

EPS = np.finfo(np.float64).eps

NAMES = (
    "panda", "a1", "floating_root", "planar_and_floating_in_the_middle", "mimic_hand_40_sliding", "tree_3",
    "tree_8",
)  # fmt: skip


def robot_of(name: str, *, mimic: bool | None = None, root_joint: str | None = None) -> Robot:
    source = name if name in ("panda", "a1") else urdf_of(name)
    return loaded(source, verify=False, mimic=mimic, root_joint=root_joint)


def state(robot: Robot, n: int, seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    v, a = np.random.default_rng(seed).standard_normal((2, n, robot.nv))
    return robot.sample(n, seed), v, a


def moved(robot: Robot, q: FloatArray, v: FloatArray, times: FloatArray) -> FloatArray:
    """Return (times, nq): `q` after a motion with the joint velocities v, by Pinocchio's `integrate`."""
    model = model_of(robot)
    full, v_full = robot.to_pinocchio(q), coupling(robot, model) @ v
    rows = np.array([pin.integrate(model, full, float(t) * v_full) for t in times])
    return robot.from_pinocchio(rows.reshape(len(times), model.nq))


def rotation_vector(R: FloatArray) -> FloatArray:
    """Return the rotation vectors (n, 3) of small rotations (n, 3, 3)."""
    skew = (R - R.swapaxes(-1, -2)) / 2.0
    axis = np.stack((skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]), axis=-1)
    sine = np.linalg.norm(axis, axis=-1, keepdims=True)
    factor: FloatArray = np.where(sine > 0.0, np.arcsin(sine) / np.where(sine > 0.0, sine, 1.0), 1.0)
    return axis * factor
