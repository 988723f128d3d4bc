"""The folder of compiled kernels, and events of their compilation, without importing Numba.

Compiling takes seconds, reading from disk almost no time. Listeners are informed of each compilation that
this process waits for.
"""

from __future__ import annotations

import logging
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

from urdfkin.kinematics import equations
from urdfkin.system.lazy_import import installed_version
from urdfkin.system.locks import importing, lock_over_forks

#: Held while Numba is imported, and while a kernel is compiled. A fork waits for both, because the child
#: process could not finish them. A fork takes the newest lock first; this one is newer than the lock of
#: `logging` that the import of Numba takes, and exists before that import begins.
compiling = lock_over_forks()

#: Called with a kernel's name and None when its compilation begins, and with the seconds when it is ready.
Listener = Callable[[str, float | None], None]


def _log(name: str, seconds: float | None) -> None:
    """Log one warning in each process, which goes to standard error by default."""
    if seconds is None and not _logged:
        _logged.append(name)
        logging.getLogger("urdfkin").warning(
            "urdfkin: compiling %s once, then cached on disk; 'urdfkin warm' compiles all kernels at once",
            name,
        )


_logged: list[str] = []
_listeners: list[Listener] = [_log]


@contextmanager
def listen_to_compile_events(listener: Listener) -> Iterator[None]:
    """Send compile events to `listener` only, while the context is open."""
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.remove(listener)


@contextmanager
def compile_event(name: str) -> Iterator[Callable[[], None]]:
    """Report a compilation. The context yields a function that must be called if a compilation begins."""
    begun: list[float] = []

    def missed() -> None:
        begun.append(time.perf_counter())
        _listeners[-1](name, None)

    yield missed
    if begun:
        _listeners[-1](name, time.perf_counter() - begun[0])


@cache
def cache_folder() -> Path | None:
    """Return the cache folder of compiled kernels; None if no folder is writable."""
    with importing:
        from urdfkin.system.cache import kept_folder  # noqa: PLC0415  not needed to interpret

    numba = sys.modules.get("numba")
    chosen = numba.config.CACHE_DIR if numba else os.environ.get("NUMBA_CACHE_DIR")
    python = sys.implementation.cache_tag + sys.abiflags
    versions = installed_version("numba") or "", installed_version("llvmlite") or "", python
    sources = [*Path(__file__).parent.rglob("*.py"), *Path(equations.__file__).parent.glob("*.py")]
    return kept_folder("kernels", sorted(sources), *versions, root=Path(chosen) if chosen else None)
