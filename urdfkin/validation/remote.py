"""Functions that run on the machines of a cluster.

Dask's worker imports no computing code. A chunk runs in a separate process, so a robot can only crash this
process and not the worker. A chunk that crashes its process is tried a second time in a new process. If the
second process crashes too, the robot's result is "not verified" with the signal as the reason. Chunks and
answers are transferred as bytes. The text of a robot is sent only once for all chunks of the robot.
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

#: Return value of a worker for a chunk.
#: "answer" comes with the pickled results, and "died" with the reason for two crashes.
#: "other code" comes with the worker's versions, because they differ from the client's.
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
    return provenance()


def run(robot: bytes, chunk: bytes, by: dict[str, str]) -> Found:
    """Run a chunk in a process and return its answer.

    `robot` and `chunk` are pickles; the chunk is pickled without its robot. The chunk runs only if the
    client's versions and digests (`by`) are those of this machine.
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
    with _lock:
        while _idle:
            _idle.pop().end()


class _DiedError(Exception):
    """The process that ran a chunk crashed; the message states the cause."""


class _Parcel:
    """A robot and a chunk as bytes; unpickling a parcel returns the chunk."""

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
