"""The compiled recursions, one for each quantity. Each takes the address of its arguments (`kernel_args`).

A kernel computes eight configurations at a time, one in each lane. For a single configuration, all eight
lanes compute that configuration. The result of a configuration therefore has the same bits at every position
of a batch.
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
    """Placements of frames: the positions of 7.77, and the rotations."""
    return forward_recursion(task, world_axes, 1, follow_place, keep_none, column_none, emit_place)


@core
def velocities(task):
    """Velocities, 7.127 and 7.128, in the world's axes."""
    return forward_recursion(task, world_axes, 2, follow_velocity, keep_none, column_none, emit_velocity)


@core
def local_velocities(task):
    """Velocities, 7.127 and 7.128, in each frame's own axes."""
    return forward_recursion(task, link_axes, 2, follow_velocity, keep_none, column_none, emit_velocity)


@core
def accelerations(task):
    """Accelerations, 7.129 and 7.130, in the world's axes."""
    return forward_recursion(
        task, world_axes, 3, follow_acceleration, keep_none, column_none, emit_acceleration
    )


@core
def local_accelerations(task):
    """Accelerations, 7.129 and 7.130, in each frame's own axes."""
    return forward_recursion(
        task, link_axes, 3, follow_acceleration, keep_none, column_none, emit_acceleration
    )


@core
def jacobians(task):
    """Jacobians, 7.85."""
    return forward_recursion(task, world_axes, 1, follow_place, keep_axis, column_jacobian, emit_matrix)


@core
def jacobian_rates(task):
    """Time derivatives of the Jacobians: J-dot of 7.126."""
    return forward_recursion(task, world_axes, 2, follow_velocity, keep_moving_axis, column_rate, emit_matrix)


@core
def hessians(task):
    """Derivatives of the Jacobian columns (7.85) by each joint velocity; compiled only when needed."""
    return forward_recursion(task, world_axes, 1, follow_place, keep_axis, column_jacobian, emit_pairs)


@core
def imus(task):
    """Accelerometer and gyroscope readings, 7.127, 7.129 and 7.130, in each frame's own axes."""
    return forward_recursion(task, link_axes, 3, follow_acceleration, keep_none, column_none, emit_imu)
