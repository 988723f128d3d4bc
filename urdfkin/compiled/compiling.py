"""Who is told that a kernel is compiled, which takes seconds; to read one from disk takes none.

Compiled kernels on disk, sealed: a damaged one is compiled again, and where none can be kept, none is.

Numba's own files have no digest: half a file ends every later run, and a flipped bit is run as it is.


How Numba compiles what is only ever a part of a kernel: no further than it has to, which halves the wait.

A part is inlined and never called by itself. It needs no machine code of its own, no optimization before it
stands where it is inlined, and of Numba's passes none for what no part has: closures, `with`, literal loops,
inlining on Numba's own level, rewriting of array expressions.


Compile once a machine: kernels are kept on disk, under a digest of the sources they are made from.

Every source file of `compiled` and of `kinematics` enters the folder's name: a kernel is made of all that it
is inlined from.
"""

from __future__ import annotations

import hashlib
import logging
import pickle
import sys
import time
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
from numba._dynfunc import make_function
from numba.core import typed_passes, untyped_passes
from numba.core.caching import NullCache
from numba.core.ccallback import CFunc
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, CompileResult
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.serialize import dumps

from urdfkin.kinematics import equations
from urdfkin.system.cache import get, kept_folder, put, report_damaged
from urdfkin.system.files import read_bytes
from urdfkin.system.processes import lock_over_forks

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
def listen_to_compile_events(listener: Listener) -> Iterator[None]:
    """While open, `listener` is told, and nobody else."""
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.remove(listener)


@contextmanager
def compile_event(name: str) -> Iterator[Callable[[], None]]:
    """Around what may compile: yields what is to be called if it does."""
    begun: list[float] = []

    def missed() -> None:
        begun.append(time.perf_counter())
        _listeners[-1](name, None)

    yield missed
    if begun:
        _listeners[-1](name, time.perf_counter() - begun[0])


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
        if (content := get(place)) is not None:
            try:
                return _Result._rebuild(target_context, *pickle.loads(content))
            except Exception as error:  # whole, but of another time: it may fail in any way
                report_damaged(place, f"{type(error).__name__}: {error}")
        self._missed()
        return None

    def save_overload(self, sig: Any, cres: Any) -> None:
        """Keep what was compiled."""
        if not cres.library.has_dynamic_globals:  # addresses of this process
            put(self._place(sig, cres.library.codegen), _dumps(cres._reduce()))

    def _place(self, signature: Any, codegen: Any) -> Path:
        key = repr((signature, codegen.magic_tuple(), self._source))
        return self._folder / f"{self._name}.{hashlib.sha256(key.encode()).hexdigest()[:16]}.kernel"


def function_name(function: Callable[..., int]) -> str:
    """The module's name without its packages, and the function's."""
    return f"{function.__module__.rpartition('.')[2]}.{function.__name__}"


_Library: Any = JITCodeLibrary  # numba has no types
_Lowering: Any = typed_passes.NativeLowering
_Compiler: Any = CompilerBase
_Passes: Any = PassManager
_register: Any = register_pass


class _Part(_Library):  # type: ignore[misc]
    """LLVM's code for a function, to be linked into a kernel's; what it calls is linked there too."""

    def finalize(self) -> None:
        """Done."""
        self._finalize_dynamic_globals()
        self._finalized = True

    @property
    def all(self) -> list[Any]:
        """With those of all that it calls."""
        return [self, *dict.fromkeys(self._linking_libraries)]


@_register(mutates_CFG=True, analysis_only=False)
class _PartLowering(_Lowering):  # type: ignore[misc]
    _name = "part_lowering"

    def run_pass(self, state: Any) -> bool:
        """To LLVM's code, and no further."""
        state.library = _Part(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = True
        super().run_pass(state)
        # Numba tells functions from one another by what Python would call: of a part, nothing.
        what, environment = state.cr.fndesc, state.cr.env
        handle = make_function(what.lookup_module(), what.qualname, "", 0, environment, (state.library,))
        state.targetctx.insert_user_function(handle, what, state.library.all)
        state.cr = state.cr._replace(cfunc=handle)
        return True


class PartCompiler(_Compiler):  # type: ignore[misc]
    """Numba's passes, those that a part needs."""

    def define_pipelines(self) -> list[Any]:
        """One pipeline."""
        passes = _Passes("part")
        for each in (
            untyped_passes.TranslateByteCode,
            untyped_passes.FixupArgs,
            untyped_passes.IRProcessing,
            untyped_passes.RewriteSemanticConstants,
            untyped_passes.GenericRewrites,
            untyped_passes.ReconstructSSA,
            typed_passes.NopythonTypeInference,
            typed_passes.PreLowerStripPhis,
            typed_passes.IRLegalization,
            typed_passes.AnnotateTypes,
            _PartLowering,
            typed_passes.NoPythonBackend,
        ):
            passes.add_pass(each, each.__name__)
        passes.finalize()
        return [passes]


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
        with compile_event(self.__name__.strip("_").replace("_", " ")) as missed, compiling_allowed():
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
