"""Singular values with fifty digits lie within the bounds; a singular Jacobian is explained."""

import pickle
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import urdfkin
from tests import urdfs
from tests.high_precision import mp
from tests.random_chains import rotation, shift
from tests.urdfs import joint, limit
from urdfkin.errors import InputError, UnknownNameError
from urdfkin.kinematics.roundings import EPS
from urdfkin.model.base_motion import BaseMotion
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.verify.exact.numbers import precision, read_exact_joints
from urdfkin.verify.exact.recursion import compute_motion
from urdfkin.verify.quantities import JACOBIAN
from urdfkin.verify.singular_values import (
    BoundedArray,
    SingularValues,
    _bound_orthogonality_error,
    singular_values,
)
from urdfkin.verify.singularity import FrameJacobian, Singularity

exact = np.vectorize(mp.mpf, otypes=[object])
ROWS = {"all": slice(0, 6), "linear": slice(0, 3), "angular": slice(3, 6)}


def true_values(A: np.ndarray) -> list[mpmath.mpf]:
    return sorted(mp.svd_r(mp.matrix(A.tolist()), compute_uv=False), reverse=True)


def true_jacobian(robot: Robot, q: FloatArray, frame: str) -> np.ndarray:
    link, still = robot.tree.frame_link(frame), [0.0] * robot.nv
    with precision(60):
        motion = compute_motion(
            robot.tree, read_exact_joints(robot.urdf, robot.tree, robot.tree.path(link)), q, still, still
        )
        found: np.ndarray = exact(JACOBIAN.enclose(motion, link, Reference.LOCAL_WORLD_ALIGNED))
        return found


def holds(found: BoundedArray, true: list[mpmath.mpf]) -> bool:
    low, high = (np.atleast_1d(end).tolist() for end in (found.lower, found.upper))
    return all(mp.mpf(a) <= x <= mp.mpf(b) for a, x, b in zip(low, true, high, strict=True))


@pytest.mark.slow
@pytest.mark.parametrize("rows", ROWS)
@pytest.mark.parametrize(("name", "frame"), [("ur5", "tool0"), ("panda", "panda_hand"), ("polar", "slider")])
def test_singular_values_at_fifty_digits_lie_within_the_bounds(name: str, frame: str, rows: str) -> None:
    robot = urdfkin.load(name)
    for q in (*robot.sample(2, 3), robot.neutral()):
        found = robot.singular_values(q, frame, rows)
        J = true_jacobian(robot, q, frame)[ROWS[rows]]
        moving = [i for i in range(robot.nv) if found.V[i].any() or any(J[:, i])]
        true = true_values(J[:, moving])
        assert holds(found.values, true)
        assert (found.values.upper - found.values.lower).max() < 1e-11 * found.values.value.max()
        assert holds(found.manipulability, [mp.fprod(true)])
        assert holds(found.condition, [true[0] / true[-1] if true[-1] else mp.inf])
        assert found.values.value.size == min(len(J), len(moving))


@pytest.mark.parametrize(
    ("origin", "rule"),
    [
        ('xyz="1 0 0" rpy="0.1 0.2 123456789.1"', ""),
        ('xyz="1 0 0"', '<mimic joint="j0" multiplier="0.001" offset="1000000.1"/>'),
    ],
)
def test_bounds_of_singular_values_include_the_rounding_of_the_decimals(origin: str, rule: str) -> None:
    robot = urdfs.built(
        joint("j0", "continuous", "base", "l0"),
        joint("j1", "continuous", "l0", "l1", origin, more=rule),
        joint("j2", "continuous", "l1", "l2", 'xyz="1 0 0"'),
        joint("j3", "prismatic", "l2", "tip", 'xyz="1 0 0"', "1 0.3 0", limit(-1.0, 1.0)),
    )
    q = np.linspace(0.7, 0.1, robot.nv)
    J = true_jacobian(robot, q, "tip")
    assert holds(robot.singular_values(q, "tip").values, true_values(J)[: robot.nv])


def test_singular_values_of_a_jacobian_wrong_by_a_billionth_lie_outside_the_bounds() -> None:
    robot, q = urdfkin.load("ur5"), np.linspace(0.2, 1.7, 6)
    J, still = robot.jacobian(q, "tool0"), np.zeros((6, 6))
    right = true_values(true_jacobian(robot, q, "tool0"))
    moving = np.ones(6, dtype=bool)
    assert holds(singular_values(J, still + 1e-14, moving).values, right)
    assert not holds(singular_values(J * (1.0 + 1e-9), still + 1e-14, moving).values, right)


@settings(max_examples=12)
@given(
    *(st.integers(1, 6), st.integers(1, 8), st.integers(-12, 12), st.booleans(), st.integers(0, 2**32 - 1))
)
def test_singular_values_of_matrices_of_any_shape_and_rank_lie_within_the_bounds(
    rows: int, columns: int, exponent: int, deficient: bool, seed: int
) -> None:
    generator, shape = np.random.default_rng(seed), (rows, columns)
    A = generator.standard_normal(shape)
    A *= 10.0 ** generator.uniform(min(0, exponent), max(0, exponent), shape)
    if deficient:
        A[-1] = A[0]
    found = singular_values(A, np.zeros(shape), np.ones(columns, dtype=bool))
    assert holds(found.values, true_values(exact(A)))
    assert (found.values.upper - found.values.lower <= 1e-12 * found.values.value[0]).all()


@pytest.mark.parametrize("exponent", [-1040, -700, -500, 500, 900])
@pytest.mark.parametrize("deficient", [False, True])
def test_singular_values_of_very_small_and_large_matrices_lie_within_the_bounds(
    exponent: int, deficient: bool
) -> None:
    A = np.random.default_rng(5).standard_normal((3, 4))
    if deficient:
        A[2] = A[0] + A[1]
    A = np.ldexp(A, exponent)
    found = singular_values(A, np.abs(A) * 2.0**-52, np.ones(4, dtype=bool))
    unit = mp.mpf(2) ** exponent
    true = [x * unit for x in true_values(exact(A) / unit)]
    assert holds(found.values, true)
    assert holds(found.manipulability, [mp.fprod(true)])
    room = 1e-12 * found.values.value[0] + 1e-306  # below, the smallest normal number hides digits
    assert (found.values.upper - found.values.lower <= room).all()


@pytest.mark.parametrize("size", [1.0, 1e-147, 1e-160, 1e-200, 1e-300])
@pytest.mark.filterwarnings("ignore::urdfkin.UrdfWarning")
def test_a_singular_arm_of_any_size_is_never_proven_to_be_regular(size: float) -> None:
    # With the second joint at 0, both levers are parallel.
    text = urdfs.robot(
        joint("j", "revolute", "a", "b", more=limit(-3, 3)),
        joint("k", "revolute", "b", "c", f'xyz="{0.7 * size} {0.3 * size} 0"', more=limit(-3, 3)),
        joint("t", "fixed", "c", "d", f'xyz="{1.4 * size} {0.6 * size} 0"'),
    )
    robot = urdfkin.load(text)
    q = np.stack([np.linspace(-3.0, 3.0, 200), np.zeros(200)], axis=-1)
    found = robot.singular_values(q, "d", "linear")
    assert (found.values.lower[:, 1] == 0.0).all()
    assert (found.values.lower[:, 0] > 1.5 * size).all()


@pytest.mark.parametrize(
    ("sizes", "product"),
    [
        ((1e-200, 1e-200), mp.mpf("1e-400")),
        ((1e-200, 1e-200, 1e200, 1e200), mp.mpf(1)),
        ((1e200, 1e200, 1e-300), mp.mpf("1e100")),
        ((1e200, 1e200), mp.mpf("1e400")),
        ((2e-162, 1.5e-162), mp.mpf("3e-324")),
    ],
)
def test_the_bounds_of_a_product_hold_if_a_partial_product_overflows_or_underflows(
    sizes: tuple[float, ...], product: mpmath.mpf
) -> None:
    values = np.array(sorted(sizes, reverse=True))
    bounds = BoundedArray(values, values * (1.0 - 1e-15), values * (1.0 + 1e-15))
    found = SingularValues(slice(None), bounds, np.eye(len(sizes)), np.eye(len(sizes)))
    assert holds(found.manipulability, [product])
    assert holds(found.condition, [mp.mpf(values[0]) / mp.mpf(values[-1])])


# -- each term of the bounds is needed -----------------------------------------------------------------


def test_bounds_of_singular_values_include_the_error_of_the_matrix() -> None:
    A, off = np.diag([2.0, 1.0]), np.full((2, 2), 1e-6)
    found = singular_values(A, off, np.ones(2, dtype=bool))
    for sign in (1.0, -1.0):
        assert holds(found.values, true_values(exact(A + sign * off)))
    # Equal errors of all numbers change one singular value by the norm of the errors.
    alone = singular_values(np.zeros((2, 2)), off, np.ones(2, dtype=bool))
    assert holds(alone.values, true_values(exact(off)))
    assert alone.values.upper[0] == pytest.approx(2e-6, rel=1e-12)


def decomposed(seed: int, values: tuple[float, ...]) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return U, s, Vt and the product U s Vt, with random rotations U and Vt."""
    generator = np.random.default_rng(seed)
    U, V = (np.linalg.qr(generator.standard_normal((3, 3)))[0] for _ in range(2))
    return U, np.array(values), V.T.copy(), (U * np.array(values)) @ V.T.copy()


def holds_with(A: FloatArray, *svd: FloatArray) -> bool:
    """Return whether the bounds from the decomposition `svd` of A contain the true singular values."""
    true = true_values(exact(A))
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(np.linalg, "svd", lambda *_, **__: svd)
        return holds(singular_values(A, np.zeros(A.shape), np.ones(A.shape[1], dtype=bool)).values, true)


@pytest.mark.parametrize("seed", range(5))
def test_bounds_of_singular_values_include_the_residual_of_the_decomposition(seed: int) -> None:
    U, s, Vt, A = decomposed(seed, (3.0, 2.0, 1.0))
    for wrong in ([1e-9, 0.0, 0.0], [0.0, -1e-9, 0.0], [0.0, 0.0, 1e-9]):
        assert holds_with(A, U, s + np.array(wrong), Vt)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("size", [1.0 + 1e-9, 1.0 - 1e-9])
def test_bounds_of_singular_values_include_the_lack_of_orthogonality(
    seed: int, side: int, size: float
) -> None:
    U, s, Vt, A = decomposed(seed, (3.0, 2.0, 1.0))
    assert holds_with(A, *((U * size, s / size, Vt) if side == 0 else (U, s / size, Vt * size)))


@pytest.mark.parametrize("seed", range(5))
def test_bounds_of_singular_values_include_the_rounding_of_the_residual(seed: int) -> None:
    U, s, Vt, A = decomposed(seed, (1.0, 1e-12, 1e-13))
    assert not np.abs(A - (U * s) @ Vt).any(), "the residual, as it is computed, is 0"
    assert holds_with(A, U, s, Vt)


def test_bounds_of_singular_values_include_underflow_of_products(monkeypatch: pytest.MonkeyPatch) -> None:
    # Each product 1607 / 16 = 100.4375 of the smallest double is rounded to 100.
    least = 5e-324
    A, svd = np.full((1, 256), 100 * least), (np.eye(1), np.array([1607 * least]), np.full((1, 256), 1 / 16))
    monkeypatch.setattr(np.linalg, "svd", lambda *_, **__: svd)
    values = singular_values(A, np.zeros(A.shape), np.ones(256, dtype=bool)).values
    assert values.lower[0] <= 1600 * least <= values.upper[0]


def test_bounds_of_singular_values_include_the_rounding_of_long_sums_in_a_batch() -> None:
    # NumPy adds the squares of a batch one after the other, and 1 + x^2 is rounded to 1.
    x = 0.7 * 2.0**-26
    error = np.full((40, 1, 6000), x)
    error[..., 0] = 1.0
    upper = singular_values(np.zeros(error.shape), error, np.ones(6000, dtype=bool)).values.upper
    assert all(Fraction(float(one)) ** 2 >= 1 + 5999 * Fraction(x) ** 2 for one in upper.ravel())


def test_the_measure_of_orthogonality_includes_the_rounding_of_the_product() -> None:
    # Each number of the product of 3 by 3 matrices has the error bound 5 eps.
    assert _bound_orthogonality_error(np.eye(3)) == pytest.approx(
        5.0 * EPS * np.sqrt(3.0), rel=1e-12, abs=0.0
    )


def test_bounds_of_singular_values_and_products_are_rounded_outward() -> None:
    # Norms, products and quotients of random numbers are rounded up or down.
    generator = np.random.default_rng(1)
    for x, y in generator.uniform(1.0, 2.0, (50, 2)):
        off = singular_values(np.zeros((1, 3)), np.full((1, 3), x), np.ones(3, dtype=bool))
        assert mp.mpf(float(off.values.upper[0])) ** 2 >= 3 * mp.mpf(x) ** 2
        values = np.array([max(x, y), min(x, y)])
        found = SingularValues(slice(None), BoundedArray(values, values, values), np.eye(2), np.eye(2))
        one, other = map(mp.mpf, values)
        for between, true in ((found.manipulability, one * other), (found.condition, one / other)):
            assert mp.mpf(float(between.lower)) < true < mp.mpf(float(between.upper))


def test_an_infinite_error_of_the_matrix_gives_the_bounds_zero_and_infinity() -> None:
    huge = singular_values(np.full((2, 2), 1e200), np.full((2, 2), np.inf), np.ones(2, dtype=bool))
    assert (huge.values.lower == 0.0).all()
    assert np.isinf(huge.values.upper).all()
    assert np.isinf(huge.condition.upper)


#: A revolute joint and a radial prismatic joint; at slide 0, the frame lies on the axis of the revolute
#: joint.
SLIDE = urdfs.robot(
    joint("turn", "revolute", "a", "b", more=limit(-3, 3)),
    joint("slide", "prismatic", "b", "c", axis="1 0 0", more=limit(0, 2)),
    name="slide",
)


@pytest.mark.parametrize("rows", ROWS)
def test_one_configuration_alone_and_in_a_batch_have_the_same_singular_values(rows: str) -> None:
    robot = urdfkin.load(SLIDE)
    alone = robot.singular_values([0.3, 0.0], "c", rows)
    batch = robot.singular_values([[0.3, 0.0], [0.3, 1.0]], "c", rows)
    for name in ("values", "condition", "manipulability"):
        one, many = (np.stack(getattr(found, name)) for found in (alone, batch))
        np.testing.assert_array_equal(one, many[:, 0])
    H = robot.hessian([0.3, 0.0], "c")
    gradients = batch.manipulability_gradient(np.stack([H, H]))
    np.testing.assert_array_equal(alone.manipulability_gradient(H), gradients[0])


def test_the_manipulability_of_a_slide_on_the_axis_of_rotation_is_zero() -> None:
    found = urdfkin.load(SLIDE).singular_values([0.3, 0.0], "c", "linear")
    assert found.values.value.tolist() == pytest.approx([1.0, 0.0], abs=1e-15)
    assert found.manipulability.lower == 0.0
    assert np.isinf(found.condition.upper)


@pytest.mark.parametrize("base", [None, BaseMotion(np.block([[np.eye(3), np.ones((3, 1))], [0, 0, 0, 1]]))])
def test_the_number_of_singular_values_does_not_depend_on_the_base_placement(base: BaseMotion | None) -> None:
    robot = urdfkin.load(SLIDE)
    assert robot.singular_values([0.3, 0.0], "b", "linear", base=base).values.value.shape == (0,)
    assert robot.singular_values([0.3, 0.0], "c", "linear", base=base).values.value.shape == (2,)


def test_a_frame_that_no_joint_moves_has_no_singular_values() -> None:
    robot = urdfkin.load("panda")
    found = robot.singular_values(robot.sample(3), "panda_link0")
    assert found.values.value.shape == (3, 0)
    assert found.manipulability.upper.tolist() == [0.0] * 3
    assert np.isnan(found.condition.value).all()
    assert not found.manipulability_gradient(robot.hessian(robot.sample(3), "panda_link0")).any()


@pytest.mark.parametrize("rows", ROWS)
@pytest.mark.parametrize(
    ("name", "frame"), [("panda", "panda_hand"), ("ur5", "forearm_link"), ("polar", "slider")]
)
def test_the_gradient_of_the_manipulability_is_the_difference_quotient(
    name: str, frame: str, rows: str
) -> None:
    robot, h = urdfkin.load(name, verify=False), 1e-5
    if (name, rows) == ("polar", "angular"):
        return  # one column, of length 1: below
    q = robot.sample(8, 5)
    found = robot.singular_values(q, frame, rows)
    gradient = found.manipulability_gradient(robot.hessian(q, frame))
    sure = found.values.lower[:, -1] > 1e-3
    for j, step in enumerate(h * np.eye(robot.nv)):
        near = (robot.singular_values(q + x, frame, rows) for x in (step, -step))
        ahead, behind = (one.manipulability.value[sure] for one in near)
        np.testing.assert_allclose(gradient[sure, j], (ahead - behind) / (2.0 * h), rtol=0, atol=1e-7)


def test_the_manipulability_gradient_is_nan_at_a_singularity_and_finite_nearby() -> None:
    arm = urdfkin.load("planar_two_link")
    q = np.array([[0.3, 0.0], [0.3, 0.1]])
    found = arm.singular_values(q, arm.tip_frame, "linear")
    gradient = found.manipulability_gradient(arm.hessian(q, arm.tip_frame))
    assert np.isnan(gradient[0]).all()
    assert np.isfinite(gradient[1]).all()
    assert np.isinf(found.condition.upper[0])
    # |l1 l2 sin q2|, by hand
    lengths = found.manipulability.value[1] / np.sin(0.1)
    assert gradient[1, 1] == pytest.approx(lengths * np.cos(0.1), rel=1e-12)


def test_the_manipulability_gradient_refuses_the_hessian_of_other_configurations() -> None:
    robot = urdfkin.load("planar_two_link")
    q = robot.sample(6).reshape(2, 3, 2)
    found, H = robot.singular_values(q, "tip", "linear"), robot.hessian(q, "tip")
    assert (found.manipulability_gradient(H.tolist()) == found.manipulability_gradient(H)).all()
    for bad in (H.swapaxes(0, 1), H[0], H[..., np.newaxis, :, :, :], H[..., 0], None, H * np.nan):
        with pytest.raises(InputError, match="H must be"):
            found.manipulability_gradient(bad)  # type: ignore[arg-type]


def test_singular_values_accept_a_base_and_a_batch_shape_and_refuse_invalid_options() -> None:
    robot = urdfkin.load("ur5")
    q = robot.sample(6).reshape(2, 3, 6)
    T = np.eye(4)
    T[:3, 3] = 1.0, 2.0, 3.0
    found = robot.singular_values(q, "tool0", base=BaseMotion(T))
    assert found.values.lower.shape == (2, 3, 6)
    assert found.condition.value.shape == (2, 3)
    alone = robot.singular_values(q[1, 2], "tool0", base=BaseMotion(T))
    np.testing.assert_allclose(found.values.value[1, 2], alone.values.value, rtol=1e-14)
    assert {line.quantity for line in robot.certificate().lines} == {"jacobian"}
    with pytest.raises(InputError, match="rows must be 'all', 'linear' or 'angular': found 'both'"):
        robot.singular_values(q, "tool0", "both")
    with pytest.raises(UnknownNameError, match="tool1"):
        robot.singular_values(q, "tool1")
    with pytest.raises(InputError, match="frame must be a name"):
        robot.singular_values(q, ["tool0"])  # type: ignore[arg-type]


# -- a singular Jacobian is explained by its rank, its lost directions and its joints ------------------------


UR5 = [0.3, -1.0, 1.0, 0.4, 0.5, 0.6]
WRISTS = "shoulder_lift_joint, elbow_joint, wrist_1_joint"


def found(robot: Robot, q: Any, rows: str = "all") -> Singularity:
    return robot.singular_values(q, robot.tip_frame, rows).singularity()


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
def test_the_explanation_of_a_singularity_names_the_joints_and_the_geometry(
    robot: str, q: Any, rows: str, reason: str
) -> None:
    assert reason in found(urdfkin.load(robot), q, rows).reasons


def test_lost_directions_and_null_motions_are_null_spaces_of_the_jacobian() -> None:
    robot = urdfkin.load("ur5")
    for q in (np.zeros(6), np.array([0.3, -1, 0, 0.4, 0.5, 0.6]), np.array([0.3, -1, 1, 0.4, 0, 0.6])):
        one, J = found(robot, q), robot.jacobian(q, "tool0")
        assert (one.rank, one.full_rank, bool(one)) == (5, 6, True)
        assert one.lost_directions.shape == one.null_motions.shape == (1, 6)
        assert np.abs(one.lost_directions @ J).max() < 1e-14
        assert np.abs(J @ one.null_motions.T).max() < 1e-14
    assert robot.certificate().verified, "the explanation computes unchecked Jacobians"


def test_errors_above_all_motions_of_a_long_chain_give_an_explanation() -> None:
    origins = ('xyz="1 0 0"', 'xyz="1 0 0" rpy="1.5 0 0"')
    joints = [joint(f"j{i}", "continuous", f"l{i}", f"l{i + 1}", origins[i % 2]) for i in range(17)]
    robot, T = urdfs.built(*joints), np.eye(4)
    T[0, 3] = 1e15
    one = robot.singular_values(robot.sample(1)[0], "l17", base=BaseMotion(T)).singularity()
    assert one.rank == 0
    assert "17 independent joint motions of j0, " in str(one)


def test_a_regular_configuration_near_a_singularity_is_not_singular() -> None:
    robot = urdfkin.load("ur5")
    for elbow in (1.0, 1e-6, 1e-10):
        one = found(robot, [0.3, -1.0, elbow, 0.4, 0.5, 0.6])
        assert (bool(one), one.reasons, str(one)) == (False, (), "Not singular: rank 6 of 6.")
    assert found(robot, [0.3, -1.0, 1e-14, 0.4, 0.5, 0.6]), "within the bound of the Jacobian"


def test_the_explanation_for_an_arm_that_is_singular_everywhere_is_the_arm() -> None:
    robot = urdfkin.load(urdfs.chain([""] * 5, origin='xyz="0.3 0 0"'))
    one = found(robot, [0.1, 0.2, 0.3, 0.4, 0.5])
    assert (one.rank, one.full_rank, len(one.lost_directions), len(one.null_motions)) == (3, 5, 0, 2)
    assert one.reasons == (
        "The Jacobian has the same rank at random configurations."
        " The arm causes the loss of rank, not this configuration.",
    )
    stretched = found(robot, np.zeros(5), "linear")
    assert stretched.lost_directions.tolist() == [[1.0, 0.0, 0.0, 0.0, 0.0, 0.0]]


@pytest.mark.parametrize("base", [None, BaseMotion(shift(1.0, 2.0, 3.0) @ rotation("z", 0.7))])
def test_an_arm_whose_only_axis_always_meets_the_origin_loses_no_direction(base: BaseMotion | None) -> None:
    robot = urdfs.built(
        joint("turn", "continuous", "base", "arm", 'xyz="0 0 0.5" rpy="0 0 0.4"', "-1 0 0"),
        joint("wrist", "continuous", "arm", "tip", 'xyz="0.5 0 0" rpy="0.4 0 1.57"', "0 0 -1"),
    )
    one = robot.singular_values([0.3, -1.1], "tip", "linear", base=base).singularity()
    assert (one.rank, one.full_rank, one.lost_directions.shape) == (0, 1, (0, 6))
    assert one.reasons[0].startswith("The Jacobian has the same rank at random configurations.")


def test_the_rotation_of_the_base_rotates_the_lost_direction() -> None:
    robot = urdfkin.load("ur5")
    turn = np.eye(4)
    turn[:3, :3] = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    one = robot.singular_values(robot.neutral(), "tool0", base=BaseMotion(turn)).singularity()
    assert one.lost_directions.round(9).tolist() == [[0.0, 0.0, 0.0, 0.0, 1.0, 0.0]]


def explained(J: FloatArray, turns: bool | None = True) -> Singularity:
    generic = np.random.default_rng(1).normal(size=(2, *J.shape))
    names, active = tuple(f"j{i}" for i in range(J.shape[1])), np.ones(J.shape, dtype=bool)
    error, turning = np.full(J.shape, 1e-15), (turns,) * J.shape[1]
    columns = FrameJacobian(J, error, "tip", names, turning, active, lambda: generic, moving_base=False)
    return singular_values(J, error, active[0], slice(0, 6), columns).singularity()


def axes(points: FloatArray, z: FloatArray) -> FloatArray:
    units = z / np.linalg.norm(z, axis=1, keepdims=True)
    return np.hstack([np.cross(points, units), units]).T


def test_the_explanation_names_the_line_that_six_axes_meet() -> None:
    rng = np.random.default_rng(0)
    along, start = np.array([0.0, 0.0, 1.0]), np.array([0.2, 0.1, 0.0])
    points = start + rng.normal(size=(6, 1)) * along
    one = explained(axes(points, rng.normal(size=(6, 3))))
    assert (one.rank, one.full_rank) == (5, 6)
    assert any("through the point at (0.2, 0.1, 0) m from the origin of tip" in line for line in one.reasons)
    assert one.reasons[-1].startswith("These joint velocities do not move tip: ")


def test_axes_through_one_point_are_distinguished_from_axes_in_one_plane() -> None:
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


def test_axes_that_are_parallel_in_every_configuration_do_not_explain_a_singularity() -> None:
    z, y = "0 0 1", "0 1 0"
    origins = ["0 0 0", "1 0 0", "1 0 0", "0.7 0 0", "0.3 0 0.2", "0.4 0 0.1", "0.1 0.3 0.2"]
    axes_of_joints = [z, z, z, z, y, "1 0 0", y]
    joints = [
        joint(f"j{i}", "continuous", f"l{i}", f"l{i + 1}", f'xyz="{origin}"', axis)
        for i, (origin, axis) in enumerate(zip(origins, axes_of_joints, strict=True))
    ]
    tool = joint("tool", "fixed", "l7", "tip", 'xyz="0.1 0.2 0.3"')
    robot = urdfs.built(*joints, tool)
    # At this angle of j5, the columns of j4, j5 and j6 and of the parallel axes have rank 5.
    one = found(robot, [0.3, 0.5, -0.7, 0.2, 0.4, 1.7273671480572632, 0.8])
    assert (one.rank, len(one.lost_directions)) == (5, 1)
    assert one.reasons[-1] == "2 independent joint motions of j0, j1, j2, j3, j4, j5 and j6 do not move tip."
    assert not any(line.startswith("The axes of joints") for line in one.reasons)


@pytest.mark.parametrize("size", [1.0, 1e6, 1e7])
def test_axes_with_different_directions_are_never_called_parallel(size: float) -> None:
    lengths = [0.0, 0.0, 0.0, size, 0.5 * size, 0.3 * size]
    directions = ["0 0 1", "0.8 0 0.6", "-0.6 0 0.8", "0 1 0", "1 0 0", "0 1 1"]
    joints = [
        joint(f"j{i}", "continuous", f"l{i}", f"l{i + 1}", f'xyz="{length} {0.3 * length} 0"', axis)
        for i, (length, axis) in enumerate(zip(lengths, directions, strict=True))
    ]
    robot = urdfs.built(*joints, joint("tool", "fixed", "l6", "tip", f'xyz="{size} 0 {0.2 * size}"'))
    one = found(robot, [0.3, 0.0, 0.8, 0.5, 0.2, 0.3])
    assert one.reasons[-1] == "The axes of joints j0, j1 and j2 intersect in one point and lie in one plane."


def test_slides_that_become_parallel_explain_a_singularity() -> None:
    robot = urdfs.built(
        joint("x", "prismatic", "base", "l0", axis="1 0 0", more=limit()),
        joint("turn", "continuous", "l0", "l1"),
        joint("slide", "prismatic", "l1", "tip", axis="1 0 0", more=limit()),
    )
    assert found(robot, [0.0, 0.0, 0.3]).reasons[-1] == "The joints x and slide slide along parallel axes."


def test_dependent_columns_that_are_no_axes_have_no_geometric_explanation() -> None:
    J = np.random.default_rng(3).normal(size=(6, 6))
    J[:, 5] = J[:, 0] - 2.0 * J[:, 1]
    one = explained(J, turns=None)
    assert one.reasons[-1].startswith("These joint velocities do not move tip: j0 ")
    assert not any(line.startswith(("The axes", "Each axis")) for line in one.reasons)


def test_the_singularity_of_each_configuration_of_a_batch_is_available_by_index() -> None:
    robot = urdfkin.load("ur5")
    values = robot.singular_values([robot.neutral().tolist(), UR5], "tool0")
    assert [bool(values.singularity(k)) for k in (0, 1)] == [True, False]
    assert values._text_document().parts[0].rows[0][-1] == "5 of 6"  # type: ignore[union-attr]
    for sample in ((), (2,), (0, 0)):
        with pytest.raises(InputError, match="no such configuration"):
            values.singularity(*sample)
    assert str(pickle.loads(pickle.dumps(values)).singularity(0)) == str(values.singularity(0))


def test_a_batch_for_a_frame_that_no_joint_moves_is_shown_as_a_table() -> None:
    robot = urdfkin.load("planar_two_link")
    assert len(robot.singular_values(np.zeros((2, 2)), "base")._text_document().parts[0].rows) == 2  # type: ignore[union-attr]


def test_results_are_shown_as_tables_in_a_notebook() -> None:
    robot = urdfkin.load("ur5")
    same = urdfkin.same("ur5", "ur5_limited")
    for one in (robot.singular_values(robot.neutral(), "tool0"), robot.screws(), robot.joints, same):
        assert one._repr_html_().startswith("<div>")
    assert "<table>" in robot.joints._repr_html_()
    assert str(same).startswith("SAME: in every configuration no frame is off by more than rounding")
    differs = str(urdfkin.same("ur5", "ur10"))
    assert differs.startswith("DIFFERS by up to 429.7 mm (at most 432.7 mm)")
    assert "tool0           429.7 mm  432.7 mm" in differs
