"""Forward recursions in Python, one function for each quantity.

The equations are 7.77 (positions of frames), 7.127 and 7.128 (velocities), 7.129 and 7.130 (accelerations),
7.85 (Jacobians) and 7.126 (Jacobian rates). Functions `local_...` compute in each frame's own axes.

`urdfkin.compiled.machine.kernels` compiles a copy of each function. The copy is called a kernel. The argument
of a kernel is the address of the integers that `KernelArgs` describes. Python code passes lists instead of
addresses. The result is 1 if an input is nan, infinite or too large, else 0.
"""

from __future__ import annotations

from urdfkin.compiled.outputs import (
    state_for_acceleration,
    state_for_placement,
    state_for_velocity,
    store_axis,
    store_moving_axis,
    store_no_axis,
    write_acceleration,
    write_hessian,
    write_imu,
    write_jacobian_column,
    write_jacobian_rate_column,
    write_matrix,
    write_no_column,
    write_placement,
    write_velocity,
)
from urdfkin.compiled.recursion import forward_recursion, select_link_axes, select_world_axes


def placements(args):
    return forward_recursion(
        args, select_world_axes, 1, state_for_placement, store_no_axis, write_no_column, write_placement
    )


def velocities(args):
    return forward_recursion(
        args, select_world_axes, 2, state_for_velocity, store_no_axis, write_no_column, write_velocity
    )


def local_velocities(args):
    return forward_recursion(
        args, select_link_axes, 2, state_for_velocity, store_no_axis, write_no_column, write_velocity
    )


def accelerations(args):
    return forward_recursion(
        args, select_world_axes, 3, state_for_acceleration, store_no_axis, write_no_column, write_acceleration
    )


def local_accelerations(args):
    return forward_recursion(
        args, select_link_axes, 3, state_for_acceleration, store_no_axis, write_no_column, write_acceleration
    )


def jacobians(args):
    return forward_recursion(
        args, select_world_axes, 1, state_for_placement, store_axis, write_jacobian_column, write_matrix
    )


def jacobian_rates(args):
    return forward_recursion(
        args,
        select_world_axes,
        2,
        state_for_velocity,
        store_moving_axis,
        write_jacobian_rate_column,
        write_matrix,
    )


def hessians(args):
    return forward_recursion(
        args, select_world_axes, 1, state_for_placement, store_axis, write_jacobian_column, write_hessian
    )


def imus(args):
    return forward_recursion(
        args, select_link_axes, 3, state_for_acceleration, store_no_axis, write_no_column, write_imu
    )
