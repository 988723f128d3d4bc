"""Tables as people have them: from a spreadsheet, a README, a paper, a web page, or as urdfkin prints them.

Whatever separates the cells (commas, semicolons, tabs, bars, ampersands, blanks), there is a line of
headings with a, alpha, d and theta among them, in any order, and a line for each joint below it. What stands
around the table is searched for the convention, names, base and tool. The result is plain data for
`urdfkin.dh.rows`: nothing is guessed here, and a table that does not say its convention is refused there.


Tables from files: TOML and JSON (`urdfkin.dh.rows` says what stands in them), and sheets of text.
"""

from __future__ import annotations

import csv
import json
import os
import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeGuard, TypeVar

import numpy as np

from urdfkin.dh.expression import Cell, NoCellError, cell_of, spelled
from urdfkin.dh.rows import ORDER, Literal, table_from_mapping
from urdfkin.dh.screws import ProductOfExponentials, screws_of_mapping
from urdfkin.dh.table import DHTable
from urdfkin.errors import InputError, SourceError, UrdfkinError
from urdfkin.errors.escape import from_csv_cell
from urdfkin.errors.numbers import UNITS
from urdfkin.errors.validators import safe_repr
from urdfkin.kinematics.rotation.matrix import ROUNDED, polar_factor
from urdfkin.system.files import read_text

#: How far a rotation that was printed with six digits is from one; what is farther was meant otherwise.
_PRINTED = 1e-5
#: In how many lines behind its heading the three rows of a pose stand, fences and blank lines among them.
_POSE_LINES = 6
#: What may be said in a line of its own, `convention: modified`, with or without a comment mark.
_SAID = re.compile(r"^\W*(convention|angles|lengths|robot|base_frame|tip_frame)\s*[:=]\s*(.+)$")
#: In a file of separated values each `# key: value` is meant; a key that is none is refused with the others.
_KEY = re.compile(r"^#?\s*(\w+)\s*:\s*([^,;\t].*)$")
#: Columns whose names are taken as they are: the ones that urdfkin writes.
_OWN = ("leader", "multiplier", "lower", "upper", "velocity", "effort", "sense")
_NAMES = {
    **dict.fromkeys(("a", "link length", "length"), "a"),
    **dict.fromkeys(("alpha", "link twist", "twist"), "alpha"),
    **dict.fromkeys(("d", "link offset"), "d"),
    **dict.fromkeys(("theta", "joint angle", "angle"), "theta"),
    "beta": "beta",
    "offset": "offset",
    **dict.fromkeys(("joint", "name", "joint name"), "joint"),
    **dict.fromkeys(("kind", "type", "sigma", "joint type"), "kind"),
}
_KINDS = {"0": "R", "1": "P"}
#: Headings of columns that count rows.
_COUNTS = ("", "i", "j", "n", "#", "no", "row", "link", "index")
_CONVENTIONS = {
    "modified": r"\b(?:modified|craig(?:'s)?|proximal|mdh)\b",
    "standard": r"\b(?:standard|classic(?:al)?|distal|paul(?:'s)?)\b",
}
_TITLE = re.compile(
    r"(?:^|parameters of )(?:\*\*)?(?P<robot>\S+?)(?:\*\*)?[:,] (?P<base>\S+) to (?P<tip>\S+?),"
)
_RULE = re.compile(r"[\s|:+=_\-\u2500-\u257f]*")


def from_sheet(text: str) -> dict[str, Any]:
    """The plain data of a table in a text.

    Raises:
        InputError: no line of headings, a row with another number of cells, a cell that is none.
    """
    lines = text.lstrip("\ufeff").splitlines()
    for form in (_latex, _bars, _separated, _aligned):
        if (grid := form(lines)) is not None:
            break
    else:
        raise _no_header(lines)
    around = [spelled(line) for line in grid.around]
    # A title begins with the robot's name, which may be "robot".
    plain = [line for line in grid.around if not _TITLE.search(line)]
    data = _said(plain, _KEY if form is _separated else _SAID)
    if "convention" not in data and (convention := _convention(around, grid.columns)):
        data["convention"] = convention
    for line in grid.around:
        if title := _TITLE.search(_unescaped(line.replace("`", ""))):
            names = {"robot": title["robot"], "base_frame": title["base"], "tip_frame": title["tip"]}
            data = names | data
    for end in ("base", "tool"):
        if end not in data and (pose := _pose(end, grid.around)):
            data[end] = pose
    # An angle that some column's heading gives a unit needs none besides; the rows say it cell by cell.
    named = _named_coordinates(grid.around)
    data["rows"] = [_row(grid, cells, i) for i, cells in enumerate(grid.rows)]
    _follow(data, named)
    return data


@dataclass(frozen=True, slots=True)
class _Column:
    """A heading: its column's name ("" for none of ours), itself, its unit, and whether it says (i-1)."""

    name: str
    heading: str = ""
    unit: str | None = None
    previous: bool = False


@dataclass(frozen=True, slots=True)
class _Grid:
    """The headings, the rows' cells, and all lines that are not the table's.

    Attributes:
        commas: Whether commas in cells are decimal.
        strict: Whether a column that is none of ours is refused.
    """

    columns: tuple[_Column, ...]
    rows: list[list[str]]
    around: list[str]
    commas: bool = False
    strict: bool = False


# -- where the table is --------------------------------------------------------------------------------


def _grid(lines: list[str], split: Callable[[str], list[str]], mark: str = "") -> _Grid | None:
    """The first line that names the columns, and the rows below it up to a line that is none."""
    for k, line in enumerate(lines):
        columns = _columns(split(line))
        if columns is None:
            continue
        rows, end = list[list[str]](), k + 1
        for end, below in enumerate(lines[k + 1 :], k + 1):  # noqa: B007  where it ended is the point
            if not below.strip() and rows:
                break
            cells = split(below)
            if _RULE.fullmatch(below) or not any(cells):
                continue
            if len(cells) != len(columns):
                if rows and len(cells) == 1:
                    break
                raise InputError(
                    f"a row has a cell for each of the {len(columns)} columns",
                    where=f"row {len(rows) + 1}",
                    found=f"{len(cells)}: {', '.join(cells)}"[:200],
                    remedy=f"the columns are {', '.join(column.name or '-' for column in columns)}",
                )
            rows.append(cells)
        else:
            end = len(lines)
        return _Grid(columns, rows, [*lines[:k], *lines[end:]], mark in (";", "\t"), mark == ",")
    return None


def _no_header(lines: list[str]) -> InputError:
    """What to say where no line has all four names: about the one that has most of them."""
    said = [re.split(r"[,;|&\t]|\s{2,}", line.strip()) for line in lines if not line.startswith("#")]
    named = [[cell.strip() for cell in cells if cell.strip()] for cells in said]
    best = max(named, key=lambda cells: sum(_column(cell).name in ORDER for cell in cells), default=[])
    names = [_column(cell).name for cell in best]
    missing = next((name for name in ORDER if name not in names), None)
    if missing is None:
        return InputError(
            "the headings are not separated as one line of cells",
            where="header",
            found=", ".join(best)[:200],
            remedy="separate all of them by the same sign: a comma, a semicolon, a tab or a bar",
        )
    return InputError(
        f"no column {missing!r}",
        where="header",
        found=", ".join(best)[:200] or "nothing",
        remedy=f"the line before the rows names the columns, {', '.join(ORDER)} among them",
    )


def _latex(lines: list[str]) -> _Grid | None:
    text = "\n".join(lines)
    found = re.search(r"\\begin\{(tabular[x*]?|array)\}(?:\{[^{}]*\})*(.*?)\\end\{\1\}", text, re.DOTALL)
    if found is None:
        return None
    body = re.sub(
        r"\\(?:toprule|midrule|bottomrule|hline|addlinespace|cline\{[^}]*\})|(?<!\\)%.*", "", found[2]
    )
    rows = [" ".join(line.split()) for line in re.split(r"\\\\(?:\[[^\]]*\])?", body)]
    grid = _grid(
        [row for row in rows if row], lambda row: [cell.strip() for cell in re.split(r"(?<!\\)&", row)]
    )
    around = (text[: found.start()] + text[found.end() :]).splitlines()
    return grid and _Grid(grid.columns, grid.rows, around)


def _bars(lines: list[str]) -> _Grid | None:
    """Markdown's bars, and the lines of boxes that other programs print."""
    plain = [re.sub("[\u2502\u2503\u2551]", "|", line) for line in lines]

    def split(line: str) -> list[str]:
        return [cell.strip().strip("`") for cell in line.strip().strip("|").split("|")] if "|" in line else []

    return _grid(plain, split)


def _separated(lines: list[str]) -> _Grid | None:
    """Semicolons, tabs or commas; commas inside cells are decimal where something else separates them."""
    for mark in (";", "\t", ","):
        kept = [line for line in lines if not re.fullmatch(r'"?sep=.?"?', line.strip())]
        if grid := _grid(kept, lambda line, mark=mark: _csv_cells(line, mark), mark):  # type: ignore[misc]
            return grid
    return None


def _csv_cells(line: str, mark: str) -> list[str]:
    return [cell.strip() for cell in next(csv.reader([line], delimiter=mark), [])]


def _aligned(lines: list[str]) -> _Grid | None:
    """Columns that blanks hold apart: two at least, or one where a cell has none inside."""

    def loose(line: str) -> list[str]:
        return [cell for cell in re.split(r"\s{2,}", line.strip()) if cell]

    def tight(line: str) -> list[str]:
        joined = re.sub(r"\s*([-+*/])\s+(?=\S)", r"\1", line.strip())
        return re.sub(r"\s+([\[(])", r"\1", joined).split()

    return _grid(lines, loose) or _grid(lines, tight)


def _columns(cells: list[str]) -> tuple[_Column, ...] | None:
    """The headings that a line is, or None: the four names must be among them, once each."""
    columns = tuple(map(_column, cells))
    names = [column.name for column in columns]
    if any(name not in names for name in ORDER):
        return None
    double = [name for name in names if name and names.count(name) > 1]
    if double:
        raise InputError(f"the column {double[0]!r} stands twice", where="header", found=", ".join(cells))
    return columns


def _column(heading: str) -> _Column:
    """What a heading says; a name of nobody's is no column of ours, and is skipped."""
    text = spelled(heading).strip("*` ")
    unit = None
    if found := re.search(
        r"[\[(/]\s*(" + "|".join(sorted(UNITS, key=len, reverse=True)) + r")\s*[\])]?\s*$", text
    ):
        unit, text = UNITS[found[1]], text[: found.start()]
    previous = re.search(r"[ijkn]\s*-\s*1", text) is not None
    text = re.sub(r"[_(\s{]*[ijkn]?\s*(?:-\s*1)?[\s)}]*$", "", text) if previous or "_" in text else text
    text = (
        re.sub(r"\((?:[ijkn])\)$|(?<=[a-z]{4})[ijkn]$|^([ad])[ijkn]$", r"\1", text.strip())
        .strip(" _{}()")
        .lower()
    )
    return _Column(text if text in _OWN else _NAMES.get(text, ""), text, unit, previous)


# -- what stands around it -----------------------------------------------------------------------------


def _said(lines: list[str], pattern: re.Pattern[str]) -> dict[str, Any]:
    data: dict[str, Any] = {}
    for line in lines:
        if found := pattern.match(line.strip()):
            try:
                data[found[1]] = json.loads(found[2])
            except ValueError:
                data[found[1]] = found[2].rstrip(" ;,\t").strip("\"'")
    return data


def _convention(around: list[str], columns: tuple[_Column, ...]) -> str | None:
    """What the headings or the text say; None where they say nothing or both."""
    if any(column.previous for column in columns):
        return "modified"
    text = "\n".join(around)
    said = [name for name, words in _CONVENTIONS.items() if re.search(words, text, re.IGNORECASE)]
    return said[0] if len(said) == 1 else None


def _pose(end: str, lines: list[str]) -> list[list[float]] | None:
    """The three rows under `base (metres):`, or the matrix in LaTeX, as urdfkin prints them."""
    matrix = rf"{end.title()} \(m\): \$\\begin{{bmatrix}}(.*?)\\end{{bmatrix}}"
    if found := re.search(matrix, " ".join(lines)):
        return _rigid(
            [[cell_of(cell).number for cell in row.split("&")] for row in found[1].split(r"\\")], end
        )
    for k, line in enumerate(lines):
        if line.strip().lower().startswith(f"{end} (metres):"):
            rows = [row.split() for row in lines[k + 1 : k + 1 + _POSE_LINES] if row.strip(" `")][:3]
            if len(rows) == 3 and all(len(row) == 4 for row in rows):
                return _rigid([[float(number) for number in row] for row in rows], end)
    return None


def _rigid(rows: list[list[float]], end: str) -> list[list[float]]:
    """A pose that was printed with some digits: with the nearest rotation; refuses infinite numbers."""
    pose = np.array(rows)
    if not np.isfinite(pose).all():  # LAPACK's singular values of an infinite matrix need not return
        raise InputError(f"the {end} is a matrix of finite numbers", where=end, found=safe_repr(rows))
    off = polar_factor(pose[:3, :3]) - pose[:3, :3]
    if ROUNDED < np.abs(off).max() < _PRINTED:
        pose[:3, :3] += off
    return [[float(number) for number in row] for row in pose]


def _named_coordinates(lines: list[str]) -> list[str]:
    """`with q1 = left, q2 = right`, as urdfkin prints where coordinates are not row by row."""
    line = next((line for line in lines if line.startswith("with q1 = ")), "")
    return [_unescaped(name).strip("`") for name in re.findall(r"q[0-9]+ = ([^,]+)", line)]


# -- rows ----------------------------------------------------------------------------------------------


def _row(grid: _Grid, cells: list[str], index: int) -> dict[str, Any]:
    """A row by name, with each cell's unit; empty cells are not said, but for the four that make a row."""
    row: dict[str, Any] = {}
    for column, cell in zip(grid.columns, cells, strict=True):
        if not column.name and grid.strict and column.heading not in _COUNTS:
            row[column.heading] = cell  # which is refused with the row: it may be a column of ours misspelt
        elif not column.name or (not cell and column.name not in ORDER):
            continue
        elif column.name in (*ORDER, "beta", "offset"):
            where = f"row {index + 1}, {column.name}"
            row[column.name] = _number(cell, column, where, grid.commas)
        elif column.name == "kind":
            row["kind"] = _KINDS.get(cell, cell)
        else:
            row[column.name] = from_csv_cell(_unescaped(cell)) if column.name in ("joint", "leader") else cell
    return _nested(row)


def _number(cell: str, column: _Column, where: str, commas: bool) -> str:
    """A cell with its heading's unit, if it says none; refuses what is no cell."""
    text = re.sub(r"(?<=[0-9]),(?=[0-9])", ".", cell) if commas else cell
    try:
        found: Cell = cell_of(text)
    except NoCellError as error:
        decimal = "separate cells by semicolons if commas are decimal" if "," in cell else f"{error}"
        raise InputError(
            "not a number",
            where=where,
            found=safe_repr(cell),
            remedy=f"{decimal}: write 1.5708, pi/2 or 90 deg",
        ) from None
    plain = spelled(text)
    return f"{plain} {column.unit}" if column.unit and found.unit is None and found.number else plain


def _unescaped(name: str) -> str:
    r"""A name as Markdown and LaTeX write it: `a\_b` is a_b."""
    return re.sub(r"\\([_&%$#{}])", r"\1", name)


def _nested(row: dict[str, Any]) -> dict[str, Any]:
    """Flat columns of followers and limits as the row has them; `offset` beside theta is added to it."""
    leads: dict[str, Any] = {key: row.pop(key) for key in ("leader", "multiplier") if key in row}
    if leads and "offset" in row:
        leads["offset"] = row.pop("offset")
    limit = {key: row.pop(key) for key in ("lower", "upper", "velocity", "effort") if key in row}
    if "offset" in row:
        name = "d" if str(row.get("kind", "R")).upper().startswith("P") else "theta"
        row[name] = f"{row[name]} + {row.pop('offset')}".replace("+ -", "- ").replace("+ +", "+ ")
    return {**row, **({"mimic": leads} if leads else {}), **({"limit": limit} if limit else {})}


def _follow(data: dict[str, Any], named: list[str]) -> None:
    """Variables that are numbered otherwise than the rows: a row with another's variable follows it."""
    rows = data["rows"]
    names = named or [row.get("joint", f"joint_{i + 1}") for i, row in enumerate(rows)]
    for i, row in enumerate(rows):
        for name in ("theta", "d"):
            cell = cell_of(row[name])
            if cell.times is None or (
                cell.variable in (None, i + 1) and abs(cell.times) == 1.0 and not named
            ):
                continue
            number = cell.variable or i + 1
            if number > len(names):
                raise InputError(
                    "a row moves with a variable that no row has",
                    where=f"row {i + 1}, {name}",
                    found=row[name],
                )
            row |= {
                "kind": row.get("kind", "R" if name == "theta" else "P"),
                name: f"{cell.number!r} {cell.unit or ''}",
            }
            if names[number - 1] == row.get("joint", f"joint_{i + 1}") and abs(cell.times) == 1.0:
                row["sense"] = cell.times
            else:
                row["mimic"] = {"leader": names[number - 1], "multiplier": cell.times}
    moving = {row.get("joint", f"joint_{i + 1}") for i, row in enumerate(rows)}
    if elsewhere := [name for name in named if name not in moving]:
        data.setdefault("coordinates", elsewhere)


_T = TypeVar("_T")


def is_table_file(source: object) -> TypeGuard[str | os.PathLike[str]]:
    """Whether a robot's source is the path of a table, by its name.

    >>> is_table_file("arm.toml"), is_table_file("arm.urdf"), is_table_file("<robot/>")
    (True, False, False)
    """
    if isinstance(source, str) and source.lstrip().startswith("<"):
        return False
    if not isinstance(source, str | os.PathLike) or (ending := Path(source).suffix.lower()) not in _PARSERS:
        return False
    return ending != ".txt" or not _is_markup(Path(source))


def read_table(path: str | os.PathLike[str]) -> DHTable:
    """A table from a file whose name ends in .toml, .json, .csv, .tsv, .md, .tex or .txt.

    Raises:
        SourceError: the file cannot be read.
        InputError: another ending, broken syntax, or anything `table_from_mapping` rejects, with the file.
    """
    return table_of(read_mapping(path), str(path))


def read_table_or_screws(path: str | os.PathLike[str]) -> DHTable | ProductOfExponentials:
    """A table, or screws where the file has an M; errors as for `read_table`."""
    data = read_mapping(path)
    return _placed(screws_of_mapping, data, str(path)) if "M" in data else table_of(data, str(path))


def read_mapping(path: str | os.PathLike[str]) -> Mapping[str, Any]:
    """The plain data of a table's file, its numbers as they are written; errors as for `read_table`."""
    return mapping_from_text(read_text(Path(path), pipes=True), Path(path).suffix.lower(), where=str(path))


def table_from_text(text: str, suffix: str, where: str = "table") -> DHTable:
    """A table from the text of a file with a given ending; errors as for `read_table`."""
    return table_of(mapping_from_text(text, suffix, where), where)


def table_of(data: Mapping[str, Any], where: str) -> DHTable:
    """The table of a file's plain data; errors as for `read_table`."""
    return _placed(table_from_mapping, data, where)


def _placed(make: Callable[[Mapping[str, Any]], _T], data: Mapping[str, Any], where: str) -> _T:
    try:
        return make(data)
    except UrdfkinError as error:
        error.where = f"{where}, {error.where}" if error.where else where
        raise


def mapping_from_text(text: str, suffix: str, where: str) -> Mapping[str, Any]:
    """The plain data of a table file; errors as for `read_table`."""
    if suffix not in _PARSERS:
        raise InputError(
            f"a table's file ends in {', '.join(_PARSERS)}",
            where=where,
            found=repr(suffix),
            remedy="rename the file",
        )
    try:
        data = _PARSERS[suffix](text)
    except UrdfkinError as error:
        error.where = f"{where}, {error.where}"
        raise
    except (ValueError, RecursionError) as error:
        raise InputError(f"not valid {suffix[1:].upper()}", where=where, found=str(error)[:200]) from None
    if not isinstance(data, Mapping):
        raise InputError(
            "a table is a mapping with convention and rows", where=where, found=type(data).__name__
        )
    return data


def _is_markup(path: Path) -> bool:
    """Whether a text file is a URDF, which may end in .txt as well."""
    try:
        return read_text(path.expanduser()).lstrip().startswith("<")
    except SourceError:
        return False


def _from_toml(text: str) -> dict[str, Any]:
    return tomllib.loads(text, parse_float=Literal)


def _from_json(text: str) -> Any:
    return json.loads(text, parse_float=Literal)


_PARSERS: dict[str, Callable[[str], Any]] = {
    ".toml": _from_toml,
    ".json": _from_json,
    **dict.fromkeys((".csv", ".tsv", ".md", ".tex", ".txt"), from_sheet),
}
