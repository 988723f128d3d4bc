"""Markdown for a comment on a pull request: verdict, table, and failures with commands to reproduce them."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Sequence
from itertools import accumulate

from urdfkin.errors.display import format_count
from urdfkin.errors.escape import escape_unprintable, markdown_code
from urdfkin.errors.escape import markdown_text as text
from urdfkin.report.words import (
    VERDICTS,
    bound_ratio_cell,
    check_name,
    format_units,
    quantities_by_heading,
    quantities_disagreement_cell,
    second_oracle_heads,
    second_oracle_rows,
    second_oracle_title,
    summary,
)
from urdfkin.validation.document import Document, ReportedRobot, outcome_of

#: GitHub accepts comments of up to 65,536 characters.
MAX_CHARACTERS = 60_000
_VERDICT_MARKS = {"verified": "✅", "disagrees": "❌", "not verified": "⚠️", "bad input": "⛔"}
_MAX_FAILED_CHECKS = 3


def as_markdown(document: Document) -> str:
    """Return the report as a comment on a pull request.

    The robots with the worst verdicts come first. Robots that do not fit into the comment are only counted.
    """
    found = outcome_of(document)
    head = [
        f"## {'✅ Verified against' if found.passed else '❌ Not verified against'} Pinocchio"
        f" {text(document['versions'].get('pin', '?'))}",
        "",
        text(summary(document)),
        "",
        *([f"Not passed: {text(found.reason)}", ""] if found.reason else []),
    ]
    foot = [
        "",
        *_cross_check_table(document["robots"]),
        "The first table has the worst disagreement of each robot for each quantity, in multiples of"
        " eps·scale. eps is 2^-52, and scale is the size of the terms that are added to compute the number."
        " Rounding errors give 1 to 10.",
        "",
        f"<sub>urdfkin {text(document['versions'].get('urdfkin', '?'))}, {text(document['started'])}."
        " To repeat the run:</sub>",
        "",
        fence_code(shorten(document["command"] or "", 2000)),
        "",
    ]
    robots = sorted(document["robots"], key=lambda robot: VERDICTS.index(robot["verdict"]))
    room = MAX_CHARACTERS - len("\n".join(head + foot))
    return "\n".join(head + _body(robots, room) + foot)


def _cross_check_table(robots: list[ReportedRobot]) -> list[str]:
    if (title := second_oracle_title(robots)) is None:
        return []
    heads = ["quantity", *map(text, second_oracle_heads(title))]
    rows = (map(text, (name, *cells)) for name, cells in second_oracle_rows(robots, title))
    return [
        f"Comparison of urdfkin, Pinocchio and {text(title)}: the largest ratio of a disagreement to its"
        " bound, for each pair of libraries:",
        "",
        *table_lines(heads, rows, left=(0, len(heads) - 1)),
        "",
    ]


def _body(robots: list[ReportedRobot], room: int) -> list[str]:
    quantities = quantities_by_heading(robots)
    heads = ["robot", "joints", "frames", "results", *map(text, quantities), "of bound", "verdict"]
    lines = table_lines(heads, left=(0, len(heads) - 1))
    parts = [(row_line(_cells(robot, list(quantities.values()))), _details(robot)) for robot in robots]
    room -= sum(len(line) + 1 for line in lines) + 200
    shown = count_within(["\n".join([row, *details]) for row, details in parts], room)
    tails = [line for _, details in parts[:shown] for line in details]
    if rest := robots[shown:]:
        good = sum(robot["verdict"] == "verified" for robot in rest)
        tails += [
            "",
            f"{format_count(len(rest), 'further robot')} left out, because the comment is full; {good} of"
            " them verified.",
        ]
    return [*lines, *(row for row, _ in parts[:shown]), *tails]


def _cells(robot: ReportedRobot, quantities: list[tuple[str, ...]]) -> list[str]:
    verdict = robot["verdict"]
    return [
        markdown_code(shorten(robot["source"], 60)),
        str(len(robot["joints"])),
        str(len(robot["frames"])),
        f"{robot['results']:,}",
        *(quantities_disagreement_cell(robot, names) for names in quantities),
        bound_ratio_cell(robot),
        f"{_VERDICT_MARKS[verdict]} {verdict}",
    ]


def _details(robot: ReportedRobot) -> list[str]:
    lines: list[str] = []
    if robot["reason"]:
        lines += ["", f"**{markdown_code(robot['source'])}**: {text(shorten(robot['reason'], 600))}"]
    failed = [check for check in robot["checks"] if check["failed"]]
    for check in failed[:_MAX_FAILED_CHECKS]:
        lines += [
            "",
            f"**{markdown_code(robot['source'])}**, {text(check_name(check))}: {check['failed']:,} of"
            f" {check['results']:,} outside their bound, worst {format_units(check['worst'])} eps·scale",
        ]
        if check["worst_case"] is not None:
            lines += ["", fence_code(shorten(check["worst_case"]["replay"], 4000))]
    if len(failed) > _MAX_FAILED_CHECKS:
        lines += [
            "",
            f"... and {len(failed) - _MAX_FAILED_CHECKS} more quantities of {markdown_code(robot['source'])}",
        ]
    return lines


def row_line(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cells)} |"


def table_lines(
    heads: Sequence[str], rows: Iterable[Iterable[str]] = (), left: Collection[int] | None = None
) -> list[str]:
    """Return the lines of a Markdown table.

    The caller must escape the cells. Columns in `left` are left-aligned, and others right-aligned. If `left`
    is None, all columns are left-aligned.
    """
    marks = ["---" if left is None or i in left else "---:" for i in range(len(heads))]
    return [row_line(cells) for cells in (heads, marks, *rows)]


def count_within(texts: Sequence[str], room: int) -> int:
    """Return how many of the first texts, each with a line end, fit into `room` characters."""
    return sum(end <= room for end in accumulate(len(text) + 1 for text in texts))


def fence_code(code: str) -> str:
    """Return a code block with a fence that is longer than any run of backticks in the code."""
    longest = max((len(run) for run in re.findall("`+", code)), default=0)
    fence = "`" * max(3, longest + 1)
    lines = "\n".join(map(escape_unprintable, code.split("\n")))
    return f"{fence}sh\n{lines}\n{fence}"


def shorten(words: str, length: int) -> str:
    return words if len(words) <= length else words[: length - 4] + " ..."
