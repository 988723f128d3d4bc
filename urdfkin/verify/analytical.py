"""Pinocchio's opinion of an analytical Jacobian: from its rotation and Jacobian, by `line_of_nodes`."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray
from urdfkin.verify import bounds
from urdfkin.verify.bounds import Bound
from urdfkin.verify.call import Part
from urdfkin.verify.line_of_nodes import euler_jacobian, quaternion_jacobian
from urdfkin.verify.magnitudes import magnitudes
from urdfkin.verify.pinocchio import Oracle
from urdfkin.verify.witnesses import Witness


def held_against(
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
