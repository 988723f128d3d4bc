"""Very small and very large inputs: correct results are returned and verified, others raise RangeError."""

import math
import re
import shlex
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import urdfkin
from tests.cli.running import urdfkin as command
from tests.urdfs import chain, joint, limit, loaded, mimic
from tests.urdfs import robot as robot_of
from urdfkin.compiled import breakdown
from urdfkin.compiled.breakdown import AccelerationBreakdown
from urdfkin.compiled.plan import LANES
from urdfkin.compiled.python_numbers import NO_OVERFLOW_BOUND
from urdfkin.errors import InputError, NotFiniteError, RangeError
from urdfkin.kinematics.number_kinds import product
from urdfkin.kinematics.roundings import EPS, SMALLEST_NORMAL, SMALLEST_SUBNORMAL
from urdfkin.model.base_motion import FIXED_BASE_STATE, BaseMotion
from urdfkin.model.tree import FloatArray, pose
from urdfkin.robot import Robot
from urdfkin.validation.accuracy import accuracy_study
from urdfkin.verify.bounds import compute_magnitudes
from urdfkin.verify.exact.numbers import precision, read_exact_joints
from urdfkin.verify.quantities import VELOCITY
from urdfkin.verify.singular_values import singular_values

#: A robot with joints of each kind and two mimic joints.
ODD = robot_of(
    joint("a", "planar", "l0", "l1", 'xyz="0.1 0.2 0.3" rpy="0.3 0.4 0.5"'),
    joint("b", "continuous", "l1", "l2", 'xyz="0.3 -0.2 0.1" rpy="0.1 0.2 0.3"', "1 2 3"),
    joint("c", "prismatic", "l2", "l3", 'xyz="0 0 1e-310" rpy="1 2 3"', "0 1 1", limit()),
    joint("d", "floating", "l3", "l4", 'rpy="1 0 0"', ""),
    joint("e", "continuous", "l4", "l5", 'xyz="0.3 0 0"', more=mimic("b", -1e-5, 0.2)),
    joint("f", "prismatic", "l5", "l6", 'xyz="0 0.2 0" rpy="0 1 0"', more=limit() + mimic("c", 3)),
    name="odd",
)
pytestmark = pytest.mark.filterwarnings("ignore::urdfkin.UrdfWarning")
#: Coordinates of the robot above that are lengths.
LENGTHS = [0, 1, 4, 5, 6, 7]
REFERENCES = ("local", "world", "local_world_aligned")


def worst_error(robot: Robot, samples: int = 3) -> float:
    """Return the largest error of a result of urdfkin or Pinocchio, in the units of the accuracy study."""
    lines = accuracy_study(robot, samples=samples).lines
    return max(max(line.urdfkin.worst, line.pinocchio.worst) for line in lines)


def numbers(rng: np.random.Generator, exponent: int, size: int) -> FloatArray:
    wide: FloatArray = rng.normal(size=size) * np.exp2(math.log2(10.0) * exponent)
    wide[rng.random(size) < 0.2] = 0.0
    return wide


def everything(robot: Robot, q: FloatArray, v: FloatArray, a: FloatArray, base: BaseMotion | None) -> int:
    """Compute each quantity of the last link in each reference; return the number of RangeErrors."""
    beyond = 0
    methods: list[tuple[Any, ...]] = [(x, q) for x in (robot.placement, robot.jacobian, robot.hessian)]
    methods += [(x, q, v) for x in (robot.velocity, robot.jacobian_rate)]
    methods += [(x, q, v, a) for x in (robot.acceleration, robot.acceleration_breakdown)]
    for reference in REFERENCES:
        for method, *inputs in methods:
            try:
                method(*inputs, "l6", *([reference] if method != robot.placement else []), base=base)
            except RangeError:
                beyond += 1
    return beyond


exponents = st.integers(-323, 300)


@pytest.mark.long
@settings(max_examples=150)
@given(st.tuples(*[exponents] * 6), st.booleans(), st.integers(0, 2**32 - 1))
def test_results_for_inputs_of_any_size_are_verified_or_raise_range_error(
    sizes: tuple[int, ...], moving: bool, seed: int
) -> None:
    robot = urdfkin.load(ODD)
    rng = np.random.default_rng(seed)
    q = robot.sample(1, seed % 1000)[0]
    q[LENGTHS] = numbers(rng, sizes[0], len(LENGTHS))
    v, a = numbers(rng, sizes[1], robot.nv), numbers(rng, sizes[2], robot.nv)
    fields = pose(p=numbers(rng, sizes[3], 3)), numbers(rng, sizes[4], 6), numbers(rng, sizes[5], 6)
    base = BaseMotion(*fields) if moving else None
    beyond = everything(robot, q, v, a, base)
    used = sizes if moving else sizes[:3]
    if max(used) < 75:  # With inputs of this size, no product of three or four inputs overflows.
        assert beyond == 0


@pytest.mark.long
@settings(max_examples=60)
@given(st.integers(-323, -140), st.integers(-2, 2), st.integers(0, 2**32 - 1))
def test_tiny_velocities_at_ordinary_coordinates_are_verified(rate: int, length: int, seed: int) -> None:
    robot = urdfkin.load(ODD)
    rng = np.random.default_rng(seed)
    q = robot.sample(1, seed % 1000)[0]
    q[LENGTHS] = numbers(rng, length, len(LENGTHS))
    assert everything(robot, q, numbers(rng, rate, robot.nv), numbers(rng, rate, robot.nv), None) == 0


PLANAR = robot_of(joint("f", "planar", "a", "b", 'rpy="0.3 0.4 0.5"'))


@pytest.mark.parametrize("size", [1e-323, 1e-310, 1e-200, 1e-170, 1e-154])
def test_velocities_whose_squares_underflow_are_verified_with_a_small_bound(size: float) -> None:
    robot = urdfkin.load(PLANAR)
    q, v = np.array([[0.0, 0.0, 0.7]]), np.array([[size, 2.0 * size, 0.0]])
    robot.velocity(q[0], v[0], "b")
    assert robot.certificate().verified
    plan = robot.plan([1])
    sizes = compute_magnitudes(plan, q, v, None, FIXED_BASE_STATE)
    bound = VELOCITY.bound(plan, sizes, urdfkin.Reference.LOCAL_WORLD_ALIGNED)
    allowed = float((bound.k * np.maximum(EPS * bound.scale, SMALLEST_SUBNORMAL)).max())
    assert allowed <= 100.0 * max(EPS * math.hypot(size, 2.0 * size), SMALLEST_SUBNORMAL)


@pytest.mark.parametrize("size", [1e155, 1e160, 1e200, 1e300])
def test_a_position_whose_square_overflows_is_verified(size: float) -> None:
    robot = urdfkin.load(PLANAR)
    assert np.isfinite(robot.placement([size, 0.0, 0.7], "b")).all()
    assert np.isfinite(robot.velocity([size, 0.0, 0.7], [size, 1.0, 0.0], "b")).all()
    base = BaseMotion(pose(p=np.full(3, size / 2)))
    assert np.isfinite(robot.placement([0.0, 0.0, 0.7], "b", base=base)).all()
    assert robot.certificate().verified


def test_products_and_magnitudes_are_zero_only_if_a_factor_is_zero() -> None:
    x = np.array([0.0, 1e-200, 1e-200, 5e-324, 1.0, 0.0])
    y = np.array([1e-200, 1e-200, 1e-50, 5e-324, 2.0, 0.0])
    assert product(x, y).tolist() == [0.0, SMALLEST_NORMAL, 1e-200 * 1e-50, SMALLEST_NORMAL, 2.0, 0.0]
    robot = urdfkin.load("panda")
    q = robot.neutral()
    robot.velocity(q, np.zeros(robot.nv), "panda_hand")
    size = compute_magnitudes(
        robot.plan([5]), q[np.newaxis], np.zeros((1, robot.nv)), None, np.zeros((1, 24))
    )
    assert not size.vel.any()
    assert not size.w.any()
    assert "velocity" in [line.quantity for line in robot.certificate().lines]


# -- failures found by scripts/fuzz.py -------------------------------------------------------------


def two_axes(first: float, second: float) -> str:
    return robot_of(
        joint("x", "continuous", "a", "b", f'xyz="{first!r} 0 0.1" rpy="1 0.2 0.3"'),
        joint("y", "continuous", "b", "c", f'xyz="{second!r} 0.1 0.2" rpy="1 0.2 0.3"', "0 0.6 0.8"),
    )


@pytest.mark.parametrize(("first", "second"), [(1e155, 0.3), (0.3, -1e200), (1e300, 1e300)])
@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_dh_raises_range_error_for_lengths_whose_squares_overflow(
    first: float, second: float, convention: str
) -> None:
    robot = urdfkin.load(two_axes(first, second))
    with pytest.raises(RangeError, match=r"joint [xy]: .*square of this length"):
        robot.dh("c", "a", convention)
    if first == 1e155:  # The path is short, but Pinocchio starts at the root.
        with pytest.raises(RangeError, match="joint x"):
            robot.dh("c", "b", convention)
    assert robot.placement(robot.neutral(), "c").shape == (4, 4)


def test_dh_and_tree_parameters_accept_the_largest_lengths_whose_squares_are_finite() -> None:
    with pytest.raises(RangeError, match="square of this length"):
        urdfkin.load(two_axes(1e160, 0.3)).tree_parameters()
    robot = urdfkin.load(two_axes(1e148, 1e147))
    for convention in ("standard", "modified"):
        robot.dh("c", "a", convention)
        robot.dh("c", "b", convention)
    robot.tree_parameters()


TINY = robot_of(joint("x", "continuous", "a", "b", 'xyz="1e-195 1e-196 1e-195" rpy="1 0.2 0.3"', "0 0.6 0.8"))


@pytest.mark.filterwarnings("error::urdfkin.NotVerifiedWarning")
def test_lengths_whose_squares_underflow_are_verified_and_judged() -> None:
    robot = urdfkin.load(TINY)
    for convention in ("standard", "modified"):
        robot.dh("b", "a", convention)
    assert urdfkin.validate([TINY.encode()], samples=2).passed
    assert worst_error(urdfkin.load(FAINT), samples=2) < 100.0


FAINT = robot_of(
    joint("x", "continuous", "a", "b"),
    joint("y", "continuous", "a", "c", axis="0 1 0", more=mimic("x", "5e-324")),
)


@pytest.mark.parametrize("small", [1e-309, -1e-312, 3e-320])
@pytest.mark.parametrize("large", [1.0, -2.5e11, 1e150])
def test_a_hessian_with_a_subnormal_and_a_large_multiplier_is_verified(small: float, large: float) -> None:
    """A subnormal multiplier has a large relative rounding error, and the large one multiplies this error."""
    turned = 'xyz="0.1 0.2 0.3" rpy="0.3 0.2 0.1"'
    robot = loaded(
        robot_of(
            joint("x", "continuous", "a", "b"),
            joint("y", "continuous", "a", "c", turned, "0.6 0 0.8", mimic("x", large)),
            joint("z", "continuous", "c", "d", turned, "0 0.6 0.8", mimic("x", small)),
            joint("w", "continuous", "d", "e", turned, "0.6 0 0.8"),
        )
    )
    for reference in ("local", "world", "local_world_aligned"):
        assert np.isfinite(robot.hessian([1e-12, 0.4], "e", reference)).all()
    assert robot.certificate().verified


def sliders(*multipliers: float) -> str:
    """Write a robot with three mimic joints along x, y and z, which mimic joints of other branches."""
    joints = [joint(f"x{i}", "prismatic", "base", f"side{i}", more=limit()) for i in range(3)]
    joints.append(joint("turn", "continuous", "base", "arm0", axis="1 0 0"))
    for i, (axis, multiplier) in enumerate(zip(("1 0 0", "0 1 0", "0 0 1"), multipliers, strict=True)):
        more = limit() + mimic(f"x{i}", multiplier)
        joints.append(joint(f"m{i}", "prismatic", f"arm{i}", f"arm{i + 1}", axis=axis, more=more))
    return robot_of(*joints)


def test_a_hessian_without_large_products_is_verified_for_large_multipliers() -> None:
    """The product of two multipliers overflows, but the derivative of a sliding column by a slide is 0."""
    robot = loaded(sliders(1e200, 1e200, 1e200))
    for reference in REFERENCES:
        assert np.isfinite(robot.hessian([0.0, 0.0, 0.0, 0.3], "arm3", reference)).all()
    assert robot.certificate().verified


@pytest.mark.parametrize("size", [5e-324, 1e-320, 1e-200, 1e-170, 1.0, 1e155, 1e200])
def test_the_sign_of_a_quaternion_at_half_a_turn_may_differ_for_columns_of_any_size(size: float) -> None:
    """At half a turn, qw is 0. Rounding decides the sign of q and of all its derivatives."""
    generator = np.random.default_rng(0)
    for _ in range(30):
        half_turn = math.pi * (axis := generator.normal(size=3)) / np.linalg.norm(axis)
        roll, pitch, yaw = Rotation.from_rotvec(half_turn).as_euler("xyz")
        robot = loaded(
            robot_of(
                joint("x", "continuous", "a", "b"),
                joint(
                    "y", "continuous", "a", "c", f'rpy="{roll} {pitch} {yaw}"', "0.6 0 0.8", mimic("x", size)
                ),
            )
        )
        assert np.isfinite(robot.analytical_jacobian([0.0], "c", "quaternion")).all()


def test_a_singular_value_beyond_the_largest_double_raises_range_error() -> None:
    with pytest.raises(RangeError, match="a singular value"):
        singular_values(np.full((3, 3), 1e308), np.zeros((3, 3)), np.ones(3, dtype=bool))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("length", [1e-200, 1e-3, 1e100, 1e160, 1e300])
def test_the_cause_of_a_singularity_does_not_depend_on_the_unit_of_length(length: float) -> None:
    origin = f'xyz="{length!r} 0 0"'
    robot = loaded(
        robot_of(
            joint("x", "continuous", "a", "b"),
            joint("y", "continuous", "b", "c", origin),
            joint("end", "fixed", "c", "d", origin),
        )
    )
    text = str(robot.singular_values([0.3, 0.0], "d", "linear").singularity())
    assert text.endswith("The axes of joints x and y lie in one plane with the origin of d.")


@pytest.mark.parametrize("size", [1e-200, 1e160, 1e200, 1e300])
def test_an_mjcf_file_with_lengths_of_any_size_is_verified(size: float) -> None:
    """MuJoCo's body is `size` away from the world's origin, and the joint `size` away from the body."""
    vector = " ".join(repr(size * x) for x in (0.6, -0.2, 0.7))
    body = f'<body name="b" pos="{vector}" euler="10 20 30">'
    body += f'<geom size="1"/><joint name="j" axis="1 2 3" pos="{vector}"/></body>'
    robot = urdfkin.load(f'<mujoco model="m"><worldbody>{body}</worldbody></mujoco>'.encode())
    assert np.isfinite(robot.placement(robot.sample(3), "b")).all()
    assert robot.certificate().verified


def test_an_mjcf_file_whose_bound_leaves_the_range_of_doubles_raises_range_error() -> None:
    body = '<body name="b" pos="1e200 0 0"><geom size="1"/><joint name="j" axis="1 2 3" ref="1e150"/></body>'
    with pytest.raises(RangeError, match="bound on a position"):
        urdfkin.load(f'<mujoco model="m"><worldbody>{body}</worldbody></mujoco>'.encode())


@pytest.mark.parametrize(("multiplier", "offset"), [(1e7, 0.0), (1e11, 0.3), (0.5, 1e9), (-1e14, 1e11)])
def test_pinocchio_coordinates_with_a_large_mimic_rule_convert_back(multiplier: float, offset: float) -> None:
    rule = mimic("x", multiplier, offset)
    robot = loaded(
        robot_of(joint("x", "continuous", "a", "b"), joint("y", "continuous", "b", "c", more=rule))
    )
    q = np.linspace(-3.1, 3.1, 200)[:, np.newaxis]
    np.testing.assert_allclose(robot.from_pinocchio(robot.to_pinocchio(q)), q, atol=1e-14)
    wrong = robot.to_pinocchio(q)
    wrong[:, 2:] = robot.to_pinocchio(q + 1.0 / multiplier)[:, 2:]  # The mimic joint is 1 rad off.
    with pytest.raises(InputError, match="the mimic joint must be"):
        robot.from_pinocchio(wrong)


@pytest.mark.parametrize("multiplier", [5e-324, 8e-320, -3e-308])
def test_same_compares_robots_with_a_subnormal_multiplier(multiplier: float) -> None:
    text = robot_of(
        joint("x", "revolute", "a", "b", 'xyz="0.1 0 0"', more=limit()),
        joint(
            "y",
            "revolute",
            "b",
            "c",
            'xyz="0.1 0.2 0" rpy="1 0.2 0.3"',
            more=limit() + mimic("x", multiplier),
        ),
        joint("z", "prismatic", "c", "d", 'xyz="0.1 0 0"', "0.6 0 0.8", limit()),
    )
    assert urdfkin.same(text, text)
    assert not urdfkin.same(text, text.replace('offset="0"', 'offset="0.1"'))


def test_exported_code_contains_no_decimal_that_a_compiler_rounds_to_zero() -> None:
    """With -Werror, such a decimal stops the compilation of the C code, and with it `export --check`."""
    turned = 'xyz="0.1 0.2 0.3" rpy="0.3 0.2 0.1"'
    robot = loaded(
        robot_of(
            joint("x", "continuous", "a", "b"),
            joint("y", "continuous", "a", "c", turned, "0.6 0 0.8", mimic("x", 1e-170)),
            joint("z", "continuous", "c", "d", turned, "0 0.6 0.8", mimic("x", 1e-170)),
        )
    )
    code = robot.export("c", "d", ["hessian"])
    decimals = re.findall(r"[1-9]\.[0-9]+e-[0-9]+", code)
    assert decimals
    assert all(map(float, decimals))


@pytest.mark.filterwarnings("error")
def test_overflow_causes_no_warning_of_numpy() -> None:
    robot = loaded(
        robot_of(
            joint("x", "prismatic", "a", "b", 'xyz="1.5e308 0 0"', more=limit()),
            joint("y", "prismatic", "b", "c", more=limit() + mimic("x", 1e10)),
            joint("z", "continuous", "a", "d", 'xyz="-1.5e308 0 0"'),
        )
    )
    assert "inf is outside [-1, 1]" in robot.limit_violations([1.7e308, 0.0])[1]
    for verify in (True, False):
        with pytest.raises(RangeError):
            robot.relative_placement([0.0, 0.0], "c", "d", verify=verify)
    with pytest.raises(RangeError):
        robot.screws("d", "a")
    base, zero = BaseMotion(velocity=np.full(6, 1e200)), np.zeros(2)
    with pytest.raises(RangeError):
        robot.imu(zero, zero, zero, "d", base=base)


@pytest.mark.filterwarnings("error")
def test_a_sum_of_contributions_beyond_the_largest_double_raises_range_error() -> None:
    robot = loaded(
        robot_of(
            joint("x", "prismatic", "a", "b", more=limit()),
            joint("y", "prismatic", "b", "c", more=limit()),
        )
    )
    zero, a = np.zeros(2), np.array([1.5e308, 1.5e308])
    breakdown = robot.acceleration_breakdown(zero, zero, zero + 1e308 / 2, "c")
    assert breakdown.total[2] == 1e308
    for verify in (True, False):
        with pytest.raises(RangeError):
            _ = robot.acceleration_breakdown(zero, zero, a, "c", verify=verify).total


def test_a_gradient_of_the_manipulability_beyond_the_largest_double_raises_range_error() -> None:
    robot, q = loaded(sliders(1e200, 1e200, 1e200)), [0.0, 0.0, 0.0, 0.3]
    found = robot.singular_values(q, "arm3", "linear")
    assert (found.values.lower > 0.0).all()
    with pytest.raises(RangeError, match="the gradient"):
        found.manipulability_gradient(robot.hessian(q, "arm3"))


def test_the_manipulability_of_a_motion_is_a_number_if_partial_products_overflow() -> None:
    robot = loaded(sliders(1e200, 1e200, 1e-300))
    motion = urdfkin.frame_motion(robot, (np.zeros((1, 4)),) * 3, "arm3")
    assert motion.manipulability(slice(0, 3)).tolist() == [0.0]


@pytest.mark.filterwarnings("error")
def test_tables_and_chains_report_invalid_numbers_and_results_beyond_the_largest_double() -> None:
    near = 'xyz="0.3 0.1 0.2" rpy="1 0.2 0.3"'
    robot = loaded(
        robot_of(
            joint("x", "prismatic", "a", "b", near, more=limit()),
            joint("y", "prismatic", "b", "c", near, "0 0.6 0.8", limit()),
            joint("z", "continuous", "c", "d", near, more=mimic("y", 1e10)),
        )
    )
    path = robot.chain("d", "a")
    functions: list[Callable[[Any], Any]] = [path.frames, path.placement, path.coupling.values]
    functions += [robot.dh("d", "a").placement, robot.dh("d", "a").frames, robot.screws("d", "a").placement]
    functions.append(robot.tree_parameters().placements)
    for function in functions:
        assert np.isfinite(function(np.array([1e100, 0.1]))).all()
        with pytest.raises(RangeError, match="a result"):
            function(np.array([1.7e308, 1.7e308]))
        for bad in (math.nan, math.inf):
            with pytest.raises(InputError, match="q must be finite"):
                function(np.array([0.1, bad]))


@pytest.mark.filterwarnings("error")
def test_dh_raises_range_error_if_the_bound_on_accelerations_is_infinite() -> None:
    """Every difference is below an infinite bound, so such a comparison proves nothing."""
    near = 'xyz="0.3 0.1 0.2" rpy="1 0.2 0.3"'
    robot = loaded(
        robot_of(
            joint("x", "prismatic", "a", "b", near, more=limit()),
            joint("y", "prismatic", "b", "c", near, "0 0.6 0.8", limit() + mimic("x", 1e200)),
        )
    )
    with pytest.raises(RangeError, match="bound on a table"):
        robot.dh("c", "a")


def test_the_text_of_a_chain_contains_a_very_distant_tip() -> None:
    robot = loaded(chain([""], origin='xyz="1e300 0.1 0"'))
    assert "the tip is at (1e+300, 0.1, 0)" in str(robot.chain("l1", "l0"))


def test_the_breakdown_of_a_batch_has_the_bits_of_single_calls() -> None:
    robot = loaded(
        robot_of(
            joint("x", "planar", "a", "b", 'rpy="0.3 0.2 0.1"'),
            joint("y", "floating", "b", "c", 'rpy="0.3 0.2 0.1"', ""),
            joint("z", "prismatic", "c", "d", 'rpy="0.3 0.2 0.1"', "0.6 0 0.8", limit()),
            joint("w", "continuous", "d", "e", 'xyz="0.1 0.2 0.3"', "0.6 0 0.8"),
        )
    )
    q, (v, a) = robot.sample(20), np.random.default_rng(0).normal(size=(2, 20, robot.nv))
    for reference in REFERENCES:
        batch = robot.acceleration_breakdown(q, v, a, "e", reference)
        for i, row in enumerate(zip(q, v, a, strict=True)):
            alone = robot.acceleration_breakdown(*row, "e", reference)
            assert alone.terms.tobytes() == batch.terms[i].tobytes()
            assert alone.total.tobytes() == batch.total[i].tobytes()


def test_a_bound_beyond_the_largest_double_is_no_disagreement_of_a_motion() -> None:
    """For the same inputs, `acceleration` raises RangeError too."""
    robot = loaded(chain([""] * 2))
    q, v = np.zeros((2, 2)), np.array([[1.0, 1.0], [6e153, 6e153]])
    assert urdfkin.frame_motion(robot, (q[:1], v[:1], q[:1]), "l2").agrees
    v = np.array([[1.0, 1.0], [1.5e154, -1.5e154]])
    with pytest.raises(RangeError):
        robot.acceleration(q, v, q, "l2")
    with pytest.raises(RangeError, match=r"sample \[1\]"):
        urdfkin.frame_motion(robot, (q, v, q), "l2")


# -- results beyond the largest number -------------------------------------------------------------

FRAME = "tool0"
#: With rates of this size, w^2 d and w x vel overflow.
HUGE = 1e200
METHODS: dict[str, Callable[..., object]] = {
    "acceleration": lambda r, q, v, a, **o: r.acceleration(q, v, a, FRAME, **o),
    "acceleration, local": lambda r, q, v, a, **o: r.acceleration(q, v, a, FRAME, "local", **o),
    "acceleration, world": lambda r, q, v, a, **o: r.acceleration(q, v, a, FRAME, "world", **o),
    "accelerations": lambda r, q, v, a, **o: r.acceleration(q, v, a, [FRAME, "base_link"], **o),
    "acceleration_breakdown": lambda r, q, v, a, **o: r.acceleration_breakdown(q, v, a, FRAME, **o),
}


@pytest.fixture(scope="module")
def ur5() -> Robot:
    return urdfkin.load("ur5")


@pytest.mark.parametrize("verify", [True, False, "sample"])
@pytest.mark.parametrize("method", METHODS)
def test_overflow_raises_range_error_for_one_configuration_and_for_a_batch(
    ur5: Robot, method: str, verify: bool | str
) -> None:
    q, v = ur5.sample(3 * LANES + 1, 1), np.ones((3 * LANES + 1, 6))
    for row in (0, LANES, 3 * LANES):
        wild = v.copy()
        wild[row] = HUGE
        with pytest.raises(RangeError):
            METHODS[method](ur5, q, wild, v, verify=verify)
        with pytest.raises(RangeError):
            METHODS[method](ur5, q[row], wild[row], v[row], verify=verify)
    METHODS[method](ur5, q, v, v, verify=verify)


@pytest.mark.parametrize("reference", ["local", "world", "local_world_aligned"])
def test_overflow_in_a_prepared_frame_raises_range_error_and_is_not_counted(reference: str) -> None:
    robot = urdfkin.load("ur5")
    fast, q, v = robot.prepare(FRAME, reference), robot.sample(1)[0], np.ones(6)
    before = fast.acceleration(q, v, v)
    for wild in (np.full(6, HUGE), np.full(6, -HUGE), np.full(6, 1e308)):
        with pytest.raises(RangeError):
            fast.acceleration(q, wild, v)
    with pytest.raises(NotFiniteError):
        fast.acceleration(q, np.full(6, np.nan), v)
    np.testing.assert_array_equal(fast.acceleration(q, v, v), before)
    assert [line.unchecked for line in robot.certificate().lines] == [2]


@pytest.mark.parametrize("threads", [1, 2, 3, None])
@pytest.mark.parametrize("row", [0, 2500, 4999])
def test_overflow_in_the_rows_of_any_thread_raises_range_error(
    ur5: Robot, threads: int | None, row: int
) -> None:
    q, v = ur5.sample(5000, 1), np.ones((5000, 6))
    v[row] = HUGE
    with pytest.raises(RangeError, match=f"sample {row} of 5000"):
        ur5.acceleration(q, v, v, FRAME, threads=threads, verify=False)
    with pytest.raises(RangeError):
        ur5.jacobian_rate(q, v * 1e108, FRAME, "local", threads=threads, verify=False)


def test_overflow_from_the_base_velocity_raises_range_error(ur5: Robot) -> None:
    q, v = ur5.sample(4), np.ones((4, 6))
    for rates in (np.full(6, HUGE), np.where(np.arange(4)[:, np.newaxis] == 2, HUGE, v)):
        with pytest.raises(RangeError):
            ur5.acceleration(q, v, v, FRAME, base=BaseMotion(velocity=rates), verify=False)


def test_overflow_from_a_huge_link_raises_range_error() -> None:
    far = joint("k", "fixed", "b", "c", 'xyz="1e250 0 0"', "")
    robot = urdfkin.load(robot_of(joint("j", "continuous", "a", "b"), far))
    fast = robot.prepare("c")
    for rate in (1e30, 1e44):  # For a robot of ordinary size, these rates do not overflow.
        with pytest.raises(RangeError):
            fast.acceleration(np.zeros(1), np.array([rate]), np.zeros(1))
        with pytest.raises(RangeError):
            robot.acceleration([0.0], [rate], [0.0], "c", verify=False)
    assert fast.acceleration(np.zeros(1), np.array([2.0]), np.zeros(1))[0] == -4e250


@pytest.mark.parametrize("method", METHODS)
def test_huge_finite_results_are_returned(ur5: Robot, method: str) -> None:
    # A power of two scales each product exactly, so the results differ only by this factor.
    factor = 2.0**450
    assert factor > NO_OVERFLOW_BOUND
    q, v = ur5.sample(5, 2), np.random.default_rng(3).normal(size=(5, 6))
    slow, fast = (METHODS[method](ur5, q, v * f, v * f * f, verify=False) for f in (1.0, factor))
    if isinstance(slow, np.ndarray) and isinstance(fast, np.ndarray):
        np.testing.assert_array_equal(slow * factor * factor, fast)
        if method == "acceleration":
            single = ur5.prepare(FRAME).acceleration(q[0], v[0] * factor, v[0] * factor * factor)
            np.testing.assert_array_equal(single, fast[0])
    METHODS[method](ur5, q, v * factor, v * factor * factor)


def test_nothing_overflows_below_the_limit() -> None:
    # The bound on w^2 d from the comment of `NO_OVERFLOW_BOUND`, for a robot of ten thousand joints.
    assert np.isfinite(4.0 * 10_000**3 * NO_OVERFLOW_BOUND**6)


# -- quaternions of URDF 1.1 in the accuracy study -----------------------------------------------------


def turned_chain(origins: list[str], version: str) -> str:
    """Write a chain whose <origin> elements have other attributes for the rotation."""
    inside = [f'<origin xyz="0.3 0.2 0.1" {origin}/>' for origin in origins]
    return chain(inside, origin="", axis="0 1 0", attributes=version)


def quaternions(scale: float) -> list[str]:
    rng = np.random.default_rng(4)
    written = (" ".join(f"{x:.9g}" for x in scale * rng.normal(size=4)) for _ in range(5))
    return [f'quat_xyzw="{words}"' for words in written]


@pytest.mark.slow
@pytest.mark.parametrize("scale", [1.0, 1e-9, 3e20])
@pytest.mark.parametrize("version", ["1.1", "1.2"])
def test_true_errors_of_robots_with_quaternions_are_rounding_errors(version: str, scale: float) -> None:
    assert worst_error(urdfkin.load(turned_chain(quaternions(scale), f'version="{version}"'))) < 24.0


@pytest.mark.parametrize("version", ["", 'version="1.0"'])
def test_quaternions_in_files_of_urdf_1_0_are_ignored(version: str) -> None:
    origins = ['rpy="0.1 0.2 0.3" quat_xyzw="0 0 0.6 0.8"']
    assert worst_error(urdfkin.load(turned_chain(origins, version))) < 10.0


def test_the_decimals_of_a_quaternion_are_read_exactly() -> None:
    robot = urdfkin.load(turned_chain(['quat_xyzw="0 0 0.6 0.8"'], 'version="1.1"'))
    with precision(50):
        R = read_exact_joints(robot.urdf, robot.tree)[0].R
        assert abs(25 * R[0][0] - 7) < 1e-48
        assert abs(25 * R[1][0] - 24) < 1e-48


# -- breakdown of the acceleration far from the origin ---------------------------------------------


def base_at(distance: float, rates: FloatArray) -> BaseMotion:
    T = pose([[0, -1, 0], [1, 0, 0], [0, 0, 1]], distance * np.array([0.5, 4.5, 1e-4]))
    return BaseMotion(T, rates[:6], rates[6:])


@pytest.mark.slow
@pytest.mark.parametrize("reference", REFERENCES)
@pytest.mark.parametrize("distance", [0.0, 1e4, 1e5, 1e6, 1e8, 1e12])
def test_the_breakdown_on_a_distant_base_uses_a_small_share_of_the_bound(
    distance: float, reference: str
) -> None:
    robot, rng = urdfkin.load("panda"), np.random.default_rng(1)
    q, (v, a) = robot.sample(60, 1), rng.normal(size=(2, 60, robot.nv))
    base = base_at(distance, rng.normal(size=12))
    robot.acceleration_breakdown(q, v, a, "panda_hand", reference, base=base)
    (line,) = robot.certificate().lines
    assert (line.quantity, line.checked) == ("acceleration breakdown", 60)
    assert line.bound_ratio < 0.05


@pytest.mark.parametrize("root_joint", ["floating", "planar"])
def test_the_breakdown_after_a_distant_root_joint_uses_a_small_share_of_the_bound(root_joint: str) -> None:
    robot = urdfkin.load("panda", root_joint=root_joint)
    rng = np.random.default_rng(2)
    q, (v, a) = robot.sample(60, 1), rng.normal(size=(2, 60, robot.nv))
    q[:, :2] += [5e5, 4.5e6]
    for reference in REFERENCES:
        robot.acceleration_breakdown(q, v, a, "panda_hand", reference)
    assert robot.certificate().lines[0].bound_ratio < 0.05


@pytest.mark.parametrize("reference", ["local", "local_world_aligned"])
def test_the_breakdown_on_a_distant_base_equals_the_breakdown_at_the_origin(reference: str) -> None:
    robot = urdfkin.load("panda")
    rng = np.random.default_rng(3)
    q, (v, a), rates = robot.sample(20, 1), rng.normal(size=(2, 20, robot.nv)), rng.normal(size=12)
    here, there = (
        robot.acceleration_breakdown(q, v, a, "panda_hand", reference, base=base_at(distance, rates))
        for distance in (0.0, 1e7)
    )
    scale = np.abs(here.terms).max()
    assert np.abs(here.terms - there.terms).max() < 20 * EPS * scale
    assert np.abs(here.base - there.base).max() < 20 * EPS * np.abs(here.base).max()


def scale_transverse_terms(monkeypatch: pytest.MonkeyPatch) -> None:
    right = breakdown._joint_terms

    def wrong(*x: FloatArray) -> FloatArray:
        terms = right(*x)  # type: ignore[arg-type]
        terms[:, 0] *= 1.0 + 1e-9
        return terms

    monkeypatch.setattr(breakdown, "_joint_terms", wrong)


def breakdown_error(robot: Robot, base: BaseMotion | None) -> urdfkin.VerificationError:
    rng = np.random.default_rng(4)
    q, (v, a) = robot.sample(3, 1), rng.normal(size=(2, 3, robot.nv))
    with pytest.raises(urdfkin.VerificationError, match="acceleration breakdown") as caught:
        robot.acceleration_breakdown(q, v, a, "panda_hand", "local", base=base)
    return caught.value


def test_the_line_that_reproduces_an_error_in_the_breakdown_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    scale_transverse_terms(monkeypatch)
    base = base_at(1e5, np.arange(12.0))
    line = breakdown_error(urdfkin.load("panda"), base).reproduce
    assert ".acceleration_breakdown(" in line
    with pytest.raises(urdfkin.VerificationError):
        eval(line)
    monkeypatch.undo()
    assert isinstance(eval(line), AccelerationBreakdown)
    scale_transverse_terms(monkeypatch)
    words = shlex.split(breakdown_error(urdfkin.load("panda"), None).reproduce)
    assert words[:3] == ["urdfkin", "acceleration", "--breakdown"]
    assert command(*words[1:]).code == 1
    monkeypatch.undo()
    assert command(*words[1:]).code == 0
