"""Each wrong table file gets one error that names the file, the row, the column, the value and the remedy."""

import json
import math
import re
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import urdfkin
from tests.reading import present
from urdfkin.dh import export, read_table, table_from_mapping, table_from_rows
from urdfkin.dh.parse_table import read_mapping, references, table_from_text
from urdfkin.dh.rows import last_digits
from urdfkin.errors import InputError, UnknownNameError, UrdfkinError

UR5 = [
    ["0", "pi/2", "0.089159", "0"], ["-0.425", "0", "0", "0"], ["-0.39225", "0", "0", "0"],
    ["0", "pi/2", "0.10915", "0"], ["0", "-pi/2", "0.09465", "0"], ["0", "0", "0.0823", "0"],
]  # fmt: skip


def refused(tmp_path: Path, text: str, suffix: str = ".toml") -> str:
    """What reading says, which begins with the file's name."""
    file = tmp_path / f"table{suffix}"
    file.write_text(text)
    with pytest.raises(UrdfkinError) as caught:
        read_table(file)
    assert str(caught.value).startswith(f"{file}, ")
    return str(caught.value).removeprefix(f"{file}, ")


def of_rows(rows: str, **keys: str) -> str:
    head = "".join(f"{key} = {value}\n" for key, value in keys.items())
    return f'convention = "standard"\n{head}rows = {rows}'


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
        ("[{a = 1, sense = 1.9}]", {}, "row 1, sense: `sense` must be 1 or -1: found 1.9"),
        ("[{a = 1, sense = '-1.5'}]", {}, "row 1, sense: `sense` must be 1 or -1: found '-1.5'"),
        (
            "[{joint = 'left', a = 1}, {joint = 'right', mimic = {leader = 'lefft'}}]", {},
            "row 2, leader: unknown joint 'lefft'; did you mean left.*coordinates",
        ),
        (
            "[{joint='a', mimic={leader='c'}}, {joint='b', mimic={leader='a'}}, {joint='c'}]", {},
            "row 2, leader: a joint cannot mimic a mimic joint: found 'a'",
        ),
        ("[{joint = 'a', mimic = {leader = 'a'}}]", {}, "row 1, leader: a joint cannot mimic a mimic joint"),
        ("[{mimic = {leader = 'b', factor = 2}}]", {}, "row 1: unknown key in mimic: found 'factor'"),
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
    ],
)  # fmt: skip
def test_a_wrong_table_says_where_and_what(
    rows: str, keys: dict[str, str], message: str, tmp_path: Path
) -> None:
    assert re.search(message, refused(tmp_path, of_rows(rows, **keys)))


def test_a_robot_that_is_null_is_an_error_and_a_csv_that_a_spreadsheet_wrote_is_none(tmp_path: Path) -> None:
    text = json.dumps({"convention": "standard", "robot": None, "rows": [[0.1, 0, 0, 0]]})
    assert "robot: a name must be text: found None" in refused(tmp_path, text, ".json")
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
    ],
)
def test_a_wrong_csv_says_where_and_what(text: str, message: str, tmp_path: Path) -> None:
    assert message in refused(tmp_path, f"# convention: standard\n{text}", ".csv")


@pytest.mark.parametrize("rows", [UR5, [[0.1, 0.7, 0.2, "pi/2"]], [[0, 0, 0.3, 0.5236], [0.4, "pi", 0, 0]]])
def test_a_right_list_is_no_other_order(rows: list[list[Any]]) -> None:
    assert len(table_from_rows(rows, "standard").rows) == len(rows)


def test_lengths_hold_for_base_tool_limits_and_followers() -> None:
    data = {
        "convention": "standard", "angles": "degrees", "lengths": "millimetres",
        "base": [[1, 0, 0, 100], [0, 1, 0, 0], [0, 0, 1, 250]],
        "tool": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 107], [0, 0, 0, 1]],
        "rows": [
            {"joint": "turn", "a": 400, "limit": {"lower": -90, "upper": 180, "velocity": 90}},
            {"joint": "slide", "kind": "P", "limit": {"lower": -50, "upper": 500}},
            {"joint": "follow", "kind": "P", "mimic": {"leader": "slide", "offset": 10, "multiplier": 2}},
        ],
    }  # fmt: skip
    table = table_from_mapping(data)
    assert table.base[:3, 3].tolist() == [0.1, 0.0, 0.25]
    assert table.tool[:3, 3].tolist() == [0.0, 0.0, 0.107]
    turn, slide, rule = present(table.rows[0].limit), present(table.rows[1].limit), table.rows[2].mimic
    assert (turn.lower, turn.upper, turn.velocity) == (-math.pi / 2, math.pi, math.pi / 2)
    assert (slide.lower, slide.upper) == (-0.05, 0.5)
    assert (present(rule).multiplier, present(rule).offset) == (2.0, 0.01)


def test_lists_arrays_and_short_names_of_units_are_understood() -> None:
    rows = np.array([[0.4, 0.0, 0.1, 0.0], [0.3, np.pi / 2, 0.0, 0.0]])
    for written in (rows, list(rows), [[np.float32(0.5), np.int64(0), 0, 0]]):
        table = table_from_rows(written, "standard")
        assert table.rows[0].a == float(np.asarray(written)[0, 0])
    table = table_from_rows([[400, 90, 0, 45]], "standard", angles="deg", lengths="mm")
    assert table.rows[0].cells == (0.4, math.pi / 2, 0.0, math.pi / 4, 0.0)


def test_a_leader_elsewhere_on_the_robot_is_a_coordinate_and_survives_being_written() -> None:
    robot = urdfkin.load("panda")
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
        mistyped = text.replace('leader": "panda_finger_joint1', 'leader": "panda_finger_joint2').replace(
            'leader = "panda_finger_joint1', 'leader = "panda_finger_jointl'
        )
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
        {"joint": "j2", "a": 0.1, "mimic": {"leader": "j1", "multiplier": 2, "offset": 0.5}},
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
def test_anything_at_any_place_is_a_table_or_an_error_of_ours(
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
def test_any_text_is_a_table_or_an_error_of_ours(text: str, suffix: str) -> None:
    for head in ("", "# convention: standard\na,alpha,d,theta\n", 'convention = "standard"\n'):
        with suppress(UrdfkinError):
            table_from_text(head + text, suffix)


def test_nesting_without_end_is_an_error_of_ours() -> None:
    for suffix, text in ((".json", "[" * 200_000), (".toml", f"rows = {'[' * 20_000}")):
        with pytest.raises(InputError, match="not valid"):
            table_from_text(text, suffix)


def test_digits_are_read_from_every_shipped_reference() -> None:
    for path in references().values():
        found = last_digits(read_mapping(path))
        assert len(found) == len(read_table(path).rows)
        assert all(0.0 <= half <= 0.05 for row in found for half in row.values())
