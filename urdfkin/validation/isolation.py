"""Chunks of one robot in a child process, whose death is a result and not the end of the run.

Pinocchio is compiled code that was never meant for hostile input: a robot can make it crash or take all
memory. In a child process that costs that robot's result and nothing else.
"""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Iterator, Sequence
from multiprocessing.connection import Connection

from urdfkin.errors import UrdfkinError
from urdfkin.interpreter import safe_spawning
from urdfkin.validation.chunk import Chunk, ChunkResult, run_chunk


class DiedError(UrdfkinError):
    """The process that checked a robot died, or gave no answer in time."""


def run_isolated(chunks: Sequence[Chunk], patience: float | None = None) -> Iterator[ChunkResult]:
    """The results of one robot's chunks, computed by a child process.

    Args:
        chunks: All of one robot.
        patience: Seconds to wait for each; None waits as long as it takes.

    Raises:
        DiedError: the process ended without an answer, or took too long.
        UrdfkinError: what a chunk raised.
    """
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe(duplex=False)
    child = context.Process(target=_child, args=(theirs, list(chunks)), daemon=True)
    with safe_spawning():
        child.start()
    theirs.close()  # so that the end of the child is the end of the pipe
    try:
        for chunk in chunks:
            answer = _receive(ours, child, chunk, patience)
            if isinstance(answer, UrdfkinError):
                raise answer
            yield answer
    finally:
        ours.close()
        if child.is_alive():
            child.kill()
        child.join()
        child.close()


def _receive(
    pipe: Connection, child: multiprocessing.process.BaseProcess, chunk: Chunk, patience: float | None
) -> ChunkResult | UrdfkinError:
    where = chunk.subject.label
    try:
        if not pipe.poll(patience):
            raise DiedError("the check was given up", where=where, found=f"no answer in {patience:g} s")
        answer: ChunkResult | UrdfkinError = pipe.recv()
    except EOFError:
        child.join()
        raise DiedError(
            "the process that checked it died", where=where, found=_cause(child.exitcode)
        ) from None
    return answer


def _cause(status: int | None) -> str:
    """What an exit status says: a signal's name, or the number.

    >>> _cause(-11), _cause(3)
    ('signal SIGSEGV', 'exit status 3')
    """
    if status is not None and status < 0:
        try:
            return f"signal {signal.Signals(-status).name}"
        except ValueError:
            return f"signal {-status}"
    return f"exit status {status}"


def _serve(pipe: Connection, chunks: Sequence[Chunk]) -> None:
    """The child's side: one answer for each chunk, up to the first error."""
    for chunk in chunks:
        try:
            pipe.send(run_chunk(chunk))
        except UrdfkinError as error:
            pipe.send(error)
            return


#: What the child runs.
_child = _serve
