"""Chunks on processes of this machine. A process that dies costs its robot and nothing else.

One thread hands out chunks and takes answers; a worker has one chunk at a time, so that it is known over
which robot it died. That robot is tried once more, alone and after all others; in isolation, where it was
alone from the start, a death is its result at once.
"""

from __future__ import annotations

import os
import signal
import subprocess
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from typing import cast

from urdfkin.system.interpreter import own_python
from urdfkin.validation.answer import Answer, Failure
from urdfkin.validation.engine import Enter, Task, lost
from urdfkin.validation.outcome import Verdict

#: The module whose `serve` a worker runs.
WORKER = "urdfkin.validation.worker"
#: Seconds that lie at most between the end of a worker's pipe and its own.
_GRACE = 5.0


class Processes:
    """An engine of processes.

    Args:
        jobs: How many at a time.
        isolate: Whether each robot has a process of its own.
    """

    def __init__(self, jobs: int, *, isolate: bool = False) -> None:
        self._jobs, self._isolate = jobs, isolate

    def run(self, tasks: Sequence[Task], enter: Enter) -> None:
        """Run the tasks; those of a robot over which a worker died, alone and last."""
        if self._isolate:
            _Crew(tasks, self._jobs, enter, alone="the process that checked it died").work()
            return
        crew = _Crew(tasks, self._jobs, enter)
        crew.work()
        _Crew(crew.doubted, 1, enter, alone="the process that checked it died twice, then alone").work()


class _Crew:
    """Workers at work.

    Args:
        tasks: What to do.
        jobs: How many workers.
        enter: Takes the answers.
        alone: None: any worker may have any chunk. Else a worker has one robot; what is said of its death.
    """

    def __init__(self, tasks: Sequence[Task], jobs: int, enter: Enter, *, alone: str | None = None) -> None:
        self._jobs, self._enter, self._alone = jobs, enter, alone
        self._waiting = deque(_by_robot(tasks) if alone else [[task] for task in tasks])
        self._workers: list[_Worker] = []
        self._failed, self._in_doubt = set[int](), set[int]()
        #: What was not answered of the robots over which a worker died.
        self.doubted: list[Task] = []

    def work(self) -> None:
        """Until nothing waits and nobody is busy; whatever ends it ends the workers."""
        try:
            while True:
                self._hand_out()
                busy = {worker.connection: worker for worker in self._workers if worker.tasks}
                if not busy:
                    return
                for ready in wait(list(busy)):
                    self._take(busy[cast("Connection", ready)])
        finally:
            for worker in self._workers:
                worker.end()

    def _hand_out(self) -> None:
        while self._waiting:
            tasks = self._waiting[0]
            if tasks[0].robot in self._failed | self._in_doubt:
                self._withdraw(self._waiting.popleft())
                continue
            worker = next((worker for worker in self._workers if not worker.tasks), None)
            if worker is None and len(self._workers) >= self._jobs:
                return
            try:
                worker = worker or self._start()
            except Exception as error:
                if self._workers:
                    return  # there is no room for another: those that are there go on
                self._answered(tasks[0], lost("no process could be started for it", error))
                continue
            self._give(worker, self._waiting.popleft())

    def _start(self) -> _Worker:
        worker = _Worker()
        self._workers.append(worker)
        return worker

    def _give(self, worker: _Worker, tasks: list[Task]) -> None:
        worker.tasks = tasks
        try:
            worker.connection.send(tasks[0].chunk)
        except OSError:
            self._died(worker)

    def _take(self, worker: _Worker) -> None:
        task, *rest = worker.tasks
        try:
            found: Answer = worker.connection.recv()
        except (EOFError, OSError):
            self._died(worker)
            return
        except Exception as error:
            found = lost("its answer cannot be read", error)
        self._answered(task, found)
        worker.tasks = []
        if rest and task.robot not in self._failed:
            self._give(worker, rest)
        elif self._alone:
            self._workers.remove(worker)
            worker.end()

    def _answered(self, task: Task, found: Answer) -> None:
        if isinstance(found, Failure):
            self._failed.add(task.robot)
        self._enter(task, found)

    def _died(self, worker: _Worker) -> None:
        task, tasks = worker.tasks[0], worker.tasks
        self._workers.remove(worker)
        cause = worker.cause()
        if self._alone is None:
            self._in_doubt.add(task.robot)
            self._withdraw(tasks)
        else:
            where = task.chunk.subject.label
            reason = f"{where}: {self._alone}: found {cause}"
            self._answered(task, Failure(Verdict.NOT_VERIFIED, reason))

    def _withdraw(self, tasks: list[Task]) -> None:
        """What is in doubt is tried again; what has failed is over."""
        if tasks[0].robot in self._in_doubt:
            self.doubted += tasks


def _by_robot(tasks: Sequence[Task]) -> list[list[Task]]:
    robots: dict[int, list[Task]] = {}
    for task in tasks:
        robots.setdefault(task.robot, []).append(task)
    return list(robots.values())


class _Worker:
    """A process, the connection to it, and the tasks in its hands: it is at work on the first."""

    def __init__(self) -> None:
        self.tasks: list[Task] = []
        self.connection, theirs = Pipe()
        try:
            self._process = _interpreter(theirs.fileno())
        except BaseException:
            self.connection.close()
            raise
        finally:
            theirs.close()  # so that the end of the process is the end of the pipe

    def end(self) -> None:
        """End the process at once."""
        self.connection.close()
        self._process.kill()
        self._process.wait()

    def cause(self) -> str:
        """How the process ended, which is at its end: what it said is over."""
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(_GRACE)
        self.end()
        return _cause(self._process.returncode)


def _interpreter(pipe: int) -> subprocess.Popen[bytes]:
    """An interpreter that imports what this one does, but nothing from the current folder or the main module.

    It leaves an interrupt by the terminal to this process, which keeps what is there: hence its own group.
    """
    command = own_python(f"from {WORKER} import serve; serve({pipe}, {os.getpid()})")
    return subprocess.Popen(command, stdin=subprocess.DEVNULL, pass_fds=[pipe], process_group=0)


def _cause(status: int) -> str:
    """What an exit status says: a signal's name, or the number.

    >>> _cause(-11), _cause(3)
    ('signal SIGSEGV', 'exit status 3')
    """
    if status >= 0:
        return f"exit status {status}"
    try:
        name = signal.Signals(-status).name
    except ValueError:
        name = str(-status)
    return f"signal {name}" + (", as when memory runs out" if status == -signal.SIGKILL else "")
