"""An option that does nothing is an error, and a printed table says what its digits lose."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import urdfkin
from tests.cli.running import urdfkin as command
from urdfkin.dh import DHTable, Units, dh_table
from urdfkin.dh.parse_table import reference_path
from urdfkin.dh.printed import printed
from urdfkin.dh.units import Angles, Lengths
from urdfkin.errors import UnknownNameError
from urdfkin.urdf.xacro import arguments_of

CHOICES = (
    ("--snap", "1e-3"),
    ("--convention", "modified"),
    ("--near-parallel", "strict"),
    ("--last", "flange"),
    ("--parallel-offset", "each"),
    ("--flip", "nonsense"),
)
IDLE = [
    *(("ur5", "--compare", "ur5", *choice) for choice in CHOICES),
    *(("ur5", "--tree", *choice) for choice in CHOICES),
    ("ur5", "--compare", "ur5", "--no-verify"),
    ("ur5", "--compare", "ur5", "--format", "json", "--millimetres"),
    ("ur5", "--tree", "--base", "base"),
    ("ur5", "--tree", "--tip", "tool0"),
    ("ur5", "--tree", "--format", "csv", "--degrees"),
    ("ur5", "--all", "--tip", "tool0"),
    ("ur5", "--tolerance", "1"),
    ("ur5", "--no-fit"),
    ("ur5", "--format", "toml", "--digits", "5"),
    ("ur5", "--format", "c", "--degrees"),
    (str(reference_path("ur5")), "--no-mimic"),
    (str(reference_path("ur5")), "--root-joint", "floating"),
    (str(reference_path("ur5")), "--xacro-arg", "a:=1"),
]


@pytest.mark.parametrize("words", IDLE, ids=lambda words: " ".join(words[1:]))
def test_an_option_that_does_nothing_is_an_error(words: tuple[str, ...]) -> None:
    done = command("dh", *words)
    assert done.code == 2
    idle = next(word for word in reversed(words) if word.startswith("--"))
    assert re.search(rf"{idle}\S* does nothing .*; leave out this option", done.err)


def test_what_stands_at_its_default_is_not_refused() -> None:
    assert command("dh", "ur5", "--compare", "ur5", "--tolerance", "0.2").code == 0
    assert command("dh", "ur5", "--tree", "--digits", "10").code == 0


def test_a_seed_that_nothing_is_drawn_from_is_an_error() -> None:
    done = command("placement", "panda", "--seed", "3")
    assert done.code == 2
    assert "--seed does nothing without a random --q, --v or --a" in done.err
    assert command("placement", "panda", "--seed", "3", "--q", "random").code == 0


# -- xacro ----------------------------------------------------------------------------------------------

XACRO = """<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
<xacro:include filename="part.xacro"/>
<xacro:arg name="length" default="1"/><link name="a"/><link name="b"/>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/>
<origin xyz="$(arg length) $(arg width) 0"/><axis xyz="0 0 1"/></joint></robot>"""
PART = (
    """<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:arg name="colour" default="red"/></robot>"""
)


@pytest.fixture
def xacro(tmp_path: Path) -> Path:
    (tmp_path / "part.xacro").write_text(PART)
    file = tmp_path / "arm.xacro"
    file.write_text(XACRO)
    return file


def _nowhere(package: str) -> str:
    raise LookupError(package)


def test_declared_used_and_included_arguments_are_known(xacro: Path) -> None:
    assert arguments_of(xacro, _nowhere) == {"length", "width", "colour"}


def test_where_an_include_is_computed_nothing_is_known(xacro: Path) -> None:
    xacro.write_text(XACRO.replace("part.xacro", "$(arg width).xacro"))
    assert arguments_of(xacro, _nowhere) is None
    xacro.write_text(XACRO.replace("part.xacro", "missing.xacro"))
    assert arguments_of(xacro, _nowhere) is None


@pytest.mark.slow
def test_an_unknown_xacro_argument_is_an_error_that_names_the_known(xacro: Path) -> None:
    robot = urdfkin.load(xacro, xacro_args={"length": 2, "width": 3, "colour": "blue"})
    assert robot.placement([0.0], "b")[:2, 3].tolist() == [2.0, 3.0]
    with pytest.raises(UnknownNameError, match=r"unknown xacro argument 'lenght'; did you mean length"):
        urdfkin.load(xacro, xacro_args={"lenght": 2, "width": 1})
    done = command("info", str(xacro), "--xacro-arg", "width:=1", "--xacro-arg", "heihgt:=2")
    assert done.code == 2
    assert "unknown xacro argument 'heihgt'" in done.err


# -- digits ---------------------------------------------------------------------------------------------


def lost(text: str) -> tuple[float, float]:
    """Metres measured and guaranteed, as the line says."""
    line = next(line for line in text.splitlines() if line.startswith("printed with"))
    found = re.search(r"within (\S+) m of its exact .* proven within (\S+) m", line)
    assert found is not None
    return float(found[1]), float(found[2])


@pytest.mark.slow
@pytest.mark.parametrize("form", ["terminal", "markdown"])
@pytest.mark.parametrize("units", [(), ("--degrees", "--millimetres")])
def test_three_digits_are_said_to_lose_nearly_a_millimetre(form: str, units: tuple[str, ...]) -> None:
    done = command(
        "dh", "ur10", "--base", "base", "--tip", "tool0", "--digits", "3", "--format", form, *units
    )
    measured, guaranteed = lost(done.text)
    assert 5e-4 < measured <= guaranteed < 2e-3
    assert "Pinocchio" in done.text


def test_latex_says_it_on_stderr() -> None:
    done = command("dh", "ur10", "--base", "base", "--tip", "tool0", "--digits", "3", "--format", "latex")
    assert lost(done.err)[0] > 5e-4


def test_the_whole_tree_says_it_as_well() -> None:
    text = command("dh", "ur10", "--tree", "--digits", "3").text
    line = next(line for line in text.splitlines() if line.startswith("printed with 3 digits"))
    found = re.search(r"within (\S+) m", line)
    assert found is not None
    assert float(found[1]) > 5e-4


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ur10", "panda", "so101", "tiago", "romeo"])
@pytest.mark.parametrize("digits", [3, 5, 17])
@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_what_the_digits_lose_stays_within_what_is_guaranteed(
    name: str, digits: int, convention: str
) -> None:
    robot = urdfkin.load(name, verify=False)
    table = dh_table(robot.tree, robot.tip_frame, convention=convention)
    for units in (Units(digits=digits), Units(Angles.DEGREES, Lengths.MILLIMETRES, digits)):
        found = printed(table, units)
        assert found.bound is not None
        assert found.metres <= found.bound
        assert found.bound <= 100.0 * max(found.metres, 1e-15)
    if digits == 17:
        assert found.metres <= 1e-14


def test_the_loss_is_the_distance_to_the_table_that_the_text_says() -> None:
    """Cells as `--digits 3 --millimetres --degrees` prints them, typed in again."""
    robot = urdfkin.load("ur10")
    table = robot.dh("tool0", "base", snap=1e-6)
    typed = rows_of(command("dh", "ur10", "--base", "base", "--tip", "tool0", "--snap", "1e-6",
                            "--digits", "3", "--millimetres", "--degrees").text)  # fmt: skip
    again = replace(
        table,
        rows=tuple(
            replace(row, a=a / 1e3, alpha=math.radians(alpha), d=d / 1e3)
            for row, (a, alpha, d) in zip(table.rows, typed, strict=True)
        ),
    )
    found = printed(table, Units(Angles.DEGREES, Lengths.MILLIMETRES, 3))
    assert distance(again, table) == pytest.approx(found.metres, rel=0.05)


def rows_of(text: str) -> list[list[float]]:
    rows = [line.split() for line in text.splitlines() if re.match(r"\d  ", line)]
    return [[float(cell) for cell in row[2:5]] for row in rows]


def distance(one: DHTable, other: DHTable) -> float:
    q = np.random.default_rng(5).uniform(-math.pi, math.pi, (2000, len(one.joint_names)))
    return float(np.linalg.norm((one.placement(q) - other.placement(q))[:, :3, 3], axis=-1).max())
