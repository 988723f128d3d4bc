"""Identities that hold for any robot, whatever Pinocchio says."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.laws.subjects import EPS, NAMES, robot_of, state
from tests.robots.odd_urdfs import Urdf
from urdfkin import load
from urdfkin.kinematics.rotation import exp_rotation
from urdfkin.model.base_motion import BaseMotion
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray, JointKind
from urdfkin.robot import Robot

LOCAL, WORLD, ALIGNED = Reference
#: Room for the rounding of a law's own arithmetic, in eps of the largest number that enters it.
ROOM = 2000.0 * EPS


@pytest.fixture(scope="module", params=NAMES)
def robot(request: pytest.FixtureRequest) -> Robot:
    return robot_of(request.param)


def frames(robot: Robot) -> list[str]:
    """The tip, the root and one in the middle."""
    links = robot.tree.links
    return [robot.tip_frame, robot.tree.frame_name(0), robot.tree.frame_name(len(links) // 2)]


def close(one: FloatArray, other: FloatArray, *sizes: FloatArray) -> bool:
    """Whether two arrays agree to rounding of what they were computed from."""
    largest = max([1.0, *(float(np.abs(x).max(initial=0.0)) for x in (one, other, *sizes))])
    return bool(np.abs(one - other).max(initial=0.0) <= ROOM * largest)


@pytest.mark.parametrize("reference", list(Reference))
def test_the_velocity_is_the_jacobian_times_the_rates(robot: Robot, reference: Reference) -> None:
    q, v, _ = state(robot, 17, 1)
    for frame in frames(robot):
        J = robot.jacobian(q, frame, reference)
        velocity = robot.velocity(q, v, frame, reference)
        assert close(np.einsum("nij,nj->ni", J, v), velocity, J)


@pytest.mark.parametrize("reference", list(Reference))
def test_j_a_plus_j_dot_v_is_the_acceleration(robot: Robot, reference: Reference) -> None:
    # In LOCAL and WORLD it is the spatial acceleration, from which the classical one differs by w x vel.
    q, v, a = state(robot, 17, 2)
    for frame in frames(robot):
        J, J_dot = robot.jacobian(q, frame, reference), robot.jacobian_rate(q, v, frame, reference)
        total = np.einsum("nij,nj->ni", J, a) + np.einsum("nij,nj->ni", J_dot, v)
        if reference is not ALIGNED:
            velocity = robot.velocity(q, v, frame, reference)
            total[:, :3] += np.cross(velocity[:, 3:], velocity[:, :3])
        assert close(total, robot.acceleration(q, v, a, frame, reference), J, J_dot)


def test_references_are_related_by_the_motion_of_a_rigid_body(robot: Robot) -> None:
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
        J = robot.jacobian(q, frame)
        columns = np.moveaxis(J, -1, 1)
        assert close(turned(R[:, None], columns), np.moveaxis(robot.jacobian(q, frame, LOCAL), -1, 1))
        shifted = columns.copy()
        shifted[..., :3] += np.cross(columns[..., 3:], d[:, None])
        assert close(shifted, np.moveaxis(robot.jacobian(q, frame, WORLD), -1, 1))


def turned(R: FloatArray, six: FloatArray) -> FloatArray:
    """[R^T linear; R^T angular]."""
    pairs = six.reshape(*six.shape[:-1], 2, 3)
    back: FloatArray = np.einsum("...ji,...pj->...pi", R, pairs).reshape(six.shape)
    return back


def test_the_power_of_a_wrench_and_the_torques_it_asks_for_do_not_depend_on_the_reference(
    robot: Robot,
) -> None:
    q, v, _ = state(robot, 17, 4)
    frame = robot.tip_frame
    force = np.random.default_rng(5).normal(size=(17, 6))  # at the frame's origin, in world axes
    T = robot.placement(q, frame)
    world = force.copy()
    world[:, 3:] += np.cross(T[:, :3, 3], force[:, :3])
    wrenches = {ALIGNED: force, LOCAL: turned(T[:, :3, :3], force), WORLD: world}
    powers = {
        reference: np.einsum("ni,ni->n", wrench, robot.velocity(q, v, frame, reference))
        for reference, wrench in wrenches.items()
    }
    torques = {
        reference: np.einsum("nij,ni->nj", robot.jacobian(q, frame, reference), wrench)
        for reference, wrench in wrenches.items()
    }
    size = np.abs(world).max() * np.abs(robot.velocity(q, v, frame, WORLD))
    for reference in (LOCAL, WORLD):
        assert close(powers[reference], powers[ALIGNED], size)
        assert close(torques[reference], torques[ALIGNED], world * 10.0)
    assert close(np.einsum("nj,nj->n", torques[ALIGNED], v), powers[ALIGNED], size)


def test_rates_twice_as_fast_double_velocities_and_quadruple_accelerations_exactly(robot: Robot) -> None:
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
def test_a_moving_base_is_the_same_robot_on_a_floating_root_joint() -> None:
    for name in ("panda", "mimic_hand_40_sliding", "planar_and_floating_in_the_middle"):
        robot, free = robot_of(name), robot_of(name, root_joint="floating")
        q, v, a = state(robot, 6, 8)
        generator = np.random.default_rng(9)
        R, p = exp_rotation(generator.normal(size=(6, 3))), generator.normal(size=(6, 3))
        T = np.tile(np.eye(4), (6, 1, 1))
        T[:, :3, :3], T[:, :3, 3] = R, p
        base = BaseMotion(T, *generator.normal(size=(2, 6, 6)))
        quaternion = np.array([_quaternion(x) for x in base.placement[:, :3, :3]])
        spatial = base.acceleration.copy()
        spatial[:, :3] -= np.cross(base.velocity[:, 3:], base.velocity[:, :3])
        q_free = np.hstack((p, quaternion, q))
        v_free = np.hstack((turned(R, base.velocity), v))
        a_free = np.hstack((turned(R, spatial), a))
        for frame in frames(robot):
            assert close(robot.placement(q, frame, base=base), free.placement(q_free, frame))
            for reference in Reference:
                ours = robot.velocity(q, v, frame, reference, base=base)
                assert close(ours, free.velocity(q_free, v_free, frame, reference))
                ours = robot.acceleration(q, v, a, frame, reference, base=base)
                assert close(ours, free.acceleration(q_free, v_free, a_free, frame, reference))
                ours = robot.jacobian(q, frame, reference, base=base)
                assert close(ours, free.jacobian(q_free, frame, reference)[..., 6:])
                ours = robot.jacobian_rate(q, v, frame, reference, base=base)
                assert close(ours, free.jacobian_rate(q_free, v_free, frame, reference)[..., 6:])


def _quaternion(R: FloatArray) -> FloatArray:
    quaternion: FloatArray = Rotation.from_matrix(R).as_quat()
    return quaternion


@pytest.mark.parametrize("name", ["panda", "mimic_hand_40_sliding", "followers_of_followers", "tree_8"])
def test_the_jacobian_of_coupled_joints_is_that_of_free_ones_times_g(name: str) -> None:
    coupled, free = robot_of(name), robot_of(name, mimic=False)
    followers = [joint for joint in coupled.tree.joints if joint.mimic]
    assert followers
    assert free.nv == coupled.nv + len(followers)
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


def test_an_elbow_of_three_and_four_metres_is_where_pythagoras_puts_it() -> None:
    # By hand, in whole numbers: two links of 3 m and 4 m at a right angle.
    urdf = Urdf("elbow", 0)
    urdf.add("continuous", axis='<axis xyz="0 0 1"/>', origin="")
    urdf.add("continuous", axis='<axis xyz="0 0 1"/>', origin='<origin xyz="3 0 0"/>')
    urdf.add("fixed", link="tip", origin='<origin xyz="4 0 0"/>')
    robot, q = load(urdf.text), [0.0, np.pi / 2]
    assert robot.placement(q, "tip")[:3, 3] == pytest.approx([3.0, 4.0, 0.0], abs=1e-15)
    assert np.hypot(*robot.placement(q, "tip")[:2, 3]) == pytest.approx(5.0, rel=1e-15)
    assert robot.jacobian(q, "tip")[:2] == pytest.approx(np.array([[-4.0, -4.0], [3.0, 0.0]]), abs=2e-15)
    # Both joints at 1 rad/s: by 7.130 -w1^2 d1 - w2^2 d2 = -1 (3, 0) - 4 (0, 4).
    acceleration = robot.acceleration(q, [1.0, 1.0], [0.0, 0.0], "tip")
    assert acceleration[:2] == pytest.approx([-3.0, -16.0], abs=1e-14)
