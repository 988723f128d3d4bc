"""Arrays in, arrays out: the compiled walks behind plain functions.

Inputs are flat batches, (n, nq) and (n, nv), already checked; `urdfkin.robot` checks, reshapes and verifies.
A kernel is loaded when it is first needed, so that a first use compiles only what it needs.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from urdfkin.errors import NotFiniteError, RangeError
from urdfkin.recursion.base import STILL_STATE
from urdfkin.recursion.batch import in_blocks
from urdfkin.recursion.plan import LARGE, Plan
from urdfkin.recursion.scratch import scratch
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
    shape = len(q), len(plan.frames), 16
    flat = np.empty(shape) if out is None else out.reshape(shape)
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
    packed = plan.packed
    if order and reference is Reference.LOCAL:
        from urdfkin.recursion.local_kernel import local_motions  # noqa: PLC0415

        def compute(x: Sequence[FloatArray], part: FloatArray) -> int:
            return local_motions(order, packed, *x, part, scratch(plan))
    else:
        from urdfkin.recursion.motion_kernel import motions  # noqa: PLC0415

        def compute(x: Sequence[FloatArray], part: FloatArray) -> int:
            return motions(order, int(reference), packed, *x, part, scratch(plan))

    _demand(in_blocks(compute, [base, *qva], out, threads), plan, [base, *qva], out)


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
    from urdfkin.recursion.jacobian_kernel import jacobians as kernel  # noqa: PLC0415

    out = np.empty((len(q), len(plan.frames), 6, plan.nv)) if out is None else out
    packed = plan.packed

    def compute(x: Sequence[FloatArray], part: FloatArray) -> int:
        return kernel(int(reference), packed, *x, part, scratch(plan))

    _demand(in_blocks(compute, [base, q], out, threads), plan, [base, q], out)
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
    from urdfkin.recursion.jacobian_rate_kernel import jacobian_rates as kernel  # noqa: PLC0415

    out = np.empty((len(q), len(plan.frames), 6, plan.nv)) if out is None else out
    packed = plan.packed

    def compute(x: Sequence[FloatArray], part: FloatArray) -> int:
        return kernel(int(reference), packed, *x, part, scratch(plan))

    _demand(in_blocks(compute, [base, q, v], out, threads), plan, [base, q, v], out)
    return out


def _demand(ordinary: bool, plan: Plan, inputs: Sequence[FloatArray], out: FloatArray) -> None:
    """Results that are finite, from inputs that are; where all is ordinary nothing needs to be looked at."""
    base = inputs[0]
    ordinary = ordinary and not plan.is_large
    if ordinary and (base is STILL_STATE or float(np.abs(base).max(initial=0.0)) < LARGE):
        return
    if not all(np.isfinite(x).all() for x in inputs):
        raise NotFiniteError("q, v and a must be finite")
    finite = np.isfinite(out).all(axis=tuple(range(1, out.ndim)))
    if not finite.all():
        raise RangeError(
            "a result leaves the range of double precision",
            where=f"sample {int(finite.argmin())} of {len(out)}" if len(out) > 1 else None,
            remedy="give smaller numbers",
        )
