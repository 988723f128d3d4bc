"""Every quantity that a single configuration has, in every reference, by one way or another."""

from __future__ import annotations

from collections.abc import Iterator

from urdfkin import Reference
from urdfkin.compiled.prepared import PreparedFrame
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot


def by_the_robot(
    robot: Robot, frame: str, q: FloatArray, v: FloatArray, a: FloatArray
) -> Iterator[tuple[str, FloatArray]]:
    yield "placement", robot.placement(q, frame, verify=False)
    for reference in Reference:
        name = reference.name
        yield f"velocity {name}", robot.velocity(q, v, frame, reference, verify=False)
        yield f"jacobian {name}", robot.jacobian(q, frame, reference, verify=False)
        yield f"hessian {name}", robot.hessian(q, frame, reference, verify=False)
        yield f"acceleration {name}", robot.acceleration(q, v, a, frame, reference, verify=False)
        yield f"jacobian rate {name}", robot.jacobian_rate(q, v, frame, reference, verify=False)


def prepared(
    robot: Robot, frame: str, q: FloatArray, v: FloatArray, a: FloatArray
) -> Iterator[tuple[str, FloatArray]]:
    """The same of one configuration, by prepared frames, which have no Jacobian rate."""
    yield "placement", robot.prepare(frame).placement(q)
    for reference in Reference:
        name, fast = reference.name, robot.prepare(frame, reference)
        assert isinstance(fast, PreparedFrame)
        yield f"velocity {name}", fast.velocity(q, v)
        yield f"jacobian {name}", fast.jacobian(q)
        yield f"hessian {name}", fast.hessian(q)
        yield f"acceleration {name}", fast.acceleration(q, v, a)


def on_its_way_alone(
    robot: Robot, frame: str, q: FloatArray, v: FloatArray, a: FloatArray
) -> Iterator[tuple[str, FloatArray]]:
    """The same of one configuration, by the kernels for batches: a block filled with its copies."""
    for what, batch in by_the_robot(robot, frame, q[None], v[None], a[None]):
        yield what, batch[0]


def differing(one: FloatArray, other: FloatArray) -> bool:
    return one.shape != other.shape or one.tobytes() != other.tobytes()
