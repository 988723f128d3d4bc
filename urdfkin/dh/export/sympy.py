"""Python code for SymPy: pi/2 stays pi/2 and 0.425 is 17/40, so that what algebra makes of it is exact."""

from __future__ import annotations

from urdfkin.dh.export.symbols import Fractions, module
from urdfkin.dh.table import DHTable
from urdfkin.dh.units import Units

_IMPORTS = "from sympy import Matrix as matrix\nfrom sympy import Rational, cos, pi, sin"


def write(table: DHTable, units: Units) -> str:
    """A module with `placement(q)`, for `q = symbols("q1:7")` or numbers."""
    del units
    return module(table, Fractions(), _IMPORTS, "symbols or numbers")
