"""Axes that nearly coincide make a comparison hard, not wrong: a URDF's own table agrees with it."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import pytest
from _pytest.mark import ParameterSet

from tests.dh.arms import arm, with_cell
from tests.dh.test_compare import disguised
from tests.random_chains import rotation, shift
from urdfkin.dh import dh_table
from urdfkin.dh.compare import compare
from urdfkin.dh.convert import to_convention
from urdfkin.model.chain import chain
from urdfkin.model.tree import KinematicTree

pytestmark = pytest.mark.slow

#: What was once said to differ, by 1 mm up to the reach, or not to agree exactly.
HARD = [2, 4, 9, 42, 66, 91, 104, 129, 143, 197, 261, 262, 292, 334]


def nearly_coincident(seed: int) -> KinematicTree:
    """Two to seven joints; half of the axes at most 1 mm and 1e-3 rad off the one before, or its opposite."""
    rng = np.random.default_rng(seed)
    n, steps = int(rng.integers(2, 8)), []
    for i in range(n):
        step = rotation("z", rng.uniform(-3, 3))
        if rng.random() < 0.5 and i:
            offset = 10 ** rng.uniform(-9, -3) * (rng.random() < 0.8)
            tilt = 10 ** rng.uniform(-9, -3) * (rng.random() < 0.8)
            step = step @ shift(offset, 0, rng.uniform(-0.3, 0.3)) @ rotation("z", rng.uniform(-3, 3))
            step = step @ rotation("x", tilt + math.pi * (rng.random() < 0.3))
        else:
            step = step @ shift(rng.uniform(-0.5, 0.5), 0, rng.uniform(-0.3, 0.3))
            step = step @ rotation("x", rng.choice([math.pi / 2, -math.pi / 2, rng.uniform(-3, 3)]))
        steps.append(step @ rotation("z", rng.uniform(-3, 3)))
    kinds = "".join("P" if rng.random() < 0.1 else "R" for _ in range(n))
    return arm(*steps, kinds=kinds, tip=shift(0.1, 0, 0.08))


def long(seeds: Iterable[int]) -> list[ParameterSet]:
    """Seeds whose tests are left to the long tests; the others are tried among the quick ones too."""
    return [pytest.param(seed, marks=pytest.mark.long) for seed in seeds]


@pytest.mark.parametrize("seed", [*HARD, *range(400, 405), *long(range(405, 430))])
@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_a_urdfs_own_table_agrees_exactly_however_near_its_axes_are(seed: int, convention: str) -> None:
    tree = nearly_coincident(seed)
    reference = to_convention(disguised(dh_table(tree, "tip"), seed), convention)
    found = compare(chain(tree, "tip"), reference)
    assert found.exact
    assert found.differences == ()


@pytest.mark.parametrize("seed", [0, 3, 8, *long({*range(12)} - {0, 3, 8})])
def test_a_wrong_cell_beside_such_axes_is_still_found(seed: int) -> None:
    square = rotation("x", math.pi / 2)
    near = shift(1e-6, 0, 0.2) @ rotation("z", 0.4 * seed) @ rotation("x", 1e-5)
    steps = [shift(0, 0, 0.3), shift(0.05, 0.02, 0.1) @ square, shift(0.4, 0, 0.1) @ square, near]
    tree = arm(*steps, shift(0.02, -0.2, 0.1) @ square, kinds="RRRRR", tip=shift(0.1, 0, 0.08))
    table = dh_table(tree, "tip")
    wrong = with_cell(table, 1, "a", table.rows[1].a + 1e-3)
    found = compare(chain(tree, "tip"), disguised(wrong, seed))
    assert not found.agrees
    assert 5e-4 < found.metres < 2e-3
