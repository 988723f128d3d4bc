"""Arrays in, arrays out: the compiled walks behind three plain functions.

Inputs are flat batches, (n, nq) and (n, nv), already checked; `urdfkin.robot` checks, reshapes and verifies.
"""

from __future__ import annotations

import numpy as np

from urdfkin.recursion.base import STILL_STATE
from urdfkin.recursion.lanes import LANES
from urdfkin.recursion.plan import Plan
from urdfkin.recursion.walk import scratch_rows
from urdfkin.reference import Reference
from urdfkin.tree import FloatArray

_ALIGNED = Reference.LOCAL_WORLD_ALIGNED


def _scratch(plan: Plan) -> FloatArray:
    return np.empty(scratch_rows(plan.slots, len(plan.columns)) * LANES)


def _motion(
    plan: Plan,
    order: int,
    q: FloatArray,
    v: FloatArray,
    a: FloatArray,
    reference: Reference,
    base: FloatArray,
    out: FloatArray | None,
) -> FloatArray:
    width = 6 if order else 16
    if out is None:
        out = np.empty((len(q), len(plan.frames), width))
    if order and reference is Reference.LOCAL:
        return _local_motion(plan, order, q, v, a, base, out)
    from urdfkin.recursion.motion_kernel import motion  # noqa: PLC0415  compiled when first needed

    motion(
        order,
        int(reference),
        plan.steps,
        plan.geometry,
        plan.frames,
        plan.offsets,
        base,
        q,
        v,
        a,
        out,
        _scratch(plan),
    )
    return out


def _local_motion(
    plan: Plan,
    order: int,
    q: FloatArray,
    v: FloatArray,
    a: FloatArray,
    base: FloatArray,
    out: FloatArray,
) -> FloatArray:
    from urdfkin.recursion.local_kernel import local_motion  # noqa: PLC0415  compiled when first needed

    local_motion(
        order, plan.steps, plan.geometry, plan.frames, plan.offsets, base, q, v, a, out, _scratch(plan)
    )
    return out


def placements(
    plan: Plan, q: FloatArray, *, base: FloatArray = STILL_STATE, out: FloatArray | None = None
) -> FloatArray:
    """(n, frames, 4, 4) T_world_frame: 7.77 with the rotations alongside."""
    flat = None if out is None else out.reshape(len(q), len(plan.frames), 16)
    return _motion(plan, 0, q, q, q, _ALIGNED, base, flat).reshape(len(q), len(plan.frames), 4, 4)


def velocities(
    plan: Plan,
    q: FloatArray,
    v: FloatArray,
    reference: Reference = _ALIGNED,
    *,
    base: FloatArray = STILL_STATE,
    out: FloatArray | None = None,
) -> FloatArray:
    """(n, frames, 6) [linear; angular]: 7.127, 7.128."""
    return _motion(plan, 1, q, v, v, reference, base, out)


def accelerations(
    plan: Plan,
    q: FloatArray,
    v: FloatArray,
    a: FloatArray,
    reference: Reference = _ALIGNED,
    *,
    base: FloatArray = STILL_STATE,
    out: FloatArray | None = None,
) -> FloatArray:
    """(n, frames, 6) [linear; angular], classical: 7.129, 7.130."""
    return _motion(plan, 2, q, v, a, reference, base, out)


def jacobians(
    plan: Plan,
    q: FloatArray,
    reference: Reference = _ALIGNED,
    *,
    base: FloatArray = STILL_STATE,
    out: FloatArray | None = None,
) -> FloatArray:
    """(n, frames, 6, nv) velocity Jacobians: 7.85."""
    if out is None:
        out = np.empty((len(q), len(plan.frames), 6, plan.nv))
    from urdfkin.recursion.jacobian_kernel import jacobian  # noqa: PLC0415  compiled when first needed

    jacobian(
        int(reference),
        plan.steps,
        plan.geometry,
        plan.slots,
        plan.frames,
        plan.offsets,
        plan.columns,
        plan.multipliers,
        plan.uses,
        plan.idle,
        base,
        q,
        out,
        _scratch(plan),
    )
    return out


def jacobian_rates(
    plan: Plan,
    q: FloatArray,
    v: FloatArray,
    reference: Reference = _ALIGNED,
    *,
    base: FloatArray = STILL_STATE,
    out: FloatArray | None = None,
) -> FloatArray:
    """(n, frames, 6, nv) time derivatives of the velocity Jacobians: the J-dot of 7.126."""
    if out is None:
        out = np.empty((len(q), len(plan.frames), 6, plan.nv))
    from urdfkin.recursion import jacobian_rate_kernel as compiled  # noqa: PLC0415  compiled when first needed

    compiled.jacobian_rate(
        int(reference),
        plan.steps,
        plan.geometry,
        plan.slots,
        plan.frames,
        plan.offsets,
        plan.columns,
        plan.multipliers,
        plan.uses,
        plan.idle,
        base,
        q,
        v,
        out,
        np.empty(compiled.scratch_rows(plan.slots, len(plan.columns)) * LANES),
    )
    return out
