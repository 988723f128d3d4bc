"""Compile once a machine: kernels are kept on disk, under a digest of the sources they are made from.

Every source file of `compiled` and of `kinematics` enters the folder's name: a kernel is made of all that it
is inlined from.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import llvmlite
import numba
from numba import types
from numba.core.ccallback import CFunc

from urdfkin.compiled.kept_kernels import KeptKernel
from urdfkin.compiled.parts import PartCompiler
from urdfkin.compiled.telling import told
from urdfkin.kinematics import equations
from urdfkin.system.forking import lock_over_forks
from urdfkin.system.keeping import kept_folder

_config: Any = numba.config  # settings that numba sets at run time

#: How everything here is compiled. Nothing is reordered, and what is fused says so itself (`numbers`):
#: results must not depend on the compiler's choices. Division by zero gives inf as in C, so that no loop
#: carries a branch that raises. Nothing is allocated, so that arrays need no reference counts.
COMPILED: dict[str, Any] = {"error_model": "numpy", "_nrt": False}
#: Of a part that is only ever inlined, no form of its own is made that Python or C could call.
_PART: dict[str, Any] = {
    "forceinline": True,
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
    "pipeline_class": PartCompiler,
}


@contextmanager
def compiling_allowed() -> Iterator[None]:
    """NUMBA_DISABLE_JIT is not obeyed: it is meant for functions that Python could run instead."""
    before, _config.DISABLE_JIT = _config.DISABLE_JIT, 0
    try:
        yield
    finally:
        _config.DISABLE_JIT = before


def _believe_in_blas() -> None:
    """Keep Numba from importing SciPy's linear algebra to see that it is there: a fifth of a command's time.

    No kernel calls it. Compiled code that does imports it then, and has it checked as ever. A Numba that
    keeps it elsewhere imports it, and all is as it would be without this.
    """
    if "numba.np.arraymath" in sys.modules or find_spec("scipy") is None:
        return
    with suppress(ImportError, AttributeError):
        linalg: Any = import_module("numba.np.linalg")
        before, linalg.ensure_blas = linalg.ensure_blas, lambda: None
        try:
            import_module("numba.np.arraymath")
        finally:
            linalg.ensure_blas = before


def jitted(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Decorator: Numba's, with the options of every function here, and those given."""

    def decorate(function: Callable[..., Any]) -> Any:
        with compiling_allowed():
            return numba.njit(**options, **COMPILED)(function)

    return decorate


#: Decorator for functions that kernels are made of.
compiled = jitted(**_PART)

# Inputs may be read-only; a writable array converts without a copy. One signature, compiled once.
NUMBERS = types.Array(types.float64, 1, "C", readonly=True)
ROWS = types.Array(types.float64, 2, "C", readonly=True)
PLACES = types.Array(types.int64, 1, "C", readonly=True)
SCRATCH = types.Array(types.float64, 1, "C")

#: One kernel after the other, as Numba compiles them anyway. A fork waits for the one that is being compiled:
#: in the child nobody would finish it.
_compiling = lock_over_forks()


class Kernel:
    """A function that is compiled, or read from disk, when it is first called.

    Attributes:
        compiled: The compiled function itself: a call through it takes a tenth of a microsecond.
    """

    compiled: Any

    def __init__(self, function: Callable[..., int], arguments: tuple[Any, ...], nogil: bool) -> None:
        self._function, self._arguments, self._nogil = function, arguments, nogil
        self.__doc__, self.__name__ = function.__doc__, function.__name__

    def __getattr__(self, name: str) -> Any:
        # Asked for what is not there yet. A cached property has a lock of its own until Python 3.12, which a
        # forked child might find closed.
        if name != "compiled":
            raise AttributeError(name)
        with _compiling:
            if "compiled" not in self.__dict__:
                self.compiled = self._compile()
            return self.__dict__["compiled"]

    def _compile(self) -> Any:
        dispatcher = jitted(nogil=self._nogil)(self._function)
        self._make(dispatcher, lambda: dispatcher.compile(types.int64(*self._arguments)))
        dispatcher.disable_compile()
        return dispatcher

    def _make(self, made: Any, make: Callable[[], object]) -> None:
        """Compile, or read from disk; whoever listens is told which takes so long."""
        with told(self.__name__.strip("_").replace("_", " ")) as missed, compiling_allowed():
            _believe_in_blas()
            if (folder := cache_folder()) is None:
                missed()
            else:
                made._cache = KeptKernel(self._function, folder, missed)
            make()

    def __call__(self, *arguments: Any) -> int:
        """Compute."""
        return int(self.compiled(*arguments))


class Core(Kernel):
    """A function of addresses, with C's calling convention: kernels call it, and Python by ctypes.

    Python calls it without the interpreter's lock.
    """

    def __init__(self, function: Callable[..., int]) -> None:
        super().__init__(function, (types.int64,) * function.__code__.co_argcount, nogil=True)

    def _compile(self) -> Any:
        core: Any = CFunc(self._function, (self._arguments, types.int64), {}, COMPILED)
        self._make(core, core.compile)
        return core

    @property
    def address(self) -> int:
        """Where it lies in this process."""
        return int(self.compiled.address)

    def __call__(self, *arguments: Any) -> int:
        """Compute."""
        return int(self.compiled.ctypes(*arguments))


def core(function: Callable[..., int]) -> Core:
    """Decorator: compile when first called, keep the result on disk."""
    return Core(function)


def helper(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Decorator for what kernels call; options are Numba's, beside those of every kernel."""
    return jitted(**_PART, **options)


def kernel(*arguments: Any, nogil: bool = True) -> Callable[[Callable[..., int]], Kernel]:
    """Decorator: compile for these argument types when first called, keep the result on disk.

    Args:
        arguments: Numba's types.
        nogil: Whether the interpreter's lock is released meanwhile; for a microsecond it is not worth it.
    """
    return lambda function: Kernel(function, arguments, nogil)


@cache
def cache_folder() -> Path | None:
    """Where compiled kernels are kept; None if no folder can be written."""
    root = Path(_config.CACHE_DIR) if _config.CACHE_DIR else None
    versions = numba.__version__, llvmlite.__version__, sys.implementation.cache_tag + sys.abiflags
    sources = [*Path(__file__).parent.glob("*.py"), *Path(equations.__file__).parent.glob("*.py")]
    return kept_folder("kernels", sorted(sources), *versions, root=root)
