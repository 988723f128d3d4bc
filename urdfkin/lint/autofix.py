"""Findings cured where that takes no judgement, and the proof that nothing else changed.

A fix is kept if the file that it makes has fewer findings of its code and no new ones, and says the same
robot: every name, number and limit that has a meaning is equal, but for axes, whose directions may differ by
the last rounding, and for angles by no more than the fix says that it turns.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction

from urdfkin.lint.finding import Finding, Severity, apply
from urdfkin.lint.runner import Examined
from urdfkin.urdf.records import AXIAL, FURTHER_LIMITS, JointRecord, RobotRecord
from urdfkin.urdf.sources import Text

#: How often a file is gone through: once for each code, and again for what overlapped or was one too many.
PASSES = 100

#: By how much (rad) a unit vector may tilt when each of its numbers is rounded: 2**-53, and as much to spare.
TILT = Fraction(1, 2**52)


@dataclass(frozen=True, slots=True)
class Mended:
    """A file after its fixes.

    Attributes:
        text: The file.
        fixed: The findings that were cured.
        kept: Code -> why its fixes were not made.
    """

    text: Text
    fixed: tuple[Finding, ...]
    kept: dict[str, str]


def mend(
    text: Text, look: Callable[[Text], Examined], choose: Callable[[], Callable[[Finding], bool]]
) -> Mended:
    """Cure what can be cured, one code after another; a file with errors has no meaning to keep.

    Args:
        text: A file's.
        look: What examines a text, and finds all there is.
        choose: What makes, for each time that the file is gone through, what says which findings to cure.
    """
    now, fixed, kept = look(text), list[Finding](), dict[str, str]()
    for _ in range(PASSES):
        chosen = filter(choose(), now.findings)
        offered = [finding for finding in chosen if finding.fix and finding.code not in kept]
        if not offered:
            break
        code = offered[0].code
        if error := next((f.code for f in now.findings if f.severity is Severity.ERROR), None):
            kept |= {finding.code: f"errors come first, {error} here" for finding in offered}
            break
        these = {id(f.fix): f for f in offered if f.code == code}
        data, taken = apply(now.text.data, (f.fix for f in these.values() if f.fix))
        cured = [these[id(fix)] for fix in taken]
        after = look(replace(now.text, data=data))
        if objection := next(_objections(now, after, cured), None):
            kept[code] = objection
        else:
            now = after
            fixed += cured
    return Mended(now.text, tuple(fixed), kept)


def _objections(before: Examined, after: Examined, cured: list[Finding]) -> Iterator[str]:
    """What speaks against a fix, the first first."""
    code = cured[0].code
    # Of a kind of which there are too many to be written out, others take the places of those that are gone.
    many = {finding.code for finding in before.findings if finding.also}
    old, new = (
        Counter((f.code, f.element, f.name) for f in seen.findings if f.code not in many)
        for seen in (before, after)
    )
    if appeared := new - old:
        yield f"it would bring {min(code for code, *_ in appeared)}"
    if sum(f.count for f in before.findings) - sum(f.count for f in after.findings) < len(cured):
        yield f"{code} would still be there"
    if before.robot is None or after.robot is None:
        if before.robot is not after.robot:
            yield "it would make another document"
        return
    turns = defaultdict[str, float](float)
    for finding in cured:
        turns[finding.name or ""] += finding.fix.turns if finding.fix else 0.0
    yield from differences(before.robot, after.robot, turns)


def differences(a: RobotRecord, b: RobotRecord, turns: Mapping[str, float]) -> Iterator[str]:
    """In what two descriptions differ that has a meaning.

    Args:
        a: One.
        b: The other.
        turns: Joint -> by how much (rad) its frame may be turned.
    """
    if (a.version, [*a.links], len(a.joints)) != (b.version, [*b.links], len(b.joints)):
        yield "links or joints would not be the same"
        return
    for one, other in zip(a.joints, b.joints, strict=True):
        if what := _difference(one, other, turns.get(one.name, 0.0)):
            yield f"joint {one.name} would have another {what}"


def _difference(a: JointRecord, b: JointRecord, turns: float) -> str | None:
    """What of a joint differs, if anything does."""
    # Each of the three angles turns the frame by no more than it changes.
    turned = sum(abs(Fraction(y) - Fraction(x)) for x, y in zip(a.rpy, b.rpy, strict=True))
    equal = {
        "name, type, parent or child": (a.name, a.kind, a.parent, a.child)
        == (b.name, b.kind, b.parent, b.child),
        "origin": (a.xyz, a.quaternion) == (b.xyz, b.quaternion),
        "orientation": turned <= Fraction(turns) * _SLACK,
        "axis": a.kind not in AXIAL or _same_direction(a.axis, b.axis),
        "limit": _limits(a) == _limits(b),
        "mimic": a.kind == "fixed" or _rule(a) == _rule(b),
    }
    return next((what for what, same in equal.items() if not same), None)


#: What a fix says of its turns is a sum of doubles.
_SLACK = 1 + Fraction(1, 2**50)


def _same_direction(a: tuple[float, ...] | None, b: tuple[float, ...] | None) -> bool:
    """Whether two vectors point one way, computed without rounding."""
    if a is None or b is None:
        return a is b
    (ax, ay, az), (bx, by, bz) = map(Fraction, a), map(Fraction, b)
    cross = (ay * bz - az * by) ** 2 + (az * bx - ax * bz) ** 2 + (ax * by - ay * bx) ** 2
    lengths = (ax * ax + ay * ay + az * az) * (bx * bx + by * by + bz * bz)
    return ax * bx + ay * by + az * bz > 0 and cross <= TILT**2 * lengths


def _limits(joint: JointRecord) -> tuple[float | None, ...]:
    """The limits that the joint's type has."""
    if joint.limit is None:
        return ()
    bounded = ("lower", "upper") if joint.kind in ("revolute", "prismatic") else ()
    return tuple(getattr(joint.limit, name) for name in (*bounded, "effort", "velocity", *FURTHER_LIMITS))


def _rule(joint: JointRecord) -> tuple[str, float, float] | None:
    rule = joint.mimic
    return None if rule is None else (rule.leader, rule.multiplier, rule.offset)
