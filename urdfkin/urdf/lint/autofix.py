"""Apply automatic fixes to a URDF, check that the robot does not change, and write the changes as a patch.

A pass applies the fixes of one code, such as URDF507. urdfkin accepts the new file if three conditions hold:

- The number of findings falls by at least the number of fixes.
- The new file has no new findings. urdfkin does not compare codes with more than 10,000 findings.
- The new file describes the same robot: all names and numbers that URDF readers use are equal. There are two
  exceptions. A joint axis may rotate by the rounding error of its numbers. The rotation of a joint origin may
  change by at most `Fix.max_rotation` (rad).

A line of the file can contain text that controls a terminal or a CI service, for example an escape sequence.
urdfkin escapes this text, but `git apply` refuses escaped lines. Therefore, if a line must be escaped,
urdfkin writes a git binary patch, and before the patch a comment that shows the escaped lines.
"""

from __future__ import annotations

import base64
import difflib
import hashlib
import io
import os
import string
import zlib
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

from urdfkin.urdf.findings import Finding, Severity, apply_fixes
from urdfkin.urdf.lint.runner import Examination
from urdfkin.urdf.records import AXIAL_TYPES, FURTHER_LIMITS, JointRecord, RobotRecord
from urdfkin.urdf.sources import UrdfText

#: Maximum number of passes of `--fix` over a file. A pass applies the fixes of one code, and skips a fix that
#: overlaps the previous applied fix.
MAX_PASSES = 100

#: Rounding to doubles rotates a unit vector by at most this angle (rad).
MAX_AXIS_TILT = Fraction(1, 2**52)


@dataclass(frozen=True, slots=True)
class FixResult:
    """The text of a file after the fixes."""

    text: UrdfText
    fixed_findings: tuple[Finding, ...]
    unfixed_reasons: dict[str, str]  # By the code of the findings.


def fix_text(
    text: UrdfText,
    examine: Callable[[UrdfText], Examination],
    choose: Callable[[], Callable[[Finding], bool]],
) -> FixResult:
    """Apply the automatic fixes, unless the file has a finding of severity error.

    `choose` is called before each pass, and returns a function that selects the findings to fix.
    """
    current, fixed, unfixed_reasons = examine(text), list[Finding](), dict[str, str]()
    for _ in range(MAX_PASSES):
        chosen = filter(choose(), current.findings)
        candidates = [finding for finding in chosen if finding.fix and finding.code not in unfixed_reasons]
        if not candidates:
            break
        code = candidates[0].code
        if error := next((f.code for f in current.findings if f.severity is Severity.ERROR), None):
            unfixed_reasons |= {
                finding.code: f"the file has an error ({error}); correct this error first"
                for finding in candidates
            }
            break
        by_fix = {id(f.fix): f for f in candidates if f.code == code}
        data, applied = apply_fixes(current.text.data, (f.fix for f in by_fix.values() if f.fix))
        fixable = [by_fix[id(fix)] for fix in applied]
        after = examine(replace(current.text, data=data))
        if objection := next(_find_objections(current, after, fixable), None):
            unfixed_reasons[code] = objection
        else:
            current = after
            fixed += fixable
    return FixResult(current.text, tuple(fixed), unfixed_reasons)


def _find_objections(before: Examination, after: Examination, fixable: list[Finding]) -> Iterator[str]:
    code = fixable[0].code
    # `findings` is incomplete for codes with more than 10,000 findings. These codes are not compared.
    many = {finding.code for finding in before.findings if finding.other_lines}
    old = Counter((f.code, f.element, f.name) for f in before.findings if f.code not in many)
    new = Counter((f.code, f.element, f.name) for f in after.findings if f.code not in many)
    if appeared := new - old:
        yield f"the fix would cause {min(code for code, *_ in appeared)}"
    if sum(f.count for f in before.findings) - sum(f.count for f in after.findings) < len(fixable):
        yield f"{code} would remain after the fix"
    if before.robot is None or after.robot is None:
        if before.robot is not after.robot:
            yield "after the fix, the file would not be a URDF"
        return
    max_rotations = defaultdict[str, float](float)
    for finding in fixable:
        max_rotations[finding.name or ""] += finding.fix.max_rotation if finding.fix else 0.0
    yield from find_differences(before.robot, after.robot, max_rotations)


def find_differences(a: RobotRecord, b: RobotRecord, max_rotations: Mapping[str, float]) -> Iterator[str]:
    """Yield messages about differences between two robots, at most one for each joint.

    The function compares the URDF version, the links, and the joint values that URDF readers use.
    `max_rotations` contains the largest permitted rotation (rad) of joint origins. The keys are joint names.
    """
    if (a.version, [*a.links], len(a.joints)) != (b.version, [*b.links], len(b.joints)):
        yield "the fix would change the links or joints"
        return
    for one, other in zip(a.joints, b.joints, strict=True):
        if what := _find_difference(one, other, max_rotations.get(one.name, 0.0)):
            yield f"the fix would change the {what} of joint {one.name}"


def _find_difference(a: JointRecord, b: JointRecord, max_rotation: float) -> str | None:
    # The frame rotates by at most the sum of the changes of roll, pitch and yaw.
    rotation = sum(abs(Fraction(y) - Fraction(x)) for x, y in zip(a.rpy, b.rpy, strict=True))
    names_a, names_b = ((one.name, one.kind, one.parent, one.child) for one in (a, b))
    equal = {
        "name, type, parent or child": names_a == names_b,
        "origin": (a.xyz, a.quaternion) == (b.xyz, b.quaternion),
        "orientation": rotation <= Fraction(max_rotation) * _ROTATION_SUM_FACTOR,
        "axis": a.kind not in AXIAL_TYPES or _same_direction(a.axis, b.axis),
        "limit": _effective_limits(a) == _effective_limits(b),
        "mimic": a.kind == "fixed" or _mimic_rule(a) == _mimic_rule(b),
    }
    return next((what for what, same in equal.items() if not same), None)


#: This factor covers the rounding errors of the sum of the angles `Fix.max_rotation`.
_ROTATION_SUM_FACTOR = 1 + Fraction(1, 2**50)


def _same_direction(a: tuple[float, ...] | None, b: tuple[float, ...] | None) -> bool:
    """Return whether the angle between two vectors is at most `MAX_AXIS_TILT`; the computation is exact."""
    if a is None or b is None:
        return a is b
    (ax, ay, az), (bx, by, bz) = map(Fraction, a), map(Fraction, b)
    cross = (ay * bz - az * by) ** 2 + (az * bx - ax * bz) ** 2 + (ax * by - ay * bx) ** 2
    lengths = (ax * ax + ay * ay + az * az) * (bx * bx + by * by + bz * bz)
    return ax * bx + ay * by + az * bz > 0 and cross <= MAX_AXIS_TILT**2 * lengths


def _effective_limits(joint: JointRecord) -> tuple[float | None, ...]:
    if joint.limit is None:
        return ()
    bounded = ("lower", "upper") if joint.kind in ("revolute", "prismatic") else ()
    return tuple(getattr(joint.limit, name) for name in (*bounded, "effort", "velocity", *FURTHER_LIMITS))


def _mimic_rule(joint: JointRecord) -> tuple[str, float, float] | None:
    rule = joint.mimic
    return None if rule is None else (rule.mimicked_joint, rule.multiplier, rule.offset)


_PATCH_BYTES_PER_LINE = 52
#: The first letter of a line in git's binary patch encodes the number of bytes of the line: A is 1, B is 2.
_PATCH_LENGTH_LETTERS = string.ascii_uppercase + string.ascii_lowercase


def make_patch(file: str, before: bytes, after: bytes, escape: Callable[[str], str]) -> str:
    """Return the patch of one UTF-8 file; `escape` escapes the control characters of a text."""
    if before == after:
        return ""
    name = _relative_path(file)
    text = _make_unified_diff(name, before, after)
    if escape(text) == text:
        return text
    lines = escape(text.replace("\r", "\\r")).splitlines()
    return "".join(f"# {line}\n" for line in lines) + _make_binary_patch(name, before, after)


def _relative_path(file: str) -> str:
    below = os.path.relpath(file)
    return file if below.startswith(os.pardir) else Path(below).as_posix()


def _make_unified_diff(name: str, before: bytes, after: bytes) -> str:
    end = "\t" if " " in name else ""  # Git needs a tab after a file name that contains spaces.
    old, new = (f"{_quote_file_name(f'{side}/{name}')}{end}" for side in "ab")
    # Like git, StringIO ends lines only at line feeds.
    a, b = (io.StringIO(data.decode(), newline="\n").readlines() for data in (before, after))
    found = difflib.unified_diff(a, b, old, new)
    no_end = "\n\\ No newline at end of file\n"
    return "".join(line if line.endswith("\n") else line + no_end for line in found)


def _quote_file_name(name: str) -> str:
    if name.isascii() and name.isprintable() and not set(name) & {'"', "\\"}:
        return name
    return '"' + "".join(
        chr(byte) if 0x20 <= byte < 0x7F and chr(byte) not in '"\\' else f"\\{byte:03o}"
        for byte in os.fsencode(name)
    ) + '"'  # fmt: skip


def _make_binary_patch(name: str, before: bytes, after: bytes) -> str:
    here = Path.cwd()
    top = next((folder for folder in (here, *here.parents) if (folder / ".git").exists()), here)
    place = os.path.relpath(name, top)
    old, new = (_quote_file_name(f"{side}/{Path(place).as_posix()}") for side in "ab")
    digests = (hashlib.sha1(b"blob %d\0" % len(data) + data).hexdigest() for data in (before, after))
    head = f"diff --git {old} {new}\nindex {'..'.join(digests)}\nGIT binary patch\n"
    return head + "".join(f"literal {len(data)}\n{_encode(data)}\n" for data in (after, before))


def _encode(data: bytes) -> str:
    packed = zlib.compress(data)
    pieces = (packed[i : i + _PATCH_BYTES_PER_LINE] for i in range(0, len(packed), _PATCH_BYTES_PER_LINE))
    return "".join(
        f"{_PATCH_LENGTH_LETTERS[len(piece) - 1]}{base64.b85encode(piece, pad=True).decode()}\n"
        for piece in pieces
    )
