"""The class of an arm, its OPW parameters, and solvers of other libraries that give the poses of its tip."""

import itertools
import math
import re
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.cli.running import good, urdfkin
from tests.dh.arms import arm
from tests.random_chains import rotation, shift
from tests.reading import present
from urdfkin.dh import DHTable, export, table_from_rows, to_tree
from urdfkin.dh.export.toolboxes import write_screws
from urdfkin.dh.screws import make_screws
from urdfkin.dh.structure import Structure, find_opw, find_structure
from urdfkin.errors import InputError
from urdfkin.model.chain import make_chain
from urdfkin.model.tree import FloatArray, KinematicTree
from urdfkin.robot import Robot
from urdfkin.robot.loading import load
from urdfkin.verify.conversions import check_opw
from urdfkin.verify.oracle import QueryBatch

H = math.pi / 2
PUMA: list[list[float]] = [
    [0, H, 0, 0], [0.4318, 0, 0, 0], [0.0203, -H, 0.15005, 0], [0, H, 0.4318, 0], [0, -H, 0, 0],
    [0, 0, 0, 0],
]  # fmt: skip


def of_tree(tree: KinematicTree) -> Structure:
    return find_structure(make_screws(make_chain(tree, "tip")))


def of_rows(rows: list[list[object]] | list[list[float]]) -> Structure:
    return of_tree(to_tree(table_from_rows(rows, "standard")))


def test_a_puma_has_a_spherical_wrist_and_can_be_solved_by_opw() -> None:
    found = of_rows(PUMA)
    assert [(kind.name, kind.is_exact) for kind in found.kinds] == [("spherical wrist", True)]
    assert found.freedoms == 6
    assert found.solvers[0].startswith("OPW")
    links = 0.4318 + math.hypot(0.0203, 0.15005) + 0.4318
    assert found.sampled_reach <= found.reach == pytest.approx(links, abs=0.02)


FIRST_AXIS = "the point of the first axis that is nearest to the"


@pytest.mark.parametrize(
    ("kinds", "tilt", "point", "words"),
    [
        # The first axis is x = 2, y = 3. The second axis passes through (2.5, 3, 5) in the plane x = 2.5.
        ("RR", H, (2.0, 3.0, 5.0), f"{FIRST_AXIS} second axis"),
        ("RR", 0.03, (2.0, 3.0, 5.0), f"{FIRST_AXIS} second axis"),
        ("RR", 0.0, (2.0, 3.0, 0.0), f"{FIRST_AXIS} base's origin"),
        ("RR", 0.01, (2.0, 3.0, 0.0), f"{FIRST_AXIS} base's origin"),
        ("RP", H, (2.0, 3.0, 0.0), f"{FIRST_AXIS} base's origin"),
        ("R", 0.0, (2.0, 3.0, 0.0), f"{FIRST_AXIS} base's origin"),
        ("PR", H, (0.0, 0.0, 0.0), "the base's origin"),
        ("", 0.0, (0.0, 0.0, 0.0), "the base's origin"),
    ],
)
def test_the_point_from_which_the_reach_is_measured_is_stated(
    kinds: str, tilt: float, point: tuple[float, ...], words: str
) -> None:
    poses = [shift(2, 3, 1), shift(0.5, 0, 4) @ rotation("x", tilt)]
    found = of_tree(arm(*poses[: len(kinds)], kinds=kinds, tip=shift(0.1, 0.2, 0.3)))
    assert found.reach_from == pytest.approx(point, abs=1e-12)
    assert found.reach_point == words
    assert found.sampled_reach <= found.reach


@pytest.mark.parametrize("metres", [1e200, 1e-200])
def test_the_reach_is_correct_if_its_square_is_not_a_double(metres: float) -> None:
    found = of_tree(arm(shift(0, 0, 0), shift(metres, 0, 0), kinds="RR", tip=shift(metres, 0, 0)))
    assert found.sampled_reach == pytest.approx(2.0 * metres, rel=1e-3)
    assert found.reach == pytest.approx(2.0 * metres)
    assert found.pairs[0].distance == pytest.approx(metres)


def test_the_command_states_the_point_from_which_the_reach_is_measured() -> None:
    text, data = (good(f"structure planar_two_link --format {form}") for form in ("table", "json"))
    assert f"measured from (0, 0, 0) m, {FIRST_AXIS} base's origin" in text.text
    assert data.data["reach_from"] == [0.0, 0.0, 0.0]
    assert data.data["reach_point"] == f"{FIRST_AXIS} base's origin"


@pytest.mark.parametrize("offset", [1e-4, 3e-3])
def test_an_inexact_spherical_wrist_is_reported_with_the_distance(offset: float) -> None:
    rows = [[*row] for row in PUMA]
    rows[4][0] = offset  # distance of the last axis from the other two axes
    kind = of_rows(rows).kinds[0]
    assert kind.name == "spherical wrist"
    assert not kind.is_exact
    assert offset / 3 <= kind.metres <= offset
    rows[4][0] = 0.08
    assert of_rows(rows).kinds == ()


@pytest.mark.parametrize("tilt", [0.0, 0.0066])
def test_three_parallel_axes_are_reported_with_the_tilt(tilt: float) -> None:
    rows: list[list[float]] = [
        [0, H, 0.18, 0], [-0.61, tilt, 0, 0], [-0.57, 0, 0, 0], [0, H, 0.17, 0], [0, -H, 0.12, 0],
        [0, 0, 0.1, 0],
    ]  # fmt: skip
    found = of_rows(rows)
    assert found.kinds[0].name == "three parallel axes"
    assert found.kinds[0].radians == pytest.approx(tilt, abs=1e-12)
    assert found.kinds[0].is_exact == (tilt == 0.0)
    solvers = "EAIK, ik-geo's three_parallel_two_intersecting"
    assert found.solvers == (f"Pieper, three axes are parallel, two meet: {solvers}",)


def test_a_scara_and_a_gantry_are_recognised() -> None:
    scara = of_rows([[0.3, 0, 0.2, 0, "R"], [0.25, math.pi, 0, 0, "R"], [0, 0, 0, 0, "P"], [0, 0, 0, 0, "R"]])
    assert (scara.joints, scara.freedoms, scara.kinds[0].name) == ("RRPR", 4, "SCARA")
    square = rotation("x", H)
    gantry = of_tree(arm(np.eye(4), square, rotation("y", H), kinds="PPP", tip=shift(0, 0, 0.1)))
    assert (gantry.joints, gantry.freedoms, gantry.kinds[0].name) == ("PPP", 3, "gantry")


@pytest.mark.parametrize("name", ["kinova", "talos", "panda"])
def test_the_centre_of_a_spherical_joint_does_not_move_according_to_pinocchio(name: str) -> None:
    robot = load(name)
    screws = robot.screws()
    found = find_structure(screws)
    assert len(found.joints) - found.freedoms == (1 if name != "kinova" else 0)
    kind = next(kind for kind in found.kinds if kind.name.startswith("spherical"))
    assert kind.at is not None
    # The three joints do not move the point of the last link at their common centre.
    beyond = robot.tree.links[robot.tree.joint_index(kind.joints[-1]) + 1]
    q = np.zeros((20, robot.nq))
    columns = [robot.tree.q_index[robot.tree.joint_index(joint)] for joint in kind.joints]
    q[1:, columns] = np.random.default_rng(0).uniform(-1, 1, (19, 3))
    both = robot.verifier.oracle().placements(QueryBatch([screws.base_frame, beyond], (q,)))
    T = np.linalg.inv(both[:, 0]) @ both[:, 1]
    local = np.linalg.solve(T[0], [*kind.at, 1.0])
    centres = (T @ local)[:, :3]
    np.testing.assert_allclose(centres, np.broadcast_to(centres[0], (20, 3)), atol=1e-12)


def test_the_command_prints_the_structure_and_the_check() -> None:
    result = good("structure ur5 --tip tool0")
    assert "three parallel axes: shoulder_lift_joint, elbow_joint, wrist_1_joint, exactly" in result.text
    assert "agrees within rounding" in result.text
    data = good("structure panda --format json").data
    assert data["freedoms"] == 6
    assert data["joints"] == "RRRRRRR"
    assert urdfkin("structure ur5 --no-verify").code == 3


# -- OPW parameters ------------------------------------------------------------------------------------

NAMES = ("a1", "a2", "b", "c1", "c2", "c3", "c4")


def drawn(rng: np.random.Generator) -> dict[str, float]:
    """Draw the lengths of an arm."""
    lengths = rng.uniform([-0.4, -0.4, -0.3, 0.1, 0.3, 0.3, 0.05], [0.4, 0.4, 0.3, 0.6, 0.9, 0.9, 0.2])
    return dict(zip(NAMES, lengths.tolist(), strict=True))


def table(lengths: dict[str, float], offsets: list[float], signs: list[int], tilt: float = 0.0) -> DHTable:
    """Return the table of an arm with these parameters, as in Brandstoetter's drawing."""
    cells = [
        (lengths["a1"], -H, lengths["c1"], 0.0), (lengths["c2"], tilt, 0.0, -H),
        (lengths["a2"], H, lengths["b"], H), (0.0, -H, lengths["c3"], 0.0), (0.0, H, 0.0, 0.0),
        (0.0, 0.0, lengths["c4"], 0.0),
    ]  # fmt: skip
    rows = [
        {"a": a, "alpha": alpha, "d": d, "theta": math.remainder(theta - offset, 2 * math.pi), "sense": sign}
        for (a, alpha, d, theta), offset, sign in zip(cells, offsets, signs, strict=True)
    ]
    return table_from_rows(rows, "standard")


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10))
def test_the_opw_parameters_of_a_random_arm_are_identified(seed: int) -> None:
    rng = np.random.default_rng(seed)
    lengths = drawn(rng)
    for name in rng.choice(["a1", "a2", "b"], seed % 3, replace=False):
        lengths[str(name)] = 0.0
    signs = [int(s) for s in rng.choice([-1, 1], 6)]
    robot = load(table(lengths, list(rng.uniform(-3, 3, 6)), signs), verify=False)
    path = robot.chain("tip", "base")
    found = find_opw(path)
    q = rng.uniform(-3, 3, (50, 6))
    np.testing.assert_allclose(found.placement(q), path.placement(q), atol=1e-12)
    ours, theirs = ({name: abs(x) for name, x in each.items()} for each in (found.lengths, lengths))
    assert ours == pytest.approx(theirs, abs=1e-12)
    assert min(found.lengths[name] for name in ("c1", "c2", "c3")) >= 0.0


def test_an_arm_with_the_tip_against_the_last_axis_is_an_opw_arm() -> None:
    lengths = dict(zip(NAMES, (-0.1, -0.1, 0.0, 0.4, 0.5, 0.5, 0.1), strict=True))
    arm = table(lengths, [0.0, 0.0, 0.0, H, 2 * H, 2 * H], [1, 1, 1, -1, 1, -1])
    path = load(arm, verify=False).chain("tip", "base")
    q = np.random.default_rng(0).uniform(-3, 3, (50, 6))
    np.testing.assert_allclose(find_opw(path).placement(q), path.placement(q), atol=1e-12)


def test_six_joints_with_a_prismatic_joint_are_not_an_opw_arm() -> None:
    rows: list[list[object]] = [[*row, "P" if i == 2 else "R"] for i, row in enumerate(PUMA)]
    path = load(table_from_rows(rows, "modified"), verify=False)
    with pytest.raises(InputError, match="six revolute joints, RRRRRR: found RRPRRR"):
        find_opw(path.chain(path.tip_frame, path.base_frame))


@pytest.mark.slow
def test_a_calibrated_arm_is_an_opw_arm_only_within_a_tolerance() -> None:
    lengths = dict(zip(NAMES, (0.1, -0.1, 0.0, 0.4, 0.5, 0.5, 0.1), strict=True))
    path = load(table(lengths, [0.0] * 6, [1] * 6, tilt=2e-3), verify=False).chain("tip", "base")
    with pytest.raises(InputError, match=r"not ortho-parallel.*error of [0-9.]+ mm and 0.00[0-9]+ rad"):
        find_opw(path)
    found = find_opw(path, 0.02)
    assert found.lengths["c2"] == pytest.approx(0.5, abs=1e-3)


def test_the_check_of_an_opw_solver_states_the_distance_and_the_angle_of_the_tip() -> None:
    robot = load("kinova")
    chain = robot.chain()
    found = find_opw(chain, 1e-6)
    moved = replace(found, tool=found.tool @ shift(0.03, 0.04, 0.0) @ rotation("z", 0.2))
    assert "by at most 5.00e-02 m and 2.00e-01 rad" in present(check_opw(robot.verifier, chain, moved))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ur5", "panda"])
def test_an_arm_that_is_not_an_opw_arm_is_refused(name: str) -> None:
    with pytest.raises(InputError, match=r"OPW arm must have six|not ortho-parallel"):
        find_opw(load(name, verify=False).chain())


@pytest.mark.slow
def test_the_command_prints_opw_parameters_in_the_format_of_the_solvers(tmp_path: Path) -> None:
    result = good("structure kinova --opw 0.001")
    assert "differs from Pinocchio's by at most" in result.text + result.err
    lines = dict(line.split(": ", 1) for line in result.text.splitlines() if line.startswith("opw_"))
    named = ("geometric_parameters", "joint_offsets", "joint_sign_corrections")
    assert sorted(lines) == [f"opw_kinematics_{name}" for name in named]
    signs = tomllib.loads(f"x = {lines['opw_kinematics_joint_sign_corrections']}")["x"]
    assert all(abs(sign) == 1 for sign in signs)


# -- solvers of other libraries, with parameters from urdfkin ------------------------------------------


TIPS = {"ur5": "tool0", "ur10": "tool0", "kinova": "j2s6s200_end_effector"}
Solve = Callable[[FloatArray], Sequence[Any]]


def poses(robot: Robot, tip: str, count: int = 10) -> tuple[FloatArray, FloatArray]:
    """Return configurations and their tip poses in the base, checked by Pinocchio."""
    q = np.random.default_rng(0).uniform(-3.0, 3.0, (count, 6))
    return q, robot.relative_placement(q, tip, robot.base_frame)


def check(robot: Robot, tip: str, solve: Solve) -> None:
    """Demand that every solution reaches its pose, and that the original configuration is a solution."""
    for q, T in zip(*poses(robot, tip), strict=True):
        found = np.array(solve(T)).reshape(-1, 6)
        assert len(found) > 0
        sampled_reach = robot.relative_placement(found, tip, robot.base_frame)
        np.testing.assert_allclose(sampled_reach, np.broadcast_to(T, (len(found), 4, 4)), atol=1e-10)
        apart = np.abs(np.angle(np.exp(1j * (found - q)))).max(axis=-1)
        assert apart.min() < 1e-7


def axes(robot: Robot, tip: str) -> dict[str, Any]:
    scope: dict[str, Any] = {}
    exec(write_screws(robot.screws(tip, robot.base_frame), "numpy"), scope)
    return scope


def eaik_solver(robot: Robot, tip: str) -> Solve:
    eaik, given = pytest.importorskip("eaik.IK_HP"), axes(robot, tip)
    solver = eaik.HPRobot(given["H"], given["P"])
    assert solver.hasKnownDecomposition()

    def solve(T: FloatArray) -> list[Any]:
        pose = T.copy()
        pose[:3, :3] = T[:3, :3] @ given["R6T"].T
        found = solver.IK(pose)
        # The solver returns a least-squares solution for a pose that a branch does not reach.
        return [q for q, nearest in zip(found.Q, found.is_LS, strict=True) if not nearest]

    return solve


def ik_geo_solver(robot: Robot, tip: str) -> Solve:
    ik_geo, given = pytest.importorskip("ik_geo"), axes(robot, tip)
    (family,) = re.findall(r"ik-geo's (\w+)", " ".join(find_structure(robot.screws(tip)).solvers))
    solver = getattr(ik_geo.Robot, family)(given["H"].tolist(), given["P"].tolist())

    def solve(T: FloatArray) -> list[Any]:
        # The Python version 1.0.3 reads a rotation column by column.
        columns = (T[:3, :3] @ given["R6T"].T).T.tolist()
        return [q for q, nearest in solver.get_ik(columns, T[:3, 3].tolist()) if not nearest]

    return solve


def opw_solver(robot: Robot, tip: str) -> Solve:
    opw = pytest.importorskip("py_opw_kinematics")
    from scipy.spatial.transform import RigidTransform

    found = find_opw(robot.chain(tip, robot.base_frame), 1e-9)
    model = opw.KinematicModel(
        **found.lengths, offsets=found.offsets, flip_axes=tuple(sign < 0 for sign in found.signs)
    )
    solver = opw.Robot(model, degrees=False)
    base, tool = np.linalg.inv(found.base), np.linalg.inv(found.tool)
    return lambda T: [*solver.inverse(RigidTransform.from_matrix(base @ T @ tool))]


SOLVERS = {"eaik": eaik_solver, "ik_geo": ik_geo_solver, "opw": opw_solver}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("library", "name"), [*itertools.product(("eaik", "ik_geo"), TIPS), ("opw", "kinova")]
)
def test_a_library_with_exported_parameters_solves_for_the_poses_of_an_arm(library: str, name: str) -> None:
    robot = load(name)
    check(robot, TIPS[name], SOLVERS[library](robot, TIPS[name]))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_opw_kinematics_solves_for_the_poses_of_random_opw_arms(seed: int) -> None:
    rng = np.random.default_rng(seed)
    lengths, signs = drawn(rng), [int(sign) for sign in rng.choice([-1, 1], 6)]
    robot = load(table(lengths, list(rng.uniform(-3, 3, 6)), signs))
    check(robot, "tip", opw_solver(robot, "tip"))


@pytest.mark.slow
def test_the_robotics_toolbox_solves_inverse_kinematics_with_the_exported_ets() -> None:
    pytest.importorskip("roboticstoolbox", exc_type=ImportError)
    robot = load("ur5")
    scope: dict[str, Any] = {}
    exec(export(robot.dh("tool0", robot.base_frame), "ets"), scope)
    q, wanted = poses(robot, "tool0", 5)
    for start, T in zip(q, wanted, strict=True):
        found = scope["ets"].ik_LM(T, q0=start + 0.1, tol=1e-20)
        sampled_reach = robot.relative_placement(found[0], "tool0", robot.base_frame)
        np.testing.assert_allclose(sampled_reach, T, atol=1e-8)
