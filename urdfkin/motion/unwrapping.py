"""Unwrap the angles of logged samples: remove their jumps by whole turns.

A log often wraps the angle of a wheel to [-pi, pi] or [0, 2 pi]. The jump from one end to the other is not a
motion, but its difference quotient would be a huge joint velocity. The angle of a planar joint wraps in the
same way. The quaternion of a floating joint may change its sign, which is the same orientation.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree

#: Largest span of a column of wrapped angles: one turn, plus the rounding of angles to two digits.
_ONE_TURN = math.tau + 0.02
#: A larger step than this is ambiguous: the step in the other direction is less than twice as long.
_AMBIGUOUS = math.tau / 3.0

#: Radians or metres: a smaller shift of a mimic joint by a whole turn of the mimicked joint is rounding.
_ROUNDING = 1e-9


@dataclass(frozen=True, slots=True)
class Unwrapped:
    """Unwrapped configurations.

    Attributes:
        q: (n, nq) configurations.
        joints: Names of the joints with changed coordinates.
        notes: Remarks for the user, one line each.
    """

    q: FloatArray
    joints: tuple[str, ...]
    notes: tuple[str, ...]


def unwrapped(tree: KinematicTree, q: FloatArray) -> Unwrapped:
    """Unwrap the angles of continuous, planar and floating joints.

    Between two samples a joint is assumed to turn in the shorter direction. Angles that span more than one
    turn were not wrapped and stay unchanged. Revolute joints stay unchanged too, since they have limits.

    Args:
        tree: The robot.
        q: (n, nq) samples in the order of time.
    """
    new, changed, notes = np.array(q), [], []
    for joint, at in zip(tree.joints, tree.q_index, strict=True):
        if joint.mimic is not None or joint.kind not in _UNWRAP:
            continue
        own = slice(at, at + joint.kind.nq)
        new[:, own], found = _UNWRAP[joint.kind](joint, q[:, own])
        notes += found
        if not np.array_equal(new[:, own], q[:, own]):
            changed.append(joint.name)
            notes.append(_unwrap_note(joint, q[:, own], new[:, own]))
    return Unwrapped(new, tuple(changed), (*notes, *_mimic_notes(tree, q, new)))


def _turning(joint: Joint, own: FloatArray) -> tuple[FloatArray, list[str]]:
    """Unwrap a continuous or a planar joint; the last coordinate is the angle."""
    angle, notes = own[:, -1], []
    new = own.copy()
    within_one_turn = bool(np.ptp(angle) <= _ONE_TURN)
    if within_one_turn:
        new[:, -1] = _without_jumps(angle)
    step = np.abs(np.diff(new[:, -1]))
    if step.max(initial=0.0) > _AMBIGUOUS:
        notes.append(_ambiguity_note(joint, step, wrapped=within_one_turn))
    return new, notes


def _without_jumps(angle: FloatArray) -> FloatArray:
    """Add whole turns after each step of more than half a turn; all other numbers stay bit for bit.

    >>> _without_jumps(np.array([3.0, -3.0, -2.5])).round(4).tolist()
    [3.0, 3.2832, 3.7832]
    """
    step = np.diff(angle)
    turns = np.where(np.abs(step) > math.pi, -np.round(step / math.tau), 0.0)
    return angle + math.tau * np.concatenate(([0.0], np.cumsum(turns)))


def _floating(joint: Joint, own: FloatArray) -> tuple[FloatArray, list[str]]:
    """Unwrap a floating joint: choose the sign of each quaternion that is nearer to the previous sample."""
    along = np.sum(own[1:, 3:] * own[:-1, 3:], axis=1)
    new = own.copy()
    new[1:, 3:] *= np.cumprod(np.where(along < 0.0, -1.0, 1.0))[:, np.newaxis]
    step = 2.0 * np.arccos(np.minimum(1.0, np.abs(along)))
    return new, [_ambiguity_note(joint, step, wrapped=True)] if step.max(initial=0.0) > _AMBIGUOUS else []


def _unwrap_note(joint: Joint, own: FloatArray, new: FloatArray) -> str:
    floating = joint.kind is JointKind.FLOATING
    change = np.sign((new * own)[:, 3:].sum(axis=1)) if floating else (new - own)[:, -1]
    k = np.flatnonzero(np.abs(np.diff(change)) > 1.0)
    what = "quaternion changes its sign" if floating else "angle jumps by a whole turn"
    more = f" and {len(k) - 1} more samples" if len(k) > 1 else ""
    return f"joint {joint.name}: its {what} after sample {k[0]}{more}; this is not a motion and was removed"


_UNWRAP = {JointKind.CONTINUOUS: _turning, JointKind.PLANAR: _turning, JointKind.FLOATING: _floating}


def _ambiguity_note(joint: Joint, step: FloatArray, *, wrapped: bool) -> str:
    k, count = int(step.argmax()), int((step > _AMBIGUOUS).sum())
    more = f", and in {count - 1} more steps" if count > 1 else ""
    assumption = (
        "the shorter direction is assumed, which may be wrong"
        if wrapped
        else "its angles span more than one turn and are not unwrapped"
    )
    return (
        f"joint {joint.name} turns {step[k]:.3g} rad from sample {k} to sample {k + 1}{more}: {assumption};"
        " record more samples per second"
    )


def _mimic_notes(tree: KinematicTree, q: FloatArray, new: FloatArray) -> Iterator[str]:
    """Yield a note for each mimic joint that moves when the mimicked joint's angle is unwrapped."""
    for joint, at in zip(tree.joints, tree.q_index, strict=True):
        rule = joint.mimic
        if rule is None or np.array_equal(q[:, at], new[:, at]):
            continue
        moved = rule.multiplier * (new[:, at] - q[:, at])
        if joint.kind.turns:
            moved = np.remainder(moved + math.pi, math.tau) - math.pi
        if np.abs(moved).max() > _ROUNDING * max(1.0, abs(rule.multiplier)):
            k = int(np.flatnonzero(np.abs(moved) > _ROUNDING)[0])
            yield (
                f"joint {joint.name} follows {rule.leader} with multiplier {rule.multiplier:g}, also"
                f" beyond one turn: from sample {k} on it is at"
                f" {rule.multiplier * new[k, at] + rule.offset:.4g}, not at"
                f" {rule.multiplier * q[k, at] + rule.offset:.4g}"
            )
