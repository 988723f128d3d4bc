"""URDF to table to URDF: Pinocchio sees one robot in both files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from tests.random_chains import configurations, trees
from urdfkin.dh import DHTable, convert, dh_table, read_table, table_from_rows, to_tree, to_urdf
from urdfkin.dh.parse_table import references
from urdfkin.errors import InputError
from urdfkin.model.tree import FloatArray, KinematicTree
from urdfkin.robot.loading import load
from urdfkin.urdf import writer
from urdfkin.validation.campaign import validate
from urdfkin.verify.tables import TableError

EPS = float(np.finfo(np.float64).eps)


def placements(text: str, names: tuple[str, ...], q: FloatArray, tip: str) -> FloatArray:
    """Poses of a frame by Pinocchio's own reading of a URDF, coordinates given by joint name."""
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


def agree(table: DHTable, first: FloatArray, second: FloatArray, q: FloatArray) -> None:
    metres, radians = table.tolerance(q)
    error = np.abs(first - second)
    assert (error[:, :3, 3].max(axis=-1) <= 4 * metres + 4 * EPS).all()
    assert (error[:, :3, :3].max(axis=(-1, -2)) <= 4 * radians).all()


def taken_for_a_coordinate_axis(tree: KinematicTree) -> bool:
    """Whether Pinocchio rounds an axis: it takes one within 1e-12 of x, y or z for that."""
    off = [np.sort(np.abs(joint.axis))[1] for joint in tree.joints]
    return any(0.0 < x < 1e-10 for x in off)


@pytest.mark.slow
@given(trees(min_joints=1, mimics=False), st.sampled_from(["standard", "modified"]))
@settings(max_examples=30)
def test_urdf_to_table_to_urdf_is_one_robot_to_pinocchio(tree: KinematicTree, convention: str) -> None:
    assume(not taken_for_a_coordinate_axis(tree))
    table = dh_table(tree, "tip", convention=convention)
    q = configurations(tree.nq, 4)
    before = placements(writer.to_urdf(tree), table.joint_names, q, "tip")
    after = placements(to_urdf(table), table.joint_names, q, to_tree(table).links[-1])
    agree(table, before, after, q)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "base", "tip"),
    [("ur5", "base", "tool0"), ("panda", "panda_link0", "panda_hand"),
     ("tiago", "base_link", "arm_tool_link"), ("talos", "left_sole_link", "imu_link")],
)  # fmt: skip
@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_a_robot_survives_a_way_to_a_table_and_back(name: str, base: str, tip: str, convention: str) -> None:
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
    second = again.dh(convention=convention)
    np.testing.assert_allclose(second.placement(own), found, atol=1e-14)


@pytest.mark.parametrize("name", references())
def test_a_shipped_reference_is_a_robot(name: str) -> None:
    table = read_table(references()[name])
    robot = load(table)
    q = robot.sample(4)
    np.testing.assert_allclose(robot.placement(q, table.tip_frame), table.placement(q), atol=1e-14)
    assert robot.certificate().verified


def test_a_table_with_a_sliding_joint_and_no_limits_is_a_robot() -> None:
    table = table_from_rows([[0, "pi/2", 0.3, 0], [0, 0, 0.1, 0, "P"]], "standard")
    robot = load(table)
    q = robot.sample(4)
    np.testing.assert_allclose(robot.placement(q, "tip"), table.placement(q), atol=1e-13)


@pytest.mark.parametrize("root_joint", [None, "floating"])
def test_a_tables_file_is_a_source_like_any_other(tmp_path: Path, root_joint: str | None) -> None:
    path = references()["ur5"]
    (tmp_path / "arm.toml").write_bytes(path.read_bytes())
    table = read_table(path)
    robot, same = load(tmp_path / "arm.toml", root_joint=root_joint), load(table, root_joint=root_joint)
    q = robot.sample(3)
    np.testing.assert_array_equal(robot.jacobian(q, "tool0"), same.jacobian(q, "tool0"))
    assert robot.certificate().verified
    assert (robot.source, same.source) == (str(tmp_path / "arm.toml"), "<table>")
    assert robot.origin.python.startswith(f"urdfkin.load({str(tmp_path / 'arm.toml')!r}")


def test_a_table_is_validated_as_it_is_and_as_a_file() -> None:
    path = references()["ur5"]
    report = validate([str(path), read_table(path)], samples=2)
    assert report.passed
    assert [robot.source for robot in report.robots] == [str(path), "<table>"]
    assert report.robots[0].results == report.robots[1].results


def test_a_urdf_that_is_not_the_tables_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    table = read_table(references()["ur5"])
    other = replace(table, rows=(replace(table.rows[0], d=table.rows[0].d + 1e-9), *table.rows[1:]))
    monkeypatch.setattr(convert, "to_urdf", lambda _: to_urdf(other))
    with pytest.raises(TableError, match="the URDF made of a table differs from the table"):
        load(table)
    assert load(table, verify=False).nq == 6


def test_a_table_takes_no_xacro_arguments() -> None:
    with pytest.raises(InputError, match="`xacro_args` needs"):
        load(read_table(references()["ur5"]), xacro_args={"arm": "left"})
