"""Export the kinematics of a robot's frame as code that runs without urdfkin and contains a self-test."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, cast

from urdfkin.errors import UnknownNameError
from urdfkin.export.seal import seal

if TYPE_CHECKING:
    from urdfkin.export.code import FrameCode

#: Each language has a module, a suffix of files, and a summary in one line.
LANGUAGES: dict[str, tuple[str, str, str]] = {
    "c": ("urdfkin.export.c", ".c", "C99, single or double precision, one configuration or a batch"),
    "cpp": ("urdfkin.export.cpp", ".hpp", "C++11, a header of templates for any number type"),
    "cuda": ("urdfkin.export.cpp", ".cuh", "CUDA, a header for host and device, with a kernel for batches"),
    "numpy": ("urdfkin.export.python", "_numpy.py", "Python on NumPy, whole batches"),
    "array": ("urdfkin.export.python", "_array.py", "Python on any array API namespace, whole batches"),
    "numba": ("urdfkin.export.python", "_numba.py", "Python that Numba compiles"),
    "jax": ("urdfkin.export.python", "_jax.py", "Python on JAX, for jit, vmap and grad"),
    "torch": ("urdfkin.export.python", "_torch.py", "Python on PyTorch, a module and functions"),
    "casadi": ("urdfkin.export.python", "_casadi.py", "Python on CasADi's SX, MX and DM"),
    "sympy": ("urdfkin.export.python", "_sympy.py", "Python on SymPy's symbols"),
    "sympy-exact": ("urdfkin.export.python", "_sympy_exact.py", "Python on SymPy's symbols, exact numbers"),
    "matlab": ("urdfkin.export.matlab", "_kinematics.m", "MATLAB and Octave"),
    "latex": ("urdfkin.export.latex", ".tex", "LaTeX formulas in the textbook's symbols"),
}
#: The argument `form` of `Robot.export` has these values.
FORMS = {"tree": "the URDF's links", "dh": "its Denavit-Hartenberg table", "screws": "its screws"}
#: Quantities that are exported by default.
QUANTITIES = ("placement", "jacobian", "acceleration")


def code_in(code: FrameCode, to: str) -> FrameCode:
    """Return the code for the language `to`: with exact constants for sympy-exact, otherwise unchanged.

    Raise VerificationError if Pinocchio computes another result than the exact expressions.
    """
    return code.exact() if to == "sympy-exact" and code.exact is not None else code


def write(code: FrameCode, to: str) -> str:
    """Return the text of a file in the language `to`, with its seal, or raise the error of `code_in`."""
    if to not in LANGUAGES:
        raise UnknownNameError("language", to, LANGUAGES)
    return seal(cast("str", importlib.import_module(LANGUAGES[to][0]).write(code_in(code, to), to)))
