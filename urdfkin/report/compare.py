"""What changed about a robot itself between two reports: joints, their axes, places, limits and leaders.

A comparison of two reports, to read: on a terminal and as Markdown.

What changed between two reports: versions, robots, verdicts, figures; and which changes are regressions.

A change is a regression when something that held no longer does: the run passed and does not, a robot is gone
or its verdict worse, more results lie outside their bound, a quantity, a table, samples or results are
compared no more, a bound is wider for the same joints, or the worst disagreement or its share of the bound
grew by more than a factor and past what rounding of a single operation gives. A robot that moves otherwise is
a change, and so is another name of its file: it is known again by what its text calls it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from urdfkin.comparison.result import angle, length
from urdfkin.comparison.wording import pose_words
from urdfkin.dh.snapping import rotation_angle
from urdfkin.errors.escape import log_line
from urdfkin.errors.escape import markdown_text as text
from urdfkin.model.mechanisms.mechanism import Tolerance
from urdfkin.model.summary import axis_words, rule_words
from urdfkin.report.document import Check, Document, Joint, Model, Robot, Units, outcome_of
from urdfkin.report.markdown import LIMIT, shortened
from urdfkin.report.pages import print_named
from urdfkin.report.words import VERDICTS, check_name, counted, percent, quantity_name, summary, units, worst

if TYPE_CHECKING:
    from rich.console import Console


#: Texts longer than this say no more.
_LONGEST = 200
#: Digits of a pose that are told; how far it is from the old one says the rest.
_TOLD = Tolerance(1e-9, 1e-9)


def model_changes(old: Model | None, new: Model | None) -> Iterator[tuple[str, str, str]]:
    """What, before, after; empty words where it was not there."""
    before, after = _joints(old), _joints(new)
    for name in dict.fromkeys([*before, *after]):
        was, now = before.get(name), after.get(name)
        if was is None or now is None:
            yield f"joint {name}", was["kind"] if was else "", now["kind"] if now else ""
            continue
        for aspect, first, second in _joint_changes(was, now):
            yield f"joint {name}, {aspect}", _cut(first), _cut(second)
    if old is not None and new is not None:
        for entry, what in (("base", "base frame"), ("tip", "tip frame"), ("coordinates", "coordinates")):
            frames = dict(old)[entry], dict(new)[entry]
            if frames[0] != frames[1]:
                yield what, _cut(_names(frames[0])), _cut(_names(frames[1]))


def _joints(model: Model | None) -> dict[str, Joint]:
    return {joint["name"]: joint for joint in model["joints"]} if model else {}


def _joint_changes(was: Joint, now: Joint) -> Iterator[tuple[str, str, str]]:
    """The same of one joint: lengths and angles as people say them."""
    for entry, aspect in (("kind", "kind"), ("parent", "parent link"), ("child", "child link")):
        if dict(was)[entry] != dict(now)[entry]:
            yield aspect, str(dict(was)[entry]), str(dict(now)[entry])
    if was["axis"] != now["axis"]:
        first, second = (axis_words(axis) if axis else "none" for axis in (was["axis"], now["axis"]))
        yield "axis", first, second + _turned(was["axis"], now["axis"])
    if was["placement"] != now["placement"]:
        Ts = [np.array(joint["placement"]) for joint in (was, now)]
        away = length(float(np.linalg.norm(Ts[1][:3, 3] - Ts[0][:3, 3])))
        turned = angle(float(rotation_angle(Ts[0][:3, :3], Ts[1][:3, :3])))
        first, second = (pose_words(T, _TOLD) for T in Ts)
        yield "origin", first, f"{second}: {away} away, turned by {turned}"
    limits = [dict(joint["limit"] or {}) for joint in (was, now)]
    for entry in ("lower", "upper", "velocity", "effort"):
        bounds = [limit.get(entry) for limit in limits]
        if bounds[0] != bounds[1]:
            first, second = ("none" if bound is None else f"{bound:.12g}" for bound in bounds)
            yield f"{entry} limit", first, second
    if was["mimic"] != now["mimic"]:
        yield "leader", _rule(was), _rule(now)


def _turned(first: Sequence[float] | None, second: Sequence[float] | None) -> str:
    if not first or not second:
        return ""
    a, b = np.array(first), np.array(second)
    return f", turned by {angle(float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)))}"


def _rule(joint: Joint) -> str:
    rule = joint["mimic"]
    return rule_words(rule["leader"], rule["multiplier"], rule["offset"]) if rule else "none"


def _names(value: Any) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def _cut(text: str) -> str:
    return text if len(text) <= _LONGEST else text[: _LONGEST - 4] + " ..."


def print_comparison(old: Document, new: Document, found: Comparison, out: Console) -> None:
    """Print what changed; every line reads without colour."""
    for title, document in (("old", old), ("new", new)):
        out.print(f"{title}: {document['started']}, {summary(document)}")
    heads = ["worst, eps*scale", "old", "new"]
    rows = [[quantity_name(name), _cell(a), _cell(b)] for name, a, b in figures(old, new)]
    print_named(out, heads, rows)
    for change in sorted(found.changes, key=lambda change: not change.regression):
        mark = "REGRESSION " if change.regression else ""
        out.print(f"{mark}{change}", style="bold red" if change.regression else "")
    out.print(f"{verdict(found)} ({_exit(found)})", style="bold red" if found.regressions else "bold green")


def verdict(found: Comparison) -> str:
    """The outcome in one line."""
    if found.regressions:
        return f"{counted(len(found.regressions), 'regression')}, {counted(len(found.changes), 'change')}"
    return f"no regression, {counted(len(found.changes), 'change')}"


def _exit(found: Comparison) -> str:
    """What the command's exit code means."""
    if found.regressions:
        return "exit 1: a regression"
    return "exit 0: changes alone do not fail, a regression would (1)" if found.changes else "exit 0"


def markdown_of(old: Document, new: Document, found: Comparison, limit: int = LIMIT) -> str:
    """What changed, for a pull request's comment."""
    mark = "❌" if found.regressions else "✅"
    lines = [f"## {mark} {verdict(found)[0].upper()}{verdict(found)[1:]}", ""]
    lines += ["| worst, eps·scale | old | new |", "| --- | ---: | ---: |"]
    lines += [
        f"| {text(quantity_name(name))} | {_cell(a)} | {_cell(b)} |" for name, a, b in figures(old, new)
    ]
    lines += ["", *(["| | what | old | new |", "| --- | --- | --- | --- |"] if found.changes else [])]
    left = limit - sum(len(line) + 1 for line in lines) - 100
    ordered = sorted(found.changes, key=lambda change: not change.regression)
    for shown, change in enumerate(ordered):
        row = _row(change)
        left -= len(row) + 1
        if left < 0:
            lines += ["", f"{counted(len(ordered) - shown, 'change')} more did not fit."]
            break
        lines.append(row)
    return "\n".join([*lines, ""])


def _row(change: Change) -> str:
    where = f"{change.robot}: " if change.robot else ""
    cells = [where + change.what, change.old, change.new]
    mark = "❌ regression" if change.regression else ""
    return f"| {mark} | {' | '.join(text(shortened(cell, 300)) for cell in cells)} |"


def _cell(value: Units | str) -> str:
    return value if isinstance(value, str) else units(value)


#: A worst disagreement may grow by this factor before it counts: the largest of many samples is a lottery.
FACTOR = 2.0
#: Below this many eps * scale nothing is a regression: a single rounding gives as much.
FLOOR = 2.0
#: Below this share of its bound a result is far from it.
_SHARE_FLOOR = 0.1


@dataclass(frozen=True, slots=True)
class Change:
    """One difference.

    Attributes:
        robot: The robot's source; None for the run as a whole.
        what: What changed.
        old: Before, in words; empty where it was not there.
        new: After; empty where it is gone.
        regression: Whether something that held no longer does.
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
class Comparison:
    """Everything that changed, regressions first in each part."""

    changes: tuple[Change, ...]

    @property
    def regressions(self) -> tuple[Change, ...]:
        """The changes for the worse."""
        return tuple(change for change in self.changes if change.regression)

    @property
    def exit_code(self) -> int:
        """1 on a regression."""
        return 1 if self.regressions else 0

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "schema": "urdfkin-comparison/1",
            "regressions": len(self.regressions),
            "changes": [asdict(change) for change in self.changes],
        }


def compare(old: Document, new: Document, factor: float = FACTOR) -> Comparison:
    """The changes from one report to another.

    Args:
        old: The report before.
        new: The report after.
        factor: By how much a worst disagreement may grow.
    """
    changes = [*_run(old, new), *_robots(old, new, factor)]
    return Comparison(tuple(changes))


def _run(old: Document, new: Document) -> Iterator[Change]:
    """Versions and settings; how the runs ended; a run that was cut short where the other was not."""
    yield from _mapping("version of ", old["versions"], new["versions"])
    yield from _mapping("", *({"seed": str(d["seed"])} for d in (old, new)))
    if old["samples"] != new["samples"]:
        fewer = new["samples"] < old["samples"]
        yield Change(None, "samples", f"{old['samples']:,}", f"{new['samples']:,}", regression=fewer)
    ends = [outcome_of(d) for d in (old, new)]
    if ends[0] != ends[1]:
        before, after = (f"not passed, {end.reason}" if end.reason else "passed" for end in ends)
        yield Change(None, "outcome", before, after, regression=ends[0].passed)
    if old["interrupted"] != new["interrupted"]:
        before, after = ("interrupted" if d["interrupted"] else "finished" for d in (old, new))
        yield Change(None, "run", before, after, regression=new["interrupted"])


def _mapping(prefix: str, old: Mapping[str, str], new: Mapping[str, str]) -> Iterator[Change]:
    for key in dict.fromkeys([*old, *new]):
        if old.get(key) != new.get(key):
            yield Change(None, prefix + key, old.get(key, ""), new.get(key, ""))


def _robots(old: Document, new: Document, factor: float) -> Iterator[Change]:
    before, after = _by_source(old), _by_source(new)
    moved = _moved(before, after)
    for source in dict.fromkeys([*before, *after]):
        if source in moved:
            yield Change(source, "file", source, moved[source])
            yield from _robot(source, before[source], after[moved[source]], factor)
        elif source in moved.values():
            continue
        elif source not in after:
            yield Change(source, "robot", before[source]["verdict"], "", regression=True)
        elif source not in before:
            verdict = after[source]["verdict"]
            yield Change(source, "robot", "", verdict, regression=verdict != "verified")
        else:
            yield from _robot(source, before[source], after[source], factor)


def _by_source(document: Document) -> dict[str, Robot]:
    """Robots by what names them; a source that was given twice is counted."""
    named: dict[str, Robot] = {}
    for robot in document["robots"]:
        source, count = robot["source"], 1
        while source in named:
            count += 1
            source = f"{robot['source']} ({count})"
        named[source] = robot
    return named


def _moved(before: Mapping[str, Robot], after: Mapping[str, Robot]) -> dict[str, str]:
    """Where a robot's file has another name now: what is gone and what is new call their robot alike."""
    gone, new = _by_name(before, after), _by_name(after, before)
    return {
        gone[name][0]: new[name][0] for name in gone if len(gone[name]) == 1 and len(new.get(name, [])) == 1
    }


def _by_name(robots: Mapping[str, Robot], besides: Mapping[str, Robot]) -> dict[str, list[str]]:
    """The sources that the other report has not, by what the robot is called in its text."""
    named: dict[str, list[str]] = {}
    for source, robot in robots.items():
        if source not in besides:
            named.setdefault(robot["name"], []).append(source)
    return named


def _robot(source: str, old: Robot, new: Robot, factor: float) -> Iterator[Change]:
    if old["verdict"] != new["verdict"]:
        worse = VERDICTS.index(new["verdict"]) < VERDICTS.index(old["verdict"])
        yield Change(source, "verdict", old["verdict"], new["verdict"], regression=worse)
    for what, n_old, n_new in (
        ("joints", len(old["joints"]), len(new["joints"])),
        ("frames", len(old["frames"]), len(new["frames"])),
    ):
        if n_old != n_new:
            yield Change(source, what, str(n_old), str(n_new))
    for what, was, now in model_changes(old["model"], new["model"]):
        yield Change(source, what, was, now)
    yield from _tables(source, old, new)
    yield from _findings(source, old, new)
    same = old["joints"] == new["joints"]
    before = {check_name(check): check for check in old["checks"]}
    after = {check_name(check): check for check in new["checks"]}
    for name in dict.fromkeys([*before, *after]):
        if name not in after:
            yield Change(source, name, "compared", "", regression=True)
        elif name not in before:
            yield Change(source, name, "", "compared", regression=bool(after[name]["failed"]))
        else:
            yield from _check(source, name, before[name], after[name], factor, same_joints=same)


def _tables(source: str, old: Robot, new: Robot) -> Iterator[Change]:
    """Denavit-Hartenberg tables that are compared no more, or were not before."""
    before, after = ({(c["base"], c["tip"]): bool(c["samples"]) for c in r["chains"]} for r in (old, new))
    for base, tip in dict.fromkeys([*before, *after]):
        ends = [compared.get((base, tip), False) for compared in (before, after)]
        if ends[0] != ends[1]:
            was, now = ("compared" if end else "" for end in ends)
            yield Change(source, f"tables from {base} to {tip}", was, now, regression=ends[0])


def _check(
    source: str, name: str, old: Check, new: Check, factor: float, *, same_joints: bool
) -> Iterator[Change]:
    def change(words: Callable[[Check], str], regression: bool) -> Change:
        return Change(source, name, words(old), words(new), regression)

    if old["failed"] != new["failed"]:
        yield change(lambda c: f"{c['failed']:,} outside the bound", new["failed"] > old["failed"])
    if new["results"] < old["results"]:
        yield change(lambda c: f"{c['results']:,} results", True)
    if old["bound"] != new["bound"]:
        wider = any((b or 0.0) > (a or 0.0) for a, b in zip(old["bound"], new["bound"], strict=True))
        yield change(lambda c: f"bound {_ends(c)} eps*scale", same_joints and wider)
    grew = _grew(old["worst"], new["worst"], factor)
    if grew or _grew(new["worst"], old["worst"], factor):
        yield change(lambda c: f"{units(c['worst'])} eps*scale", grew)

    was, now = old["share_of_bound"], new["share_of_bound"]
    grew = _grew(was, now, factor, _SHARE_FLOOR)
    if grew or _grew(now, was, factor, _SHARE_FLOOR):
        yield change(lambda c: f"{percent(c['share_of_bound'])} of the bound", grew)


def _ends(check: Check) -> str:
    return " to ".join("none" if end is None else f"{end:g}" for end in check["bound"])


def _grew(old: Units, new: Units, factor: float, floor: float = FLOOR) -> bool:
    if old is None:
        return False
    return new is None or (new > floor and new > factor * old)


def _findings(source: str, old: Robot, new: Robot) -> Iterator[Change]:
    """Errors and warnings by code; the verdict says whether an error matters."""
    counts: list[dict[str, int]] = [{}, {}]
    for count, robot in zip(counts, (old, new), strict=True):
        for finding in robot["findings"]:
            if finding["severity"] != "note":
                key = f"{finding['severity']} {finding['code']}"
                count[key] = count.get(key, 0) + 1 + len(finding["also"])
    for key in sorted(counts[0].keys() | counts[1].keys()):
        before, after = counts[0].get(key, 0), counts[1].get(key, 0)
        if before != after:
            yield Change(source, key, str(before or ""), str(after or ""))


def figures(old: Document, new: Document) -> list[tuple[str, Units | str, Units | str]]:
    """The worst disagreement of each quantity over all robots, before and after; empty where not compared."""
    names = dict.fromkeys(c["quantity"] for d in (old, new) for r in d["robots"] for c in r["checks"])
    return [(name, _worst(old, name), _worst(new, name)) for name in names]


def _worst(document: Document, quantity: str) -> Units | str:
    checks = [c for robot in document["robots"] for c in robot["checks"] if c["quantity"] == quantity]
    return worst(check["worst"] for check in checks) if checks else ""
