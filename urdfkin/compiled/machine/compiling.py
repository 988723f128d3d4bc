"""Compile kernels with Numba and cache them on disk.

The cache folder's name contains a digest of the sources of `compiled` and `kinematics`. Each cache file
contains a digest of its content. If a cache file is damaged, its kernel is compiled again. Numba's own cache
does not check files for changed bits.
"""

from __future__ import annotations

import hashlib
import pickle
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

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

from urdfkin.compiled.kernel_cache import compile_event, compile_lock, kernel_cache_folder
from urdfkin.system.cache import read_cached_file, report_damaged, write_cached_file
from urdfkin.system.files import read_bytes

_NullCache: Any = NullCache  # Numba has no type annotations.
_CompileResult: Any = CompileResult
_dumps: Any = dumps


class KernelCache(_NullCache):  # type: ignore[misc]
    """The disk cache of one function.

    The folder's name depends only on the sources of `compiled` and `kinematics`, but `urdfkin.verify` also
    has kernels. The key of a cache file therefore contains the text of the function's source file.
    """

    def __init__(self, function: Callable[..., int], folder: Path, report_start: Callable[[], None]) -> None:
        self._folder, self._name, self._report_start = folder, function_name(function), report_start
        self._source = read_bytes(Path(function.__code__.co_filename))

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        target_context.refresh()
        path = self._path(sig, target_context.codegen())
        if (content := read_cached_file(path)) is not None:
            try:
                return _CompileResult._rebuild(target_context, *pickle.loads(content))
            # The file's checksum is correct, but another version of Numba may have written the file. Reading
            # a file from another version can raise any exception.
            except Exception as error:
                report_damaged(path, f"{type(error).__name__}: {error}")
        self._report_start()
        return None

    def save_overload(self, sig: Any, cres: Any) -> None:
        # Code with dynamic globals contains memory addresses that are valid only in this process. Such code
        # cannot be cached.
        if not cres.library.has_dynamic_globals:
            write_cached_file(self._path(sig, cres.library.codegen), _dumps(cres._reduce()))

    def _path(self, signature: Any, codegen: Any) -> Path:
        key = repr((signature, codegen.magic_tuple(), self._source))
        return self._folder / f"{self._name}.{hashlib.sha256(key.encode()).hexdigest()[:16]}.kernel"


def function_name(function: Callable[..., int]) -> str:
    return f"{function.__module__.rpartition('.')[2]}.{function.__name__}"


_CodeLibrary: Any = JITCodeLibrary  # Numba has no type annotations.
_Lowering: Any = typed_passes.NativeLowering
_Compiler: Any = CompilerBase
_PassManager: Any = PassManager
_register_pass: Any = register_pass


class _InlinedLibrary(_CodeLibrary):  # type: ignore[misc]
    def finalize(self) -> None:
        """Complete the library without generating machine code."""
        self._finalize_dynamic_globals()
        self._finalized = True

    @property
    def all_libraries(self) -> list[Any]:
        return [self, *dict.fromkeys(self._linking_libraries)]


@_register_pass(mutates_CFG=True, analysis_only=False)
class _InlinedLowering(_Lowering):  # type: ignore[misc]
    _name = "inlined_lowering"

    def run_pass(self, state: Any) -> bool:
        """Translate the function to LLVM code, but not to machine code."""
        state.library = _InlinedLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = True
        super().run_pass(state)
        # Numba finds the compiled code by the Python function `handle`, but never calls `handle`.
        descriptor, environment = state.cr.fndesc, state.cr.env
        handle = make_function(
            descriptor.lookup_module(), descriptor.qualname, "", 0, environment, (state.library,)
        )
        state.targetctx.insert_user_function(handle, descriptor, state.library.all_libraries)
        state.cr = state.cr._replace(cfunc=handle)
        return True


class InlinedCompiler(_Compiler):  # type: ignore[misc]
    """Compiles functions that only kernels call.

    Closures and array expressions are not supported.
    """

    def define_pipelines(self) -> list[Any]:
        passes = _PassManager("inlined")
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
            _InlinedLowering,
            typed_passes.NoPythonBackend,
        ):
            passes.add_pass(each, each.__name__)
        passes.finalize()
        return [passes]


_config: Any = numba.config  # Numba defines these settings at run time.

#: Without fast math, the compiler neither reorders nor fuses operations, so results do not depend on the
#: compiler. Division by zero gives inf, so loops contain no branch that raises an error. The functions
#: allocate no memory, so arrays need no reference counts.
COMPILE_OPTIONS: dict[str, Any] = {"error_model": "numpy", "_nrt": False}
_INLINE_OPTIONS: dict[str, Any] = {
    "forceinline": True,
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
    "pipeline_class": InlinedCompiler,
}


@contextmanager
def ignore_disable_jit() -> Iterator[None]:
    """Ignore NUMBA_DISABLE_JIT in a `with` block.

    Python cannot run these functions uncompiled.
    """
    before, _config.DISABLE_JIT = _config.DISABLE_JIT, 0
    try:
        yield
    finally:
        _config.DISABLE_JIT = before


def _skip_blas_check() -> None:
    """Skip Numba's BLAS check, which imports SciPy."""
    if "numba.np.arraymath" in sys.modules or find_spec("scipy") is None:
        return
    with suppress(ImportError, AttributeError):
        linalg: Any = import_module("numba.np.linalg")
        before, linalg.ensure_blas = linalg.ensure_blas, lambda: None
        try:
            import_module("numba.np.arraymath")
        finally:
            linalg.ensure_blas = before


def jit(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    def decorate(function: Callable[..., Any]) -> Any:
        with ignore_disable_jit():
            return numba.njit(**options, **COMPILE_OPTIONS)(function)

    return decorate


inline = jit(**_INLINE_OPTIONS)

# A read-only argument type also accepts a writable array, without a copy.
FLOATS_1D = types.Array(types.float64, 1, "C", readonly=True)
FLOATS_2D = types.Array(types.float64, 2, "C", readonly=True)
INTS_1D = types.Array(types.int64, 1, "C", readonly=True)
INTS_2D = types.Array(types.int64, 2, "C", readonly=True)
WRITABLE_FLOATS_1D = types.Array(types.float64, 1, "C")
WRITABLE_INTS_1D = types.Array(types.int64, 1, "C")
WRITABLE_FLOATS_3D = types.Array(types.float64, 3, "C")


class Kernel:
    """A function that is compiled, or loaded, at its first call."""

    compiled_function: Any

    def __init__(self, function: Callable[..., int], arguments: tuple[Any, ...]) -> None:
        self._function, self._arguments = function, arguments
        self.__doc__, self.__name__ = function.__doc__, function.__name__

    def __getattr__(self, name: str) -> Any:
        # This method replaces a `cached_property`, because before Python 3.12 a fork could leave the lock of
        # a `cached_property` locked.
        if name != "compiled_function":
            raise AttributeError(name)
        with compile_lock:
            if "compiled_function" not in self.__dict__:
                self.compiled_function = self._compile()
            return self.__dict__["compiled_function"]

    def _compile(self) -> Any:
        dispatcher = jit(nogil=True)(self._function)
        self._compile_or_load(dispatcher, lambda: dispatcher.compile(types.int64(*self._arguments)))
        dispatcher.disable_compile()
        return dispatcher

    def _compile_or_load(self, function: Any, compile_: Callable[[], object]) -> None:
        with compile_event(self.__name__.strip("_").replace("_", " ")) as report_start, ignore_disable_jit():
            _skip_blas_check()
            if (folder := kernel_cache_folder()) is None:
                report_start()
            else:
                function._cache = KernelCache(self._function, folder, report_start)
            compile_()

    def __call__(self, *arguments: Any) -> int:
        return int(self.compiled_function(*arguments))


class CKernel(Kernel):
    """A compiled function that C code can call.

    All arguments are integers. A call from Python uses ctypes, which releases the global interpreter lock.
    """

    def __init__(self, function: Callable[..., int]) -> None:
        super().__init__(function, (types.int64,) * function.__code__.co_argcount)

    def _compile(self) -> Any:
        c_function: Any = CFunc(self._function, (self._arguments, types.int64), {}, COMPILE_OPTIONS)
        self._compile_or_load(c_function, c_function.compile)
        return c_function

    @property
    def address(self) -> int:
        return int(self.compiled_function.address)

    def __call__(self, *arguments: Any) -> int:
        return int(self.compiled_function.ctypes(*arguments))


def inline_function(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    return jit(**_INLINE_OPTIONS, **options)


def kernel(*arguments: Any) -> Callable[[Callable[..., int]], Kernel]:
    """Return a decorator that makes kernels with arguments of the given Numba types."""
    return lambda function: Kernel(function, arguments)
