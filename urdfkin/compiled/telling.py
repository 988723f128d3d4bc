"""Who is told that a kernel is compiled, which takes seconds; to read one from disk takes none."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

#: Told a kernel's name when it begins to be compiled, with None, and when it is there, with the seconds.
Listener = Callable[[str, float | None], None]


def _log(name: str, seconds: float | None) -> None:
    """Programs and notebooks: one warning a process, on standard error unless logging is set otherwise."""
    if seconds is None and not _logged:
        _logged.append(name)
        logging.getLogger("urdfkin").warning(
            "urdfkin: compiling %s once; kept from now on, 'urdfkin warm' compiles all kernels at once",
            name,
        )


_logged: list[str] = []
_listeners: list[Listener] = [_log]


@contextmanager
def listening(listener: Listener) -> Iterator[None]:
    """While open, `listener` is told, and nobody else."""
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.remove(listener)


@contextmanager
def told(name: str) -> Iterator[Callable[[], None]]:
    """Around what may compile: yields what is to be called if it does."""
    begun: list[float] = []

    def missed() -> None:
        begun.append(time.perf_counter())
        _listeners[-1](name, None)

    yield missed
    if begun:
        _listeners[-1](name, time.perf_counter() - begun[0])
