"""Python code for CasADi: the pose as an expression of SX, MX or DM, for functions and their derivatives."""

from __future__ import annotations

from urdfkin.dh.export.symbols import Doubles, module
from urdfkin.dh.table import DHTable
from urdfkin.dh.units import Units

_IMPORTS = '''from casadi import cos, horzcat, sin, vertcat, vertsplit


def matrix(rows):
    """Row by row."""
    return vertcat(*(horzcat(*row) for row in rows))'''


def write(table: DHTable, units: Units) -> str:
    """A module with `placement(q)`, for a column `q = SX.sym("q", 6)`."""
    del units
    return module(table, Doubles(), _IMPORTS, "numbers of a column SX, MX or DM", "vertsplit(q)")
