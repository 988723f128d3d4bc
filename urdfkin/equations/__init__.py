"""The chapter's equations: what each says, which function computes it, and what checks it.

One source for `docs/equations.md`, `urdfkin explain 7.130` and the tests that hold both to the truth.
"""

from urdfkin.equations.pages import explain
from urdfkin.equations.registry import LOST, Equation, Misprint, Section, equations, misprints, sections
from urdfkin.equations.table import table

__all__ = [
    "LOST",
    "Equation",
    "Misprint",
    "Section",
    "equations",
    "explain",
    "misprints",
    "sections",
    "table",
]
