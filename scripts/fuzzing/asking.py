"""Compute every quantity of a robot in each reference frame, single and in batches, on any base.

urdfkin compares each call with Pinocchio. This module checks that the results of different calls have the
same bits, because all calls use the same forward recursion. The module also checks that every name of a frame
is accepted.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from urdfkin import BaseMotion, Reference
from urdfkin.errors import InputError, RepresentationSingularityError, UnknownNameError
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot

#: Largest numbers of frames for which quantities are computed in one pass, and one by one.
TOGETHER, ALONE = 12, 2
#: Number of frame names that are looked up for each robot.
NAMES = 6
#: Distance of the far base from the world's origin, in metres.
FAR = 1e6


class MismatchError(Exception):
    """Error if two computations of the same number return different results."""


def ask(robot: Robot, seed: int) -> Iterator[tuple[str, FloatArray]]:
    """Yield the name and the result of each checked computation.

    Raises:
        MismatchError: two computations differ.
        UrdfkinError: a call raises an error. Errors about singular representations and about paths without a
            table are expected and not raised.
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
    """Compare the unchecked results of a prepared frame with the results of checked calls.

    Raises:
        MismatchError: a result of the prepared frame differs.
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
    """Return a rotated, moving base at a distance of `size` metres."""
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
    """Yield each quantity, computed in three ways.

    The three ways are all frames in a batch of configurations, one frame in the same batch, and a single
    configuration of the batch.
    """
    results = dict[str, FloatArray]()
    if reference is Reference.LOCAL_WORLD_ALIGNED:
        results["placement"] = robot.placement(q, frames, base=base)
    results["velocity"] = robot.velocity(q, v, frames, reference, base=base)
    results["jacobian"] = robot.jacobian(q, frames, reference, base=base)
    results["hessian"] = robot.hessian(q, frames, reference, base=base)
    results["acceleration"] = robot.acceleration(q, v, a, frames, reference, base=base)
    yield from results.items()
    inputs: dict[str, tuple[FloatArray, ...]] = {
        "placement": (q,),
        "velocity": (q, v),
        "jacobian": (q,),
        "hessian": (q,),
        "acceleration": (q, v, a),
    }
    for frame in alone:
        for name, every in results.items():
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
    """Yield placements of frames that are given by name.

    urdfkin and Pinocchio look up each name independently.
    """
    links, joints = set(robot.link_names), {joint.name for joint in robot.tree.joints}
    own = sorted(links | joints)
    asked = [f"{prefix}{name}" for name in own for prefix in ("", "link:", "joint:")]
    for i in generator.permutation(len(asked))[:NAMES]:
        try:
            yield f"placement of {asked[i]!r}", robot.placement(q, asked[i])
        except UnknownNameError:  # for example `joint:x`, if x is only a link
            if asked[i] in own:
                raise
        except InputError:  # two frames have this name
            if asked[i] not in links & joints:
                raise


def _tables(robot: Robot, frames: list[str]) -> Iterator[tuple[str, FloatArray]]:
    """Yield Denavit-Hartenberg tables of paths from the root without planar and floating joints."""
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
