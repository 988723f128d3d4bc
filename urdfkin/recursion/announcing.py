"""Know when a kernel is compiled, which takes seconds, and not found on disk, which takes none."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from numba.core import event

_Listener: Any = event.Listener  # numba has no types


class _Once(_Listener):  # type: ignore[misc]
    """Calls a function at the first compilation, and at no later one."""

    def __init__(self, tell: Callable[[], None]) -> None:
        super().__init__()
        self._tell: Callable[[], None] | None = tell

    def on_start(self, event: Any) -> None:
        tell, self._tell = self._tell, None
        if tell is not None:
            tell()

    def on_end(self, event: Any) -> None:
        pass


@contextmanager
def announced(tell: Callable[[], None]) -> Iterator[None]:
    """While open, `tell` is called once, when the first kernel begins to be compiled."""
    with event.install_listener("numba:compile", _Once(tell)):
        yield


def load_kernels() -> None:
    """Compile every kernel, or read it from disk: before processes are started that would all compile."""
    from urdfkin.recursion import (  # noqa: F401, PLC0415
        jacobian_kernel,
        jacobian_rate_kernel,
        local_kernel,
        motion_kernel,
    )
