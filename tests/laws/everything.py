"""All quantities of one configuration in each reference, computed in different ways."""

from collections.abc import Iterator

from urdfkin import Reference
from urdfkin.compiled.prepared import PreparedFrame
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.verify.quantities import recursive_quantities

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
