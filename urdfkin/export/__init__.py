"""Export the kinematics of a robot's frame as code that runs without urdfkin and contains a self-test.

A LaTeX document contains the formulas, but no self-test.
"""

from __future__ import annotations

import importlib
import re
from dataclasses import replace
from typing import TYPE_CHECKING, cast

from urdfkin.errors import UnknownNameError

if TYPE_CHECKING:
    from urdfkin.export.code import FrameCode

#: Module and file suffix of each language.
LANGUAGES: dict[str, tuple[str, str]] = {
    "c": ("urdfkin.export.c", ".c"),
    "cpp": ("urdfkin.export.cpp", ".hpp"),
    "cuda": ("urdfkin.export.cpp", ".cuh"),
    **{
        name: ("urdfkin.export.python", f"_{name.replace('-', '_')}.py")
        for name in ("numpy", "array", "numba", "jax", "torch", "casadi", "sympy", "sympy-exact")
    },
    "matlab": ("urdfkin.export.matlab", "_kinematics.m"),
    "latex": ("urdfkin.export.latex", ".tex"),
}
#: Values of the argument `form` of `Robot.export`.
FORMS = ("tree", "dh", "screws")
DEFAULT_QUANTITIES = ("placement", "jacobian", "acceleration")


def code_for_language(code: FrameCode, to: str) -> FrameCode:
    """Return `code`, or the code with exact constants if `to` is sympy-exact."""
    if to != "sympy-exact" or code.exact is None:
        return code
    exact = code.exact()
    # For tables and screws, only `code.proof` contains the locked joints.
    return replace(exact, maybe_proof=replace(exact.proof, lock=code.proof.lock))


def write(code: FrameCode, to: str, file: str | None = None) -> str:
    """Return an exported file's text with its digest.

    `file`, for example `arm.c`, replaces the default file name in the text. The text keeps the default name
    if `file` begins with "." or "-", or contains a character other than ASCII letters, digits, "_", "." and
    "-".

    Raises:
        UnknownNameError: `to` is not a key of `LANGUAGES`.
    """
    if to not in LANGUAGES:
        raise UnknownNameError("language", to, LANGUAGES)
    from urdfkin.export.check import insert_seal

    module, suffix = LANGUAGES[to]
    text = cast("str", importlib.import_module(module).write(code_for_language(code, to), to))
    if file is not None and re.fullmatch(r"\w[\w.-]*", file, re.ASCII):
        text = re.sub(rf"(?<=[ \"]){re.escape(code.name + suffix)}(?=[ )\"\n])", file, text)
    return insert_seal(text)
