"""Where yourdfpy and Pinocchio read a URDF differently, urdfkin follows the specification and Pinocchio.

Each test writes down one difference and checks urdfkin's side of it, against Pinocchio where it can say.
"""

import warnings
from typing import Any

import numpy as np
import pytest

import urdfkin
from tests.reading import present
from tests.urdf.lint.cases.arm import LIMIT, arm, base_link, fixed, shape
from tests.urdfs import joint, mimic
from urdfkin.robot import Robot
from urdfkin.verify.verifier import NotVerifiedWarning

TIP = "link:tool"


def verified(text: str, **options: Any) -> Robot:
    """A robot whose every quantity was asked for and verified: one that is not raises."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", urdfkin.UrdfWarning)
        warnings.simplefilter("error", NotVerifiedWarning)
        robot = urdfkin.load(text, **options)
    q = robot.sample(3, seed=1)
    v, a = np.random.default_rng(0).normal(size=(2, 3, robot.nv))
    robot.placement(q, TIP)
    robot.velocity(q, v, TIP)
    robot.jacobian(q, TIP)
    robot.acceleration(q, v, a, TIP)
    assert robot.certificate().verified
    return robot


def test_an_axis_that_is_no_unit_vector_is_normalised() -> None:
    """Yourdfpy moves a prismatic joint with axis 0 0 2 twice as far."""
    robot = verified(arm(attributes='type="prismatic"', axis='<axis xyz="0 0 2"/>'))
    T = robot.placement([[0.0, 0.0], [1.0, 0.0]], TIP)
    assert np.linalg.norm(T[1, :3, 3] - T[0, :3, 3]) == pytest.approx(1.0, abs=1e-15)


@pytest.mark.parametrize("axis", ["1e-9 0 0", "0 1e100 0", "3 4 0", "0.577 0.577 0.577"])
def test_every_axis_with_a_direction_is_a_unit_vector_in_the_tree(axis: str) -> None:
    robot = verified(arm(axis=f'<axis xyz="{axis}"/>'))
    assert np.linalg.norm(robot.tree.joints[0].axis) == pytest.approx(1.0, abs=1e-15)


def test_an_axis_that_is_not_written_is_x() -> None:
    assert verified(arm(axis="")).tree.joints[0].axis.tolist() == [1.0, 0.0, 0.0]


@pytest.mark.parametrize("element", ["<axis/>", '<axis note="z"/>', "<axis><!-- 0 0 1 --></axis>"])
def test_an_axis_element_without_xyz_is_refused_because_two_readers_see_two_robots(element: str) -> None:
    """Urdfdom takes a zero vector, so that Pinocchio's rotation is none; the specification says 1 0 0."""
    with pytest.raises(urdfkin.UrdfError, match="URDF504"):
        urdfkin.load(arm(axis=element))


def test_a_planar_joint_whose_axis_element_is_empty_moves_in_the_xy_plane_for_both() -> None:
    verified(arm(axis="<axis/>", attributes='type="planar"'))


def test_joints_stand_depth_first_and_siblings_by_name_not_as_in_the_file() -> None:
    """Yourdfpy keeps the order of the file."""
    more = '<link name="x"/><joint name="a0" type="continuous"><parent link="base"/><child link="x"/></joint>'
    assert verified(arm(more=more)).joint_names == ("a0", "j1", "j2")


def test_a_follower_takes_no_coordinate_and_is_coupled() -> None:
    """Yourdfpy keeps a coordinate for it in some of its views; Pinocchio throws for some mimic robots."""
    text = arm(follow='<mimic joint="j1" multiplier="-2" offset="0.1"/>')
    robot, free = verified(text), verified(text, mimic=False)
    assert robot.nq == 1
    T = free.placement([0.3, -2 * 0.3 + 0.1], TIP)
    np.testing.assert_allclose(robot.placement([0.3], TIP), T, atol=1e-15)


def test_a_continuous_follower_is_coupled_although_pinocchio_would_let_it_turn() -> None:
    text = arm(second='type="continuous"', follow='<mimic joint="j1"/>')
    assert verified(text.replace(LIMIT + "<mimic", "<mimic")).nq == 1


def test_a_chain_of_followers_is_resolved() -> None:
    third = joint("j3", "revolute", "tool", "x", axis="", more=LIMIT + mimic("j2", 3, 0.5))
    more = f'<link name="x"/>{third}'
    robot = verified(arm(follow='<mimic joint="j1" multiplier="-2" offset="0.1"/>', more=more))
    rule = present(robot.tree.joints[2].mimic)
    assert (rule.leader, rule.multiplier) == ("j1", -6.0)
    assert rule.offset == pytest.approx(3 * 0.1 + 0.5)


def test_a_fixed_followers_mimic_is_ignored() -> None:
    verified(arm(second='type="fixed"', follow='<mimic joint="j1"/>'))


@pytest.mark.parametrize("axis", ['<axis xyz="1 0 0"/>', '<axis xyz="0 0 1"/>', ""])
def test_a_planar_joint_moves_in_its_frames_xy_plane(axis: str) -> None:
    """Yourdfpy does not move planar joints; the specification's normal is ignored as Pinocchio ignores it."""
    robot = verified(arm(attributes='type="planar"', axis=axis, limit="", origin=""))
    assert robot.placement([0.3, -0.2, 0.0, 0.0], "link:l1")[:3, 3].tolist() == [0.3, -0.2, 0.0]


def test_a_floating_joint_has_seven_coordinates_and_six_rates() -> None:
    """Yourdfpy does not move floating joints."""
    robot = verified(arm(attributes='type="floating"', axis="", limit=""))
    assert (robot.nq, robot.nv) == (8, 7)


def test_limits_of_a_continuous_joint_are_ignored() -> None:
    limit = present(verified(arm(attributes='type="continuous"')).tree.joints[0].limit)
    assert (limit.lower, limit.upper) == (-np.inf, np.inf)


def test_a_limit_that_is_not_written_is_zero() -> None:
    robot = verified(arm(limit='<limit upper="1" effort="1" velocity="1"/>'))
    limit = present(robot.tree.joints[0].limit)
    assert (limit.lower, limit.upper) == (0.0, 1.0)


def test_a_quaternion_is_obeyed_from_version_1_1_on() -> None:
    """Yourdfpy ignores it."""
    turned = '<origin xyz="0 0 1" quat_xyzw="0 0 1 1"/>'
    old, new = (verified(arm(origin=turned, robot=f'name="r" {x}')) for x in ("", 'version="1.1"'))
    np.testing.assert_array_equal(old.placement(old.neutral(), "link:l1")[:3, :3], np.eye(3))
    R = new.placement(new.neutral(), "link:l1")[:3, :3]
    np.testing.assert_allclose(R, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15)


STUMBLES = {
    "shape": base_link(shape('<box size="a b"/>')),
    "inertia": base_link('<inertial><inertia ixx="1"/></inertial>'),
    "mass": base_link('<inertial><mass value="x"/></inertial>'),
    "visual": base_link("<visual/>"),
    "namespace": arm(robot='name="r" xmlns="http://example.org"'),
    "nesting": arm(more="<a>" * 400 + "</a>" * 400),
    "colour": arm(more='<material name="m"><color rgba="1 1"/></material>'),
    "doctype": arm(head='<?xml version="1.0"?><!DOCTYPE robot>'),
    "mark": "\ufeff" + arm(),
    "comments": arm(head="<!-- first -->").replace("<parent", "<!-- x --><parent"),
}


@pytest.mark.parametrize("what", STUMBLES)
def test_what_yourdfpy_stumbles_over_is_read_as_pinocchio_reads_it(what: str) -> None:
    verified(STUMBLES[what])


@pytest.mark.parametrize(
    ("text", "code"),
    [
        (arm(origin='<origin xyz="0\t0 1"/>'), "URDF303"),
        (arm(limit='<limit lower="-1" upper="1" effort="-1" velocity="1"/>'), "URDF509"),
        (arm(more='<link name="x"/>' + fixed("universe", "tool", "x")), "URDF404"),
        (arm(more='<link name="a\nb"/>' + fixed("k", "tool", "a\nb")), "URDF406"),
    ],
)
def test_what_pinocchio_cannot_check_is_computed_and_never_called_verified(text: str, code: str) -> None:
    with pytest.warns(urdfkin.UrdfWarning, match=code):
        robot = urdfkin.load(text)
    with pytest.warns(NotVerifiedWarning, match=code):
        T = robot.placement(robot.neutral(), TIP)
    assert np.isfinite(T).all()
    assert not robot.certificate().verified


def test_a_robot_of_one_rate_is_verified_in_every_quantity() -> None:
    """Pinocchio hands out a single column as a plain vector."""
    verified(arm(second='type="fixed"'))


def test_a_robot_as_small_as_a_denormal_number_is_verified() -> None:
    verified(arm(origin='<origin xyz="0 1e-310 3e-167"/>'))
