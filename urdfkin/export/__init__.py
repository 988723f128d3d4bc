"""A robot's kinematics as code for where no Python runs, or no urdfkin, with its proof in the same file."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, cast

from urdfkin.errors import UnknownNameError
from urdfkin.export.seal import seal

if TYPE_CHECKING:
    from urdfkin.export.code import Code

#: Language -> (module that holds `write`, a file's ending, one-line summary).
LANGUAGES: dict[str, tuple[str, str, str]] = {
    "c": ("urdfkin.export.c", ".c", "C99, single or double precision, one configuration or a batch"),
    "cpp": ("urdfkin.export.cpp", ".hpp", "C++11, a header of templates on the number"),
    "numpy": ("urdfkin.export.python", "_numpy.py", "Python on NumPy, whole batches"),
    "numba": ("urdfkin.export.python", "_numba.py", "Python that Numba compiles"),
    "jax": ("urdfkin.export.python", "_jax.py", "Python on JAX, for jit, vmap and grad"),
    "casadi": ("urdfkin.export.python", "_casadi.py", "Python on CasADi's SX, MX and DM"),
    "sympy": ("urdfkin.export.python", "_sympy.py", "Python on SymPy's symbols"),
    "matlab": ("urdfkin.export.matlab", "_kinematics.m", "MATLAB and Octave"),
    "latex": ("urdfkin.export.latex", ".tex", "formulas of a document, in the text's letters"),
}
#: What is written where nobody says which.
QUANTITIES = ("placement", "jacobian", "acceleration")


def write(code: Code, to: str) -> str:
    """The text of a file.

    Raises:
        UnknownNameError: no such language.
    """
    if to not in LANGUAGES:
        raise UnknownNameError("language", to, LANGUAGES)
    return seal(cast("str", importlib.import_module(LANGUAGES[to][0]).write(code, to)))
