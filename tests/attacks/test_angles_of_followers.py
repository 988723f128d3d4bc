"""A follower's angle is the same double on both sides: a slip shows, however far the joint has turned."""

import mpmath
import numpy as np
import pytest

import urdfkin
from tests.reading import tree_of
from urdfkin.compiled.evaluate import placements
from urdfkin.compiled.plan import compile_tree
from urdfkin.kinematics.roundings import EPS
from urdfkin.model.tree import freed
from urdfkin.robot import Robot
from urdfkin.urdf.sources import Origin
from urdfkin.verify.oracle import QueryBatch, rules_of_text

pytestmark = pytest.mark.filterwarnings("ignore::urdfkin.UrdfWarning")

FAR = (1.0, 1e4, 1e8, 1e12, 1e15)


def text(*rules: tuple[str, str]) -> str:
    """A chain of continuous joints: j0 leads, each further one follows the one before by its rule."""
    joints = "".join(
        f'<link name="l{i + 1}"/><joint name="j{i}" type="continuous"><parent link="l{i}"/>'
        f'<child link="l{i + 1}"/><origin xyz="0.3 0.2 0.1" rpy="0.1 0.2 0.3"/><axis xyz="0 0 1"/>'
        + (f'<mimic joint="j{i - 1}" multiplier="{rule[0]}" offset="{rule[1]}"/>' if rule else "")
        + "</joint>"
        for i, rule in enumerate([(), *rules])
    )
    return f'<robot name="r"><link name="l0"/>{joints}</robot>'


def misread(document: str, wrong: str) -> Robot:
    """A robot whose own tree was read from `wrong` and which has Pinocchio check it against `document`."""
    return Robot(tree_of(wrong.encode()), document, origin=Origin("<text>"))


def test_a_multiplier_that_is_one_bit_off_is_caught_when_the_joint_has_turned_far() -> None:
    right, wrong = text(("3", "0")), text((repr(float(np.nextafter(3.0, 4.0))), "0"))
    for q in (1e8, 1e12):
        with pytest.raises(urdfkin.VerificationError):
            misread(right, wrong).placement([q], "l2")
        urdfkin.load(right).placement([q], "l2")


@pytest.mark.parametrize(("q", "slip"), [(1e8, 1e-7), (1e12, 1e-3), (1e15, 0.5)])
def test_an_offset_that_slipped_is_caught_when_the_joint_has_turned_far(q: float, slip: float) -> None:
    robot = misread(text(("3", "0")), text(("3", repr(slip))))
    with pytest.raises(urdfkin.VerificationError):
        robot.placement([q], "l2")
    with pytest.raises(urdfkin.VerificationError):
        robot.acceleration([q], [1.0], [1.0], "l2", "local")


@pytest.mark.slow
def test_rules_read_twice_and_multiplied_out_twice_are_the_same_doubles() -> None:
    rng = np.random.default_rng(5)
    for _ in range(200):
        rules = [tuple(map(repr, rng.normal(size=2).tolist())) for _ in range(4)]
        document = text(*((multiplier, offset) for multiplier, offset in rules))
        tree = tree_of(document.encode())
        again = rules_of_text(document, [joint.name for joint in tree.joints])
        assert {joint.name: joint.mimic for joint in tree.joints if joint.mimic} == again


@pytest.mark.slow
@pytest.mark.parametrize("far", FAR)
def test_chains_of_followers_are_verified_however_far_they_have_turned(far: float) -> None:
    rng = np.random.default_rng(int(np.log10(far)))
    for _ in range(5):
        rules = [tuple(map(repr, rng.normal(size=2).tolist())) for _ in range(4)]
        robot = urdfkin.load(text(*((multiplier, offset) for multiplier, offset in rules)))
        q, v, a = rng.uniform(-far, far, (3, 20, 1))
        robot.placement(q, robot.link_frames)
        robot.jacobian(q, robot.link_frames)
        robot.acceleration(q, v / far, a / far, robot.link_frames)
        assert all(line.share < 0.3 for line in robot.certificate().lines)


def test_no_kernel_fuses_the_multiplication_and_the_addition() -> None:
    rng = np.random.default_rng(9)
    for _ in range(10):
        m, c = rng.normal(size=2).tolist()
        robot = urdfkin.load(text((repr(m), repr(c))), verify=False)
        q = rng.uniform(-1e9, 1e9, (64, 1))
        free = freed(robot.tree)
        alone = placements(compile_tree(free, [2]), np.hstack((q, m * q + c)))[:, 0]
        np.testing.assert_array_equal(robot.placement(q, "l2"), alone)
        np.testing.assert_array_equal(robot.prepare("l2").placement(q[0]), alone[0])


@pytest.mark.parametrize("exponent", [0, 3, 6, 7, 8, 12, 15, 22, 100, 300])
def test_sine_and_cosine_are_right_to_the_last_digit_for_angles_of_any_size(exponent: int) -> None:
    # What the bound grants a joint for both: one eps. An angle of 1e300 needs 1e300's digits of pi.
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
