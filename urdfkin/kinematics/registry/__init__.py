"""The chapter's equations: what each says, which function computes it, and what checks it.

One source for `docs/equations.md`, `urdfkin explain 7.130` and the tests that hold both to the truth.
"""

from urdfkin.kinematics.registry.entries import (
    LOST,
    Equation,
    Misprint,
    Section,
    equations,
    misprints,
    sections,
)
from urdfkin.kinematics.registry.pages import explain
from urdfkin.kinematics.registry.table import table

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
