"""Engines that run chunks, and the queue that distributes chunks among workers.

An engine runs tasks and passes each answer to a callback once, in any order. The collector sorts the answers,
so no result depends on the engine. If a robot has failed, an engine may skip the remaining chunks of this
robot, but no others. Tasks are created only when they are needed, so a million tasks take no memory.

Each worker gets its own robot, so that only one worker has to read this robot. If no robot is waiting, a free
worker takes chunks of the robot with the most chunks left.
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
from urdfkin.validation.outcome import ValidationVerdict
from urdfkin.validation.robot_input import RobotInput


class RobotTasks:
    """The remaining tasks of a robot.

    Attributes:
        robot: Index of the robot; -1 before the first task was taken.
        index: Index of the latest chunk that was taken. The lower this index, the more chunks of the robot
            remain.
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
        """Put a task back, so that it is the robot's next task."""
        self._tasks = chain([task], self._tasks)


class WorkQueue:
    """Distribute tasks among workers; if `shared`, several workers may work on the same robot."""

    def __init__(self, work: Work, *, shared: bool = True) -> None:
        self._waiting: Iterator[RobotTasks] = map(RobotTasks, work)
        self._shared = shared
        self._begun: list[RobotTasks] = []
        self._ended = set[int]()

    def first(self) -> tuple[Task, RobotTasks] | None:
        """Return a task for an idle worker, preferably of a new robot, and the robot's other tasks."""
        for row in self._waiting:
            self._begun.append(row)
            if (task := self.next(row)) is not None:
                return task, row
        for row in sorted(self._begun, key=lambda row: row.index) if self._shared else ():
            if (task := self.next(row)) is not None:
                return task, row
        return None

    def next(self, row: RobotTasks) -> Task | None:
        """Return the next task of a robot; None if no task is left, or if the robot was removed."""
        task = next(row, None)
        if task is None or task.robot in self._ended:
            if row in self._begun:
                self._begun.remove(row)
            return None
        return task

    def put_back(self, task: Task, row: RobotTasks) -> None:
        """Put a task back into its robot's remaining tasks, so that another worker can run it."""
        row.put_back(task)
        self._begun.remove(row)
        self._waiting = chain([row], self._waiting)

    def end(self, robot: int) -> None:
        """Remove a robot from the queue."""
        self._ended.add(robot)

    def withdraw(self, robot: int) -> list[Task]:
        """Remove a robot from the queue, and return its remaining tasks."""
        self.end(robot)
        return [task for row in self._begun if row.robot == robot for task in row]


#: Maximum number of chunks in an executor's queue.
#: This number is enough for many workers, and small enough to save memory.
IN_FLIGHT = 512


@dataclass(frozen=True, slots=True)
class Task:
    robot: int
    chunk: Chunk


#: The tasks of each robot, in the order of its chunks.
Work = Iterable[Iterable[Task]]
#: Callback that receives the answer of a task, at most once for each task.
Enter = Callable[[Task, Answer], None]


class Engine(Protocol):
    """Interface of an engine; an exception from `run` ends the validation.

    Answers that were passed to the callback before the exception stay in the report.
    """

    def run(self, work: Work, enter: Enter) -> None:
        """Run the tasks and pass each answer to `enter`."""


class SerialEngine:
    def run(self, work: Work, enter: Enter) -> None:
        for tasks in work:
            for task in tasks:
                found = answer(task.chunk)
                enter(task, found)
                if isinstance(found, Failure):
                    break


class ExecutorEngine:
    """Engine that runs chunks on an executor. The number of chunks in the executor's queue is bounded."""

    def __init__(self, executor: Executor) -> None:
        self._executor = executor

    def run(self, work: Work, enter: Enter) -> None:
        """Run the tasks. If the executor raises an error, the error becomes the result of the robot."""
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
            return lost("the executor did not accept the chunk", error)
        return None


def _result(future: Future[Answer]) -> Answer:
    try:
        return future.result()
    except Exception as error:
        return lost("the executor lost the chunk", error)


def lost(what: str, error: Exception) -> Failure:
    message = " ".join(str(error).split()) or "no message"
    return Failure(ValidationVerdict.NOT_VERIFIED, f"{what}: {type(error).__name__}: {message}", passing=True)


#: Reasons in the report for a robot that crashed its process.
DIED = "the process that validated the robot crashed"
DIED_TWICE = "the process that validated the robot crashed twice; the second process computed nothing else"


def died(subject: RobotInput, how: str, cause: str) -> Failure:
    return Failure(ValidationVerdict.NOT_VERIFIED, f"{subject.label}: {how}: found {cause}")
