"""Print tables on a terminal of any width; numbers have six digits and are right-aligned."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import zip_longest
from typing import TYPE_CHECKING

from urdfkin.errors.display import ASCII_TREE_LINES, Matrix, Table, TextDocument
from urdfkin.errors.escape import escape_unprintable

if TYPE_CHECKING:
    from rich.console import Console


def print_document(out: Console, document: TextDocument) -> None:
    """Print a document; each sentence stays on one line, so that a reader can copy it."""
    if document.title:
        out.print(document.title, style="bold")
    for part in document.parts:
        if isinstance(part, Table):
            print_table(out, part)
        elif isinstance(part, Matrix):
            for line in part.text().split("\n"):
                out.print(line)
        else:
            out.print(part, style=getattr(part, "style", None))


def print_table(out: Console, table: Table) -> None:
    """Print a table.

    If a name in the first column is wider than the column, the name has its own line above the other cells.
    """
    from rich.cells import cell_len

    ascii_only = out.options.ascii_only
    heads, rows, widths = _cells_and_widths(table)
    roomy = fits(out, table)
    gap = "  " if roomy else " "
    if not roomy:
        widths[0] = max(2, out.width - 1 - sum(width + 1 for width in widths[1:])) - 1

    def show(cells: Sequence[str], style: str | None = None) -> None:
        if cell_len(cells[0]) > widths[0]:
            out.print(cells[0], soft_wrap=True, style=style)
            cells = ["", *cells[1:]]
        out.print(gap.join(map(pad, range(len(cells)), cells)).rstrip(), soft_wrap=True, style=style)

    def pad(i: int, cell: str) -> str:
        blanks = " " * (widths[i] - cell_len(cell))
        return cell + blanks if table.is_left(i) else blanks + cell

    for line in heads:
        show(line, "bold")
    rule = sum(widths) + 2 * len(widths) - 1 if roomy else out.width
    out.print(("-" if ascii_only else "\u2500") * rule)
    name = None
    for row in rows:
        first, *rest = (cell.translate(ASCII_TREE_LINES) if ascii_only else cell for cell in row)
        show(["" if first == name and not roomy else first, *rest])
        name = first


def fits(out: Console, table: Table) -> bool:
    return sum(width + 2 for width in _cells_and_widths(table)[2]) - 1 <= out.width


def _cells_and_widths(table: Table) -> tuple[list[list[str]], list[list[str]], list[int]]:
    from rich.cells import cell_len

    lines = zip_longest(*(head.split("\n") for head in table.heads), fillvalue="")
    heads, rows = (
        [[escape_unprintable(cell) for cell in row] for row in part] for part in (lines, table.cells())
    )
    return heads, rows, [max(map(cell_len, column)) for column in zip(*heads, *rows, strict=True)]
