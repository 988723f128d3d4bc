"""For a wrong sign, a wrong right angle or a wrong order of rows, the comparison names the correction."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.cli.test_dh import run
from tests.dh.arms import published, with_cells
from urdfkin.dh import DHTable, table_from_rows, units_of
from urdfkin.dh.compare import TableComparison, compare, document
from urdfkin.dh.convert import to_tree
from urdfkin.dh.parse_table import reference_path, references
from urdfkin.model.chain import chain

pytestmark = pytest.mark.slow

#: Tables that agree with the URDF without a fit. Kinova's table has other frames.
AS_WRITTEN = ("panda", "ur5", pytest.param("xarm7_standard", marks=pytest.mark.long))


def with_wrong_signs(table: DHTable) -> Iterator[tuple[int, str, DHTable]]:
    """Yield each table with one reversed sign that has an effect."""
    for i, row in enumerate(table.rows):
        for cell in ("a", "alpha", "d", "theta"):
            value = getattr(row, cell)
            if abs(value if cell in ("a", "d") else math.sin(value)) > 1e-9:
                yield i, cell, with_cells(table, i, **{cell: -value})


def named(found: TableComparison) -> list[tuple[int, str, float]]:
    cells = [one.cell for one in found.mistakes]
    return [(one.row, one.cell, one.urdf) for one in cells if one is not None]


@pytest.mark.parametrize("name", AS_WRITTEN)
def test_a_wrong_sign_is_named_alone(name: str) -> None:
    path, table = published(name)
    for row, cell, wrong in with_wrong_signs(table):
        found = compare(path, wrong)
        assert named(found) == [(row, cell, getattr(table.rows[row], cell))]
        assert found.mistakes[0].fitted.count == 0
        assert [(one.row, one.cell) for one in found.differences] == [(row, cell)]
        assert found.instead == ()
        assert not found.passes


@pytest.mark.parametrize("name", AS_WRITTEN)
def test_an_alpha_with_a_right_angle_too_many_is_named_alone(name: str) -> None:
    path, table = published(name)
    for row in range(len(table.rows)):
        alpha = table.rows[row].alpha
        found = compare(path, with_cells(table, row, alpha=alpha + math.pi / 2))
        assert [one[:2] for one in named(found)] == [(row, "alpha")]
        assert named(found)[0][2] == pytest.approx(alpha, abs=1e-15)
        assert not found.passes


@pytest.mark.parametrize("name", [pytest.param("kinova", marks=pytest.mark.long), "panda", "ur5"])
def test_exchanged_and_reversed_rows_are_named(name: str) -> None:
    path, table = published(name)
    last = len(table.rows) - 1
    for i, j in ((0, 1), (1, 2), (last - 1, last)):
        rows = list(table.rows)
        rows[i], rows[j] = rows[j], rows[i]
        found = compare(path, replace(table, rows=tuple(rows)))
        assert [(str(one.kind), one.rows) for one in found.mistakes] == [("rows exchanged", (i, j))]
    found = compare(path, replace(table, rows=tuple(reversed(table.rows))))
    assert [str(one.kind) for one in found.mistakes] == ["rows reversed"]
    assert "the rows in reverse order" in document(found, units_of()).text()


@pytest.mark.parametrize("name", references())
def test_a_correct_table_has_no_mistake(name: str) -> None:
    path, table = published(name)
    found = compare(path, table)
    assert found.mistakes == ()
    assert found.passes
    ends = compare(path, replace(table, base=np.eye(4), tool=np.eye(4)))
    assert (ends.mistakes, ends.passes) == ((), True)


@pytest.mark.long
def test_a_wrong_sign_in_a_table_without_the_tool_is_named() -> None:
    path, table = published("panda")
    bare = replace(table, tool=np.eye(4))
    for row, cell, wrong in with_wrong_signs(bare):
        found = compare(path, wrong)
        assert [one[:2] for one in named(found)] == [(row, cell)]
        assert str(found.mistakes[0].fitted) == "tool"


def test_a_table_in_other_frames_warns_that_a_fit_can_hide_a_wrong_sign() -> None:
    path, table = published("kinova")
    text = document(compare(path, table), units_of()).text()
    assert "These changes can hide a wrong sign." in text
    path, table = published("panda")
    assert "can hide" not in document(compare(path, replace(table, tool=np.eye(4))), units_of()).text()


def test_two_changes_that_explain_a_table_equally_well_are_both_named() -> None:
    rows = [[0.1, 0.5, 0.3, 0.0], [0.2, 0.0, 0.05, 0.0], [0.15, 0.9, 0.05, 0.0], [0.1, 0.4, 0.1, 0.0]]
    wrong = table_from_rows(rows, "standard")
    right = with_cells(wrong, 1, d=-0.05)  # along parallel axes, only the sum of the offsets matters
    found = compare(chain(to_tree(right), right.tip_frame, right.base_frame), wrong)
    assert [one[:2] for one in named(found)] == [(1, "d"), (2, "d")]
    assert found.differences == ()
    assert "Each of these changes makes the table right without a fit:" in document(found, units_of()).text()


def test_a_wrong_sign_is_named_despite_a_smaller_difference() -> None:
    """The calibration changes the tip by a millimetre, and the wrong sign by a hundred millimetres."""
    path, table = published("panda")
    near = with_cells(table, 6, a=table.rows[6].a + 1e-3)
    found = compare(path, with_cells(near, 3, a=-near.rows[3].a))
    assert not found.agrees
    assert [one[:2] for one in named(found)] == [(3, "a")]
    assert 5e-4 < found.mistakes[0].metres < 2e-3


def test_the_command_exits_with_1_for_a_wrong_sign_and_names_the_correction(tmp_path: Path) -> None:
    file = tmp_path / "mistake.toml"
    text = reference_path("ur5").read_text()
    file.write_text(text.replace("d = 0.10915", "d = -0.10915"))
    result = run("ur5", "--compare", str(file), "--millimetres")
    assert result.code == 1
    assert "agrees only after a fit of base, tool and joint offsets" in result.text
    assert "One change makes the table right without a fit:" in result.text
    assert "  row 4, wrist_1_joint: d = 109.15 mm, not -109.15 (its sign)" in result.text
    data = json.loads(run("ur5", "--compare", str(file), "--format", "json").text)
    assert data["agrees"]
    assert not data["passes"]
    assert data["likely_mistakes"][0]["cell"]["urdf"] == 0.10915
    without = run("ur5", "--compare", str(file), "--no-fit")
    assert without.code == 1
    assert "One change makes the table right without a fit:" in without.text
