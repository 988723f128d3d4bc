"""Functions that run on the machines of a cluster.

Dask's worker computes nothing. It runs chunks in child processes, so that a robot can crash a child process,
but not the worker. If a chunk crashes a process, the worker runs the chunk again in a new process. If the new
process crashes too, the robot is not verified; the reason is the signal or exit status. Chunks and answers
are transferred as bytes. A chunk does not contain the text of the robot. The text is sent separately, so that
it is not sent again with every chunk.
"""

from __future__ import annotations

import pickle
import threading
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Literal

from urdfkin.validation.results import provenance
from urdfkin.validation.worker_processes import WorkerProcess

if TYPE_CHECKING:
    from urdfkin.validation.chunk import Chunk

#: Outcome of a chunk, and data. "answer": The data are the pickled answer. "died": The data are the signal or
#: exit status of the second crash. "other code": The data are the worker's versions and digests, which differ
#: from the client's.
ChunkOutcome = (
    tuple[Literal["answer"], bytes]
    | tuple[Literal["died"], str]
    | tuple[Literal["other code"], dict[str, str]]
)

_idle: list[WorkerProcess] = []
_running: set[WorkerProcess] = set()
_lock = threading.Lock()


def store_robot(robot: bytes) -> bytes:
    """Store a robot's text on a worker.

    If the worker is lost, Dask calls this function on another worker.
    """
    return robot


def run(robot: bytes, chunk: bytes, client_provenance: dict[str, str]) -> ChunkOutcome:
    """Run a pickled chunk in a worker process; after a crash, try a new process.

    The chunk is not run if the client has other versions or digests.
    """
    if client_provenance != provenance():
        return "other code", provenance()
    cause = ""
    for start in (_reuse_or_start, WorkerProcess):
        try:
            return "answer", _run_in(start(), _Parcel(robot, chunk))
        except _CrashError as crash:
            cause = str(crash)
    return "died", cause


def end_processes() -> None:
    """End all processes. A chunk that still runs, for example a chunk that never ends, has no answer."""
    with _lock:
        while _idle:
            _idle.pop().end()
        # The thread that waits for the answer closes the connection.
        while _running:
            _running.pop().kill()


class _CrashError(Exception):
    """A process crashed. The message is its signal or exit status."""


class _Parcel:
    """A pickled robot and a pickled chunk. The receiver unpickles one `Chunk`."""

    def __init__(self, robot: bytes, chunk: bytes) -> None:
        self._robot, self._chunk = robot, chunk

    def __reduce__(self) -> tuple[Callable[[bytes, bytes], Chunk], tuple[bytes, bytes]]:
        return _unpickle, (self._robot, self._chunk)


def _unpickle(robot: bytes, chunk: bytes) -> Chunk:
    without_robot: Chunk = pickle.loads(chunk)
    return replace(without_robot, robot_input=pickle.loads(robot))


def _reuse_or_start() -> WorkerProcess:
    """Prefer an idle process, because it may already have loaded the robot."""
    with _lock:
        while _idle:
            process = _idle.pop()
            if process.is_alive:
                return process
            process.end()
    return WorkerProcess()


def _run_in(process: WorkerProcess, parcel: _Parcel) -> bytes:
    with _lock:
        _running.add(process)
    try:
        process.connection.send(parcel)
        answer = process.connection.recv_bytes()
    except (EOFError, OSError):
        cause = process.wait_for_cause()
        if not _remove_running(process):
            raise RuntimeError("the cluster was closed") from None
        raise _CrashError(cause) from None
    except BaseException:
        _remove_running(process)
        process.end()
        raise
    if _remove_running(process):
        with _lock:
            _idle.append(process)
    else:
        process.end()
    return answer


def _remove_running(process: WorkerProcess) -> bool:
    """Return False if `end_processes` has already removed the process."""
    with _lock:
        is_running = process in _running
        _running.discard(process)
    return is_running
