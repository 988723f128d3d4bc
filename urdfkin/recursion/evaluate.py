"""Arrays in, arrays out: the compiled walks behind plain functions.

Inputs are flat batches, (n, nq) and (n, nv), already checked; `urdfkin.robot` checks, reshapes and verifies.
A kernel is loaded when it is first needed, so that a first use compiles only what it needs.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from urdfkin.recursion.base import STILL_STATE
from urdfkin.recursion.batch import in_blocks
from urdfkin.recursion.lanes import LANES
from urdfkin.recursion.plan import Plan
from urdfkin.recursion.walk import scratch_rows
from urdfkin.reference import Reference
from urdfkin.tree import FloatArray

_ALIGNED = Reference.LOCAL_WORLD_ALIGNED


def placements(
    plan: Plan,
    q: FloatArray,
    *,
    base: FloatArray = STILL_STATE,
    out: FloatArray | None = None,
    threads: int | None = None,
) -> FloatArray:
    """(n, frames, 4, 4) T_world_frame: 7.77 with the rotations alongside."""
    flat = np.empty((len(q), len(plan.frames), 16)) if out is None else out.reshape(len(q), -1, 16)
    _motion(plan, 0, [q, q, q], _ALIGNED, base, flat, threads)
    return flat.reshape(len(q), len(plan.frames), 4, 4)


def velocities(
    plan: Plan,
    q: FloatArray,
    v: FloatArray,
    reference: Reference = _ALIGNED,
    *,
    base: FloatArray = STILL_STATE,
    out: FloatArray | None = None,
    threads: int | None = None,
) -> FloatArray:
    """(n, frames, 6) [linear; angular]: 7.127, 7.128."""
    out = np.empty((len(q), len(plan.frames), 6)) if out is None else out
    _motion(plan, 1, [q, v, v], reference, base, out, threads)
    return out


def accelerations(
    plan: Plan,
    q: FloatArray,
    v: FloatArray,
    a: FloatArray,
    reference: Reference = _ALIGNED,
    *,
    base: FloatArray = STILL_STATE,
    out: FloatArray | None = None,
    threads: int | None = None,
) -> FloatArray:
    """(n, frames, 6) [linear; angular], classical: 7.129, 7.130."""
    out = np.empty((len(q), len(plan.frames), 6)) if out is None else out
    _motion(plan, 2, [q, v, a], reference, base, out, threads)
    return out


def _motion(
    plan: Plan,
    order: int,
    qva: Sequence[FloatArray],
    reference: Reference,
    base: FloatArray,
    out: FloatArray,
    threads: int | None,
) -> None:
    walk = plan.steps, plan.geometry, plan.frames, plan.offsets
    if order and reference is Reference.LOCAL:
        from urdfkin.recursion.local_kernel import local_motion  # noqa: PLC0415

        def compute(x: Sequence[FloatArray], part: FloatArray) -> None:
            local_motion(order, *walk, *x, part, _scratch(plan))
    else:
        from urdfkin.recursion.motion_kernel import motion  # noqa: PLC0415

        def compute(x: Sequence[FloatArray], part: FloatArray) -> None:
            motion(order, int(reference), *walk, *x, part, _scratch(plan))

    in_blocks(compute, [base, *qva], out, threads)


def jacobians(
    plan: Plan,
    q: FloatArray,
    reference: Reference = _ALIGNED,
    *,
    base: FloatArray = STILL_STATE,
    out: FloatArray | None = None,
    threads: int | None = None,
) -> FloatArray:
    """(n, frames, 6, nv) velocity Jacobians: 7.85."""
    from urdfkin.recursion.jacobian_kernel import jacobian  # noqa: PLC0415

    out = np.empty((len(q), len(plan.frames), 6, plan.nv)) if out is None else out
    in_blocks(
        lambda x, part: jacobian(int(reference), *_columns(plan), *x, part, _scratch(plan)),
        [base, q],
        out,
        threads,
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
    threads: int | None = None,
) -> FloatArray:
    """(n, frames, 6, nv) time derivatives of the velocity Jacobians: the J-dot of 7.126."""
    from urdfkin.recursion import jacobian_rate_kernel as compiled  # noqa: PLC0415

    out = np.empty((len(q), len(plan.frames), 6, plan.nv)) if out is None else out
    rows = compiled.scratch_rows(plan.slots, len(plan.columns))
    in_blocks(
        lambda x, part: compiled.jacobian_rate(
            int(reference), *_columns(plan), *x, part, np.empty(rows * LANES)
        ),
        [base, q, v],
        out,
        threads,
    )
    return out


def _columns(plan: Plan) -> tuple[object, ...]:
    """What the kernels with columns take of a plan, in their order."""
    return (
        plan.steps,
        plan.geometry,
        plan.slots,
        plan.frames,
        plan.offsets,
        plan.columns,
        plan.multipliers,
        plan.uses,
        plan.idle,
    )


def _scratch(plan: Plan) -> FloatArray:
    return np.empty(scratch_rows(plan.slots, len(plan.columns)) * LANES)
