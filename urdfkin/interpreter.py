"""Python processes and imports of our own that take nothing from the current folder.

urdfkin is run in the folders of other people's robots. `python -c`, `python -m` and the children of
multiprocessing look for modules there first, and libraries for their settings: a file `json.py` beside a
robot would be run.
"""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

#: Keeps the current folder out of the path of every Python that is started with it.
_SAFE_PATH = "PYTHONSAFEPATH"

_lock = threading.Lock()
_open = 0  # how many spawn safely just now
_before: str | None = None  # what the variable was before the first of them


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
    home = str(Path(__file__).resolve().parents[1])
    return [*(entry for entry in sys.path if Path(entry).is_absolute()), home]


@contextmanager
def safe_spawning() -> Iterator[None]:
    """While open, a Python that this process starts has no current folder on its path.

    multiprocessing starts its children by `python -c`; it leaves no other way to tell them than the
    environment, which is as before when the last one that opened this closes it.
    """
    global _open, _before  # noqa: PLW0603  one environment, many threads
    with _lock:
        if _open == 0:
            _before = os.environ.get(_SAFE_PATH)
            os.environ[_SAFE_PATH] = "1"
        _open += 1
    try:
        yield
    finally:
        with _lock:
            _open -= 1
            if _open == 0:
                _restore()


def _restore() -> None:
    if _before is None:
        os.environ.pop(_SAFE_PATH, None)
    else:
        os.environ[_SAFE_PATH] = _before


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
