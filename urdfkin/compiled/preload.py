"""Decide when a kernel is loaded or compiled.

Numba is imported only when a kernel is loaded or compiled. For a few configurations, plain Python takes less
time than loading or compiling a kernel. For each kernel, this module therefore sums up the time (s) of plain
Python, including the estimated time of the next computations. At each threshold, the module takes an action:

| time in plain Python | action |
|---|---|
| `LOAD_AFTER` for the first kernel, then `_LOAD_NEXT_AFTER` | read the kernel from disk |
| `BACKGROUND_AFTER`, no kernel on disk | compile it in a second process; Python still computes |
| `COMPILE_AFTER`, no kernel on disk | compile it in this process |

If no second process can compile the kernel, this process compiles it after the time `BACKGROUND_AFTER`.
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

from urdfkin.compiled.kernel_cache import compile_lock, kernel_cache_folder
from urdfkin.system.locks import import_lock

if TYPE_CHECKING:
    import subprocess

#: Thresholds (s) of the time in plain Python; see the module's docstring.
LOAD_AFTER, BACKGROUND_AFTER, COMPILE_AFTER = 0.3, 1.0, 3.0
#: Threshold (s) that replaces `LOAD_AFTER` after the first kernel has been loaded.
_LOAD_NEXT_AFTER = 0.03
#: Time (s) that the fast function saves in each call with one configuration.
_SECONDS_SAVED_PER_CALL = 5e-5
#: Time (s) after which the cache folder is searched again for a missing kernel.
_SEARCH_INTERVAL = 0.05

KERNELS_MODULE, SINGLE_MODULE = "urdfkin.compiled.machine.kernels", "urdfkin.compiled.machine.single"
#: Two groups of kernels with about equal compile times, one for each of two processes.
_FIRST_PROCESS_KERNELS = "accelerations", "local_accelerations", "velocities"
_SECOND_PROCESS_KERNELS = "jacobians", "jacobian_rates", "local_velocities", "placements"

# -- when a kernel pays ----------------------------------------------------------------------------------

#: How to compute: "interpreted" with Python numbers, or "compiled" with kernels.
ComputeMode = Literal["interpreted", "compiled"]

_seconds_spent: dict[str, float] = {}
_kernels: dict[str, Any] = {}
_next_search: dict[tuple[Path, str], float] = {}
_modes: list[ComputeMode] = []


@contextmanager
def use_only(mode: ComputeMode) -> Iterator[None]:
    """Select plain Python or kernels inside a `with` block."""
    _modes.append(mode)
    try:
        yield
    finally:
        _modes.pop()


def add_time(name: str, seconds: float) -> None:
    _seconds_spent[name] = _seconds_spent.get(name, 0.0) + seconds


def get_kernel(name: str, expected_seconds: float = 0.0, module: str = KERNELS_MODULE) -> Any:
    """Return a kernel, or None to use plain Python.

    `expected_seconds` is the time of the next computations in plain Python.
    """
    if _modes and _modes[-1] == "interpreted":
        return None
    if (kernel := _kernels.get(name)) is not None:
        return kernel
    if _modes:
        return load_kernel(name, module)
    seconds = _seconds_spent.get(name, 0.0) + expected_seconds
    if seconds < (_LOAD_NEXT_AFTER if _kernels else LOAD_AFTER):
        return None
    if (
        seconds < COMPILE_AFTER
        and not _is_on_disk(name)
        and (seconds < BACKGROUND_AFTER or _compile_in_background(name, module))
    ):
        return None
    return load_kernel(name, module)


def should_load_single_evaluator(name: str) -> bool:
    """Return whether to use the kernel `one_configuration`, and load the kernel if it saves time.

    Without a selected mode, the result is False until a batch kernel of the quantity `name` is loaded.
    """
    if _modes:
        return _modes[-1] == "compiled"
    if name not in _kernels and f"local_{name}" not in _kernels:
        return False
    add_time("one_configuration", _SECONDS_SAVED_PER_CALL)
    expected_seconds = COMPILE_AFTER if kernel_cache_folder() is None else LOAD_AFTER
    return get_kernel("one_configuration", expected_seconds, SINGLE_MODULE) is not None


def load_kernel(name: str, module: str = KERNELS_MODULE) -> Any:
    with compile_lock, import_lock:
        kernel = getattr(import_module(module), name)
    _ = kernel.compiled_function
    _kernels[name] = kernel
    return kernel


def _is_on_disk(name: str) -> bool:
    folder = kernel_cache_folder()
    if folder is None or time.monotonic() < _next_search.get((folder, name), 0.0):
        return False
    exists = any(folder.glob(f"*.{name}.*.kernel"))
    if not exists:
        _next_search[folder, name] = time.monotonic() + _SEARCH_INTERVAL
    return exists


# -- the second process ----------------------------------------------------------------------------------

#: Python code that ends the second process when its standard input closes. The standard input closes when the
#: first process ends.
_EXIT_WITH_PARENT_CODE = (
    "import os, sys, threading;"
    " threading.Thread(target=lambda: (sys.stdin.read(), os._exit(1)), daemon=True).start();"
)
_background: dict[str, subprocess.Popen[bytes]] = {}


def _compile_in_background(name: str, module: str) -> bool:
    """Return False if the caller must load or compile the kernel."""
    if kernel_cache_folder() is None:
        return False
    if not compile_lock.acquire(blocking=False):
        return True  # Another thread is compiling a kernel or starting the second process.
    try:
        if any(process.poll() is None for process in _background.values()):
            return True
        if name in _background:
            return False
        _background[name] = _start_compiler((name,), module)
        return True
    finally:
        compile_lock.release()


def _start_compiler(names: Sequence[str], module: str = KERNELS_MODULE) -> subprocess.Popen[bytes]:
    import subprocess

    from urdfkin.system.processes import python_command

    load = f"preload._load_group({tuple(names)!r}, {module!r})"
    code = f"{_EXIT_WITH_PARENT_CODE} from urdfkin.compiled import preload; {load}"
    return subprocess.Popen(
        python_command(code),
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


def _kill_background() -> None:
    for process in _background.values():
        process.kill()
        process.wait()
        _close_stdin(process)


def _close_stdin(process: subprocess.Popen[bytes]) -> None:
    if process.stdin is not None:
        process.stdin.close()


def _close_inherited_inputs() -> None:
    """Close a forked child's copy of the pipe, so that the second process ends when its parent ends."""
    for process in _background.values():
        process.returncode = 0
        _close_stdin(process)
    _background.clear()


atexit.register(_kill_background)
os.register_at_fork(after_in_child=_close_inherited_inputs)


# -- all kernels in advance ------------------------------------------------------------------------------


def all_kernels_on_disk() -> bool:
    return all(map(_is_on_disk, _FIRST_PROCESS_KERNELS + _SECOND_PROCESS_KERNELS))


def load_all_kernels() -> None:
    """Load or compile the kernels of both groups.

    `hessians`, `imus` and `one_configuration` are in neither group.
    """
    missing = kernel_cache_folder() is not None and not all(map(_is_on_disk, _SECOND_PROCESS_KERNELS))
    compiler = _start_compiler(_SECOND_PROCESS_KERNELS) if missing else None
    try:
        _load_group(_FIRST_PROCESS_KERNELS)
    finally:
        if compiler is not None:
            compiler.wait()
            _close_stdin(compiler)
    _load_group(_SECOND_PROCESS_KERNELS)


def _load_group(names: Sequence[str], module: str = KERNELS_MODULE) -> None:
    for name in names:
        load_kernel(name, module)
