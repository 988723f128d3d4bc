"""Who gets which chunk: whoever works has a robot of their own, which nobody else has to read.

When no robot waits, those without one help with the robot of which most is left.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain

from urdfkin.validation.engine import Task, Work


class Row:
    """The tasks of a robot that are still to be handed out.

    Attributes:
        robot: Whose; -1 before the first was handed out.
        index: The chunk that was handed out last; the lower, the more are left.
    """

    def __init__(self, tasks: Iterable[Task]) -> None:
        self.robot = self.index = -1
        self._tasks = iter(tasks)

    def __iter__(self) -> Iterator[Task]:
        return self

    def __next__(self) -> Task:
        task = next(self._tasks)
        self.robot, self.index = task.robot, task.chunk.index
        return task

    def put_back(self, task: Task) -> None:
        """Have it come next."""
        self._tasks = chain([task], self._tasks)


class Deal:
    """Hands out work.

    Args:
        work: What is to be done.
        shared: Whether a robot may be worked on by several.
    """

    def __init__(self, work: Work, *, shared: bool = True) -> None:
        self._waiting: Iterator[Row] = map(Row, work)
        self._shared = shared
        self._begun: list[Row] = []
        self._over = set[int]()

    def first(self) -> tuple[Task, Row] | None:
        """A task for somebody without a robot, and the row it is from; None: there is nothing left to do."""
        for row in self._waiting:
            self._begun.append(row)
            if (task := self.next(row)) is not None:
                return task, row
        for row in sorted(self._begun, key=lambda row: row.index) if self._shared else ():
            if (task := self.next(row)) is not None:
                return task, row
        return None

    def next(self, row: Row) -> Task | None:
        """The next task of a robot."""
        task = next(row, None)
        if task is None or task.robot in self._over:
            if row in self._begun:
                self._begun.remove(row)
            return None
        return task

    def put_back(self, task: Task, row: Row) -> None:
        """Hand out a row's task again, to somebody without a robot."""
        row.put_back(task)
        self._begun.remove(row)
        self._waiting = chain([row], self._waiting)

    def end(self, robot: int) -> None:
        """Hand out no more of a robot."""
        self._over.add(robot)

    def withdraw(self, robot: int) -> list[Task]:
        """Hand out no more of a robot; what there would have been."""
        self.end(robot)
        return [task for row in self._begun if row.robot == robot for task in row]
