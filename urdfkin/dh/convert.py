"""From one convention to the other: the same factors, bracketed differently.

    standard   base . (S_1 X_1) (S_2 X_2) ... (S_n X_n) . tool
    modified   base' . (X_0 S_1) (X_1 S_2) ... (X_{n-1} S_n) . tool'

X_n moves into the tool on the way to modified, and X_0 into the base on the way back. Where base or tool is
itself a step Tx(a) Rx(alpha), it moves into the row that gained a place, so that both ways undo each other.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from urdfkin.dh.elements import as_step
from urdfkin.dh.row import Convention, convention_of
from urdfkin.dh.table import DHTable
from urdfkin.model.tree import FloatArray


def to_convention(table: DHTable, convention: str) -> DHTable:
    """The same table in a convention by name; raises InputError for an unknown one."""
    wanted = convention_of(convention)
    if wanted is table.convention or not table.rows:
        return replace(table, convention=wanted)
    return to_modified(table) if wanted is Convention.MODIFIED else to_standard(table)


def to_modified(table: DHTable) -> DHTable:
    """A standard table as a modified one: row i takes a, alpha and beta from row i - 1."""
    first = as_step(table.base)
    steps = [(*(first or (0.0, 0.0)), 0.0), *((row.a, row.alpha, row.beta) for row in table.rows[:-1])]
    base = np.eye(4) if first else table.base
    return _with(table, Convention.MODIFIED, steps, base, table.rows[-1].X @ table.tool)


def to_standard(table: DHTable) -> DHTable:
    """A modified table as a standard one: row i takes a, alpha and beta from row i + 1."""
    last = as_step(table.tool)
    steps = [*((row.a, row.alpha, row.beta) for row in table.rows[1:]), (*(last or (0.0, 0.0)), 0.0)]
    tool = np.eye(4) if last else table.tool
    return _with(table, Convention.STANDARD, steps, table.base @ table.rows[0].X, tool)


def _with(
    table: DHTable,
    convention: Convention,
    steps: list[tuple[float, float, float]],
    base: FloatArray,
    tool: FloatArray,
) -> DHTable:
    rows = tuple(
        replace(row, a=a, alpha=alpha, beta=beta)
        for row, (a, alpha, beta) in zip(table.rows, steps, strict=True)
    )
    return replace(table, convention=convention, rows=rows, base=base, tool=tool)
