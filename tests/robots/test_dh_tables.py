"""Tables of the catalogue's robots have Pinocchio's motion and the vendors' cells."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.dh.arms import published
from tests.reading import present
from urdfkin.dh import read_table
from urdfkin.dh.common_normals import sum_zeroed_tilts
from urdfkin.dh.compare import compare
from urdfkin.dh.make import make_dh_table
from urdfkin.dh.parse_table import published_tables, reference_path
from urdfkin.errors import UnknownNameError
from urdfkin.kinematics.roundings import EPS
from urdfkin.robot.loading import load
from urdfkin.urdf.catalogue import example_robot_data_names


@pytest.mark.slow
@pytest.mark.parametrize("convention", ["standard", "modified"])
@pytest.mark.parametrize("name", example_robot_data_names())
def test_the_table_of_every_path_to_a_leaf_agrees_with_pinocchio_and_has_no_long_row(
    name: str, convention: str
) -> None:
    robot = load(name)
    root = robot.tree.links[0]
    for leaf in robot.tree.leaves():
        tip = robot.tree.links[leaf]
        table = make_dh_table(robot.tree, tip, root, convention)
        check = present(robot.verifier.check_table(table, samples=10))
        assert check.agrees
        assert max(check.units.values()) <= 20.0 + sum_zeroed_tilts(robot.chain(tip, root)) / EPS
        reach = float(robot.chain(tip, root).lengths.sum())
        assert all(max(abs(row.a), abs(row.d)) <= 10.0 * reach for row in table.rows)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "base", "tip"),
    [
        ("talos", "left_sole_link", "gripper_right_base_link"),
        ("icub", "l_sole", "r_gripper"),
        ("ur5", "tool0", "base"),
        ("hyq", "lf_foot", "rh_foot"),
    ],
)
@pytest.mark.parametrize("convention", ["standard", "modified"])
@pytest.mark.parametrize("snap", [0.0, 1e-3])
def test_a_path_through_the_common_ancestor_agrees_with_pinocchio(
    name: str, base: str, tip: str, convention: str, snap: float
) -> None:
    table = load(name).dh(tip, base, convention, snap=snap)
    assert table.rows


# -- tables of the vendors -----------------------------------------------------------------------------


#: Options (snap, last) with which a table equals the vendor's, and the allowed displacement of the tip (m).
EXACT = {
    "ur3": (1e-6, "tip", 1e-11),
    "ur5": (1e-6, "tip", 1e-11),
    "ur10": (1e-6, "tip", 1e-11),
    "panda": (0.0, "flange", 0.0),
    "xarm7_standard": (1e-4, "tip", 1e-5),
    "xarm7_modified": (1e-4, "tip", 1e-5),
}


@pytest.mark.parametrize("name", EXACT)
def test_every_cell_of_the_vendors_table_is_computed_from_the_urdf(name: str) -> None:
    reference = read_table(reference_path(name))
    snap, last, metres = EXACT[name]
    table = load(reference.robot).dh(
        reference.tip_frame, reference.base_frame, str(reference.convention), snap=snap, last=last
    )
    for row, other in zip(table.rows, reference.rows, strict=True):
        assert row.joint == other.joint
        np.testing.assert_allclose(row.cells, other.cells, rtol=0, atol=1e-15)
    np.testing.assert_allclose(table.base, np.eye(4), atol=1e-15)
    np.testing.assert_allclose(table.tool, reference.tool, atol=1e-15)
    if snap:
        assert present(table.snap).metres <= metres


@pytest.mark.slow
def test_kinovas_published_table_differs_from_the_urdf_only_by_rounding() -> None:
    found = compare(*published("kinova"))
    assert found.agrees
    assert [(one.row, one.cell) for one in found.differences] == [(3, "d")]
    assert found.differences[0].urdf == pytest.approx(-0.31105, abs=1e-9)
    assert found.metres < 5.01e-5


@pytest.mark.slow
@pytest.mark.parametrize("name", published_tables())
def test_a_bundled_reference_table_agrees_with_the_urdf_to_the_stated_accuracy(name: str) -> None:
    found = compare(*published(name))
    text = reference_path(name).read_text()
    assert found.agrees
    assert found.residual <= 1e-12
    assert ('checked = "exact' in text) == found.is_exact
    assert f"{found.metres:.1e} m" in text or found.is_exact
    assert 'source = "' in text


@pytest.mark.slow
def test_an_error_of_0_3_mm_in_a_published_table_is_detected() -> None:
    """The xArm7 table of robotkinematicscatalogue 1.1.2 has a3 = 52.2 mm instead of 52.5 mm."""
    path, reference = published("xarm7_modified")
    rows = list(reference.rows)
    rows[3] = replace(rows[3], a=0.0522, alpha=-math.pi / 2, theta=math.pi)
    rows[4] = replace(rows[4], a=-0.0775)
    rows[5] = replace(rows[5], alpha=-math.pi / 2)
    rows[6] = replace(rows[6], a=-0.076, alpha=math.pi / 2, theta=math.pi)
    found = compare(path, replace(reference, rows=tuple(rows)))
    assert not found.agrees
    assert found.senses == (1, 1, 1, -1, 1, 1, 1)
    wrong = [one for one in found.differences if one.tip_displacement > 1e-4]
    assert [(one.row, one.cell) for one in wrong] == [(3, "a")]
    assert wrong[0].difference == pytest.approx(3e-4, abs=1e-9)


def test_the_error_about_an_unknown_reference_table_lists_the_nearest_names() -> None:
    with pytest.raises(UnknownNameError, match="did you mean"):
        reference_path("xarm7_standrad")
