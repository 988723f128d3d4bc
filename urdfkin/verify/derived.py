"""Checks of quantities that are derived from several results of an oracle.

| Quantity | Results of the oracle from which it is computed | |---|---| | analytical Jacobian | rotation and
Jacobian, with `urdfkin.verify.analytical_reference` | | relative placement | placements of both frames in the
world | | IMU reading | acceleration, placement and velocity |

urdfkin's forward recursion includes gravity as an acceleration of the base, but the check of an IMU reading
subtracts gravity at the end, in the sensor's axes. An error of sign or order in one of them therefore leads
to a disagreement.
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
from urdfkin.verify.oracle import Oracle
from urdfkin.verify.oracles import OracleLibrary


def check_analytical_jacobian(
    bound_of: Callable[..., Bound], oracle: Oracle, x: Part, ours: FloatArray, by: OracleLibrary
) -> tuple[FloatArray, Bound]:
    """Return analytical Jacobians (n, frames, 6 or 7, nv) from an oracle, and their bound.

    If rounding errors hide the sign of a quaternion, the oracle's quaternion gets the sign of urdfkin's.
    `bound_of` computes the bound of the velocity Jacobian.
    """
    aligned = Reference.LOCAL_WORLD_ALIGNED
    J_v = oracle.jacobians(x.query._replace(reference=aligned))
    size = by.size(magnitudes(x.plan, x.q, None, None, x.state))
    bound = bound_of(x.plan, size, aligned)
    representation = str(x.options["representation"])
    if representation == "quaternion":
        quat = oracle.quaternions(x.query)
        bound = bounds.quaternion_jacobian_bound(bound)
        theirs, hidden = quaternion_jacobian(quat, J_v), bounds.hidden_scalar(bound, quat.shape[:-1])
        # The quaternions q and -q are the same rotation, and the one with qw >= 0 is used.
        # If rounding hides the sign of qw, both quaternions are accepted.
        with_other = (ours * theirs)[..., 3:, :].sum(axis=(-2, -1)) < 0.0
        turned = with_other & (np.abs(quat[..., 3]) <= hidden)
        theirs[..., 3:, :] *= np.where(turned, -1.0, 1.0)[..., np.newaxis, np.newaxis]
        return theirs, bound
    R = oracle.placements(x.query)[..., :3, :3]
    theirs, apart = euler_jacobian(representation, R, J_v)
    return theirs, bounds.euler_jacobian_bound(bound, size, apart)


def check_relative_placement(
    bound_of: Callable[..., Bound], oracle: Oracle, x: Part, ours: FloatArray, by: OracleLibrary
) -> tuple[FloatArray, Bound]:
    """Return the oracle's relative placements (n, frames, 4, 4), and the bound on urdfkin's error.

    A relative placement is the pose of frame b relative to frame a, the last frame of `x.plan`. Let s_a and
    s_b be the path lengths of the frames. Let k_a and k_b be the numbers of roundings of their placements.
    The position is R_a^T (p_b - p_a). All errors below are in multiples of eps. The errors of p_a and p_b
    contribute at most k_b s_b + k_a s_a to the error of the position. The error of R_a contributes at most
    k_a |p_b - p_a|. Since |p_b - p_a| <= s_a + s_b, the sum of these errors is at most (2 k_a + k_b) (s_a +
    s_b). The error of the rotation R_a^T R_b is at most k_a + k_b. Computing the difference p_b - p_a and the
    products causes a rounding error of about 5 eps. This error needs no additional bound, because k_a and k_b
    each count one joint more than the path contains. `bound_of` computes the bound of placements in the
    world.
    """
    other = cast("str", x.options["relative_to"])
    T = oracle.placements(x.query._replace(frames=[*x.query.frames, other]))
    back = T[:, -1:, :3, :3].swapaxes(-1, -2)
    theirs = np.zeros((*T.shape[:1], T.shape[1] - 1, 4, 4))
    theirs[..., :3, :] = back @ T[:, :-1, :3, :]
    theirs[..., :3, 3] -= (back @ T[:, -1:, :3, 3:])[..., 0]
    theirs[..., 3, 3] = 1.0
    size = by.size(magnitudes(x.plan, x.q, None, None, x.state))
    world = bound_of(x.plan, replace(size, p=size.p + size.p[:, -1:]), None)
    return theirs, Bound(world.scale[:, :-1], world.k[:, :-1] + 2.0 * world.k[:, -1:])


_LOCAL = Reference.LOCAL


def check_imu(oracle: Oracle, x: Part, ours: FloatArray, by: OracleLibrary) -> tuple[FloatArray, Bound]:
    """Return IMU readings (n, frames, 6) from an oracle, and their bound."""
    query, (v_flat, a_flat) = x.query._replace(reference=_LOCAL), x.rates
    gravity = np.asarray(x.options["gravity"], dtype=np.float64)
    R = oracle.placements(query)[..., :3, :3]
    proper = oracle.accelerations(query)[..., :3] - gravity @ R  # the product is R^T g
    w = oracle.velocities(query)[..., 3:]
    size = by.size(magnitudes(x.plan, x.q, v_flat, a_flat, x.state))
    return np.concatenate((proper, w), axis=-1), bound_of(imu_scale(size, gravity), 3, size, _LOCAL)
