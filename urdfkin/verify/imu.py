"""What an accelerometer and a gyroscope read, by a witness: its accelerations, placements and velocities.

The walk has the base accelerated against gravity; here gravity is taken from the acceleration at the end, in
the sensor's axes, so that the two share neither the sign nor the way.
"""

from __future__ import annotations

import numpy as np

from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray
from urdfkin.verify.bounds import Bound, bound_of, imu_scale
from urdfkin.verify.call import Part
from urdfkin.verify.magnitudes import magnitudes
from urdfkin.verify.pinocchio import Oracle
from urdfkin.verify.witnesses import Witness

_LOCAL = Reference.LOCAL


def held_against(oracle: Oracle, x: Part, ours: FloatArray, by: Witness) -> tuple[FloatArray, Bound]:
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
