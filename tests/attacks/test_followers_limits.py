"""Samples keep all limits, of mimic joints too; a validation covers each joint's own limits."""

from __future__ import annotations

import hashlib
import json
import math
import warnings

import jsonschema
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import urdfkin
from urdfkin.model.configuration import draw, narrowed_ranges
from urdfkin.report.html import as_html
from urdfkin.robot import Robot
from urdfkin.validation.campaign import validate
from urdfkin.validation.document import VALIDATION
from urdfkin.validation.robot_summary import describe


def gripper(kind: str, bounds: tuple[float, float], *rules: tuple[float, float, float, float]) -> Robot:
    """A leader with bounds and followers, each (multiplier, offset, lower, upper)."""
    links = "".join(f'<link name="l{i}"/>' for i in range(len(rules) + 2))
    limit = '<limit lower="{!r}" upper="{!r}" effort="1" velocity="1"/>'
    joint = '<joint name="{}" type="{}"><parent link="l{}"/><child link="l{}"/><axis xyz="0 0 1"/>{}</joint>'
    joints = joint.format("leader", kind, 0, 1, limit.format(*bounds))
    for i, (multiplier, offset, lower, upper) in enumerate(rules, 1):
        rule = f'<mimic joint="leader" multiplier="{multiplier!r}" offset="{offset!r}"/>'
        joints += joint.format(f"f{i}", "revolute", i, i + 1, limit.format(lower, upper) + rule)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", urdfkin.UrdfWarning)
        return urdfkin.load(f'<robot name="r">{links}{joints}</robot>')


@pytest.mark.parametrize("multiplier", [5.0, -5.0, 1e-3, 1.0 / 3.0, 7e3])
@pytest.mark.parametrize("offset", [0.0, 0.7, -1.0, 900.0])
@pytest.mark.parametrize("kind", ["revolute", "prismatic", "continuous"])
def test_a_leader_stays_where_its_follower_keeps_its_limits(
    kind: str, offset: float, multiplier: float
) -> None:
    middle = 0.3 * multiplier + offset  # where the follower stands with its leader at 0.3
    robot = gripper(kind, (-1.0, 1.0), (multiplier, offset, middle - 0.2, middle + 0.9))
    drawn = robot.sample(2000)
    assert robot.limit_violations(drawn) == []
    reached = np.ptp(drawn)
    wanted = min(1.1 / abs(multiplier), 2.0)
    assert reached >= 0.4 * wanted, "the range that is left is used"


def test_a_validation_covers_the_files_limits_where_a_mimic_joint_leaves_its_own() -> None:
    robot = gripper("prismatic", (-0.005, 0.055), (-1.0, 0.0, -0.005, 0.055))
    drawn = draw(robot.tree, 2000, np.random.default_rng(0), with_special=True).q
    assert drawn[1:3].tolist() == [[-0.005], [0.055]]
    assert np.ptp(drawn[3:]) > 0.059
    assert np.ptp(robot.sample(2000)) <= 0.01


def test_info_and_the_data_say_what_mimic_joints_leave_of_a_range() -> None:
    robot = gripper("prismatic", (-0.005, 0.055), (-1.0, 0.0, -0.005, 0.055))
    said = "joint leader ranges over -0.005 to 0.055 m; its mimic joints keep their limits from -0.005 to "
    assert f"{said}0.005 only (f1)" in robot._sheet().text()
    kept = [joint["kept"] for joint in describe(robot)["joints"]]
    assert kept == [{"lower": pytest.approx(-0.005), "upper": pytest.approx(0.005), "by": ["f1"]}, None]
    (none,) = narrowed_ranges(gripper("prismatic", (0.0, 1.0), (1.0, 0.0, 3.0, 4.0)).tree)
    assert str(none).endswith("no value keeps all its mimic joints within their limits (f1)")


@pytest.mark.slow
def test_the_report_shows_what_mimic_joints_leave_of_a_range() -> None:
    robot = gripper("prismatic", (-0.005, 0.055), (-1.0, 0.0, -0.005, 0.055))
    document = json.loads(json.dumps(validate([robot], samples=8).as_dict()))
    jsonschema.validate(document, VALIDATION.schema())
    page = as_html(document)
    assert "leader: its mimic joints are within limits only from -0.005 to 0.005 m (f1)." in page
    assert "URDF527" in page


@pytest.mark.slow
@settings(max_examples=100)
@given(
    st.floats(-3.0, 3.0), st.floats(1e-3, 3.0),
    st.lists(st.tuples(st.floats(-9.0, 9.0), st.floats(-2.0, 2.0), st.floats(0.01, 1.0)), max_size=3),
)  # fmt: skip
def test_any_followers_keep_their_limits_where_there_is_room(
    lower: float, width: float, rules: list[tuple[float, float, float]]
) -> None:
    middle = lower + 0.5 * width
    followers = [(m, o, m * middle + o - half, m * middle + o + half) for m, o, half in rules]
    robot = gripper("prismatic", (lower, lower + width), *followers)
    assert robot.limit_violations(robot.sample(50)) == []


@pytest.mark.parametrize(
    "rule",
    [(1.0, 0.0, 3.0, 4.0), (-1.0, 0.0, 1.0, 4.0), (0.0, 5.0, -1.0, 1.0)],
    ids=["no common place", "one common point", "a constant outside"],
)
def test_where_there_is_no_room_the_leader_keeps_its_own_limits_and_the_follower_is_named(
    rule: tuple[float, float, float, float],
) -> None:
    robot = gripper("revolute", (-1.0, 1.0), rule)
    q = robot.sample(500)
    assert q.min() < -0.9
    assert q.max() > 0.9
    assert q.min() >= -1.0
    assert q.max() <= 1.0
    (line,) = robot.limit_violations(q)
    assert line.startswith("joint f1")


@pytest.mark.parametrize(
    ("name", "digest"),
    [
        ("panda", "42521fd4b67c65a0"),
        ("ur5", "cb6bde16c9b2a8f9"),
        ("talos", "a2bb0559f21907f0"),
        ("anymal", "a4048fddd35247c6"),
    ],
)
def test_a_seed_gives_the_numbers_it_gave_before_where_followers_cut_nothing(name: str, digest: str) -> None:
    drawn = urdfkin.load(name).sample(20, seed=3)
    assert hashlib.sha256(drawn.tobytes()).hexdigest()[:16] == digest


def test_a_continuous_leader_without_a_followers_limit_takes_any_angle() -> None:
    robot = gripper("continuous", (0.0, 0.0))
    assert np.ptp(robot.sample(1000)) > 1.99 * math.pi
