"""Zeros of joints that no axis and no frame fixes: mimic rules do.

A rule v = m w + c of A and one of B, v' = m' w' + c', say the same if v' = s v + o and w' = s' w + o' make
one of the other. Where nothing hangs on a joint's link, its o is free, and the rule gives it. A turning
joint's o is free by full turns in any case.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from urdfkin.model.mechanisms.alignment import IDENTITY, Alignment, Step
from urdfkin.model.mechanisms.mechanism import Tolerance, between_lines
from urdfkin.model.tree import Joint

#: By so many turns the zero of a mimicked joint may be another one.
TURNS = (0, 1, -1)
#: A zero that axes fix may be off by so many times an angle's rounding: they may have a short lever.
LEVER = 1e4


@dataclass(frozen=True, slots=True)
class _Rule:
    """A step whose joint moves with a coordinate of B: its value is m x + c in A, n y + d in B.

    Attributes:
        step: Its index.
        slope: s m, of sense * A's value in A's coordinate.
        constant: s c.
        n: Multiplier of B's rule.
        d: Offset of B's rule.
        offset: o, as it was found.
        turns: Whether the joint turns.
        free: Whether nothing fixes o.
        meets: Whether a link of A and one of B stand in one place on what it carries.
    """

    step: int
    slope: float
    constant: float
    n: float
    d: float
    offset: float
    turns: bool
    free: bool
    meets: bool

    def beta(self, turn: int) -> float:
        """Of y = alpha x + beta, from this joint's zero moved by some turns."""
        return (self.constant + self.offset + 2.0 * math.pi * turn - self.d) / self.n

    def wanted(self, beta: float) -> float:
        """The offset that beta asks for."""
        return self.n * beta + self.d - self.constant

    def allows(self, offset: float, tolerance: Tolerance) -> bool:
        """Whether the zero may be so, but for rounding."""
        off = offset - self.offset
        if self.turns:
            off = math.remainder(off, 2.0 * math.pi)
        return self.free or abs(off) <= LEVER * tolerance.angle * max(1.0, abs(offset))


def zeros_by_rules(found: Alignment, tolerance: Tolerance) -> Mapping[str, tuple[int, float]]:
    """Joints of A whose zero mimic rules set otherwise than it was found: sense and offset."""
    zeros = dict[str, tuple[int, float]]()
    for rules in _groups(found):
        alphas = [rule.slope / rule.n for rule in rules if rule.n]
        # One member with another slope keeps its difference; the others are set all the same.
        alpha = max(
            alphas, key=lambda one: sum(_near(one, other, tolerance) for other in alphas), default=0.0
        )
        fit = [rule for rule in rules if _near(rule.slope, rule.n * alpha, tolerance)]
        some = sorted((rule for rule in fit if rule.n), key=lambda rule: (rule.free, not rule.meets))
        some = [rule for rule in some if rule.free == some[0].free]
        betas = [rule.beta(turn) for rule in some for turn in (TURNS if rule.turns else (0,))]
        if not betas:
            continue
        beta = max(betas, key=lambda one: sum(rule.allows(rule.wanted(one), tolerance) for rule in fit))
        for rule in fit:
            wanted = rule.wanted(beta)
            if rule.allows(wanted, tolerance) and not _near(wanted, rule.offset, tolerance):
                step = found.steps[rule.step]
                zeros[found.a.tree.joints[step.a].name] = step.sense, wanted
    return zeros


def _near(x: float, y: float, tolerance: Tolerance) -> bool:
    return abs(x - y) <= 0.5 * tolerance.angle * max(1.0, abs(x), abs(y))


def _groups(found: Alignment) -> Iterator[list[_Rule]]:
    """Steps whose joints move with one coordinate of A and one of B."""
    groups = dict[tuple[str, str], list[_Rule]]()
    for i, step in enumerate(found.steps):
        if step.unlike or step.kind not in ("turns", "prismatic"):
            continue
        x, m, c = _as_rule(found.a.tree.joints[step.a])
        y, n, d = _as_rule(found.b.tree.joints[step.b])
        slope, constant = step.sense * m, step.sense * c
        held, meets = _held(found, i)
        rule = _Rule(i, slope, constant, n, d, step.offset, step.kind == "turns", not held, meets)
        groups.setdefault((x, y), []).append(rule)
    yield from (rules for rules in groups.values() if len(rules) > 1)


def _as_rule(joint: Joint) -> tuple[str, float, float]:
    """The coordinate that a joint moves with, its multiplier and its offset."""
    rule = joint.mimic
    return (joint.name, 1.0, 0.0) if rule is None else (rule.leader, rule.multiplier, rule.offset)


def _held(found: Alignment, i: int) -> tuple[bool, bool]:
    """Whether axes or links of one name fix a joint's zero; whether other links meet on what it carries."""
    names = set(found.a.tree.links) & set(found.b.tree.links)
    behind = {i}
    for k, step in enumerate(found.steps):
        if step.previous in behind:
            if step.differs or step.unlike or step.conversion or not _stays(found.steps[i], step):
                return True, True
            behind.add(k)
    carried = [frame for frame in found.frames if frame.previous in behind]
    held = any(found.a.tree.links[frame.a] in names for frame in carried)
    return held, any(frame.tool is IDENTITY for frame in carried)


def _stays(one: Step, other: Step) -> bool:
    """Whether a joint leaves another one's axis where it is, whatever its value."""
    if "turns" not in (one.kind, other.kind):
        return other.kind == "prismatic"
    if {one.kind, other.kind} - {"turns", "prismatic"}:
        return False
    placed = one.kind == other.kind == "turns"
    return max(between_lines(one.axis, other.axis, placed=placed)) == 0.0
