"""Engine that runs chunks in processes of this machine; the crash of a process affects only its robot.

A worker is a new Python interpreter that imports neither the parent's main module nor modules of the current
folder, so a script needs no `__main__` guard. A worker has one chunk at a time, so a crash can be attributed
to a robot. This robot is tried once more, alone in a process, after all other robots. With `isolate`, each
robot runs alone from the start, so the first crash of a robot is reported as its result.
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
from urdfkin.validation.engines import DIED, DIED_TWICE, Enter, RobotTasks, Task, Work, WorkQueue, died, lost

#: Module with the function `serve`, which a process runs.
WORKER = "urdfkin.validation.worker_processes"
#: Maximum time (seconds) between the end of a worker's pipe and the end of its process.
_GRACE = 5.0


class WorkerProcess:
    """A worker process and the connection to it, which carries chunks and answers."""

    def __init__(self) -> None:
        self.connection, theirs = Pipe()
        try:
            self._process = _interpreter(theirs.fileno())
        except BaseException:
            self.connection.close()
            raise
        finally:
            theirs.close()  # the pipe closes when the worker ends, because only the worker has this end

    @property
    def alive(self) -> bool:
        return self._process.poll() is None

    def end(self) -> None:
        self.connection.close()
        self._process.kill()
        self._process.wait()

    def cause(self) -> str:
        """Wait until the process has ended, and return the cause."""
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(_GRACE)
        self.end()
        return _cause(self._process.returncode)


def _interpreter(pipe: int) -> subprocess.Popen[bytes]:
    """Start a Python interpreter that imports the same packages as this process.

    The new interpreter imports neither modules from the current folder nor this process's main module. It has
    its own process group. Ctrl-C in the terminal therefore interrupts only the parent process, which then
    saves the finished results.
    """
    command = own_python(f"from {WORKER} import serve; serve({pipe}, {os.getpid()})")
    return subprocess.Popen(command, stdin=subprocess.DEVNULL, pass_fds=[pipe], process_group=0)


def _cause(status: int) -> str:
    """Return an exit status as text: the name of a signal, or the status as a number.

    >>> _cause(-11), _cause(3)
    ('signal SIGSEGV', 'exit status 3')
    """
    if status >= 0:
        return f"exit status {status}"
    try:
        name = signal.Signals(-status).name
    except ValueError:
        name = str(-status)
    return f"signal {name}" + (", for example because memory ran out" if status == -signal.SIGKILL else "")


_PR_SET_PDEATHSIG = 1


def serve(pipe: int, parent: int) -> None:
    """Answer chunks from a connection (its descriptor is `pipe`) to a parent process, until the pipe ends."""
    _end_with(parent)
    connection, chunks = Connection(pipe), SimpleQueue[Chunk]()
    threading.Thread(target=_receive, args=(connection, chunks), daemon=True).start()
    while True:
        connection.send(answer(chunks.get()))


def _receive(connection: Connection, chunks: SimpleQueue[Chunk]) -> None:
    """Receive the next chunks while an earlier chunk is computed.

    If the parent ends, the connection breaks, and this process ends at once.
    """
    try:
        while True:
            chunks.put(connection.recv())
    except (EOFError, OSError):
        os._exit(0)


def _end_with(parent: int) -> None:
    """End this process when its parent ends; on Linux the kernel ends it, even if compiled code hangs."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(0)


class ProcessEngine:
    """Engine of at most `jobs` local processes at a time; if `isolate`, each robot has its own process."""

    def __init__(self, jobs: int, *, isolate: bool = False) -> None:
        self._jobs, self._isolate = jobs, isolate

    def run(self, work: Work, enter: Enter) -> None:
        """Run the tasks. If a robot crashed a worker, its remaining tasks run last and alone."""
        if self._isolate:
            _Crew(work, self._jobs, enter, alone=DIED).work()
            return
        crew = _Crew(work, self._jobs, enter)
        crew.work()
        to_retry = [sorted(tasks, key=lambda task: task.chunk.index) for tasks in crew.to_retry.values()]
        _Crew(to_retry, 1, enter, alone=DIED_TWICE).work()


class _Crew:
    """A group of at most `jobs` worker processes.

    If `alone` is None, several workers may share a robot. Otherwise, each worker validates only one robot,
    and `alone` is the reason in the report if the worker crashes.
    """

    def __init__(self, work: Work, jobs: int, enter: Enter, *, alone: str | None = None) -> None:
        self._jobs, self._enter, self._alone = jobs, enter, alone
        self._queue = WorkQueue(work, shared=alone is None)
        self._workers: list[_WorkerProcess] = []
        #: Unanswered tasks of each robot that crashed a worker.
        self.to_retry: dict[int, list[Task]] = {}

    def work(self) -> None:
        """Run until no task is left. The worker processes always end, even after an exception."""
        try:
            while True:
                self._assign_tasks()
                busy = {w.connection: (w, w.task) for w in self._workers if w.task is not None}
                if not busy:
                    return
                for ready in wait(list(busy)):
                    self._take(*busy[cast("Connection", ready)])
        finally:
            for worker in self._workers:
                worker.end()

    def _assign_tasks(self) -> None:
        while True:
            worker = next((worker for worker in self._workers if worker.task is None), None)
            if worker is None and len(self._workers) >= self._jobs:
                return
            if (found := self._queue.first()) is None:
                return
            task, row = found
            try:
                worker = worker or self._start()
            except Exception as error:
                if self._workers:  # a new process cannot be started, so the running ones continue
                    self._queue.put_back(task, row)
                    return
                self._enter_answer(task, lost("no process could be started", error))
                continue
            self._give(worker, task, row)

    def _start(self) -> _WorkerProcess:
        worker = _WorkerProcess()
        self._workers.append(worker)
        return worker

    def _give(self, worker: _WorkerProcess, task: Task, row: RobotTasks) -> None:
        worker.task, worker.row = task, row
        try:
            worker.connection.send(task.chunk)
        except OSError:
            self._handle_crash(worker, task)

    def _take(self, worker: _WorkerProcess, task: Task) -> None:
        try:
            found: Answer = worker.connection.recv()
        except (EOFError, OSError):
            self._handle_crash(worker, task)
            return
        except Exception as error:
            found = lost("the answer of the worker process cannot be read", error)
        self._enter_answer(task, found)
        worker.task = None
        if (next_task := self._queue.next(worker.row)) is not None:
            self._give(worker, next_task, worker.row)
        elif self._alone:
            self._workers.remove(worker)
            worker.end()

    def _enter_answer(self, task: Task, found: Answer) -> None:
        if isinstance(found, Failure):
            self._queue.end(task.robot)
            self.to_retry.pop(task.robot, None)
        self._enter(task, found)

    def _handle_crash(self, worker: _WorkerProcess, task: Task) -> None:
        """Schedule the tasks of the worker's robot for a second try, or report the crash."""
        self._workers.remove(worker)
        cause = worker.cause()
        if self._alone is None:
            self.to_retry.setdefault(task.robot, []).extend([task, *self._queue.withdraw(task.robot)])
        else:
            self._enter_answer(task, died(task.chunk.subject, self._alone, cause))


class _WorkerProcess(WorkerProcess):
    """A worker process, its current task, and the remaining tasks of the robot that it works on."""

    def __init__(self) -> None:
        super().__init__()
        self.task: Task | None = None
        self.row = RobotTasks(())
