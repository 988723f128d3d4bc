"""Identities that hold for any robot, checked without Pinocchio."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import urdfkin
from tests import urdfs
from tests.laws.subjects import NAMES, moved, robot_of, rotation_vector, state
from urdfkin import VerificationError, load
from urdfkin.compiled import evaluate
from urdfkin.kinematics import bodies
from urdfkin.kinematics.roundings import EPS
from urdfkin.model.base_motion import FIXED_BASE_STATE
from urdfkin.model.configuration import draw_base_motion
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray, JointKind
from urdfkin.robot import Robot
from urdfkin.urdf.catalogue import catalogue
from urdfkin.verify.bounds import Bound, compute_magnitudes
from urdfkin.verify.quantities import ACCELERATION, JACOBIAN, JACOBIAN_RATE

LOCAL, WORLD, ALIGNED = Reference
#: Tolerance for the rounding errors of a law's formula, in eps of its largest number.
ROOM = 2000.0 * EPS


@pytest.fixture(scope="module", params=NAMES)
def robot(request: pytest.FixtureRequest) -> Robot:
    return robot_of(request.param)


def frames(robot: Robot) -> list[str]:
    links = robot.tree.links
    return [robot.tip_frame, robot.tree.frame_name(0), robot.tree.frame_name(len(links) // 2)]


def close(one: FloatArray, other: FloatArray, *sizes: FloatArray) -> bool:
    largest = max([1.0, *(float(np.abs(x).max(initial=0.0)) for x in (one, other, *sizes))])
    return bool(np.abs(one - other).max(initial=0.0) <= ROOM * largest)


@pytest.mark.parametrize("reference", list(Reference))
def test_the_velocity_is_the_jacobian_times_the_joint_velocities(robot: Robot, reference: Reference) -> None:
    q, v, _ = state(robot, 17, 1)
    for frame in frames(robot):
        J = robot.jacobian(q, frame, reference)
        velocity = robot.velocity(q, v, frame, reference)
        assert close(np.einsum("nij,nj->ni", J, v), velocity, J)


def test_results_in_the_reference_frames_are_related_by_rigid_body_motion(robot: Robot) -> None:
    q, v, a = state(robot, 17, 3)
    for frame in frames(robot):
        T = robot.placement(q, frame)
        R, d = T[:, :3, :3], -T[:, :3, 3]  # from the frame's origin to the world's
        velocity = robot.velocity(q, v, frame)
        acceleration = robot.acceleration(q, v, a, frame)
        w, alpha = velocity[:, 3:], acceleration[:, 3:]
        at_origin = velocity.copy()
        at_origin[:, :3] += np.cross(w, d)
        assert close(at_origin, robot.velocity(q, v, frame, WORLD))
        at_origin = acceleration.copy()
        at_origin[:, :3] += np.cross(alpha, d) + np.cross(w, np.cross(w, d))
        assert close(at_origin, robot.acceleration(q, v, a, frame, WORLD))
        assert close(turned(R, velocity), robot.velocity(q, v, frame, LOCAL))
        assert close(turned(R, acceleration), robot.acceleration(q, v, a, frame, LOCAL))
        columns = np.moveaxis(robot.jacobian(q, frame), -1, 1)
        assert close(turned(R[:, None], columns), np.moveaxis(robot.jacobian(q, frame, LOCAL), -1, 1))
        shifted = columns.copy()
        shifted[..., :3] += np.cross(columns[..., 3:], d[:, None])
        assert close(shifted, np.moveaxis(robot.jacobian(q, frame, WORLD), -1, 1))


def turned(R: FloatArray, six: FloatArray) -> FloatArray:
    pairs = six.reshape(*six.shape[:-1], 2, 3)
    back: FloatArray = np.einsum("...ji,...pj->...pi", R, pairs).reshape(six.shape)
    return back


def test_the_power_and_the_joint_torques_of_a_wrench_do_not_depend_on_the_reference(robot: Robot) -> None:
    q, v, _ = state(robot, 17, 4)
    frame = robot.tip_frame
    force = np.random.default_rng(5).normal(size=(17, 6))  # at the frame's origin, in world axes
    T = robot.placement(q, frame)
    world = force.copy()
    world[:, 3:] += np.cross(T[:, :3, 3], force[:, :3])
    powers, torques = {}, {}
    for reference, wrench in ((ALIGNED, force), (LOCAL, turned(T[:, :3, :3], force)), (WORLD, world)):
        powers[reference] = np.einsum("ni,ni->n", wrench, robot.velocity(q, v, frame, reference))
        torques[reference] = np.einsum("nij,ni->nj", robot.jacobian(q, frame, reference), wrench)
    size = np.abs(world).max() * np.abs(robot.velocity(q, v, frame, WORLD))
    for reference in (LOCAL, WORLD):
        assert close(powers[reference], powers[ALIGNED], size)
        assert close(torques[reference], torques[ALIGNED], world * 10.0)
    assert close(np.einsum("nj,nj->n", torques[ALIGNED], v), powers[ALIGNED], size)


def test_doubled_joint_velocities_double_velocities_and_quadruple_accelerations_exactly(robot: Robot) -> None:
    q, v, a = state(robot, 5, 6)
    for frame in frames(robot):
        for reference in Reference:
            once, twice = (robot.velocity(q, f * v, frame, reference) for f in (1.0, 2.0))
            assert (twice == 2.0 * once).all()
            once, twice = (robot.acceleration(q, f * v, f * f * a, frame, reference) for f in (1.0, 2.0))
            assert (twice == 4.0 * once).all()


def test_frames_joined_by_fixed_joints_move_as_one_body(robot: Robot) -> None:
    q, v, a = state(robot, 9, 7)
    for i, joint in enumerate(robot.tree.joints):
        if joint.kind is not JointKind.FIXED:
            continue
        parent, child = (robot.tree.frame_name(link) for link in (joint.parent, i + 1))
        T = robot.placement(q, parent) @ joint.T_parent_joint
        assert close(robot.placement(q, child), T)
        d = (T - robot.placement(q, parent))[:, :3, 3]
        velocity, acceleration = robot.velocity(q, v, parent), robot.acceleration(q, v, a, parent)
        w = velocity[:, 3:]
        velocity[:, :3] += np.cross(w, d)
        acceleration[:, :3] += np.cross(acceleration[:, 3:], d) + np.cross(w, np.cross(w, d))
        assert close(robot.velocity(q, v, child), velocity)
        assert close(robot.acceleration(q, v, a, child), acceleration)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["panda", "mimic_hand_40_sliding", "planar_and_floating_in_the_middle"])
def test_a_moving_base_gives_the_results_of_a_floating_root_joint(name: str) -> None:
    robot, free = robot_of(name), robot_of(name, root_joint="floating")
    q, v, a = state(robot, 6, 8)
    generator = np.random.default_rng(9)
    base = draw_base_motion(6, generator)
    R, p = base.placement[:, :3, :3], base.placement[:, :3, 3]
    quaternion = Rotation.from_matrix(R).as_quat()
    spatial = base.acceleration.copy()
    spatial[:, :3] -= np.cross(base.velocity[:, 3:], base.velocity[:, :3])
    q_free = np.hstack((p, quaternion, q))
    v_free = np.hstack((turned(R, base.velocity), v))
    a_free = np.hstack((turned(R, spatial), a))
    for frame in frames(robot):
        assert close(robot.placement(q, frame, base=base), free.placement(q_free, frame))
        for reference in Reference:
            for method, n in (("velocity", 2), ("acceleration", 3), ("jacobian", 1), ("jacobian_rate", 2)):
                ours = getattr(robot, method)(*(q, v, a)[:n], frame, reference, base=base)
                theirs = getattr(free, method)(*(q_free, v_free, a_free)[:n], frame, reference)
                assert close(ours, theirs[..., 6:] if method.startswith("jacobian") else theirs), method


@pytest.mark.parametrize("name", ["panda", "mimic_hand_40_sliding", "followers_of_followers", "tree_8"])
def test_the_jacobian_with_mimic_joints_is_the_jacobian_of_free_joints_times_g(name: str) -> None:
    coupled, free = robot_of(name), robot_of(name, mimic=False)
    mimic_joints = [joint for joint in coupled.tree.joints if joint.mimic]
    assert mimic_joints
    assert free.nv == coupled.nv + len(mimic_joints)
    q, v, a = state(coupled, 7, 10)
    G, q_free = np.zeros((free.nv, coupled.nv)), np.zeros((7, free.nq))
    for i, joint in enumerate(coupled.tree.joints):
        factor, offset = (joint.mimic.multiplier, joint.mimic.offset) if joint.mimic else (1.0, 0.0)
        for c in range(joint.kind.nv):
            G[free.tree.v_index[i] + c, coupled.tree.v_index[i] + c] = factor
        for c in range(joint.kind.nq):
            q_free[:, free.tree.q_index[i] + c] = factor * q[:, coupled.tree.q_index[i] + c] + offset
    for frame in frames(coupled):
        assert close(coupled.placement(q, frame), free.placement(q_free, frame))
        for reference in Reference:
            J = free.jacobian(q_free, frame, reference)
            assert close(coupled.jacobian(q, frame, reference), J @ G, J * np.abs(G).max())
            acceleration = free.acceleration(q_free, v @ G.T, a @ G.T, frame, reference)
            assert close(coupled.acceleration(q, v, a, frame, reference), acceleration)


ELBOW = urdfs.robot(
    urdfs.joint("shoulder", "continuous", "base", "upper"),
    urdfs.joint("elbow", "continuous", "upper", "lower", 'xyz="3 0 0"'),
    urdfs.joint("flange", "fixed", "lower", "tip", 'xyz="4 0 0"'),
)


def test_an_elbow_of_three_and_four_metres_has_its_tip_at_five_metres() -> None:
    # Computed by hand: two links of 3 m and 4 m at a right angle.
    robot, q = load(ELBOW), [0.0, np.pi / 2]
    assert robot.placement(q, "tip")[:3, 3] == pytest.approx([3.0, 4.0, 0.0], abs=1e-15)
    assert np.hypot(*robot.placement(q, "tip")[:2, 3]) == pytest.approx(5.0, rel=1e-15)
    assert robot.jacobian(q, "tip")[:2] == pytest.approx(np.array([[-4.0, -4.0], [3.0, 0.0]]), abs=2e-15)
    # Both joints at 1 rad/s: by 7.130 -w1^2 d1 - w2^2 d2 = -1 (3, 0) - 4 (0, 4).
    acceleration = robot.acceleration(q, [1.0, 1.0], [0.0, 0.0], "tip")
    assert acceleration[:2] == pytest.approx([-3.0, -16.0], abs=1e-14)


# J a + J-dot v is the recursion's acceleration, on every robot of the catalogue and in every reference.


def room(bound: Bound) -> FloatArray:
    allowed: FloatArray = EPS * bound.k * bound.scale
    return allowed


@pytest.mark.parametrize("name", [*catalogue(), *sorted(set(NAMES) - set(catalogue()))])
def test_the_acceleration_is_the_sum_of_the_terms_of_the_jacobian_and_of_the_jacobian_rate(name: str) -> None:
    robot = urdfkin.load(name, verify=False) if name in catalogue() else robot_of(name)
    tree = robot.tree
    generator = np.random.default_rng(5)
    q, (v, a) = robot.sample(4, 5), generator.normal(size=(2, 4, tree.nv))
    plan = robot.plan(range(len(tree.links)))
    size = compute_magnitudes(plan, q, v, a, FIXED_BASE_STATE)
    for reference in Reference:
        J, J_rate = evaluate.jacobians(plan, q, reference), evaluate.jacobian_rates(plan, q, v, reference)
        total = np.einsum("nfij,nj->nfi", J, a) + np.einsum("nfij,nj->nfi", J_rate, v)
        expected = evaluate.accelerations(plan, q, v, a, reference)
        if reference is not Reference.LOCAL_WORLD_ALIGNED:
            # In this reference frame, the sum is the spatial acceleration.
            velocity = evaluate.velocities(plan, q, v, reference)
            expected[..., :3] -= np.cross(velocity[..., 3:], velocity[..., :3])
        allowed = (
            np.einsum("nfij,nj->nfi", room(JACOBIAN.bound(plan, size, reference)), np.abs(a))
            + np.einsum("nfij,nj->nfi", room(JACOBIAN_RATE.bound(plan, size, reference)), np.abs(v))
            + room(ACCELERATION.bound(plan, size, reference))
        )
        assert (np.abs(total - expected) <= allowed).all(), reference


# -- difference quotients for several step sizes ---------------------------------------------------

STEPS = 2.0 ** -np.arange(3.0, 26.0)


def errors(name: str, seed: int, order: int) -> tuple[FloatArray, FloatArray, float]:
    """Return errors of the quotients of position and orientation at each step, and the numerators' size."""
    robot = robot_of(name)
    q, v, a = (x[0] for x in state(robot, 1, seed))
    frame = robot.tip_frame
    after = robot.placement(moved(robot, q, v, STEPS), frame)
    before = robot.placement(moved(robot, q, v, -STEPS), frame)
    now = robot.placement(q, frame)
    reach = 1.0 + float(np.abs(after[:, :3, 3]).max())
    h = STEPS[:, np.newaxis]
    if order == 1:
        velocity = robot.jacobian(q, frame) @ v
        linear = (after[:, :3, 3] - before[:, :3, 3]) / (2.0 * h) - velocity[:3]
        turn = rotation_vector(after[:, :3, :3] @ before[:, :3, :3].swapaxes(-1, -2)) / (2.0 * h)
        return np.abs(linear).max(axis=1), np.abs(turn - velocity[3:]).max(axis=1), reach
    acceleration = robot.acceleration(q, v, np.zeros_like(a), frame)
    linear = (after[:, :3, 3] - 2.0 * now[:3, 3] + before[:, :3, 3]) / h**2 - acceleration[:3]
    forth = rotation_vector(after[:, :3, :3] @ now[:3, :3].T)
    turn = (forth + rotation_vector(before[:, :3, :3] @ now[:3, :3].T)) / h**2 - acceleration[3:]
    return np.abs(linear).max(axis=1), np.abs(turn).max(axis=1), reach


def assert_converges(error: FloatArray, reach: float, order: int) -> None:
    """Demand that the error is proportional to h^2 for large steps, and reaches the rounding error."""
    floor = 200.0 * EPS * reach / STEPS**order
    falling = np.flatnonzero((error[:-1] > 30.0 * floor[:-1]) & (error[1:] > 30.0 * floor[1:]))
    if len(falling) > 2:
        rates = np.log2(error[falling] / error[falling + 1])
        assert abs(rates[-1] - 2.0) < 0.1, rates
        assert abs(rates[len(rates) // 2 :] - 2.0).max() < 0.3, rates
    constant = max(float(error[0]), reach) / STEPS[0] ** 2
    assert (error <= 4.0 * constant * STEPS**2 + floor).all()
    # The best step leaves an error of about eps^(2/3) for slopes and eps^(1/2) for curvatures.
    assert error.min() < 300.0 * reach * EPS ** (2.0 / (2.0 + order))


@pytest.mark.slow
@pytest.mark.parametrize("order", [1, 2], ids=["Jacobian", "acceleration"])
@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("name", NAMES)
def test_central_differences_converge_to_jacobian_and_acceleration_with_second_order(
    name: str, seed: int, order: int
) -> None:
    linear, angular, reach = errors(name, seed, order)
    assert_converges(linear, reach, order)
    assert_converges(angular, 1.0, order)


def test_the_convergence_check_detects_an_error_of_1e_7_in_a_jacobian() -> None:
    linear, _, reach = errors("panda", 0, order=1)
    with pytest.raises(AssertionError):
        assert_converges(linear + 1e-7, reach, 1)


# -- relative placements ---------------------------------------------------------------------------

#: Frames on one branch and on two, in both directions; also with a mimic joint.
TRIPLES = [
    ("panda", ("panda_link4", "panda_hand", "panda_leftfinger")),
    ("panda", ("panda_rightfinger", "panda_link2", "panda_link0")),
    ("talos", ("left_sole_link", "gripper_right_base_link", "torso_1_link")),
]


@pytest.mark.parametrize("root_joint", [None, "floating"])
@pytest.mark.parametrize(("name", "frames"), TRIPLES)
def test_relative_placements_are_composed_and_inverted(
    name: str, frames: tuple[str, str, str], root_joint: str | None
) -> None:
    robot = urdfkin.load(name, root_joint=root_joint)
    q = robot.sample(5, seed=1)
    a, b, c = frames
    T_a_b, T_b_c, T_a_c, T_b_a = (
        robot.relative_placement(q, frame, relative_to=other)
        for other, frame in ((a, b), (b, c), (a, c), (b, a))
    )
    np.testing.assert_allclose(T_a_b @ T_b_c, T_a_c, atol=1e-14)
    np.testing.assert_allclose(T_a_b @ T_b_a, np.broadcast_to(np.eye(4), T_a_b.shape), atol=1e-14)
    np.testing.assert_allclose(robot.placement(q, a) @ T_a_b, robot.placement(q, b), atol=1e-14)
    assert robot.certificate().verified


def test_a_relative_placement_equals_the_placement_of_the_chain() -> None:
    robot = urdfkin.load("panda")
    q = robot.sample(6, seed=2)
    path = robot.chain("panda_leftfinger", "panda_link3")
    T = robot.relative_placement(q, "panda_leftfinger", "panda_link3")
    np.testing.assert_allclose(T, path.placement(robot.select(path, q)), atol=1e-14)


def test_relative_placement_accepts_frames_batches_and_out_as_placement_does() -> None:
    robot = urdfkin.load("ur5")
    q = robot.sample(6, seed=3).reshape(2, 3, 6)
    out = np.empty((2, 3, 2, 4, 4))
    both = robot.relative_placement(q, ["tool0", "base_link"], "wrist_1_link", out=out)
    assert both is out
    for f, frame in enumerate(("tool0", "base_link")):
        np.testing.assert_array_equal(both[:, :, f], robot.relative_placement(q, frame, "wrist_1_link"))
    line = robot.certificate().lines[0]
    assert (line.quantity, line.checked) == ("relative placement", 24)  # `relative_to` has no result


@pytest.mark.parametrize("mistake", [1e-12, "transposed", "in the world's axes"])
def test_an_error_in_a_relative_placement_is_found_and_reproducible(
    mistake: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    right: Any = bodies.relative_pose

    def wrong(T_a: FloatArray, T_b: FloatArray, out: FloatArray | None) -> FloatArray:
        T: FloatArray = right(T_a, T_b, out)
        if mistake == "transposed":
            T[..., :3, :3] = T[..., :3, :3].swapaxes(-1, -2).copy()
        elif isinstance(mistake, float):
            T[..., 0, 3] += mistake
        else:
            T[..., :3, 3] = T_b[..., :3, 3] - T_a[..., :3, 3]
        return T

    robot = urdfkin.load("ur5")
    q = robot.sample(1, seed=4)[0]
    monkeypatch.setattr(bodies, "relative_pose", wrong)
    with pytest.raises(VerificationError, match="relative placement of tool0") as caught:
        robot.relative_placement(q, "tool0", "forearm_link")
    monkeypatch.undo()
    again = caught.value.reproduce
    assert again.startswith("urdfkin.load('ur5').relative_placement(")
    np.testing.assert_array_equal(eval(again), robot.relative_placement(q, "tool0", "forearm_link"))
