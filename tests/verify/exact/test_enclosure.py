"""An enclosure contains the true values, computed with fifty digits, of every quantity in every reference."""

import io
import re
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import redirect_stdout
from fractions import Fraction
from pathlib import Path

import flint
import numpy as np
import pytest

import urdfkin
from tests import urdfs
from tests.attacks.test_extreme_numbers import quaternions, turned_chain
from tests.high_precision import mp, true_motion
from tests.laws.subjects import by_the_robot, robot_of, state
from tests.laws.test_mutation import with_a_mistake
from tests.reading import present
from tests.urdfs import joint, limit, mimic
from urdfkin import BaseMotion, Reference
from urdfkin.errors import InputError, NotFiniteError, UnknownNameError
from urdfkin.kinematics.rotation import exp_rotation
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.verify.exact import recursion
from urdfkin.verify.exact.enclosure import Enclosure, Enclosures
from urdfkin.verify.exact.recursion import ExactMotion
from urdfkin.verify.oracle import QueryBatch
from urdfkin.verify.quantities import QUANTITIES

pytestmark = pytest.mark.filterwarnings("ignore::urdfkin.UrdfWarning")

ROBOTS = (
    "panda", "a1", "floating_root", "planar_and_floating_in_the_middle", "two_floating_in_a_row",
    "followers_of_followers", "mimic_hand_40_sliding", "default_everything", "sizes",
    *(f"tree_{seed}" for seed in range(8)),
)  # fmt: skip
Sample = tuple[FloatArray, FloatArray, FloatArray]


def sample(robot: Robot, seed: int = 0) -> Sample:
    q, v, a = state(robot, 1, seed)
    return q[0], v[0], a[0]


def moving_base(seed: int) -> BaseMotion:
    generator = np.random.default_rng(seed)
    T = np.eye(4)
    T[:3, :3] = np.round(exp_rotation(generator.normal(size=3)), 9)
    T[:3, 3] = generator.normal(size=3)
    return BaseMotion(T, generator.normal(size=6), generator.normal(size=6))


def quantities(x: Enclosures) -> tuple[Enclosure, ...]:
    return x.placement, x.velocity, x.acceleration, x.jacobian, x.jacobian_rate


def holds(enclosure: Enclosure, motion: ExactMotion, link: int, reference: Reference) -> bool:
    """Return whether the true values of the motion lie in the intervals."""
    true = QUANTITIES[enclosure.quantity].enclose(motion, link, reference)
    rows = zip(enclosure.lower.flat, true.flat, enclosure.upper.flat, strict=True)
    return all(mp.mpf(low) <= mp.mpf(number) <= mp.mpf(high) for low, number, high in rows)


@pytest.mark.slow
@pytest.mark.parametrize("moves", [False, True], ids=["standing", "moving"])
@pytest.mark.parametrize("name", ROBOTS)
def test_every_result_at_fifty_digits_lies_in_the_interval_at_any_precision(name: str, moves: bool) -> None:
    robot = robot_of(name)
    x, base = sample(robot), moving_base(3) if moves else None
    link = int(np.random.default_rng(len(robot.tree.links)).integers(1, len(robot.tree.links)))
    motion = true_motion(robot, x, base)
    for reference in Reference:
        widest = np.inf
        for digits in (15, 40):
            enclosed = robot.enclose(*x, robot.tree.link_frames[link], reference, base=base, digits=digits)
            for one in quantities(enclosed):
                assert holds(one, motion, link, reference), (digits, one)
            before, widest = widest, max(float(one.width.max(initial=0.0)) for one in quantities(enclosed))
            assert widest <= before


@pytest.mark.slow
def test_robots_with_quaternions_or_a_root_joint_are_enclosed() -> None:
    for robot in (
        urdfkin.load(turned_chain(quaternions(1.7), 'version="1.1"'), verify=False),
        robot_of("tree_1", root_joint="floating"),
        robot_of("one_joint", root_joint="planar"),
    ):
        x, link = sample(robot), robot.tree.frame_link(robot.tip_frame)
        motion = true_motion(robot, x)
        for one in quantities(robot.enclose(*x, robot.tip_frame, "local")):
            assert holds(one, motion, link, Reference.LOCAL), one


@pytest.mark.slow
@pytest.mark.parametrize("name", ["panda", "tree_3", "tree_5", "mimic_hand_40_sliding", "deep_with_fixed"])
def test_the_ends_of_intervals_are_adjacent_doubles_at_the_default_precision(name: str) -> None:
    robot = robot_of(name)
    for one in quantities(robot.enclose(*sample(robot), robot.tip_frame)):
        # A true number that is itself a double may lie between the ends.
        next_ones = one.upper <= np.nextafter(one.lower, np.inf)
        assert (next_ones | (one.width <= 2.0 * np.spacing(np.abs(one.upper))) | (one.width < 1e-25)).all()
        assert next_ones.mean() > 0.8


@pytest.mark.slow
@pytest.mark.parametrize("name", ["panda", "ur5", "tree_2", "floating_root"])
def test_nearly_all_results_in_doubles_lie_in_intervals_of_15_digits(name: str) -> None:
    robot = urdfkin.load("ur5", verify=False) if name == "ur5" else robot_of(name)
    x, frame = sample(robot), robot.tip_frame
    for reference in Reference:
        enclosed = robot.enclose(*x, frame, reference, digits=15)
        results, inside = dict(by_the_robot(robot, frame, *x)), []
        for one in quantities(enclosed):
            what = "placement" if one is enclosed.placement else f"{one.quantity} {reference.name}"
            assert (one.urdfkin == results[what]).all()
            assert one.pinocchio is not None
            inside += [one.contains(one.urdfkin).ravel(), one.contains(one.pinocchio).ravel()]
        # Intervals may be exact where urdfkin and Pinocchio round.
        assert np.concatenate(inside).mean() > 0.97


@pytest.mark.parametrize("base", [None, moving_base(1)], ids=["standing", "moving"])
def test_an_enclosure_contains_the_results_of_the_pinocchio_oracle(base: BaseMotion | None) -> None:
    robot = robot_of("panda")
    x, frame = sample(robot), robot.tip_frame
    enclosed = robot.enclose(*x, frame, "world", base=base)
    asked = QueryBatch([frame], tuple(row[np.newaxis] for row in x), Reference.WORLD, base)
    oracle = robot.verifier.oracle(base)
    assert (enclosed.acceleration.pinocchio == oracle.accelerations(asked)[0, 0]).all()
    assert (enclosed.placement.pinocchio == oracle.placements(asked)[0, 0]).all()


#: A term of an equation and the quantity that the equation computes, by the name of the equation.
MISTAKES = {
    "centripetal": ("cross(w, cross(w, d))", "acceleration"),
    "angular_acceleration": ("times(v, cross(w, z))", "acceleration"),
    "turning_column": ("cross(z, d)", "jacobian"),
    "turning_column_rate": ("cross(z, d_rate)", "jacobian rate"),
}


@pytest.mark.slow
@pytest.mark.parametrize("equation", MISTAKES)
def test_results_of_wrong_equations_lie_outside_the_interval(
    equation: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot, (term, quantity) = robot_of("panda"), MISTAKES[equation]
    x, frame = sample(robot), robot.tip_frame
    monkeypatch.setattr(recursion._RECURSION, "eq", with_a_mistake(equation, term))
    for one in quantities(robot.enclose(*x, frame, digits=15)):
        assert one.pinocchio is not None
        if one.quantity == quantity:
            assert not one.contains(one.urdfkin).all()
            assert not one.contains(one.lower - 1e-3).any()
            assert not one.contains(one.pinocchio).all()


#: Prismatic joints with exact and with rounded numbers.
GANTRY = urdfs.robot(
    joint("x", "prismatic", "a", "b", 'xyz="0.5 0.25 0"', "2 0 0", limit()),
    joint("y", "prismatic", "b", "c", 'xyz="0 0 0.1"', "0 3 4", limit()),
    name="gantry",
)


def test_an_exact_result_has_zero_width_and_a_decimal_lies_between_adjacent_doubles() -> None:
    robot = urdfkin.load(GANTRY)
    first, second = (robot.enclose([0.75, 0.5], [1.0, 5.0], [0.5, 0.0], frame) for frame in "bc")
    assert [one.width.max() for one in quantities(first)] == [0.0] * 5
    assert first.placement.lower[:3, 3].tolist() == [1.25, 0.25, 0.0]
    assert first.acceleration.upper.tolist() == [0.5, 0.0, 0.0, 0.0, 0.0, 0.0]
    # 0.1 + 0.5 * 0.8 is the double 0.5, but the decimal 0.1 is an interval; 0.25 + 0.5 * 0.6 is not a double.
    low, high = second.placement.lower[:3, 3], second.placement.upper[:3, 3]
    assert (low[0], high[0]) == (1.25, 1.25)
    assert low[1] < high[1] == np.nextafter(low[1], 1.0)
    assert low[2] < 0.5 < high[2]
    assert high[2] - low[2] < 2e-16
    assert second.jacobian.contains(np.array([[1.0, 0, 0, 0, 0, 0], [0, 0.6, 0.8, 0, 0, 0]]).T).all()


def test_the_stated_error_of_a_result_is_rounded_upward() -> None:
    generator = np.random.default_rng(3)
    x, lower = generator.normal(size=(2, 200)) * 10.0 ** generator.integers(-9, 9, (2, 200))
    upper = np.nextafter(lower, np.inf)
    errors = Enclosure("velocity", lower, upper, x, None).error_bound(x)
    for error, *numbers in zip(errors, x, lower, upper, strict=True):
        number, low, high = map(Fraction, numbers)
        largest = max(abs(number - low), abs(number - high))
        assert largest <= Fraction(error) <= largest * (1 + Fraction(2) ** -51)
    assert Enclosure("velocity", x, x, x, None).error_bound(x).tolist() == [0.0] * 200


@pytest.mark.slow
@pytest.mark.parametrize("name", ["tree_1", "one_joint"])
def test_a_hessian_is_enclosed_on_request(name: str) -> None:
    robot = robot_of(name)
    x, link = sample(robot), robot.tree.frame_link(robot.tip_frame)
    motion = true_motion(robot, x)
    assert robot.enclose(*x, robot.tip_frame).hessian is None
    for reference in Reference:
        one = present(robot.enclose(*x, robot.tip_frame, reference, hessian=True).hessian)
        assert holds(one, motion, link, reference)
        assert ((one.width <= 2.0 * np.spacing(np.abs(one.upper))) | (one.width < 1e-25)).mean() > 0.8
        assert one.error_bound(robot.hessian(x[0], robot.tip_frame, reference)).max() < 1e-14


#: A joint, a joint that mimics it, and a joint that mimics the second one.
FOLLOWERS = urdfs.robot(
    joint("x", "revolute", "a", "b", more=limit()),
    joint("y", "revolute", "b", "c", 'xyz="0.5 0.1 0"', "0 1 0", mimic("x", -2.5, 0.2) + limit(-3, 3)),
    joint("z", "prismatic", "c", "d", 'xyz="0.3 0 0.2"', "1 0 0", mimic("y", 0.3) + limit()),
    name="followers",
)


@pytest.mark.parametrize("reference", list(Reference))
def test_a_hessian_with_two_mimic_joints_is_enclosed_with_both_multipliers(reference: Reference) -> None:
    robot, x = urdfkin.load(FOLLOWERS), (np.array([0.3]), np.array([1.0]), np.array([0.5]))
    one = present(robot.enclose(*x, "d", reference, hessian=True).hessian)
    assert one.error_bound(robot.hessian(x[0], "d", reference)).max() < 1e-14
    # With one joint velocity v = 1, J-dot = H v.
    rate = QUANTITIES["jacobian rate"].enclose(true_motion(robot, x), robot.tree.frame_link("d"), reference)
    assert np.abs((one.lower[..., 0] - rate).astype(float)).max() < 1e-15


def test_threads_with_different_digits_change_neither_results_nor_the_users_precision() -> None:
    robot = robot_of("panda")
    x, asked = sample(robot), (15, 300) * 20

    def ends(digits: int) -> bytes:
        return robot.enclose(*x, robot.tip_frame, digits=digits).acceleration.upper.tobytes()

    alone = {digits: ends(digits) for digits in asked}
    assert len(set(alone.values())) == 2
    before, interval = flint.ctx.prec, sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    try:
        with ThreadPoolExecutor(4) as pool:
            assert list(pool.map(ends, asked)) == [alone[digits] for digits in asked]
    finally:
        sys.setswitchinterval(interval)
    assert flint.ctx.prec == before


def test_a_robot_that_pinocchio_refuses_can_be_enclosed() -> None:
    robot = robot_of("panda")
    robot.verifier.known_refusal = "it was told to"
    enclosed = robot.enclose(*sample(robot), robot.tip_frame)
    assert enclosed.jacobian.pinocchio is None
    assert "Pinocchio" not in str(enclosed)


def test_the_text_of_an_enclosure_lists_intervals_widths_and_contained_results() -> None:
    lines = str(urdfkin.load(GANTRY).enclose([0.75, 0.5], [1.0, 5.0], [0.5, 0.0], "b")).splitlines()
    assert lines[0] == "b in local_world_aligned, proven with 31 digits"
    assert lines[3] == (
        "  acceleration: 6 intervals, at most 0.0e+00 wide; inside: 6 numbers of urdfkin, 6 of Pinocchio"
    )
    assert len(lines) == 6


def test_invalid_input_of_an_enclosure_is_a_clear_error() -> None:
    robot = robot_of("panda")
    q, v, a = sample(robot)
    with pytest.raises(InputError, match=r"an enclosure needs one sample: found a batch of shape \(2,\)"):
        robot.enclose(np.stack([q, q]), v, a, robot.tip_frame)
    with pytest.raises(InputError, match="digits must be at least 15"):
        robot.enclose(q, v, a, robot.tip_frame, digits=14)
    with pytest.raises(NotFiniteError, match="v must be finite"):
        robot.enclose(q, v * np.nan, a, robot.tip_frame)
    with pytest.raises(UnknownNameError, match="panda_hand"):
        robot.enclose(q, v, a, "panda_hond")
    enclosed = robot.enclose(q, v, a, robot.tip_frame)
    with pytest.raises(InputError, match=r"the velocity has the shape \(6,\)"):
        enclosed.velocity.contains(np.zeros(5))


def test_a_robot_without_joints_has_jacobians_without_columns() -> None:
    robot = robot_of("fixed_only")
    enclosed = robot.enclose([], [], [], robot.tip_frame, base=moving_base(4))
    assert enclosed.jacobian.lower.shape == (6, 0)
    assert enclosed.velocity.contains(robot.velocity([], [], robot.tip_frame, base=moving_base(4))).any()


def test_the_example_on_the_page_of_enclosures_prints_the_stated_output() -> None:
    page = (Path(__file__).parents[3] / "docs" / "enclosures.md").read_text("utf-8")
    code, printed = re.findall(r"```(?:python|text)\n(.*?)```", page, re.DOTALL)
    names: dict[str, Enclosures] = {}
    with redirect_stdout(io.StringIO()) as out:
        exec(code, names)
    # The number of urdfkin's values inside depends on last digits.
    assert re.sub(r"\d+ of urdfkin's", "", out.getvalue()) == re.sub(r"\d+ of urdfkin's", "", printed)
