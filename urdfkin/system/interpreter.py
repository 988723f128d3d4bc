"""Python processes and imports of our own that take nothing from the current folder.

urdfkin is run in the folders of other people's robots. `python -c` and `python -m` look for modules there
first, and libraries for their settings: a file `json.py` beside a robot would be run.
"""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

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
