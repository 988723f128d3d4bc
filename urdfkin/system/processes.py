"""Python processes and imports of our own that take nothing from the current folder.

urdfkin is run in the folders of other people's robots. `python -c` and `python -m` look for modules there
first, and libraries for their settings: a file `json.py` beside a robot would be run.


Locks that a forked child finds open.

A fork copies the locks of every thread and only the thread that forks: what another one held in that moment
would stay closed in the child for ever.


Call something on a thread whose stack is large enough for it.

Pinocchio and its parser walk a robot recursively; on a usual stack of 8 MiB a chain of some 3,000 links
ends the process, on a smaller one a few hundred links do.
"""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TypeVar

#: Variables that a Python may need from the environment to start at all.
_NEEDED = ("LD_LIBRARY_PATH",)
#: Threads of linear algebra take address space, which a confined process has little of.
_GIVEN = {"OPENBLAS_NUM_THREADS": "1"}


def own_python(code: str, *, options: Sequence[str] = ()) -> list[str]:
    """The command of another interpreter: what this one can import, that one can, but from no current folder.

    Args:
        code: What it runs.
        options: Of the interpreter.
    """
    return [sys.executable, "-I", *options, "-c", f"import sys; sys.path[:] = {_path()!r}; {code}"]


def _path() -> list[str]:
    # An empty or relative entry stands for the current folder or one below it; urdfkin itself may have
    # been found through it.
    home = str(Path(__file__).resolve().parents[2])
    return [*(entry for entry in sys.path if Path(entry).is_absolute() and not _is_scratch(entry)), home]


def _is_scratch(entry: str) -> bool:
    """Whether Dask has put it on the path: it lies in the common temporary folder, where others write."""
    return any(part.startswith("dask-scratch-space") for part in Path(entry).parts)


def ask_python(command: list[str], request: bytes, patience: float, most: int) -> tuple[bytes, int | None]:
    """Give a process a request on its standard input, and an empty environment; read its output.

    Args:
        command: As from `own_python`.
        request: What it reads.
        patience: Seconds after which it is killed.
        most: Bytes of output; one more is read, and then it is killed.

    Returns:
        Its output, and its exit status; None for the status if it took too long.
    """
    environ = _GIVEN | {name: os.environ[name] for name in _NEEDED if name in os.environ}
    pipe = subprocess.PIPE
    late = threading.Event()
    with subprocess.Popen(
        command, env=environ, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL
    ) as process:

        def give_up() -> None:
            late.set()
            process.kill()

        timer = threading.Timer(patience, give_up)
        timer.start()
        try:
            assert process.stdin is not None
            assert process.stdout is not None
            with suppress(BrokenPipeError), process.stdin:
                process.stdin.write(request)
            output = process.stdout.read(most + 1)
            if len(output) > most:
                process.kill()
            status = process.wait()
        finally:
            timer.cancel()
            process.kill()
    return output, None if late.is_set() else status


@contextmanager
def not_reading(settings: str) -> Iterator[None]:
    """While open, a library that looks for a file of settings in the current folder finds none.

    Where there is one, the process is in the root folder meanwhile; otherwise nothing happens.

    Args:
        settings: The file's name.
    """
    if not os.path.lexists(settings):
        yield
        return
    here = os.open(".", os.O_PATH)
    os.chdir("/")
    try:
        yield
    finally:
        os.fchdir(here)
        os.close(here)


def lock_over_forks() -> threading.RLock:
    """A lock for a whole module: a fork waits for it, and parent and child go on with it open.

    It is registered for as long as the process lives, so that no object may have one of its own.
    """
    lock = threading.RLock()
    os.register_at_fork(before=lock.acquire, after_in_parent=lock.release, after_in_child=lock.release)
    return lock


#: Held while a module is imported that is loaded only when it is needed: a child that was forked meanwhile by
#: another thread would wait for ever for the rest of that import.
importing = lock_over_forks()


_T = TypeVar("_T")

_USUAL_STACK = 8 * 2**20
_one_at_a_time = lock_over_forks()


def with_stack(size: int, function: Callable[[], _T]) -> _T:
    """What `function()` returns or raises, called on a stack of at least `size` bytes.

    >>> with_stack(64 * 2**20, lambda: 6 * 7)
    42
    """
    future: Future[_T] = Future()

    def run() -> None:
        try:
            future.set_result(function())
        except BaseException as error:
            future.set_exception(error)

    with _one_at_a_time:  # the size is a setting of the whole process
        before = threading.stack_size(max(size, _USUAL_STACK))
        try:
            thread = threading.Thread(target=run)
            thread.start()
        finally:
            threading.stack_size(before)
    thread.join()
    return future.result()
