"""The bounds and the sizes of terms equal numbers that are derived by hand."""

from typing import Any

import numpy as np
import pytest

import urdfkin
from tests import urdfs
from tests.laws.subjects import NAMES, robot_of, state
from tests.urdfs import joint, limit, mimic
from urdfkin.compiled.evaluate import accelerations, placements, velocities
from urdfkin.compiled.plan import CompiledTree
from urdfkin.kinematics.roundings import EPS, PINOCCHIO_ROUNDINGS, joint_roundings
from urdfkin.model.base_motion import FIXED_BASE_STATE, BaseMotion
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray
from urdfkin.verify import bounds, derived
from urdfkin.verify.bounds import Bound, Magnitudes, compute_magnitudes
from urdfkin.verify.call import Call
from urdfkin.verify.oracles import PINOCCHIO
from urdfkin.verify.quantities import (
    ACCELERATION,
    HESSIAN,
    JACOBIAN,
    JACOBIAN_RATE,
    PLACEMENT,
    VELOCITY,
    Quantity,
)

#: A revolute joint, a prismatic joint, and a prismatic joint with the double displacement.
ARM = urdfs.robot(
    joint("a", "continuous", "l0", "l1"),
    joint("b", "prismatic", "l1", "l2", axis="1 0 0", more=limit()),
    joint("c", "prismatic", "l2", "l3", axis="1 0 0", more=limit(-2, 2) + mimic("b", -2)),
)
P, W, VEL, ALPHA, ACC, JOINTS = 3.0, 5.0, 7.0, 11.0, 13.0, 4.0
LOCAL, WORLD, ALIGNED = Reference.LOCAL, Reference.WORLD, Reference.LOCAL_WORLD_ALIGNED


def sizes(tilt: float = 0.0) -> Magnitudes:
    return Magnitudes(*(np.array([[x]]) for x in (P, W, VEL, ALPHA, ACC, joint_roundings(JOINTS, tilt))))


@pytest.fixture(scope="module")
def plan() -> CompiledTree:
    return urdfkin.load(ARM).plan([3])


def rows(bound: Bound) -> tuple[Any, Any, float]:
    """Return the scale of the three linear rows, that of the three angular rows, and k."""
    scale = bound.scale[0, 0]
    assert (scale[:3] == scale[0]).all()
    assert (scale[3:] == scale[3]).all()
    return scale[0].tolist(), scale[3].tolist(), float(bound.k.ravel()[0])


def test_the_bound_of_a_placement_has_the_path_length_and_one_as_scales(plan: CompiledTree) -> None:
    bound = PLACEMENT.bound(plan, sizes(), None)
    expected = np.array([[1, 1, 1, P], [1, 1, 1, P], [1, 1, 1, P], [0, 0, 0, 0]], dtype=np.float64)
    assert (bound.scale[0, 0] == expected).all()
    assert bound.k.ravel().tolist() == [24.0 * JOINTS]


#: The revolute joint `a` comes before the prismatic joints `b` and `c`, which move by three times its value.
BY_HAND: list[tuple[Quantity, Reference, Any, Any, int]] = [
    (VELOCITY, ALIGNED, VEL, W, 2),
    (VELOCITY, LOCAL, VEL, W, 3),
    (VELOCITY, WORLD, VEL + W * P, W, 3),
    (ACCELERATION, ALIGNED, ACC + W * VEL, ALPHA, 3),
    (ACCELERATION, LOCAL, ACC + W * VEL, ALPHA, 4),
    (ACCELERATION, WORLD, ACC + 2 * W * VEL + (ALPHA + W * W) * P, ALPHA, 4),
    (JACOBIAN, ALIGNED, [P, 3.0], [1.0, 0.0], 2),
    (JACOBIAN, LOCAL, [P, 3.0], [1.0, 0.0], 3),
    (JACOBIAN, WORLD, [P, 3.0], [1.0, 0.0], 3),
    (JACOBIAN_RATE, ALIGNED, [W * P + VEL, 3.0 * W], [W, 0.0], 3),
    (JACOBIAN_RATE, LOCAL, [2 * W * P + VEL, 6.0 * W], [2 * W, 0.0], 4),
    (JACOBIAN_RATE, WORLD, [W * P + VEL, 3.0 * W], [W, 0.0], 4),
    (HESSIAN, ALIGNED, [[5.0 * P, 3.0], [6.0, 0.0]], [[1.0, 0.0], [0.0, 0.0]], 3),
    (HESSIAN, LOCAL, [[0.0, 3.0], [0.0, 0.0]], [[0.0, 0.0], [0.0, 0.0]], 4),
    (HESSIAN, WORLD, [[2.0 * P, 0.0], [3.0, 0.0]], [[1.0, 0.0], [0.0, 0.0]], 4),
]


@pytest.mark.parametrize(("quantity", "reference", "linear", "angular", "factors"), BY_HAND)
def test_each_bound_has_the_terms_and_factors_counted_by_hand(
    plan: CompiledTree, quantity: Quantity, reference: Reference, linear: Any, angular: Any, factors: int
) -> None:
    bound = quantity.bound(plan, sizes(), reference)
    assert rows(bound) == (linear, angular, 24.0 * JOINTS * factors)


def test_the_bound_of_an_imu_has_the_scale_with_gravity_and_the_factors_of_an_acceleration() -> None:
    robot = urdfkin.load(ARM)
    inputs = np.array([[0.3, 0.5], [1.5, -2.0], [0.7, 0.2]])
    call = Call(robot.tree, robot.plan, "l3", LOCAL, None, list(inputs), gravity=[3.0, 0.0, 4.0])
    part = call.select(slice(0, 1))
    _, bound = derived.derive_imu_reading(robot.verifier.oracle(), part, np.zeros((1, 1, 6)), PINOCCHIO)
    v, a = part.rates
    size = compute_magnitudes(part.plan, part.q, v, a, part.state)
    linear = (size.acc + size.w * size.vel + 5.0).item()
    assert rows(bound) == (linear, size.w.item(), 24.0 * JOINTS * (ACCELERATION.factors + 1))


def test_the_bound_of_a_relative_placement_includes_both_paths() -> None:
    robot = urdfkin.load(ARM)
    call = Call(
        robot.tree,
        robot.plan,
        "l3",
        ALIGNED,
        None,
        ([0.3, 0.5],),
        additional_frames=("l2",),
        relative_to="l2",
    )
    part = call.select(slice(0, 1))
    _, bound = derived.derive_relative_placement(
        PLACEMENT.bound, robot.verifier.oracle(), part, np.zeros((1, 1, 4, 4)), PINOCCHIO
    )
    size = compute_magnitudes(part.plan, part.q, None, None, part.state)
    assert (bound.scale[0, 0, :3, 3] == size.p.sum()).all()
    assert (bound.scale[0, 0, :3, :3] == 1.0).all()
    assert bound.k.ravel().tolist() == [24.0 * (JOINTS + 2.0 * (JOINTS - 1.0))]


@pytest.mark.parametrize(
    ("frame", "reference", "linear"),
    [
        ("l1", ALIGNED, [False, False]),  # on the axis of the revolute joint, with no length after it
        ("l2", ALIGNED, [True, True]),
        ("l3", LOCAL, [True, True]),
        ("l3", WORLD, [False, True]),  # the axis of the revolute joint passes through the world's origin
        ("l0", ALIGNED, [False, False]),
    ],
)
def test_columns_that_the_bound_treats_as_zero_are_zero_in_the_jacobian(
    frame: str, reference: Reference, linear: list[bool]
) -> None:
    robot = urdfkin.load(ARM)
    found = bounds.find_active_entries(robot.plan([robot.tree.frame_link(frame)]), reference)
    assert found.shape == (1, 6, 2)
    assert found[0, :3].tolist() == [linear] * 3
    assert found[0, 3:].tolist() == [[frame != "l0", False]] * 3
    J = robot.jacobian(robot.sample(20, 1) + 0.01, frame, reference)
    assert (found[0] | (J == 0.0)).all()
    assert (np.abs(J).max(axis=(0, 1))[found[0].any(axis=0)] > 0.0).all()


@pytest.mark.parametrize("x", [0.0, 1.0])
def test_in_world_a_displaced_root_gives_each_revolute_joint_a_linear_velocity(x: float) -> None:
    robot = urdfkin.load(ARM)
    plan = robot.plan([robot.tree.frame_link("l3")])
    found = bounds.find_active_entries(plan, WORLD, root_at_origin=x == 0.0)
    assert found[0, :3].tolist() == [[x != 0.0, True]] * 3
    base = np.eye(4)
    base[0, 3] = x
    J = robot.jacobian(robot.sample(20, 1) + 0.01, "l3", WORLD, base=urdfkin.BaseMotion(base))
    assert (found[0] | (J == 0.0)).all()


def test_the_bound_of_euler_rates_grows_with_the_inverse_square_of_the_singularity_distance(
    plan: CompiledTree,
) -> None:
    def euler(axis_sine: float) -> FloatArray:
        jacobian = JACOBIAN.bound(plan, sizes(), ALIGNED)
        return np.asarray(bounds.euler_jacobian_bound(jacobian, sizes(), np.array([[axis_sine]])).scale[0, 0])

    delta = EPS * 24.0 * JOINTS
    for axis_sine in (1.0, 1e-3, 1e-6):
        scale, s = euler(axis_sine), axis_sine - delta
        assert (scale[:3] == [P, 3.0]).all()
        assert scale[[3, 5], 0] == pytest.approx(1.5 / s**2, rel=1e-15)
        assert scale[4, 0] == pytest.approx(1.0 / s, rel=1e-15)
        assert (scale[3:, 1] == 0.0).all()
    assert not np.isfinite(euler(delta)[3:, 0]).any()
    assert bounds.singularity_margin(plan) == 4.0 * delta


def test_the_bound_of_quaternion_rates_is_the_bound_of_the_jacobian(plan: CompiledTree) -> None:
    jacobian = JACOBIAN.bound(plan, sizes(), ALIGNED)
    bound = bounds.quaternion_jacobian_bound(jacobian)
    assert (bound.scale[0, 0, :6] == jacobian.scale[0, 0]).all()
    assert (bound.scale[0, 0, 6] == jacobian.scale[0, 0, 5]).all()
    assert (bound.k == jacobian.k).all()


def test_each_factor_of_a_bound_includes_twice_the_tilt(plan: CompiledTree) -> None:
    tilt = 1e-13
    k = 24.0 * JOINTS + 2.0 * tilt / EPS
    assert rows(VELOCITY.bound(plan, sizes(tilt), LOCAL))[2] == 3.0 * k
    assert rows(JACOBIAN.bound(plan, sizes(tilt), ALIGNED))[2] == 2.0 * k


def test_bounds_for_mujoco_have_lever_arms_twice_as_long_and_2_5_times_the_roundings() -> None:
    lever = 2.0 * P
    assert bounds.mujoco_magnitudes(sizes()) == Magnitudes(
        p=np.array([[lever]]),
        w=np.array([[W]]),
        vel=np.array([[VEL + W * lever]]),
        alpha=np.array([[ALPHA]]),
        acc=np.array([[ACC + W * VEL + (ALPHA + W * W) * lever]]),
        roundings=np.array([[2.0 * 30.0 * JOINTS]]),
    )


# -- the magnitudes of terms -------------------------------------------------------------------------------


LONG_ARM = urdfs.robot(
    joint("a", "continuous", "l0", "l1"),
    joint("b", "continuous", "l1", "l2", 'xyz="2 0 0"'),
    joint("c", "prismatic", "l2", "l3", 'xyz="1 0 0"', "1 0 0", limit(-9, 9)),
    joint("d", "fixed", "l3", "tip", 'xyz="0.5 0 0"', axis=""),
)


def exceed(vectors: FloatArray, size: FloatArray) -> bool:
    lengths = np.linalg.norm(vectors, axis=-1)
    return bool((lengths > size * (1.0 + 100.0 * EPS) + 100.0 * EPS * (size > 0.0)).any())


@pytest.mark.slow
@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize("sizes", [(1.0, 1.0), (1e-3, 1e3), (1e3, 1e-3), (0.0, 1.0), (1.0, 0.0)])
@pytest.mark.parametrize("subject", NAMES)
def test_no_result_exceeds_the_computed_magnitude(
    subject: str, sizes: tuple[float, float], moving: bool
) -> None:
    robot = robot_of(subject)
    q, v, a = state(robot, 20, 1)
    v, a = sizes[0] * v, sizes[1] * a
    rng = np.random.default_rng(2)
    base = BaseMotion(velocity=rng.normal(size=6), acceleration=rng.normal(size=6)).state(())
    base = base if moving else FIXED_BASE_STATE
    plan = robot.plan(range(len(robot.link_names)))
    size = compute_magnitudes(plan, q, v, a, base)
    vel, acc = velocities(plan, q, v, base=base), accelerations(plan, q, v, a, base=base)
    assert not exceed(placements(plan, q, base=base)[..., :3, 3], size.p)
    assert not exceed(vel[..., :3], size.vel)
    assert not exceed(vel[..., 3:], size.w)
    assert not exceed(acc[..., :3], size.acc)
    assert not exceed(acc[..., 3:], size.alpha)
    places = compute_magnitudes(plan, q, None, None, base)
    assert (places.p == size.p).all()
    assert (places.roundings == size.roundings).all()


def of_the_arm(q: list[float], v: list[float], a: list[float]) -> Magnitudes:
    robot = urdfkin.load(LONG_ARM)
    return compute_magnitudes(robot.plan([4]), np.array([q]), np.array([v]), np.array([a]), FIXED_BASE_STATE)


def test_magnitudes_are_reached_if_all_terms_have_the_same_direction() -> None:
    size = of_the_arm([0.0, 0.0, 0.25], [2.0, 3.0, 0.0], [0.0, 0.0, 0.0])
    # In the outstretched arm, 2 m rotate with 2 rad/s, and 1.75 m with 5 rad/s.
    assert size.p == 3.75
    assert size.w == 5.0
    assert size.vel == 2.0 * 2.0 + 5.0 * 1.75
    assert size.alpha == 2.0 * 2.0 + 3.0 * (2.0 + 3.0)  # Pinocchio's term v w x z, which cancels later
    assert size.acc == (4.0 + 4.0) * 2.0 + (size.alpha + 25.0) * 1.75
    assert size.roundings == 5 * PINOCCHIO_ROUNDINGS


def test_magnitudes_include_prismatic_joints_and_joint_accelerations_as_in_7_130() -> None:
    size = of_the_arm([0.0, 0.0, -0.25], [0.5, 0.0, 3.0], [7.0, 0.0, 11.0])
    alpha = 7.0 + 0.25
    assert size.p == 3.75
    assert size.vel == 0.5 * 3.75 + 3.0
    assert size.alpha == alpha
    assert size.acc == (alpha + 0.25) * 3.75 + 11.0 + 2.0 * 3.0 * 0.5
