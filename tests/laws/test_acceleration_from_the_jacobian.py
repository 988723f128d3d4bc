"""J a + J-dot v is the recursion's acceleration, on every robot of the catalogue and in every reference."""

import numpy as np
import pytest

import urdfkin
from urdfkin.compiled import evaluate
from urdfkin.kinematics.roundings import EPS
from urdfkin.model.base_motion import STILL_STATE
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray
from urdfkin.urdf.catalogue import catalogue
from urdfkin.verify.bounds import Bound, magnitudes
from urdfkin.verify.quantities import ACCELERATION, JACOBIAN, JACOBIAN_RATE


def room(bound: Bound) -> FloatArray:
    """What a quantity may be off by, number for number."""
    allowed: FloatArray = EPS * bound.k * bound.scale
    return allowed


@pytest.mark.parametrize("name", list(catalogue()))
def test_the_jacobian_and_its_rate_make_the_acceleration(name: str) -> None:
    robot = urdfkin.load(name, verify=False)
    tree = robot.tree
    generator = np.random.default_rng(5)
    q, (v, a) = robot.sample(4, 5), generator.normal(size=(2, 4, tree.nv))
    plan = robot.plan(range(len(tree.links)))
    size = magnitudes(plan, q, v, a, STILL_STATE)
    for reference in Reference:
        J, J_rate = evaluate.jacobians(plan, q, reference), evaluate.jacobian_rates(plan, q, v, reference)
        total = np.einsum("nfij,nj->nfi", J, a) + np.einsum("nfij,nj->nfi", J_rate, v)
        expected = evaluate.accelerations(plan, q, v, a, reference)
        if reference is not Reference.LOCAL_WORLD_ALIGNED:
            # There it is the spatial acceleration that they make.
            velocity = evaluate.velocities(plan, q, v, reference)
            expected[..., :3] -= np.cross(velocity[..., 3:], velocity[..., :3])
        allowed = (
            np.einsum("nfij,nj->nfi", room(JACOBIAN.bound(plan, size, reference)), np.abs(a))
            + np.einsum("nfij,nj->nfi", room(JACOBIAN_RATE.bound(plan, size, reference)), np.abs(v))
            + room(ACCELERATION.bound(plan, size, reference))
        )
        assert (np.abs(total - expected) <= allowed).all(), reference
