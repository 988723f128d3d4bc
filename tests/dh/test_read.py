"""Tables from files are what was written, and a wrong file is told what is wrong with it."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.random_chains import trees
from urdfkin.dh import dh_table, export, read_table, table_from_mapping, table_from_rows
from urdfkin.dh.parse_table import table_from_text
from urdfkin.errors import InputError, SourceError
from urdfkin.model.tree import KinematicTree

ROWS = [[0.0, "pi/2", 0.3, 0.0, "R"], [0.4, 0.0, 0.0, -1.0, "P"]]


@pytest.mark.slow
@given(trees(), st.sampled_from(["standard", "modified"]), st.sampled_from(["toml", "json", "csv"]))
@settings(max_examples=50)
def test_a_written_table_reads_back_to_the_bit(tree: KinematicTree, convention: str, form: str) -> None:
    table = dh_table(tree, "tip", convention=convention)
    again = table_from_text(export(table, form), f".{form}")
    assert again.rows == table.rows
    assert again.convention is table.convention
    assert (again.robot, again.base_frame, again.tip_frame) == (table.robot, "l0", "tip")
    np.testing.assert_array_equal(again.base, table.base)
    np.testing.assert_array_equal(again.tool, table.tool)


def test_degrees_and_millimetres_are_read_where_said() -> None:
    table = table_from_rows([[400, 90, 0, 45]], "standard", angles="degrees", lengths="millimetres")
    assert table.rows[0].cells == (0.4, math.pi / 2, 0.0, math.pi / 4, 0.0)
    mixed = table_from_rows([[400, "pi/2", 0, 10.5]], "standard", angles="degrees")
    assert (mixed.rows[0].alpha, mixed.rows[0].theta) == (math.pi / 2, math.radians(10.5))


def test_a_file_is_read_by_its_ending(tmp_path: Path) -> None:
    path = tmp_path / "arm.json"
    path.write_text(json.dumps({"convention": "standard", "rows": ROWS}))
    table = read_table(path)
    assert [row.kind.value for row in table.rows] == ["revolute", "prismatic"]
    assert table.joint_names == ("joint_1", "joint_2")


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ({"rows": ROWS}, "does not name its convention"),
        ({"convention": "dh", "rows": ROWS}, "unknown convention: found 'dh'"),
        (
            {"convention": "standard", "rows": ROWS, "anlges": "degrees"},
            "unknown key in a table: found 'anlges'",
        ),
        ({"convention": "standard"}, "needs a list of rows"),
        (
            {"convention": "standard", "rows": [[1, 2, 3]]},
            r"row 1: a row must be a mapping or \[a, alpha, d, theta",
        ),
        (
            {"convention": "standard", "rows": [[0, 0, 0, 0, "X"]]},
            "row 1, kind: the kind of a row must be revolute, continuous or prismatic",
        ),
        ({"convention": "standard", "rows": [{"a": 0, "alhpa": 1}]}, "unknown key in a row: found 'alhpa'"),
        ({"convention": "standard", "rows": [{"a": "wide"}]}, "row 1, a: this is not a number: found 'wide'"),
        ({"convention": "standard", "rows": [{"a": 0, "sense": 0}]}, "`sense` must be"),
        (
            {"convention": "standard", "rows": ROWS, "base": [[1, 0], [0, 1]]},
            "base: the base must be a matrix of numbers, 4 x 4",
        ),
        ({"convention": "standard", "rows": ROWS, "tool": "none"}, "the tool must be a matrix of numbers"),
        ({"convention": "standard", "rows": [{"mimic": "j1"}]}, "`mimic` must have the form {leader"),
    ],
)
def test_an_inconsistent_table_says_where(data: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        table_from_mapping(data)


def test_a_broken_or_missing_file_is_named(tmp_path: Path) -> None:
    (tmp_path / "broken.toml").write_text("rows = [")
    with pytest.raises(InputError, match=r"broken.toml: not valid TOML"):
        read_table(tmp_path / "broken.toml")
    with pytest.raises(SourceError, match="cannot be read"):
        read_table(tmp_path / "missing.toml")
    (tmp_path / "arm.xls").write_text("")
    with pytest.raises(InputError, match=r"must have the suffix .toml, .json, .csv, .tsv"):
        read_table(tmp_path / "arm.xls")
    (tmp_path / "bad.toml").write_text('convention = "standard"\nrows = [["x", 0, 0, 0]]')
    with pytest.raises(InputError, match=r"bad.toml, row 1, a: this is not a number"):
        read_table(tmp_path / "bad.toml")
