"""A worker that raises over one robot what nobody foresaw: the error is named in the environment."""

import os
from collections.abc import Callable

from urdfkin.validation import answer, worker_processes
from urdfkin.validation.chunk import Chunk, ChunkResult, run_chunk


class UnpicklableError(Exception):
    """An error that does not survive the way between processes."""

    def __reduce__(self) -> tuple[Callable[[], None], tuple[()]]:
        raise TypeError("not to be pickled")


def _deep() -> None:
    _deep()


def _pinocchio() -> None:
    import pinocchio as pin

    pin.forwardKinematics(pin.Model(), None, 1.0)


def _raise(error: BaseException) -> None:
    raise error


#: What is raised, and what its robot's reason says of it.
ERRORS: dict[str, Callable[[], None]] = {
    "memory": lambda: _raise(MemoryError()),
    "recursion": _deep,
    "runtime": lambda: _raise(RuntimeError("line\nbreak")),
    "unpicklable": lambda: _raise(UnpicklableError("odd")),
    "pinocchio": _pinocchio,
}
WORDS = {
    "memory": "MemoryError: no message",
    "recursion": "RecursionError: maximum recursion depth exceeded",
    "runtime": "RuntimeError: line break",
    "unpicklable": "UnpicklableError: odd",
    "pinocchio": "ArgumentError: Python argument types in",
}


def raising(chunk: Chunk) -> ChunkResult:
    """As `run_chunk`, but for one robot."""
    if chunk.subject.label == "ur5":
        ERRORS[os.environ["URDFKIN_TEST_ERROR"]]()
    return run_chunk(chunk)


def serve(pipe: int, parent: int) -> None:
    """As the worker's, with the error built in."""
    setattr(answer, "run_chunk", raising)  # noqa: B010 - mypy does not let a foreign name be replaced
    worker_processes.serve(pipe, parent)
