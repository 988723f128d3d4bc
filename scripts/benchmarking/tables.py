"""Format the measurements as tables, for the terminal and for the page."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from scripts.benchmarking.contenders import COMPILED, FLOOR, ONE
from scripts.benchmarking.generated import GENERATED
from scripts.benchmarking.machine import EMPTY, STORED
from scripts.pages import insert_parts
from scripts.pages import table as markdown

#: A `Row` as a mapping.
Entry = Mapping[str, Any]
_SHARE = "speed relative to generated code"
NOT_MEASURED = "Not measured yet."
_SEVERAL = re.compile(r"urdfkin, \d+ threads")
#: Sections with measurements for several numbers of joints, frames or configurations. A section has a title,
#: and a function that makes the table row of one measurement.
_GROWTH: dict[str, tuple[str, Callable[[Entry], dict[str, str]]]] = {
    "joints": (
        "chains: the tip's result, one thread",
        lambda row: {
            "": f"{row['quantity']}, {row['label']}",
            "joints": str(row["size"]),
            "ns for one configuration": format_number(row["median_ns"]),
            "ns per joint": format_number(row["median_ns"] / row["size"]),
            "ns per number of the output": format_number(row["median_ns"] / row["numbers"]),
        },
    ),
    "frames": (
        "{robot}: placements of several links, one thread",
        lambda row: {
            "": row["label"],
            "links": str(row["size"]),
            "ns for one configuration": format_number(row["median_ns"]),
            "ns per link": format_number(row["median_ns"] / row["size"]),
        },
    ),
    "sizes": (
        "{robot}: batches of several sizes, one thread, out= given",
        lambda row: {
            "": f"{row['quantity']}, {row['label']}",
            "configurations": f"{row['size']:,}",
            "ns for one configuration, median": format_number(row["median_ns"]),
            "minimum": format_number(row["minimum_ns"]),
        },
    ),
}


@dataclass(frozen=True)
class TextTable:
    """A table as text.

    Attributes:
        cells: Rows, which map headings to cells.
    """

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

    @property
    def text(self) -> str:
        remarks = "".join(f"\n[{i}] {remark}." for i, remark in enumerate(self.remarks, start=1))
        cells = markdown(self.head, self.rows, left=1) + (f"\n{remarks}" if remarks else "")
        return f"**{self.title}**\n\n{cells}"


def format_number(x: float) -> str:
    """Format a number without an exponent: 0.01, 1.23, 12.3, 123 or 12,345."""
    digits = 2 if abs(x) < 10 else 1 if abs(x) < 100 else 0
    return f"{x:,.{digits}f}"


def make_tables(figures: Mapping[str, Any]) -> Iterator[TextTable]:
    sections: dict[str, list[Entry]] = {}
    for row in figures["rows"]:
        sections.setdefault(row["section"], []).append(row)
    for section in (name for name in sections if name in ("batch", "single", "checked", "verified")):
        for title, rows in _group_rows(sections[section]):
            yield _make_contender_table(section, title, rows)
    if batch := sections.get("batch"):
        yield TextTable(
            "summary",
            "urdfkin against the others, medians",
            [_compare_with_best(*group) for group in _group_rows(batch)],
        )
        title = "bytes and operations for one configuration"
        yield TextTable(
            "floor",
            title,
            [_compare_with_limits(*group, figures["operations"]) for group in _group_rows(batch)],
        )
    for kind, description in (("batch", "a batch, one thread"), ("single", "a single call")):
        if chosen := [entry for entry in figures.get("where", ()) if entry["kind"] == kind]:
            yield _make_step_table(f"{description}: where the time goes, ns for one configuration", chosen)
    if entries := figures.get("first"):
        heads = {"without stored kernels": EMPTY, "with stored kernels": STORED}
        times = [
            {"": entry["what"], **{head: format_number(entry[key] / 1e3) for head, key in heads.items()}}
            for entry in entries
        ]
        yield TextTable("first", f"{entries[0]['robot']}: processor time of a first use, s", times)
    for section, (title, cells) in _GROWTH.items():
        if rows := sections.get(section, []):
            # Sort the rows by quantity, then by contender. Quantities and contenders keep their order.
            keys = [(row["quantity"], row["label"]) for row in rows]
            quantities = [quantity for quantity, _ in keys]
            rows = sorted(rows, key=lambda row: keys.index((row["quantity"], row["label"])))
            rows = sorted(rows, key=lambda row: quantities.index(row["quantity"]))
            yield TextTable(section, title.format(robot=rows[0]["robot"]), [cells(row) for row in rows])
    if figures["memory"]:
        yield _make_memory_table(figures["memory"])


def make_page(text: str, figures: Mapping[str, Any]) -> str:
    """Insert the figures into the page."""
    parts: dict[str, list[str]] = {"machine": [format_machine(figures)]}
    for words in make_tables(figures):
        parts.setdefault(words.section, []).append(words.text)
    places = re.findall(r"<!-- figures: (\w+) -->", text)
    if set(parts) - set(places) or len(places) != len(set(places)):
        raise ValueError(f"the page has places for {places}, the figures are {list(parts)}")
    texts = {place: "\n\n".join(parts.get(place, [NOT_MEASURED])) for place in places}
    return insert_parts(text, **{f"figures: {place}": part for place, part in texts.items()})


def format_machine(figures: Mapping[str, Any]) -> str:
    machine, versions = figures["machine"], figures["versions"]
    libraries = figures["libraries"] | {name: versions[name] for name in ("numpy", "numba")}
    return (
        f"{machine['processor']}, {machine['processors']} processors, {machine['vectors']}, "
        f"{machine['memory_gib']} GiB, {machine['system']}, Python {machine['python']}; "
        f"{', '.join(f'{name} {state}' for name, state in libraries.items())}. "
        f"{figures['rounds']} rounds, float64."
    )


def _group_rows(rows: list[Entry]) -> Iterator[tuple[str, list[Entry]]]:
    for (robot, quantity), group in groupby(rows, key=lambda row: (row["robot"], row["quantity"])):
        yield f"{robot}, {quantity}", list(group)


def _make_contender_table(section: str, title: str, rows: list[Entry]) -> TextTable:
    cost, single = section in ("checked", "verified"), section in ("single", "checked")
    baseline = "calls" if single else "results stored" if cost else "loop"
    ratio = f"{'cost' if cost else 'speed'} relative to Pinocchio's {baseline}"
    remarks = list(dict.fromkeys(row["remark"] for row in rows if row["remark"]))
    ceiling = _generated_time(rows)
    cells = [
        {
            "": row["label"] + (f" [{remarks.index(row['remark']) + 1}]" if row["remark"] else ""),
            "median": format_number(row["median_ns"]),
            "minimum": format_number(row["minimum_ns"]),
            ratio: format_number(1 / row["ratio"] if cost else row["ratio"]),
            **({_SHARE: format_number(ceiling / row["median_ns"])} if ceiling else {}),
            "configurations per call": f"{1 if single else row['n']:,}",
        }
        for row in rows
    ]
    return TextTable(
        section, f"{title}: {rows[0]['numbers']} numbers, ns for one configuration", cells, remarks
    )


def _generated_time(rows: Sequence[Entry]) -> float | None:
    return next((float(row["median_ns"]) for row in rows if row["label"] == GENERATED), None)


def _compare_with_best(title: str, group: list[Entry]) -> dict[str, str]:
    rows = {row["label"]: row for row in group}
    several = next((row for row in group if _SEVERAL.fullmatch(row["label"])), None)
    one_thread_ns, ceiling = float(rows[ONE]["median_ns"]), _generated_time(group)
    others = [row for row in group if not row["label"].startswith(("urdfkin", FLOOR, GENERATED))]
    best = min(others, key=lambda row: float(row["median_ns"]))
    compiled = format_number(rows[COMPILED]["ratio"]) if COMPILED in rows else "not measured"
    return {
        "": title,
        "1 thread, ns": format_number(one_thread_ns),
        "speed relative to Pinocchio's loop": format_number(rows[ONE]["ratio"]),
        "speed with all threads, relative to the loop": format_number(several["ratio"])
        if several
        else "one processor",
        "speed of code compiled for this robot, 1 thread, relative to the loop": compiled,
        _SHARE: format_number(ceiling / one_thread_ns) if ceiling else "not measured",
        "fastest other library, ns": f"{best['label']}, {format_number(best['median_ns'])}",
        "speed of urdfkin, 1 thread, relative to this library": format_number(
            best["median_ns"] / one_thread_ns
        ),
    }


def _compare_with_limits(title: str, group: list[Entry], operations: Mapping[str, int]) -> dict[str, str]:
    rows = {row["label"].partition(",")[0]: row for row in reversed(group)}
    fill, ns = rows[FLOOR], rows["urdfkin"]["median_ns"]
    size = 8 * fill["numbers"]
    return {
        "": title,
        "bytes written": f"{size:,}",
        "fill, ns": format_number(fill["median_ns"]),
        "operations": f"{operations[title]:,}",
        "urdfkin, 1 thread, ns": format_number(ns),
        "bytes per ns": format_number(size / ns),
        "operations per ns": format_number(operations[title] / ns),
    }


def _make_step_table(title: str, entries: Sequence[Entry]) -> TextTable:
    def cell(entry: Entry, part: str) -> str:
        ns = entry["parts"].get(part)
        return "" if ns is None else f"{format_number(ns)} ({100 * ns / entry['ns']:.0f} %)"

    columns = {f"{entry['robot']}, {entry['quantity']}": entry for entry in entries}
    parts = dict.fromkeys(part for entry in entries for part in entry["parts"])
    cells = [{"": part} | {name: cell(entry, part) for name, entry in columns.items()} for part in parts]
    cells.append({"": "total"} | {name: format_number(entry["ns"]) for name, entry in columns.items()})
    return TextTable("where", title, cells)


def _make_memory_table(entries: list[Entry]) -> TextTable:
    cells = [
        {
            "": f"{entry['quantity']}, {'out= given' if entry['out'] else 'no out='}",
            "configurations": f"{entry['n']:,}",
            "output, MB": format_number(entry["output_bytes"] / 1e6),
            "peak, MB": format_number(entry["peak_bytes"] / 1e6),
            "beyond the output": f"{100 * (entry['peak_bytes'] / entry['output_bytes'] - 1):.1f} %",
        }
        for entry in entries
    ]
    return TextTable("memory", f"{entries[0]['robot']}: memory of a batch, output included", cells)
