"""Decide when a kernel is loaded or compiled; this decision does not import Numba.

For a few configurations, Python is faster than loading or compiling a kernel. This module therefore measures
how long Python has computed without each kernel. The time in the table also includes an estimate for the next
computations.

| time without a kernel | action |
|---|---|
| more than `LOADING` | read the kernel from disk |
| more than `BESIDE`, no kernel on disk | compile the kernel in a second process; Python still computes |
| more than `COMPILING`, no kernel on disk | compile the kernel in this process |

If no second process can compile the kernel, this process compiles it after the time `BESIDE`.
"""

from __future__ import annotations

import atexit
import os
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from urdfkin.compiled.kernel_cache import cache_folder, compiling
from urdfkin.system.locks import importing

if TYPE_CHECKING:
    import subprocess

#: Computing times (s) without a kernel; the table above lists the action that follows each time.
LOADING, BESIDE, COMPILING = 0.3, 1.0, 3.0
#: This threshold (s) applies instead of `LOADING` after the first kernel is loaded.
_LOADING_MORE = 0.03
#: Time (s) that the fast function saves in each call with one configuration.
_SAVED = 5e-5
#: Time (s) after which the cache folder is searched again for a missing kernel.
_AGAIN = 0.05

RECURSIONS, SINGLE = "urdfkin.compiled.machine.kernels", "urdfkin.compiled.machine.single"
#: Two groups of kernels with about equal compile times; each of two processes compiles one group.
_ONE_HALF = "accelerations", "local_accelerations", "velocities"
_OTHER_HALF = "jacobians", "jacobian_rates", "local_velocities", "placements"

# -- when a kernel pays ----------------------------------------------------------------------------------

#: How to compute: "interpreted" with Python numbers, or "compiled" with kernels.
Way = Literal["interpreted", "compiled"]

_spent: dict[str, float] = {}
_loaded: dict[str, Any] = {}
_absent: dict[tuple[Path, str], float] = {}
_only: list[Way] = []


@contextmanager
def only(way: Way) -> Iterator[None]:
    """While the context is open, use only Python numbers ("interpreted") or only kernels ("compiled")."""
    _only.append(way)
    try:
        yield
    finally:
        _only.pop()


def spend(name: str, seconds: float) -> None:
    """Add the seconds of a computation that did not use the kernel `name`."""
    _spent[name] = _spent.get(name, 0.0) + seconds


def kernel(name: str, more: float = 0.0, home: str = RECURSIONS) -> Any:
    """Return a kernel, or None if computing without the kernel is faster.

    `more` is the estimated time (seconds) of the next computations without the kernel.
    """
    if _only and _only[-1] == "interpreted":
        return None
    if (found := _loaded.get(name)) is not None:
        return found
    if _only:
        return load(name, home)
    seconds = _spent.get(name, 0.0) + more
    if seconds < (_LOADING_MORE if _loaded else LOADING):
        return None
    if seconds < COMPILING and not _on_disk(name) and (seconds < BESIDE or _compile_beside(name, home)):
        return None
    return load(name, home)


def single_pays(name: str) -> bool:
    """Return whether to load the function that computes one configuration with the kernel `name`.

    If the kernel is loaded, each call adds `_SAVED` seconds to the time lost without this function.
    """
    if _only:
        return _only[-1] == "compiled"
    if name not in _loaded and f"local_{name}" not in _loaded:
        return False
    spend("one_configuration", _SAVED)
    more = COMPILING if cache_folder() is None else LOADING
    return kernel("one_configuration", more, SINGLE) is not None


def load(name: str, home: str = RECURSIONS) -> Any:
    with compiling, importing:
        found = getattr(import_module(home), name)
    _ = found.compiled
    _loaded[name] = found
    return found


def _on_disk(name: str) -> bool:
    """Return whether a kernel is on disk; search again only after `_AGAIN` seconds."""
    folder = cache_folder()
    if folder is None or time.monotonic() < _absent.get((folder, name), 0.0):
        return False
    found = any(folder.glob(f"*.{name}.*.kernel"))
    if not found:
        _absent[folder, name] = time.monotonic() + _AGAIN
    return found


# -- the second process ----------------------------------------------------------------------------------

#: Code that ends the second process when its standard input closes, that is, when this process ends.
_UNTIL_CLOSED = (
    "import os, sys, threading;"
    " threading.Thread(target=lambda: (sys.stdin.read(), os._exit(1)), daemon=True).start();"
)
_beside: dict[str, subprocess.Popen[bytes]] = {}


def _compile_beside(name: str, home: str) -> bool:
    """Start a second process that compiles a kernel.

    Return False if the caller must load or compile the kernel itself, and True otherwise. At most one second
    process runs at a time, and at most one is started for each kernel.
    """
    if cache_folder() is None:
        return False
    if not compiling.acquire(blocking=False):
        return True  # Another thread compiles a kernel, or starts the second process.
    try:
        if any(process.poll() is None for process in _beside.values()):
            return True
        if name in _beside:
            return False
        _beside[name] = _compile_elsewhere((name,), home)
        return True
    finally:
        compiling.release()


def _compile_elsewhere(names: Sequence[str], home: str = RECURSIONS) -> subprocess.Popen[bytes]:
    import subprocess

    from urdfkin.system.processes import own_python

    code = (
        f"{_UNTIL_CLOSED} from urdfkin.compiled import preload; preload._compile({tuple(names)!r}, {home!r})"
    )
    return subprocess.Popen(
        own_python(code),
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


def _end_beside() -> None:
    for process in _beside.values():
        process.kill()
        process.wait()
        _close(process)


def _close(process: subprocess.Popen[bytes]) -> None:
    if process.stdin is not None:
        process.stdin.close()


def _forget_beside() -> None:
    """Close the second process's standard input in a forked child, so that only the parent keeps it open."""
    for process in _beside.values():
        process.returncode = 0
        _close(process)
    _beside.clear()


atexit.register(_end_beside)
os.register_at_fork(after_in_child=_forget_beside)


# -- all kernels in advance ------------------------------------------------------------------------------


def are_on_disk() -> bool:
    return all(map(_on_disk, _ONE_HALF + _OTHER_HALF))


def load_kernels() -> None:
    """Load every kernel before several processes start, so that not every process compiles all kernels."""
    missing = cache_folder() is not None and not all(map(_on_disk, _OTHER_HALF))
    helper = _compile_elsewhere(_OTHER_HALF) if missing else None
    try:
        _compile(_ONE_HALF)
    finally:
        if helper is not None:
            helper.wait()
            _close(helper)
    _compile(_OTHER_HALF)


def _compile(names: Sequence[str], home: str = RECURSIONS) -> None:
    for name in names:
        load(name, home)
