"""Whoever works has a robot of their own; who has none helps where most is left; every task is dealt once."""

from __future__ import annotations

from collections.abc import Iterator

from urdfkin.urdf.sources import Origin
from urdfkin.validation.chunk import Cut
from urdfkin.validation.engines import Row, Task, WorkQueue
from urdfkin.validation.robot_input import RobotInput

CUT, NOBODY = Cut(100), RobotInput(b"", Origin(""))


def work(robots: int) -> Iterator[Iterator[Task]]:
    """Four chunks for each robot."""
    return (iter([Task(i, CUT.chunk(NOBODY, 0, k)) for k in range(4)]) for i in range(robots))


def step(deal: WorkQueue, row: Row | None) -> tuple[tuple[int, int] | None, Row | None]:
    """What somebody with a row, or without, is given; and the row that they have then."""
    if row is not None and (task := deal.next(row)) is not None:
        return (task.robot, task.chunk.index), row
    if (found := deal.first()) is None:
        return None, None
    task, row = found
    return (task.robot, task.chunk.index), row


def test_two_have_a_robot_each_and_share_the_last() -> None:
    deal, rows = WorkQueue(work(3)), list[Row | None]([None, None])
    seen = [list[tuple[int, int]](), list[tuple[int, int]]()]
    for turn in (0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1):
        given, rows[turn] = step(deal, rows[turn])
        assert given is not None
        seen[turn].append(given)
    assert {robot for robot, _ in seen[0]} == {0, 2}
    assert {robot for robot, _ in seen[1]} == {1, 2}
    assert sorted(seen[0] + seen[1]) == [(i, k) for i in range(3) for k in range(4)]
    assert deal.first() is None


def test_help_goes_to_the_robot_of_which_most_is_left() -> None:
    deal = WorkQueue(work(2))
    (_, first), (_, second) = deal.first() or ((), Row(())), deal.first() or ((), Row(()))
    for _ in range(2):
        deal.next(first)
    task, row = deal.first() or (None, None)
    assert task is not None
    assert row is second
    assert (task.robot, task.chunk.index) == (1, 1)


def test_where_each_is_alone_nobody_helps() -> None:
    deal = WorkQueue(work(1), shared=False)
    assert deal.first() is not None
    assert deal.first() is None


def test_what_is_put_back_is_dealt_again_and_what_is_withdrawn_is_not() -> None:
    for shared in (True, False):
        deal = WorkQueue(work(2), shared=shared)
        found = deal.first()
        assert found is not None
        task, row = found
        deal.put_back(task, row)
        again = deal.first()
        assert again is not None
        assert again[0] == task
        assert [left.chunk.index for left in deal.withdraw(0)] == [1, 2, 3]
        assert deal.next(row) is None
        assert [(step(deal, None)[0] or (0, 0))[0]] == [1]
