"""Find the cache folder of compiled kernels, and report when a compilation begins and ends.

This module does not import Numba.
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
from urdfkin.system.locks import import_lock, make_fork_safe_lock

#: Lock for the import of Numba and for compilations. A fork waits for this lock, because a child cannot
#: finish the parent's compilation. The import of Numba acquires this lock first, and then `logging`'s lock. A
#: fork acquires the newest lock first. Both orders are the same only if this lock is newer, so `logging` must
#: be imported before this lock is created.
compile_lock = make_fork_safe_lock()

#: A function that receives a kernel's name and the compile time in seconds. The time is None when the
#: compilation begins.
Listener = Callable[[str, float | None], None]


def _log(name: str, seconds: float | None) -> None:
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
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.remove(listener)


@contextmanager
def compile_event(name: str) -> Iterator[Callable[[], None]]:
    """Report a compilation to the listener.

    The caller must call the yielded function immediately before the compilation.
    """
    starts: list[float] = []

    def report_start() -> None:
        starts.append(time.perf_counter())
        _listeners[-1](name, None)

    yield report_start
    if starts:
        _listeners[-1](name, time.perf_counter() - starts[0])


@cache
def kernel_cache_folder() -> Path | None:
    """Return the cache folder, or None if no folder is writable."""
    with import_lock:
        from urdfkin.system.cache import make_cache_folder

    numba = sys.modules.get("numba")
    chosen = numba.config.CACHE_DIR if numba else os.environ.get("NUMBA_CACHE_DIR")
    python = sys.implementation.cache_tag + sys.abiflags
    versions = installed_version("numba") or "", installed_version("llvmlite") or "", python
    sources = [*Path(__file__).parent.rglob("*.py"), *Path(equations.__file__).parent.glob("*.py")]
    return make_cache_folder("kernels", sorted(sources), *versions, root=Path(chosen) if chosen else None)
