"""`acceleration --breakdown` and `jacobian-rate` through the command itself."""

import csv
import io

import numpy as np
import pytest

import urdfkin
from tests.cli.running import urdfkin as run

pytestmark = pytest.mark.slow

POLAR = ["polar", "--q", "0.3,0.7", "--v", "1,2", "--a", "0.5,-1"]


def test_the_parts_of_the_polar_robots_acceleration_are_shown_with_their_sum() -> None:
    result = run("acceleration", *POLAR, "--breakdown")
    assert result.code == 0, result.err
    rows = [line.split() for line in result.text.splitlines() if line.strip().startswith(("joint_", "sum"))]
    assert [row[:2] for row in rows[:-1]] == [
        ["joint_1", "transverse"],
        ["joint_1", "centripetal"],
        ["joint_2", "coriolis"],
        ["joint_2", "sliding"],
    ]
    sums = np.array([[float(x) for x in row[2:]] for row in rows[:-1]]).sum(axis=0)
    assert np.abs(sums - [float(x) for x in rows[-1][1:]]).max() < 2e-3
    assert "verified by Pinocchio" in result.text


def test_as_json_the_parts_sum_to_the_acceleration_exactly() -> None:
    result = run("acceleration", *POLAR, "--breakdown", "--format", "json")
    document = result.data
    terms = np.array(document["terms"])
    assert terms.shape == (1, 2, 4, 6)
    assert document["kinds"] == ["transverse", "centripetal", "coriolis", "sliding"]
    total = np.array(document["base"]) + terms.sum(axis=2).sum(axis=1)
    assert np.array_equal(total, document["total"])
    expected = urdfkin.load("polar").acceleration([0.3, 0.7], [1.0, 2.0], [0.5, -1.0], "slider")
    assert np.abs(total[0] - expected).max() <= 1e-14
    assert document["verified"] is True


def test_as_csv_there_is_a_line_for_each_part_and_one_for_the_sum() -> None:
    result = run("acceleration", *POLAR, "--breakdown", "--format", "csv")
    rows = list(csv.DictReader(io.StringIO(result.text)))
    assert [row["kind"] for row in rows] == ["transverse", "centripetal", "coriolis", "sliding", ""]
    assert float(rows[-1]["vx"]) == pytest.approx(sum(float(row["vx"]) for row in rows[:-1]), abs=1e-14)


def test_the_rate_of_the_jacobian_has_a_command() -> None:
    result = run("jacobian-rate", *POLAR[:5], "--format", "json")
    assert result.code == 0, result.err
    document = result.data
    expected = urdfkin.load("polar").jacobian_rate([0.3, 0.7], [1.0, 2.0], "slider")
    assert np.array_equal(document["result"][0], expected)
    assert document["v"] == [[1.0, 2.0]]
