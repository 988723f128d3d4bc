"""Unusual and random robots agree with Pinocchio in every quantity, frame and reference."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import urdfkin
from tests.laws.subjects import state
from tests.robots.against_pinocchio import assert_agrees
from tests.robots.odd_urdfs import NAMES, random_tree, urdf_of
from tests.urdfs import loaded
from urdfkin.model.reference import Reference
from urdfkin.robot import Robot
from urdfkin.validation.document import ValidationVerdict
from urdfkin.validation.results import RobotReport
from urdfkin.verify.quantities import QUANTITIES

pytestmark = pytest.mark.slow

#: Upper bound on the measured ratios to a bound, because rounding errors rarely add up in the worst way.
USUAL_SHARE = 0.25


def assert_verified(report: RobotReport, robot: Robot, samples: int) -> None:
    """Demand that no check failed, and that the report contains all results of the robot."""
    assert (report.verdict, report.failed, report.reason) == (ValidationVerdict.VERIFIED, 0, None)
    frames = len(robot.tree.links) + len(robot.tree.joints)
    moving = [joint for joint in robot.tree.joints if joint.kind.nv]
    counts = {quantity: sum(stats.results for stats in report.stats_of(quantity)) for quantity in QUANTITIES}
    assert counts["placement"] == samples * frames
    for quantity in ("velocity", "acceleration", "jacobian", "jacobian rate"):
        assert counts[quantity] == 3 * samples * frames, quantity
    assert counts["joint jacobian"] == 3 * samples * len(moving)
    assert counts["screws"] == samples * sum(joint.kind.nv for joint in moving)
    assert max(stats.bound_ratio for stats in report.error_stats.values()) < USUAL_SHARE


WITH_ROOT = product(
    ["mimic_hand_40", "tree_3", "single_link", "one_joint", "fixed_only"], ["planar", "floating"]
)


@pytest.mark.parametrize(("name", "root_joint"), [*product(NAMES, [None]), *WITH_ROOT])
def test_every_quantity_of_every_frame_agrees_with_pinocchio(name: str, root_joint: str | None) -> None:
    text = urdf_of(name)
    report = urdfkin.validate(text, samples=5, root_joint=root_joint).robots[0]
    assert_verified(report, loaded(text, root_joint=root_joint), samples=5 + 3)


@pytest.mark.parametrize("reference", list(Reference))
@pytest.mark.parametrize("name", NAMES)
def test_results_of_an_unusual_robot_agree_with_direct_calls_of_pinocchio(
    name: str, reference: Reference
) -> None:
    robot = loaded(urdf_of(name), verify=False)
    q, v, a = (x[0] for x in state(robot, 1, 3))
    assert_agrees(robot, q, v, a, robot.tip_frame, reference, is_odd=True)


@pytest.mark.parametrize("name", NAMES)
def test_the_certificate_counts_every_checked_call(name: str) -> None:
    robot = loaded(urdf_of(name))
    q, v, a = state(robot, 2, 4)
    frame = robot.tip_frame
    robot.placement(q, frame)
    for reference in Reference:
        robot.velocity(q, v, frame, reference)
        robot.jacobian(q, frame, reference)
        robot.jacobian_rate(q, v, frame, reference)
        robot.acceleration(q, v, a, frame, reference)
    certificate = robot.certificate()
    assert certificate.verified
    counts = {line.quantity: (line.checked, line.unchecked) for line in certificate.lines}
    referred = ("velocity", "jacobian", "jacobian rate", "acceleration")
    assert counts == {"placement": (2, 0), **dict.fromkeys(referred, (6, 0))}


@settings(max_examples=50)
@given(st.integers(1000, 10**9))
def test_any_tree_agrees_with_pinocchio(seed: int) -> None:
    text = random_tree(seed)
    assert_verified(urdfkin.validate(text, samples=10, seed=seed).robots[0], loaded(text), samples=13)


def test_a_name_of_two_different_frames_needs_the_prefix_link_or_joint() -> None:
    robot = loaded(urdf_of("same_names"))
    q = robot.sample(1, 5)[0]
    with pytest.raises(urdfkin.InputError, match=r"write 'link:elbow' or 'joint:elbow'"):
        robot.placement(q, "elbow")
    assert (robot.placement(q, "joint:elbow") == robot.placement(q, "forearm")).all()
    assert (robot.placement(q, "link:elbow") == robot.placement(q, "slide")).all()
    assert (robot.placement(q, "wrist") == robot.placement(q, "joint:wrist")).all()


def test_the_length_of_a_prismatic_axis_does_not_scale_the_displacement() -> None:
    robot = loaded(urdf_of("default_everything"))
    q = np.zeros(4)
    slide = robot.joint_names.index("joint_2")
    at_rest = robot.placement(q, "link_2")[:3, 3]
    q[slide] = 0.25
    assert np.linalg.norm(robot.placement(q, "link_2")[:3, 3] - at_rest) == pytest.approx(0.25, abs=1e-15)
