"""The judge reads decimals, is right to fifty digits, and finds an error of a few units in the last place."""

import numpy as np
import pytest

import urdfkin
from tests.high_precision import mp as independent
from tests.high_precision import rate, second_rate
from tests.text.robots import motion
from urdfkin.exact import recursion as exact_recursion
from urdfkin.exact.decimals import read_exact
from urdfkin.exact.vectors import exact, mp
from urdfkin.judge import Errors, Line, judge
from urdfkin.recursion import evaluate
from urdfkin.reference import Reference
from urdfkin.tree import FloatArray
from urdfkin.verification.bounds import Quantity

#: One of each kind: arms, a hand with followers, humanoids, a quadruped, a mobile base, CAD exports.
ROBOTS = (
    "panda", "ur5", "xarm7", "kinova", "allegro_left_hand", "tiago_pro", "talos", "icub", "anymal", "so100",
    "polar",
)  # fmt: skip


def exact_motion(name: str, q: FloatArray, v: FloatArray, a: FloatArray) -> exact_recursion.Motion:
    robot = urdfkin.load(name)
    joints = read_exact(robot.urdf, robot.tree)
    return exact_recursion.move(robot.tree, joints, *([exact(x) for x in row] for row in (q, v, a)))


def test_decimals_are_read_as_they_are_written_not_as_the_nearest_doubles() -> None:
    robot = urdfkin.load("planar_two_link")
    joints = read_exact(robot.urdf, robot.tree)
    assert joints[2].p[0] == mp.mpf("0.4")
    assert joints[2].p[0] != mp.mpf(0.4)


def test_it_agrees_to_far_more_digits_than_a_double_has_with_derivatives_of_the_elbow() -> None:
    # The elbow's decimals are doubles in the other source: 0.6, 0.5 and 0.45 are put in as such here too.
    moving = motion("elbow", 12)
    text = urdfkin.load("elbow").urdf
    for word in ("0.6", "0.5", "0.45"):
        text = text.replace(f" {word}", f" {independent.nstr(independent.mpf(float(word)), 60)}")
        text = text.replace(f'"{word}', f'"{independent.nstr(independent.mpf(float(word)), 60)}')
    tree = urdfkin.load("elbow").tree
    numbers = ([exact(x) for x in row] for row in (moving.q, moving.v, moving.a))
    state = exact_recursion.move(tree, read_exact(text, tree), *numbers).states[tree.link_index("wrist")]
    # The other source differentiates with a step of 1e-18 at 60 digits.
    expected = (
        (state.p, moving.d(6)(0), 1e-45),
        (state.vel, rate(moving.d(6), 0.0), 1e-33),
        (state.acc, second_rate(moving.d(6), 0.0), 1e-22),
    )
    for found, derivative, room in expected:
        for row in range(3):
            assert abs(found[row] - derivative[row]) < room


def test_the_rate_of_the_jacobian_is_its_difference_quotient_to_many_digits() -> None:
    moving = motion("polar", 13)
    step = mp.mpf(10) ** -15
    robot = urdfkin.load("polar")
    joints, link = read_exact(robot.urdf, robot.tree), robot.tree.link_index("slider")
    v = [exact(x) for x in moving.v]

    def at(t: object) -> exact_recursion.Motion:
        q = [exact(x) + t * rate for x, rate in zip(moving.q, v, strict=True)]
        return exact_recursion.move(robot.tree, joints, q, v, v)

    for reference in Reference:
        ahead, behind = (exact_recursion.jacobian(at(t), link, reference) for t in (step, -step))
        found = exact_recursion.jacobian_rate(at(mp.mpf(0)), link, reference)
        for column, after, before in zip(found, ahead, behind, strict=True):
            for x, late, early in zip(column, after, before, strict=True):
                assert abs(x - (late - early) / (2 * step)) < 1e-25


@pytest.mark.parametrize(
    ("name", "root_joint"), [("ur3_gripper", None), ("anymal", "floating"), ("solo8", "planar")]
)
def test_it_judges_followers_and_free_joints_too(name: str, root_joint: str | None) -> None:
    robot = urdfkin.load(name, root_joint=root_joint)
    for line in judge(robot, samples=1).lines:
        assert line.urdfkin.worst < 40.0, line
        assert line.pinocchio.worst < 40.0, line


def test_an_error_of_sixteen_units_in_the_last_place_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    right = {line.quantity: line for line in judge(urdfkin.load("ur5"), samples=2).lines}
    original = evaluate.placements

    def wrong(*args: object, **kwargs: object) -> FloatArray:
        return original(*args, **kwargs) * (1.0 + 16.0 * np.finfo(np.float64).eps)  # type: ignore[arg-type]

    monkeypatch.setattr(evaluate, "placements", wrong)
    found = {line.quantity: line for line in judge(urdfkin.load("ur5"), samples=2).lines}
    assert not right[Quantity.PLACEMENT].ours_is_worse
    assert found[Quantity.PLACEMENT].ours_is_worse
    assert found[Quantity.PLACEMENT].urdfkin.worst == pytest.approx(16.0, rel=0.2)
    assert found[Quantity.PLACEMENT].pinocchio == right[Quantity.PLACEMENT].pinocchio


def test_the_same_seed_gives_the_same_judgement() -> None:
    first, again = (judge(urdfkin.load("polar"), samples=3, seed=4).as_dict() for _ in range(2))
    assert first == again
    assert first != judge(urdfkin.load("polar"), samples=3, seed=5).as_dict()


def test_worse_means_by_more_than_a_factor_of_two() -> None:
    def line(ours: float, theirs: float) -> Line:
        return Line(Quantity.VELOCITY, "local", 1, Errors(ours, ours), Errors(theirs, theirs))

    assert line(2.1, 1.0).ours_is_worse
    assert not line(1.9, 1.0).ours_is_worse


@pytest.mark.parametrize(
    ("ours", "theirs", "worse"),
    [
        ((6.1, 1.0), (3.0, 1.0), True),
        ((6.0, 1.0), (3.0, 1.0), False),
        ((3.0, 0.61), (3.0, 0.3), True),
        ((3.0, 0.6), (3.0, 0.3), False),
        ((0.9, 0.9), (0.5, 0.5), False),
    ],
)
def test_the_worst_and_the_typical_error_are_each_held_against_their_own(
    ours: tuple[float, float], theirs: tuple[float, float], worse: bool
) -> None:
    line = Line(Quantity.VELOCITY, "local", 1, Errors(*ours), Errors(*theirs))
    assert line.ours_is_worse == worse


@pytest.mark.slow
@pytest.mark.parametrize("name", ROBOTS)
def test_urdfkin_is_never_the_worse_of_the_two_by_more_than_a_factor_of_two(name: str) -> None:
    for line in judge(urdfkin.load(name), samples=5).lines:
        assert not line.ours_is_worse, line
