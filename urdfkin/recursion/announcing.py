"""Know when a kernel is compiled, which takes seconds, and not found on disk, which takes none."""

from __future__ import annotations

import importlib
import subprocess
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from numba.core import event

from urdfkin.interpreter import own_python
from urdfkin.recursion.compiling import cache_folder

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


#: The kernels for batches, by the module they stand in: half of the work each.
_ONE_HALF = {"jacobian_kernel": "jacobians", "motion_kernel": "motions"}
_OTHER_HALF = {"jacobian_rate_kernel": "jacobian_rates", "local_kernel": "local_motions"}


def load_kernels() -> None:
    """Compile every kernel for batches, or read it from disk: before processes start that would all compile.

    Compiling takes one processor; a second process does half of it, and this one then reads it from disk.
    """
    helper = None if all(map(_on_disk, _OTHER_HALF)) else _compile_elsewhere(_OTHER_HALF)
    try:
        _compile(_ONE_HALF)
    finally:
        if helper is not None:
            helper.wait()
    _compile(_OTHER_HALF)


def _compile(kernels: Mapping[str, str]) -> None:
    for module, name in kernels.items():
        _ = getattr(importlib.import_module(f"urdfkin.recursion.{module}"), name).compiled


def _on_disk(name: str) -> bool:
    folder = cache_folder()
    return folder is None or any(folder.glob(f"{name}.*.kernel"))


def _compile_elsewhere(kernels: Mapping[str, str]) -> subprocess.Popen[bytes]:
    """Another interpreter that does nothing but compile; what it fails to do is done here after all."""
    code = f"from urdfkin.recursion import announcing; announcing._compile({dict(kernels)!r})"
    return subprocess.Popen(
        own_python(code),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
