"""Error statistics count results outside their bound, contain the worst case, and add in any order."""

import math

import numpy as np
import pytest

from tests.reading import present
from urdfkin.kinematics.roundings import EPS
from urdfkin.validation.error_stats import (
    HISTOGRAM_EDGES,
    ErrorStats,
    Inputs,
    compute_error_stats,
    histogram_bin,
    percentile,
)
from urdfkin.verify.bounds import Bound
from urdfkin.verify.comparison import BatchComparison

FRAMES = ("a", "b", "c")


def stats_of(units: np.ndarray, first: int = 0, names: tuple[str, ...] = FRAMES) -> ErrorStats:
    """Return the statistics of results with errors in eps; the bound is 10 eps."""
    ours = np.ones((*units.shape, 6))
    ours[..., 2] += units * EPS
    bound = Bound(np.ones_like(ours), np.full((*units.shape, 1), 10.0))
    inputs: list[Inputs] = [([float(i)], [0.0], [0.0]) for i in range(first, first + len(units))]
    return compute_error_stats(ours, np.ones_like(ours), bound, names, first, inputs)


@pytest.mark.parametrize(
    ("units", "failed"), [(9.0, 0), (10.0, 0), (11.0, 1), (14.0, 1), (30.0, 1), (math.inf, 1), (math.nan, 1)]
)
def test_a_result_outside_its_bound_is_counted_and_disagrees(units: float, failed: int) -> None:
    found = stats_of(np.array([[1.0, units, 2.0]]))
    assert (found.results, found.failed) == (3, failed)
    assert (found.bound_ratio > 1.0) == bool(failed)
    assert BatchComparison(3, 1.0, found.bound_ratio, ()).agrees == (not failed)
    assert present(found.case).frame == "b"


@pytest.mark.parametrize("k", [0.0, -1.0, math.inf, math.nan])
def test_no_result_is_within_an_invalid_bound(k: float) -> None:
    ours = np.ones((1, 3, 6))
    bound = Bound(np.ones_like(ours), np.full((1, 3, 1), k))
    found = compute_error_stats(ours, ours, bound, FRAMES, 0, [([0.0], [0.0], [0.0])])
    assert (found.failed, found.bound_ratio, present(found.case).bound_ratio) == (3, math.inf, math.inf)


@pytest.mark.parametrize("cut", [1, 3, 7])
def test_tallies_of_any_division_into_samples_and_frames_add_up(cut: int) -> None:
    units = np.round(np.random.default_rng(5).uniform(0.0, 12.0, (8, 3)))
    whole = stats_of(units)
    assert stats_of(units[:cut]) + stats_of(units[cut:], cut) == whole
    assert stats_of(units[cut:], cut) + stats_of(units[:cut]) == whole
    for at in (1, 2):
        left, right = stats_of(units[:, :at], 0, FRAMES[:at]), stats_of(units[:, at:], 0, FRAMES[at:])
        assert left.join_frames(right) == whole
    nothing = stats_of(units[:, :0], 0, ())
    assert nothing.join_frames(whole) == whole == whole.join_frames(nothing)


def test_equal_worst_cases_are_ordered_by_sample_and_then_by_frame() -> None:
    same = np.full((4, 3), 3.0)
    for found in (
        stats_of(same[2:], 2) + stats_of(same[:2]),
        stats_of(same[:, :1], 0, ("a",)).join_frames(stats_of(same[:, 1:], 0, ("b", "c"))),
    ):
        case = present(found.case)
        assert (case.sample, case.frame, case.q) == (0, "a", (0.0,))


def test_a_percentile_is_the_upper_edge_of_its_bin_and_never_above_the_worst() -> None:
    edges = [1.0, 2.0, 4.0]
    histogram = [5, 3, 1, 1]
    assert percentile(histogram, edges, 9.0, 50.0) == 0.0
    assert percentile(histogram, edges, 9.0, 80.0) == 2.0
    assert percentile(histogram, edges, 3.0, 90.0) == 3.0
    assert percentile(histogram, edges, 9.0, 100.0) == 4.0
    assert percentile([0, 0, 0, 0], edges, 0.0, 50.0) == 0.0


def test_the_histogram_has_ten_bins_a_decade_and_counts_an_edge_above_it() -> None:
    edge = float(HISTOGRAM_EDGES[30])
    assert histogram_bin(edge, HISTOGRAM_EDGES) == 31
    assert histogram_bin(math.nextafter(edge, 0.0), HISTOGRAM_EDGES) == 30
    assert histogram_bin(math.inf, HISTOGRAM_EDGES) == len(HISTOGRAM_EDGES)
    assert histogram_bin(0.0, HISTOGRAM_EDGES) == 0
    assert len(HISTOGRAM_EDGES) == 81
    np.testing.assert_allclose(HISTOGRAM_EDGES[[0, 10, 30, 80]], [1e-3, 1e-2, 1.0, 1e5])


def test_empty_results_agree_and_tallies_of_different_frames_cannot_be_added() -> None:
    nothing = np.zeros((4, 3, 6, 0))
    bound = Bound(nothing, np.ones((4, 3, 1, 1)))
    found = compute_error_stats(nothing, nothing, bound, FRAMES, 0, [([], [], [])] * 4)
    assert found == ErrorStats(12, 0, 0.0, 0.0, (12, *([0] * 81)), (0.0,) * 3, None, (math.inf, 0.0))
    with pytest.raises(ValueError, match=r"shorter|longer"):
        _ = stats_of(np.ones((1, 3))) + stats_of(np.ones((1, 2)), 0, FRAMES[:2])
