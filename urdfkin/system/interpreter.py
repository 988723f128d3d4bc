"""Python processes and imports of our own that take nothing from the current folder.

urdfkin is run in the folders of other people's robots. `python -c` and `python -m` look for modules there
first, and libraries for their settings: a file `json.py` beside a robot would be run.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path


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
