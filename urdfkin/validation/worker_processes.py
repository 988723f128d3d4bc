"""A process of ours that answers chunks, and how it ended. It imports no more than that takes.

A machine of a cluster has it imported beside its own work: what computes is imported in the process alone.


A worker: a process that answers one chunk after another, and ends with its parent, however that ends.

It is an interpreter of its own that runs nothing but this: not the parent's main module, so that a script
needs no guard, and nothing from the current folder.


Chunks on processes of this machine. A process that dies costs its robot and nothing else.

One thread hands out chunks and takes answers; a worker has a robot of its own while there are any, and one
chunk at a time, so that it is known over which robot it died. That robot is tried once more, alone and after
all others; in isolation, where it was alone from the start, a death is its result at once.
"""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
import threading
from contextlib import suppress
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from queue import SimpleQueue
from typing import cast

from urdfkin.system.processes import own_python
from urdfkin.validation.answer import Answer, Failure, answer
from urdfkin.validation.chunk import Chunk
from urdfkin.validation.engines import DIED, DIED_TWICE, Enter, Row, Task, Work, WorkQueue, died, lost

#: The module whose `serve` a process runs.
WORKER = "urdfkin.validation.worker_processes"
#: Seconds that lie at most between the end of a worker's pipe and its own.
_GRACE = 5.0


class WorkerProcess:
    """A process, and the connection to it: chunks go in, answers come out."""

    def __init__(self) -> None:
        self.connection, theirs = Pipe()
        try:
            self._process = _interpreter(theirs.fileno())
        except BaseException:
            self.connection.close()
            raise
        finally:
            theirs.close()  # so that the end of the process is the end of the pipe

    @property
    def alive(self) -> bool:
        """Whether it has not ended by itself."""
        return self._process.poll() is None

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


_PR_SET_PDEATHSIG = 1


def serve(pipe: int, parent: int) -> None:
    """Answer chunks until the pipe ends.

    Args:
        pipe: Descriptor of the connection to the parent.
        parent: Its process.
    """
    _end_with(parent)
    connection, chunks = Connection(pipe), SimpleQueue[Chunk]()
    threading.Thread(target=_receive, args=(connection, chunks), daemon=True).start()
    while True:
        connection.send(answer(chunks.get()))


def _receive(connection: Connection, chunks: SimpleQueue[Chunk]) -> None:
    """Take chunks while another is computed, so that the end of the parent is noticed at once."""
    try:
        while True:
            chunks.put(connection.recv())
    except (EOFError, OSError):
        os._exit(0)


def _end_with(parent: int) -> None:
    """Have the kernel end this process with its parent, where it can: even compiled code that hangs."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(0)


class ProcessEngine:
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
        self._deal = WorkQueue(work, shared=alone is None)
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


class _Worker(WorkerProcess):
    """A process, the task that it is at work on, and the robot that this is of."""

    def __init__(self) -> None:
        super().__init__()
        self.task: Task | None = None
        self.row = Row(())
