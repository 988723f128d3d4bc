"""Everything that a robot can be asked: each quantity in each reference, alone and in batches, on any base.

Each call is held against Pinocchio by urdfkin itself. Here it is seen that the calls agree with one another
to the last bit, since they are one walk, and that a name that means a frame is answered.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from urdfkin import BaseMotion, Reference
from urdfkin.errors import InputError, RepresentationSingularityError, UnknownNameError
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot

#: Frames of one robot that are asked about together, and one by one.
TOGETHER, ALONE = 12, 2
#: Names that are looked up.
NAMES = 6
#: How far away the second base is, metres.
FAR = 1e6


class MismatchError(Exception):
    """Two ways to the same number hand out different ones."""


def ask(robot: Robot, seed: int) -> Iterator[tuple[str, FloatArray]]:
    """Each way to be handed numbers that are checked, and the numbers.

    Raises:
        MismatchError: two ways of them differ.
        UrdfkinError: what a call raises; singular representations and paths without a table are passed over.
    """
    generator = np.random.default_rng(seed)
    q, v, a = _inputs(robot, seed)
    frames = robot.all_frames
    if len(frames) > TOGETHER:
        frames = tuple(frames[i] for i in sorted(generator.choice(len(frames), TOGETHER, replace=False)))
    alone = [frames[i] for i in sorted({len(frames) - 1, int(generator.integers(len(frames)))})][:ALONE]
    yield from _names(robot, q[0], generator)
    for base in (None, _base(generator, 1.0), _base(generator, FAR)):
        for reference in Reference:
            yield from _together(robot, frames, alone, reference, base, q, v, a)
        for frame in alone:
            for representation in ("ZYZ", "xyz", "quaternion"):
                try:
                    J = robot.analytical_jacobian(q, frame, representation, base=base)
                except RepresentationSingularityError:
                    continue
                yield f"analytical_jacobian {representation}", J
    yield from _tables(robot, alone)


def ask_prepared(robot: Robot, seed: int) -> None:
    """A prepared frame's numbers, which nobody checks, are those of the checked calls.

    Raises:
        MismatchError: they are not.
    """
    inputs = [x[0] for x in _inputs(robot, seed)]
    frame = robot.all_frames[-1]
    for reference in Reference:
        fast, words = robot.prepare(frame, reference), (frame, reference)
        for name, count in (("placement", 1), ("velocity", 2), ("jacobian", 1), ("acceleration", 3)):
            checked: Callable[..., FloatArray] = getattr(robot, name)
            ours = getattr(fast, name)(*inputs[:count])
            theirs = checked(*inputs[:count], *(words[:1] if name == "placement" else words))
            _same(f"{name} of {frame!r} prepared and not", ours, theirs)


def _inputs(robot: Robot, seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    v, a = np.random.default_rng([seed, 1]).normal(size=(2, 2, robot.nv))
    return robot.sample(2, seed), v, a


def _base(generator: np.random.Generator, size: float) -> BaseMotion:
    """A base that is turned, moves, and stands so many metres away."""
    R = np.linalg.qr(generator.normal(size=(3, 3)))[0]
    T = np.eye(4)
    T[:3, :3] = R * np.linalg.det(R)
    T[:3, 3] = size * generator.normal(size=3)
    return BaseMotion(T, *generator.normal(size=(2, 6)))


def _together(
    robot: Robot,
    frames: tuple[str, ...],
    alone: list[str],
    reference: Reference,
    base: BaseMotion | None,
    q: FloatArray,
    v: FloatArray,
    a: FloatArray,
) -> Iterator[tuple[str, FloatArray]]:
    """Each quantity of all frames in a batch, of one frame in that batch, and of one configuration."""
    kept = dict[str, FloatArray]()
    if reference is Reference.LOCAL_WORLD_ALIGNED:
        kept["placement"] = robot.placement(q, frames, base=base)
    kept["velocity"] = robot.velocity(q, v, frames, reference, base=base)
    kept["jacobian"] = robot.jacobian(q, frames, reference, base=base)
    kept["hessian"] = robot.hessian(q, frames, reference, base=base)
    kept["acceleration"] = robot.acceleration(q, v, a, frames, reference, base=base)
    yield from kept.items()
    inputs: dict[str, tuple[FloatArray, ...]] = {
        "placement": (q,),
        "velocity": (q, v),
        "jacobian": (q,),
        "hessian": (q,),
        "acceleration": (q, v, a),
    }
    for frame in alone:
        for name, every in kept.items():
            compute: Callable[..., FloatArray] = getattr(robot, name)
            words = () if name == "placement" else (reference,)
            batch = compute(*inputs[name], frame, *words, base=base)
            single = compute(*(x[1] for x in inputs[name]), frame, *words, base=base)
            _same(f"{name} of several frames and of {frame!r}", every[:, frames.index(frame)], batch)
            _same(f"{name} of {frame!r} in a batch and alone", batch[1], single)
        rate = robot.jacobian_rate(q, v, frame, reference, base=base)
        _same(
            f"jacobian_rate of {frame!r}",
            rate[0],
            robot.jacobian_rate(q[0], v[0], frame, reference, base=base),
        )
        yield "jacobian_rate", rate
        yield (
            "acceleration_breakdown",
            robot.acceleration_breakdown(q, v, a, frame, reference, base=base).total,
        )


def _names(robot: Robot, q: FloatArray, generator: np.random.Generator) -> Iterator[tuple[str, FloatArray]]:
    """What a name stands for is looked up by urdfkin and by Pinocchio, each by itself."""
    links, joints = set(robot.link_names), {joint.name for joint in robot.tree.joints}
    own = sorted(links | joints)
    asked = [f"{prefix}{name}" for name in own for prefix in ("", "link:", "joint:")]
    for i in generator.permutation(len(asked))[:NAMES]:
        try:
            yield f"placement of {asked[i]!r}", robot.placement(q, asked[i])
        except UnknownNameError:  # `joint:NAME` where NAME is a link's alone
            if asked[i] in own:
                raise
        except InputError:  # of two frames of one name neither comes first
            if asked[i] not in links & joints:
                raise


def _tables(robot: Robot, frames: list[str]) -> Iterator[tuple[str, FloatArray]]:
    """Denavit-Hartenberg tables from the root, where no planar or floating joint is in the way."""
    for frame in frames:
        tree = robot.tree
        if any(tree.joints[i].nq > 1 for i in tree.path(tree.frame_link(frame))):
            continue
        for convention in ("standard", "modified"):
            table = robot.dh(frame, tree.link_frames[0], convention)
            yield f"{convention} table", table.placement(robot.select(table, robot.neutral()))


def _same(what: str, x: FloatArray, y: FloatArray) -> None:
    if x.tobytes() != y.tobytes() and not np.array_equal(x, y, equal_nan=True):
        raise MismatchError(f"{what}: off by {np.abs(x - y).max():.3g}")
