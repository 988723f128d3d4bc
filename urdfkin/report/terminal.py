"""Report on a terminal: tables and failures.

A terminal with less than 100 columns shows two tables; a wider terminal shows one wide table. Colours only
repeat information that the words contain.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from urdfkin.errors.display import Table, format_count
from urdfkin.report.listing import print_table
from urdfkin.report.words import (
    accuracy_words,
    bound_ratio_cell,
    check_name,
    checks_in_order,
    checks_of_quantity,
    disagreement_cell,
    error_cells,
    format_ratio,
    format_units,
    more_accurate,
    pinocchio_version,
    quantities,
    quantities_by_heading,
    quantities_disagreement_cell,
    quantity_name,
    second_oracle_heads,
    second_oracle_rows,
    second_oracle_title,
    second_reader_words,
    summary,
    worst,
)
from urdfkin.validation.document import Document, ReportedAccuracy, ReportedRobot, outcome_of

if TYPE_CHECKING:
    from rich.console import Console

#: Minimum terminal width for one column per quantity.
_WIDE = 100


def print_report(document: Document, out: Console, *, cases: bool = False) -> None:
    """Print a report, with a command that reproduces each failure or, with `cases`, each worst result."""
    robots = document["robots"]
    out.print(
        f"worst disagreement with Pinocchio {pinocchio_version(document)}, in eps*scale"
        " (rounding gives 1 to 10)",
        style="bold",
    )
    if len(robots) == 1 and robots[0]["checks"]:
        _print_checks(robots[0], out)
    elif out.width >= _WIDE:
        _print_wide(robots, out)
    else:
        _print_robot_table(robots, out)
        _print_quantity_table(robots, out)
    if (title := second_oracle_title(robots)) is not None:
        out.print(
            f"urdfkin, Pinocchio and {title}: the largest ratio of a disagreement to its bound, for each"
            " pair of libraries",
            style="bold",
        )
        print_table(out, _cross_check_table(robots, title))
    shared_reasons = _shared_reasons(robots)
    for (verdict, reason), names in shared_reasons.items():
        out.print(f"{', '.join(names[:3])} and {len(names) - 3} more robots: {verdict}: {reason}")
    for robot in robots:
        has_own_reason = (robot["verdict"], robot["reason"]) not in shared_reasons
        _print_robot(robot, out, cases=cases, reason=has_own_reason)
    found = outcome_of(document)
    passed = "verified: " if found.passed else ""
    out.print(passed + summary(document), style="bold green" if found.passed else "bold red")
    if found.reason:
        out.print(f"not passed: {found.reason}", style="bold red")


def _shared_reasons(robots: Sequence[ReportedRobot]) -> dict[tuple[str, str | None], list[str]]:
    """Return robots without checks by verdict and reason, for reasons that at least five robots share."""
    names: dict[tuple[str, str | None], list[str]] = {}
    for robot in robots:
        if robot["reason"] and not robot["checks"]:
            names.setdefault((robot["verdict"], robot["reason"]), []).append(robot["source"])
    return {key: sources for key, sources in names.items() if len(sources) > 4}


def _count_cells(robot: ReportedRobot) -> list[str]:
    return [robot["source"], str(len(robot["joints"])), str(len(robot["frames"])), f"{robot['results']:,}"]


def _print_wide(robots: Sequence[ReportedRobot], out: Console) -> None:
    quantities_of = quantities_by_heading(robots)
    heads = ["robot", "joints", "frames", "results", *quantities_of, "verdict"]
    rows = [
        [
            *_count_cells(robot),
            *(quantities_disagreement_cell(robot, names) for names in quantities_of.values()),
            robot["verdict"],
        ]
        for robot in robots
    ]
    print_table(out, Table(heads, rows, left=(0, len(heads) - 1)))


def _print_robot_table(robots: Sequence[ReportedRobot], out: Console) -> None:
    heads = ["robot", "joints", "frames", "results", "worst", "of bound", "verdict"]
    rows = [
        [
            *_count_cells(robot),
            disagreement_cell(robot["checks"]),
            bound_ratio_cell(robot),
            robot["verdict"],
        ]
        for robot in robots
    ]
    print_table(out, Table(heads, rows, left=(0, 6)))


def _print_quantity_table(robots: Sequence[ReportedRobot], out: Console) -> None:
    rows = []
    for name in quantities(robots):
        checks = [check for robot in robots for check in checks_of_quantity(robot, name)]
        largest = worst(check["worst"] for check in checks)
        where = next(
            robot["source"]
            for robot in robots
            if any(check["worst"] == largest for check in checks_of_quantity(robot, name))
        )
        results = f"{sum(check['results'] for check in checks):,}"
        ratio = format_ratio(worst(check["bound_ratio"] for check in checks))
        rows.append([quantity_name(name), results, format_units(largest), ratio, where])
    print_table(out, Table(["quantity", "results", "worst", "of bound", "robot"], rows, left=(0, 4)))


def _cross_check_table(robots: Sequence[ReportedRobot], title: str) -> Table:
    rows = [[quantity_name(name), *cells] for name, cells in second_oracle_rows(robots, title)]
    heads = [head.replace(", ", ",\n") for head in second_oracle_heads(title)]
    return Table(["quantity", *heads], rows, left=(0, 5))


def _print_checks(robot: ReportedRobot, out: Console) -> None:
    heads = ["quantity, reference", "results", "outside", "median", "99 %", "worst", "of bound"]
    rows = [
        [
            check_name(check),
            f"{check['results']:,}",
            f"{check['failed']:,}",
            format_units(check["median"]),
            format_units(check["p99"]),
            format_units(check["worst"]),
            format_ratio(check["bound_ratio"]),
        ]
        for check in checks_in_order(robot)
    ]
    out.print(robot["source"], style="bold")
    print_table(out, Table(heads, rows))


def _accuracy_table(study: ReportedAccuracy) -> Table:
    heads = ["quantity, reference", "numbers", "worst\nurdfkin", "\nPinocchio"]
    heads += ["typical\nurdfkin", "\nPinocchio", "smaller\nerror"]
    rows = [
        [
            check_name(line),
            f"{line['numbers']:,}",
            *error_cells(line),
            more_accurate(line),
        ]
        for line in study["lines"]
    ]
    return Table(heads, rows)


def _print_robot(robot: ReportedRobot, out: Console, *, cases: bool, reason: bool) -> None:
    if robot["reason"] and reason:
        first, *rest = robot["reason"].split("\n")
        out.print(f"{robot['source']}: {robot['verdict']}: {first}")
        for line in rest:
            out.print(line)
    noted = [finding for finding in robot["findings"] if finding["severity"] != "note"]
    if noted and robot["checks"] and cases:
        out.print(
            f"{robot['source']}: {format_count(len(noted), 'warning')}, see: urdfkin check {robot['source']}"
        )
    reading = robot.get("second_reader")
    if cases and reading is not None and (reading["known"] or reading["unread"]):
        out.print(f"{robot['source']}: {second_reader_words(robot)}")
    if robot["accuracy"] is not None:
        out.print(
            f"{robot['source']}: differences from values with 50 digits, in eps*scale;"
            f" {accuracy_words(robot['accuracy'])}",
            style="bold",
        )
        print_table(out, _accuracy_table(robot["accuracy"]))
    for check in robot["checks"]:
        case = check["worst_case"]
        if case is None or not (cases or check["failed"]):
            continue
        out.print(
            f"{robot['source']}, {check_name(check)}: {check['failed']:,} of {check['results']:,} outside"
            f" the bound, worst {format_units(check['worst'])} eps*scale,"
            f" {format_ratio(check['bound_ratio'])} of the bound"
        )
        out.print(f"  {case['replay']}", soft_wrap=True)
