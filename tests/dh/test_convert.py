"""Conversions between conventions, trees, URDFs and tables do not change the placement."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from tests.dh.arms import CONVENTIONS, EPS, error_ratio, with_cells
from tests.oracle import TreeOracle
from tests.random_chains import configurations, trees
from urdfkin.dh import convert, make_dh_table, read_table, table_from_rows, to_convention, to_tree, to_urdf
from urdfkin.dh.parse_table import published_tables
from urdfkin.dh.table import DHConvention, DHRow, DHTable
from urdfkin.errors import InputError
from urdfkin.model.chain import make_chain
from urdfkin.model.tree import FloatArray, JointKind, KinematicTree, Mimic
from urdfkin.robot.loading import load
from urdfkin.urdf import writer
from urdfkin.validation.campaign import validate
from urdfkin.verify.conversions import check_table_source
from urdfkin.verify.oracle import QueryBatch
from urdfkin.verify.pinocchio import PinocchioOracle
from urdfkin.verify.tables import TableError

conventions = st.sampled_from(CONVENTIONS)
ROW = DHRow(0.0, 0.0, 0.0, 0.0, JointKind.REVOLUTE, "j")
TABLE = DHTable(DHConvention.STANDARD, (ROW,))
UR5 = published_tables()["ur5"]


@pytest.mark.slow
@given(trees(), conventions, st.sampled_from(["tip", "flange"]))
@settings(max_examples=50)
def test_a_conversion_to_the_other_convention_and_back_gives_an_equal_table(
    tree: Any, convention: str, last: str
) -> None:
    table = make_dh_table(tree, "tip", convention=convention, last=last)
    other = "modified" if convention == "standard" else "standard"
    there = to_convention(table, other)
    back = to_convention(there, convention)
    q = configurations(len(table.joint_names))
    assert there.convention == other
    for one in (there, back):
        assert error_ratio(table, one.placement(q), table.placement(q), q) <= 3.0


@pytest.mark.slow
@given(trees(), conventions)
@settings(max_examples=40)
def test_a_table_converted_to_a_tree_and_back_gives_the_same_tip_placement(
    tree: Any, convention: str
) -> None:
    table = make_dh_table(tree, "tip", convention=convention)
    robot = to_tree(table)
    tip = robot.links[robot.frame_link("tip")]
    q = configurations(robot.nq, 4)
    path = make_chain(robot, tip)
    own = path.coupling.select(robot, q)
    assert set(path.joint_names) == set(table.joint_names)
    expected = table.placement(own[:, [path.joint_names.index(name) for name in table.joint_names]])
    again = make_dh_table(robot, tip, convention=convention)
    for found in (TreeOracle(robot).placement(q, tip, robot.links[0]), again.placement(own)):
        assert error_ratio(table, found, expected, own) <= 3.0


#: The Stanford arm.
STANFORD = [
    [0, "-pi/2", 0.412, 0], [0, "pi/2", 0.154, 0], [0.0203, 0, 0, "-pi/2", "P"], [0, "-pi/2", 0, 0],
    [0, "pi/2", 0, 0], [0, 0, 0, 0],
]  # fmt: skip


def test_the_stanford_arm_converted_to_a_tree_and_back_has_the_same_cells() -> None:
    table = table_from_rows(STANFORD, "standard")
    again = make_dh_table(to_tree(table), "tip")
    np.testing.assert_allclose(
        [row.cells for row in again.rows], [row.cells for row in table.rows], rtol=0, atol=1e-12
    )
    for end in (again.base, again.tool):
        np.testing.assert_allclose(end, np.eye(4), atol=1e-15)


def test_a_mimicked_joint_outside_the_path_remains_a_coordinate_of_the_tree() -> None:
    table = replace(TABLE, rows=(replace(ROW, a=0.3, mimic=Mimic("far", 2.0, 0.1)),))
    robot = to_tree(table)
    assert table.joint_names == ("far",)
    assert robot.nq == 1
    q = np.array([[0.2]])
    np.testing.assert_allclose(TreeOracle(robot).placement(q, "tip", "base"), table.placement(q), atol=1e-15)


# -- a URDF --------------------------------------------------------------------------------------------


def placements(text: str, names: tuple[str, ...], q: FloatArray, tip: str) -> FloatArray:
    """Return poses of a frame by Pinocchio's reading of a URDF; coordinates are given by joint name."""
    model = pin.buildModelFromXML(text)
    data = model.createData()
    poses = []
    for one in q:
        full = pin.neutral(model)
        for name, value in zip(names, one, strict=True):
            joint = model.joints[model.getJointId(name)]
            own = [value] if joint.nq == 1 else [np.cos(value), np.sin(value)]
            full[joint.idx_q : joint.idx_q + joint.nq] = own
        pin.framesForwardKinematics(model, data, full)
        poses.append(data.oMf[model.getFrameId(tip, pin.FrameType.BODY)].homogeneous)
    return np.array(poses)


@pytest.mark.slow
@given(trees(min_joints=1, mimics=False), conventions)
@settings(max_examples=30)
def test_a_urdf_converted_to_a_table_and_back_is_the_same_robot_for_pinocchio(
    tree: KinematicTree, convention: str
) -> None:
    # Pinocchio replaces an axis by x, y or z, from which it deviates by at most 1e-12.
    assume(not any(0.0 < np.sort(np.abs(joint.axis))[1] < 1e-10 for joint in tree.joints))
    table = make_dh_table(tree, "tip", convention=convention)
    q = configurations(tree.nq, 4)
    before = placements(writer.to_urdf(tree), table.joint_names, q, "tip")
    after = placements(to_urdf(table), table.joint_names, q, to_tree(table).links[-1])
    assert error_ratio(table, after, before, q, slack=EPS) <= 4.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "base", "tip"),
    [("ur5", "base", "tool0"), ("panda", "panda_link0", "panda_hand"),
     ("tiago", "base_link", "arm_tool_link"), ("talos", "left_sole_link", "imu_link")],
)  # fmt: skip
@pytest.mark.parametrize("convention", CONVENTIONS)
def test_a_robot_converted_to_a_table_and_back_gives_the_same_placements(
    name: str, base: str, tip: str, convention: str
) -> None:
    robot = load(name)
    table = robot.dh(tip, base, convention)
    again = load(table)
    q = robot.sample(6)
    own = robot.select(table, q)
    order = [table.joint_names.index(joint) for joint in again.coordinate_names]
    T_base, T_tip = robot.placement(q, base), robot.placement(q, tip)
    found = again.placement(own[:, order], again.tip_frame)
    np.testing.assert_allclose(found, np.linalg.solve(T_base, T_tip), atol=1e-14)
    assert again.certificate().verified
    np.testing.assert_allclose(again.dh(convention=convention).placement(own), found, atol=1e-14)


# -- a robot -------------------------------------------------------------------------------------------

SLIDING = table_from_rows([[0, "pi/2", 0.3, 0], [0, 0, 0.1, 0, "P"]], "standard")


@pytest.mark.parametrize("name", [*published_tables(), "a sliding joint without limits"])
def test_a_table_can_be_loaded_as_a_robot(name: str) -> None:
    table = read_table(published_tables()[name]) if name in published_tables() else SLIDING
    robot = load(table)
    q = robot.sample(4)
    np.testing.assert_allclose(robot.placement(q, table.tip_frame), table.placement(q), atol=1e-14)
    assert robot.certificate().verified


@pytest.mark.parametrize("kind", ["R", "P"])
def test_a_joint_without_position_limits_keeps_its_limits_of_velocity_and_effort(kind: str) -> None:
    robot = load(table_from_rows([{"kind": kind, "limit": {"velocity": 2, "effort": 3}}], "standard"))
    limit = robot.tree.joints[0].limit
    assert limit is not None
    assert (limit.velocity, limit.effort) == (2.0, 3.0)


@pytest.mark.parametrize("kind", ["R", "P"])
def test_a_single_position_limit_is_not_dropped(kind: str) -> None:
    table = table_from_rows([{"joint": "slide", "kind": kind, "limit": {"lower": 0}}], "standard")
    with pytest.raises(InputError, match=r"joint slide: a URDF needs finite position limits .* 0\.0 to inf"):
        load(table)


@pytest.mark.parametrize("root_joint", [None, "floating"])
def test_a_table_file_can_be_loaded_like_a_urdf(tmp_path: Path, root_joint: str | None) -> None:
    file = tmp_path / "arm.toml"
    file.write_bytes(UR5.read_bytes())
    robot, same = (load(source, root_joint=root_joint) for source in (file, read_table(UR5)))
    q = robot.sample(3)
    np.testing.assert_array_equal(robot.jacobian(q, "tool0"), same.jacobian(q, "tool0"))
    assert robot.certificate().verified
    assert (robot.source, same.source) == (str(file), "<table>")
    assert robot.origin.python_call.startswith(f"urdfkin.load({str(file)!r}")


def test_a_table_and_a_table_file_can_be_validated() -> None:
    report = validate([str(UR5), read_table(UR5)], samples=2)
    assert report.passed
    assert [robot.source for robot in report.robots] == [str(UR5), "<table>"]
    assert report.robots[0].results == report.robots[1].results


def test_a_urdf_that_differs_from_the_table_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    table = read_table(UR5)
    other = with_cells(table, 0, d=table.rows[0].d + 1e-9)
    monkeypatch.setattr(convert, "to_urdf", lambda _: to_urdf(other))
    with pytest.raises(TableError, match="the URDF made from a table differs from the table"):
        load(table)
    assert load(table, verify=False).nq == 6


def test_a_nan_in_pinocchios_placement_is_a_difference_from_the_table(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    table, placements = read_table(UR5), PinocchioOracle.placements
    verifier = load(table, verify=False).verifier

    def with_nan(self: PinocchioOracle, x: QueryBatch) -> FloatArray:
        T = placements(self, x)
        T[0, 0, 0, 0] = np.nan
        return T

    check_table_source(verifier, table)
    monkeypatch.setattr(PinocchioOracle, "placements", with_nan)
    with pytest.raises(TableError, match="the URDF made from a table differs from the table"):
        check_table_source(verifier, table)


def test_a_table_takes_no_xacro_arguments() -> None:
    with pytest.raises(InputError, match=r"`xacro_args` \(--xacro-arg\) is only for"):
        load(read_table(UR5), xacro_args={"arm": "left"})


# -- inconsistent tables -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("right", "change", "message"),
    [
        (ROW, {"a": float("nan")}, "row of joint j: a is not a finite number"),
        (ROW, {"sense": 2}, r"`sense` must be \+1 or -1"),
        (ROW, {"kind": JointKind.FLOATING}, "revolute, continuous or prismatic"),
        (TABLE, {"rows": (ROW, ROW)}, "two rows name the same joint: found 'j'"),
        (TABLE, {"base": np.diag([1.0, 1.0, 2.0, 1.0])}, "rotation and a translation"),
        (TABLE, {"tool": np.eye(3)}, r"\(4, 4\)"),
    ],
)
def test_an_inconsistent_row_or_table_is_refused(right: Any, change: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        replace(right, **change)
