"""What a machine of a cluster does: hand each chunk to a process of its own, which may die over it.

Dask's own worker imports nothing that computes and never dies of a robot, so that nobody's death has to be
guessed at: what a robot kills is the process here, twice, the second time alone, and that is its answer.
Chunks and answers pass through as bytes; the text of a robot is sent once, and stays for all of its chunks.
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

#: An answer's pickle, or how the processes died that should have made it, or what computes here.
Found = (
    tuple[Literal["answer"], bytes]
    | tuple[Literal["died"], str]
    | tuple[Literal["other code"], dict[str, str]]
)

_idle: list[WorkerProcess] = []
_lock = threading.Lock()


def hold(robot: bytes) -> bytes:
    """A robot on a worker, for the chunks that need it; made again where a worker is lost."""
    return robot


def computes() -> dict[str, str]:
    """What computes here."""
    return provenance()


def run(robot: bytes, chunk: bytes, by: dict[str, str]) -> Found:
    """Have a chunk answered.

    Args:
        robot: The pickle of its robot.
        chunk: The pickle of a chunk without it.
        by: What computes where it comes from: others' numbers are not wanted.
    """
    if by != computes():
        return "other code", computes()
    cause = ""
    for child in (_any, WorkerProcess):
        try:
            return "answer", _answer(child(), _Parcel(robot, chunk))
        except _DiedError as death:
            cause = str(death)
    return "died", cause


def end_idle() -> None:
    """End the processes that wait for chunks."""
    with _lock:
        while _idle:
            _idle.pop().end()


class _DiedError(Exception):
    """The process that had a chunk; the message says how."""


class _Parcel:
    """Becomes a chunk where it is unpickled."""

    def __init__(self, robot: bytes, chunk: bytes) -> None:
        self._robot, self._chunk = robot, chunk

    def __reduce__(self) -> tuple[Callable[[bytes, bytes], Chunk], tuple[bytes, bytes]]:
        return _unpacked, (self._robot, self._chunk)


def _unpacked(robot: bytes, chunk: bytes) -> Chunk:
    made: Chunk = replace(pickle.loads(chunk), subject=pickle.loads(robot))
    return made


def _any() -> WorkerProcess:
    """A process that is there already and knows a robot, or another."""
    with _lock:
        while _idle:
            child = _idle.pop()
            if child.alive:
                return child
            child.end()
    return WorkerProcess()


def _answer(child: WorkerProcess, parcel: _Parcel) -> bytes:
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
