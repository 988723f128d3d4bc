"""The recursions, one for each quantity. Each takes its arguments (`kernel_args`), and returns 0 or 1.

A function runs on Python's numbers as it is, with lists instead of addresses. The kernel of the same name
computes eight configurations at a time (`urdfkin.compiled.machine.kernels`), with the same bits.
"""

from __future__ import annotations

from urdfkin.compiled.axes import link_axes, world_axes
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


def placements(task):
    """Placements of frames: the positions of 7.77, and the rotations."""
    return forward_recursion(task, world_axes, 1, follow_place, keep_none, column_none, emit_place)


def velocities(task):
    """Velocities, 7.127 and 7.128, in the world's axes."""
    return forward_recursion(task, world_axes, 2, follow_velocity, keep_none, column_none, emit_velocity)


def local_velocities(task):
    """Velocities, 7.127 and 7.128, in each frame's own axes."""
    return forward_recursion(task, link_axes, 2, follow_velocity, keep_none, column_none, emit_velocity)


def accelerations(task):
    """Accelerations, 7.129 and 7.130, in the world's axes."""
    return forward_recursion(
        task, world_axes, 3, follow_acceleration, keep_none, column_none, emit_acceleration
    )


def local_accelerations(task):
    """Accelerations, 7.129 and 7.130, in each frame's own axes."""
    return forward_recursion(
        task, link_axes, 3, follow_acceleration, keep_none, column_none, emit_acceleration
    )


def jacobians(task):
    """Jacobians, 7.85."""
    return forward_recursion(task, world_axes, 1, follow_place, keep_axis, column_jacobian, emit_matrix)


def jacobian_rates(task):
    """Time derivatives of the Jacobians: J-dot of 7.126."""
    return forward_recursion(task, world_axes, 2, follow_velocity, keep_moving_axis, column_rate, emit_matrix)


def hessians(task):
    """Derivatives of the Jacobian columns (7.85) by each joint velocity; compiled only when needed."""
    return forward_recursion(task, world_axes, 1, follow_place, keep_axis, column_jacobian, emit_pairs)


def imus(task):
    """Accelerometer and gyroscope readings, 7.127, 7.129 and 7.130, in each frame's own axes."""
    return forward_recursion(task, link_axes, 3, follow_acceleration, keep_none, column_none, emit_imu)
