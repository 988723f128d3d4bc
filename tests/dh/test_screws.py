"""Screws of a robot agree with a textbook example, the matrix exponential, Pinocchio and a written URDF."""

import json
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from scipy.linalg import expm

from tests.cli.running import good
from tests.random_chains import trees
from tests.urdfs import built, joint, limit
from urdfkin.dh.export.toolboxes import write_screws
from urdfkin.dh.parse_table import read_table_or_screws
from urdfkin.dh.screws import ProductOfExponentials, make_screws, screws_from_rows
from urdfkin.errors import InputError, RangeError
from urdfkin.kinematics.rotation import exp_rotation
from urdfkin.model.chain import make_chain
from urdfkin.model.tree import FloatArray, KinematicTree
from urdfkin.robot.loading import load
from urdfkin.verify.conversions import check_screws
from urdfkin.verify.oracle import QueryBatch
from urdfkin.verify.pinocchio import PinocchioOracle
from urdfkin.verify.tables import TableError

#: Lynch and Park, Modern Robotics, example 4.5: a UR5 with W1 = 109 mm, W2 = 82, L1 = 425, L2 = 392, H1 = 89,
#: H2 = 95.
M: list[list[float]] = [[-1, 0, 0, 0.817], [0, 0, 1, 0.191], [0, 1, 0, -0.006], [0, 0, 0, 1]]
SPACE: list[list[float]] = [
    [0, 0, 1, 0, 0, 0], [0, 1, 0, -0.089, 0, 0], [0, 1, 0, -0.089, 0, 0.425], [0, 1, 0, -0.089, 0, 0.817],
    [0, 0, -1, -0.109, 0.817, 0], [0, 1, 0, 0.006, 0, 0.817],
]  # fmt: skip


def exponential(screws: FloatArray, q: FloatArray) -> FloatArray:
    """Return the product of matrix exponentials, computed by SciPy's expm."""
    T = np.eye(4)
    for (w1, w2, w3, *v), value in zip(screws, q, strict=True):
        S = np.zeros((4, 4))
        S[:3, :3], S[:3, 3] = [[0, -w3, w2], [w3, 0, -w1], [-w2, w1, 0]], v
        T = T @ expm(S * value)
    return T


def test_the_screws_of_the_books_ur5_give_the_placement_in_the_book() -> None:
    arm, q = screws_from_rows(SPACE, M), [0, -np.pi / 2, 0, 0, np.pi / 2, 0]
    T = np.array([[0, -1, 0, 0.095], [1, 0, 0, 0.109], [0, 0, 1, 0.988], [0, 0, 0, 1.0]])
    np.testing.assert_allclose(arm.placement(q), T, atol=1e-15)
    np.testing.assert_allclose(load(arm).placement(q, "tip"), arm.placement(q), atol=1e-15)


@pytest.mark.slow
@given(trees(min_joints=1, max_joints=6, tame=True))
@settings(max_examples=20)
def test_space_and_body_screws_give_the_placements_of_the_chain(tree: KinematicTree) -> None:
    path = make_chain(tree, "tip")
    screws = make_screws(path)
    q = np.linspace(-1, 1, len(path.joint_names))
    values = path.coupling.values(q)
    scale = 1e-13 * max(1.0, path.reach + float(path.lengths[0]))
    wanted = path.placement(q)
    np.testing.assert_allclose(screws.placement(q), wanted, atol=scale)
    np.testing.assert_allclose(exponential(screws.space, values) @ screws.M, wanted, atol=10 * scale)
    np.testing.assert_allclose(screws.M @ exponential(screws.body, values), wanted, atol=10 * scale)


@pytest.mark.parametrize("name", ["ur5", "panda", "kinova", "talos"])
def test_the_screws_of_a_robot_are_checked_and_can_be_loaded(name: str) -> None:
    robot = load(name)
    screws = robot.screws()
    again = load(screws)
    assert again.tree.links[0] == robot.base_frame
    own = screws.coupling.select(robot.tree, robot.sample(5, seed=1))
    free = screws_from_rows(screws.space, screws.M, joints=[joint.name for joint in screws.joints])
    found = free.placement(screws.coupling.values(own))
    np.testing.assert_allclose(found, screws.placement(own), atol=1e-14)


def test_a_wrong_screw_is_detected_by_pinocchio() -> None:
    robot = load("ur5")
    screws = robot.screws()
    wrong = np.array(screws.space)
    wrong[2, 5] += 1e-12
    with pytest.raises(TableError, match="product of exponentials disagrees"):
        check_screws(robot.verifier, replace(screws, space=wrong))


@pytest.mark.parametrize("size", [1e-300, 1e-100, 1e-9, 1.0, 1e100, 1e200, 1e300])
def test_a_wrong_length_of_any_size_is_detected_by_pinocchio(size: float) -> None:
    def origin(*xyz: float) -> str:
        return f'xyz="{" ".join(repr(size * x) for x in xyz)}" rpy="1 0.2 0.3"'

    robot = built(
        joint("x", "continuous", "a", "b", origin(1.0, 0.0, 0.1)),
        joint("y", "continuous", "b", "c", origin(0.3, 0.1, 0.2), "0 0.6 0.8"),
    )
    for base in ("a", "b"):
        screws = robot.screws("c", base)
        wrong = np.array(screws.M)
        wrong[:3, 3] *= 1.0 + 1e-12
        with pytest.raises(TableError, match="product of exponentials disagrees"):
            check_screws(robot.verifier, replace(screws, M=wrong))


def test_screws_of_axes_that_pinocchio_replaces_are_verified() -> None:
    robot = built(
        joint("x", "continuous", "a", "b", 'xyz="0.1 0 0.3" rpy="1 0.2 0.3"', "9e-13 0 1"),
        joint("y", "continuous", "b", "c", 'xyz="0.3 0.1 0.2" rpy="1 0.2 0.3"', "0 9e-13 1"),
        joint("z", "prismatic", "c", "d", 'xyz="0.3 0.1 0.2"', "1 9e-13 0", limit()),
    )
    for base in ("a", "b"):
        screws = robot.screws("d", base)
        wrong = np.array(screws.M)
        wrong[0, 3] += 1e-10
        with pytest.raises(TableError, match="product of exponentials disagrees"):
            check_screws(robot.verifier, replace(screws, M=wrong))


def test_screws_raise_range_error_if_the_bound_leaves_the_range_of_doubles() -> None:
    far = 'xyz="1.5e308 0 0"'
    robot = built(joint("x", "continuous", "a", "b", far), joint("y", "continuous", "b", "c"))
    with pytest.raises(RangeError, match="bound on a position"):
        robot.screws("c", "a")


def test_a_nan_in_pinocchios_rotation_is_a_disagreement(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = load("ur5")
    screws, placements = robot.screws(), PinocchioOracle.placements

    def with_nan(self: PinocchioOracle, x: QueryBatch) -> FloatArray:
        T = placements(self, x)
        T[:, 1, 0, 0] = np.nan
        return T

    monkeypatch.setattr(PinocchioOracle, "placements", with_nan)
    with pytest.raises(TableError, match="product of exponentials disagrees"):
        check_screws(robot.verifier, screws)


@pytest.mark.parametrize("form", ["toml", "json"])
def test_a_written_screw_file_can_be_loaded_as_a_robot(form: str, tmp_path: Path) -> None:
    path = tmp_path / f"arm.{form}"
    good("screws ur5 --base base --tip tool0 --format", form, "-o", str(path))
    robot, ur5 = load(path), load("ur5")
    q = np.linspace(-1, 1, 6)
    T = np.linalg.inv(ur5.placement(q, "base")) @ ur5.placement(q, "tool0")
    np.testing.assert_allclose(robot.placement(q, "tool0"), T, atol=1e-14)
    shown = good("dh", str(path), "--snap", "1e-6", "--base", "base", "--tip", "tool0").text
    assert "q1" in shown
    assert "agrees within rounding" in shown


@pytest.mark.slow
def test_exported_code_contains_the_screws_as_columns(tmp_path: Path) -> None:
    arm = screws_from_rows(SPACE, M)
    names: dict[str, Any] = {}
    exec(write_screws(arm, "numpy"), names)
    np.testing.assert_array_equal(names["Slist"], np.transpose(SPACE))
    T = arm.placement(np.ones(6))
    np.testing.assert_allclose(names["M"] @ exponential(names["Blist"].T, np.ones(6)), T, atol=1e-14)
    # ik-geo's notation: vectors P between the axes H.
    R, p = np.eye(3), names["P"][0]
    for h, between in zip(names["H"], names["P"][1:], strict=True):
        R = R @ exp_rotation(h)
        p = p + R @ between
    np.testing.assert_allclose(p, T[:3, 3], atol=1e-14)
    np.testing.assert_allclose(R @ names["R6T"], T[:3, :3], atol=1e-14)
    assert json.loads(write_screws(arm, "json"))["space"] == SPACE
    assert r"\end{bmatrix}$" in write_screws(arm, "latex")
    if octave := shutil.which("octave-cli"):
        (tmp_path / "robot_screws.m").write_text(write_screws(arm, "matlab"))
        script = "[M, S, B] = robot_screws(); printf('%.17g ', S(:), M(:))"
        out = subprocess.check_output([octave, "-q", "--eval", script], cwd=tmp_path, text=True)
        assert np.fromstring(out, sep=" ").tolist() == [*np.ravel(SPACE), *np.transpose(M).ravel()]


@pytest.mark.parametrize(
    ("screws", "home", "message"),
    [
        ([[0, 0, 2, 0, 0, 0]], M, "screw 1: the axis w of a screw must have length 1: found 2"),
        ([[0, 0, 0, 0, 0, 2]], M, "screw 1: the axis v of a screw must have length 1: found 2"),
        ([[0, 0, 1, 0, 0, 0.1]], M, "must be a pure rotation or a pure translation: found a pitch of 0.1"),
        ([[0, 0, 1]], M, r"screws must have the shape \(n, 6\)"),
        ([[0, 0, 1, 0, 0, 0]], np.ones((4, 4)), "M must be a rotation"),
        ([[0, 0, 1, 0, 0, np.nan]], M, "finite"),
        (np.ma.array([[0, 0, 1, 0.3, 0, 0]], mask=True), M, "screws must be real numbers"),
        ([["0", "0", "1", "0", "0", "0"]], M, "screws must be real numbers"),
        ([[0, 0, 1, 0, 0, 0]], np.eye(4) + 1j, "M must be real numbers"),
    ],
)
def test_an_invalid_screw_is_refused_with_the_reason(screws: Any, home: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        screws_from_rows(screws, home)


@pytest.mark.parametrize("form", ["toml", "json"])
def test_the_names_in_a_screw_file_are_not_changed(form: str, tmp_path: Path) -> None:
    arm, path = (
        screws_from_rows(SPACE[:2], M, joints=["\U0001f600", "tip"], tip_frame="x\x7f"),
        tmp_path / "a",
    )
    path = path.with_suffix(f".{form}")
    path.write_text(write_screws(arm, form), "utf-8")
    again = read_table_or_screws(path)
    assert isinstance(again, ProductOfExponentials)
    assert [joint.name for joint in again.joints] == ["\U0001f600", "tip"]
    assert again.tip_frame == "x\x7f"


@pytest.mark.parametrize(
    "names",
    [
        {"joints": ["base", "tip"]},
        {"joints": ["tip_fixed", "b"]},
        {"base_frame": "joint_1_link"},
        {"base_frame": "x", "tip_frame": "x"},
    ],
)
def test_screws_with_equal_names_of_joints_and_frames_can_be_loaded(names: dict[str, Any]) -> None:
    screws = screws_from_rows(SPACE[:2], M, **names)
    robot = load(screws)
    T = robot.placement([0.3, 0.4], f"link:{robot.tree.links[-1]}")
    np.testing.assert_allclose(T, screws.placement([0.3, 0.4]), atol=1e-14)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("joints = [1]", "arm.toml, joints: a name must be text: found 1"),
        ("joints = 'j'", "arm.toml, joints: `joints` must be a list of names: found 'j'"),
        ("joints = ['j', 'j']", "arm.toml, joints: two screws name the same joint: found 'j'"),
        ("robot = 5", "arm.toml, robot: a name must be text: found 5"),
    ],
)
def test_a_wrong_name_in_a_screw_file_is_reported(line: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    path.write_text(f"M = [[1,0,0,0],[0,1,0,0],[0,0,1,0]]\nspace = [[0, 0, 1, 0, 0, 0]]\n{line}\n")
    with pytest.raises(InputError, match=message):
        load(path)


def test_an_error_in_a_screw_file_is_reported_with_the_position(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    path.write_text("M = [[1,0,0,0],[0,1,0,0],[0,0,1,0]]\nspace = [['x']]\n")
    with pytest.raises(InputError, match=r"arm.toml: screws must be real numbers: found \[\['x'\]\]"):
        load(path)
    path.write_text("M = [[1,0,0,0],[0,1,0,0],[0,0,1,0]]\nscrews = []\n")
    with pytest.raises(InputError, match="unknown key in the table of screws: found 'screws'"):
        load(path)
