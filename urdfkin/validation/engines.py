"""Who gets which chunk: whoever works has a robot of their own, which nobody else has to read.

When no robot waits, those without one help with the robot of which most is left.


Who runs the chunks: an engine takes tasks and hands their answers in, in any order, each once.

Answers are kept by robot and chunk and added up in that order, so that no figure depends on the engine. An
engine may leave out the rest of a robot that has failed, and nothing else. Tasks are made when they are asked
for: a million of them must take no memory. What is here runs in this process or on anything with the
interface of `concurrent.futures`; `urdfkin.validation.worker_processes` has processes.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from itertools import chain
from typing import Protocol

from urdfkin.validation.answer import Answer, Failure, answer
from urdfkin.validation.chunk import Chunk
from urdfkin.validation.outcome import Verdict
from urdfkin.validation.robot_input import RobotInput


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


class WorkQueue:
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


#: How many chunks an executor is given at a time: enough for any number of workers, too few to fill memory.
IN_FLIGHT = 512


@dataclass(frozen=True, slots=True)
class Task:
    """A chunk of a robot, which is known by its place in the run."""

    robot: int
    chunk: Chunk


#: What is to be done: robot by robot, the tasks of each in their order.
Work = Iterable[Iterable[Task]]
#: Takes an answer; every task is answered at most once.
Enter = Callable[[Task, Answer], None]


class Engine(Protocol):
    """Runs tasks. An exception that leaves `run` is an interrupt: what was entered stays."""

    def run(self, work: Work, enter: Enter) -> None:
        """Run the tasks and enter their answers."""


class SerialEngine:
    """One chunk after another, in this process."""

    def run(self, work: Work, enter: Enter) -> None:
        """Run the tasks in their order."""
        for tasks in work:
            for task in tasks:
                found = answer(task.chunk)
                enter(task, found)
                if isinstance(found, Failure):
                    break


class ExecutorEngine:
    """Chunks on an executor, a bounded number of them at a time."""

    def __init__(self, executor: Executor) -> None:
        self._executor = executor

    def run(self, work: Work, enter: Enter) -> None:
        """Run the tasks; what the executor itself fails at is the answer for the robot in hand."""
        waiting, failed = chain.from_iterable(work), set[int]()
        flying = deque[tuple[Task, Future[Answer]]]()
        next_task = next(waiting, None)
        try:
            while next_task is not None or flying:
                found: Answer | None
                if next_task is not None and len(flying) < IN_FLIGHT:
                    task, next_task = next_task, next(waiting, None)
                    if task.robot in failed:
                        continue
                    found = self._submit(task, flying)
                else:
                    task, future = flying.popleft()
                    found = _result(future)
                if isinstance(found, Failure):
                    failed.add(task.robot)
                if found is not None:
                    enter(task, found)
        finally:
            for _, future in flying:
                future.cancel()

    def _submit(self, task: Task, flying: deque[tuple[Task, Future[Answer]]]) -> Failure | None:
        try:
            flying.append((task, self._executor.submit(answer, task.chunk)))
        except Exception as error:
            return lost("the executor does not take it", error)
        return None


def _result(future: Future[Answer]) -> Answer:
    try:
        return future.result()
    except Exception as error:
        return lost("the executor lost it", error)


def lost(what: str, error: Exception) -> Failure:
    """The answer for a robot whose chunk could not be run, or whose answer did not come back."""
    told = " ".join(str(error).split()) or "no message"
    return Failure(Verdict.NOT_VERIFIED, f"{what}: {type(error).__name__}: {told}", passing=True)


#: What is said of a robot over which processes died.
DIED = "the process that checked it died"
DIED_TWICE = "the process that checked it died twice, then alone"


def died(subject: RobotInput, how: str, cause: str) -> Failure:
    """The answer for a robot over which processes died."""
    return Failure(Verdict.NOT_VERIFIED, f"{subject.label}: {how}: found {cause}")
