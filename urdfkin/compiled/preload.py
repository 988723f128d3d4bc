"""Compile all kernels in advance, with two processes."""

from __future__ import annotations

import subprocess
from collections.abc import Sequence

from urdfkin.compiled.compiling import cache_folder
from urdfkin.system.processes import own_python

#: The kernels in two groups of equal compile time.
_ONE_HALF = "accelerations", "local_accelerations", "velocities"
_OTHER_HALF = "jacobians", "jacobian_rates", "local_velocities", "placements"


def load_kernels() -> None:
    """Compile every kernel, or read it from disk.

    Call this function before you start several processes; otherwise each of them compiles the kernels. A
    process compiles on one processor only. A second process therefore compiles half of the kernels, and this
    process then reads that half from disk.
    """
    helper = None if all(map(_on_disk, _OTHER_HALF)) else _compile_elsewhere(_OTHER_HALF)
    try:
        _compile(_ONE_HALF)
    finally:
        if helper is not None:
            helper.wait()
    _compile(_OTHER_HALF)


def _compile(names: Sequence[str]) -> None:
    from urdfkin.compiled import kernels  # noqa: PLC0415

    for name in names:
        _ = getattr(kernels, name).compiled


def _on_disk(name: str) -> bool:
    folder = cache_folder()
    return folder is None or any(folder.glob(f"kernels.{name}.*.kernel"))


def _compile_elsewhere(names: Sequence[str]) -> subprocess.Popen[bytes]:
    """Start another interpreter that compiles; this process compiles the kernels that it fails to compile."""
    code = f"from urdfkin.compiled import preload; preload._compile({tuple(names)!r})"
    return subprocess.Popen(
        own_python(code),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
