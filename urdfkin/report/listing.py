"""Print tables on a terminal of any width: names on the left, numbers on the right with six digits."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from typing import TYPE_CHECKING, Literal

from urdfkin.errors.display import NOISE, six_digits
from urdfkin.errors.escape import printable

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table


def make_table(
    columns: Sequence[str], rows: Iterable[Sequence[str | float]], *, left: Collection[int] = (0,)
) -> Table:
    """Return a plain table with numbers at six digits.

    Columns in `left` are left-aligned, the others right-aligned. Numbers below the rounding error of the
    table's largest number are shown as 0. Use JSON for full precision.
    """
    from rich import box  # noqa: PLC0415
    from rich.table import Table  # noqa: PLC0415

    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0), show_edge=False, header_style="bold")
    for i, heading in enumerate(columns):
        justify: Literal["left", "right"] = "left" if i in left else "right"
        table.add_column(heading, justify=justify, overflow="fold", no_wrap=i not in left)
    for row in _texts(rows):
        table.add_row(*row)
    return table


def print_named(
    out: Console,
    columns: Sequence[str],
    rows: Iterable[Sequence[str | float]],
    *,
    left: Collection[int] = (0,),
) -> None:
    """Print a table like that of `make_table`. The names in the first column are never folded.

    On a narrow terminal a long name is on its own line, above the other cells of its row.
    """
    from rich.cells import cell_len  # noqa: PLC0415

    texts = _texts(rows)
    widths = _widths(columns, texts)
    if fits(out, columns, texts):
        out.print(make_table(columns, texts, left=left))
        return
    room = max(2, out.width - 1 - sum(width + 1 for width in widths[1:]))

    def show(cells: Sequence[str], style: str | None = None) -> None:
        first, rest = cells[0], " ".join(map(padded, range(1, len(cells)), cells[1:], widths[1:]))
        if cell_len(first) > room - 1:
            out.print(first, soft_wrap=True, style=style)
            first = ""
        out.print((padded(0, first, room) + rest).rstrip(), soft_wrap=True, style=style)

    def padded(i: int, cell: str, width: int) -> str:
        gap = " " * (width - cell_len(cell))
        return cell + gap if i in left else gap + cell

    show(columns, "bold")
    out.print(("-" if out.options.ascii_only else "\u2500") * out.width)
    name = None
    for row in texts:
        show([row[0] if row[0] != name else "", *row[1:]])
        name = row[0]


def fits(out: Console, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> bool:
    """Whether a table fits the terminal, with one space after each cell and one between two columns."""
    return sum(width + 2 for width in _widths(columns, rows)) - 1 <= out.width


def _widths(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> list[int]:
    from rich.cells import cell_len  # noqa: PLC0415

    return [max(map(cell_len, column)) for column in zip(columns, *rows, strict=True)]


def _texts(rows: Iterable[Sequence[str | float]]) -> list[list[str]]:
    cells = [list(row) for row in rows]
    largest = max((abs(cell) for row in cells for cell in row if not isinstance(cell, str)), default=0.0)
    return [
        [printable(cell) if isinstance(cell, str) else six_digits(cell, NOISE * largest) for cell in row]
        for row in cells
    ]
