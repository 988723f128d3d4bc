"""Engines that run chunks, and the queue that distributes chunks among workers.

An engine runs tasks, and passes the answer of each task to a callback. The collector sorts the answers, so no
result depends on the engine or the order of the answers. If the answer of a chunk is a `Failure`, an engine
may skip the remaining chunks of the same robot. The engine must run all other chunks. Tasks are created only
when they are needed, so a million tasks take little memory.

`WorkQueue` gives different workers chunks of different robots, so that most robots are read by one worker. If
no robot is waiting, a free worker takes a chunk of the robot whose latest chunk has the lowest index.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from itertools import chain
from typing import Protocol

from urdfkin.validation.answer import Answer, Failure, answer_chunk, make_lost_failure
from urdfkin.validation.chunk import Chunk

#: Maximum number of submitted chunks without a processed answer.
MAX_IN_FLIGHT = 512


@dataclass(frozen=True, slots=True)
class Task:
    robot: int
    chunk: Chunk


#: The tasks of each robot, in the order of its chunks.
Work = Iterable[Iterable[Task]]
#: Function that an engine calls with a task and its answer. A task has at most one answer.
AnswerCallback = Callable[[Task, Answer], None]


class Engine(Protocol):
    """Interface of an engine.

    If `Engine.run` raises an exception, `validate` runs no further task. The report contains the answers that
    the callback has received.
    """

    def run(self, work: Work, on_answer: AnswerCallback) -> None: ...


class SerialEngine:
    def run(self, work: Work, on_answer: AnswerCallback) -> None:
        for tasks in work:
            for task in tasks:
                answer = answer_chunk(task.chunk)
                on_answer(task, answer)
                if isinstance(answer, Failure):
                    break


class ExecutorEngine:
    def __init__(self, executor: Executor) -> None:
        self._executor = executor

    def run(self, work: Work, on_answer: AnswerCallback) -> None:
        all_tasks, failed_robots = chain.from_iterable(work), set[int]()
        pending = deque[tuple[Task, Future[Answer]]]()
        next_task = next(all_tasks, None)
        try:
            while next_task is not None or pending:
                answer: Answer | None
                if next_task is not None and len(pending) < MAX_IN_FLIGHT:
                    task, next_task = next_task, next(all_tasks, None)
                    if task.robot in failed_robots:
                        continue
                    answer = self._submit(task, pending)
                else:
                    task, future = pending.popleft()
                    answer = _take_answer(future)
                if isinstance(answer, Failure):
                    failed_robots.add(task.robot)
                if answer is not None:
                    on_answer(task, answer)
        finally:
            for _, future in pending:
                future.cancel()

    def _submit(self, task: Task, pending: deque[tuple[Task, Future[Answer]]]) -> Failure | None:
        try:
            pending.append((task, self._executor.submit(answer_chunk, task.chunk)))
        except Exception as error:
            return make_lost_failure("the executor did not accept the task of checking the chunk", error)
        return None


def _take_answer(future: Future[Answer]) -> Answer:
    try:
        return future.result()
    except Exception as error:
        return make_lost_failure("the executor lost the chunk", error)


class RobotTasks:
    """Iterator over a robot's tasks. `index` is the latest task's chunk, or -1 before the first task."""

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
        self._tasks = chain([task], self._tasks)


class WorkQueue:
    """Distribute tasks among workers.

    If `share_robots` is true, several workers may validate the same robot.
    """

    def __init__(self, work: Work, *, share_robots: bool = True) -> None:
        self._waiting: Iterator[RobotTasks] = map(RobotTasks, work)
        self._share_robots = share_robots
        self._started_robots: list[RobotTasks] = []
        self._removed_robots = set[int]()

    def take_for_idle_worker(self) -> tuple[Task, RobotTasks] | None:
        """Return the next task, or None. Robots that no worker has started come first."""
        for tasks in self._waiting:
            self._started_robots.append(tasks)
            if (task := self.next(tasks)) is not None:
                return task, tasks
        for tasks in (
            sorted(self._started_robots, key=lambda tasks: tasks.index) if self._share_robots else ()
        ):
            if (task := self.next(tasks)) is not None:
                return task, tasks
        return None

    def next(self, tasks: RobotTasks) -> Task | None:
        """Return the next task, or None if no task is left or the robot was removed."""
        task = next(tasks, None)
        if task is None or task.robot in self._removed_robots:
            if tasks in self._started_robots:
                self._started_robots.remove(tasks)
            return None
        return task

    def put_back(self, task: Task, tasks: RobotTasks) -> None:
        tasks.put_back(task)
        self._started_robots.remove(tasks)
        self._waiting = chain([tasks], self._waiting)

    def remove(self, robot: int) -> None:
        self._removed_robots.add(robot)

    def take_remaining_tasks(self, robot: int) -> list[Task]:
        self.remove(robot)
        return [task for tasks in self._started_robots if tasks.robot == robot for task in tasks]
