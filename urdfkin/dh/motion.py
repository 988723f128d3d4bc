"""Compute velocity, Jacobian and acceleration of a table's tip by the textbook's recursion on its frames.

The module uses equations 7.85 and 7.127 to 7.130, with d_{i-1,i} = d_i z_{i-1} + a_i x_i (7.64). The forward
recursion of `urdfkin.compiled` runs on a tree whose joint frames are the table's frames. In this tree every
mimic joint has its own coordinate. The module applies the mimic rules separately. The joint values are G q +
g. Let J_rows be the tree's Jacobian, with one column for each row. Then the Jacobian with mimic rules is J =
J_rows G.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from urdfkin.compiled.evaluate import accelerations, jacobians, velocities
from urdfkin.compiled.plan import CompiledTree, compile_tree
from urdfkin.dh.convert import free_tree
from urdfkin.dh.table import DHTable
from urdfkin.model.configuration_like import Given
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray

#: Number of cached compiled tables
_TABLES = 64


@lru_cache(_TABLES)
def plan_of(table: DHTable) -> CompiledTree:
    tree = free_tree(table)
    return compile_tree(tree, [len(tree.links) - 1])


def jacobian(
    table: DHTable, q: Given, reference: Reference | str = Reference.LOCAL_WORLD_ALIGNED
) -> FloatArray:
    """Return the (..., 6, coordinates) Jacobian of the tip, [linear; angular] (7.85).

    `q` (..., coordinates) is in the order of `joint_names` (rad or m), or a mapping by name. The world is the
    table's base frame. If `q` has the wrong length, InputError is raised.
    """
    shape, (values,) = _flat(table, table.coupling.values(q))
    J = jacobians(plan_of(table), values, Reference.of(reference))[:, 0] @ table.coupling.matrix
    return np.ascontiguousarray(J.reshape(*shape, 6, len(table.joint_names)))


def velocity(
    table: DHTable, q: Given, v: Given, reference: Reference | str = Reference.LOCAL_WORLD_ALIGNED
) -> FloatArray:
    """Return the (..., 6) velocity of the tip, [linear; angular] (7.127, 7.128); batches broadcast.

    The arguments are as in `jacobian`, with `v` in rad/s or m/s.
    """
    shape, (values, rates) = _flat(table, table.coupling.values(q), _joint_derivatives(table, v, "v"))
    return velocities(plan_of(table), values, rates, Reference.of(reference)).reshape(*shape, 6)


def acceleration(
    table: DHTable, q: Given, v: Given, a: Given, reference: Reference | str = Reference.LOCAL_WORLD_ALIGNED
) -> FloatArray:
    """Return the (..., 6) classical acceleration of the tip, [linear; angular] (7.129, 7.130).

    The arguments are as in `velocity`, with `a` in rad/s^2 or m/s^2.
    """
    arrays = (table.coupling.values(q), _joint_derivatives(table, v, "v"), _joint_derivatives(table, a, "a"))
    shape, (values, velocities_, accelerations_) = _flat(table, *arrays)
    found = accelerations(plan_of(table), values, velocities_, accelerations_, Reference.of(reference))
    return found.reshape(*shape, 6)


def _joint_derivatives(table: DHTable, rates: Given, what: str) -> FloatArray:
    """Convert velocities (or accelerations) of the coordinates to velocities (..., rows) of all joints."""
    return table.coupling.checked(rates, what) @ table.coupling.matrix.T


def _flat(table: DHTable, *arrays: FloatArray) -> tuple[tuple[int, ...], list[FloatArray]]:
    """Broadcast the arrays; return their common batch shape, and the arrays with shape (n, rows)."""
    shape = np.broadcast_shapes(*(array.shape[:-1] for array in arrays))
    rows = len(table.rows)
    wide = [np.broadcast_to(array, (*shape, rows)).reshape(math.prod(shape), rows) for array in arrays]
    return shape, [np.ascontiguousarray(array) for array in wide]
