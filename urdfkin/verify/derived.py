"""Derive expected results, and their bounds, from several results of an oracle.

| Quantity | Results of the oracle |
|---|---|
| analytical Jacobian | rotation and velocity Jacobian |
| relative placement | placements of both frames in the world |
| IMU reading | acceleration, placement and velocity |

urdfkin includes gravity in an IMU reading as an acceleration of the base. `derive_imu_reading` subtracts
gravity from the oracle's result, in the sensor's axes. Because the two methods differ, a wrong sign of
gravity or a wrong order of steps causes a disagreement.
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
from urdfkin.verify.bounds import Bound, compute_magnitudes, imu_scale, make_bound
from urdfkin.verify.call import CallPart
from urdfkin.verify.oracle import Oracle
from urdfkin.verify.oracles import OracleLibrary

#: The comparison reports inf and NaN, so NumPy need not warn.
_ignore_overflow = np.errstate(over="ignore", under="ignore", invalid="ignore")


@_ignore_overflow
def derive_analytical_jacobian(
    compute_bound: Callable[..., Bound], oracle: Oracle, x: CallPart, ours: FloatArray, library: OracleLibrary
) -> tuple[FloatArray, Bound]:
    """Return an oracle's analytical Jacobians, and a bound.

    `compute_bound` returns the bound on velocity Jacobians.
    """
    aligned = Reference.LOCAL_WORLD_ALIGNED
    J_v = oracle.jacobians(x.query._replace(reference=aligned))
    magnitudes = library.adapt_magnitudes(compute_magnitudes(x.plan, x.q, None, None, x.state))
    bound = compute_bound(x.plan, magnitudes, aligned)
    representation = str(x.options["representation"])
    if representation == "quaternion":
        quat = oracle.quaternions(x.query)
        bound = bounds.quaternion_jacobian_bound(bound)
        theirs = quaternion_jacobian(quat, J_v)
        # q and -q are the same rotation, and results have qw >= 0. If |qw| is below the rounding error,
        # rounding decides the sign of q, so both signs are accepted. The signs are compared with sums and
        # differences, because products could leave the range of doubles.
        same, other = (
            np.abs(x)[..., 3:, :].max(axis=(-2, -1), initial=0.0) for x in (ours - theirs, ours + theirs)
        )
        opposite = other < same
        flipped = opposite & (np.abs(quat[..., 3]) <= bounds.sign_limit(bound, quat.shape[:-1]))
        theirs[..., 3:, :] *= np.where(flipped, -1.0, 1.0)[..., np.newaxis, np.newaxis]
        return theirs, bound
    R = oracle.placements(x.query)[..., :3, :3]
    theirs, axis_sine = euler_jacobian(representation, R, J_v)
    return theirs, bounds.euler_jacobian_bound(bound, magnitudes, axis_sine)


@_ignore_overflow
def derive_relative_placement(
    compute_bound: Callable[..., Bound], oracle: Oracle, x: CallPart, ours: FloatArray, library: OracleLibrary
) -> tuple[FloatArray, Bound]:
    """Return an oracle's poses of the frames b relative to the frame a, and a bound.

    The last frame of `x.plan` is frame a.

        s_a, s_b: length of the path from the world origin to the frame
        k_a, k_b: allowed rounding errors of the frame's placement, in eps

    | Number | Source | Error at most, in eps |
    |---|---|---|
    | position R_a^T (p_b - p_a) | p_a and p_b | k_a s_a + k_b s_b |
    | position | R_a | k_a (s_a + s_b) |
    | position | sum | (2 k_a + k_b) (s_a + s_b) |
    | rotation R_a^T R_b | R_a and R_b | k_a + k_b |
    | both | p_b - p_a and products | about 5 |
    | both | allowed for the additional joint in k_a and in k_b | at least 24 > 5 |
    """
    other = cast("str", x.options["relative_to"])
    T = oracle.placements(x.query._replace(frames=[*x.query.frames, other]))
    R_a_world = T[:, -1:, :3, :3].swapaxes(-1, -2)
    theirs = np.zeros((*T.shape[:1], T.shape[1] - 1, 4, 4))
    theirs[..., :3, :] = R_a_world @ T[:, :-1, :3, :]
    theirs[..., :3, 3] -= (R_a_world @ T[:, -1:, :3, 3:])[..., 0]
    theirs[..., 3, 3] = 1.0
    magnitudes = library.adapt_magnitudes(compute_magnitudes(x.plan, x.q, None, None, x.state))
    world = compute_bound(x.plan, replace(magnitudes, p=magnitudes.p + magnitudes.p[:, -1:]), None)
    return theirs, Bound(world.scale[:, :-1], world.k[:, :-1] + 2.0 * world.k[:, -1:])


@_ignore_overflow
def derive_imu_reading(
    oracle: Oracle, x: CallPart, ours: FloatArray, library: OracleLibrary
) -> tuple[FloatArray, Bound]:
    local, (v, a) = Reference.LOCAL, x.rates
    query = x.query._replace(reference=local)
    gravity = np.asarray(x.options["gravity"], dtype=np.float64)
    R = oracle.placements(query)[..., :3, :3]
    proper_acceleration = oracle.accelerations(query)[..., :3] - gravity @ R  # `gravity @ R` equals R^T g.
    w = oracle.velocities(query)[..., 3:]
    magnitudes = library.adapt_magnitudes(compute_magnitudes(x.plan, x.q, v, a, x.state))
    bound = make_bound(imu_scale(magnitudes, gravity), 3, magnitudes, local)
    return np.concatenate((proper_acceleration, w), axis=-1), bound
