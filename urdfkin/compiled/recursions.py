"""One forward recursion for each quantity, in Python; `urdfkin.compiled.machine.kernels` compiles copies.

The equations are 7.77 (positions of frames), 7.127 and 7.128 (velocities), 7.129 and 7.130 (accelerations),
7.85 (Jacobians) and 7.126 (Jacobian rates). Functions `local_...` compute in each frame's own axes.

The argument of a kernel is the address of the integers that `KernelArgs` describes; Python code passes lists
instead of addresses. The result is 1 if an input is nan, infinite or too large, else 0.
"""

from __future__ import annotations

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
    mask_acceleration,
    mask_place,
    mask_velocity,
    store_axis,
    store_moving_axis,
    store_none,
)
from urdfkin.compiled.recursion import forward_recursion, link_axes, world_axes


def placements(task):
    return forward_recursion(task, world_axes, 1, mask_place, store_none, column_none, emit_place)


def velocities(task):
    return forward_recursion(task, world_axes, 2, mask_velocity, store_none, column_none, emit_velocity)


def local_velocities(task):
    return forward_recursion(task, link_axes, 2, mask_velocity, store_none, column_none, emit_velocity)


def accelerations(task):
    return forward_recursion(
        task, world_axes, 3, mask_acceleration, store_none, column_none, emit_acceleration
    )


def local_accelerations(task):
    return forward_recursion(
        task, link_axes, 3, mask_acceleration, store_none, column_none, emit_acceleration
    )


def jacobians(task):
    return forward_recursion(task, world_axes, 1, mask_place, store_axis, column_jacobian, emit_matrix)


def jacobian_rates(task):
    return forward_recursion(task, world_axes, 2, mask_velocity, store_moving_axis, column_rate, emit_matrix)


def hessians(task):
    """Compute the derivative of each Jacobian column with respect to each joint's motion."""
    return forward_recursion(task, world_axes, 1, mask_place, store_axis, column_jacobian, emit_pairs)


def imus(task):
    """Compute accelerometer and gyroscope readings in each frame's own axes."""
    return forward_recursion(task, link_axes, 3, mask_acceleration, store_none, column_none, emit_imu)
