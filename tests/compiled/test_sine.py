"""Sine and cosine of the walk, against fifty digits."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

import urdfkin
from urdfkin.model.tree import FloatArray

ONE_JOINT = """<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="continuous">
  <parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint></robot>"""


def sine_and_cosine(angles: FloatArray) -> FloatArray:
    """(n, 2), as the walk puts them into a rotation."""
    places = urdfkin.load(ONE_JOINT).placement(angles[:, None], "b", verify=False)
    return np.stack([places[:, 1, 0], places[:, 0, 0]], axis=1)


def units_off(angles: FloatArray) -> FloatArray:
    """By how many units in the last place."""
    with mpmath.workdps(60):
        true = [[f(mpmath.mpf(float(x))) for f in (mpmath.sin, mpmath.cos)] for x in angles]
        ours = sine_and_cosine(angles)
        return np.array(
            [
                [
                    float((mpmath.mpf(float(x)) - y) / np.spacing(abs(float(y))))
                    for x, y in zip(*pair, strict=True)
                ]
                for pair in zip(ours, true, strict=True)
            ]
        )


@pytest.mark.slow
@pytest.mark.parametrize("largest", [1e-3, 0.8, 4.0, 100.0, 1.6e6, 1e9])
def test_sine_and_cosine_are_right_to_two_thirds_of_a_unit_in_the_last_place(largest: float) -> None:
    angles = np.random.default_rng(0).uniform(-largest, largest, 3000)
    assert np.abs(units_off(angles)).max() < 2.0 / 3.0


@pytest.mark.slow
def test_their_typical_error_is_that_of_rounding() -> None:
    off = units_off(np.random.default_rng(1).uniform(-np.pi, np.pi, 5000))
    assert np.sqrt(np.square(off).mean(axis=0)).max() < 1.02 / np.sqrt(12.0)


def test_beside_a_multiple_of_a_right_angle_the_smaller_one_is_right_to_1e_27() -> None:
    turns = np.arange(-200, 201) * (np.pi / 2.0)
    angles = np.concatenate([np.nextafter(turns, -np.inf), turns, np.nextafter(turns, np.inf)])
    off = np.abs(units_off(angles))
    assert (off * np.spacing(np.abs(sine_and_cosine(angles))))[off > 2.0 / 3.0].max() < 1e-27
