"""The equations for lengths bound the equations for vectors; only zero has the length zero."""

import inspect
from types import FunctionType
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.strategies import rotations, trees
from urdfkin.compiled.evaluate import accelerations, placements, velocities
from urdfkin.compiled.plan import compile_tree
from urdfkin.kinematics import equations
from urdfkin.kinematics.arithmetic import VECTOR_OPERATIONS
from urdfkin.kinematics.number_kinds import array_equations as on_vectors
from urdfkin.kinematics.number_kinds import length_equations as on_lengths
from urdfkin.kinematics.number_kinds import magnitude, norm, product
from urdfkin.kinematics.roundings import EPS, SMALLEST_NORMAL
from urdfkin.model.base_motion import FIXED_BASE_STATE
from urdfkin.model.configuration import draw_samples
from urdfkin.model.tree import FloatArray, KinematicTree
from urdfkin.verify.bounds import compute_magnitudes

#: Every equation of motion, except those that compute a rotation from a sine and a cosine.
EQUATIONS = sorted(
    name
    for name, value in vars(equations).items()
    if isinstance(value, FunctionType)
    and name not in VECTOR_OPERATIONS
    and not name.startswith("about_")
    and name != "rotation_of_quaternion"
)
numbers = st.one_of(st.floats(-1e3, 1e3), st.sampled_from([0.0, 1e-200, -1e-308, 5e-324, 1e60]))
vectors = st.tuples(numbers, numbers, numbers).map(np.array)
sizes = st.one_of(st.just(0.0), st.floats(5e-324, 1e100))


def parameters(name: str) -> list[str]:
    return list(inspect.signature(getattr(equations, name)).parameters)


def numbers_of(name: str) -> set[str]:
    return {"d", "a"} if name == "interorigin_vector" else {"v", "a"}


def both(result: Any) -> tuple[Any, ...]:
    return result if isinstance(result, tuple) else (result,)


@pytest.mark.slow
@pytest.mark.parametrize("name", EQUATIONS)
@given(data=st.data())
@settings(max_examples=60)
def test_the_length_of_a_result_is_at_most_the_result_for_lengths(name: str, data: st.DataObject) -> None:
    given: dict[str, Any] = {
        x: data.draw(rotations if x == "R" else numbers if x in numbers_of(name) else vectors)
        for x in parameters(name)
    }
    lengths = {
        x: None if x == "R" else magnitude(np.asarray(value)) if np.ndim(value) == 0 else norm(value)
        for x, value in given.items()
    }
    with np.errstate(under="ignore"):
        found = both(getattr(on_vectors, name)(**given))
        bounds = both(getattr(on_lengths, name)(**lengths))
    for vector, bound in zip(found, bounds, strict=True):
        assert np.hypot.reduce(vector) <= bound * (1.0 + 8.0 * EPS)


@pytest.mark.slow
@pytest.mark.parametrize("name", EQUATIONS)
@given(data=st.data())
@settings(max_examples=30)
def test_longer_inputs_never_give_shorter_results(name: str, data: st.DataObject) -> None:
    pairs = {x: sorted((data.draw(sizes), data.draw(sizes))) for x in parameters(name)}
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        shorter, longer = (
            both(
                getattr(on_lengths, name)(**{x: magnitude(np.asarray(pair[i])) for x, pair in pairs.items()})
            )
            for i in (0, 1)
        )
    assert all(a <= b for a, b in zip(shorter, longer, strict=True))


@given(sizes, sizes)
def test_a_product_of_lengths_is_at_least_the_smallest_normal_number_unless_a_factor_is_zero(
    x: float, y: float
) -> None:
    with np.errstate(over="ignore", under="ignore"):
        xy = float(product(x, y))
        assert xy == max(x * y, SMALLEST_NORMAL) if x and y else xy == 0.0


@pytest.mark.slow
@given(trees(max_joints=6), st.integers(0, 2**32), st.sampled_from([1.0, 1e-3, 1e3, 1e-170]))
@settings(max_examples=40)
def test_the_motion_of_any_link_of_any_tree_is_within_the_computed_magnitude(
    tree: KinematicTree, seed: int, speed: float
) -> None:
    plan = compile_tree(tree, range(len(tree.links)))
    samples = draw_samples(tree, 5, np.random.default_rng(seed), with_zero_and_limits=True)
    q, v, a = samples.q, speed * samples.v, speed * samples.a
    size = compute_magnitudes(plan, q, v, a, FIXED_BASE_STATE)
    vel, acc = velocities(plan, q, v), accelerations(plan, q, v, a)

    def exceeds(found: FloatArray, size: FloatArray) -> bool:
        return bool((np.hypot.reduce(found, axis=-1) > size * (1.0 + 100.0 * EPS)).any())

    assert not exceeds(placements(plan, q)[..., :3, 3], size.p)
    assert not exceeds(vel[..., :3], size.vel)
    assert not exceeds(vel[..., 3:], size.w)
    assert not exceeds(acc[..., :3], size.acc)
    assert not exceeds(acc[..., 3:], size.alpha)
