"""The figures of growth as tables of words: joints, frames, batches, memory."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from scripts.benchmarking.words import Entry, Words, number


def growth_tables(figures: Mapping[str, Any]) -> Iterator[Words]:
    """The tables of what was measured."""
    for section, make in (("joints", _joints), ("frames", _frames), ("sizes", _sizes)):
        if chosen := [row for row in figures["rows"] if row["section"] == section]:
            yield make(chosen)
    if figures["memory"]:
        yield _memory(figures["memory"])


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
