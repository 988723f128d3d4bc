"""The rotation of a base is not changed, and Pinocchio receives it from independent code."""

import copy
import pickle

import mpmath as mp
import numpy as np
import pinocchio as pin
import pytest

import urdfkin
from tests.urdfs import joint, robot
from urdfkin import BaseMotion
from urdfkin.errors import InputError
from urdfkin.kinematics.rotation import exp_rotation, nearest_rotation
from urdfkin.kinematics.roundings import EPS, PINOCCHIO_ROUNDINGS
from urdfkin.model import base_motion as recursion_base
from urdfkin.model.base_motion import FIXED_BASE_STATE
from urdfkin.model.tree import FloatArray, pose
from urdfkin.verify.bounds import compute_magnitudes
from urdfkin.verify.oracle import free_flyer_q, free_flyer_velocity, nearest_quaternion

ARM = robot(joint("j", "continuous", "a", "b", 'xyz="0.3 0.2 0.1" rpy="1 2 3"', "0.6 0 0.8"))


def orientations(n: int, seed: int) -> FloatArray:
    """Return rotations (n, 3, 3); half of them have nine decimals, and some are quarter or half turns."""
    vectors = np.random.default_rng(seed).normal(size=(n, 3)) * 2.0
    vectors[::5] = np.pi * np.eye(3)[np.arange(len(vectors[::5])) % 3]
    R = exp_rotation(vectors)
    R[::2] = np.round(R[::2], 9)
    return R


def at(R: FloatArray) -> FloatArray:
    T = np.broadcast_to(np.eye(4), (*R.shape[:-2], 4, 4)).copy()
    T[..., :3, :3] = R
    return T


def test_a_rotation_with_nine_decimals_is_accepted_and_an_exact_rotation_is_unchanged() -> None:
    # An earlier version refused one in five of these matrices.
    R = np.round(exp_rotation(np.random.default_rng(0).normal(size=(2000, 3))), 9)
    assert BaseMotion(at(R)).placement.shape == (2000, 4, 4)
    with pytest.raises(InputError, match="the rotation of the base's placement must be a rotation"):
        BaseMotion(at(np.round(R, 8)))
    turns = np.array([np.eye(3)[list(p)] for p in [(0, 1, 2), (1, 2, 0), (2, 0, 1)]])
    assert (nearest_rotation(turns) == turns).all()
    assert (free_flyer_q(BaseMotion()) == [0, 0, 0, 0, 0, 0, 1]).all()


def nearest_at_50_digits(M: FloatArray) -> FloatArray:
    with mp.workdps(50):
        X = mp.matrix(M.tolist())
        for _ in range(8):
            X = (X + (X**-1).T) / 2
        return np.array(X.tolist(), dtype=object)


@pytest.mark.slow
def test_urdfkin_and_the_oracle_find_the_same_nearest_rotation() -> None:
    ours, theirs = list[float](), list[float]()
    for M in orientations(60, 1):
        truth = nearest_at_50_digits(M)
        by_pinocchio = pin.Quaternion(nearest_quaternion(M)).toRotationMatrix()
        for found, R in ((ours, nearest_rotation(M)), (theirs, by_pinocchio)):
            found.append(float(np.linalg.norm((R.astype(object) - truth).astype(np.float64), 2)) / EPS)
    # The bounds derived in `roundings` are larger: 3.2 for urdfkin, 11 for Pinocchio.
    assert max(ours) < 1.5
    assert max(theirs) < 8.0


def test_a_base_keeps_its_numbers_and_a_floating_joint_has_velocities_in_its_own_axes() -> None:
    T = at(orientations(200, 2))
    base = BaseMotion(T, np.arange(6.0))
    assert (base.placement == T).all()
    for again in (pickle.loads(pickle.dumps(base)), copy.copy(base), copy.deepcopy(base)):
        assert (again.placement == T).all()
        assert (again.state((200,)) == base.state((200,))).all()
        assert not again.placement.flags.writeable
    generator = np.random.default_rng(4)
    R, six = orientations(50, 3), generator.normal(size=(50, 6))
    expected = np.einsum("nji,npj->npi", nearest_rotation(R), six.reshape(50, 2, 3)).reshape(50, 6)
    np.testing.assert_allclose(free_flyer_velocity(BaseMotion(at(R), six)), expected, atol=1e-14)


@pytest.mark.parametrize("frame", ["a", "b"])
def test_pinocchio_does_not_use_the_rotation_of_urdfkin(monkeypatch: pytest.MonkeyPatch, frame: str) -> None:
    def turned_back(R: FloatArray, name: str) -> FloatArray:
        return np.swapaxes(nearest_rotation(R, name), -1, -2)

    monkeypatch.setattr(recursion_base, "nearest_rotation", turned_back)
    base = BaseMotion(at(exp_rotation([0.1, 0.2, 0.3])))
    with pytest.raises(urdfkin.VerificationError):
        urdfkin.load(ARM).placement([0.0], frame, base=base)


@pytest.mark.parametrize("reference", ["local", "world", "local_world_aligned"])
def test_errors_on_a_rotated_base_are_well_within_the_bound(reference: str) -> None:
    generator, n = np.random.default_rng(5), 300
    arm = urdfkin.load(ARM)
    q, v, a = generator.normal(size=(3, n, 1))
    T = at(orientations(n, 6))
    T[:, :3, 3] = generator.normal(size=(n, 3))
    base = BaseMotion(T, *generator.normal(size=(2, n, 6)))
    arm.placement(q, arm.link_frames, base=base)
    arm.velocity(q, v, ["a", "b"], reference, base=base)
    arm.jacobian(q, ["a", "b"], reference, base=base)
    arm.acceleration(q, v, a, ["a", "b"], reference, base=base)
    assert arm.certificate().verified
    assert max(line.bound_ratio for line in arm.certificate().lines) < 0.2


def test_only_a_rotated_base_counts_as_a_joint_in_the_bound() -> None:
    plan, q = urdfkin.load(ARM).plan([0, 1]), np.zeros((1, 1))
    turned = BaseMotion(at(exp_rotation([0.0, 0.0, 1.0])))
    counts = [
        (compute_magnitudes(plan, q, None, None, state).roundings / PINOCCHIO_ROUNDINGS).tolist()
        for state in (FIXED_BASE_STATE, BaseMotion(pose(p=[1.0, 2.0, 3.0])).state(()), turned.state(()))
    ]
    assert counts == [[[1.0, 2.0]], [[1.0, 2.0]], [[2.0, 3.0]]]


def test_each_sample_has_its_own_base() -> None:
    panda, generator = urdfkin.load("panda"), np.random.default_rng(7)
    q, v = panda.sample(6, 0).reshape(2, 3, 8), generator.normal(size=(3, 8))
    T = at(exp_rotation(generator.normal(size=(2, 1, 3))))
    base = BaseMotion(T, generator.normal(size=(3, 6)), generator.normal(size=6))
    together = panda.acceleration(q, v, v, "panda_hand", base=base, verify="sample")
    for i, j in np.ndindex(2, 3):
        own = BaseMotion(base.placement[i, 0], base.velocity[j], base.acceleration)
        alone = panda.acceleration(q[i, j], v[j], v[j], "panda_hand", base=own)
        np.testing.assert_allclose(together[i, j], alone, atol=1e-12)
    assert panda.certificate().verified
