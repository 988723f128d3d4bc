"""Parse CSV text into columns of numbers; errors name the file, the line and the column."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from urdfkin.errors import InputError
from urdfkin.errors.numbers import parse_float, remedy
from urdfkin.kinematics.inputs import FloatArray
from urdfkin.model.configuration_like import listed, wrong_count


def read_columns(
    text: str,
    where: str,
    what: str,
    required: Sequence[str],
    optional: Sequence[str] = (),
    *,
    named: bool = False,
) -> Mapping[str, FloatArray]:
    r"""Parse CSV text into columns of finite numbers.

    Empty lines and lines that begin with # are skipped. The first other line may contain the names of the
    columns, in any order. Without names, the columns are the required ones in their order.

    Args:
        text: The content of the file.
        where: Name of the file, for messages.
        what: Name of the table, for messages.
        required: Names of the required columns.
        optional: Names of the optional columns.
        named: Whether the first line must contain the names.

    Returns:
        An array (n,) for each column that is present; n may be zero.

    Raises:
        InputError: a column is unknown, missing or duplicate; a line has a wrong number of cells; or a cell
            is not a finite number in decimal digits.

    >>> read_columns("b,a\n1,2\n3,4\n", "x.csv", "q", ["a", "b"])["a"].tolist()
    [2.0, 4.0]
    """
    rows = list(_rows(text, where))
    names = list(required)
    if rows and (named or _is_header(rows[0][1], names)):
        line, names = rows.pop(0)
        _check_names(names, f"{where}:{line}", what, required, optional)
    table = np.empty((len(rows), len(names)))
    for k, (line, cells) in enumerate(rows):
        table[k] = numbers(cells, f"{where}:{line}", names)
    return {name: np.ascontiguousarray(table[:, i]) for i, name in enumerate(names)}


def width_of(text: str, where: str) -> int:
    """Return the number of cells in the first line that is not skipped; 0 without such a line."""
    return len(next(_rows(text, where), (0, []))[1])


def numbers(cells: Sequence[str], where: str, names: Sequence[str]) -> list[float]:
    """Parse one number for each name.

    Raises:
        InputError: the number of cells is wrong, or a cell is not a finite number.
    """
    if len(cells) != len(names):
        raise wrong_count(names, len(cells), where)
    values = []
    for name, cell in zip(names, cells, strict=True):
        if (value := parse_float(cell)) is None:
            raise InputError(
                "not a finite number", where=f"{where}, {name}", found=repr(cell.strip()), remedy=remedy(cell)
            )
        values.append(value)
    return values


def _rows(text: str, where: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the lines that are not skipped, each with its line number."""
    reader = csv.reader(text.splitlines(keepends=True), strict=True)
    try:
        for row in reader:
            if row and not row[0].lstrip().startswith("#"):
                yield reader.line_num, [cell.strip() for cell in row]
    except csv.Error as error:
        raise InputError("not valid CSV", where=f"{where}:{reader.line_num}", found=str(error)) from None


def _is_header(cells: Sequence[str], names: Sequence[str]) -> bool:
    """Return whether a line contains the names of columns; a joint may have the name "1"."""
    return sorted(cells) == sorted(names) or all(parse_float(cell) is None for cell in cells)


def _check_names(
    names: Sequence[str], where: str, what: str, required: Sequence[str], optional: Sequence[str]
) -> None:
    known = {*required, *optional}
    wrong = {
        "unknown": [name for name in names if name not in known],
        "missing": [name for name in required if name not in names],
        "duplicate": sorted({name for name in names if names.count(name) > 1}),
    }
    if any(wrong.values()):
        also = f", and optionally {listed(optional)}" if optional else ""
        raise InputError(
            f"the first line must name the columns of {what}",
            where=where,
            found="; ".join(f"{word}: {listed(found)}" for word, found in wrong.items() if found),
            remedy=f"name them {listed(required)}{also}",
        )
