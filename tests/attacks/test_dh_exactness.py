"""A table is the robot to rounding of the robot, or it says by how many millimetres it is not."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import urdfkin
from tests.cli.running import urdfkin as command
from tests.dh.arms import arm
from tests.random_chains import rotation, shift
from urdfkin.dh import DHTable, dh_table, export
from urdfkin.dh.snapping import noisy_cells
from urdfkin.kinematics.roundings import EPS
from urdfkin.model.chain import chain
from urdfkin.model.tree import JointKind, KinematicTree, Mimic
from urdfkin.urdf.writer import to_urdf
from urdfkin.verify.tables import TableCheck, TableError

#: A file that writes a right angle with twelve digits: 2.07e-13 rad off, between parallel axes 0.1 m apart.
TWELVE_DIGITS = math.pi - 3.14159265359


def leaning(tilt: float) -> KinematicTree:
    """Four joints, the second and third parallel but for a tilt across their offset."""
    return arm(
        shift(0, 0, 0.3),
        shift(0.05, 0.02, 0.1) @ rotation("x", math.pi / 2),
        shift(0.4, 0.1, 0.1) @ rotation("y", tilt),
        shift(0.2, -0.2, 0.1) @ rotation("x", math.pi / 2),
        tip=shift(0.1, 0, 0.08),
    )


def text_of(tree: KinematicTree) -> str:
    """The URDF of an arm, its joints without limits."""
    return to_urdf(
        replace(
            tree,
            joints=tuple(
                replace(joint, kind=JointKind.CONTINUOUS) if joint.kind.turns else joint
                for joint in tree.joints
            ),
        )
    )


def robot_of(tree: KinematicTree) -> urdfkin.Robot:
    return urdfkin.load(text_of(tree))


def checked(robot: urdfkin.Robot, table: DHTable) -> TableCheck:
    check = robot.verifier.table(table)
    assert check is not None
    return check


def test_a_strict_table_that_loses_more_than_the_robots_rounding_says_how_many_millimetres() -> None:
    robot = robot_of(leaning(TWELVE_DIGITS))
    with pytest.warns(urdfkin.NotVerifiedWarning, match=r"LOSES .* mm .* use --snap 1e-12"):
        table = robot.dh("tip", "l0", near_parallel="strict")
    with pytest.warns(urdfkin.NotVerifiedWarning):
        check = checked(robot, table)
    longest = max(max(abs(row.a), abs(row.d)) for row in table.rows)
    assert longest > 1e11
    assert not check.within
    assert check.agrees
    predicted = f"which rounds by {EPS * longest * 1e3:.2g} mm"
    assert predicted in str(check)
    assert 1e-3 * EPS * longest <= check.metres <= 100.0 * EPS * longest


def test_such_a_table_exits_3_and_its_hayati_form_and_its_snapped_form_exit_0() -> None:
    text = text_of(leaning(TWELVE_DIGITS))
    ends = ("--base", "l0", "--tip", "tip")
    lossy = command("dh", "-", *ends, "--near-parallel", "strict", stdin=text)
    assert lossy.code == 3
    assert "agrees" not in lossy.text
    assert "LOSES" in lossy.text
    assert command("dh", "-", *ends, stdin=text).code == 0
    assert command("dh", "-", *ends, "--near-parallel", "strict", "--snap", "1e-12", stdin=text).code == 0


def test_a_wrong_strict_table_is_a_disagreement_however_long_its_rows_are() -> None:
    robot = robot_of(leaning(TWELVE_DIGITS))
    table = dh_table(robot.tree, "tip", "l0", near_parallel="strict")
    rows = list(table.rows)
    rows[0] = replace(rows[0], alpha=rows[0].alpha + 1e-3)
    with pytest.raises(TableError, match="DISAGREES"):
        robot.verifier.table(replace(table, rows=tuple(rows)))


RACK = """<robot name="rack"><link name="a"/><link name="b"/><link name="c"/><link name="d"/>
<joint name="rack" type="prismatic"><parent link="a"/><child link="b"/>
 <origin xyz="0.1 0.2 0.3" rpy="0.3 0.4 0.5"/><axis xyz="0.6 0 0.8"/>
 <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="pinion" type="revolute"><parent link="b"/><child link="c"/>
 <origin xyz="0.1 0.2 0.3" rpy="1.3 0.4 0.5"/><axis xyz="0.6 0 0.8"/>
 <limit lower="-100000" upper="100000" effort="1" velocity="1"/><mimic joint="rack" multiplier="{m}"/></joint>
<joint name="j" type="continuous"><parent link="c"/><child link="d"/>
 <origin xyz="0.4 0.1 0.3" rpy="1.3 0.4 0.5"/><axis xyz="0 0.6 0.8"/></joint></robot>"""


@pytest.mark.slow
@pytest.mark.parametrize("multiplier", [1, 30, 1000, 1e5])
@pytest.mark.parametrize("ends", [("d", "a"), ("a", "d"), ("d", "b")])
def test_a_right_table_of_a_rack_and_pinion_is_right_whatever_the_multiplier(
    multiplier: float, ends: tuple[str, str]
) -> None:
    robot = urdfkin.load(RACK.format(m=multiplier))
    for convention in ("standard", "modified"):
        check = checked(robot, robot.dh(*ends, convention))
        assert check.within


@pytest.mark.parametrize("multiplier", [30, 1000])
def test_a_wrong_multiplier_in_a_table_is_still_found(multiplier: float) -> None:
    robot = urdfkin.load(RACK.format(m=multiplier))
    table = robot.dh("d", "a")
    wrong = Mimic("rack", multiplier * (1.0 + 1e-9), 0.0)
    rows = (table.rows[0], replace(table.rows[1], mimic=wrong), table.rows[2])
    with pytest.raises(TableError, match="DISAGREES"):
        robot.verifier.table(replace(table, rows=rows))


# -- noise ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("angle", [1.5707963267949, 1.570796326794897, 1.57079632679489661923])
@pytest.mark.parametrize("near_parallel", ["hayati", "strict"])
def test_an_angle_written_with_fourteen_digits_gets_no_beta_and_no_kilometres(
    angle: float, near_parallel: str
) -> None:
    back, forth = rotation("y", angle), rotation("y", -math.pi / 2)
    tree = arm(
        shift(0, 0, 0.3),
        shift(0.4, 0.1, 0.1) @ back @ forth,
        shift(0.4, 0.1, 0.1) @ forth @ back,
        shift(0.1, 0.3, 0.2) @ rotation("x", math.pi / 2),
        tip=shift(0.1, 0, 0.08),
    )
    robot = robot_of(tree)
    table = robot.dh("tip", "l0", near_parallel=near_parallel)
    assert not table.has_hayati_rows
    assert max(max(abs(row.a), abs(row.d)) for row in table.rows) < 2.0
    assert checked(robot, table).within
    assert "roboticstoolbox" in export(table, "roboticstoolbox")


@pytest.mark.parametrize("near_parallel", ["hayati", "strict"])
def test_two_angles_of_fifteen_digits_that_tilt_together_are_rounding(near_parallel: str) -> None:
    half = 3.14159265358979
    tree = arm(
        shift(0, 0, 0.3),
        shift(0.4, 0.1, 0.1) @ rotation("x", half) @ rotation("y", half),
        shift(0.1, 0.3, 0.2) @ rotation("x", math.pi / 2),
        tip=shift(0.1, 0, 0.08),
    )
    robot = robot_of(tree)
    assert chain(tree, "tip").constants[1][0, 2] != 0.0
    table = robot.dh("tip", "l0", near_parallel=near_parallel)
    assert not table.has_hayati_rows
    assert max(max(abs(row.a), abs(row.d)) for row in table.rows) < 2.0
    assert checked(robot, table).within


@pytest.mark.parametrize("tilt", [1e-13, 1e-12, 1e-9])
def test_a_tilt_that_is_no_rounding_is_kept(tilt: float) -> None:
    tree = leaning(tilt)
    table = dh_table(tree, "tip", "l0")
    assert table.has_hayati_rows
    q = np.random.default_rng(0).uniform(-3, 3, (50, 4))
    error = np.abs(table.placement(q) - chain(tree, "tip").placement(q)).max()
    assert error <= 20 * EPS


def test_so101_has_no_foot_at_the_inverse_of_rounding() -> None:
    robot = urdfkin.load("so101")
    table = robot.dh(near_parallel="strict")
    assert checked(robot, table).within
    assert max(abs(row.d) for row in table.rows) < 1.0


@pytest.mark.slow
def test_a_table_with_cells_of_rounded_angles_recommends_the_snap_that_cures_it() -> None:
    done = command("dh", "baxter")
    assert done.code == 0
    hint = next(line for line in done.text.splitlines() if line.startswith("hint: "))
    assert "--snap 1e-11" in hint
    snapped = urdfkin.load("baxter").dh(snap=1e-11)
    assert noisy_cells(snapped) == []
    assert "--snap" not in command("dh", "baxter", "--snap", "1e-11").text


@pytest.mark.parametrize("name", ["panda", "elbow"])
def test_a_clean_table_gets_no_hint_at_snapping(name: str) -> None:
    assert "--snap" not in command("dh", name).text
