"""A table's Jacobian and acceleration are Pinocchio's, and the derivatives of its own placement."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.dh.arms import arm
from tests.oracle import TreeOracle
from tests.random_chains import configurations, rotation, shift, trees
from urdfkin.dh.make import dh_table
from urdfkin.dh.motion import acceleration, jacobian, velocity
from urdfkin.errors import InputError, UnknownNameError
from urdfkin.model.chain import chain
from urdfkin.model.tree import KinematicTree

EPS = float(np.finfo(np.float64).eps)


@pytest.mark.slow
@given(trees(min_joints=1), st.sampled_from(["standard", "modified"]))
@settings(max_examples=30)
def test_jacobian_and_acceleration_agree_with_pinocchio(tree: KinematicTree, convention: str) -> None:
    path, table, oracle = chain(tree, "tip"), dh_table(tree, "tip", convention=convention), TreeOracle(tree)
    columns = list(path.coupling.v_index(tree))
    q, v, a = (configurations(tree.nq, 3, seed) for seed in (0, 1, 2))
    q_own, v_own, a_own = (path.coupling.select(tree, array) for array in (q, v, a))
    rates = np.abs(path.coupling.matrix).sum(initial=1.0) * 3.0
    reach = table.span + rates + float(np.linalg.norm(table.base[:3, 3]))
    bound = 20 * EPS * (1 + len(table.rows)) * reach
    J, vel = jacobian(table, q_own), velocity(table, q_own, v_own)
    acc = acceleration(table, q_own, v_own, a_own)
    for i in range(len(q)):
        expected = oracle.jacobian(q[i], "tip")
        assert np.abs(J[i] - expected[:, columns]).max(initial=0.0) <= bound * rates
        assert np.abs(acc[i] - oracle.acceleration(q[i], v[i], a[i], "tip")).max() <= bound * (1 + rates) ** 2
        np.testing.assert_allclose(vel[i], J[i] @ v_own[i], atol=bound * rates, rtol=0)


def test_batches_broadcast_and_lengths_are_checked() -> None:
    link = shift(0.3, 0.0, 0.1) @ rotation("x", 1.0)
    table = dh_table(arm(link, link, link), "tip")
    q = np.zeros((4, 1, 3))
    assert jacobian(table, q).shape == (4, 1, 6, 3)
    assert acceleration(table, q, np.ones((5, 3)), np.ones(3)).shape == (4, 5, 6)
    named = velocity(table, {"j1": 0.1, "j2": 0.0, "j3": 0.0}, "neutral, j2=90deg/s")
    np.testing.assert_array_equal(named, velocity(table, [0.1, 0.0, 0.0], [0.0, np.pi / 2, 0.0]))
    with pytest.raises(InputError, match="v needs 3 values"):
        velocity(table, q, np.ones(2))
    with pytest.raises(UnknownNameError, match="unknown reference"):
        jacobian(table, q, "sideways")
