"""Pinocchio's opinion of an analytical Jacobian: from its rotation and Jacobian, by `line_of_nodes`.

A frame's placement in another frame, by a witness: of both placements in the world.

What an accelerometer and a gyroscope read, by a witness: its accelerations, placements and velocities.

The walk has the base accelerated against gravity; here gravity is taken from the acceleration at the end, in
the sensor's axes, so that the two share neither the sign nor the way.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import cast

import numpy as np

from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray
from urdfkin.verify import bounds
from urdfkin.verify.analytical_reference import euler_jacobian, quaternion_jacobian
from urdfkin.verify.bounds import Bound, bound_of, imu_scale, magnitudes
from urdfkin.verify.call import Part
from urdfkin.verify.oracles import Witness
from urdfkin.verify.pinocchio import Oracle


def check_analytical_jacobian(
    bound_of: Callable[..., Bound], oracle: Oracle, x: Part, ours: FloatArray, by: Witness
) -> tuple[FloatArray, Bound]:
    """(n, frames, 6 or 7, nv) the same results by Pinocchio, and what the two are measured against.

    Args:
        bound_of: The bound of the Jacobian that they are made from.
        oracle: Pinocchio.
        x: What was asked.
        ours: What was handed out.
        by: Whose the oracle is.
    """
    aligned = Reference.LOCAL_WORLD_ALIGNED
    q, frames, base = x.asked.inputs[0], x.asked.frames, x.asked.base
    J_v = oracle.jacobians(q, frames, aligned, base)
    size = by.size(magnitudes(x.plan, x.q, None, None, x.state))
    bound = bound_of(x.plan, size, aligned)
    representation = str(x.options["representation"])
    if representation == "quaternion":
        quat = oracle.quaternions(q, frames, base)
        bound = bounds.quaternion_jacobian_bound(bound)
        theirs, hidden = quaternion_jacobian(quat, J_v), bounds.hidden_scalar(bound, quat.shape[:-1])
        # Of q and -q the one with qw >= 0 counts; where rounding hides the sign of qw, either does.
        with_other = (ours * theirs)[..., 3:, :].sum(axis=(-2, -1)) < 0.0
        turned = with_other & (np.abs(quat[..., 3]) <= hidden)
        theirs[..., 3:, :] *= np.where(turned, -1.0, 1.0)[..., np.newaxis, np.newaxis]
        return theirs, bound
    R = oracle.placements(q, frames, base)[..., :3, :3]
    theirs, apart = euler_jacobian(representation, R, J_v)
    return theirs, bounds.euler_jacobian_bound(bound, size, apart)


def check_relative_placement(
    bound_of: Callable[..., Bound], oracle: Oracle, x: Part, ours: FloatArray, by: Witness
) -> tuple[FloatArray, Bound]:
    """(n, frames, 4, 4) the same placements by a witness, and what the two are measured against.

    With a the frame that is looked from, s_a and s_b the lengths of both paths and k_a and k_b the roundings
    of each, R_a^T (p_b - p_a) is off by k_b s_b + k_a s_a for the positions and by k_a |p_b - p_a| for R_a:
    with |p_b - p_a| up to s_a + s_b, no more than (2 k_a + k_b) (s_a + s_b). The product of the rotations is
    off by k_a + k_b. The difference and the products themselves round some 5 eps more, which the joint that
    each k counts more than there is has room for.

    Args:
        bound_of: The bound of placements in the world.
        oracle: The witness's.
        x: What was asked; its plan meets the frames, and after them the one that is looked from.
        ours: What was handed out; the witness does not need it.
        by: Whose the oracle is.
    """
    (q,), other = x.asked.inputs, cast("str", x.options["relative_to"])
    T = oracle.placements(q, [*x.asked.frames, other])
    back = T[:, -1:, :3, :3].swapaxes(-1, -2)
    theirs = np.zeros((*T.shape[:1], T.shape[1] - 1, 4, 4))
    theirs[..., :3, :] = back @ T[:, :-1, :3, :]
    theirs[..., :3, 3] -= (back @ T[:, -1:, :3, 3:])[..., 0]
    theirs[..., 3, 3] = 1.0
    size = by.size(magnitudes(x.plan, x.q, None, None, x.state))
    world = bound_of(x.plan, replace(size, p=size.p + size.p[:, -1:]), None)
    return theirs, Bound(world.scale[:, :-1], world.k[:, :-1] + 2.0 * world.k[:, -1:])


_LOCAL = Reference.LOCAL


def check_imu(oracle: Oracle, x: Part, ours: FloatArray, by: Witness) -> tuple[FloatArray, Bound]:
    """(n, frames, 6) the same readings by a witness, and what the two are measured against.

    Args:
        oracle: The witness's.
        x: What was asked.
        ours: What was handed out; the witness does not need it.
        by: Whose the oracle is.
    """
    (q, v, a), frames, base = x.asked.inputs, x.asked.frames, x.asked.base
    v_flat, a_flat = x.rates
    gravity = np.asarray(x.options["gravity"], dtype=np.float64)
    R = oracle.placements(q, frames, base)[..., :3, :3]
    proper = oracle.accelerations(q, v, a, frames, _LOCAL, base)[..., :3] - gravity @ R  # R^T g
    w = oracle.velocities(q, v, frames, _LOCAL, base)[..., 3:]
    size = by.size(magnitudes(x.plan, x.q, v_flat, a_flat, x.state))
    return np.concatenate((proper, w), axis=-1), bound_of(imu_scale(size, gravity), 3, size, _LOCAL)
