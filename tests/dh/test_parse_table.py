"""Tables are read from common file formats, and the error for a wrong file names the mistake."""

import contextlib
import json
import math
import re
from collections import Counter
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.cli.running import good
from tests.dh.arms import CONVENTIONS
from tests.random_chains import trees
from tests.reading import present
from urdfkin.dh import (
    export,
    make_dh_table,
    parse_units,
    read_table,
    table_from_mapping,
    table_from_rows,
    to_convention,
)
from urdfkin.dh.compare import compare
from urdfkin.dh.parse_table import (
    is_table_file,
    mapping_from_text,
    published_tables,
    read_mapping,
    reference_path,
    table_from_text,
)
from urdfkin.dh.rows import half_digits_by_row
from urdfkin.dh.units import InvalidCellError, parse_cell
from urdfkin.errors import InputError, SourceError, UnknownNameError, UrdfkinError
from urdfkin.model.tree import KinematicTree
from urdfkin.robot.loading import load


@pytest.mark.slow
@given(trees(), st.sampled_from(CONVENTIONS), st.sampled_from(["toml", "json", "csv"]))
@settings(max_examples=50)
def test_a_written_table_is_read_exactly(tree: KinematicTree, convention: str, form: str) -> None:
    table = make_dh_table(tree, "tip", convention=convention)
    again = table_from_text(export(table, form), f".{form}")
    assert again.rows == table.rows
    assert again.convention is table.convention
    assert (again.robot, again.base_frame, again.tip_frame) == (table.robot, "l0", "tip")
    np.testing.assert_array_equal(again.base, table.base)
    np.testing.assert_array_equal(again.tool, table.tool)


def test_a_missing_file_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(SourceError, match="no such file"):
        read_table(tmp_path / "missing.toml")


# -- formats: spreadsheets, READMEs, papers, web pages, output of programs -----------------------------


#: For each file: its convention and its rows (a, alpha, d, theta, R or P).
SHEETS: dict[str, tuple[str, str, list[tuple[float, float, float, float, str]]]] = {
    "excel.csv": (
        "\ufeffsep=;\r\nconvention: standard;;;;\r\nJoint;a [mm];α [°];d [mm];θ [°]\r\n"
        "A1;0;90;89,159;0\r\nA2;-425;0;0;-45,5\r\n",
        "standard",
        [(0, math.pi / 2, 0.089159, 0, "R"), (-0.425, 0, 0, math.radians(-45.5), "R")],
    ),
    "toolbox.txt": (
        "DHRobot: UR5 (by Universal Robotics), 6 joints (RRRRRR), standard DH parameters\n"
        "┌───────────┬─────────┬─────────┬────────┐\n│θⱼ  │   dⱼ    │   aⱼ    │   ⍺ⱼ   │\n├──┼──┼──┼──┤\n"
        "│ q1 │ 0.08946 │       0 │  90.0° │\n│ q2 + 180° │       0 │  -0.425 │   0.0° │\n└──┴──┴──┴──┘\n",
        "standard",
        [(0, math.pi / 2, 0.08946, 0, "R"), (-0.425, 0, 0, math.pi, "R")],
    ),
    "toolbox_modified.txt": (
        "│ aⱼ₋₁  │  ⍺ⱼ₋₁  │ θⱼ  │  dⱼ   │\n├──┼──┼──┼──┤\n│ 0.0 │ 0.0° │  q1 │ 0.333 │\n"
        "│ 0.0 │ -90.0° │  q2 │ 0.0 │\n",
        "modified",
        [(0, 0, 0.333, 0, "R"), (0, -math.pi / 2, 0, 0, "R")],
    ),
    "readme.md": (
        "Modified DH parameters (Craig)\n\n| Joint | $a_{i-1}$ (mm) | $\\alpha_{i-1}$ (rad) | $d_i$ |"
        " $\\theta_i$ |\n|---|:--:|---|---|---|\n| 1 | 0 | 0 | 333 mm | $\\theta_1$ |\n"
        "| 2 | 82.5 | $-\\frac{\\pi}{2}$ | 0 | θ₂* + π |\n\nThe end.\n",
        "modified",
        [(0, 0, 0.333, 0, "R"), (0.0825, -math.pi / 2, 0, math.pi, "R")],
    ),
    "commas.md": (
        "standard\n\n| Joint | θ | d [mm] | a [mm] | α |\n|---|---|---|---|---|\n"
        "| J1 | q1 | 162,5 | 0 | 90° |\n"
        "| J2 | q2 - 0,5 | 0 | -392,25 | 0 |\n",
        "standard",
        [(0, math.pi / 2, 0.1625, 0, "R"), (-0.39225, 0, 0, -0.5, "R")],
    ),
    "paper.tex": (
        "In the classical convention,\n\\begin{tabular}{c|cccc}\\hline\nLink & $a_i$ & $\\alpha_i$ & $d_i$ &"
        " $\\theta_i$ \\\\ \\hline\n1 & $0$ & $\\pi/2$ & $0.4$ & $\\theta_1^*$ \\\\\n"
        "2 & $0.3$ & $-90^\\circ$ & $-d_2^* + 0.1$ & $0$ \\\\[2pt] \\hline\n\\end{tabular}\n",
        "standard",
        [(0, math.pi / 2, 0.4, 0, "R"), (0.3, -math.pi / 2, 0.1, 0, "P")],
    ),
    "vendor.tsv": (
        "standard DH\nKinematics\ttheta [rad]\ta [m]\td [m]\talpha [rad]\nJoint 1\t0\t0\t0.1625\tπ/2\n"
        "Joint 2\t0\t-0.425\t0\t0\n",
        "standard",
        [(0, math.pi / 2, 0.1625, 0, "R"), (-0.425, 0, 0, 0, "R")],
    ),
    "narrow.txt": (
        "convention: modified\ni a(i-1) alpha(i-1) d theta\n1 0 0 0.333 q1\n2 0 -pi/2 0 q2 - pi / 2\n",
        "modified",
        [(0, 0, 0.333, 0, "R"), (0, -math.pi / 2, 0, -math.pi / 2, "R")],
    ),
    "offset.csv": (
        "# convention: standard\ntheta,d,a,alpha,offset,sigma\n0,0.3,0,-pi/2,pi/4,0\n0,0,0.1,0,-0.05,1\n",
        "standard",
        [(0, -math.pi / 2, 0.3, math.pi / 4, "R"), (0.1, 0, -0.05, 0, "P")],
    ),
}


@pytest.mark.parametrize("name", SHEETS)
def test_tables_in_common_layouts_are_read_correctly(name: str, tmp_path: Path) -> None:
    text, convention, rows = SHEETS[name]
    path = tmp_path / name
    path.write_text(text, "utf-8")
    table = read_table(path)
    assert table.convention == convention
    for row, (*cells, kind) in zip(table.rows, rows, strict=True):
        assert row.cells[:4] == pytest.approx(cells, abs=1e-15)
        assert row.kind.turns == (kind == "R")
    assert load(path, verify=False).nq == len(rows)


COMMA_TABLE = "standard\n\n| θ | d [mm] | a [mm] | α |\n|---|---|---|---|\n| q1 | {} | {} | 0 |\n"


@pytest.mark.parametrize(("d", "a"), [("1,000", "0"), ("-392,250", "0.5"), ("1,234,567", "0")])
def test_a_comma_that_may_separate_thousands_is_refused(d: str, a: str) -> None:
    with pytest.raises(InputError, match=r"decimal comma or separate thousands") as caught:
        table_from_text(COMMA_TABLE.format(d, a), ".md")
    assert caught.value.where is not None
    assert "row 1, d" in caught.value.where


def test_another_decimal_comma_of_the_table_decides_that_three_digits_are_decimals() -> None:
    table = table_from_text(COMMA_TABLE.format("1,250", "0,5"), ".md")
    assert (table.rows[0].d, table.rows[0].a) == (1.25e-3, 0.5e-3)


def test_the_sign_of_a_joint_variable_is_the_sense_of_the_row() -> None:
    assert table_from_text(SHEETS["paper.tex"][0], ".tex").rows[1].sense == -1
    text = 'convention = "standard"\nrows = [{theta = "-q1 + 90 deg", d = "107 mm"}]'
    (row,) = table_from_text(text, ".toml").rows
    assert (row.sense, row.theta, row.d) == (-1, math.pi / 2, 0.107)


@pytest.mark.slow
@pytest.mark.parametrize("form", ["terminal", "markdown", "latex", "csv"])
@pytest.mark.parametrize("name", published_tables())
def test_a_printed_reference_table_is_read_with_the_same_placements(name: str, form: str) -> None:
    table = read_table(reference_path(name))
    for units in (parse_units(), parse_units("degrees", "millimetres")):
        again = table_from_text(export(table, form, units), SUFFIXES[form])
        for one in ("robot", "base_frame", "tip_frame", "convention"):
            assert getattr(again, one) == getattr(table, one)
        assert [row.joint for row in again.rows] == [row.joint for row in table.rows]
        q = np.linspace(-1, 1, len(table.rows))
        np.testing.assert_allclose(again.placement(q), table.placement(q), atol=1e-9)


def test_a_robot_with_the_name_robot_is_read_from_a_printed_table() -> None:
    table = table_from_rows([[0.3, 0, 0, 0]], "standard")
    assert table.robot == "robot"
    assert table_from_text(export(table, "terminal"), ".txt").robot == "robot"


@pytest.mark.slow
@given(trees(min_joints=1), *map(st.sampled_from, (("standard", "modified"), ("terminal", "markdown"))))
@settings(max_examples=40)
def test_a_printed_table_of_a_random_robot_is_read_with_the_same_placements(
    tree: KinematicTree, convention: str, form: str
) -> None:
    table = make_dh_table(tree, "tip", convention=convention)
    again = table_from_text(export(table, form, parse_units(digits=17)), SUFFIXES[form])
    assert again.joint_names == table.joint_names
    q = np.linspace(-1, 1, len(table.joint_names))
    np.testing.assert_allclose(again.placement(q), table.placement(q), atol=1e-8 * max(1.0, table.span))


@pytest.mark.parametrize(
    "text", ["", "1_0", "nan", "1 2", "--1", "1/0", "q1 + q2", "pi deg", "3 *", "* 3", "٣", "1e999"]
)
def test_an_invalid_cell_is_refused(text: str) -> None:
    with pytest.raises(InvalidCellError):
        parse_cell(text)


@pytest.mark.slow
@given(st.text(max_size=30))
@settings(max_examples=300)
def test_every_text_is_a_finite_cell_or_is_refused(text: str) -> None:
    with contextlib.suppress(InvalidCellError):
        assert math.isfinite(parse_cell(text).number)


def test_the_last_digit_of_a_cell_with_a_unit_is_converted() -> None:
    data = mapping_from_text("a;alpha;d;theta\n311,1 mm;90°;0,25;0\n", ".csv", "sheet")
    assert half_digits_by_row({"convention": "standard", **data})[0] == {
        "a": pytest.approx(5e-5), "alpha": 0.0, "d": pytest.approx(5e-3), "theta": 0.0,
    }  # fmt: skip


def test_a_urdf_with_the_suffix_txt_is_not_a_table(tmp_path: Path) -> None:
    urdf, table = tmp_path / "robot.txt", tmp_path / "table.txt"
    urdf.write_text("  <robot name='r'><link name='l'/></robot>")
    table.write_text(SHEETS["narrow.txt"][0])
    assert not is_table_file(urdf)
    assert is_table_file(table)


def test_dh_prints_a_table_file_unchanged_or_converted(tmp_path: Path) -> None:
    path, out = str(reference_path("kinova")), tmp_path / "again.csv"
    text = good("dh", path, "--degrees").text
    assert "q1 + 180" in text
    assert "agrees within rounding" in text
    good("dh", path, "--format", "csv", "-o", str(out))
    assert read_table(out).rows[0].theta == math.pi
    good("dh", path, "--convention", "modified", "--format", "csv", "-o", str(out))
    wanted = to_convention(read_table(path), "modified")
    assert [row.cells for row in read_table(out).rows] == [row.cells for row in wanted.rows]
    assert "q1 + pi" not in good("dh", path, "--last", "flange").text


@pytest.mark.parametrize(
    "header", ["a;alpha,d,theta", "a,alpha;d,theta", "a_i;alpha,d,theta", "a|alpha,d,theta"]
)
def test_headings_with_mixed_separators_are_refused(header: str) -> None:
    words = "the line of column headings uses a different separator from the other lines"
    with pytest.raises(InputError, match=words):
        table_from_text(f"# convention: standard\n{header}\n0,pi/2,0.1,0\n", ".csv")


@pytest.mark.parametrize("number", ["1e4000", "nan", "-inf"])
def test_a_base_with_an_infinite_number_is_refused(number: str) -> None:
    """LAPACK computed the singular values of such a matrix without end."""
    rows = f" 1 0 0 0\n {number} 1 0 0\n 0 0 1 0\n"
    sheet = f"standard\na  alpha  d  theta\n0  pi/2  0.3  q1\n\nbase (metres):\n{rows}"
    with pytest.raises(InputError, match="the base must be a matrix of finite numbers"):
        table_from_text(sheet, ".txt")


@pytest.mark.parametrize("form", ["to_markdown", "to_latex", "to_html"])
def test_markdown_latex_and_html_use_radians_metres_and_ten_digits_by_default(form: str) -> None:
    write = getattr(table_from_rows([[math.sqrt(2.0), 0.1, math.sqrt(0.5), 0.0]], "standard"), form)
    assert write() == write("radians", "metres", 10)
    assert "1.4142135624" not in write()
    assert "1.4142135624" in write(digits=11)


#: Texts that replace characters of a table, to damage it.
PIECES = (
    *",;\t|& \"'\n\\{}[]()_^$-+*/0123456789eqadtheta.\x00\ufeffα",
    *("", "nan", "inf", "1e400", "1e155", "(i-1)"),
)
#: For each format of `export`: the suffix of its files.
SUFFIXES = {
    "csv": ".csv", "markdown": ".md", "latex": ".tex", "terminal": ".txt", "toml": ".toml", "json": ".json",
}  # fmt: skip


@cache
def printed_ur5() -> dict[str, str]:
    table = read_table(reference_path("ur5"))
    rows = "0\tpi/2\t0,1\t0\n" * len(table.rows)
    sheets = {suffix: export(table, form) for form, suffix in SUFFIXES.items()}
    return {**sheets, ".tsv": f"convention: standard\na\talpha\td\ttheta\n{rows}"}


@st.composite
def damaged(draw: st.DrawFn) -> tuple[str, str]:
    """Return the suffix and the text of a table with a few characters changed, removed or repeated."""
    suffix = draw(st.sampled_from([*SUFFIXES.values(), ".tsv"]))
    text = printed_ur5()[suffix]
    for _ in range(draw(st.integers(1, 5))):
        head = max(text.find("theta"), 40) + 20  # damage near the headings has the most effects
        k = draw(st.integers(0, min(head, len(text))) | st.integers(0, len(text)))
        piece = draw(st.sampled_from((*PIECES, text[k : k + 4], 3 * text[k : k + 4])))
        text = text[:k] + piece + text[k + draw(st.integers(0, 12)) :]
    return suffix, text


@pytest.mark.slow
def test_a_damaged_table_is_refused_with_a_message_or_compared() -> None:
    path, outcomes = load("ur5").chain("tool0", "base"), Counter[str]()

    @settings(max_examples=100)
    @given(damaged())
    def judge(sheet: tuple[str, str]) -> None:
        suffix, text = sheet
        try:
            compare(path, table_from_text(text, suffix))
        except UrdfkinError as error:
            outcomes["refused"] += bool(str(error))
        else:
            outcomes["read"] += 1

    judge()
    assert outcomes["refused"] > 10
    assert outcomes["read"] > 10


# -- errors --------------------------------------------------------------------------------------------

UR5 = [
    ["0", "pi/2", "0.089159", "0"], ["-0.425", "0", "0", "0"], ["-0.39225", "0", "0", "0"],
    ["0", "pi/2", "0.10915", "0"], ["0", "-pi/2", "0.09465", "0"], ["0", "0", "0.0823", "0"],
]  # fmt: skip


def refused(tmp_path: Path, text: str, suffix: str = ".toml") -> str:
    """Return the message of the error, which must begin with the file's name."""
    file = tmp_path / f"table{suffix}"
    file.write_text(text)
    with pytest.raises(UrdfkinError) as caught:
        read_table(file)
    assert str(caught.value).startswith(str(file))
    return str(caught.value).removeprefix(str(file))


@pytest.mark.parametrize(
    ("rows", "keys", "message"),
    [
        ("[[0.1, 90, 0, 0]]", {}, "row 1, alpha: alpha is more than one turn.*found 90; write angles = 'deg"),
        ("[[0, 0, 0, 0], [0, 0, 0, -180.0]]", {}, r"row 2, theta: .*found -180.0; write angles = 'degrees'"),
        ('[{beta = 45, a = 1}]', {}, "row 1, beta: beta is more than one turn in radians"),
        (
            "[[0, 0.089, 0, 1.5708], [0, 0.1, 0.4, 0], [0, 0.3, 0, -1.5708]]", {},
            "rows 1 to 3: the columns look like theta, d, a, alpha.*found second column 0.089",
        ),
        (
            "[[0, 89.2, 0, 90], [0, 10.1, 0.4, 0]]", {"angles": '"degrees"', "lengths": '"millimetres"'},
            "the columns look like theta, d, a, alpha",
        ),
        ("[[0, 0.089, 0, 1.5708, 0]]", {}, "row 1: .* must be 'R' or 'P'.*found 0; .*theta, d, a, alpha"),
        ("[[0, 0, 0.1, 0, 'R', 7]]", {}, r"row 1: .*found 6 entries, \[0, 0, 0.1, 0, 'R', 7\]"),
        (
            "[{theta = '-q1', sense = -1}]", {},
            "row 1, theta: a row with a joint variable must not have `sense`.*: found '-q1', sense -1; write",
        ),
        ("[{a = 1, sense = 1.9}]", {}, "row 1, sense: `sense` must be 1 or -1: found 1.9"),
        ("[{a = 1, sense = '-1.5'}]", {}, "row 1, sense: `sense` must be 1 or -1: found '-1.5'"),
        (
            "[{joint = 'left', a = 1}, {joint = 'right', mimic = {mimicked_joint = 'lefft'}}]", {},
            "row 2, mimicked_joint: unknown joint 'lefft'; did you mean left.*coordinates",
        ),
        (
            "[{joint='a', mimic={mimicked_joint='c'}}, {joint='b', mimic={mimicked_joint='a'}}, {joint='c'}]",
            {},
            "row 2, mimicked_joint: a joint cannot mimic a mimic joint: found 'a'",
        ),
        (
            "[{joint = 'a', mimic = {mimicked_joint = 'a'}}]", {},
            "row 1, mimicked_joint: a joint cannot mimic a mimic joint",
        ),
        ("[{mimic = {mimicked_joint = 'b', factor = 2}}]", {}, "row 1: unknown key in mimic: found 'factor'"),
        ("[{joint = 'a', limit = {min = 2}}]", {}, "row 1: unknown key in limit: found 'min'"),
        ("[{limit = {lower = 2, upper = 1}}]", {}, "row 1, limit: `lower` is above `upper`: found 2 and 1"),
        ("[{joint = 'a', limit = {lower = nan}}]", {}, "row 1, lower: not a finite number: found nan"),
        ("[]", {}, r"rows: a table needs a row, a base or a tool: found \[\]"),
        ("[{joint = 5}]", {}, "row 1, joint: a name must be text: found 5"),
        ("[{a = true}]", {}, "row 1, a: this is not a number: found True"),
        ("[{a = '1_0'}]", {}, "row 1, a: this is not a number: found '1_0'"),
        ("[{a = '١'}]", {}, "row 1, a: this is not a number"),
        ("[{d = inf}]", {}, "row 1, d: not a finite number: found inf"),
        ("[{a = 'pi/0'}]", {}, "row 1, a: this is not a number: found 'pi/0'"),
        (f"[{{a = 1{'0' * 400}}}]", {}, "row 1, a: this is not a number"),
        ("[{a = 1979-05-27}]", {}, "row 1, a: this is not a number"),
        ("[{a = 1}]", {"robot": "1979-05-27"}, "robot: a name must be text"),
        ("[{a = 1}]", {"angles": "1979-05-27"}, "angles or lengths: unknown unit"),
        ("[{kind = 3}]", {}, "row 1, kind: the kind of a row must be revolute, .*: found 3"),
        ("[{a = 1}]", {"robot": "7"}, "robot: a name must be text: found 7"),
        ("[{a = 1}]", {"base_frame": "''"}, "base_frame: a name must be text: found ''"),
        ("[{a = 1}]", {"base": "[[1,0,0,'0'], [0,1,0,'x'], [0,0,1,0]]"}, "base, row 2, column 4: this is"),
        ("[{a = 1}]", {"tool": "[1, 2, 3]"}, "tool: the tool must be a matrix of numbers, 4 x 4 or 3 x 4"),
        ("[{a = 1}]", {"angles": "['deg']"}, "unknown unit"),
        ("[{a = 1}]", {"coordinates": "'q'"}, "coordinates: `coordinates` must be a list of names"),
        ("'none'", {}, "rows: a table needs a list of rows: found 'none'"),
        ("[[0, 0, 0, 0, 'X']]", {}, "row 1, kind: the kind of a row must be revolute, continuous or"),
        ("[{a = 0, alhpa = 1}]", {}, "unknown key in a row: found 'alhpa'"),
        ("[{mimic = 'j1'}]", {}, "`mimic` must have the form {mimicked_joint"),
        ("[{a = 1}]", {"anlges": "'degrees'"}, "unknown key in a table: found 'anlges'"),
        ("[{a = 1}]", {"convention": "'dh'"}, "unknown convention: found 'dh'"),
        ("[{a = 1}]", {"convention": ""}, "does not name its convention"),
    ],
)  # fmt: skip
def test_an_error_in_a_table_is_reported_with_position_and_reason(
    rows: str, keys: dict[str, str], message: str, tmp_path: Path
) -> None:
    lines = {"convention": "'standard'", **keys, "rows": rows}
    text = "".join(f"{key} = {value}\n" for key, value in lines.items() if value)
    assert re.search(message, refused(tmp_path, text))


NULL = '{"convention": "standard", "robot": null, "rows": [[0.1, 0, 0, 0]]}'


@pytest.mark.parametrize(
    ("text", "suffix", "message"),
    [
        ("rows = [", ".toml", ": not valid TOML"),
        ("", ".xls", "must have the suffix .toml, .json, .csv, .tsv"),
        (NULL, ".json", "robot: a name must be text: found None"),
        ('{"rows": [{"a": 1, "d": 0, "a": 2}]}', ".json", ": not valid JSON: found the key 'a' occurs twice"),
        pytest.param("[" * 200_000, ".json", ": not valid", id="deep JSON"),
        pytest.param(f"rows = {'[' * 20_000}", ".toml", ": not valid", id="deep TOML"),
    ],
)
def test_an_error_in_a_file_is_reported_with_the_name_of_the_file(
    text: str, suffix: str, message: str, tmp_path: Path
) -> None:
    assert message in refused(tmp_path, text, suffix)


def test_a_csv_file_of_a_spreadsheet_is_read(tmp_path: Path) -> None:
    file = tmp_path / "sheet.csv"
    file.write_bytes(b"\xef\xbb\xbf# convention: standard\r\na,alpha,d,theta\r\n0.1,pi/2,0,0\r\n,,,\r\n")
    assert read_table(file).rows[0].cells == (0.1, math.pi / 2, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a,alpha,d,theta\n0.1,0,0,0,7\n", "row 1: a row needs a cell for each of the 4 columns: found 5"),
        (
            "a,alpha,d,theta\n0.1,0,0,0\n0.1,0,0\n",
            "row 2: a row needs a cell for each of the 4 columns: found 3",
        ),
        ("a,d,theta\n0.1,0,0\n", "header: the table has no column 'alpha': found a, d, theta"),
        ("0.1,0,0,0\n", "header: the table has no column 'a'"),
        ("a,a,alpha,d,theta\n1,1,0,0,0\n", "header: the column 'a' occurs twice"),
        ("a,alpha,d,theta\n0.1,,0,0\n", "row 1, alpha: this is not a number: found ''"),
        ("a,alpha,d,theta,mass\n0.1,0,0,0,1\n", "row 1: unknown key in a row: found 'mass'"),
        ("a,alpha,d,theta,twist\n0.1,0,0,0,1\n", "header: the column 'alpha' occurs twice"),
        ("", "header: the table has no column 'a': found nothing"),
        ("a,alpha,d,theta\n", "rows: a table needs a row"),
        ("# anlges: degrees\na,alpha,d,theta\n0,0,0,0\n", "unknown key in a table: found 'anlges'"),
        ('a,alpha,d,theta\n"0,3",0,0,0\n', "row 1, a: this is not a number: found '0,3'; separate cells"),
        ("a;alpha;d;phi\n0;0;0;0\n", "header: the table has no column 'theta'"),
        ("a [mm],alpha_i,x,theta\n0,pi/2,0.1,0\n", "header: the table has no column 'd'"),
        ("a;alpha;d;theta\n0;q1;0;0\n", "joint variable belongs in theta of a revolute joint, or in d"),
        ("a;alpha;d;theta\n0;0;0;q7\n", "row 1, theta: no row has the joint variable that this row mimics"),
        ("a;alpha;d;theta\n0;0;0;90 deg rad\n", "deg and rad in one cell"),
        ("a;alpha;d;theta\n90 deg;0;0;0\n", "row 1, a: a must be a length"),
        ("a;alpha;d;theta;offset [deg]\n0;0;0;q1 + pi/2;5\n", "row 1, offset: offset must be a number in"),
        ("a;alpha;d;theta;offset\n0;0;0;0;q1\n", "row 1, offset: offset must be a number in the unit of"),
        ("a;alpha;d;theta;beta\n0;0;0;0;q1\n", "row 1, beta: beta must not contain a joint variable"),
        ("a;alpha;d;theta;lower [m]\n0;0;0;q1;1\n", "row 1, lower: lower must be an angle: found '1 m'"),
        ("a;alpha;d;theta\n1.000,5;0;0;0\n", "'.5' is not understood"),
        pytest.param(
            f"a,alpha,d,theta\n{'1' * 200_000},0,0,0\n", "row 1: a row needs a cell", id="long cell"
        ),
        ("# convention: modified\na,alpha,d,theta\n1,0,0,0\n", "different values: found 'standard' and 'mod"),
        *(
            (f"joint,a,alpha,d,theta\nj1,1,0,0,0\n{line}j3,2,0,0,0\n", "row 2: a row of the table is below")
            for line in ("\n", "# remark\n", "\n\n# remark\n", '"a\nb",0,0,0,0\n', "a\u2028b,0,0,0,0\n")
        ),
    ],
)
def test_an_error_in_a_csv_table_is_reported_with_position_and_reason(
    text: str, message: str, tmp_path: Path
) -> None:
    assert message in refused(tmp_path, f"# convention: standard\n{text}", ".csv")


def test_a_row_below_a_page_break_is_refused_but_other_tables_are_skipped(tmp_path: Path) -> None:
    table = "standard\n\ni  a  alpha  d  theta\n1  0.1  0  0  q1\n2  0.2  0  0  q2\n\n"
    broken = f"{table}Table 2 (continued on the next page)\n3  0.3  0  0  q3\n"
    assert "row 3: a row of the table is below the end of the table" in refused(tmp_path, broken, ".txt")
    others = "Page 3\n\nlink  mass  x  y  z\n1  3.7  0  0  0.1\n\nJ =\n1  0  0  0  0\n2  1  0  0  0\n"
    path = tmp_path / "whole.txt"
    path.write_text(table + others)
    assert len(read_table(path).rows) == 2


@pytest.mark.parametrize("rows", [UR5, [[0.1, 0.7, 0.2, "pi/2"]], [[0, 0, 0.3, 0.5236], [0.4, "pi", 0, 0]]])
def test_correct_rows_are_not_mistaken_for_a_different_column_order(rows: list[list[Any]]) -> None:
    assert len(table_from_rows(rows, "standard").rows) == len(rows)


def test_units_apply_to_base_tool_limits_and_mimic_joints() -> None:
    data = {
        "convention": "standard", "angles": "degrees", "lengths": "millimetres",
        "base": [[1, 0, 0, 100], [0, 1, 0, 0], [0, 0, 1, 250]],
        "tool": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 107], [0, 0, 0, 1]],
        "rows": [
            {"joint": "turn", "a": 400, "limit": {"lower": -90, "upper": 180, "velocity": 90}},
            {"joint": "slide", "kind": "P", "limit": {"lower": -50, "upper": 500}},
            {
                "joint": "follow", "kind": "P",
                "mimic": {"mimicked_joint": "slide", "offset": 10, "multiplier": 2},
            },
        ],
    }  # fmt: skip
    table = table_from_mapping(data)
    assert table.base[:3, 3].tolist() == [0.1, 0.0, 0.25]
    assert table.tool[:3, 3].tolist() == [0.0, 0.0, 0.107]
    turn, slide, rule = present(table.rows[0].limit), present(table.rows[1].limit), table.rows[2].mimic
    assert (turn.lower, turn.upper, turn.velocity) == (-math.pi / 2, math.pi, math.pi / 2)
    assert (slide.lower, slide.upper) == (-0.05, 0.5)
    assert (present(rule).multiplier, present(rule).offset) == (2.0, 0.01)


@pytest.mark.parametrize("form", ["terminal", "markdown", "latex"])
def test_a_printed_table_with_mimic_joints_and_misleading_names_is_read(form: str) -> None:
    rows = [
        {"a": 1, "joint": "one"},
        {"a": 2, "joint": "two", "mimic": {"mimicked_joint": "one", "multiplier": -1}},
        {"a": 3, "joint": "modified", "kind": "P"},
    ]
    names = {"robot": "my hand", "base_frame": "craig", "tip_frame": "proximal"}
    table = table_from_rows(rows, "standard", **names)
    again = table_from_text(
        export(table, form), {"terminal": ".txt", "markdown": ".md", "latex": ".tex"}[form]
    )
    assert again.rows == table.rows
    assert (again.convention, again.joint_names) == ("standard", ("one", "modified"))
    assert {name: getattr(again, name) for name in names} == names


@pytest.mark.parametrize(("form", "suffix"), [("terminal", ".txt"), ("markdown", ".md"), ("latex", ".tex")])
def test_a_text_with_two_tables_is_refused(form: str, suffix: str) -> None:
    # The base of the second table must not become the base of the first table.
    one, two = (
        table_from_rows([[1, 0, 0, 0]], "standard", base=base)
        for base in (None, [[1, 0, 0, 5], [0, 1, 0, 0], [0, 0, 1, 0]])
    )
    with pytest.raises(InputError, match="header: the text contains more than one table"):
        table_from_text(f"{export(one, form)}\n{export(two, form)}", suffix)


@pytest.mark.parametrize(
    ("variable", "kind", "sense"),
    [("d3", "P", 1), ("$-d_3$", "P", -1), ("θ₃*", "R", 1), ("−q3", "R", -1), (r"$\theta_{3}$", "R", 1)],
)
def test_a_column_of_variables_states_kind_and_sense(variable: str, kind: str, sense: int) -> None:
    head = "standard DH\n\n| a | α | d | θ | Variable |\n|---|---|---|---|---|\n"
    text = f"{head}| 0 | 0 | 0.1 | 0 | {variable} |\n"
    row = table_from_text(text, ".md").rows[0]
    assert (row.kind.turns, row.sense, row.d) == (kind == "R", sense, 0.1)
    with pytest.raises(InputError, match="row 1, variable: this is not a joint variable: found 'x'"):
        table_from_text(text.replace(variable, "x"), ".md")


def test_a_joint_variable_in_d_adds_the_offset_to_d() -> None:
    text = "convention: standard\n\na | alpha | d | theta | offset\n0 | 0 | q1 | 0 | 0.05\n"
    assert table_from_text(text, ".md").rows[0].cells == (0.0, 0.0, 0.05, 0.0, 0.0)


@pytest.mark.parametrize("theta", ["0", "q1", "q1 + 10", "q1 + 10°"])
def test_an_offset_without_a_unit_has_the_unit_of_the_column_theta(theta: str) -> None:
    text = f"convention: standard\n\na | alpha | d | theta [deg] | offset\n0 | 0 | 0 | {theta} | 5\n"
    assert table_from_text(text, ".md").rows[0].theta == math.radians(15.0 if "10" in theta else 5.0)


@pytest.mark.parametrize("heading", ["offset", "θ offset", "theta_offset"])
def test_a_column_of_offsets_is_added_to_theta(heading: str) -> None:
    text = f"standard DH\n\na | alpha | d | theta | {heading} [deg]\n0 | 0 | 0 | q1 | 90\n"
    assert table_from_text(text, ".md").rows[0].theta == math.pi / 2


def test_a_printed_pose_is_in_metres_also_in_a_table_in_millimetres() -> None:
    text = "lengths: mm\nconvention: standard\n\na | alpha | d | theta\n0 | 0 | 100 | q1\n"
    pose = "base (metres):\n  1  0  0  0.5\n  0  1  0  0\n  0  0  1  0.1\n"
    table = table_from_text(f"{text}\n{pose}", ".md")
    assert (table.rows[0].d, table.base[:3, 3].tolist()) == (0.1, [0.5, 0.0, 0.1])


def test_a_unit_in_the_heading_of_a_limit_is_read() -> None:
    heading = "theta [deg],d,a,alpha,sigma,lower [deg],upper (deg)"
    limit = table_from_text(f"# convention: standard\n{heading}\n0,0,0,0,0,-90,45\n", ".csv").rows[0].limit
    assert (present(limit).lower, present(limit).upper) == (-math.pi / 2, math.pi / 4)


def _markdown_with_column(heading: str) -> str:
    rule, row = "|---" * 5 + "|", "| 0 | 0 | 0 | 0 | 180 |"
    return f"convention: standard\n\n| a | alpha | d | theta | {heading} |\n{rule}\n{row}\n"


@pytest.mark.parametrize(
    ("heading", "velocity", "effort"),
    [
        ("velocity [deg/s]", math.pi, math.inf),
        ("Velocity (rad / s)", 180.0, math.inf),
        ("effort [N·m]", math.inf, 180.0),
    ],
)
def test_a_unit_of_a_velocity_or_an_effort_in_a_heading_is_read(
    heading: str, velocity: float, effort: float
) -> None:
    text = _markdown_with_column(heading)
    limit = present(table_from_text(text, ".md").rows[0].limit)
    assert (limit.velocity, limit.effort) == (velocity, effort)


@pytest.mark.parametrize("heading", ["velocity [rpm]", "effort [deg]", "lower [deg/s]"])
def test_an_unknown_unit_in_the_heading_of_a_limit_is_an_error(heading: str, tmp_path: Path) -> None:
    text = _markdown_with_column(heading)
    assert f"header: unknown unit in a heading: found {heading}; write [" in refused(tmp_path, text, ".md")


def test_a_multiple_of_pi_is_in_radians_also_in_limits_and_mimic_joints_of_a_table_in_degrees() -> None:
    rows = [
        {"joint": "a", "limit": {"lower": "-pi/2", "upper": 180}},
        {"joint": "b", "mimic": {"mimicked_joint": "a", "offset": "pi/4"}},
    ]
    table = table_from_rows(rows, "standard", angles="degrees")
    limit = present(table.rows[0].limit)
    assert (limit.lower, limit.upper) == (-math.pi / 2, math.pi)
    assert present(table.rows[1].mimic).offset == math.pi / 4


def test_lists_arrays_and_short_names_of_units_are_accepted() -> None:
    rows = np.array([[0.4, 0.0, 0.1, 0.0], [0.3, np.pi / 2, 0.0, 0.0]])
    for written in (rows, list(rows), [[np.float32(0.5), np.int64(0), 0, 0]]):
        table = table_from_rows(written, "standard")
        assert table.rows[0].a == float(np.asarray(written)[0, 0])
    table = table_from_rows([[400, 90, 0, 45]], "standard", angles="deg", lengths="mm")
    assert table.rows[0].cells == (0.4, math.pi / 2, 0.0, math.pi / 4, 0.0)
    mixed = table_from_rows([[400, "pi/2", 0, 10.5]], "standard", angles="degrees")
    assert (mixed.rows[0].alpha, mixed.rows[0].theta) == (math.pi / 2, math.radians(10.5))


def test_a_mimicked_joint_outside_the_path_is_a_coordinate_also_after_writing() -> None:
    robot = load("panda")
    table = robot.dh("panda_rightfinger", "panda_link0")
    names = {row.joint for row in table.rows}
    assert [name for name in table.joint_names if name not in names] == ["panda_finger_joint1"]
    q = robot.sample(20)
    for form in ("toml", "json", "csv"):
        text = export(table, form)
        again = table_from_text(text, f".{form}")
        assert again.joint_names == table.joint_names
        own = table.coupling.select(robot.tree, q)
        np.testing.assert_array_equal(again.placement(own), table.placement(own))
        mistyped = text.replace(
            'mimicked_joint": "panda_finger_joint1', 'mimicked_joint": "panda_finger_joint2'
        ).replace('mimicked_joint = "panda_finger_joint1', 'mimicked_joint = "panda_finger_jointl')
        if mistyped != text:
            with pytest.raises((UnknownNameError, InputError)):
                table_from_text(mistyped, f".{form}")


# -- any type at any key --------------------------------------------------------------------------------

_GOOD: dict[str, Any] = {
    "convention": "standard", "angles": "radians", "lengths": "metres", "robot": "r", "base_frame": "b",
    "tip_frame": "t", "base": np.eye(4).tolist(), "tool": np.eye(4).tolist(), "coordinates": ["far"],
    "rows": [
        {"joint": "j1", "kind": "R", "a": 0.1, "alpha": 0.2, "d": 0.3, "theta": 0.4, "beta": 0.0, "sense": 1,
         "limit": {"lower": -1, "upper": 1, "velocity": 1, "effort": 1}},
        {"joint": "j2", "a": 0.1, "mimic": {"mimicked_joint": "j1", "multiplier": 2, "offset": 0.5}},
        [0.1, "pi/2", 0.3, 0.0, "P"],
    ],
}  # fmt: skip
_WORDS = ["pi", "-pi/2", "R", "P", "j1", "j2", "degrees", 10**400, -(10**400), "1e999", "pi/0"]
_SCALAR = (
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5) | st.sampled_from(_WORDS)
)
_FLAT = _SCALAR | st.lists(_SCALAR, max_size=4) | st.dictionaries(st.text(max_size=5), _SCALAR, max_size=3)
_ANYTHING = _FLAT | st.lists(_FLAT, max_size=4)


def _places(data: Any, here: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    keys = data if isinstance(data, dict) else range(len(data)) if isinstance(data, list) else ()
    return [here] * bool(here) + [place for key in keys for place in _places(data[key], (*here, key))]


_PLACES = _places(_GOOD)


@pytest.mark.slow
@given(st.lists(st.tuples(st.sampled_from(_PLACES), _ANYTHING), min_size=1, max_size=3))
@settings(max_examples=600)
def test_any_value_at_any_position_gives_a_table_or_an_error_of_urdfkin(
    changes: list[tuple[tuple[Any, ...], Any]],
) -> None:
    data = json.loads(json.dumps(_GOOD))
    for place, value in changes:
        inside = data
        try:
            for key in place[:-1]:
                inside = inside[key]
            inside[place[-1]] = value
        except (TypeError, KeyError, IndexError):
            continue
    try:
        table = table_from_text(json.dumps(data), ".json")
    except UrdfkinError:
        return
    assert np.isfinite(table.placement(np.zeros(len(table.joint_names)))).all()


@pytest.mark.slow
@given(st.text(max_size=60), st.sampled_from([".toml", ".json", ".csv"]))
@settings(max_examples=300)
def test_any_text_gives_a_table_or_an_error_of_urdfkin(text: str, suffix: str) -> None:
    for head in ("", "# convention: standard\na,alpha,d,theta\n", 'convention = "standard"\n'):
        with contextlib.suppress(UrdfkinError):
            table_from_text(head + text, suffix)


def test_the_last_digits_of_every_shipped_reference_table_are_read() -> None:
    for path in published_tables().values():
        found = half_digits_by_row(read_mapping(path))
        assert len(found) == len(read_table(path).rows)
        assert all(0.0 <= half <= 0.05 for row in found for half in row.values())
