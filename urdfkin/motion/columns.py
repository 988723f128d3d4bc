"""Numbers in columns: CSV text, whose every mistake is told with its file, line and column."""

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
    r"""Columns of finite numbers by name, from lines of cells between commas.

    Empty lines, and lines that begin with #, do not count. The first other line may name the columns, which
    then may come in any order; without names they are the required ones.

    Args:
        text: What stands in the file.
        where: How the file is called in messages.
        what: What the columns are for, likewise.
        required: Columns that must be there.
        optional: Columns that may be there.
        named: Whether the first line must be one of names.

    Returns:
        (n,) numbers for each column that is there; n may be zero.

    Raises:
        InputError: a column too many, missing, or twice there; a line with a cell too many or too few; a
            cell that is no finite number in decimal digits.

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
    """How many cells the first line has that counts; 0 where there is none."""
    return len(next(_rows(text, where), (0, []))[1])


def numbers(cells: Sequence[str], where: str, names: Sequence[str]) -> list[float]:
    """One number for each name.

    Raises:
        InputError: another count, or a cell that is no finite number.
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
    """Lines that count, each with its number."""
    reader = csv.reader(text.splitlines(keepends=True), strict=True)
    try:
        for row in reader:
            if row and not row[0].lstrip().startswith("#"):
                yield reader.line_num, [cell.strip() for cell in row]
    except csv.Error as error:
        raise InputError("no CSV", where=f"{where}:{reader.line_num}", found=str(error)) from None


def _is_header(cells: Sequence[str], names: Sequence[str]) -> bool:
    """Whether a line names columns: a joint may be called 1."""
    return sorted(cells) == sorted(names) or all(parse_float(cell) is None for cell in cells)


def _check_names(
    names: Sequence[str], where: str, what: str, required: Sequence[str], optional: Sequence[str]
) -> None:
    known = {*required, *optional}
    wrong = {
        "unknown": [name for name in names if name not in known],
        "missing": [name for name in required if name not in names],
        "twice there": sorted({name for name in names if names.count(name) > 1}),
    }
    if any(wrong.values()):
        also = f", and if wanted {listed(optional)}" if optional else ""
        raise InputError(
            f"the first line must name the columns of {what}",
            where=where,
            found="; ".join(f"{word}: {listed(found)}" for word, found in wrong.items() if found),
            remedy=f"name them {listed(required)}{also}",
        )
