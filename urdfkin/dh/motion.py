"""Compute velocity, Jacobian and acceleration of a table's tip by a recursion over the table's frames.

The recursion uses equations 7.85 and 7.127 to 7.130 of the textbook, with d_{i-1,i} = d_i z_{i-1} + a_i x_i
(7.64). The recursion runs on a tree with the table's frames as joint frames. This tree has one coordinate for
each row. With mimic rules, the joint values are G q + g, and the table's Jacobian is J_rows G. Here J_rows is
the tree's Jacobian.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from urdfkin.compiled.evaluate import accelerations, jacobians, velocities
from urdfkin.compiled.plan import CompiledTree, compile_tree
from urdfkin.dh.convert import to_free_tree
from urdfkin.dh.table import DHTable
from urdfkin.kinematics.inputs import common_batch_shape
from urdfkin.model.configuration_like import ConfigurationLike
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray


@lru_cache(maxsize=64)
def _compile_table(table: DHTable) -> CompiledTree:
    tree = to_free_tree(table)
    return compile_tree(tree, [len(tree.links) - 1])


def jacobian(
    table: DHTable, q: ConfigurationLike, reference: Reference | str = Reference.LOCAL_WORLD_ALIGNED
) -> FloatArray:
    """Return the tip's Jacobian (equation 7.85).

    The world is the table's base frame.
    `q` (..., coordinates) is in the order of `joint_names` (rad or m).

    Returns:
        (..., 6, coordinates), [linear; angular].
    """
    shape, (values,) = _flatten(table, table.coupling.values(q))
    J = jacobians(_compile_table(table), values, Reference.of(reference))[:, 0] @ table.coupling.matrix
    return np.ascontiguousarray(J.reshape(*shape, 6, len(table.joint_names)))


def velocity(
    table: DHTable,
    q: ConfigurationLike,
    v: ConfigurationLike,
    reference: Reference | str = Reference.LOCAL_WORLD_ALIGNED,
) -> FloatArray:
    """Return the tip's velocity (equations 7.127, 7.128).

    `v` is in rad/s or m/s.

    Returns:
        (..., 6), [linear; angular].
    """
    shape, (values, rates) = _flatten(table, table.coupling.values(q), _joint_derivatives(table, v, "v"))
    return velocities(_compile_table(table), values, rates, Reference.of(reference)).reshape(*shape, 6)


def acceleration(
    table: DHTable,
    q: ConfigurationLike,
    v: ConfigurationLike,
    a: ConfigurationLike,
    reference: Reference | str = Reference.LOCAL_WORLD_ALIGNED,
) -> FloatArray:
    """Return the tip's classical acceleration (equations 7.129, 7.130).

    `a` is in rad/s^2 or m/s^2.

    Returns:
        (..., 6), [linear; angular].
    """
    arrays = (table.coupling.values(q), _joint_derivatives(table, v, "v"), _joint_derivatives(table, a, "a"))
    shape, (values, velocities_, accelerations_) = _flatten(table, *arrays)
    tree = _compile_table(table)
    return accelerations(tree, values, velocities_, accelerations_, Reference.of(reference)).reshape(
        *shape, 6
    )


def _joint_derivatives(table: DHTable, rates: ConfigurationLike, what: str) -> FloatArray:
    return table.coupling.parse(rates, what) @ table.coupling.matrix.T


def _flatten(table: DHTable, *arrays: FloatArray) -> tuple[tuple[int, ...], list[FloatArray]]:
    """Return the common batch shape, and arrays (number of configurations, rows)."""
    shape = common_batch_shape(array.shape[:-1] for array in arrays)
    rows = len(table.rows)
    flat = [np.broadcast_to(array, (*shape, rows)).reshape(math.prod(shape), rows) for array in arrays]
    return shape, [np.ascontiguousarray(array) for array in flat]
