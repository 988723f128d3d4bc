"""Comparison of two validation reports: versions, robots, verdicts and disagreements.

A change is a regression in these cases:

- The old run passed, and the new run has not passed.
- The new run was interrupted, and the old run was not.
- A robot of the old report is missing in the new report.
- The verdict on a robot is worse.
- A robot that is only in the new report is not verified.
- More results lie outside their bound.
- A quantity that is only in the new report has results outside their bound.
- A quantity or a table is no longer compared, or not with the second oracle.
- There are fewer samples or fewer results.
- A bound is wider, although the robot has the same joints.
- The worst disagreement grew by more than a given factor, and exceeds 2 eps * scale (a single rounding).
- The largest ratio of a disagreement to its bound grew by more than this factor, and exceeds 0.1.
- The worst disagreement or the largest ratio is infinite only in the new report.

A changed model is not a regression. The comparison lists changes of a joint's axis, placement, limits and
mimic rule. A renamed file is not a regression either: the robot is then found by the robot name in the file.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, TypedDict, cast

import numpy as np

from urdfkin.comparison.result import angle, length, pose_words
from urdfkin.dh.snapping import rotation_angle
from urdfkin.errors.display import Strong, Table, TextDocument, format_count
from urdfkin.errors.escape import log_line
from urdfkin.errors.escape import markdown_text as text
from urdfkin.model.mechanisms.mechanism import Tolerance
from urdfkin.model.summary import format_axis, format_mimic_rule
from urdfkin.report.markdown import MAX_CHARACTERS, count_within, row_line, shorten, table_lines
from urdfkin.report.words import (
    VERDICTS,
    check_name,
    format_ratio,
    format_units,
    quantity_name,
    summary,
    worst,
)
from urdfkin.system.documents import DocumentKind, Header, as_json_data, doc
from urdfkin.validation.document import (
    Document,
    ReportedCheck,
    ReportedJoint,
    ReportedModel,
    ReportedRobot,
    Units,
    outcome_of,
)
from urdfkin.verify.oracles import package_versions

_MAX_LENGTH = 200
#: Displayed poses are rounded to nine decimals.
_DISPLAY_TOLERANCE = Tolerance(1e-9, 1e-9)


def model_changes(old: ReportedModel | None, new: ReportedModel | None) -> Iterator[tuple[str, str, str]]:
    """Yield the name, the old value and the new value of each change; a missing value is empty."""
    before, after = _joints(old), _joints(new)
    for name in dict.fromkeys([*before, *after]):
        was, now = before.get(name), after.get(name)
        if was is None or now is None:
            yield f"joint {name}", was["kind"] if was else "", now["kind"] if now else ""
            continue
        for aspect, first, second in _joint_changes(was, now):
            yield f"joint {name}, {aspect}", shorten(first, _MAX_LENGTH), shorten(second, _MAX_LENGTH)
    if old is not None and new is not None:
        for entry, what in (("base", "base frame"), ("tip", "tip frame"), ("coordinates", "coordinates")):
            frames = dict(old)[entry], dict(new)[entry]
            if frames[0] != frames[1]:
                yield what, shorten(_names(frames[0]), _MAX_LENGTH), shorten(_names(frames[1]), _MAX_LENGTH)


def _joints(model: ReportedModel | None) -> dict[str, ReportedJoint]:
    return {joint["name"]: joint for joint in model["joints"]} if model else {}


def _joint_changes(was: ReportedJoint, now: ReportedJoint) -> Iterator[tuple[str, str, str]]:
    for entry, aspect in (("kind", "kind"), ("parent", "parent link"), ("child", "child link")):
        if dict(was)[entry] != dict(now)[entry]:
            yield aspect, str(dict(was)[entry]), str(dict(now)[entry])
    if was["axis"] != now["axis"]:
        first, second = (format_axis(axis) if axis else "none" for axis in (was["axis"], now["axis"]))
        yield "axis", first, second + _angle_between(was["axis"], now["axis"])
    if was["placement"] != now["placement"]:
        Ts = [np.array(joint["placement"]) for joint in (was, now)]
        away = length(float(np.linalg.norm(Ts[1][:3, 3] - Ts[0][:3, 3])))
        rotation = angle(float(rotation_angle(Ts[0][:3, :3], Ts[1][:3, :3])))
        first, second = (pose_words(T, _DISPLAY_TOLERANCE) for T in Ts)
        yield "origin", first, f"{second}: moved by {away}, rotated by {rotation}"
    limits = [dict(joint["limit"] or {}) for joint in (was, now)]
    for entry in ("lower", "upper", "velocity", "effort"):
        bounds = [limit.get(entry) for limit in limits]
        if bounds[0] != bounds[1]:
            first, second = ("none" if bound is None else f"{bound:.12g}" for bound in bounds)
            yield f"{entry} limit", first, second
    if was["mimic"] != now["mimic"]:
        yield "mimic rule", _mimic_rule(was), _mimic_rule(now)


def _angle_between(first: Sequence[float] | None, second: Sequence[float] | None) -> str:
    if not first or not second:
        return ""
    a, b = np.array(first), np.array(second)
    return f", rotated by {angle(float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)))}"


def _mimic_rule(joint: ReportedJoint) -> str:
    rule = joint["mimic"]
    return format_mimic_rule(rule["mimicked_joint"], rule["multiplier"], rule["offset"]) if rule else "none"


def _names(value: Any) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def document(old: Document, new: Document, comparison: ReportComparison) -> TextDocument:
    parts: list[str | Table] = [
        f"{title}: {one['started']}, {summary(one)}" for title, one in (("old", old), ("new", new))
    ]
    rows = [
        [quantity_name(name), _units_cell(a), _units_cell(b)] for name, a, b in worst_disagreements(old, new)
    ]
    parts.append(Table(["worst, eps*scale", "old", "new"], rows))
    for change in sorted(comparison.changes, key=lambda change: not change.regression):
        parts.append(Strong(f"REGRESSION {change}", "bold red") if change.regression else str(change))
    style = "bold red" if comparison.regressions else "bold green"
    return TextDocument("", [*parts, Strong(f"{verdict(comparison)} ({_describe_exit(comparison)})", style)])


def verdict(comparison: ReportComparison) -> str:
    if comparison.regressions:
        regressions = format_count(len(comparison.regressions), "regression")
    else:
        regressions = "no regression"
    return f"{regressions}, {format_count(len(comparison.changes), 'change')}"


def _describe_exit(comparison: ReportComparison) -> str:
    if comparison.regressions:
        return "exit 1: a regression"
    return "exit 0: changes without a regression" if comparison.changes else "exit 0"


def markdown_of(
    old: Document, new: Document, comparison: ReportComparison, max_characters: int = MAX_CHARACTERS
) -> str:
    mark = "❌" if comparison.regressions else "✅"
    worst_rows = (
        (text(quantity_name(name)), _units_cell(a), _units_cell(b))
        for name, a, b in worst_disagreements(old, new)
    )
    lines = [
        f"## {mark} {verdict(comparison)[0].upper()}{verdict(comparison)[1:]}",
        "",
        *table_lines(["worst, eps·scale", "old", "new"], worst_rows, left=[0]),
        "",
        *(table_lines(["", "changed value", "old", "new"]) if comparison.changes else []),
    ]
    row_characters = max_characters - sum(len(line) + 1 for line in lines) - 100
    rows = [_row(change) for change in sorted(comparison.changes, key=lambda change: not change.regression)]
    shown = count_within(rows, row_characters)
    lines += rows[:shown]
    if shown < len(rows):
        lines += ["", f"{format_count(len(rows) - shown, 'further change')} left out: the comment is full."]
    return "\n".join([*lines, ""])


def _row(change: ReportChange) -> str:
    where = f"{change.robot}: " if change.robot else ""
    cells = [where + change.what, change.old, change.new]
    mark = "❌ regression" if change.regression else ""
    return row_line([mark, *(text(shorten(cell, 300)) for cell in cells)])


def _units_cell(value: Units | str) -> str:
    return value if isinstance(value, str) else format_units(value)


#: Growth of a robot's largest disagreement or ratio by more than this factor is a regression. Other random
#: samples cause smaller growth.
GROWTH_FACTOR = 2.0
#: Growth is no regression if the new disagreement (in eps * scale) is at most this number. A single rounding
#: error can be as large as this number.
DISAGREEMENT_FLOOR = 2.0
#: Growth of a ratio of disagreement to bound is no regression if the new ratio is at most this number.
_BOUND_RATIO_FLOOR = 0.1


@dataclass(frozen=True, slots=True)
class ReportChange:
    """A difference between two reports.

    `robot` is None for a difference of the whole run. `old` or `new` is "" if the report has no value.
    """

    robot: str | None
    what: str
    old: str
    new: str
    regression: bool = False

    def __str__(self) -> str:
        where = f"{self.robot}: " if self.robot else ""
        return log_line(f"{where}{self.what}: {self.old or 'nothing'} -> {self.new or 'nothing'}")


@dataclass(frozen=True, slots=True)
class ReportComparison:
    """Changes between two reports. `sha256` contains the digest of each robot's text in the new report."""

    changes: tuple[ReportChange, ...]
    sha256: tuple[str | None, ...] = ()

    @property
    def regressions(self) -> tuple[ReportChange, ...]:
        return tuple(change for change in self.changes if change.regression)

    @property
    def exit_code(self) -> int:
        return 1 if self.regressions else 0

    def as_dict(self, command: str | None = None) -> ComparisonDocument:
        document = {
            "schema": COMPARISON.name,
            "versions": package_versions(),
            "sha256": self.sha256,
            "verdict": COMPARISON.verdicts[bool(self.regressions)],
            "command": command,
            "changes": self.changes,
        }
        return cast("ComparisonDocument", as_json_data(document))


class ChangeEntry(TypedDict):
    """A difference between two reports."""

    robot: Annotated[str | None, doc("Source of the robot; null if the value does not belong to one robot.")]
    what: Annotated[str, doc("Name of the changed value.")]
    old: Annotated[str, doc("Value in the old report; empty if the old report has no value.")]
    new: Annotated[str, doc("Value in the new report; empty if the new report has no value.")]
    regression: Annotated[bool, doc("Whether the change is a regression.")]


class ComparisonDocument(Header):
    """The output of `urdfkin report compare --format json`.

    The header entry `sha256` contains the SHA-256 of each robot's text in the new report.
    """

    changes: Annotated[list[ChangeEntry], doc("All changes between the two reports.")]


COMPARISON = DocumentKind(
    "urdfkin-comparison/1",
    ComparisonDocument,
    ("no regression", "regression"),
    "urdfkin report compare OLD.json NEW.json --format json",
)


def compare(old: Document, new: Document, factor: float = GROWTH_FACTOR) -> ReportComparison:
    changes = [*_run(old, new), *_robots(old, new, factor)]
    return ReportComparison(tuple(changes), tuple(new["sha256"]))


def _run(old: Document, new: Document) -> Iterator[ReportChange]:
    yield from _mapping("version of ", old["versions"], new["versions"])
    yield from _mapping("", *({"seed": str(d["seed"])} for d in (old, new)))
    if old["samples"] != new["samples"]:
        fewer = new["samples"] < old["samples"]
        yield ReportChange(None, "samples", f"{old['samples']:,}", f"{new['samples']:,}", regression=fewer)
    ends = [outcome_of(d) for d in (old, new)]
    if ends[0] != ends[1]:
        before, after = (f"not passed, {end.reason}" if end.reason else "passed" for end in ends)
        yield ReportChange(None, "outcome", before, after, regression=ends[0].passed)
    if old["interrupted"] != new["interrupted"]:
        before, after = ("interrupted" if d["interrupted"] else "finished" for d in (old, new))
        yield ReportChange(None, "run", before, after, regression=new["interrupted"])


def _mapping(prefix: str, old: Mapping[str, str], new: Mapping[str, str]) -> Iterator[ReportChange]:
    for key in dict.fromkeys([*old, *new]):
        if old.get(key) != new.get(key):
            yield ReportChange(None, prefix + key, old.get(key, ""), new.get(key, ""))


def _robots(old: Document, new: Document, factor: float) -> Iterator[ReportChange]:
    before, after = robots_by_source(old), robots_by_source(new)
    renamed = find_renamed_files(before, after)
    for source in dict.fromkeys([*before, *after]):
        if source in renamed:
            yield ReportChange(source, "file", source, renamed[source])
            yield from _robot(source, before[source], after[renamed[source]], factor)
        elif source in renamed.values():
            continue
        elif source not in after:
            yield ReportChange(source, "robot", before[source]["verdict"], "", regression=True)
        elif source not in before:
            verdict = after[source]["verdict"]
            yield ReportChange(source, "robot", "", verdict, regression=verdict != "verified")
        else:
            yield from _robot(source, before[source], after[source], factor)


def robots_by_source(document: Document) -> dict[str, ReportedRobot]:
    """Return the robots of a report by source. Equal sources get numbers: `ur5`, `ur5 (2)`."""
    named: dict[str, ReportedRobot] = {}
    for robot in document["robots"]:
        source, count = robot["source"], 1
        while source in named:
            count += 1
            source = f"{robot['source']} ({count})"
        named[source] = robot
    return named


def find_renamed_files(
    before: Mapping[str, ReportedRobot], after: Mapping[str, ReportedRobot]
) -> dict[str, str]:
    """Return the new source of each renamed file, with the old source as the key.

    A file counts as renamed if its robot name has exactly one removed source and exactly one added source.
    """
    gone, new = _missing_sources_by_name(before, after), _missing_sources_by_name(after, before)
    return {
        gone[name][0]: new[name][0] for name in gone if len(gone[name]) == 1 and len(new.get(name, [])) == 1
    }


def _missing_sources_by_name(
    robots: Mapping[str, ReportedRobot], others: Mapping[str, ReportedRobot]
) -> dict[str, list[str]]:
    named: dict[str, list[str]] = {}
    for source, robot in robots.items():
        if source not in others:
            named.setdefault(robot["name"], []).append(source)
    return named


def _robot(source: str, old: ReportedRobot, new: ReportedRobot, factor: float) -> Iterator[ReportChange]:
    if old["verdict"] != new["verdict"]:
        worse = VERDICTS.index(new["verdict"]) < VERDICTS.index(old["verdict"])
        yield ReportChange(source, "verdict", old["verdict"], new["verdict"], regression=worse)
    for what, n_old, n_new in (
        ("joints", len(old["joints"]), len(new["joints"])),
        ("frames", len(old["frames"]), len(new["frames"])),
    ):
        if n_old != n_new:
            yield ReportChange(source, what, str(n_old), str(n_new))
    for what, was, now in model_changes(old["model"], new["model"]):
        yield ReportChange(source, what, was, now)
    yield from _tables(source, old, new)
    yield from _findings(source, old, new)
    yield from _second_oracle(source, old, new)
    same = old["joints"] == new["joints"]
    before = {check_name(check): check for check in old["checks"]}
    after = {check_name(check): check for check in new["checks"]}
    for name in dict.fromkeys([*before, *after]):
        if name not in after:
            yield ReportChange(source, name, "compared", "", regression=True)
        elif name not in before:
            yield ReportChange(source, name, "", "compared", regression=bool(after[name]["failed"]))
        else:
            yield from _check(source, name, before[name], after[name], factor, same_joints=same)


def _tables(source: str, old: ReportedRobot, new: ReportedRobot) -> Iterator[ReportChange]:
    before, after = ({(c["base"], c["tip"]): bool(c["samples"]) for c in r["chains"]} for r in (old, new))
    for base, tip in dict.fromkeys([*before, *after]):
        ends = [compared.get((base, tip), False) for compared in (before, after)]
        if ends[0] != ends[1]:
            was, now = ("compared" if end else "" for end in ends)
            yield ReportChange(source, f"tables from {base} to {tip}", was, now, regression=ends[0])


def _second_oracle(source: str, old: ReportedRobot, new: ReportedRobot) -> Iterator[ReportChange]:
    before, after = (
        Counter(check["second_oracle"]["by"] for check in robot["checks"] if "second_oracle" in check)
        for robot in (old, new)
    )
    for name in sorted(before | after):
        if before[name] != after[name]:
            was, now = (str(counts[name] or "") for counts in (before, after))
            lost = after[name] < before[name]
            yield ReportChange(source, f"comparisons with {name}", was, now, regression=lost)


def _check(
    source: str, name: str, old: ReportedCheck, new: ReportedCheck, factor: float, *, same_joints: bool
) -> Iterator[ReportChange]:
    def change(words: Callable[[ReportedCheck], str], regression: bool) -> ReportChange:
        return ReportChange(source, name, words(old), words(new), regression)

    if old["failed"] != new["failed"]:
        yield change(lambda c: f"{c['failed']:,} outside the bound", new["failed"] > old["failed"])
    if new["results"] < old["results"]:
        yield change(lambda c: f"{c['results']:,} results", True)
    if old["bound"] != new["bound"]:
        wider = any((b or 0.0) > (a or 0.0) for a, b in zip(old["bound"], new["bound"], strict=True))
        yield change(lambda c: f"bound {_bound_range(c)} eps*scale", same_joints and wider)
    grew = _has_grown(old["worst"], new["worst"], factor)
    if grew or _has_grown(new["worst"], old["worst"], factor):
        yield change(lambda c: f"{format_units(c['worst'])} eps*scale", grew)

    was, now = old["bound_ratio"], new["bound_ratio"]
    grew = _has_grown(was, now, factor, _BOUND_RATIO_FLOOR)
    if grew or _has_grown(now, was, factor, _BOUND_RATIO_FLOOR):
        yield change(lambda c: f"{format_ratio(c['bound_ratio'])} of the bound", grew)


def _bound_range(check: ReportedCheck) -> str:
    return " to ".join("none" if end is None else f"{end:g}" for end in check["bound"])


def _has_grown(old: Units, new: Units, factor: float, floor: float = DISAGREEMENT_FLOOR) -> bool:
    if old is None:
        return False
    return new is None or (new > floor and new > factor * old)


def _findings(source: str, old: ReportedRobot, new: ReportedRobot) -> Iterator[ReportChange]:
    counts: list[dict[str, int]] = [{}, {}]
    for count, robot in zip(counts, (old, new), strict=True):
        for finding in robot["findings"]:
            if finding["severity"] != "note":
                key = f"{finding['severity']} {finding['code']}"
                count[key] = count.get(key, 0) + 1 + len(finding["other_lines"])
    for key in sorted(counts[0].keys() | counts[1].keys()):
        before, after = counts[0].get(key, 0), counts[1].get(key, 0)
        if before != after:
            yield ReportChange(source, key, str(before or ""), str(after or ""))


def worst_disagreements(old: Document, new: Document) -> list[tuple[str, Units | str, Units | str]]:
    names = dict.fromkeys(c["quantity"] for d in (old, new) for r in d["robots"] for c in r["checks"])
    return [(name, _worst_disagreement(old, name), _worst_disagreement(new, name)) for name in names]


def _worst_disagreement(document: Document, quantity: str) -> Units | str:
    checks = [c for robot in document["robots"] for c in robot["checks"] if c["quantity"] == quantity]
    return worst(check["worst"] for check in checks) if checks else ""
