"""The figures as tables of words, for the terminal and for the page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import groupby
from typing import Any

from scripts.benchmarking.growth_tables import growth_tables
from scripts.benchmarking.words import Entry, Words, number


def tables(figures: Mapping[str, Any]) -> Iterator[Words]:
    """Every table of a run, in order."""
    entries = figures["rows"]
    for (section, robot, quantity), group in groupby(
        (row for row in entries if row["section"] in ("batch", "single", "verified")),
        key=lambda row: (row["section"], row["robot"], row["quantity"]),
    ):
        yield _contest(section, f"{robot}, {quantity}", list(group))
    if batch := [row for row in entries if row["section"] == "batch"]:
        yield _summary(batch)
        yield _floor(batch, figures["operations"])
    yield from growth_tables(figures)


def _contest(section: str, title: str, rows: list[Entry]) -> Words:
    own = section == "verified"
    ratio = "cost, Pinocchio's own = 1" if own else "times as fast as Pinocchio's loop"
    remarks = tuple(dict.fromkeys(row["remark"] for row in rows if row["remark"]))
    marks = {remark: f" [{i + 1}]" for i, remark in enumerate(remarks)}
    return Words(
        section,
        f"{title}: {rows[0]['numbers']} numbers, ns for one configuration",
        (
            "",
            "median",
            "minimum",
            ratio.replace("loop", "calls") if section == "single" else ratio,
            "at a time",
        ),
        [
            (
                row["who"] + marks.get(row["remark"], ""),
                number(row["median_ns"]),
                number(row["minimum_ns"]),
                number(1 / row["ratio"] if own else row["ratio"]),
                f"{1 if section == 'single' else row['n']:,}",
            )
            for row in rows
        ],
        remarks,
    )


def _summary(rows: list[Entry]) -> Words:
    """One thread and all, against Pinocchio's loop and against the fastest other, whoever that is."""
    found = []
    for title, group in _tables_of(rows):
        who = {row["who"]: row for row in group}
        ours = [row for name, row in who.items() if name.startswith("urdfkin") and "no out" not in name]
        others = [row for name, row in who.items() if not name.startswith(("urdfkin", "output"))]
        best = min(others, key=lambda row: float(row["median_ns"]))
        found.append(
            (
                title,
                number(ours[0]["median_ns"]),
                number(ours[0]["ratio"]),
                number(ours[-1]["ratio"]),
                f"{best['who']}, {number(best['median_ns'])}",
                number(best["median_ns"] / ours[0]["median_ns"]),
            )
        )
    heads = (
        "1 thread, ns",
        "times Pinocchio's loop",
        "all threads",
        "fastest other, ns",
        "times that, 1 thread",
    )
    return Words("summary", "urdfkin against the others, medians", ("", *heads), found)


def _floor(rows: list[Entry], operations: Mapping[str, int]) -> Words:
    """What it takes to write the output once, how much there is to compute, and what urdfkin takes."""
    found = []
    for title, group in _tables_of(rows):
        who = {row["who"].partition(",")[0]: row for row in reversed(group)}
        fill, ours = who["output written once (fill)"], who["urdfkin"]
        size = 8 * fill["numbers"]
        found.append(
            (
                title,
                f"{size:,}",
                number(fill["median_ns"]),
                f"{operations[title]:,}",
                number(ours["median_ns"]),
                number(size / ours["median_ns"]),
                number(operations[title] / ours["median_ns"]),
            )
        )
    heads = (
        "bytes written",
        "fill, ns",
        "operations",
        "urdfkin, 1 thread, ns",
        "bytes a ns",
        "operations a ns",
    )
    return Words("floor", "the floor: bytes and operations of one configuration", ("", *heads), found)


def _tables_of(rows: list[Entry]) -> Iterator[tuple[str, list[Entry]]]:
    for (robot, quantity), group in groupby(rows, key=lambda row: (row["robot"], row["quantity"])):
        yield f"{robot}, {quantity}", list(group)
