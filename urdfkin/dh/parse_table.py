"""Read tables from TOML files, JSON files, and plain text copied from a document or web page.

`urdfkin.dh.rows` defines the content of TOML and JSON files. A table in text has a line of headings with a,
alpha, d and theta in any order. Below the headings, the table has a line for each joint. Commas, semicolons,
tabs, bars, ampersands or blanks separate the cells. The lines before and after the table may state the
convention, names, base and tool, as in the tables that urdfkin prints.
"""

from __future__ import annotations

import csv
import json
import os
import re
import tomllib
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, TypeGuard, TypeVar

import numpy as np

from urdfkin.dh.rows import LIMIT_KEYS, NumberWithText, table_from_mapping
from urdfkin.dh.screws import ProductOfExponentials, screws_from_mapping
from urdfkin.dh.table import DHTable
from urdfkin.dh.units import COLUMNS, InvalidCellError, parse_cell, parse_units, to_plain_text
from urdfkin.errors import InputError, SourceError, UnknownNameError, UrdfkinError
from urdfkin.errors.escape import from_csv_cell
from urdfkin.errors.numbers import UNIT_SHORT_NAMES
from urdfkin.errors.validators import as_path, safe_repr
from urdfkin.kinematics.rotation import UNCHANGED_MATRIX_TOLERANCE, polar_factor
from urdfkin.system.files import may_exist, read_text
from urdfkin.system.resources import robots_dir

#: Tolerance of a rotation that is printed with six digits.
_PRINTED_ROTATION_TOLERANCE = 1e-5
#: Maximum number of lines below the heading of a printed pose. Blank lines and Markdown fences may separate
#: the heading and the three rows.
_MAX_POSE_LINES = 6
#: A line such as `convention: modified` or `# convention: modified`.
_SETTING = re.compile(r"^\W*(convention|angles|lengths|robot|base_frame|tip_frame)\s*[:=]\s*(.+)$")
#: A line `# key: value` in CSV, with any key.
#: `table_from_mapping` rejects unknown keys.
_CSV_SETTING = re.compile(r"^#?\s*(\w+)\s*:\s*([^,;\t].*)$")
_NAMES = {
    **{name: name for name in ("mimicked_joint", "multiplier", "sense", *LIMIT_KEYS)},
    **dict.fromkeys(("a", "link length", "length"), "a"),
    **dict.fromkeys(("alpha", "link twist", "twist"), "alpha"),
    **dict.fromkeys(("d", "link offset"), "d"),
    **dict.fromkeys(("theta", "joint angle", "angle"), "theta"),
    "beta": "beta",
    **dict.fromkeys(("offset", "theta offset", "theta_offset"), "offset"),
    **dict.fromkeys(("joint", "name", "joint name"), "joint"),
    **dict.fromkeys(("kind", "type", "sigma", "joint type"), "kind"),
    **dict.fromkeys(("variable", "joint variable"), "variable"),
}
#: A heading with a unit in brackets, such as `velocity [deg/s]`.
_LIMIT_HEADING = re.compile(rf"({'|'.join(LIMIT_KEYS)})\s*[\[(]\s*([^\])]+?)\s*[\])]$", re.IGNORECASE)
_EFFORT_UNITS = ("N", "Nm", "N m", "N*m", "N·m")
_KINDS_BY_SIGMA = {"0": "R", "1": "P"}
_ROW_NUMBERS = ("", "i", "j", "n", "#", "no", "row", "link", "index")
_CONVENTIONS = {
    "modified": r"\b(?:modified|craig(?:'s)?|proximal|mdh)\b",
    "standard": r"\b(?:standard|classic(?:al)?|distal|paul(?:'s)?)\b",
}
#: The names and the convention in the title of a table that urdfkin prints.
_TITLE = re.compile(
    r"^(?:.*\bparameters of )?(?:\*\*)?(?P<robot>.+?)(?:\*\*)?[:,] (?P<base>.+?) to (?P<tip>.+?),"
    r" (?P<convention>standard|modified) "
)
#: Line above a matrix, such as `base (metres):` or `T =`. The matrix can look like rows of a table.
_MATRIX_CAPTION = re.compile(r"\b(?:base|tool)\b|[:=]\W*$", re.IGNORECASE)
_RULE = re.compile(r"[\s|:+=_\-\u2500-\u257f]*")
_NUMBER_COLUMNS = (*COLUMNS, "beta", "offset")
_COMMA = re.compile(r"(?<=[0-9]),(?=[0-9])")
#: A number such as 1,000 can mean 1 or 1000.
_THOUSANDS = re.compile(r"(?<![0-9.,])[1-9][0-9]{0,2}(,[0-9]{3})+(?![0-9,])")


def find_table_in_text(text: str) -> dict[str, Any]:
    """Find a table in a text; return plain data for `table_from_mapping`."""
    lines = text.lstrip("\ufeff").splitlines()
    for form in (_parse_latex, _parse_bars, _parse_separated, _parse_aligned):
        if (grid := form(lines)) is not None:
            break
    else:
        raise _missing_header_error(lines)
    # If a robot has the name "robot", the title begins with "robot:" and looks like a setting. Therefore,
    # titles are removed before the settings are read.
    without_title = [line for line in grid.other_lines if not _TITLE.search(line)]
    data = _parse_settings(without_title, _CSV_SETTING if form is _parse_separated else _SETTING)
    if "convention" not in data and (convention := _find_convention(grid)):
        data["convention"] = convention
    for line in grid.other_lines:
        if title := _TITLE.search(_unescape(line.replace("`", ""))):
            names = {"robot": title["robot"], "base_frame": title["base"], "tip_frame": title["tip"]}
            data = names | data
    for end in ("base", "tool"):
        if end not in data and (pose := _parse_pose(end, grid.other_lines)):
            # A printed pose is always in metres, even if the table is in millimetres.
            in_millimetres = parse_units(lengths=data.get("lengths", "metres")).uses_millimetres
            data[end] = [[*row[:3], row[3] * 1e3 if in_millimetres else row[3]] for row in pose]
    data["rows"] = [_parse_row(grid, cells, i) for i, cells in enumerate(grid.rows)]
    _replace_mimic_variables(data, _parse_coordinate_names(grid.other_lines))
    return data


@dataclass(frozen=True, slots=True)
class _Column:
    """Content of a heading."""

    name: str  # Standard name of the column; "" for an unknown heading.
    heading: str = ""  # Lower case, without unit and index.
    unit: str | None = None
    previous: bool = False  # The heading has the index i-1.


@dataclass(frozen=True, slots=True)
class _Grid:
    """The cells of a table.

    `other_lines` are the lines outside the table.
    """

    columns: tuple[_Column, ...]
    rows: list[list[str]]
    other_lines: list[str]
    decimal_commas: bool = False  # Decimal commas are possible.
    rejects_unknown_columns: bool = False

    @property
    def has_clear_decimal_comma(self) -> bool:
        """Whether a number has an unambiguous decimal comma, such as 0,4 or 162,5."""
        return any(
            column.name in _NUMBER_COLUMNS and _COMMA.search(_THOUSANDS.sub("", cell))
            for row in self.rows
            for column, cell in zip(self.columns, row, strict=True)
        )


# -- the table's position ------------------------------------------------------------------------------


def _find_grid(lines: list[str], split: Callable[[str], list[str]], separator: str = "") -> _Grid | None:
    for k, line in enumerate(lines):
        columns = _parse_columns(split(line))
        if columns is None:
            continue
        rows, end = list[list[str]](), k + 1
        for end, below in enumerate(lines[k + 1 :], k + 1):  # noqa: B007  `end` is used after the loop
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
        if any(_parse_columns(split(other)) for other in lines[end:]):
            raise _second_table_error(line)
        _refuse_rows_below(lines[end + 1 :], split, columns, len(rows))
        others, decimal_commas = [*lines[:k], *lines[end:]], separator in (";", "\t", "|")
        return _Grid(columns, rows, others, decimal_commas, separator == ",")
    return None


def _refuse_rows_below(
    lines: list[str], split: Callable[[str], list[str]], columns: tuple[_Column, ...], count: int
) -> None:
    is_other_table = False
    for line in lines:
        cells = split(line)
        if not line.strip() or line.startswith("#"):
            continue
        if not _is_row(cells, columns):
            is_other_table = len(cells) == len(columns) or bool(_MATRIX_CAPTION.search(line))
        elif not is_other_table:
            raise InputError(
                "a row of the table is below the end of the table",
                where=f"row {count + 1}",
                found=safe_repr(line.strip()),
                remedy="remove the empty line, the text or the line break in a name above this row",
            )


def _is_row(cells: list[str], columns: tuple[_Column, ...]) -> bool:
    if len(cells) != len(columns):
        return False
    numbers = [cell for column, cell in zip(columns, cells, strict=True) if column.name in COLUMNS]
    try:
        return all(parse_cell(_COMMA.sub(".", cell)) for cell in numbers)
    except InvalidCellError:
        return False


def _second_table_error(heading: str) -> InputError:
    return InputError(
        "the text contains more than one table",
        where="header",
        found=f"a second heading with {', '.join(COLUMNS)} below {safe_repr(heading.strip())}",
        remedy="write each table into its own file",
    )


def _missing_header_error(lines: list[str]) -> InputError:
    split = [re.split(r"[,;|&\t]|\s{2,}", line.strip()) for line in lines if not line.startswith("#")]
    rows = [[cell.strip() for cell in cells if cell.strip()] for cells in split]
    best = max(rows, key=lambda cells: sum(_parse_column(cell).name in COLUMNS for cell in cells), default=[])
    names = [_parse_column(cell).name for cell in best]
    missing = next((name for name in COLUMNS if name not in names), None)
    if missing is None:
        return InputError(
            "the line of column headings uses a different separator from the other lines",
            where="header",
            found=", ".join(best)[:200],
            remedy="separate all cells by the same character: a comma, a semicolon, a tab or a bar",
        )
    return InputError(
        f"the table has no column {missing!r}",
        where="header",
        found=", ".join(best)[:200] or "nothing",
        remedy=f"write a line of headings above the rows, with {', '.join(COLUMNS)}",
    )


def _parse_latex(lines: list[str]) -> _Grid | None:
    text = "\n".join(lines)
    found = re.search(r"\\begin\{(tabular[x*]?|array)\}(?:\{[^{}]*\})*(.*?)\\end\{\1\}", text, re.DOTALL)
    if found is None:
        return None
    body = re.sub(
        r"\\(?:toprule|midrule|bottomrule|hline|addlinespace|cline\{[^}]*\})|(?<!\\)%.*", "", found[2]
    )
    rows = [" ".join(line.split()) for line in re.split(r"\\\\(?:\[[^\]]*\])?", body)]
    grid = _find_grid(
        [row for row in rows if row], lambda row: [cell.strip() for cell in re.split(r"(?<!\\)&", row)]
    )
    if grid is not None and _parse_latex(text[found.end() :].splitlines()):
        raise _second_table_error(" & ".join(column.heading for column in grid.columns))
    other_lines = (text[: found.start()] + text[found.end() :]).splitlines()
    return grid and _Grid(grid.columns, grid.rows, other_lines)


def _parse_bars(lines: list[str]) -> _Grid | None:
    plain = [re.sub("[\u2502\u2503\u2551]", "|", line) for line in lines]
    plain = [re.sub(r"\\([\[\]()])", r"\1", line) for line in plain]  # Markdown escapes brackets: a \[m\].

    def split(line: str) -> list[str]:
        return [cell.strip().strip("`") for cell in line.strip().strip("|").split("|")] if "|" in line else []

    return _find_grid(plain, split, "|")


def _parse_separated(lines: list[str]) -> _Grid | None:
    lines = [line for line in lines if not re.fullmatch(r'"?sep=.?"?', line.strip())]
    grids = (
        _find_grid(lines, partial(_split_csv_line, separator=separator), separator)
        for separator in (";", "\t", ",")
    )
    return next(filter(None, grids), None)


def _split_csv_line(line: str, separator: str) -> list[str]:
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=separator), [])]
    except csv.Error:  # A cell has more characters than the limit of the module csv.
        return [line]


def _parse_aligned(lines: list[str]) -> _Grid | None:
    """Try two or more blanks between cells, then one blank."""

    def split_at_two_blanks(line: str) -> list[str]:
        return [cell for cell in re.split(r"\s{2,}", line.strip()) if cell]

    def split_at_one_blank(line: str) -> list[str]:
        joined = re.sub(r"\s*([-+*/])\s+(?=\S)", r"\1", line.strip())
        return re.sub(r"\s+([\[(])", r"\1", joined).split()

    return _find_grid(lines, split_at_two_blanks) or _find_grid(lines, split_at_one_blank)


def _parse_columns(cells: list[str]) -> tuple[_Column, ...] | None:
    columns = tuple(map(_parse_column, cells))
    names = [column.name for column in columns]
    if any(name not in names for name in COLUMNS):
        return None
    double = [name for name in names if name and names.count(name) > 1]
    if double:
        raise InputError(f"the column {double[0]!r} occurs twice", where="header", found=", ".join(cells))
    return columns


def _parse_column(heading: str) -> _Column:
    text = to_plain_text(heading).strip("*` ")
    if limit := _LIMIT_HEADING.match(text):
        return _parse_limit_column(limit[1].lower(), limit[2])
    unit = None
    if found := re.search(
        r"[\[(/]\s*(" + "|".join(sorted(UNIT_SHORT_NAMES, key=len, reverse=True)) + r")\s*[\])]?\s*$", text
    ):
        unit, text = UNIT_SHORT_NAMES[found[1]], text[: found.start()]
    previous = re.search(r"[ijkn]\s*-\s*1", text) is not None
    text = re.sub(r"[_(\s{]*[ijkn]?\s*(?:-\s*1)?[\s)}]*$", "", text) if previous or "_" in text else text
    text = (
        re.sub(r"\((?:[ijkn])\)$|(?<=[a-z]{4})[ijkn]$|^([ad])[ijkn]$", r"\1", text.strip())
        .strip(" _{}()")
        .lower()
    )
    return _Column(_NAMES.get(text, ""), text, unit, previous)


def _parse_limit_column(name: str, unit: str) -> _Column:
    if name == "effort" and unit in _EFFORT_UNITS:
        return _Column(name, name)
    allowed = UNIT_SHORT_NAMES if name != "effort" else {}
    short = allowed.get(re.sub(r"\s*/\s*s$", "", unit) if name == "velocity" else unit)
    if short is None:
        units = {"effort": "[N] or [Nm]", "velocity": "[rad/s], [deg/s], [m/s] or [mm/s]"}
        raise InputError(
            "unknown unit in a heading",
            where="header",
            found=f"{name} [{unit}]",
            remedy=f"write {units.get(name, '[rad], [deg], [m] or [mm]')}",
        )
    return _Column(name, name, short)


# -- the lines around the table ------------------------------------------------------------------------


def _parse_settings(lines: list[str], pattern: re.Pattern[str]) -> dict[str, Any]:
    data: dict[str, Any] = {}
    for line in lines:
        if found := pattern.match(line.strip()):
            value: Any = found[2].rstrip(" ;,\t").strip("\"'")
            with suppress(ValueError):
                value = json.loads(found[2])
            if data.setdefault(found[1], value) != value:
                raise InputError(
                    "two lines state different values",
                    where=found[1],
                    found=f"{safe_repr(data[found[1]])} and {safe_repr(value)}",
                )
    return data


def _find_convention(grid: _Grid) -> str | None:
    """A heading with the index i-1 means "modified"."""
    if any(column.previous for column in grid.columns):
        return "modified"
    # Below a title, a name such as "distal" must not select a convention.
    if title := next(filter(None, map(_TITLE.search, grid.other_lines)), None):
        return title["convention"]
    text = "\n".join(map(to_plain_text, grid.other_lines))
    names = [name for name, pattern in _CONVENTIONS.items() if re.search(pattern, text, re.IGNORECASE)]
    return names[0] if len(names) == 1 else None


def _parse_pose(end: str, lines: list[str]) -> list[list[float]] | None:
    """Parse a pose printed by urdfkin, as text or as a LaTeX matrix."""
    matrix = rf"{end.title()} \(m\): \$\\begin{{bmatrix}}(.*?)\\end{{bmatrix}}"
    if found := re.search(matrix, " ".join(lines)):
        return _nearest_rigid(
            [[parse_cell(cell).number for cell in row.split("&")] for row in found[1].split(r"\\")], end
        )
    for k, line in enumerate(lines):
        if line.strip().lower().startswith(f"{end} (metres):"):
            rows = [row.split() for row in lines[k + 1 : k + 1 + _MAX_POSE_LINES] if row.strip(" `")][:3]
            if len(rows) == 3 and all(len(row) == 4 for row in rows):
                return _nearest_rigid([[float(number) for number in row] for row in rows], end)
    return None


def _nearest_rigid(rows: list[list[float]], end: str) -> list[list[float]]:
    """Replace a rounded rotation by the nearest rotation matrix."""
    pose = np.array(rows)
    if not np.isfinite(pose).all():  # LAPACK may run forever for an infinite matrix.
        raise InputError(f"the {end} must be a matrix of finite numbers", where=end, found=safe_repr(rows))
    correction = polar_factor(pose[:3, :3]) - pose[:3, :3]
    if UNCHANGED_MATRIX_TOLERANCE < np.abs(correction).max() < _PRINTED_ROTATION_TOLERANCE:
        pose[:3, :3] += correction
    return [[float(number) for number in row] for row in pose]


def _parse_coordinate_names(lines: list[str]) -> list[str]:
    """Parse a line such as `with q1 = left, q2 = right`, or `with $q_{1}$ = left` in LaTeX."""
    plain = (
        re.sub(r"\$q_\{([0-9]+)\}\$ = ", r"q\1 = ", line.removeprefix(r"  \par\medskip ")) for line in lines
    )
    line = next((line for line in plain if line.startswith("with q1 = ")), "")
    return [_unescape(name).strip("`") for name in re.findall(r"q[0-9]+ = ([^,]+)", line)]


# -- rows ----------------------------------------------------------------------------------------------


def _parse_row(grid: _Grid, cells: list[str], index: int) -> dict[str, Any]:
    row: dict[str, Any] = {}
    for column, cell in zip(grid.columns, cells, strict=True):
        if not column.name and grid.rejects_unknown_columns and column.heading not in _ROW_NUMBERS:
            row[column.heading] = cell  # `table_from_mapping` rejects this heading.
        elif not column.name or (not cell and column.name not in COLUMNS):
            continue
        elif column.name in _NUMBER_COLUMNS:
            where = f"row {index + 1}, {column.name}"
            row[column.name] = _add_unit(cell, column, where, grid)
        elif column.name == "kind":
            row["kind"] = _KINDS_BY_SIGMA.get(cell, cell)
        elif column.name == "variable":
            row |= _parse_variable(cell, f"row {index + 1}, variable")
        elif column.name in LIMIT_KEYS and column.unit:
            row[column.name] = f"{cell} {column.unit}"
        else:
            row[column.name] = (
                from_csv_cell(_unescape(cell)) if column.name in ("joint", "mimicked_joint") else cell
            )
    units = {column.name: column.unit for column in grid.columns}
    return _nest_row(row, units, f"row {index + 1}, offset")


def _parse_variable(cell: str, where: str) -> dict[str, Any]:
    """Parse a variable such as d3 or -θ2. Only d and theta determine the joint's kind."""
    found = re.fullmatch(r"(-?)\s*(theta|th|d|q)[\W_]*[0-9]*[\W_]*", to_plain_text(cell))
    if found is None:
        raise InputError(
            "this is not a joint variable", where=where, found=safe_repr(cell), remedy="write θ1, d1 or q1"
        )
    kind = {"q": {}, "d": {"kind": "P"}}.get(found[2], {"kind": "R"})
    return kind | ({"sense": "-1"} if found[1] else {})


def _add_unit(original: str, column: _Column, where: str, grid: _Grid) -> str:
    text = _COMMA.sub(".", original) if grid.decimal_commas else original
    if grid.decimal_commas and _THOUSANDS.search(original) and not grid.has_clear_decimal_comma:
        raise InputError(
            "the comma can be a decimal comma or separate thousands",
            where=where,
            found=safe_repr(original),
            remedy="write a decimal point, or no comma in a large number",
        )
    try:
        cell = parse_cell(text)
    except InvalidCellError as error:
        is_comma_separated = grid.rejects_unknown_columns
        problem = (
            "separate cells by semicolons if commas are decimal"
            if "," in original and is_comma_separated
            else f"{error}"
        )
        raise InputError(
            "this is not a number",
            where=where,
            found=safe_repr(original),
            remedy=f"{problem}: write 1.5708, pi/2 or 90 deg",
        ) from None
    plain = to_plain_text(text)
    return f"{plain} {column.unit}" if column.unit and cell.unit is None and cell.number else plain


def _unescape(name: str) -> str:
    return re.sub(r"\\([_&%$#{}])", r"\1", name)


def _nest_row(row: dict[str, Any], units: Mapping[str, str | None], where: str) -> dict[str, Any]:
    """Nest the entries of a mimic rule and of limits; without a mimic rule, add the offset to theta or d."""
    mimic: dict[str, Any] = {key: row.pop(key) for key in ("mimicked_joint", "multiplier") if key in row}
    if mimic and "offset" in row:
        mimic["offset"] = row.pop("offset")
    limit = {key: row.pop(key) for key in LIMIT_KEYS if key in row}
    if "offset" in row:
        _add_offset(row, row.pop("offset"), units, where)
    return {**row, **({"mimic": mimic} if mimic else {}), **({"limit": limit} if limit else {})}


def _add_offset(row: dict[str, Any], offset: str, units: Mapping[str, str | None], where: str) -> None:
    slides = parse_cell(row["d"]).variable_factor is not None
    name = "d" if str(row.get("kind", "P" if slides else "R")).upper().startswith("P") else "theta"
    cell, added = parse_cell(row[name]), parse_cell(offset)
    unit = added.unit or units[name]
    if added.variable_factor is not None or (cell.number and added.number and cell.unit != unit):
        raise InputError(
            f"offset must be a number in the unit of {name}",
            where=where,
            found=f"{safe_repr(offset)}, and {safe_repr(row[name])} in {name}",
            remedy="write both with the same unit",
        )
    offset = offset if added.unit else f"{offset} {unit or ''}"
    row[name] = f"{row[name]} + {offset}".replace("+ -", "- ").replace("+ +", "+ ")


def _replace_mimic_variables(data: dict[str, Any], coordinates: list[str]) -> None:
    """Replace another joint's variable by a mimic rule.

    Variable qi belongs to the i-th joint in `coordinates`, or to row i if `coordinates` is empty.
    """
    rows = data["rows"]
    joints = [row.get("joint", f"joint_{i + 1}") for i, row in enumerate(rows)]
    names = coordinates or joints
    for i, row in enumerate(rows):
        for name in ("theta", "d"):
            cell = parse_cell(row[name])
            if cell.variable_factor is None:
                continue
            if not coordinates and cell.variable in (None, i + 1) and abs(cell.variable_factor) == 1.0:
                continue  # `table_from_mapping` interprets the row's own variable.
            number = cell.variable or i + 1
            if number > len(names):
                raise InputError(
                    "no row has the joint variable that this row mimics",
                    where=f"row {i + 1}, {name}",
                    found=row[name],
                )
            row |= {"kind": row.get("kind", "R" if name == "theta" else "P"), name: cell.constant}
            if names[number - 1] == joints[i] and abs(cell.variable_factor) == 1.0:
                row["sense"] = cell.variable_factor
            else:
                row["mimic"] = {"mimicked_joint": names[number - 1], "multiplier": cell.variable_factor}
    if elsewhere := [name for name in coordinates if name not in joints]:
        data.setdefault("coordinates", elsewhere)


# -- files ---------------------------------------------------------------------------------------------

_T = TypeVar("_T")


def is_table_file(source: object) -> TypeGuard[str | os.PathLike[str]]:
    """Return whether a source is a table file; a .txt file that begins with "<" is a URDF."""
    if isinstance(source, str) and source.lstrip().startswith("<"):
        return False
    if (
        not isinstance(source, str | os.PathLike)
        or (suffix := Path(source).suffix.lower()) not in _PARSERS_BY_SUFFIX
    ):
        return False
    return suffix != ".txt" or not _is_markup(Path(source))


def read_table(path: str | os.PathLike[str]) -> DHTable:
    """Read a table from a .toml, .json, .csv, .tsv, .md, .tex or .txt file.

    Raises:
        SourceError: the file cannot be read.
        InputError: the suffix, the syntax or the table is invalid.
        UnknownNameError: a mimicked joint has no row and is not in `coordinates`.

    >>> import urdfkin
    >>> table = urdfkin.read_table("robots/dh/ur5.toml")
    >>> len(table.rows), table.convention.value
    (6, 'standard')
    """
    return parse_table_data(read_mapping(path), str(path))


def read_table_or_screws(path: str | os.PathLike[str]) -> DHTable | ProductOfExponentials:
    """Read a table, or a product of exponentials if the file has the key M."""
    data = read_mapping(path)
    return (
        _add_place(screws_from_mapping, data, str(path)) if "M" in data else parse_table_data(data, str(path))
    )


def read_mapping(path: str | os.PathLike[str]) -> Mapping[str, Any]:
    file = as_path(path, "path")
    return mapping_from_text(read_text(file, pipes=True), file.suffix.lower(), where=str(path))


def table_from_text(text: str, suffix: str, where: str = "table") -> DHTable:
    return parse_table_data(mapping_from_text(text, suffix, where), where)


def parse_table_data(data: Mapping[str, Any], where: str) -> DHTable:
    return _add_place(table_from_mapping, data, where)


def _add_place(make: Callable[[Mapping[str, Any]], _T], data: Mapping[str, Any], where: str) -> _T:
    try:
        return make(data)
    except UrdfkinError as error:
        error.where = f"{where}, {error.where}" if error.where else where
        raise


def mapping_from_text(text: str, suffix: str, where: str) -> Mapping[str, Any]:
    if suffix not in _PARSERS_BY_SUFFIX:
        raise InputError(
            f"a table file must have the suffix {', '.join(_PARSERS_BY_SUFFIX)}",
            where=where,
            found=repr(suffix),
            remedy="rename the file",
        )
    try:
        data = _PARSERS_BY_SUFFIX[suffix](text)
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


def _as_mapping(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    data = dict(pairs)
    if len(data) < len(pairs):
        keys = [key for key, _ in pairs]
        raise ValueError(f"the key {next(key for key in keys if keys.count(key) > 1)!r} occurs twice")
    return data


def _is_markup(path: Path) -> bool:
    try:
        return read_text(path.expanduser()).lstrip().startswith("<")
    except SourceError:
        return False


_PARSERS_BY_SUFFIX: dict[str, Callable[[str], Any]] = {
    ".toml": partial(tomllib.loads, parse_float=NumberWithText),
    ".json": partial(json.loads, parse_float=NumberWithText, object_pairs_hook=_as_mapping),
    **dict.fromkeys((".csv", ".tsv", ".md", ".tex", ".txt"), find_table_in_text),
}


def published_tables() -> dict[str, Path]:
    return {path.stem: path for path in sorted((robots_dir() / "dh").glob("*.toml"))}


def suggest_published_tables(robot: str) -> list[str]:
    lines = []
    for name, path in published_tables().items():
        data = read_mapping(path)
        if data.get("robot") == robot:
            snap = f" --snap {data['snap']:.0e}" if "snap" in data else ""
            lines.append(f"published {data['convention']} table of this robot: --like {name}{snap}")
    return lines


def reference_path(name: str) -> Path:
    """Return the path of a table; `name` is a path or the name of a published table."""
    path, files = Path(name), published_tables()
    if not name:
        raise SourceError("the path is empty", remedy=f"give a file, or one of {', '.join(files)}")
    if path.suffix or may_exist(path):
        return path
    if name not in files:
        raise UnknownNameError("reference table", name, files)
    return files[name]
