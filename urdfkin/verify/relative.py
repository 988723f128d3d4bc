"""A frame's placement in another frame, by a witness: of both placements in the world."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import cast

import numpy as np

from urdfkin.model.tree import FloatArray
from urdfkin.verify.bounds import Bound
from urdfkin.verify.call import Part
from urdfkin.verify.magnitudes import magnitudes
from urdfkin.verify.pinocchio import Oracle
from urdfkin.verify.witnesses import Witness


def held_against(
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
