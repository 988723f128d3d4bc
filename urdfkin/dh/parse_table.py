"""Read tables from TOML files, JSON files, and plain text that you copy from a document or web page.

`urdfkin.dh.rows` defines the content of TOML and JSON files. A table in text has a line of headings that
contains a, alpha, d and theta in any order, and below it a line for each joint. Commas, semicolons, tabs,
bars, ampersands or blanks separate the cells. The lines before and after the table may state the convention,
names, base and tool. urdfkin prints its own tables in this form. The module never guesses. For example, a
table without a convention is an error in `urdfkin.dh.rows`.
"""

from __future__ import annotations

import csv
import json
import os
import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, TypeGuard, TypeVar

import numpy as np

from urdfkin.dh.rows import ORDER, Literal, table_from_mapping
from urdfkin.dh.screws import ProductOfExponentials, screws_of_mapping
from urdfkin.dh.table import DHTable
from urdfkin.dh.units import Cell, NoCellError, cell_of, spelled
from urdfkin.errors import InputError, SourceError, UnknownNameError, UrdfkinError
from urdfkin.errors.escape import from_csv_cell
from urdfkin.errors.numbers import UNITS
from urdfkin.errors.validators import safe_repr
from urdfkin.kinematics.rotation import ROUNDED, polar_factor
from urdfkin.system.files import exists, read_text
from urdfkin.system.resources import robots_dir

#: A printed rotation (six digits) is corrected if the nearest rotation differs by at most this number.
_PRINTED = 1e-5
#: The three rows of a pose must be within this number of lines after the heading of the pose.
#: Some of these lines may be blank or Markdown fences.
_POSE_LINES = 6
#: A setting is a line such as `convention: modified`, with or without a comment mark.
_SETTING = re.compile(r"^\W*(convention|angles|lengths|robot|base_frame|tip_frame)\s*[:=]\s*(.+)$")
#: In a CSV file each line `# key: value` is a setting; `table_from_mapping` rejects an unknown key.
_KEY = re.compile(r"^#?\s*(\w+)\s*:\s*([^,;\t].*)$")
#: Columns without synonyms
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
#: Headings of columns with row numbers.
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
    """Find the table in a text, and return it as plain data.

    Raises:
        InputError: there is no line of headings, a row has too few or too many cells, or a cell is invalid.
    """
    lines = text.lstrip("\ufeff").splitlines()
    for form in (_latex, _bars, _separated, _aligned):
        if (grid := form(lines)) is not None:
            break
    else:
        raise _no_header(lines)
    around = [spelled(line) for line in grid.around]
    # A title line is no setting, even if the name of the robot is "robot".
    plain = [line for line in grid.around if not _TITLE.search(line)]
    data = _settings(plain, _KEY if form is _separated else _SETTING)
    if "convention" not in data and (convention := _convention(around, grid.columns)):
        data["convention"] = convention
    for line in grid.around:
        if title := _TITLE.search(_unescaped(line.replace("`", ""))):
            names = {"robot": title["robot"], "base_frame": title["base"], "tip_frame": title["tip"]}
            data = names | data
    for end in ("base", "tool"):
        if end not in data and (pose := _pose(end, grid.around)):
            data[end] = pose
    # Each cell gets the unit in its column's heading, so the table needs no common unit.
    named = _named_coordinates(grid.around)
    data["rows"] = [_row(grid, cells, i) for i, cells in enumerate(grid.rows)]
    _interpret_variables(data, named)
    return data


@dataclass(frozen=True, slots=True)
class _Column:
    """A column of a table in text; `previous` says whether the heading contains i-1."""

    name: str
    heading: str = ""
    unit: str | None = None
    previous: bool = False


@dataclass(frozen=True, slots=True)
class _Grid:
    """A table that was found in a text, and all lines outside the table (`around`).

    Attributes:
        commas: Whether a comma in a cell is a decimal comma.
        strict: Whether an unknown column is an error.
    """

    columns: tuple[_Column, ...]
    rows: list[list[str]]
    around: list[str]
    commas: bool = False
    strict: bool = False


# -- the table's position ------------------------------------------------------------------------------


def _grid(lines: list[str], split: Callable[[str], list[str]], mark: str = "") -> _Grid | None:
    """Find the first line of headings, and the rows below it up to the end of the table."""
    for k, line in enumerate(lines):
        columns = _columns(split(line))
        if columns is None:
            continue
        rows, end = list[list[str]](), k + 1
        for end, below in enumerate(lines[k + 1 :], k + 1):  # noqa: B007  the code after the loop reads `end`
            if not below.strip() and rows:
                break
            cells = split(below)
            if _RULE.fullmatch(below) or not any(cells):
                continue
            if len(cells) != len(columns):
                if rows and len(cells) == 1:
                    break
                raise InputError(
                    f"a row needs a cell for each of the {len(columns)} columns",
                    where=f"row {len(rows) + 1}",
                    found=f"{len(cells)}: {', '.join(cells)}"[:200],
                    remedy="the columns of the table are"
                    f" {', '.join(column.name or '-' for column in columns)}",
                )
            rows.append(cells)
        else:
            end = len(lines)
        return _Grid(columns, rows, [*lines[:k], *lines[end:]], mark in (";", "\t"), mark == ",")
    return None


def _no_header(lines: list[str]) -> InputError:
    """Return the error for missing headings; it quotes the line with the most required headings."""
    said = [re.split(r"[,;|&\t]|\s{2,}", line.strip()) for line in lines if not line.startswith("#")]
    named = [[cell.strip() for cell in cells if cell.strip()] for cells in said]
    best = max(named, key=lambda cells: sum(_column(cell).name in ORDER for cell in cells), default=[])
    names = [_column(cell).name for cell in best]
    missing = next((name for name in ORDER if name not in names), None)
    if missing is None:
        return InputError(
            "the line of column headings has another separator than the other lines",
            where="header",
            found=", ".join(best)[:200],
            remedy="separate the cells of all lines by the same character: a comma, a semicolon, a tab"
            " or a bar",
        )
    return InputError(
        f"the table has no column {missing!r}",
        where="header",
        found=", ".join(best)[:200] or "nothing",
        remedy=f"write a line of headings above the rows, with {', '.join(ORDER)}",
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
    """Parse columns that are separated by the character | or by vertical box-drawing characters."""
    plain = [re.sub("[\u2502\u2503\u2551]", "|", line) for line in lines]
    plain = [re.sub(r"\\([\[\]()])", r"\1", line) for line in plain]  # Markdown escapes brackets: a \[m\].

    def split(line: str) -> list[str]:
        return [cell.strip().strip("`") for cell in line.strip().strip("|").split("|")] if "|" in line else []

    return _grid(plain, split)


def _separated(lines: list[str]) -> _Grid | None:
    """Parse cells separated by semicolons, tabs or commas.

    If semicolons or tabs separate the cells, a comma inside a cell is a decimal comma.
    """
    for mark in (";", "\t", ","):
        kept = [line for line in lines if not re.fullmatch(r'"?sep=.?"?', line.strip())]
        if grid := _grid(kept, partial(_csv_cells, mark=mark), mark):
            return grid
    return None


def _csv_cells(line: str, mark: str) -> list[str]:
    return [cell.strip() for cell in next(csv.reader([line], delimiter=mark), [])]


def _aligned(lines: list[str]) -> _Grid | None:
    """Parse columns separated by two or more blanks, or by one blank if no cell contains a blank."""

    def loose(line: str) -> list[str]:
        return [cell for cell in re.split(r"\s{2,}", line.strip()) if cell]

    def tight(line: str) -> list[str]:
        joined = re.sub(r"\s*([-+*/])\s+(?=\S)", r"\1", line.strip())
        return re.sub(r"\s+([\[(])", r"\1", joined).split()

    return _grid(lines, loose) or _grid(lines, tight)


def _columns(cells: list[str]) -> tuple[_Column, ...] | None:
    """Parse a line of headings; return None unless a, alpha, d and theta all occur and names are unique."""
    columns = tuple(map(_column, cells))
    names = [column.name for column in columns]
    if any(name not in names for name in ORDER):
        return None
    double = [name for name in names if name and names.count(name) > 1]
    if double:
        raise InputError(f"the column {double[0]!r} occurs twice", where="header", found=", ".join(cells))
    return columns


def _column(heading: str) -> _Column:
    """Parse a heading; an unknown name gives a column with the name ""."""
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


# -- the lines around the table-------------------------------------------------------------------------


def _settings(lines: list[str], pattern: re.Pattern[str]) -> dict[str, Any]:
    data: dict[str, Any] = {}
    for line in lines:
        if found := pattern.match(line.strip()):
            try:
                data[found[1]] = json.loads(found[2])
            except ValueError:
                data[found[1]] = found[2].rstrip(" ;,\t").strip("\"'")
    return data


def _convention(around: list[str], columns: tuple[_Column, ...]) -> str | None:
    """Return the convention that the headings or the text name.

    The result is None if the headings and the text name no convention, or both the standard and the modified
    convention.
    """
    if any(column.previous for column in columns):
        return "modified"
    text = "\n".join(around)
    said = [name for name, words in _CONVENTIONS.items() if re.search(words, text, re.IGNORECASE)]
    return said[0] if len(said) == 1 else None


def _pose(end: str, lines: list[str]) -> list[list[float]] | None:
    """Parse a pose as urdfkin prints it: three rows under `base (metres):`, or a LaTeX matrix."""
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
    """Replace a printed rotation with the nearest exact rotation if it differs only by the printed digits.

    A number that is not finite raises InputError.
    """
    pose = np.array(rows)
    if not np.isfinite(pose).all():  # LAPACK may run forever for an infinite matrix.
        raise InputError(f"the {end} must be a matrix of finite numbers", where=end, found=safe_repr(rows))
    off = polar_factor(pose[:3, :3]) - pose[:3, :3]
    if ROUNDED < np.abs(off).max() < _PRINTED:
        pose[:3, :3] += off
    return [[float(number) for number in row] for row in pose]


def _named_coordinates(lines: list[str]) -> list[str]:
    """Return the joint names in a line such as `with q1 = left, q2 = right`.

    urdfkin prints this line if the coordinates differ from the joints of the rows, or have another order.
    """
    line = next((line for line in lines if line.startswith("with q1 = ")), "")
    return [_unescaped(name).strip("`") for name in re.findall(r"q[0-9]+ = ([^,]+)", line)]


# -- rows ----------------------------------------------------------------------------------------------


def _row(grid: _Grid, cells: list[str], index: int) -> dict[str, Any]:
    """Return a row as a mapping from column names to cells with units; optional empty cells are left out."""
    row: dict[str, Any] = {}
    for column, cell in zip(grid.columns, cells, strict=True):
        if not column.name and grid.strict and column.heading not in _COUNTS:
            row[column.heading] = cell  # `table_from_mapping` rejects this heading.
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
    """Return a cell as text with its own unit or its column's unit; raise InputError for an invalid cell."""
    text = re.sub(r"(?<=[0-9]),(?=[0-9])", ".", cell) if commas else cell
    try:
        found: Cell = cell_of(text)
    except NoCellError as error:
        decimal = "separate cells by semicolons if commas are decimal" if "," in cell else f"{error}"
        raise InputError(
            "this is not a number",
            where=where,
            found=safe_repr(cell),
            remedy=f"{decimal}: write 1.5708, pi/2 or 90 deg",
        ) from None
    plain = spelled(text)
    return f"{plain} {column.unit}" if column.unit and found.unit is None and found.number else plain


def _unescaped(name: str) -> str:
    r"""Remove the escapes of Markdown and LaTeX from a name: `a\_b` is a_b."""
    return re.sub(r"\\([_&%$#{}])", r"\1", name)


def _nested(row: dict[str, Any]) -> dict[str, Any]:
    """Put the cells of a mimic rule into a mapping `mimic`, and the cells of limits into a mapping `limit`.

    If the row has no mimic rule, `offset` is added to theta or d.
    """
    leads: dict[str, Any] = {key: row.pop(key) for key in ("leader", "multiplier") if key in row}
    if leads and "offset" in row:
        leads["offset"] = row.pop("offset")
    limit = {key: row.pop(key) for key in ("lower", "upper", "velocity", "effort") if key in row}
    if "offset" in row:
        name = "d" if str(row.get("kind", "R")).upper().startswith("P") else "theta"
        row[name] = f"{row[name]} + {row.pop('offset')}".replace("+ -", "- ").replace("+ +", "+ ")
    return {**row, **({"mimic": leads} if leads else {}), **({"limit": limit} if limit else {})}


def _interpret_variables(data: dict[str, Any], named: list[str]) -> None:
    """Interpret the variables q1, q2, ... of the rows.

    If a row contains the variable of another row, its joint mimics the joint of the other row.
    """
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
                    "no row has the joint variable that this row mimics",
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
    """Whether a robot's source is the path of a table file, judged by its suffix.

    >>> is_table_file("arm.toml"), is_table_file("arm.urdf"), is_table_file("<robot/>")
    (True, False, False)
    """
    if isinstance(source, str) and source.lstrip().startswith("<"):
        return False
    if not isinstance(source, str | os.PathLike) or (ending := Path(source).suffix.lower()) not in _PARSERS:
        return False
    return ending != ".txt" or not _is_markup(Path(source))


def read_table(path: str | os.PathLike[str]) -> DHTable:
    """Read a table from a .toml, .json, .csv, .tsv, .md, .tex or .txt file.

    Raises:
        SourceError: the file cannot be read.
        InputError: the file has another suffix or invalid syntax, or `table_from_mapping` raises an error.
            The message contains the file's name.

    >>> import urdfkin
    >>> table = urdfkin.read_table("robots/dh/ur5.toml")
    >>> len(table.rows), table.convention.value
    (6, 'standard')
    """
    return table_of(read_mapping(path), str(path))


def read_table_or_screws(path: str | os.PathLike[str]) -> DHTable | ProductOfExponentials:
    """Read a table, or a product of exponentials if the file contains the key M.

    Raises the same errors as `read_table`.
    """
    data = read_mapping(path)
    return _with_place(screws_of_mapping, data, str(path)) if "M" in data else table_of(data, str(path))


def read_mapping(path: str | os.PathLike[str]) -> Mapping[str, Any]:
    """Return the plain data of a table file; each number keeps its text. Errors are as for `read_table`."""
    return mapping_from_text(read_text(Path(path), pipes=True), Path(path).suffix.lower(), where=str(path))


def table_from_text(text: str, suffix: str, where: str = "table") -> DHTable:
    """Parse a table from the text of a file with this suffix; errors as for `read_table`."""
    return table_of(mapping_from_text(text, suffix, where), where)


def table_of(data: Mapping[str, Any], where: str) -> DHTable:
    return _with_place(table_from_mapping, data, where)


def _with_place(make: Callable[[Mapping[str, Any]], _T], data: Mapping[str, Any], where: str) -> _T:
    try:
        return make(data)
    except UrdfkinError as error:
        error.where = f"{where}, {error.where}" if error.where else where
        raise


def mapping_from_text(text: str, suffix: str, where: str) -> Mapping[str, Any]:
    """Parse the text of a table file into plain data; errors as for `read_table`."""
    if suffix not in _PARSERS:
        raise InputError(
            f"a table file must have the suffix {', '.join(_PARSERS)}",
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
            "a table must be a mapping with the keys `convention` and `rows`",
            where=where,
            found=type(data).__name__,
        )
    return data


def _is_markup(path: Path) -> bool:
    try:
        return read_text(path.expanduser()).lstrip().startswith("<")
    except SourceError:
        return False


_PARSERS: dict[str, Callable[[str], Any]] = {
    ".toml": partial(tomllib.loads, parse_float=Literal),
    ".json": partial(json.loads, parse_float=Literal),
    **dict.fromkeys((".csv", ".tsv", ".md", ".tex", ".txt"), from_sheet),
}


def references() -> dict[str, Path]:
    return {path.stem: path for path in sorted((robots_dir() / "dh").glob("*.toml"))}


def published(robot: str) -> list[str]:
    """Return a line with the option `--like` for each published table of a robot."""
    lines = []
    for name, path in references().items():
        data = read_mapping(path)
        if data.get("robot") == robot:
            snap = f" --snap {data['snap']:.0e}" if "snap" in data else ""
            lines.append(f"published {data['convention']} table of this robot: --like {name}{snap}")
    return lines


def reference_path(name: str) -> Path:
    """Return the file of a table, given its path or the name of a reference table.

    If there is no such file and no such table, UnknownNameError lists the nearest names.
    """
    path = Path(name)
    if path.suffix or exists(path):
        return path
    shipped = references()
    if name not in shipped:
        raise UnknownNameError("reference table", name, shipped)
    return shipped[name]
