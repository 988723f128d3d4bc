"""Format the measurements as tables, for the terminal and for the page."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from rich.console import Console
from rich.table import Table

from scripts.benchmarking.contenders import COMPILED, FLOOR, ONE
from scripts.benchmarking.generated import GENERATED
from scripts.benchmarking.machine import EMPTY, KEPT

#: The measurements of one contender, as a mapping.
Entry = Mapping[str, Any]


@dataclass(frozen=True)
class Words:
    """One table as text, with section, title, column headings and rows; the first column contains names."""

    section: str
    title: str
    head: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    remarks: tuple[str, ...] = ()


def number(x: float) -> str:
    """Format a number with three digits and without an exponent."""
    digits = 2 if abs(x) < 10 else 1 if abs(x) < 100 else 0
    return f"{x:,.{digits}f}"


def tables(figures: Mapping[str, Any]) -> Iterator[Words]:
    """Yield the tables of a run, in order."""
    entries = figures["rows"]
    for (section, robot, quantity), group in groupby(
        (row for row in entries if row["section"] in ("batch", "single", "checked", "verified")),
        key=lambda row: (row["section"], row["robot"], row["quantity"]),
    ):
        yield _contest(section, f"{robot}, {quantity}", list(group))
    if batch := [row for row in entries if row["section"] == "batch"]:
        yield _summary(batch)
        yield _floor(batch, figures["operations"])
    for kind, what in (("batch", "a batch, one thread"), ("single", "a single call")):
        if chosen := [entry for entry in figures.get("where", ()) if entry["kind"] == kind]:
            yield _where(f"{what}: where the time goes, ns for one configuration", chosen)
    if entries := figures.get("first"):
        yield _first(entries)
    for section, make in (("joints", _joints), ("frames", _frames), ("sizes", _sizes)):
        if chosen := [row for row in figures["rows"] if row["section"] == section]:
            yield make(chosen)
    if figures["memory"]:
        yield _memory(figures["memory"])


def show(figures: Mapping[str, Any], console: Console | None = None) -> None:
    """Print all tables, the machine and the libraries."""
    console = console or Console(width=110, highlight=False)
    machine = figures["machine"]
    console.print(
        f"{machine['processor']}, {machine['processors']} processors, {machine['vectors']}, "
        f"Python {machine['python']}; {figures['rounds']} rounds, float64"
    )
    console.print("; ".join(f"{name} {state}" for name, state in figures["libraries"].items()))
    for words in tables(figures):
        table = Table(title=words.title, title_justify="left", box=None, pad_edge=False, header_style="dim")
        for i, head in enumerate(words.head):
            table.add_column(head, justify="right" if i else "left", no_wrap=not i)
        for row in words.rows:
            table.add_row(*(cell.replace("[", "\\[") for cell in row))
        console.print()
        console.print(table)
        for i, remark in enumerate(words.remarks):
            console.print(f"  \\[{i + 1}] {remark}")


# -- contests ------------------------------------------------------------------------------------------


def _contest(section: str, title: str, rows: list[Entry]) -> Words:
    cost, single = section in ("checked", "verified"), section in ("single", "checked")
    what = "calls" if single else "results stored" if cost else "loop"
    ratio = f"cost, Pinocchio's {what} = 1" if cost else f"times Pinocchio's {what}"
    remarks = tuple(dict.fromkeys(row["remark"] for row in rows if row["remark"]))
    marks = {remark: f" [{i + 1}]" for i, remark in enumerate(remarks)}
    ceiling = _generated(rows)

    def cells(row: Entry) -> Iterator[str]:
        yield row["who"] + marks.get(row["remark"], "")
        yield number(row["median_ns"])
        yield number(row["minimum_ns"])
        yield number(1 / row["ratio"] if cost else row["ratio"])
        if ceiling:
            yield number(ceiling / row["median_ns"])
        yield f"{1 if single else row['n']:,}"

    return Words(
        section,
        f"{title}: {rows[0]['numbers']} numbers, ns for one configuration",
        ("", "median", "minimum", ratio, *([_SHARE] if ceiling else ()), "configurations per call"),
        [tuple(cells(row)) for row in rows],
        remarks,
    )


_SHARE = "times generated code"
#: Pattern of urdfkin's name in the measurements with all threads.
#: The name contains the number of threads of the measuring machine.
_SEVERAL = re.compile(r"urdfkin, \d+ threads")


def _generated(rows: Sequence[Entry]) -> float | None:
    """Return the time of code generated for the robot, or None without a measurement."""
    return next((float(row["median_ns"]) for row in rows if row["who"] == GENERATED), None)


def _summary(rows: list[Entry]) -> Words:
    """Summarise urdfkin with one thread and with all threads, compared with the fastest other contenders."""
    found = []
    for title, group in _tables_of(rows):
        who = {row["who"]: row for row in group}
        several = next((row for row in group if _SEVERAL.fullmatch(row["who"])), None)
        one = float(who[ONE]["median_ns"])
        others = [row for row in group if not row["who"].startswith(("urdfkin", FLOOR, GENERATED))]
        best, ceiling = min(others, key=lambda row: float(row["median_ns"])), _generated(group)
        found.append(
            (
                title,
                number(one),
                number(who[ONE]["ratio"]),
                number(several["ratio"]) if several else "one processor",
                number(who[COMPILED]["ratio"]) if COMPILED in who else "not measured",
                number(ceiling / one) if ceiling else "not measured",
                f"{best['who']}, {number(best['median_ns'])}",
                number(best["median_ns"] / one),
            )
        )
    heads = (
        "1 thread, ns",
        "times Pinocchio's loop",
        "the same, all threads",
        "the same, compiled for this robot, 1 thread",
        _SHARE,
        "fastest other library, ns",
        "urdfkin, 1 thread, times faster",
    )
    return Words("summary", "urdfkin against the others, medians", ("", *heads), found)


def _floor(rows: list[Entry], operations: Mapping[str, int]) -> Words:
    """Compare urdfkin's time with the time to write the output once and with the number of operations."""
    found = []
    for title, group in _tables_of(rows):
        who = {row["who"].partition(",")[0]: row for row in reversed(group)}
        fill, ours = who[FLOOR], who["urdfkin"]
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
        "bytes per ns",
        "operations per ns",
    )
    return Words(
        "floor", "lower limit of the time: bytes and operations of one configuration", ("", *heads), found
    )


def _tables_of(rows: list[Entry]) -> Iterator[tuple[str, list[Entry]]]:
    for (robot, quantity), group in groupby(rows, key=lambda row: (row["robot"], row["quantity"])):
        yield f"{robot}, {quantity}", list(group)


# -- where the time goes ---------------------------------------------------------------------------------


def _where(title: str, entries: Sequence[Entry]) -> Words:
    """Return a column for each robot and quantity, with nanoseconds and the fraction of the total time."""
    parts = dict.fromkeys(part for entry in entries for part in entry["parts"])

    def cell(entry: Entry, part: str) -> str:
        if part not in entry["parts"]:
            return ""
        ns = entry["parts"][part]
        return f"{number(ns)} ({100 * ns / entry['ns']:.0f} %)"

    rows = [(part, *(cell(entry, part) for entry in entries)) for part in parts]
    rows.append(("total", *(number(entry["ns"]) for entry in entries)))
    heads = (f"{entry['robot']}, {entry['quantity']}" for entry in entries)
    return Words("where", title, ("", *heads), rows)


def _first(entries: Sequence[Entry]) -> Words:
    return Words(
        "first",
        f"{entries[0]['robot']}: processor time of a first use, s",
        ("", "without stored kernels", "with stored kernels"),
        [(entry["what"], *(number(entry[key] / 1e3) for key in (EMPTY, KEPT))) for entry in entries],
    )


# -- growth ----------------------------------------------------------------------------------------------


def _joints(rows: list[Entry]) -> Words:
    return Words(
        "joints",
        "chains: the tip's result, one thread",
        ("", "joints", "ns for one configuration", "ns per joint", "ns per number of the output"),
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
        ("", "links", "ns for one configuration", "ns per link"),
        [
            (row["who"], str(row["size"]), number(row["median_ns"]), number(row["median_ns"] / row["size"]))
            for row in _together(rows)
        ],
    )


def _sizes(rows: list[Entry]) -> Words:
    return Words(
        "sizes",
        f"{rows[0]['robot']}: batches of several sizes, one thread, out= given",
        ("", "configurations", "ns for one configuration, median", "minimum"),
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
    """Group the rows by contender and quantity, in the order of their first rows."""
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
        ("", "configurations", "output, MB", "peak, MB", "beyond the output"),
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
