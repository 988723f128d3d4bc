"""Angles in a table of samples as they ran: without the jumps by whole turns where a log wrapped them.

A wheel that turns on and on is logged between -pi and pi, or 0 and 2 pi; the jump from one end to the other
is no motion, and a difference quotient would make a huge rate of it. The same holds for the angle of a planar
joint, and for the quaternion of a floating one, whose negative is the same orientation.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree

#: Numbers of a column that span no more than this may be angles within one turn, rounded to two digits.
_ONE_TURN = math.tau + 0.02
#: From here on, the other way round is less than twice as far: who can tell which way the joint went?
_UNSURE = math.tau / 3.0

#: Radians or metres: a follower that moves less beyond a whole turn of its leader stands where it stood.
_STANDS = 1e-9


@dataclass(frozen=True, slots=True)
class Unwrapped:
    """Configurations without wraps.

    Attributes:
        q: (n, nq).
        joints: The joints whose coordinates were changed.
        notes: What a person must know about it, a line each.
    """

    q: FloatArray
    joints: tuple[str, ...]
    notes: tuple[str, ...]


def unwrapped(tree: KinematicTree, q: FloatArray) -> Unwrapped:
    """Take the wraps out of the angles of continuous, planar and floating joints.

    Between two samples a joint is taken to have gone the shorter way round. Angles that span more than one
    turn are none that were wrapped, and stay. Revolute joints stay too: their limits say where they are.

    Args:
        tree: The robot.
        q: (n, nq), one sample after the other.
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
            notes.append(_undone(joint, q[:, own], new[:, own]))
    return Unwrapped(new, tuple(changed), (*notes, *_followers(tree, q, new)))


def _turning(joint: Joint, own: FloatArray) -> tuple[FloatArray, list[str]]:
    """A continuous joint, or a planar one, whose last number is the angle."""
    angle, notes = own[:, -1], []
    new = own.copy()
    within_one_turn = bool(np.ptp(angle) <= _ONE_TURN)
    if within_one_turn:
        new[:, -1] = _without_jumps(angle)
    step = np.abs(np.diff(new[:, -1]))
    if step.max(initial=0.0) > _UNSURE:
        notes.append(_unsure(joint, step, wrapped=within_one_turn))
    return new, notes


def _without_jumps(angle: FloatArray) -> FloatArray:
    """Whole turns are added where a step is longer than half a turn; other numbers keep their bits.

    >>> _without_jumps(np.array([3.0, -3.0, -2.5])).round(4).tolist()
    [3.0, 3.2832, 3.7832]
    """
    step = np.diff(angle)
    turns = np.where(np.abs(step) > math.pi, -np.round(step / math.tau), 0.0)
    return angle + math.tau * np.concatenate(([0.0], np.cumsum(turns)))


def _floating(joint: Joint, own: FloatArray) -> tuple[FloatArray, list[str]]:
    """A floating joint: of a quaternion and its negative, the one nearer to the sample before."""
    along = np.sum(own[1:, 3:] * own[:-1, 3:], axis=1)
    new = own.copy()
    new[1:, 3:] *= np.cumprod(np.where(along < 0.0, -1.0, 1.0))[:, np.newaxis]
    step = 2.0 * np.arccos(np.minimum(1.0, np.abs(along)))
    return new, [_unsure(joint, step, wrapped=True)] if step.max(initial=0.0) > _UNSURE else []


def _undone(joint: Joint, own: FloatArray, new: FloatArray) -> str:
    floating = joint.kind is JointKind.FLOATING
    change = np.sign((new * own)[:, 3:].sum(axis=1)) if floating else (new - own)[:, -1]
    k = np.flatnonzero(np.abs(np.diff(change)) > 1.0)
    what = "quaternion changes its sign" if floating else "angle jumps by a whole turn"
    more = f", and in {len(k) - 1} more places" if len(k) > 1 else ""
    return f"joint {joint.name}: its {what} after sample {k[0]}{more}: undone, since it is no motion"


_UNWRAP = {JointKind.CONTINUOUS: _turning, JointKind.PLANAR: _turning, JointKind.FLOATING: _floating}


def _unsure(joint: Joint, step: FloatArray, *, wrapped: bool) -> str:
    k, count = int(step.argmax()), int((step > _UNSURE).sum())
    often = f", and so {count - 1} times more" if count > 1 else ""
    taken = (
        "the shorter way round is taken, and may be the wrong one"
        if wrapped
        else "its angles span more than one turn and are taken as written"
    )
    return (
        f"joint {joint.name} turns {step[k]:.3g} rad from sample {k} to sample {k + 1}{often}: {taken};"
        " sample it more often"
    )


def _followers(tree: KinematicTree, q: FloatArray, new: FloatArray) -> Iterator[str]:
    """Followers that stand elsewhere when their leader's angle goes on by whole turns."""
    for joint, at in zip(tree.joints, tree.q_index, strict=True):
        rule = joint.mimic
        if rule is None or np.array_equal(q[:, at], new[:, at]):
            continue
        moved = rule.multiplier * (new[:, at] - q[:, at])
        if joint.kind.turns:
            moved = np.remainder(moved + math.pi, math.tau) - math.pi
        if np.abs(moved).max() > _STANDS * max(1.0, abs(rule.multiplier)):
            k = int(np.flatnonzero(np.abs(moved) > _STANDS)[0])
            yield (
                f"joint {joint.name} follows {rule.leader} {rule.multiplier:g}-fold on beyond a whole turn:"
                f" from sample {k} on it stands at {rule.multiplier * new[k, at] + rule.offset:.4g}, not at"
                f" {rule.multiplier * q[k, at] + rule.offset:.4g}"
            )
