"""The rate of the Jacobian: a derivative, a part of the acceleration, in three references."""

import numpy as np
import pytest
from scipy.linalg import expm

from tests.odd_tree import odd_tree, pose, state
from urdfkin.compiled.evaluate import accelerations, jacobian_rates, jacobians, velocities
from urdfkin.compiled.plan import compile_tree
from urdfkin.kinematics.inputs import FloatArray
from urdfkin.kinematics.rotation import exp_rotation, multiply, quaternion_of, rotation_of, skew
from urdfkin.model.base_motion import BaseMotion
from urdfkin.model.reference import Reference
from urdfkin.model.tree import JointKind, KinematicTree

EPS = np.finfo(np.float64).eps


@pytest.fixture(scope="module")
def odd() -> KinematicTree:
    return odd_tree()


def moved(tree: KinematicTree, q: FloatArray, v: FloatArray, t: float) -> FloatArray:
    """The configuration after going on with the rates v for a time t."""
    later = q.copy()
    for i, joint in enumerate(tree.joints):
        at, rate = tree.q_index[i], tree.v_index[i]
        if joint.kind is JointKind.FLOATING:
            turn = quaternion_of(exp_rotation(v[:, rate + 3 : rate + 6] * t))
            # The exact flow of a constant body twist.
            T = np.zeros((len(q), 4, 4))
            T[:, :3, :3], T[:, :3, 3] = _twist_exponential(v[:, rate : rate + 6] * t)
            R = rotation_of(q[:, at + 3 : at + 7])
            later[:, at : at + 3] = q[:, at : at + 3] + (R @ T[:, :3, 3:])[..., 0]
            later[:, at + 3 : at + 7] = multiply(q[:, at + 3 : at + 7], turn)
        elif joint.kind is JointKind.PLANAR:
            twist = np.zeros((len(q), 6))
            twist[:, (0, 1, 5)] = v[:, rate : rate + 3] * t
            _, p = _twist_exponential(twist)
            c, s = np.cos(q[:, at + 2]), np.sin(q[:, at + 2])
            later[:, at] += c * p[:, 0] - s * p[:, 1]
            later[:, at + 1] += s * p[:, 0] + c * p[:, 1]
            later[:, at + 2] += v[:, rate + 2] * t
        elif joint.nq:
            later[:, at] = q[:, at] + v[:, rate] * t
    return later


def _twist_exponential(twist: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rotation and translation of exp of [linear; angular], by SciPy's general matrix exponential."""
    X = np.zeros((len(twist), 4, 4))
    X[:, :3, :3], X[:, :3, 3] = skew(twist[:, 3:]), twist[:, :3]
    T = expm(X)
    return T[:, :3, :3], T[:, :3, 3]


@pytest.mark.slow
@pytest.mark.parametrize("reference", list(Reference))
def test_it_is_the_derivative_of_the_jacobian_along_the_motion(
    odd: KinematicTree, reference: Reference
) -> None:
    plan = compile_tree(odd, range(len(odd.links)))
    q, v, _ = state(odd, 5, 1)
    step = 1e-3
    weights = {1: 3 / 4, 2: -3 / 20, 3: 1 / 60}
    slope = sum(
        weight
        / step
        * (
            jacobians(plan, moved(odd, q, v, n * step), reference)
            - jacobians(plan, moved(odd, q, v, -n * step), reference)
        )
        for n, weight in weights.items()
    )
    assert np.abs(jacobian_rates(plan, q, v, reference) - slope).max() < 1e-10


def test_with_the_jacobian_it_makes_the_acceleration_of_7_126(odd: KinematicTree) -> None:
    plan = compile_tree(odd, range(len(odd.links)))
    q, v, a = state(odd, 33, 2)
    total = np.einsum("nfij,nj->nfi", jacobians(plan, q), a) + np.einsum(
        "nfij,nj->nfi", jacobian_rates(plan, q, v), v
    )
    assert np.abs(total - accelerations(plan, q, v, a)).max() <= 64 * EPS * 30.0


def test_in_local_axes_it_makes_the_spatial_acceleration(odd: KinematicTree) -> None:
    plan = compile_tree(odd, range(len(odd.links)))
    q, v, a = state(odd, 17, 3)
    total = np.einsum("nfij,nj->nfi", jacobians(plan, q, Reference.LOCAL), a) + np.einsum(
        "nfij,nj->nfi", jacobian_rates(plan, q, v, Reference.LOCAL), v
    )
    velocity = velocities(plan, q, v, Reference.LOCAL)
    spatial = accelerations(plan, q, v, a, Reference.LOCAL)
    spatial[..., :3] -= np.cross(velocity[..., 3:], velocity[..., :3])
    assert np.abs(total - spatial).max() <= 64 * EPS * 30.0


def test_on_a_moving_base_the_rest_is_what_the_base_does(odd: KinematicTree) -> None:
    # The velocity is J v + B, with B that of a robot whose joints stand still. The rate of B is its value at
    # rest and, for the linear rows, w_base x (J v), because the joints move the point that the base carries.
    plan = compile_tree(odd, range(len(odd.links)))
    q, v, a = state(odd, 9, 4)
    generator = np.random.default_rng(5)
    motion = BaseMotion(pose(generator), generator.normal(size=6), generator.normal(size=6))
    base, still = motion.state(()), np.zeros_like(v)
    J = jacobians(plan, q, base=base)
    carried = np.einsum("nfij,nj->nfi", J, v)
    total = (
        np.einsum("nfij,nj->nfi", J, a)
        + np.einsum("nfij,nj->nfi", jacobian_rates(plan, q, v, base=base), v)
        + accelerations(plan, q, still, still, base=base)
    )
    total[..., :3] += np.cross(motion.velocity[3:], carried[..., :3])
    assert np.abs(total - accelerations(plan, q, v, a, base=base)).max() <= 64 * EPS * 50.0


def test_a_plan_for_one_frame_and_a_row_of_one_give_the_same(odd: KinematicTree) -> None:
    q, v, _ = state(odd, 35, 6)
    whole = jacobian_rates(compile_tree(odd, range(len(odd.links))), q, v)
    tyre = odd.link_index("tyre")
    alone = jacobian_rates(compile_tree(odd, [tyre]), q, v)[:, 0]
    assert np.abs(alone - whole[:, tyre]).max() <= 4 * EPS
    first = jacobian_rates(compile_tree(odd, [tyre]), q[:1], v[:1])[0, 0]
    assert np.abs(first - alone[0]).max() <= 4 * EPS


def test_it_vanishes_when_nothing_moves_and_for_an_empty_batch(odd: KinematicTree) -> None:
    plan = compile_tree(odd, [odd.link_index("wrist")])
    q, v, _ = state(odd, 3, 8)
    assert not jacobian_rates(plan, q, np.zeros_like(v)).any()
    assert jacobian_rates(plan, q[:0], v[:0]).shape == (0, 1, 6, odd.nv)
