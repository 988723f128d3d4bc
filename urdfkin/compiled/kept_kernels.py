"""Compiled kernels on disk, sealed: a damaged one is compiled again, and where none can be kept, none is.

Numba's own files have no digest: half a file ends every later run, and a flipped bit is run as it is.
"""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba.core.caching import NullCache
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps

from urdfkin.system.files import read_bytes
from urdfkin.system.sealed import damaged, keep, kept

_Null: Any = NullCache  # numba has no types
_Result: Any = CompileResult
_dumps: Any = dumps


class KeptKernel(_Null):  # type: ignore[misc]
    """Where Numba looks for one function before it compiles it, and leaves it afterwards.

    The folder stands for the sources that all kernels share; a file's name for the function and the file that
    it is in, which may lie elsewhere, its arguments and the processor.
    `missed` is called where there is nothing of use.
    """

    def __init__(self, function: Callable[..., int], folder: Path, missed: Callable[[], None]) -> None:
        self._folder, self._name, self._missed = folder, function_name(function), missed
        self._source = read_bytes(Path(function.__code__.co_filename))

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """What was kept for these arguments; None where there is nothing of use."""
        target_context.refresh()
        place = self._place(sig, target_context.codegen())
        if (content := kept(place)) is not None:
            try:
                return _Result._rebuild(target_context, *pickle.loads(content))
            except Exception as error:  # whole, but of another time: it may fail in any way
                damaged(place, f"{type(error).__name__}: {error}")
        self._missed()
        return None

    def save_overload(self, sig: Any, cres: Any) -> None:
        """Keep what was compiled."""
        if not cres.library.has_dynamic_globals:  # addresses of this process
            keep(self._place(sig, cres.library.codegen), _dumps(cres._reduce()))

    def _place(self, signature: Any, codegen: Any) -> Path:
        key = repr((signature, codegen.magic_tuple(), self._source))
        return self._folder / f"{self._name}.{hashlib.sha256(key.encode()).hexdigest()[:16]}.kernel"


def function_name(function: Callable[..., int]) -> str:
    """The module's name without its packages, and the function's."""
    return f"{function.__module__.rpartition('.')[2]}.{function.__name__}"
