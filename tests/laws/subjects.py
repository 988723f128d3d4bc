"""Robots for the laws, and all quantities of a configuration, computed in different ways."""

from collections.abc import Iterator

import numpy as np
import pinocchio as pin

from tests.robots.against_pinocchio import coupling, model_of
from tests.robots.odd_urdfs import urdf_of
from tests.urdfs import loaded
from urdfkin.compiled.prepared import PreparedFrame
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.verify.quantities import recursive_quantities

#: All joint kinds, mimic joints and branches.
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


# -- all quantities of one configuration in each reference -------------------------------------------------

Results = Iterator[tuple[str, FloatArray]]


def by_the_robot(
    robot: Robot, frame: str | list[str], q: FloatArray, v: FloatArray, a: FloatArray
) -> Results:
    for row in recursive_quantities():
        for reference in row.references:
            inputs = (q, v, a)[: len(row.inputs)]
            if reference is None:
                yield row.name, getattr(robot, row.method)(*inputs, frame, verify=False)
            else:
                result = getattr(robot, row.method)(*inputs, frame, reference, verify=False)
                yield f"{row.name} {reference.name}", result


def prepared(robot: Robot, frame: str, q: FloatArray, v: FloatArray, a: FloatArray) -> Results:
    """Yield the results of prepared frames, which have no rate of the Jacobian."""
    yield "placement", robot.prepare(frame).placement(q)
    for reference in Reference:
        name, fast = reference.name, robot.prepare(frame, reference)
        assert isinstance(fast, PreparedFrame)
        yield f"velocity {name}", fast.velocity(q, v)
        yield f"jacobian {name}", fast.jacobian(q)
        yield f"hessian {name}", fast.hessian(q)
        yield f"acceleration {name}", fast.acceleration(q, v, a)


def as_a_block(robot: Robot, frame: str, q: FloatArray, v: FloatArray, a: FloatArray) -> Results:
    """Yield the results of the kernels for batches, with copies of the configuration in all lanes."""
    for what, batch in by_the_robot(robot, frame, q[None], v[None], a[None]):
        yield what, batch[0]


def differing(one: FloatArray, other: FloatArray) -> bool:
    return one.shape != other.shape or one.tobytes() != other.tobytes()
