"""The figures on a terminal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.console import Console
from rich.table import Table

from scripts.benchmarking.tables import tables


def show(figures: Mapping[str, Any], console: Console | None = None) -> None:
    """Print every table, the machine and the libraries."""
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
