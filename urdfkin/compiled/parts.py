"""How Numba compiles what is only ever a part of a kernel: no further than it has to, which halves the wait.

A part is inlined and never called by itself. It needs no machine code of its own, no optimization before it
stands where it is inlined, and of Numba's passes none for what no part has: closures, `with`, literal loops,
inlining on Numba's own level, rewriting of array expressions.
"""

from __future__ import annotations

from typing import Any

from numba._dynfunc import make_function
from numba.core import typed_passes, untyped_passes
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase
from numba.core.compiler_machinery import PassManager, register_pass

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
