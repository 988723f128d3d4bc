"""A table has the robot's poses up to rounding, or states its error; an option without effect is an error."""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import urdfkin
from tests.cli.running import good, refused
from tests.cli.running import urdfkin as command
from tests.dh.arms import arm, with_cells
from tests.random_chains import rotation, shift
from tests.reading import present
from tests.urdfs import built, joint, limit, mimic, robot
from urdfkin.dh import DHTable, Units, export, make_dh_table
from urdfkin.dh.export.text import measure_printed_table
from urdfkin.dh.parse_table import reference_path
from urdfkin.dh.snapping import find_noisy_cells
from urdfkin.dh.units import AngleUnit, LengthUnit
from urdfkin.errors import UnknownNameError
from urdfkin.kinematics.roundings import EPS
from urdfkin.model.chain import make_chain
from urdfkin.model.tree import FloatArray, JointKind, KinematicTree, Mimic
from urdfkin.urdf.writer import to_urdf
from urdfkin.urdf.xacro import find_arguments
from urdfkin.verify.tables import TableCheck, TableError

#: A right angle with twelve digits, an error of 2.07e-13 rad; the parallel axes are 0.1 m apart.
TWELVE_DIGITS = math.pi - 3.14159265359


def leaning(tilt: float) -> KinematicTree:
    """Return an arm of four joints; the axes of joints 2 and 3 are parallel except for a tilt."""
    return arm(
        shift(0, 0, 0.3),
        shift(0.05, 0.02, 0.1) @ rotation("x", math.pi / 2),
        shift(0.4, 0.1, 0.1) @ rotation("y", tilt),
        shift(0.2, -0.2, 0.1) @ rotation("x", math.pi / 2),
        tip=shift(0.1, 0, 0.08),
    )


def text_of(tree: KinematicTree) -> str:
    """Return the URDF of an arm without joint limits."""
    joints = (replace(one, kind=JointKind.CONTINUOUS) if one.kind.turns else one for one in tree.joints)
    return to_urdf(replace(tree, joints=tuple(joints)))


def robot_of(tree: KinematicTree) -> urdfkin.Robot:
    return urdfkin.load(text_of(tree))


def checked(robot: urdfkin.Robot, table: DHTable) -> TableCheck:
    return present(robot.verifier.check_table(table))


def test_a_strict_table_with_a_large_rounding_error_reports_the_error_in_millimetres() -> None:
    robot = robot_of(leaning(TWELVE_DIGITS))
    with pytest.warns(urdfkin.NotVerifiedWarning, match=r"LOSES .* mm .* use --snap 1e-12"):
        table = robot.dh("tip", "l0", near_parallel="strict")
    with pytest.warns(urdfkin.NotVerifiedWarning):
        check = checked(robot, table)
    longest = max(max(abs(row.a), abs(row.d)) for row in table.rows)
    assert longest > 1e11
    assert not check.is_within_bounds
    assert check.agrees
    predicted = f"which rounds by {EPS * longest * 1e3:.2g} mm"
    assert predicted in str(check)
    assert 1e-3 * EPS * longest <= check.metres <= 100.0 * EPS * longest


def test_a_table_with_a_very_large_mimic_multiplier_reports_the_rounding_of_the_angle() -> None:
    motor = joint("motor", "revolute", "l0", "l1", "", "0 0 1", limit(-3, 3))
    pose = 'xyz="1 0.5 0" rpy="0.3 0.4 0.7"'
    gear = joint("gear", "revolute", "l1", "l2", pose, "0 0 1", limit(-3, 3) + mimic("motor", 1e16, 0.3))
    tip = joint("end", "fixed", "l2", "l3", 'xyz="0.5 0 0"')
    with pytest.warns(urdfkin.NotVerifiedWarning, match=r"LOSES .* gear turns by up to 3e\+16 rad"):
        built(motor, gear, tip).dh("l3", "l0")


def test_an_inexact_strict_table_exits_with_3_and_the_hayati_or_snapped_table_with_0() -> None:
    text, line = text_of(leaning(TWELVE_DIGITS)), "dh - --base l0 --tip tip"
    lossy = command(f"{line} --near-parallel strict", stdin=text)
    assert lossy.code == 3
    assert "agrees" not in lossy.text
    assert "LOSES" in lossy.text
    good(line, stdin=text)
    good(f"{line} --near-parallel strict --snap 1e-12", stdin=text)


def test_a_wrong_strict_table_with_very_long_rows_is_a_disagreement() -> None:
    robot = robot_of(leaning(TWELVE_DIGITS))
    table = make_dh_table(robot.tree, "tip", "l0", near_parallel="strict")
    with pytest.raises(TableError, match="DISAGREES"):
        robot.verifier.check_table(with_cells(table, 0, alpha=table.rows[0].alpha + 1e-3))


def rack(multiplier: float) -> str:
    """Return a prismatic joint, a revolute joint that mimics it, and another revolute joint, all oblique."""
    origin, follows = 'xyz="0.1 0.2 0.3" rpy="{} 0.4 0.5"', mimic("rack", multiplier) + limit(-100000, 100000)
    return robot(
        joint("rack", "prismatic", "a", "b", origin.format(0.3), "0.6 0 0.8", limit()),
        joint("pinion", "revolute", "b", "c", origin.format(1.3), "0.6 0 0.8", follows),
        joint("j", "continuous", "c", "d", 'xyz="0.4 0.1 0.3" rpy="1.3 0.4 0.5"', "0 0.6 0.8"),
        name="rack",
    )


@pytest.mark.slow
@pytest.mark.parametrize("multiplier", [1, 30, 1000, 1e5])
@pytest.mark.parametrize("ends", [("d", "a"), ("a", "d"), ("d", "b")])
def test_a_correct_table_of_a_rack_and_pinion_agrees_for_every_multiplier(
    multiplier: float, ends: tuple[str, str]
) -> None:
    found = urdfkin.load(rack(multiplier))
    for convention in ("standard", "modified"):
        assert checked(found, found.dh(*ends, convention)).is_within_bounds


@pytest.mark.parametrize("multiplier", [30, 1000])
def test_a_wrong_multiplier_in_a_table_is_detected(multiplier: float) -> None:
    found = urdfkin.load(rack(multiplier))
    table = found.dh("d", "a")
    wrong = Mimic("rack", multiplier * (1.0 + 1e-9), 0.0)
    with pytest.raises(TableError, match="DISAGREES"):
        found.verifier.check_table(with_cells(table, 1, mimic=wrong))


# -- noise ----------------------------------------------------------------------------------------------


def plain_table(near_parallel: str, *steps: FloatArray) -> DHTable:
    """Demand a table without beta and without kilometres that has the robot's poses up to rounding."""
    last = shift(0.1, 0.3, 0.2) @ rotation("x", math.pi / 2)
    robot = robot_of(arm(shift(0, 0, 0.3), *steps, last, tip=shift(0.1, 0, 0.08)))
    table = robot.dh("tip", "l0", near_parallel=near_parallel)
    assert not table.has_hayati_rows
    assert max(max(abs(row.a), abs(row.d)) for row in table.rows) < 2.0
    assert checked(robot, table).is_within_bounds
    return table


@pytest.mark.parametrize("angle", [1.5707963267949, 1.570796326794897, 1.57079632679489661923])
@pytest.mark.parametrize("near_parallel", ["hayati", "strict"])
def test_an_angle_with_fourteen_digits_causes_neither_beta_nor_long_rows(
    angle: float, near_parallel: str
) -> None:
    step, back, forth = shift(0.4, 0.1, 0.1), rotation("y", angle), rotation("y", -math.pi / 2)
    table = plain_table(near_parallel, step @ back @ forth, step @ forth @ back)
    assert "roboticstoolbox" in export(table, "roboticstoolbox")


@pytest.mark.parametrize("near_parallel", ["hayati", "strict"])
def test_a_tilt_by_two_angles_of_fifteen_digits_is_treated_as_rounding(near_parallel: str) -> None:
    half = 3.14159265358979
    tilted = shift(0.4, 0.1, 0.1) @ rotation("x", half) @ rotation("y", half)
    assert tilted[0, 2] != 0.0
    plain_table(near_parallel, tilted)


@pytest.mark.parametrize("tilt", [1e-13, 1e-12, 1e-9])
def test_a_tilt_larger_than_rounding_gives_hayati_rows(tilt: float) -> None:
    tree = leaning(tilt)
    table = make_dh_table(tree, "tip", "l0")
    assert table.has_hayati_rows
    q = np.random.default_rng(0).uniform(-3, 3, (50, 4))
    assert np.abs(table.placement(q) - make_chain(tree, "tip").placement(q)).max() <= 20 * EPS


@pytest.mark.slow
def test_the_strict_table_of_so101_is_short_and_baxter_gets_a_hint_to_snap() -> None:
    robot = urdfkin.load("so101")
    table = robot.dh(near_parallel="strict")
    assert checked(robot, table).is_within_bounds
    assert max(abs(row.d) for row in table.rows) < 1.0
    hint = next(line for line in good("dh baxter").text.splitlines() if line.startswith("hint: "))
    assert "--snap 1e-11" in hint
    assert find_noisy_cells(urdfkin.load("baxter").dh(snap=1e-11)) == []
    assert "--snap" not in command("dh baxter --snap 1e-11").text


@pytest.mark.parametrize("name", ["panda", "elbow"])
def test_a_table_without_noisy_cells_gets_no_hint_to_snap(name: str) -> None:
    assert "--snap" not in command("dh", name).text


# -- options ---------------------------------------------------------------------------------------

IDLE = [
    *(
        f"ur5 {idle} {choice}"
        for idle in ("--compare ur5", "--tree")
        for choice in (
            "--snap 1e-3", "--convention modified", "--near-parallel strict", "--last flange",
            "--parallel-offset each", "--flip nonsense",
        )
    ),
    "ur5 --compare ur5 --no-verify", "ur5 --compare ur5 --format json --millimetres",
    "ur5 --tree --base base", "ur5 --tree --tip tool0", "ur5 --tree --format csv --degrees",
    "ur5 --all --tip tool0", "ur5 --tolerance 1", "ur5 --no-fit", "ur5 --format toml --digits 5",
    "ur5 --format c --degrees", "TABLE --no-mimic", "TABLE --root-joint floating", "TABLE --xacro-arg a:=1",
]  # fmt: skip


@pytest.mark.parametrize("line", IDLE)
def test_an_option_without_effect_is_an_error(line: str) -> None:
    err = refused("dh", *line.replace("TABLE", str(reference_path("ur5"))).split())
    idle = next(word for word in reversed(line.split()) if word.startswith("--"))
    assert re.search(rf"{idle}\S* does nothing .*; leave out this option", err)


def test_an_option_with_the_default_value_is_accepted_and_a_seed_without_effect_is_refused() -> None:
    for line in ("dh ur5 --compare ur5 --tolerance 0.2", "dh ur5 --tree --digits 10"):
        good(line)
    assert "--seed does nothing without a random --q, --v or --a" in refused("placement panda --seed 3")
    good("placement panda --seed 3 --q random")


# -- xacro ----------------------------------------------------------------------------------------------

XMLNS = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
XACRO = robot(
    '<xacro:include filename="part.xacro"/><xacro:arg name="length" default="1"/>',
    joint("j", "continuous", "a", "b", 'xyz="$(arg length) $(arg width) 0"'),
    attributes=XMLNS,
)
PART = f'<robot {XMLNS}><xacro:arg name="colour" default="red"/></robot>'


@pytest.fixture
def xacro(tmp_path: Path) -> Path:
    (tmp_path / "part.xacro").write_text(PART)
    file = tmp_path / "arm.xacro"
    file.write_text(XACRO)
    return file


def test_all_xacro_arguments_are_found_unless_an_include_is_computed_or_missing(xacro: Path) -> None:
    def nowhere(package: str) -> str:
        raise LookupError(package)

    assert find_arguments(xacro, nowhere) == {"length", "width", "colour"}
    for file in ("$(arg width).xacro", "missing.xacro"):
        xacro.write_text(XACRO.replace("part.xacro", file))
        assert find_arguments(xacro, nowhere) is None


@pytest.mark.slow
def test_an_unknown_xacro_argument_is_an_error_that_names_the_similar_one(xacro: Path) -> None:
    robot = urdfkin.load(xacro, xacro_args={"length": 2, "width": 3, "colour": "blue"})
    assert robot.placement([0.0], "b")[:2, 3].tolist() == [2.0, 3.0]
    with pytest.raises(UnknownNameError, match=r"unknown xacro argument 'lenght'; did you mean length"):
        urdfkin.load(xacro, xacro_args={"lenght": 2, "width": 1})
    assert "unknown xacro argument 'heihgt'" in refused(
        "info", str(xacro), "--xacro-arg", "width:=1", "--xacro-arg", "heihgt:=2"
    )


# -- digits ---------------------------------------------------------------------------------------------


def lost(text: str) -> tuple[float, ...]:
    """Return the measured and, except for a tree, the guaranteed error (m) of a printed line."""
    (line,) = (line for line in text.splitlines() if line.startswith("printed with 3 digits"))
    of_a_table = re.search(r"within (\S+) m of its exact .* the proven bound is (\S+) m", line)
    return tuple(map(float, present(of_a_table or re.search(r"within (\S+) m", line)).groups()))


THREE_DIGITS = "dh ur10 --base base --tip tool0 --digits 3"


@pytest.mark.slow
@pytest.mark.parametrize("form", ["terminal", "markdown"])
@pytest.mark.parametrize("units", ["", " --degrees --millimetres"])
def test_a_table_with_three_digits_states_a_rounding_error_of_nearly_a_millimetre(
    form: str, units: str
) -> None:
    done = command(f"{THREE_DIGITS} --format {form}{units}")
    measured, guaranteed = lost(done.text)
    assert 5e-4 < measured <= guaranteed < 2e-3
    assert "Pinocchio" in done.text


def test_the_rounding_error_is_printed_on_stderr_for_latex_and_for_the_whole_tree() -> None:
    assert lost(command(f"{THREE_DIGITS} --format latex").err)[0] > 5e-4
    assert lost(command("dh ur10 --tree --digits 3").text)[0] > 5e-4


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ur10", "panda", "so101", "tiago", "romeo"])
@pytest.mark.parametrize("digits", [3, 5, 17])
@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_the_rounding_error_of_printed_digits_is_within_the_stated_bound(
    name: str, digits: int, convention: str
) -> None:
    robot = urdfkin.load(name, verify=False)
    table = make_dh_table(robot.tree, robot.tip_frame, convention=convention)
    for units in (Units(digits=digits), Units(AngleUnit.DEGREES, LengthUnit.MILLIMETRES, digits)):
        found = measure_printed_table(table, units)
        assert found.bound is not None
        assert found.metres <= found.bound
        assert found.bound <= 100.0 * max(found.metres, 1e-15)
    if digits == 17:
        assert found.metres <= 1e-14


def test_the_stated_rounding_error_is_the_distance_to_the_printed_table() -> None:
    """The table is parsed from the output of `--digits 3 --millimetres --degrees`."""
    table = urdfkin.load("ur10").dh("tool0", "base", snap=1e-6)
    text = command("dh ur10 --base base --tip tool0 --snap 1e-6 --digits 3 --millimetres --degrees").text
    lines = [line.split() for line in text.splitlines() if re.match(r"\d  ", line)]
    typed = [[float(cell) for cell in line[2:5]] for line in lines]
    rows = (
        replace(row, a=a / 1e3, alpha=math.radians(alpha), d=d / 1e3)
        for row, (a, alpha, d) in zip(table.rows, typed, strict=True)
    )
    again = replace(table, rows=tuple(rows))
    found = measure_printed_table(table, Units(AngleUnit.DEGREES, LengthUnit.MILLIMETRES, 3))
    q = np.random.default_rng(5).uniform(-math.pi, math.pi, (2000, len(table.joint_names)))
    apart = np.linalg.norm((again.placement(q) - table.placement(q))[:, :3, 3], axis=-1)
    assert apart.max() == pytest.approx(found.metres, rel=0.05)
