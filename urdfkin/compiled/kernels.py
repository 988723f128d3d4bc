"""The compiled walks, one for each quantity: functions of the address of a task (`task`).

The same one computes a batch, eight configurations at a time, and a single configuration, which then stands
in all eight lanes: one result for a configuration, to the last bit, wherever it stands.
"""

from __future__ import annotations

from urdfkin.compiled.axes import link_axes, world_axes
from urdfkin.compiled.compiling import core
from urdfkin.compiled.outputs import (
    column_jacobian,
    column_none,
    column_rate,
    emit_acceleration,
    emit_imu,
    emit_matrix,
    emit_pairs,
    emit_place,
    emit_velocity,
    follow_acceleration,
    follow_place,
    follow_velocity,
    keep_axis,
    keep_moving_axis,
    keep_none,
)
from urdfkin.compiled.recursion import forward_recursion


@core
def placements(task):
    """Places of frames: 7.77 with the rotations alongside."""
    return forward_recursion(task, world_axes, 1, follow_place, keep_none, column_none, emit_place)


@core
def velocities(task):
    """7.127, 7.128 in the world's axes."""
    return forward_recursion(task, world_axes, 2, follow_velocity, keep_none, column_none, emit_velocity)


@core
def local_velocities(task):
    """7.127, 7.128 in each frame's own axes."""
    return forward_recursion(task, link_axes, 2, follow_velocity, keep_none, column_none, emit_velocity)


@core
def accelerations(task):
    """7.129, 7.130 in the world's axes."""
    return forward_recursion(
        task, world_axes, 3, follow_acceleration, keep_none, column_none, emit_acceleration
    )


@core
def local_accelerations(task):
    """7.129, 7.130 in each frame's own axes."""
    return forward_recursion(
        task, link_axes, 3, follow_acceleration, keep_none, column_none, emit_acceleration
    )


@core
def jacobians(task):
    """7.85."""
    return forward_recursion(task, world_axes, 1, follow_place, keep_axis, column_jacobian, emit_matrix)


@core
def jacobian_rates(task):
    """The J-dot of 7.126."""
    return forward_recursion(task, world_axes, 2, follow_velocity, keep_moving_axis, column_rate, emit_matrix)


@core
def hessians(task):
    """The derivatives of 7.85 by each rate: a kernel that only those wait for who ask for it."""
    return forward_recursion(task, world_axes, 1, follow_place, keep_axis, column_jacobian, emit_pairs)


@core
def imus(task):
    """7.127, 7.129, 7.130 in each frame's own axes: acceleration and angular velocity."""
    return forward_recursion(task, link_axes, 3, follow_acceleration, keep_none, column_none, emit_imu)
