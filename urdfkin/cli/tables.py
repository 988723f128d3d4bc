"""Plain tables for a terminal of any width: names on the left, numbers on the right at six digits."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table


def make_table(columns: Sequence[str], rows: Iterable[Sequence[str | float]], *, words: int = 1) -> Table:
    """A plain table: the first `words` columns left, the others right, numbers at six digits.

    What is below rounding of the table's largest number is shown as 0: full precision is for machines.
    """
    from rich import box  # noqa: PLC0415
    from rich.table import Table  # noqa: PLC0415

    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0), show_edge=False, header_style="bold")
    for i, column in enumerate(columns):
        justify: Literal["left", "right"] = "left" if i < words else "right"
        table.add_column(column, justify=justify, overflow="fold", no_wrap=i >= words)
    for row in _texts(rows):
        table.add_row(*row)
    return table


def print_named(
    out: Console, columns: Sequence[str], rows: Iterable[Sequence[str | float]], *, words: int = 1
) -> None:
    """A table like `make_table`'s whose first column holds names, which are never folded.

    Where the terminal is too narrow, a name stands on a line of its own above what belongs to it.
    """
    from rich.cells import cell_len  # noqa: PLC0415

    texts = _texts(rows)
    widths = [max(map(cell_len, column)) for column in zip(columns, *texts, strict=True)]
    if sum(width + 1 for width in widths) <= out.width:
        out.print(make_table(columns, texts, words=words))
        return

    def line(cells: Sequence[str]) -> str:
        padded = (
            cell + gap if i < words else gap + cell
            for i, (cell, width) in enumerate(zip(cells, widths, strict=True))
            for gap in [" " * (width - cell_len(cell))]
            if i
        )
        return "  " + " ".join(padded)

    out.print(columns[0], style="bold")
    out.print(line(columns), style="bold", soft_wrap=True)
    out.print("\u2500" * min(out.width, len(line(columns))))
    name = None
    for row in texts:
        if row[0] != name:
            name = row[0]
            out.print(name, soft_wrap=True)
        out.print(line(row), soft_wrap=True)


def _texts(rows: Iterable[Sequence[str | float]]) -> list[list[str]]:
    cells = [list(row) for row in rows]
    largest = max((abs(cell) for row in cells for cell in row if not isinstance(cell, str)), default=0.0)
    return [
        [cell if isinstance(cell, str) else _number(cell, 1e-15 * largest) for cell in row] for row in cells
    ]


def _number(value: float, noise: float) -> str:
    return "0" if abs(value) <= noise else f"{value:.6g}"
