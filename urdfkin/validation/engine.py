"""Who runs the chunks: an engine takes tasks and hands their answers in, in any order, each once.

Answers are kept by robot and chunk and added up in that order, so that no figure depends on the engine. An
engine may leave out the rest of a robot that has failed, and nothing else. Tasks are made when they are asked
for: a million of them must take no memory. What is here runs in this process or on anything with the
interface of `concurrent.futures`; `urdfkin.validation.workers` has processes.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from itertools import chain
from typing import Protocol

from urdfkin.validation.answer import Answer, Failure, answer
from urdfkin.validation.chunk import Chunk
from urdfkin.validation.outcome import Verdict
from urdfkin.validation.subject import Subject

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


class Here:
    """One chunk after another, in this process."""

    def run(self, work: Work, enter: Enter) -> None:
        """Run the tasks in their order."""
        for tasks in work:
            for task in tasks:
                found = answer(task.chunk)
                enter(task, found)
                if isinstance(found, Failure):
                    break


class OnExecutor:
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


def died(subject: Subject, how: str, cause: str) -> Failure:
    """The answer for a robot over which processes died."""
    return Failure(Verdict.NOT_VERIFIED, f"{subject.label}: {how}: found {cause}")
