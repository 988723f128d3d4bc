"""Compile once a machine: kernels are kept on disk, under a digest of the sources they are made from.

Numba by itself looks only at the file a kernel stands in; a change in a file it is inlined from would go
unnoticed, and an old kernel would be run. Here every source file of `recursion` enters the folder's name.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numba
from numba import types

from urdfkin.keeping import kept_folder
from urdfkin.recursion.lanes import COMPILED

#: What Numba raises of its own where a kernel does not take an argument.
NoKernelError: type[Exception] = numba.core.errors.NumbaError

_config: Any = numba.config  # settings that numba sets at run time

# Inputs may be read-only; a writable array converts without a copy. One signature, compiled once.
PLAN = types.Array(types.int64, 1, "C", readonly=True)
#: A plan bound to scratch memory, for one configuration at a time.
BOUND = types.Array(types.int64, 1, "C")
NUMBERS = types.Array(types.float64, 1, "C", readonly=True)
ROWS = types.Array(types.float64, 2, "C", readonly=True)
SCRATCH = types.Array(types.float64, 1, "C")
INT = types.int64


def output(axes: int) -> Any:
    """A kernel's output with so many axes."""
    return types.Array(types.float64, axes, "C")


class Kernel:
    """A function that is compiled, or read from disk, when it is first called."""

    def __init__(self, function: Callable[..., int], arguments: tuple[Any, ...], nogil: bool) -> None:
        self._function, self._arguments, self._nogil = function, arguments, nogil
        self._lock = threading.Lock()
        self.__doc__, self.__name__ = function.__doc__, function.__name__

    @cached_property
    def compiled(self) -> Any:
        """The compiled function itself: a call through it takes a tenth of a microsecond."""
        with self._lock:
            if (ready := self.__dict__.get("compiled")) is not None:
                return ready
            folder = cache_folder()
            with _numba_cache(folder):
                self.__dict__["compiled"] = numba.njit(
                    [types.int64(*self._arguments)],
                    nogil=self._nogil,
                    cache=folder is not None,
                    **COMPILED,
                )(self._function)
            return self.__dict__["compiled"]

    def __call__(self, *arguments: Any) -> int:
        """Compute."""
        return int(self.compiled(*arguments))


def helper(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Decorator for what kernels call; options are Numba's, beside those of every kernel."""
    decorate: Callable[[Callable[..., Any]], Any] = numba.njit(forceinline=True, **options, **COMPILED)
    return decorate


def kernel(*arguments: Any, nogil: bool = True) -> Callable[[Callable[..., int]], Kernel]:
    """Decorator: compile for these argument types when first called, keep the result on disk.

    Args:
        arguments: Numba's types.
        nogil: Whether the interpreter's lock is released meanwhile; for a microsecond it is not worth it.
    """
    return lambda function: Kernel(function, arguments, nogil)


@cache
def cache_folder() -> Path | None:
    """Where compiled kernels are kept; None if no folder can be written."""
    root = Path(_config.CACHE_DIR) if _config.CACHE_DIR else None
    return kept_folder("kernels", sorted(Path(__file__).parent.glob("*.py")), root=root)


@contextmanager
def _numba_cache(folder: Path | None) -> Iterator[None]:
    before = _config.CACHE_DIR
    if folder is not None:
        _config.CACHE_DIR = str(folder)
    try:
        yield
    finally:
        _config.CACHE_DIR = before
