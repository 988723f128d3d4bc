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
from scripts.pages import inserted
from scripts.pages import table as markdown

#: The measurements of one contender, as a mapping.
Entry = Mapping[str, Any]
_SHARE = "times generated code"
NOT_MEASURED = "Not measured yet."
_SEVERAL = re.compile(r"urdfkin, \d+ threads")


@dataclass(frozen=True)
class Words:
    """A table as text: its rows map headings to cells, and its first column has names."""

    section: str
    title: str
    cells: Sequence[Mapping[str, str]]
    remarks: Sequence[str] = ()

    @property
    def head(self) -> tuple[str, ...]:
        return tuple(self.cells[0])

    @property
    def rows(self) -> list[tuple[str, ...]]:
        return [tuple(row.values()) for row in self.cells]


def number(x: float) -> str:
    """Format a number with three digits and without an exponent."""
    digits = 2 if abs(x) < 10 else 1 if abs(x) < 100 else 0
    return f"{x:,.{digits}f}"


def tables(figures: Mapping[str, Any]) -> Iterator[Words]:
    sections: dict[str, list[Entry]] = {}
    for row in figures["rows"]:
        sections.setdefault(row["section"], []).append(row)
    for section in (name for name in sections if name in ("batch", "single", "checked", "verified")):
        for title, rows in _groups(sections[section]):
            yield _contest(section, title, rows)
    if batch := sections.get("batch"):
        yield Words("summary", "urdfkin against the others, medians", [_best(*one) for one in _groups(batch)])
        yield _floor(batch, figures["operations"])
    for kind, what in (("batch", "a batch, one thread"), ("single", "a single call")):
        if chosen := [entry for entry in figures.get("where", ()) if entry["kind"] == kind]:
            yield _where(f"{what}: where the time goes, ns for one configuration", chosen)
    if entries := figures.get("first"):
        yield _first(entries)
    for section, make in (("joints", _joints), ("frames", _frames), ("sizes", _sizes)):
        if rows := sections.get(section, []):
            yield make(rows)
    if figures["memory"]:
        yield _memory(figures["memory"])


def show(figures: Mapping[str, Any], console: Console | None = None) -> None:
    console = console or Console(width=110, highlight=False)
    console.print(_machine(figures))
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


def page(text: str, figures: Mapping[str, Any]) -> str:
    """Return the page with the figures in their places; raise ValueError if a place is missing or double."""
    parts: dict[str, list[str]] = {"machine": [_machine(figures)]}
    for words in tables(figures):
        remarks = "".join(f"\n[{i}] {remark}." for i, remark in enumerate(words.remarks, start=1))
        cells = markdown(words.head, words.rows, left=1) + (f"\n{remarks}" if remarks else "")
        parts.setdefault(words.section, []).append(f"**{words.title}**\n\n{cells}")
    places = re.findall(r"<!-- figures: (\w+) -->", text)
    if set(parts) - set(places) or len(places) != len(set(places)):
        raise ValueError(f"the page has places for {places}, the figures are {list(parts)}")
    texts = {place: "\n\n".join(parts.get(place, [NOT_MEASURED])) for place in places}
    return inserted(text, **{f"figures: {place}": part for place, part in texts.items()})


def _machine(figures: Mapping[str, Any]) -> str:
    machine, versions = figures["machine"], figures["versions"]
    libraries = figures["libraries"] | {name: versions[name] for name in ("numpy", "numba")}
    return (
        f"{machine['processor']}, {machine['processors']} processors, {machine['vectors']}, "
        f"{machine['memory_gib']} GiB, {machine['system']}, Python {machine['python']}; "
        f"{', '.join(f'{name} {state}' for name, state in libraries.items())}. "
        f"{figures['rounds']} rounds, float64."
    )


def _groups(rows: list[Entry]) -> Iterator[tuple[str, list[Entry]]]:
    """Yield "robot, quantity" and the rows of each robot and quantity."""
    for (robot, quantity), group in groupby(rows, key=lambda row: (row["robot"], row["quantity"])):
        yield f"{robot}, {quantity}", list(group)


def _contest(section: str, title: str, rows: list[Entry]) -> Words:
    cost, single = section in ("checked", "verified"), section in ("single", "checked")
    what = "calls" if single else "results stored" if cost else "loop"
    ratio = f"cost, Pinocchio's {what} = 1" if cost else f"times Pinocchio's {what}"
    remarks = list(dict.fromkeys(row["remark"] for row in rows if row["remark"]))
    ceiling = _generated(rows)
    cells = [
        {
            "": row["who"] + (f" [{remarks.index(row['remark']) + 1}]" if row["remark"] else ""),
            "median": number(row["median_ns"]),
            "minimum": number(row["minimum_ns"]),
            ratio: number(1 / row["ratio"] if cost else row["ratio"]),
            **({_SHARE: number(ceiling / row["median_ns"])} if ceiling else {}),
            "configurations per call": f"{1 if single else row['n']:,}",
        }
        for row in rows
    ]
    return Words(section, f"{title}: {rows[0]['numbers']} numbers, ns for one configuration", cells, remarks)


def _generated(rows: Sequence[Entry]) -> float | None:
    """Return the time of code generated for the robot, or None without a measurement."""
    return next((float(row["median_ns"]) for row in rows if row["who"] == GENERATED), None)


def _best(title: str, group: list[Entry]) -> dict[str, str]:
    """Compare urdfkin, with one thread and with all threads, with the fastest other contender."""
    who = {row["who"]: row for row in group}
    several = next((row for row in group if _SEVERAL.fullmatch(row["who"])), None)
    one, ceiling = float(who[ONE]["median_ns"]), _generated(group)
    others = [row for row in group if not row["who"].startswith(("urdfkin", FLOOR, GENERATED))]
    best = min(others, key=lambda row: float(row["median_ns"]))
    compiled = number(who[COMPILED]["ratio"]) if COMPILED in who else "not measured"
    return {
        "": title,
        "1 thread, ns": number(one),
        "times Pinocchio's loop": number(who[ONE]["ratio"]),
        "the same, all threads": number(several["ratio"]) if several else "one processor",
        "the same, compiled for this robot, 1 thread": compiled,
        _SHARE: number(ceiling / one) if ceiling else "not measured",
        "fastest other library, ns": f"{best['who']}, {number(best['median_ns'])}",
        "urdfkin, 1 thread, times faster": number(best["median_ns"] / one),
    }


def _floor(rows: list[Entry], operations: Mapping[str, int]) -> Words:
    """Compare urdfkin's time with the time to write the output once and with the number of operations."""
    cells = []
    for title, group in _groups(rows):
        who = {row["who"].partition(",")[0]: row for row in reversed(group)}
        fill, ns = who[FLOOR], who["urdfkin"]["median_ns"]
        size = 8 * fill["numbers"]
        cells.append(
            {
                "": title,
                "bytes written": f"{size:,}",
                "fill, ns": number(fill["median_ns"]),
                "operations": f"{operations[title]:,}",
                "urdfkin, 1 thread, ns": number(ns),
                "bytes per ns": number(size / ns),
                "operations per ns": number(operations[title] / ns),
            }
        )
    return Words(
        "floor", "lower limits of the time for one configuration, from its bytes and its operations", cells
    )


def _where(title: str, entries: Sequence[Entry]) -> Words:
    """Return a column for each robot and quantity, with nanoseconds and the fraction of the total time."""
    names = [f"{entry['robot']}, {entry['quantity']}" for entry in entries]

    def cell(entry: Entry, part: str) -> str:
        ns = entry["parts"].get(part)
        return "" if ns is None else f"{number(ns)} ({100 * ns / entry['ns']:.0f} %)"

    parts = dict.fromkeys(part for entry in entries for part in entry["parts"])
    rows = [(part, *(cell(entry, part) for entry in entries)) for part in parts]
    rows.append(("total", *(number(entry["ns"]) for entry in entries)))
    return Words("where", title, [dict(zip(("", *names), row, strict=True)) for row in rows])


def _first(entries: Sequence[Entry]) -> Words:
    heads = {"without stored kernels": EMPTY, "with stored kernels": KEPT}
    cells = [
        {"": entry["what"], **{head: number(entry[key] / 1e3) for head, key in heads.items()}}
        for entry in entries
    ]
    return Words("first", f"{entries[0]['robot']}: processor time of a first use, s", cells)


def _joints(rows: list[Entry]) -> Words:
    cells = [
        {
            "": f"{row['quantity']}, {row['who']}",
            "joints": str(row["size"]),
            "ns for one configuration": number(row["median_ns"]),
            "ns per joint": number(row["median_ns"] / row["size"]),
            "ns per number of the output": number(row["median_ns"] / row["numbers"]),
        }
        for row in _together(rows)
    ]
    return Words("joints", "chains: the tip's result, one thread", cells)


def _frames(rows: list[Entry]) -> Words:
    cells = [
        {
            "": row["who"],
            "links": str(row["size"]),
            "ns for one configuration": number(row["median_ns"]),
            "ns per link": number(row["median_ns"] / row["size"]),
        }
        for row in _together(rows)
    ]
    return Words("frames", f"{rows[0]['robot']}: placements of several links, one thread", cells)


def _sizes(rows: list[Entry]) -> Words:
    cells = [
        {
            "": f"{row['quantity']}, {row['who']}",
            "configurations": f"{row['size']:,}",
            "ns for one configuration, median": number(row["median_ns"]),
            "minimum": number(row["minimum_ns"]),
        }
        for row in _together(rows)
    ]
    return Words("sizes", f"{rows[0]['robot']}: batches of several sizes, one thread, out= given", cells)


def _together(rows: list[Entry]) -> list[Entry]:
    """Group the rows by quantity and contender, in the order of their first rows."""
    quantities = list(dict.fromkeys(row["quantity"] for row in rows))
    seen = list(dict.fromkeys((row["quantity"], row["who"]) for row in rows))
    return sorted(
        rows, key=lambda row: (quantities.index(row["quantity"]), seen.index((row["quantity"], row["who"])))
    )


def _memory(entries: list[Entry]) -> Words:
    cells = [
        {
            "": f"{entry['quantity']}, {'out= given' if entry['out'] else 'no out='}",
            "configurations": f"{entry['n']:,}",
            "output, MB": number(entry["output_bytes"] / 1e6),
            "peak, MB": number(entry["peak_bytes"] / 1e6),
            "beyond the output": f"{100 * (entry['peak_bytes'] / entry['output_bytes'] - 1):.1f} %",
        }
        for entry in entries
    ]
    return Words("memory", f"{entries[0]['robot']}: memory of a batch, output included", cells)
