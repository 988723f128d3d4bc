"""Functions that run on the machines of a cluster.

A chunk runs in a separate process, not in the process of Dask's worker.

Dask's worker imports no computing code, so a robot can only crash the separate process and not the worker. A
chunk that crashes its process is tried a second time in a new process. If the second process crashes too, the
robot's result is "not verified" with the signal as the reason. Chunks and answers are transferred as bytes.
The text of a robot is sent only once for all chunks of the robot.
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

#: Return value of a worker for a chunk. "answer": the pickled results. "died": the reason for two crashes.
#: "other code": the versions on the worker, because they differ from ours.
Found = (
    tuple[Literal["answer"], bytes]
    | tuple[Literal["died"], str]
    | tuple[Literal["other code"], dict[str, str]]
)

_idle: list[WorkerProcess] = []
_lock = threading.Lock()


def hold(robot: bytes) -> bytes:
    """Store a robot's text on a worker. If the worker is lost, Dask calls this function on another worker."""
    return robot


def computes() -> dict[str, str]:
    """Return the versions and digests of the code on this machine."""
    return provenance()


def run(robot: bytes, chunk: bytes, by: dict[str, str]) -> Found:
    """Run a chunk in a process and return its answer.

    Args:
        robot: The pickle of the chunk's robot.
        chunk: The pickle of the chunk without the robot.
        by: Versions and digests on the client. The chunk runs only if the versions and digests on this
            machine are the same.
    """
    if by != computes():
        return "other code", computes()
    cause = ""
    for child in (_idle_or_new, WorkerProcess):
        try:
            return "answer", _run_in(child(), _Parcel(robot, chunk))
        except _DiedError as crash:
            cause = str(crash)
    return "died", cause


def end_idle() -> None:
    """End the idle processes."""
    with _lock:
        while _idle:
            _idle.pop().end()


class _DiedError(Exception):
    """The process that ran a chunk crashed. The message of this exception states the cause."""


class _Parcel:
    """A robot and a chunk as bytes. Unpickling an object of this class returns the chunk."""

    def __init__(self, robot: bytes, chunk: bytes) -> None:
        self._robot, self._chunk = robot, chunk

    def __reduce__(self) -> tuple[Callable[[bytes, bytes], Chunk], tuple[bytes, bytes]]:
        return _unpickle, (self._robot, self._chunk)


def _unpickle(robot: bytes, chunk: bytes) -> Chunk:
    made: Chunk = replace(pickle.loads(chunk), subject=pickle.loads(robot))
    return made


def _idle_or_new() -> WorkerProcess:
    """Return an idle process, which may have the robot in its cache; start a process if none is idle."""
    with _lock:
        while _idle:
            child = _idle.pop()
            if child.alive:
                return child
            child.end()
    return WorkerProcess()


def _run_in(child: WorkerProcess, parcel: _Parcel) -> bytes:
    try:
        child.connection.send(parcel)
        found = child.connection.recv_bytes()
    except (EOFError, OSError):
        raise _DiedError(child.cause()) from None
    except BaseException:
        child.end()
        raise
    with _lock:
        _idle.append(child)
    return found
