"""Compile once a machine: kernels are kept on disk, under a digest of the sources they are made from.

Numba by itself looks only at the file a kernel stands in; a change in a file it is inlined from would go
unnoticed, and an old kernel would be run. Here every source file of `recursion` enters the folder's name.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import numba
import platformdirs
from numba import types

from urdfkin.recursion.lanes import COMPILED

_config: Any = numba.config  # settings that numba sets at run time

# Inputs may be read-only; a writable array converts without a copy. One signature, compiled once.
WHOLE = types.Array(types.int64, 2, "C", readonly=True)
ROWS = types.Array(types.float64, 2, "C", readonly=True)
ROW = types.Array(types.float64, 1, "C", readonly=True)
SCRATCH = types.Array(types.float64, 1, "C")
INT = types.int64


def kernel(*arguments: Any) -> Callable[[Callable[..., None]], Any]:
    """Decorator: compile for these argument types, keep the result on disk, release the lock."""

    def compile_(function: Callable[..., None]) -> Any:
        folder = cache_folder()
        with _numba_cache(folder):
            return numba.njit(
                [types.void(*arguments)],
                nogil=True,
                cache=folder is not None,
                **COMPILED,
            )(function)

    return compile_


@cache
def cache_folder() -> Path | None:
    """Where compiled kernels are kept; None if no folder can be written."""
    digest = hashlib.sha256()
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.read_bytes())
    root = Path(_config.CACHE_DIR or platformdirs.user_cache_dir("urdfkin"))
    folder = root / f"kernels-{digest.hexdigest()[:16]}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / ".writable").touch()
    except OSError:
        return None
    return folder


@contextmanager
def _numba_cache(folder: Path | None) -> Iterator[None]:
    before = _config.CACHE_DIR
    if folder is not None:
        _config.CACHE_DIR = str(folder)
    try:
        yield
    finally:
        _config.CACHE_DIR = before
