"""A comparison of two reports, to read: on a terminal and as Markdown."""

from __future__ import annotations

from typing import TYPE_CHECKING

from urdfkin.errors.printable import markdown_text as text
from urdfkin.report.compare import Change, Comparison, figures
from urdfkin.report.document import Document, Units
from urdfkin.report.listing import print_named
from urdfkin.report.markdown import LIMIT, shortened
from urdfkin.report.words import counted, quantity_name, summary, units

if TYPE_CHECKING:
    from rich.console import Console


def print_comparison(old: Document, new: Document, found: Comparison, out: Console) -> None:
    """Print what changed; every line reads without colour."""
    for title, document in (("old", old), ("new", new)):
        out.print(f"{title}: {document['started']}, {summary(document)}")
    heads = ["worst, eps*scale", "old", "new"]
    rows = [[quantity_name(name), _cell(a), _cell(b)] for name, a, b in figures(old, new)]
    print_named(out, heads, rows)
    for change in sorted(found.changes, key=lambda change: not change.regression):
        mark = "REGRESSION " if change.regression else ""
        out.print(f"{mark}{change}", style="bold red" if change.regression else "")
    out.print(f"{verdict(found)} ({_exit(found)})", style="bold red" if found.regressions else "bold green")


def verdict(found: Comparison) -> str:
    """The outcome in one line."""
    if found.regressions:
        return f"{counted(len(found.regressions), 'regression')}, {counted(len(found.changes), 'change')}"
    return f"no regression, {counted(len(found.changes), 'change')}"


def _exit(found: Comparison) -> str:
    """What the command's exit code means."""
    if found.regressions:
        return "exit 1: a regression"
    return "exit 0: changes alone do not fail, a regression would (1)" if found.changes else "exit 0"


def markdown_of(old: Document, new: Document, found: Comparison, limit: int = LIMIT) -> str:
    """What changed, for a pull request's comment."""
    mark = "❌" if found.regressions else "✅"
    lines = [f"## {mark} {verdict(found)[0].upper()}{verdict(found)[1:]}", ""]
    lines += ["| worst, eps·scale | old | new |", "| --- | ---: | ---: |"]
    lines += [
        f"| {text(quantity_name(name))} | {_cell(a)} | {_cell(b)} |" for name, a, b in figures(old, new)
    ]
    lines += ["", *(["| | what | old | new |", "| --- | --- | --- | --- |"] if found.changes else [])]
    left = limit - sum(len(line) + 1 for line in lines) - 100
    ordered = sorted(found.changes, key=lambda change: not change.regression)
    for shown, change in enumerate(ordered):
        row = _row(change)
        left -= len(row) + 1
        if left < 0:
            lines += ["", f"{counted(len(ordered) - shown, 'change')} more did not fit."]
            break
        lines.append(row)
    return "\n".join([*lines, ""])


def _row(change: Change) -> str:
    where = f"{change.robot}: " if change.robot else ""
    cells = [where + change.what, change.old, change.new]
    mark = "❌ regression" if change.regression else ""
    return f"| {mark} | {' | '.join(text(shortened(cell, 300)) for cell in cells)} |"


def _cell(value: Units | str) -> str:
    return value if isinstance(value, str) else units(value)
