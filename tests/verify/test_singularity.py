"""A singular Jacobian is explained by its rank, its lost directions and its joints."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

import urdfkin
from urdfkin.errors import InputError
from urdfkin.model.base_motion import BaseMotion
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.verify.singular_values import singular_values
from urdfkin.verify.singularity import FrameColumns, Singularity

UR5 = [0.3, -1.0, 1.0, 0.4, 0.5, 0.6]
WRISTS = "shoulder_lift_joint, elbow_joint, wrist_1_joint"


def found(robot: Robot | str, q: object, rows: str = "all", frame: str | None = None) -> Singularity:
    robot = urdfkin.load(robot) if isinstance(robot, str) else robot
    return robot.singular_values(q, frame or robot.tip_frame, rows).singularity()  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("robot", "q", "rows", "reason"),
    [
        ("planar_two_link", [0.3, 0.0], "linear",
         "The axes of joints joint_1 and joint_2 lie in one plane with the origin of tip."),
        ("ur5", [0.3, -1.0, 0.0, 0.4, 0.5, 0.6], "all",
         "The axes of joints shoulder_lift_joint, elbow_joint and wrist_1_joint are parallel and lie in one"
         " plane."),
        ("ur5", [0.3, -1.0, 1.0, 0.4, 0.0, 0.6], "all",
         f"The axes of joints {WRISTS} and wrist_3_joint are parallel."),
        ("panda", "neutral", "all",
         "The axes of joints panda_joint1, panda_joint3 and panda_joint5 are collinear."),
        ("panda", "neutral", "angular",
         "The axes of joints panda_joint2, panda_joint4 and panda_joint6 are parallel."),
    ],
)  # fmt: skip
def test_the_reason_names_the_joints_and_their_geometry(
    robot: str, q: list[float] | str, rows: str, reason: str
) -> None:
    assert reason in found(robot, q, rows).reasons


def test_no_joint_velocity_moves_the_frame_in_a_lost_direction_and_no_null_motion_moves_it_at_all() -> None:
    robot = urdfkin.load("ur5")
    for q in (
        robot.neutral(),
        np.array([0.3, -1.0, 0.0, 0.4, 0.5, 0.6]),
        np.array([0.3, -1.0, 1.0, 0.4, 0.0, 0.6]),
    ):
        one, J = found(robot, q), robot.jacobian(q, "tool0")
        assert (one.rank, one.full, bool(one)) == (5, 6, True)
        assert one.lost.shape == one.motions.shape == (1, 6)
        assert np.abs(one.lost @ J).max() < 1e-14
        assert np.abs(J @ one.motions.T).max() < 1e-14


def test_a_regular_configuration_is_not_singular_however_near_it_is() -> None:
    robot = urdfkin.load("ur5")
    for elbow in (1.0, 1e-6, 1e-10):
        one = found(robot, [0.3, -1.0, elbow, 0.4, 0.5, 0.6])
        assert (bool(one), one.reasons, str(one)) == (False, (), "Not singular: rank 6 of 6.")
    assert found(robot, [0.3, -1.0, 1e-14, 0.4, 0.5, 0.6]), "within the bound of the Jacobian"


def test_an_explanation_leaves_the_certificate_verified() -> None:
    robot = urdfkin.load("ur5")
    assert found(robot, robot.neutral())
    assert robot.certificate().verified


def test_an_arm_that_is_singular_everywhere_is_not_explained_by_its_configuration() -> None:
    links = "".join(f'<link name="l{i}"/>' for i in range(6))
    joint = (
        '<joint name="j{0}" type="continuous"><parent link="l{0}"/><child link="l{1}"/>'
        '<origin xyz="0.3 0 0"/><axis xyz="0 0 1"/></joint>'
    )
    joints = "".join(joint.format(i, i + 1) for i in range(5))
    robot = urdfkin.load(f'<robot name="row">{links}{joints}</robot>')
    one = found(robot, [0.1, 0.2, 0.3, 0.4, 0.5])
    assert (one.rank, one.full, len(one.lost), len(one.motions)) == (3, 5, 0, 2)
    assert one.reasons == (
        "Random configurations have the same rank: the cause is the arm, not this configuration.",
    )
    stretched = found(robot, np.zeros(5), "linear")
    assert stretched.lost.tolist() == [[1.0, 0.0, 0.0, 0.0, 0.0, 0.0]]


def test_the_base_of_a_moving_robot_turns_the_lost_direction() -> None:
    robot = urdfkin.load("ur5")
    turn = np.eye(4)
    turn[:3, :3] = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    one = robot.singular_values(robot.neutral(), "tool0", base=BaseMotion(turn)).singularity()
    assert one.lost.round(9).tolist() == [[0.0, 0.0, 0.0, 0.0, 1.0, 0.0]]


def revolute(z: FloatArray, point: FloatArray) -> FloatArray:
    return np.concatenate([np.cross(point, z), z])


def explained(J: FloatArray, turns: bool | None = True) -> Singularity:
    generic = np.random.default_rng(1).normal(size=(2, *J.shape))
    names, active = tuple(f"j{i}" for i in range(J.shape[1])), np.ones(J.shape, dtype=bool)
    error, moving = np.full(J.shape, 1e-15), np.ones(J.shape[1], dtype=bool)
    turning = (turns,) * J.shape[1]
    columns = FrameColumns(J, error, "tip", names, turning, active, lambda: generic, moving_base=False)
    return singular_values(J, error, moving, slice(0, 6), columns).singularity()


def axes(points: FloatArray, z: FloatArray) -> FloatArray:
    units = z / np.linalg.norm(z, axis=1, keepdims=True)
    return np.array([revolute(*pair) for pair in zip(units, points, strict=True)]).T


def test_six_axes_that_meet_one_line_name_this_line() -> None:
    rng = np.random.default_rng(0)
    along, start = np.array([0.0, 0.0, 1.0]), np.array([0.2, 0.1, 0.0])
    points = start + rng.normal(size=(6, 1)) * along
    one = explained(axes(points, rng.normal(size=(6, 3))))
    assert (one.rank, one.full) == (5, 6)
    assert any("through the point at (0.2, 0.1, 0) m from the origin of tip" in line for line in one.reasons)
    assert one.reasons[-1].startswith("These joint velocities do not move tip: ")


def test_axes_through_one_point_are_told_from_axes_in_one_plane() -> None:
    rng = np.random.default_rng(2)
    J = axes(rng.normal(size=(6, 3)), rng.normal(size=(6, 3)))
    point, z = np.array([0.1, 0.2, 0.3]), rng.normal(size=(4, 3))
    J[:, :4] = axes(np.tile(point, (4, 1)), z)
    assert explained(J).reasons[-1] == "The axes of joints j0, j1, j2 and j3 intersect in one point."
    z[2] = z[0] + 0.5 * z[1]
    J[:, :3] = axes(np.tile(point, (3, 1)), z[:3])
    J[:, 3] = axes(rng.normal(size=(1, 3)), rng.normal(size=(1, 3)))[:, 0]
    said = "The axes of joints j0, j1 and j2 intersect in one point and lie in one plane."
    assert explained(J).reasons[-1] == said


def test_dependent_columns_that_are_no_axes_get_no_geometry() -> None:
    J = np.random.default_rng(3).normal(size=(6, 6))
    J[:, 5] = J[:, 0] - 2.0 * J[:, 1]
    one = explained(J, turns=None)
    assert one.reasons[-1].startswith("These joint velocities do not move tip: j0 ")
    assert not any(line.startswith(("The axes", "All axes")) for line in one.reasons)


def test_a_batch_names_its_configuration() -> None:
    robot = urdfkin.load("ur5")
    values = robot.singular_values([robot.neutral().tolist(), UR5], "tool0")
    assert [bool(values.singularity(k)) for k in (0, 1)] == [True, False]
    assert values._sheet().parts[0].rows[0][-1] == "5 of 6"  # type: ignore[union-attr]
    for sample in ((), (2,), (0, 0)):
        with pytest.raises(InputError, match="no such configuration"):
            values.singularity(*sample)
    assert str(pickle.loads(pickle.dumps(values)).singularity(0)) == str(values.singularity(0))


def test_a_notebook_shows_tables() -> None:
    robot = urdfkin.load("ur5")
    same = urdfkin.same("ur5", "ur5_limited")
    for one in (robot.singular_values(robot.neutral(), "tool0"), robot.screws(), robot.joints, same):
        assert one._repr_html_().startswith("<div>")
    assert "<table>" in robot.joints._repr_html_()
    assert str(same).startswith("SAME: in every configuration no frame is off by more than rounding")
    differs = str(urdfkin.same("ur5", "ur10"))
    assert differs.startswith("DIFFERS by up to 429.7 mm (at most 432.7 mm)")
    assert "tool0           429.7 mm  432.7 mm" in differs
