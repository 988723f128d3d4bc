"""A worker process with a fault: it hangs, or it crashes or raises an error for the robot ur5.

The environment variable URDFKIN_TEST_FAULT selects the fault: "hang", a name in `ERRORS`, or the path of a
file with the number of crashes.
"""

import os
import signal
import time
from collections.abc import Callable
from pathlib import Path

from urdfkin.validation import answer, worker_processes
from urdfkin.validation.chunk import Chunk, ChunkResult, run_chunk

FAULT, MODULE = "URDFKIN_TEST_FAULT", __name__


class UnpicklableError(Exception):
    def __reduce__(self) -> tuple[Callable[[], None], tuple[()]]:
        raise TypeError("not to be pickled")


def _deep() -> None:
    _deep()


def _pinocchio() -> None:
    import pinocchio as pin

    pin.forwardKinematics(pin.Model(), None, 1.0)


def _raise(error: BaseException) -> None:
    raise error


#: Functions that raise an error, and a part of the reason in the report.
ERRORS: dict[str, tuple[Callable[[], None], str]] = {
    "memory": (lambda: _raise(MemoryError()), "MemoryError: no message"),
    "recursion": (_deep, "RecursionError: maximum recursion depth exceeded"),
    "runtime": (lambda: _raise(RuntimeError("line\nbreak")), "RuntimeError: line break"),
    "unpicklable": (lambda: _raise(UnpicklableError("odd")), "UnpicklableError: odd"),
    "pinocchio": (_pinocchio, "ArgumentError: Python argument types in"),
}


def run_faulty(chunk: Chunk) -> ChunkResult:
    if chunk.robot_input.label == "ur5":
        fault = os.environ[FAULT]
        if fault in ERRORS:
            ERRORS[fault][0]()
        elif left := int(Path(fault).read_text()):
            Path(fault).write_text(str(left - 1))
            os.kill(os.getpid(), signal.SIGSEGV)
    return run_chunk(chunk)


def serve(pipe: int, parent: int) -> None:
    if os.environ[FAULT] == "hang":  # like compiled code, which handles no signal
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        time.sleep(600)
    setattr(answer, "run_chunk", run_faulty)  # noqa: B010  mypy refuses an assignment to a function
    worker_processes.serve(pipe, parent)
