"""Who runs the chunks: an engine takes tasks and hands their answers in, in any order, each once.

Answers are kept by robot and chunk and added up in that order, so that no figure depends on the engine. An
engine may leave out the rest of a robot that has failed, and nothing else. What is here runs in this process
or on anything with the interface of `concurrent.futures`; `urdfkin.validation.workers` has processes.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from typing import Protocol

from urdfkin.validation.answer import Answer, Failure, answer
from urdfkin.validation.chunk import Chunk
from urdfkin.validation.outcome import Verdict

#: How many chunks an executor is given at a time: enough for any number of workers, too few to fill memory.
IN_FLIGHT = 512


@dataclass(frozen=True, slots=True)
class Task:
    """A chunk of a robot, which is known by its place in the run."""

    robot: int
    chunk: Chunk


#: Takes an answer; every task is answered at most once.
Enter = Callable[[Task, Answer], None]


class Engine(Protocol):
    """Runs tasks. An exception that leaves `run` is an interrupt: what was entered stays."""

    def run(self, tasks: Sequence[Task], enter: Enter) -> None:
        """Run the tasks and enter their answers."""


class Here:
    """One chunk after another, in this process."""

    def run(self, tasks: Sequence[Task], enter: Enter) -> None:
        """Run the tasks in their order."""
        failed = set[int]()
        for task in tasks:
            if task.robot not in failed:
                found = answer(task.chunk)
                if isinstance(found, Failure):
                    failed.add(task.robot)
                enter(task, found)


class OnExecutor:
    """Chunks on an executor, a bounded number of them at a time."""

    def __init__(self, executor: Executor) -> None:
        self._executor = executor

    def run(self, tasks: Sequence[Task], enter: Enter) -> None:
        """Run the tasks; what the executor itself fails at is the answer for the robot in hand."""
        waiting, failed = deque(tasks), set[int]()
        flying = deque[tuple[Task, Future[Answer]]]()
        try:
            while waiting or flying:
                found: Answer | None
                if waiting and len(flying) < IN_FLIGHT:
                    task = waiting.popleft()
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
    return Failure(Verdict.NOT_VERIFIED, f"{what}: {type(error).__name__}: {told}")
