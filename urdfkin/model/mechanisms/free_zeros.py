"""Joint zeros that only mimic rules determine, because no axis and no link frame does.

Let v = m w + c be a rule of A and v' = m' w' + c' one of B. They are equivalent if v' = s v + o and
w' = s' w + o' turn one into the other. If nothing is attached to a joint's link, its offset o is free, and
the rule determines it. For a revolute joint o is free by full turns in any case.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from urdfkin.model.mechanisms.alignment import IDENTITY, Alignment, Step
from urdfkin.model.mechanisms.mechanism import Tolerance, between_lines
from urdfkin.model.tree import Joint

#: Full turns by which the zero of a mimicked joint may be changed.
TURNS = (0, 1, -1)
#: Tolerance of a zero that axes determine, in units of the angle tolerance; the axes may be close together.
LEVER = 1e4


@dataclass(frozen=True, slots=True)
class _Rule:
    """A step whose joint moves with a coordinate of B: its value is m x + c in A, n y + d in B.

    Attributes:
        step: Index of the step.
        slope: s m, the slope of sense * A's value.
        constant: s c.
        n: Multiplier of B's rule.
        d: Offset of B's rule.
        offset: o, as the alignment found it.
        turns: Whether the joint is revolute.
        free: Whether no axis and no common link determines o.
        meets: Whether links of A and of B coincide on the body behind the joint.
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
        """Return beta of y = alpha x + beta, from this joint's zero moved by some full turns."""
        return (self.constant + self.offset + 2.0 * math.pi * turn - self.d) / self.n

    def wanted(self, beta: float) -> float:
        """Return the offset that corresponds to beta."""
        return self.n * beta + self.d - self.constant

    def allows(self, offset: float, tolerance: Tolerance) -> bool:
        """Return whether the joint can have this offset, within rounding."""
        off = offset - self.offset
        if self.turns:
            off = math.remainder(off, 2.0 * math.pi)
        return self.free or abs(off) <= LEVER * tolerance.angle * max(1.0, abs(offset))


def zeros_by_rules(found: Alignment, tolerance: Tolerance) -> Mapping[str, tuple[int, float]]:
    """Return sense and offset of the joints of A whose zero mimic rules change."""
    zeros = dict[str, tuple[int, float]]()
    for rules in _groups(found):
        alphas = [rule.slope / rule.n for rule in rules if rule.n]
        # A joint with a different slope keeps its difference; the others are set nevertheless.
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
    """Yield groups of steps whose joints move with one coordinate of A and one of B."""
    groups = dict[tuple[str, str], list[_Rule]]()
    for i, step in enumerate(found.steps):
        if step.unlike or step.kind not in ("turns", "prismatic"):
            continue
        x, m, c = _as_rule(found.a.tree.joints[step.a])
        y, n, d = _as_rule(found.b.tree.joints[step.b])
        slope, constant = step.sense * m, step.sense * c
        determined, meets = _is_determined(found, i)
        rule = _Rule(i, slope, constant, n, d, step.offset, step.kind == "turns", not determined, meets)
        groups.setdefault((x, y), []).append(rule)
    yield from (rules for rules in groups.values() if len(rules) > 1)


def _as_rule(joint: Joint) -> tuple[str, float, float]:
    """Return the coordinate of a joint, its multiplier and its offset."""
    rule = joint.mimic
    return (joint.name, 1.0, 0.0) if rule is None else (rule.leader, rule.multiplier, rule.offset)


def _is_determined(found: Alignment, i: int) -> tuple[bool, bool]:
    """Return whether axes or common links determine a joint's zero, and whether other links coincide."""
    names = set(found.a.tree.links) & set(found.b.tree.links)
    behind = {i}
    for k, step in enumerate(found.steps):
        if step.previous in behind:
            if step.differs or step.unlike or step.conversion or not _keeps_axis(found.steps[i], step):
                return True, True
            behind.add(k)
    carried = [frame for frame in found.frames if frame.previous in behind]
    determined = any(found.a.tree.links[frame.a] in names for frame in carried)
    return determined, any(frame.tool is IDENTITY for frame in carried)


def _keeps_axis(one: Step, other: Step) -> bool:
    """Return whether the motion of one joint keeps the axis of another unchanged."""
    if "turns" not in (one.kind, other.kind):
        return other.kind == "prismatic"
    if {one.kind, other.kind} - {"turns", "prismatic"}:
        return False
    placed = one.kind == other.kind == "turns"
    return max(between_lines(one.axis, other.axis, placed=placed)) == 0.0
