"""Engine that runs chunks in processes of this machine.

The crash of a process affects only the robot that this process validates. A worker process is a new Python
interpreter. A worker does not import the parent's main module, so a script needs no `__main__` guard. A
worker has one chunk at a time, so each crash can be attributed to a robot.

If a chunk crashes a process, the same chunk and the robot's remaining chunks run after all other robots, in a
separate process. After a second crash, the robot is reported as not verified. With `isolate`, each robot has
a separate process from the start, and is reported as not verified after the first crash.
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

from urdfkin.system.processes import python_command
from urdfkin.validation.answer import (
    CRASHED,
    CRASHED_TWICE,
    Answer,
    Failure,
    answer_chunk,
    make_crash_failure,
    make_lost_failure,
)
from urdfkin.validation.chunk import Chunk
from urdfkin.validation.engines import AnswerCallback, RobotTasks, Task, Work, WorkQueue

WORKER_MODULE = "urdfkin.validation.worker_processes"
#: Maximum time to wait for the exit status of a crashed worker, in seconds.
_EXIT_TIMEOUT = 5.0


class WorkerProcess:
    def __init__(self) -> None:
        self.connection, theirs = Pipe()
        try:
            self._process = _start_interpreter(theirs.fileno())
        except BaseException:
            self.connection.close()
            raise
        finally:
            # Close this copy of the worker's end, so that the pipe closes when the worker ends.
            theirs.close()

    @property
    def is_alive(self) -> bool:
        return self._process.poll() is None

    def kill(self) -> None:
        self._process.kill()

    def end(self) -> None:
        self.connection.close()
        self._process.kill()
        self._process.wait()

    def wait_for_cause(self) -> str:
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(_EXIT_TIMEOUT)
        self.end()
        return _signal_or_status(self._process.returncode)


def _start_interpreter(pipe: int) -> subprocess.Popen[bytes]:
    """Start a process in its own group. Ctrl-C then interrupts only the parent, which saves results."""
    command = python_command(f"from {WORKER_MODULE} import serve; serve({pipe}, {os.getpid()})")
    return subprocess.Popen(command, stdin=subprocess.DEVNULL, pass_fds=[pipe], process_group=0)


def _signal_or_status(status: int) -> str:
    """Describe a return code of `Popen`: a negative code is the number of a signal.

    >>> _signal_or_status(-11), _signal_or_status(3)
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
    """Run the chunks that the process `parent` sends over the file descriptor `pipe`."""
    _end_with(parent)
    connection, chunks = Connection(pipe), SimpleQueue[Chunk]()
    threading.Thread(target=_receive_chunks, args=(connection, chunks), daemon=True).start()
    while True:
        connection.send(answer_chunk(chunks.get()))


def _receive_chunks(connection: Connection, chunks: SimpleQueue[Chunk]) -> None:
    """Receive chunks. End this process when the pipe closes, because the parent has ended."""
    try:
        while True:
            chunks.put(connection.recv())
    except (EOFError, OSError):
        os._exit(0)


def _end_with(parent: int) -> None:
    """End this process with its parent. On Linux, this works even while compiled code hangs."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(0)


class ProcessEngine:
    """Engine with at most `jobs` local worker processes at a time."""

    def __init__(self, jobs: int, *, isolate: bool = False) -> None:
        self._jobs, self._isolate = jobs, isolate

    def run(self, work: Work, on_answer: AnswerCallback) -> None:
        if self._isolate:
            _WorkerPool(work, self._jobs, on_answer, crash_reason=CRASHED).run()
            return
        pool = _WorkerPool(work, self._jobs, on_answer)
        pool.run()
        to_retry = [sorted(tasks, key=lambda task: task.chunk.index) for tasks in pool.to_retry.values()]
        _WorkerPool(to_retry, 1, on_answer, crash_reason=CRASHED_TWICE).run()


class _WorkerPool:
    """A group of at most `jobs` worker processes.

    With `crash_reason`, each process validates one robot, and a crash is reported with this reason. Without
    `crash_reason`, a process can validate several robots.
    """

    def __init__(
        self, work: Work, jobs: int, on_answer: AnswerCallback, *, crash_reason: str | None = None
    ) -> None:
        self._jobs, self._on_answer, self._crash_reason = jobs, on_answer, crash_reason
        self._queue = WorkQueue(work, share_robots=crash_reason is None)
        self._workers: list[_PoolWorker] = []
        #: Unfinished tasks of each robot that crashed a process.
        self.to_retry: dict[int, list[Task]] = {}

    def run(self) -> None:
        try:
            while True:
                self._assign_tasks()
                busy = {w.connection: (w, w.task) for w in self._workers if w.task is not None}
                if not busy:
                    return
                for ready in wait(list(busy)):
                    self._receive(*busy[cast("Connection", ready)])
        finally:
            for worker in self._workers:
                worker.end()

    def _assign_tasks(self) -> None:
        while True:
            worker = next((worker for worker in self._workers if worker.task is None), None)
            if worker is None and len(self._workers) >= self._jobs:
                return
            if (found := self._queue.take_for_idle_worker()) is None:
                return
            task, tasks = found
            try:
                if worker is None:
                    worker = _PoolWorker()
                    self._workers.append(worker)
            except Exception as error:
                if self._workers:
                    # No new process can be started, so an existing worker process takes the task later.
                    self._queue.put_back(task, tasks)
                    return
                self._record_answer(task, make_lost_failure("no process could be started", error))
                continue
            self._send(worker, task, tasks)

    def _send(self, worker: _PoolWorker, task: Task, tasks: RobotTasks) -> None:
        worker.task, worker.tasks = task, tasks
        try:
            worker.connection.send(task.chunk)
        except OSError:
            self._handle_crash(worker, task)

    def _receive(self, worker: _PoolWorker, task: Task) -> None:
        try:
            answer: Answer = worker.connection.recv()
        except (EOFError, OSError):
            self._handle_crash(worker, task)
            return
        except Exception as error:
            answer = make_lost_failure("the answer of the worker process cannot be read", error)
        self._record_answer(task, answer)
        worker.task = None
        if (next_task := self._queue.next(worker.tasks)) is not None:
            self._send(worker, next_task, worker.tasks)
        elif self._crash_reason:
            self._workers.remove(worker)
            worker.end()

    def _record_answer(self, task: Task, answer: Answer) -> None:
        if isinstance(answer, Failure):
            self._queue.remove(task.robot)
            self.to_retry.pop(task.robot, None)
        self._on_answer(task, answer)

    def _handle_crash(self, worker: _PoolWorker, task: Task) -> None:
        self._workers.remove(worker)
        cause = worker.wait_for_cause()
        if self._crash_reason is None:
            self.to_retry.setdefault(task.robot, []).extend(
                [task, *self._queue.take_remaining_tasks(task.robot)]
            )
        else:
            self._record_answer(task, make_crash_failure(task.chunk.robot_input, self._crash_reason, cause))


class _PoolWorker(WorkerProcess):
    def __init__(self) -> None:
        super().__init__()
        self.task: Task | None = None
        self.tasks = RobotTasks(())
