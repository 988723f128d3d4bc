"""Chunks on processes of this machine. A process that dies costs its robot and nothing else.

One thread hands out chunks and takes answers; a worker has a robot of its own while there are any, and one
chunk at a time, so that it is known over which robot it died. That robot is tried once more, alone and after
all others; in isolation, where it was alone from the start, a death is its result at once.
"""

from __future__ import annotations

from multiprocessing.connection import Connection, wait
from typing import cast

from urdfkin.validation.answer import Answer, Failure
from urdfkin.validation.child import Child
from urdfkin.validation.dealing import Deal, Row
from urdfkin.validation.engine import DIED, DIED_TWICE, Enter, Task, Work, died, lost


class Processes:
    """An engine of processes.

    Args:
        jobs: How many at a time.
        isolate: Whether each robot has a process of its own.
    """

    def __init__(self, jobs: int, *, isolate: bool = False) -> None:
        self._jobs, self._isolate = jobs, isolate

    def run(self, work: Work, enter: Enter) -> None:
        """Run the tasks; those of a robot over which a worker died, alone and last."""
        if self._isolate:
            _Crew(work, self._jobs, enter, alone=DIED).work()
            return
        crew = _Crew(work, self._jobs, enter)
        crew.work()
        doubted = [sorted(tasks, key=lambda task: task.chunk.index) for tasks in crew.doubted.values()]
        _Crew(doubted, 1, enter, alone=DIED_TWICE).work()


class _Crew:
    """Workers at work.

    Args:
        work: What to do.
        jobs: How many workers.
        enter: Takes the answers.
        alone: None: workers help each other. Else a worker has one robot; what is said of its death.
    """

    def __init__(self, work: Work, jobs: int, enter: Enter, *, alone: str | None = None) -> None:
        self._jobs, self._enter, self._alone = jobs, enter, alone
        self._deal = Deal(work, shared=alone is None)
        self._workers: list[_Worker] = []
        #: What was not answered of each robot over which a worker died.
        self.doubted: dict[int, list[Task]] = {}

    def work(self) -> None:
        """Until nothing waits and nobody is busy; whatever ends it ends the workers."""
        try:
            while True:
                self._hand_out()
                busy = {w.connection: (w, w.task) for w in self._workers if w.task is not None}
                if not busy:
                    return
                for ready in wait(list(busy)):
                    self._take(*busy[cast("Connection", ready)])
        finally:
            for worker in self._workers:
                worker.end()

    def _hand_out(self) -> None:
        while True:
            worker = next((worker for worker in self._workers if worker.task is None), None)
            if worker is None and len(self._workers) >= self._jobs:
                return
            if (found := self._deal.first()) is None:
                return
            task, row = found
            try:
                worker = worker or self._start()
            except Exception as error:
                if self._workers:  # there is no room for another: those that are there go on
                    self._deal.put_back(task, row)
                    return
                self._answered(task, lost("no process could be started for it", error))
                continue
            self._give(worker, task, row)

    def _start(self) -> _Worker:
        worker = _Worker()
        self._workers.append(worker)
        return worker

    def _give(self, worker: _Worker, task: Task, row: Row) -> None:
        worker.task, worker.row = task, row
        try:
            worker.connection.send(task.chunk)
        except OSError:
            self._died(worker, task)

    def _take(self, worker: _Worker, task: Task) -> None:
        try:
            found: Answer = worker.connection.recv()
        except (EOFError, OSError):
            self._died(worker, task)
            return
        except Exception as error:
            found = lost("its answer cannot be read", error)
        self._answered(task, found)
        worker.task = None
        if (follower := self._deal.next(worker.row)) is not None:
            self._give(worker, follower, worker.row)
        elif self._alone:
            self._workers.remove(worker)
            worker.end()

    def _answered(self, task: Task, found: Answer) -> None:
        if isinstance(found, Failure):
            self._deal.end(task.robot)
            self.doubted.pop(task.robot, None)
        self._enter(task, found)

    def _died(self, worker: _Worker, task: Task) -> None:
        """What is in doubt is tried again later."""
        self._workers.remove(worker)
        cause = worker.cause()
        if self._alone is None:
            self.doubted.setdefault(task.robot, []).extend([task, *self._deal.withdraw(task.robot)])
        else:
            self._answered(task, died(task.chunk.subject, self._alone, cause))


class _Worker(Child):
    """A process, the task that it is at work on, and the robot that this is of."""

    def __init__(self) -> None:
        super().__init__()
        self.task: Task | None = None
        self.row = Row(())
