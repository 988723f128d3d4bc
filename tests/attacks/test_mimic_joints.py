"""Mimic joints: two parsers agree, the oracle has the same angles, and samples are within limits."""

import hashlib
import json
import math
from collections.abc import Iterable

import jsonschema
import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import urdfkin
from tests.reading import tree_of
from tests.urdfs import chain, joint, limit, loaded, mimic
from tests.urdfs import robot as robot_of
from urdfkin.compiled.evaluate import placements
from urdfkin.compiled.plan import compile_tree
from urdfkin.kinematics.roundings import EPS
from urdfkin.model.configuration import draw_samples, range_reductions
from urdfkin.model.tree import without_mimic_rules
from urdfkin.report.html import as_html
from urdfkin.robot import Robot
from urdfkin.urdf.sources import Origin
from urdfkin.validation.campaign import validate
from urdfkin.validation.document import VALIDATION
from urdfkin.validation.robot_summary import describe
from urdfkin.verify.oracle import QueryBatch, parse_mimic_rules

pytestmark = pytest.mark.filterwarnings("ignore::urdfkin.UrdfWarning")


def text(*rules: tuple[object, object]) -> str:
    """Write a chain of continuous joints; each joint after j0 mimics the joint before it."""
    return mimic_chain([(i, *rule) for i, rule in enumerate(rules)], 'xyz="0.3 0.2 0.1" rpy="0.1 0.2 0.3"')


def mimic_chain(rules: Iterable[tuple[int, object, object]], origin: str = 'xyz="0.1 0.2 0.3"') -> str:
    """Write a chain; joint j(i+1) mimics the joint with the number in rule i, with multiplier and offset."""
    return chain(
        ["", *(mimic(f"j{mimicked_joint}", *rule) for mimicked_joint, *rule in rules)], origin=origin
    )


def misread(document: str, wrong: str) -> Robot:
    """Return a robot with the tree of `wrong`, which Pinocchio checks against `document`."""
    return Robot(tree_of(wrong.encode()), document, origin=Origin("<text>"))


#: Angles with a wrong multiplier and offset of a rule with the multiplier 3.
ONE_BIT = (float(np.nextafter(3.0, 4.0)), 0.0)
WRONG = [(1e8, ONE_BIT), (1e12, ONE_BIT), (1e8, (3, 1e-7)), (1e12, (3, 1e-3)), (1e15, (3, 0.5))]


@pytest.mark.parametrize(("q", "wrong"), WRONG)
def test_a_wrong_multiplier_or_offset_is_caught_at_large_angles(q: float, wrong: tuple[float, float]) -> None:
    right, robot = text((3, 0)), misread(text((3, 0)), text(wrong))
    with pytest.raises(urdfkin.VerificationError):
        robot.placement([q], "l2")
    if wrong[1]:
        with pytest.raises(urdfkin.VerificationError):
            robot.acceleration([q], [1.0], [1.0], "l2", "local")
    urdfkin.load(right).placement([q], "l2")


@pytest.mark.slow
@pytest.mark.parametrize("far", [1.0, 1e4, 1e8, 1e12, 1e15])
def test_chains_of_mimic_joints_are_verified_at_any_angle(far: float) -> None:
    rng = np.random.default_rng(int(np.log10(far)))
    for _ in range(5):
        robot = urdfkin.load(text(*rng.normal(size=(4, 2)).tolist()))
        q, v, a = rng.uniform(-far, far, (3, 20, 1))
        robot.placement(q, robot.link_frames)
        robot.jacobian(q, robot.link_frames)
        robot.acceleration(q, v / far, a / far, robot.link_frames)
        assert all(line.bound_ratio < 0.3 for line in robot.certificate().lines)


def test_no_kernel_fuses_the_multiplication_and_the_addition() -> None:
    rng = np.random.default_rng(9)
    for _ in range(10):
        m, c = rng.normal(size=2).tolist()
        robot = urdfkin.load(text((m, c)), verify=False)
        q = rng.uniform(-1e9, 1e9, (64, 1))
        plan = compile_tree(without_mimic_rules(robot.tree), [2])
        alone = placements(plan, np.hstack((q, m * q + c)))[:, 0]
        np.testing.assert_array_equal(robot.placement(q, "l2"), alone)
        np.testing.assert_array_equal(robot.prepare("l2").placement(q[0]), alone[0])


@pytest.mark.parametrize("exponent", [0, 3, 6, 7, 8, 12, 15, 22, 100, 300])
def test_sine_and_cosine_are_accurate_to_the_last_digit_for_angles_of_any_size(exponent: int) -> None:
    # The bound allows one eps for each joint. An angle of 1e300 needs pi with 300 more digits.
    robot = urdfkin.load(text())
    x = np.random.default_rng(exponent).uniform(1.0, 10.0, 60) * 10.0**exponent
    level = urdfkin.load(text().replace('rpy="0.1 0.2 0.3"', ""), verify=False)
    ours = level.placement(x[:, np.newaxis], "l1")
    theirs = level.verifier.oracle().placements(QueryBatch(["l1"], (x[:, np.newaxis],)))[:, 0]
    with mpmath.workdps(50 + exponent):
        for k, angle in enumerate(x.tolist()):
            true = mpmath.cos(mpmath.mpf(angle)), mpmath.sin(mpmath.mpf(angle))
            for side in (ours, theirs):
                for found, value in zip(side[k, :2, 0].tolist(), true, strict=True):
                    assert abs(mpmath.mpf(found) - value) < 0.75 * EPS
    robot.placement(x[:, np.newaxis], "l1")
    assert robot.certificate().verified


# -- rules from two parsers ------------------------------------------------------------------------

numbers = st.floats(-2.0, 2.0).filter(lambda x: x == 0.0 or abs(x) > 1e-3)


@pytest.mark.slow
@settings(max_examples=60)
@given(data=st.data(), n=st.integers(1, 5))
def test_chains_of_mimic_joints_are_resolved_to_the_same_joint_and_rule(data: st.DataObject, n: int) -> None:
    rules = [(data.draw(st.integers(0, i)), data.draw(numbers), data.draw(numbers)) for i in range(n)]
    text = mimic_chain(rules)
    theirs = parse_mimic_rules(text, {f"j{i}" for i in range(n + 1)})
    ours = {joint.name: joint.mimic for joint in tree_of(text.encode()).joints if joint.mimic}
    assert theirs == ours  # the same doubles
    angles = [0.7]  # apply the rules one after the other
    for i, (mimicked_joint, multiplier, offset) in enumerate(rules, start=1):
        angles.append(multiplier * angles[mimicked_joint] + offset)
        for rule in (theirs[f"j{i}"], ours[f"j{i}"]):
            assert rule.mimicked_joint == "j0"
            assert rule.multiplier * 0.7 + rule.offset == pytest.approx(angles[i], abs=1e-12)


TEXT = mimic_chain([(0, 1.5, 0.2), (1, -0.5, 0.1), (0, 2.0, 0.0)])

MISREAD = {
    "a multiplier": ("1.5", "1.500000001"),
    "an offset in the middle of a chain": ('"0.2"', '"0.2000000001"'),
    "whom it follows": ('<mimic joint="j1"', '<mimic joint="j0"'),
    "a rule that was lost": (mimic("j0", 2.0, 0.0), ""),
}


@pytest.mark.parametrize("what", MISREAD)
def test_a_mimic_rule_that_urdfkin_misreads_is_not_verified(what: str) -> None:
    wrong = TEXT.replace(*MISREAD[what])
    assert wrong != TEXT
    robot = misread(TEXT, wrong)
    if robot.nq > 1:
        with pytest.warns(
            urdfkin.NotVerifiedWarning, match="Pinocchio finds different coordinates .*: found j3"
        ):
            robot.placement(robot.neutral(), "l4")
        assert not robot.certificate().verified
        return
    for compute in (robot.placement, robot.jacobian):
        with pytest.raises(urdfkin.VerificationError):
            compute([0.7], "l4")


def test_a_parser_that_loses_all_mimic_rules_is_not_verified() -> None:
    # Only mimic=False of the user removes the rules; a tree without rules is not a request.
    robot = Robot(tree_of(TEXT.encode(), mimic=False), TEXT, origin=Origin("<text>"))
    with pytest.warns(urdfkin.NotVerifiedWarning, match="Pinocchio finds different coordinates"):
        robot.placement(robot.neutral(), "l4")
    free = urdfkin.load(TEXT, mimic=False)
    free.placement([0.1, 0.2, 0.3, 0.4], "l4")
    assert free.certificate().verified


def test_joints_in_a_different_order_and_coordinates_of_other_joints_are_detected() -> None:
    text = robot_of(joint("x", "continuous", "a", "b"), joint("y", "continuous", "a", "c"))
    tree = tree_of(text.replace('"x"', '"z"').encode())  # in this order, x comes after y
    for one in tree.joints:
        if one.name == "z":
            object.__setattr__(one, "name", "x")
    robot = Robot(tree, text, origin=Origin("<text>"))
    assert robot.joint_names == ("y", "x")
    with pytest.warns(
        urdfkin.NotVerifiedWarning, match="different joints .* found the same names in a different order"
    ):
        robot.placement([0.1, 0.2], "b")
    # Both sides once used the tree's assignment of the numbers in q to joints.
    robot = urdfkin.load("ur5")
    first, second, *_ = (i for i, joint in enumerate(robot.tree.joints) if joint.nq)
    places = list(robot.tree.q_index)
    places[first], places[second] = places[second], places[first]
    robot.tree.__dict__["q_index"] = tuple(places)
    with pytest.raises(urdfkin.VerificationError):
        robot.placement(np.arange(6.0), "tool0")


# -- limits ----------------------------------------------------------------------------------------


def gripper(kind: str, bounds: tuple[float, float], *rules: tuple[float, float, float, float]) -> Robot:
    """A robot with a mimicked joint; each rule is (multiplier, offset, lower, upper)."""
    joints = [joint("leader", kind, "l0", "l1", more=limit(*bounds))]
    for i, (multiplier, offset, *own) in enumerate(rules, 1):
        more = limit(*own) + mimic("leader", multiplier, offset)
        joints.append(joint(f"f{i}", "revolute", f"l{i}", f"l{i + 1}", more=more))
    return loaded(robot_of(*joints))


#: Two fingers of a hand; the second one moves opposite to the first.
MIRRORED = ("prismatic", (-0.005, 0.055), (-1.0, 0.0, -0.005, 0.055))


@pytest.mark.parametrize("multiplier", [5.0, -5.0, 1e-3, 1.0 / 3.0, 7e3])
@pytest.mark.parametrize("offset", [0.0, 0.7, -1.0, 900.0])
@pytest.mark.parametrize("kind", ["revolute", "prismatic", "continuous"])
def test_samples_keep_mimic_joints_within_their_limits(kind: str, offset: float, multiplier: float) -> None:
    middle = 0.3 * multiplier + offset  # The value of the mimic joint if the mimicked joint is at 0.3.
    robot = gripper(kind, (-1.0, 1.0), (multiplier, offset, middle - 0.2, middle + 0.9))
    drawn = robot.sample(2000)
    assert robot.limit_violations(drawn) == []
    reached = np.ptp(drawn)
    assert reached >= 0.4 * min(1.1 / abs(multiplier), 2.0), "the range that is left is used"


def test_a_validation_covers_the_whole_range_of_a_mimicked_joint() -> None:
    robot = gripper(*MIRRORED)
    drawn = draw_samples(robot.tree, 2000, np.random.default_rng(0), with_zero_and_limits=True).q
    assert drawn[1:3].tolist() == [[-0.005], [0.055]]
    assert np.ptp(drawn[3:]) > 0.059
    assert np.ptp(robot.sample(2000)) <= 0.01
    robot = gripper("continuous", (0.0, 0.0))
    assert np.ptp(robot.sample(1000)) > 1.99 * math.pi


@pytest.mark.slow
def test_info_data_and_report_state_the_narrowed_range_of_a_mimicked_joint() -> None:
    robot = gripper(*MIRRORED)
    own = "joint leader ranges over -0.005 to 0.055 m"
    allowed = "the limits of its mimic joints (f1) allow only values from -0.005 to 0.005"
    assert f"{own}; {allowed}" in robot._text_document().text()
    kept = [joint["remaining_range"] for joint in describe(robot)["joints"]]
    assert kept == [{"lower": pytest.approx(-0.005), "upper": pytest.approx(0.005), "by": ["f1"]}, None]
    (none,) = range_reductions(gripper("prismatic", (0.0, 1.0), (1.0, 0.0, 3.0, 4.0)).tree)
    assert str(none).endswith("the limits of its mimic joints (f1) allow at most one value")
    document = json.loads(json.dumps(validate([robot], samples=8).as_dict()))
    jsonschema.validate(document, VALIDATION.schema())
    page = as_html(document)
    assert "the mimic joints are within their limits only for values from -0.005 to 0.005 m (f1)." in page
    assert "URDF527" in page


@pytest.mark.slow
@settings(max_examples=100)
@given(
    st.floats(-3.0, 3.0), st.floats(1e-3, 3.0),
    st.lists(st.tuples(st.floats(-9.0, 9.0), st.floats(-2.0, 2.0), st.floats(0.01, 1.0)), max_size=3),
)  # fmt: skip
def test_random_mimic_rules_are_kept_within_limits_if_possible(
    lower: float, width: float, rules: list[tuple[float, float, float]]
) -> None:
    middle = lower + 0.5 * width
    mimic_rules = [(m, o, m * middle + o - half, m * middle + o + half) for m, o, half in rules]
    robot = gripper("prismatic", (lower, lower + width), *mimic_rules)
    assert robot.limit_violations(robot.sample(50)) == []


@pytest.mark.parametrize(
    "rule",
    [(1.0, 0.0, 3.0, 4.0), (-1.0, 0.0, 1.0, 4.0), (0.0, 5.0, -1.0, 1.0)],
    ids=["no common place", "one common point", "a constant outside"],
)
def test_a_mimic_joint_that_is_always_outside_its_limits_is_reported(
    rule: tuple[float, float, float, float],
) -> None:
    robot = gripper("revolute", (-1.0, 1.0), rule)
    q = robot.sample(500)
    assert -1.0 <= q.min() < -0.9
    assert 0.9 < q.max() <= 1.0
    (line,) = robot.limit_violations(q)
    assert line.startswith("joint f1")


DIGESTS = {
    "panda": "42521fd4b67c65a0", "ur5": "cb6bde16c9b2a8f9", "talos": "a2bb0559f21907f0",
    "anymal": "a4048fddd35247c6",
}  # fmt: skip


@pytest.mark.parametrize("name", DIGESTS)
def test_a_seed_gives_the_same_samples_as_in_earlier_versions(name: str) -> None:
    drawn = urdfkin.load(name).sample(20, seed=3)
    assert hashlib.sha256(drawn.tobytes()).hexdigest()[:16] == DIGESTS[name]
