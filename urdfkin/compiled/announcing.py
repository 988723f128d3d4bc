"""Know when a kernel is compiled, which takes seconds, and not found on disk, which takes none."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from numba.core import event

from urdfkin.compiled.compiling import cache_folder
from urdfkin.system.interpreter import own_python

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


#: The cores: half of the work each.
_ONE_HALF = "accelerations", "local_accelerations", "velocities"
_OTHER_HALF = "jacobians", "jacobian_rates", "local_velocities", "placements"


def load_kernels() -> None:
    """Compile every core, or read it from disk: before processes start that would all compile.

    Compiling takes one processor; a second process does half of it, and this one then reads it from disk.
    """
    helper = None if all(map(_on_disk, _OTHER_HALF)) else _compile_elsewhere(_OTHER_HALF)
    try:
        _compile(_ONE_HALF)
    finally:
        if helper is not None:
            helper.wait()
    _compile(_OTHER_HALF)


def _compile(names: Sequence[str]) -> None:
    from urdfkin.compiled import cores  # noqa: PLC0415

    for name in names:
        _ = getattr(cores, name).compiled


def _on_disk(name: str) -> bool:
    folder = cache_folder()
    return folder is None or any(folder.glob(f"cores.{name}.*.kernel"))


def _compile_elsewhere(names: Sequence[str]) -> subprocess.Popen[bytes]:
    """Another interpreter that does nothing but compile; what it fails to do is done here after all."""
    code = f"from urdfkin.compiled import announcing; announcing._compile({tuple(names)!r})"
    return subprocess.Popen(
        own_python(code),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
