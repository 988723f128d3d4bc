"""A worker that dies over one robot as a crash of compiled code would, as often as a file says."""

import os
import signal
from pathlib import Path

from urdfkin.validation import answer, worker_processes
from urdfkin.validation.chunk import Chunk, ChunkResult, run_chunk


def _deadly(chunk: Chunk) -> ChunkResult:
    path = Path(os.environ["URDFKIN_TEST_DEATHS"])
    if chunk.subject.label == "ur5" and (left := int(path.read_text())):
        path.write_text(str(left - 1))
        os.kill(os.getpid(), signal.SIGSEGV)
    return run_chunk(chunk)


def serve(pipe: int, parent: int) -> None:
    """As the worker's, with the crash built in."""
    setattr(answer, "run_chunk", _deadly)  # noqa: B010 - mypy does not let a foreign name be replaced
    worker_processes.serve(pipe, parent)
