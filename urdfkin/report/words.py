"""Texts and numbers that all forms of the report share."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from datetime import UTC, datetime
from typing import Literal

from urdfkin.errors.display import format_count
from urdfkin.validation.document import (
    Document,
    ReportedAccuracy,
    ReportedAccuracyLine,
    ReportedCheck,
    ReportedRobot,
    Units,
    ValidationVerdict,
)
from urdfkin.verify.oracles import ORACLES
from urdfkin.verify.quantities import QUANTITIES

#: Verdicts, the worst first.
VERDICTS = tuple(verdict.value for verdict in ValidationVerdict)


def utc(started: str) -> datetime | None:
    """Parse an ISO date and time, and return a `datetime` in UTC; return None for any other text.

    A time without an offset is in UTC.
    """
    try:
        moment = datetime.fromisoformat(started)
        return moment.astimezone(UTC) if moment.tzinfo else moment.replace(tzinfo=UTC)
    except (ValueError, OverflowError):
        return None


def quantity_name(quantity: str) -> str:
    return QUANTITIES[quantity].title if quantity in QUANTITIES else quantity


def check_name(check: ReportedCheck | ReportedAccuracyLine) -> str:
    """Return the quantity and reference frame of a check: `acceleration, local`."""
    reference = check["reference"]
    return check["quantity"] + (f", {reference}" if reference else "")


def second_reader_words(robot: ReportedRobot) -> str:
    reading = robot.get("second_reader")
    if reading is None:
        return ""
    if reading["unread"] is not None:
        return f"not compared with {reading['by']}, which cannot read the file: {reading['unread']}"
    known = f"; known faults of this reader: {'; '.join(reading['known'])}" if reading["known"] else ""
    if reading["differences"]:
        return f"✗ {reading['by']} reads another robot: {'; '.join(reading['differences'])}{known}"
    return (
        f"{reading['by']} reads the same links, joints, origins, axes, limits and mimic rules"
        f" ({format_count(reading['joints'], 'joint')}){known}"
    )


def format_units(value: Units, *, compared: bool = True) -> str:
    """Format a disagreement; None means infinity."""
    if not compared:
        return ""
    if value is None:
        return "inf"
    return f"{value:.2f}" if value < 1000.0 else f"{value:.2g}"


def format_ratio(ratio: Units) -> str:
    """Format the ratio of a disagreement to its bound: as a percentage, or from 10 on like "12 x"."""
    if ratio is None:
        return "inf"
    return f"{ratio:.1%}" if ratio < 10.0 else f"{ratio:.2g} x"


def worst(values: Iterable[Units]) -> Units:
    """Return the largest value; None means infinity."""
    largest = 0.0
    for value in values:
        if value is None:
            return None
        largest = max(largest, value)
    return largest


def quantities(robots: Sequence[ReportedRobot]) -> list[str]:
    found = {check["quantity"] for robot in robots for check in robot["checks"]}
    return [q for q in QUANTITIES if q in found] + sorted(found - set(QUANTITIES))


def checks_of_quantity(robot: ReportedRobot, quantity: str) -> list[ReportedCheck]:
    return [check for check in robot["checks"] if check["quantity"] == quantity]


def checks_in_order(robot: ReportedRobot) -> list[ReportedCheck]:
    return checks_of_quantities(robot, quantities([robot]))


def quantities_by_heading(robots: Sequence[ReportedRobot]) -> dict[str, tuple[str, ...]]:
    """Return the quantities of each column in the table of robots."""
    heads: dict[str, tuple[str, ...]] = {}
    for name in quantities(robots):
        head = QUANTITIES[name].heading if name in QUANTITIES else name
        heads[head] = (*heads.get(head, ()), name)
    return heads


def checks_of_quantities(robot: ReportedRobot, names: Sequence[str]) -> list[ReportedCheck]:
    return [check for name in names for check in checks_of_quantity(robot, name)]


def quantities_disagreement_cell(robot: ReportedRobot, names: Sequence[str]) -> str:
    return disagreement_cell(checks_of_quantities(robot, names))


def disagreement_cell(checks: Sequence[ReportedCheck]) -> str:
    return format_units(worst(check["worst"] for check in checks), compared=bool(checks))


def bound_ratio_cell(robot: ReportedRobot) -> str:
    return format_ratio(bound_ratio_of(robot)) if robot["checks"] else ""


def error_cells(line: ReportedAccuracyLine) -> list[str]:
    """Return four cells: the worst errors of urdfkin and of Pinocchio, then their typical errors."""
    both = line["urdfkin"], line["pinocchio"]
    return [*(f"{one['worst']:.2f}" for one in both), *(f"{one['typical']:.3f}" for one in both)]


def more_accurate(line: ReportedAccuracyLine) -> Literal["urdfkin", "Pinocchio", "equal"]:
    ours, theirs = line["urdfkin"]["typical"], line["pinocchio"]["typical"]
    return "equal" if ours == theirs else "urdfkin" if ours < theirs else "Pinocchio"


def more_accurate_counts(lines: Sequence[ReportedAccuracyLine]) -> str:
    counts = Counter(more_accurate(line) for line in lines)
    return (
        f"urdfkin is more accurate in {counts['urdfkin']:,} of {format_count(len(lines), 'line')}, equal in "
        f"{counts['equal']:,}, less accurate in {counts['Pinocchio']:,}"
    )


def accuracy_words(study: ReportedAccuracy) -> str:
    moving = " on a moving base" if study.get("moving_base") else ""
    return f"{format_count(study['samples'], 'sample')}{moving}; {more_accurate_counts(study['lines'])}"


def second_oracle_title(robots: Sequence[ReportedRobot]) -> str | None:
    names = (
        check["second_oracle"]["by"]
        for robot in robots
        for check in robot["checks"]
        if "second_oracle" in check
    )
    name = next(names, None)
    return next((one.title for one in ORACLES.values() if one.name == name), name)


def second_oracle_heads(title: str) -> list[str]:
    return ["results", "urdfkin, Pinocchio", f"urdfkin, {title}", f"Pinocchio, {title}", "outlier"]


def second_oracle_rows(robots: Sequence[ReportedRobot], title: str) -> Iterator[tuple[str, list[str]]]:
    for name in quantities(robots):
        checks = [
            check for robot in robots for check in checks_of_quantity(robot, name) if "second_oracle" in check
        ]
        if checks:
            yield name, second_oracle_cells(checks, title)


def second_oracle_cells(checks: Sequence[ReportedCheck], title: str) -> list[str]:
    """Return a row under `second_oracle_heads`, with the largest ratios of all `checks`."""
    checks = [check for check in checks if "second_oracle" in check]
    found = [check["second_oracle"] for check in checks]
    outliers = {
        "urdfkin": sum(one["alone"]["urdfkin"] for one in found),
        "Pinocchio": sum(one["alone"]["pinocchio"] for one in found),
        title: sum(one["alone"]["second_oracle"] for one in found),
        "undecided": sum(one["undecided"] for one in found),
    }
    return [
        f"{sum(check['results'] for check in checks):,}",
        format_ratio(worst(check["bound_ratio"] for check in checks)),
        format_ratio(worst(one["urdfkin"]["bound_ratio"] for one in found)),
        format_ratio(worst(one["pinocchio"]["bound_ratio"] for one in found)),
        ", ".join(f"{who} ({count:,})" for who, count in outliers.items() if count) or "none",
    ]


def bound_ratio_of(robot: ReportedRobot) -> Units:
    return worst(check["bound_ratio"] for check in robot["checks"])


def summary(document: Document) -> str:
    robots = document["robots"]
    results = sum(robot["results"] for robot in robots)
    failed = sum(robot["failed"] for robot in robots)
    state = "interrupted: " if document["interrupted"] else ""
    return (
        f"{state}{format_count(len(robots), 'robot')}, {results:,} results compared, {failed:,} outside their"
        f" bound, {document['seconds']:.1f} s, seed {document['seed']}"
    )


def verdict_counts(document: Document) -> dict[str, int]:
    counts = dict.fromkeys(VERDICTS, 0)
    for robot in document["robots"]:
        counts[robot["verdict"]] += 1
    return {verdict: count for verdict, count in counts.items() if count}


def pinocchio_version(document: Document) -> str:
    return document["versions"].get("pin", "?")
