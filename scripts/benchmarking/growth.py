"""How cost grows: with the joints of a chain, with the frames of a robot, with the size of a batch."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from scripts.benchmarking.chains import TIP, chain_urdf
from scripts.benchmarking.clock import Row, Table, measure
from scripts.benchmarking.contenders.pinocchio_loop import pinocchio_calls
from scripts.benchmarking.contenders.urdfkin_batch import FLOOR, ONE, batches
from scripts.benchmarking.subject import QUANTITIES, Subject
from scripts.benchmarking.work import Work, agree
from urdfkin.tree import FloatArray

ONE_PASS, ONE_BY_ONE = "urdfkin, all in one pass", "urdfkin, one after the other"


def joint_rows(joints: Sequence[int], numbers: int, rounds: int) -> Iterator[Row]:
    """Chains of `joints` joints, the tip's Jacobian and acceleration, one thread.

    Batches are cut so that each writes `numbers` numbers of Jacobian: memory is as far away for everyone.
    """
    for size in joints:
        with Subject(
            chain_urdf(size), TIP, max(numbers // (6 * size), 16), name=f"chain of {size}"
        ) as subject:
            for quantity in QUANTITIES:
                works = [work for work in batches(subject, quantity) if work.who in (ONE, FLOOR)]
                pinocchio = pinocchio_calls(subject.urdf, TIP, quantity).batch(subject, quantity)
                works.append(pinocchio)
                agree(works, pinocchio, f"{subject.name}, {quantity}")
                table = Table("joints", subject.name, quantity, subject.numbers(quantity), size)
                yield from measure(table, works, rounds, pinocchio)


def frame_rows(subject: Subject, counts: Sequence[int], rounds: int) -> Iterator[Row]:
    """Placements of several links, spread over the robot: in one pass, and one call for each."""
    links = subject.robot.link_names
    for count in sorted({min(count, len(links)) for count in counts}):
        frames = [f"link:{links[i]}" for i in np.linspace(0, len(links) - 1, count).astype(int)]
        works = _frame_works(subject, frames)
        agree(works, works[1], f"{subject.name}, {count} placements")
        table = Table("frames", subject.name, "placement", 16 * count, count)
        yield from measure(table, works, rounds, works[1])


def _frame_works(subject: Subject, frames: Sequence[str]) -> list[Work]:
    robot, q, n = subject.robot, subject.q, subject.n
    out, every = np.empty((len(frames), n, 4, 4)), np.empty((n, len(frames), 4, 4))

    def together() -> FloatArray:
        return robot.placements(q, frames, out=every, threads=1, verify=False)

    def apart() -> None:
        for k, frame in enumerate(frames):
            robot.placement(q, frame, out=out[k], threads=1, verify=False)

    return [Work(ONE_PASS, n, together, together), Work(ONE_BY_ONE, n, apart, lambda: out.swapaxes(0, 1))]


def size_rows(source: tuple[str, str], sizes: Sequence[int], rounds: int) -> Iterator[Row]:
    """One robot, batches of `sizes` configurations, one thread, `out=` given."""
    for size in sizes:
        with Subject(*source, size) as subject:
            for quantity in QUANTITIES:
                works = [work for work in batches(subject, quantity) if work.who in (ONE, FLOOR)]
                pinocchio = pinocchio_calls(subject.urdf, subject.frame, quantity).batch(subject, quantity)
                agree(works, pinocchio, f"{subject.name}, {size} at a time, {quantity}")
                table = Table("sizes", subject.name, quantity, subject.numbers(quantity), size)
                yield from measure(table, works, rounds)
