"""The compiled comparison equals its definition, `disagreement`, for all numbers."""

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scripts.check_bits import MODES
from urdfkin.compiled.preload import ComputeMode, use_only
from urdfkin.kinematics.roundings import EPS, SMALLEST_NORMAL
from urdfkin.model.tree import FloatArray
from urdfkin.verify.comparison import disagreement, worst_disagreements

ODD = (0.0, -0.0, 5e-324, 1e-310, SMALLEST_NORMAL, 1.0, 1.0 + EPS, -1.0, 1e300, 1.7e308, -1.7e308)
NEVER = (np.inf, -np.inf, np.nan)
numbers = st.one_of(st.floats(-10.0, 10.0), st.sampled_from(ODD), st.floats(), st.sampled_from(NEVER))
scales = st.one_of(
    st.floats(0.0, 100.0), st.sampled_from([0.0, 5e-324, SMALLEST_NORMAL / EPS, 1e300, np.inf, np.nan])
)


@pytest.fixture(autouse=True, params=MODES)
def _in_both_ways(request: pytest.FixtureRequest) -> Iterator[None]:
    way: ComputeMode = request.param
    with use_only(way):
        yield


def definition(ours: FloatArray, theirs: FloatArray, scale: FloatArray, axes: int) -> FloatArray:
    """Return the largest disagreement of each result; 0 for a result without numbers."""
    units = disagreement(ours, theirs, scale)
    return np.asarray(units.reshape(*ours.shape[:axes], -1).max(axis=-1, initial=0.0))


@st.composite
def cases(draw: st.DrawFn) -> tuple[FloatArray, FloatArray, FloatArray, int]:
    """Return results, some equal or different by rounding, and a scale that may need broadcasting."""
    shape = draw(st.sampled_from([(1,), (7,), (1, 6), (3, 2, 6), (2, 2, 6, 3), (17, 1, 4, 4)]))
    size = int(np.prod(shape))
    pool = draw(st.lists(numbers, min_size=1, max_size=24))
    ours = np.resize(np.array(pool), size).reshape(shape)
    change = np.resize(np.array(draw(st.lists(st.integers(0, 3), min_size=1, max_size=16))), size)
    other = np.resize(np.array(draw(st.lists(numbers, min_size=1, max_size=5))), size)
    with np.errstate(over="ignore"):  # before NumPy 2.2, the number after the largest one raised a flag
        up = np.nextafter(ours, np.inf).ravel()
    theirs = np.choose(change, [ours.ravel(), ours.ravel(), up, other]).reshape(shape)
    own = draw(st.sampled_from([shape, shape[-1:], (1,) * len(shape)]))
    scale = np.resize(np.array(draw(st.lists(scales, min_size=1, max_size=8))), int(np.prod(own)))
    return ours, theirs, scale.reshape(own), draw(st.integers(0, len(shape)))


@pytest.mark.slow
@settings(max_examples=150)
@given(cases())
def test_worst_of_each_equals_the_definition_to_the_last_bit(
    case: tuple[FloatArray, FloatArray, FloatArray, int],
) -> None:
    ours, theirs, scale, axes = case
    found = worst_disagreements(ours, theirs, scale, axes)
    with np.errstate(over="ignore"):
        expected = definition(ours, theirs, scale, axes)
    assert found.shape == ours.shape[:axes]
    np.testing.assert_array_equal(found, expected)


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_worst_of_each_equals_the_definition_for_typical_results(seed: int) -> None:
    generator = np.random.default_rng(seed)
    ours = generator.standard_normal((33, 3, 6, 8))
    theirs = ours + EPS * generator.standard_normal(ours.shape)
    scale = generator.uniform(0.1, 9.0, (33, 3, 6, 8))
    np.testing.assert_array_equal(
        worst_disagreements(ours, theirs, scale, 2), definition(ours, theirs, scale, 2)
    )


@pytest.mark.parametrize("frames", [1, 3])
def test_worst_of_each_equals_the_definition_for_a_scale_common_to_three_rows(frames: int) -> None:
    generator = np.random.default_rng(2)
    ours = generator.standard_normal((40, frames, 6, 8))
    theirs = ours + EPS * generator.standard_normal(ours.shape)
    scale = np.repeat(generator.uniform(0.1, 9.0, (1, frames, 2, 8)), 3, axis=2)
    scale[..., 5:] = ours[..., 5:] = theirs[..., 5:] = 0.0
    ours[3, 0, 1, 6], ours[5, -1, 2, 0], theirs[7, 0, 4, 1] = 5e-324, np.nan, np.inf
    ours[9, 0, 5, 2], theirs[11, 0, 0, 7] = -np.inf, -np.nan
    found = worst_disagreements(ours, theirs, scale, 2)
    np.testing.assert_array_equal(found, definition(ours, theirs, scale, 2))
    assert np.argwhere(np.isinf(found)).tolist() == [[3, 0], [5, frames - 1], [7, 0], [9, 0], [11, 0]]


@pytest.mark.parametrize("place", range(16))
@pytest.mark.parametrize("bad", NEVER)
def test_a_value_that_is_not_finite_disagrees_at_every_place(place: int, bad: float) -> None:
    right = np.ones((5, 1, 4, 4))
    spoiled = right.copy()
    spoiled[3].flat[place] = bad
    expected = [0.0, 0.0, 0.0, np.inf, 0.0]
    for arrays in ((spoiled, right, right), (right, spoiled, right), (right, right, spoiled)):
        assert worst_disagreements(*arrays, 2)[:, 0].tolist() == expected
    assert worst_disagreements(spoiled, spoiled, right, 2)[:, 0].tolist() == expected


def test_with_the_scale_zero_only_equal_numbers_agree() -> None:
    ours = np.array([[0.0, 1.0], [0.0, 1.0], [-0.0, 1.0]])
    theirs = np.array([[0.0, 1.0], [5e-324, 1.0], [0.0, 1.0]])
    assert worst_disagreements(ours, theirs, np.array([0.0, 1.0]), 1).tolist() == [0.0, np.inf, 0.0]


@pytest.mark.parametrize(("shape", "axes"), [((0, 1, 4, 4), 2), ((3, 0, 6), 2), ((3, 2, 6, 0), 2), ((0,), 0)])
def test_the_disagreement_of_empty_arrays_is_zero(shape: tuple[int, ...], axes: int) -> None:
    nothing = np.zeros(shape)
    found = worst_disagreements(nothing, nothing, nothing, axes)
    assert found.shape == shape[:axes]
    assert not found.any()
