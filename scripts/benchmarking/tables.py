"""The figures as tables of words, for the terminal and for the page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import groupby
from typing import Any

#: A row of the figures, as data.
Entry = Mapping[str, Any]


@dataclass(frozen=True)
class Words:
    """One table: its section, what it is of, the columns' heads, the rows; the first column is words."""

    section: str
    title: str
    head: tuple[str, ...]
    rows: list[tuple[str, ...]]
    remarks: tuple[str, ...] = ()


def tables(figures: Mapping[str, Any]) -> Iterator[Words]:
    """Every table of a run, in order."""
    entries = figures["rows"]
    for (section, robot, quantity), group in groupby(
        (row for row in entries if row["section"] in ("batch", "single", "verified")),
        key=lambda row: (row["section"], row["robot"], row["quantity"]),
    ):
        yield _contest(section, f"{robot}, {quantity}", list(group))
    for section, make in (("joints", _joints), ("frames", _frames), ("sizes", _sizes)):
        if chosen := [row for row in entries if row["section"] == section]:
            yield make(chosen)
    if figures["memory"]:
        yield _memory(figures["memory"])


def number(x: float) -> str:
    """Three digits, and no power of ten."""
    digits = 2 if x < 10 else 1 if x < 100 else 0
    return f"{x:,.{digits}f}"


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


def _joints(rows: list[Entry]) -> Words:
    return Words(
        "joints",
        "chains: the tip's result, one thread",
        ("", "joints", "ns for one configuration", "for one joint", "for one number written"),
        [
            (
                f"{row['quantity']}, {row['who']}",
                str(row["size"]),
                number(row["median_ns"]),
                number(row["median_ns"] / row["size"]),
                number(row["median_ns"] / row["numbers"]),
            )
            for row in _together(rows)
        ],
    )


def _frames(rows: list[Entry]) -> Words:
    return Words(
        "frames",
        f"{rows[0]['robot']}: placements of several links, one thread",
        ("", "links", "ns for one configuration", "for one link"),
        [
            (row["who"], str(row["size"]), number(row["median_ns"]), number(row["median_ns"] / row["size"]))
            for row in _together(rows)
        ],
    )


def _sizes(rows: list[Entry]) -> Words:
    return Words(
        "sizes",
        f"{rows[0]['robot']}: batches of several sizes, one thread, out= given",
        ("", "configurations", "ns for one, median", "minimum"),
        [
            (
                f"{row['quantity']}, {row['who']}",
                f"{row['size']:,}",
                number(row["median_ns"]),
                number(row["minimum_ns"]),
            )
            for row in _together(rows)
        ],
    )


def _together(rows: list[Entry]) -> list[Entry]:
    """Rows of one contender and quantity beside each other, in the order in which they first come."""
    seen = list(dict.fromkeys((row["quantity"], row["who"]) for row in rows))
    quantities = list(dict.fromkeys(row["quantity"] for row in rows))
    return sorted(
        rows,
        key=lambda row: (quantities.index(row["quantity"]), seen.index((row["quantity"], row["who"]))),
    )


def _memory(entries: list[Entry]) -> Words:
    return Words(
        "memory",
        f"{entries[0]['robot']}: memory of a batch, output included",
        ("", "configurations", "output, MB", "at the most, MB", "beyond the output"),
        [
            (
                f"{entry['quantity']}, {'out= given' if entry['out'] else 'no out='}",
                f"{entry['n']:,}",
                number(entry["output_bytes"] / 1e6),
                number(entry["peak_bytes"] / 1e6),
                f"{100 * (entry['peak_bytes'] / entry['output_bytes'] - 1):.1f} %",
            )
            for entry in entries
        ],
    )
