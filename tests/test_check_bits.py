"""The program that compares results to the last bit finds any changed bit."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from scripts import check_bits
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot

ROBOTS = ("polar", "planar_two_link")


def last_bit_changed(x: FloatArray) -> FloatArray:
    return x * (1.0 + 2.0**-52)


@pytest.mark.slow
def test_results_are_equal_in_single_calls_in_batches_and_to_stored_results(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "kept.npz"
    assert check_bits.main([*ROBOTS, "--write", str(file)]) == 0
    first = capsys.readouterr().out.splitlines()
    assert check_bits.main(["--against", str(file)]) == 0
    again = capsys.readouterr().out.splitlines()
    assert [line.split()[:2] for line in again[:2]] == [line.split()[:2] for line in first[:2]]
    assert [line.split()[2:] for line in again[:2]] == [["equal"], ["equal"]]


def test_a_row_of_a_batch_that_differs_in_its_last_bit_is_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    right: Any = Robot.velocity

    def wrong(*asked: Any, **how: Any) -> Any:
        result = right(*asked, **how)
        if len(result) == 7:
            result[3] = last_bit_changed(result[3])
        return result

    monkeypatch.setattr(Robot, "velocity", wrong)
    assert check_bits.main(["polar"]) == 1
    assert "polar/velocity/LOCAL: row 3 of 7 from 0 on" in capsys.readouterr().out


@pytest.mark.slow
def test_a_change_is_reported_and_limited_as_a_fraction_of_the_bound(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "kept.npz"
    assert check_bits.main(["polar", "--write", str(file)]) == 0
    right: Any = Robot.jacobian_rate
    monkeypatch.setattr(Robot, "jacobian_rate", lambda *asked, **how: last_bit_changed(right(*asked, **how)))
    capsys.readouterr()
    assert check_bits.main(["--against", str(file)]) == 1
    said = capsys.readouterr().out
    assert "3 of 16 results differ, by at most 0." in said
    assert check_bits.main(["--against", str(file), "--within", "1"]) == 0


def test_zeros_of_different_signs_have_different_bits_and_the_difference_zero() -> None:
    kept = {"r/x/LOCAL": np.zeros(1), "r/x/LOCAL/bound": np.zeros(1)}
    assert check_bits.difference_ratio("r/x/LOCAL", {"r/x/LOCAL": np.zeros(1)}, kept) == 0.0
    assert 0.0 < check_bits.difference_ratio("r/x/LOCAL", {"r/x/LOCAL": -np.zeros(1)}, kept) < 1e-300
    assert check_bits.difference_ratio("r/x/LOCAL", {"r/x/LOCAL": np.full(1, 1e-300)}, kept) == np.inf
