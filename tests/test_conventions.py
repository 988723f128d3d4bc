"""The page of conventions agrees with the installed libraries."""

import numpy as np
import pytest

from scripts import make_conventions as maker


def test_the_page_contains_the_libraries_results() -> None:
    assert maker.PAGE.read_text("utf-8") == maker.make_page(), "run python scripts/make_conventions.py"


def test_a_result_that_matches_no_or_two_definitions_is_an_error() -> None:
    readings = {"one": np.ones(3), "two": 2.0 * np.ones(3)}
    assert maker.find_definition(np.ones(3), readings) == "one"
    with pytest.raises(ValueError, match="none"):
        maker.find_definition(np.zeros(3), readings)
    with pytest.raises(ValueError, match="one"):
        maker.find_definition(np.ones(3), readings | {"the same": np.ones(3)})


def test_the_definitions_differ_clearly_for_the_measured_motion() -> None:
    asked = maker.MeasuredMotion()
    for readings in (asked.velocity_readings(), asked.acceleration_readings(flipped=False)):
        values = list(readings.values())
        gaps = [np.abs(x - y).max() for i, x in enumerate(values) for y in values[:i]]
        assert min(gaps) > 0.01
