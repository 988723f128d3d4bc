"""A comparison states the fitted parameters, the cells not compared, and the error of a wrong cell."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import urdfkin
from tests.cli.running import good
from tests.cli.running import urdfkin as command
from tests.dh.arms import CONVENTIONS, published, with_cells
from urdfkin.dh import make_dh_table, parse_units
from urdfkin.dh.compare import compare, comparison_document
from urdfkin.dh.convert import to_tree
from urdfkin.dh.parse_table import parse_table_data, read_mapping, reference_path
from urdfkin.dh.rows import half_digits_by_row
from urdfkin.kinematics.rotation import exp_rotation
from urdfkin.model.chain import make_chain
from urdfkin.model.tree import KinematicTree

pytestmark = pytest.mark.long


def with_ends(name: str) -> tuple[urdfkin.Robot, str, str]:
    robot = urdfkin.load(name)
    return (robot, "base", "tool0") if name == "ur5" else (robot, robot.base_frame, robot.tip_frame)


def test_a_wrong_d1_is_reported_in_millimetres_with_and_without_a_fit() -> None:
    path, table = published("ur5")
    wrong = with_cells(table, 0, d=table.rows[0].d + 0.01)
    found = compare(path, wrong)
    assert found.agrees  # the table agrees after a fit of the base
    assert not found.is_exact_unfitted
    assert found.unfitted_metres == pytest.approx(0.01, rel=1e-6)
    assert found.base.metres == pytest.approx(0.01, rel=1e-6)
    assert (0, "d") in found.not_compared
    text = comparison_document(found, parse_units("radians", "millimetres")).text()
    assert "very cell" not in text
    assert "after a fit of base, tool and joint offsets" in text
    assert "changed the base by 10 mm" in text
    assert "has the same effect: d1" in text
    assert [(one.row, one.cell) for one in found.unfitted_differences] == [(0, "d")]
    assert found.unfitted_differences[0].difference == pytest.approx(-0.01, rel=1e-6)
    found = compare(path, wrong, fit=False)
    assert not found.agrees
    assert [(one.row, one.cell) for one in found.differences] == [(0, "d")]
    assert found.differences[0].difference == pytest.approx(-0.01, rel=1e-6)
    assert found.residual <= 1e-12


CELLS = [(0, "d"), (0, "theta"), (2, "theta"), (3, "d"), (1, "a"), (5, "d")]


@pytest.mark.parametrize("convention", CONVENTIONS)
@pytest.mark.parametrize(("row", "cell"), CELLS)
def test_without_fitting_every_wrong_cell_differs(convention: str, row: int, cell: str) -> None:
    path, _ = published("ur5")
    table = make_dh_table(urdfkin.load("ur5").tree, "tool0", "base", convention, snap=1e-6)
    assert compare(path, table, fit=False).agrees
    wrong = with_cells(table, row, **{cell: getattr(table.rows[row], cell) + 3e-3})
    found = compare(path, wrong, fit=False)
    assert not found.agrees
    assert found.metres > 1e-3 or found.radians > 1e-3


def test_every_cell_agrees_only_for_a_table_that_is_the_urdf_as_written() -> None:
    robot, ends = urdfkin.load("panda"), ("panda_link8", "panda_link0")
    table, path = robot.dh(*ends), robot.chain(*ends)
    found = compare(path, table)
    assert found.is_exact_unfitted
    assert "Every cell agrees with the URDF." in comparison_document(found, parse_units()).text()
    assert found.base.metres == found.base.radians == found.tool.metres == found.tool.radians == 0.0
    tool = np.array(table.tool)
    tool[:3, :3] = tool[:3, :3] @ exp_rotation(np.array([0.0, 0.0, 0.5]))
    found = compare(path, replace(table, tool=tool), fit=False)
    assert found.metres <= 1e-12
    assert not found.agrees


def test_cells_that_do_not_explain_the_difference_are_not_listed() -> None:
    found = compare(*published("kinova"), fit=False)
    assert not found.agrees
    assert found.differences == ()
    text = comparison_document(found, parse_units()).text()
    assert "No change of cells explains the whole difference" in text
    assert "Omit --no-fit" in text


def calibrated(tree: KinematicTree, seed: int, radians: float = 3e-4, metres: float = 2e-4) -> KinematicTree:
    rng, joints = np.random.default_rng(seed), []
    for joint in tree.joints:
        T = np.array(joint.T_parent_joint)
        if joint.kind.has_axis:
            T[:3, :3] = T[:3, :3] @ exp_rotation(radians * rng.normal(size=3))
            T[:3, 3] += metres * rng.normal(size=3)
        joints.append(replace(joint, T_parent_joint=T))
    return replace(tree, joints=tuple(joints))


CALIBRATED = [(name, seed) for name in ("ur5", "kinova") for seed in range(3)]


@pytest.mark.parametrize(("name", "seed"), CALIBRATED)
def test_a_calibrated_table_differs_about_equally_in_strict_and_hayati_form(name: str, seed: int) -> None:
    robot, base, tip = with_ends(name)
    tree, path = calibrated(robot.tree, seed), robot.chain(tip, base)
    forms = (make_dh_table(tree, tip, base, near_parallel=form) for form in ("hayati", "strict"))
    hayati, strict = (compare(path, table).metres for table in forms)
    assert 1e-4 < hayati < 3e-3
    assert strict <= 1.5 * hayati


@pytest.mark.parametrize(("name", "seed"), CALIBRATED)
def test_no_cell_of_a_nominal_table_has_a_far_larger_effect_than_the_tip_error(name: str, seed: int) -> None:
    robot, base, tip = with_ends(name)
    nominal = make_dh_table(robot.tree, tip, base, snap=1e-4)
    strict = make_dh_table(calibrated(robot.tree, seed), tip, base, near_parallel="strict")
    assert max(abs(row.d) for row in strict.rows) > 100.0
    found = compare(make_chain(to_tree(strict), tip, base), nominal)
    assert found.metres < 3e-3
    assert found.differences[0].tip_displacement <= 2.0 * found.metres
    assert found.residual <= 1e-9


def test_cells_that_differ_are_sorted_by_the_effect_on_the_tip() -> None:
    table = make_dh_table(calibrated(urdfkin.load("ur5").tree, 1), "tool0", "base")
    effects = [one.tip_displacement for one in compare(published("ur5")[0], table).differences]
    assert len(effects) > 5
    assert effects == sorted(effects, reverse=True)


@pytest.mark.parametrize(
    ("written", "is_rounding"), [("0.095", True), ("0.0947", True), ("0.0950", False), ("0.09480", False)]
)
@pytest.mark.parametrize("suffix", [".toml", ".json", ".csv"])
def test_a_difference_within_the_last_digit_is_distinguished_from_a_larger_one(
    written: str, is_rounding: bool, suffix: str, tmp_path: Path
) -> None:
    """The cell d5 of the UR5 is 0.09465."""
    lines = (
        "0,pi/2,0.089159,0", "-0.425,0,0,0", "-0.39225,0,0,0", "0,pi/2,0.10915,0", f"0,-pi/2,{written},0",
        "0,0,0.0823,0",
    )  # fmt: skip
    rows = ", ".join(f"[{re.sub('-?pi/2', lambda x: repr(x[0]), line)}]".replace("'", '"') for line in lines)
    file = tmp_path / f"sheet{suffix}"
    file.write_text({
        ".toml": f'convention = "standard"\nrows = [{rows}]',
        ".json": f'{{"convention": "standard", "rows": [{rows}]}}',
        ".csv": "\n".join(["# convention: standard", "a,alpha,d,theta", *lines]),
    }[suffix])  # fmt: skip
    data = read_mapping(file)
    found = compare(
        published("ur5")[0], parse_table_data(data, "sheet"), half_digits=half_digits_by_row(data)
    )
    largest = found.differences[0]
    assert (largest.row, largest.cell) == (4, "d")
    assert largest.is_rounding == is_rounding
    assert ("within the last digit" in comparison_document(found, parse_units()).text()) == is_rounding


def test_the_dh_command_marks_rounded_cells_and_has_the_option_no_fit(tmp_path: Path) -> None:
    done = command("dh kinova --compare kinova")
    assert "The difference is within the last digit of the table (*)." in done.text
    data = command("dh kinova --compare kinova --format json").data
    assert [one["within_last_digit"] for one in data["differences"]] == [True]
    file = tmp_path / "wrong.toml"
    file.write_text(reference_path("ur5").read_text().replace("0.089159", "0.099159"))
    fitted = good("dh ur5 --compare", str(file))
    assert "Every cell" not in fitted.text
    assert "10 mm" in fitted.text
    assert command("dh ur5 --compare", str(file), "--no-fit").code == 1
    assert command("dh ur5 --compare ur5 --no-fit").code == 0
