"""Other zeros of slides are no difference to a table like another, and what they cannot explain is one."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from tests.dh.arms import arm, with_cell
from tests.dh.test_compare import disguised
from tests.random_chains import TURNS, configurations, rotation, shift
from urdfkin.dh import DHTable, dh_table
from urdfkin.dh.compare import compare
from urdfkin.dh.convert import to_convention
from urdfkin.model.chain import chain
from urdfkin.model.tree import FloatArray, KinematicTree

pytestmark = pytest.mark.slow

#: Of a change of a cell (m or rad) a fifth is a difference: with two slides, one on either side of a tilt
#: of 1e-8 rad, rounding hides more of where a plane cuts than with one.
CHANGE, SAME, EXACT = 1e-6, 2e-7, 1e-11

turn = st.one_of(st.sampled_from(list(TURNS)), st.floats(-3.0, 3.0))
length = st.one_of(st.just(0.0), st.floats(0.05, 0.5), st.floats(-0.5, -0.05))
slight = st.floats(3.0, 12.0).map(lambda digits: 10.0**-digits)
tilts = {
    "parallel": st.just(0.0), "antiparallel": st.just(math.pi), "nearly parallel": slight,
    "nearly antiparallel": slight.map(lambda tilt: math.pi - tilt), "far feet": st.floats(0.012, 0.34),
    "skew": st.floats(0.4, 2.7), "square": st.just(math.pi / 2.0),
}  # fmt: skip


@st.composite
def step(draw: st.DrawFn) -> FloatArray:
    """The pose from one axis to the next, tilted about a line beside the one between them or along it."""
    relation = draw(st.sampled_from(sorted(tilts)))
    nearly = relation.startswith("nearly")
    a, b = draw(st.floats(0.05, 0.5)) if nearly else draw(length), draw(length) if nearly else 0.0
    lean = rotation("x", draw(tilts[relation]))
    before, after = (rotation("z", draw(turn)) @ shift(0.0, 0.0, draw(length)) for _ in range(2))
    return before @ shift(a, b, 0.0) @ lean @ after


@st.composite
def arms_with_slides(draw: st.DrawFn, *, inner: bool = False) -> KinematicTree:
    """Two to six joints, one of them a slide at least; with `inner` no slide at either end."""
    kinds = draw(st.lists(st.sampled_from("RRP"), min_size=1 if inner else 2, max_size=4 if inner else 6))
    kinds = ["R", *kinds, "R"] if inner else kinds
    assume("P" in kinds)
    steps = [draw(step()) for _ in range(len(kinds) + 1)]
    return arm(*steps[:-1], kinds="".join(kinds), tip=steps[-1])


def differences(table: DHTable, other: DHTable) -> dict[tuple[int, str], float]:
    """Of all cells that no zero, no base and no tool explains, by row and name."""
    found, last = {}, len(table.rows) - 1
    for i, (row, there) in enumerate(zip(table.rows, other.rows, strict=True)):
        names = ["a", "alpha", "beta"] if i < last else []
        names += ["d" if row.kind.turns else "theta"] if 0 < i < last else []
        for name in names:
            off = getattr(row, name) - getattr(there, name)
            found[i, name] = abs(off if name in ("a", "d") else math.remainder(off, 2.0 * math.pi))
    return found


def is_the_urdf(table: DHTable, tree: KinematicTree) -> bool:
    q = configurations(len(table.rows))
    apart = np.abs(table.placement(q) - chain(tree, "tip").placement(q)).max()
    return bool(apart <= 20.0 * np.max(table.rounding(q)) + 1e-13)


@st.composite
def arms_with_a_slide(draw: st.DrawFn) -> KinematicTree:
    """One slide between joints that turn, and no tool."""
    before, after = (draw(st.integers(1, 3)) for _ in range(2))
    kinds = "R" * before + "P" + "R" * after
    return arm(*(draw(step()) for _ in kinds), kinds=kinds)


@given(arms_with_a_slide(), st.integers(0, 99))
@settings(max_examples=100)
def test_another_zero_of_one_slide_is_no_difference_to_rounding(tree: KinematicTree, seed: int) -> None:
    reference = disguised(dh_table(tree, "tip"), seed)
    table = dh_table(tree, "tip", like=reference)
    assert is_the_urdf(table, tree)
    assert max(differences(table, reference).values()) <= EXACT


conventions = st.sampled_from(["standard", "modified"])


@given(arms_with_slides(), st.integers(0, 99), conventions, conventions)
@settings(max_examples=100)
def test_other_zeros_are_no_difference_in_any_convention(tree: Any, seed: int, there: str, here: str) -> None:
    reference = disguised(dh_table(tree, "tip"), seed)
    table = dh_table(tree, "tip", convention=here, like=to_convention(reference, there))
    assert table.convention == here
    assert is_the_urdf(table, tree)
    assert max(differences(to_convention(table, "standard"), reference).values()) <= SAME


def along_slides(reference: DHTable) -> list[int]:
    """The rows whose d lies along a slide's axis that comes before them or after them, exactly parallel."""
    rows, found = reference.rows, list[int]()
    for k, slide in enumerate(rows):
        if slide.kind.turns:
            continue
        for to, twists in ((range(k + 1, len(rows)), 1), (range(k - 1, -1, -1), 0)):
            for i in to:
                if rows[i - twists].beta or abs(math.sin(rows[i - twists].alpha)) > 1e-14:
                    break
                found.append(i)
    return [i for i in found if rows[i].kind.turns]


@given(arms_with_slides(inner=True), st.integers(0, 99), st.floats(-0.5, 0.5))
@settings(max_examples=50)
def test_a_length_along_a_slide_may_stand_in_either_d(tree: KinematicTree, seed: int, moved: float) -> None:
    reference = disguised(dh_table(tree, "tip"), seed)
    assume(beside := along_slides(reference))
    i = beside[seed % len(beside)]
    reference = with_cell(reference, i, "d", reference.rows[i].d + moved)
    table = dh_table(tree, "tip", like=reference)
    assert is_the_urdf(table, tree)
    assert max(differences(table, reference).values()) <= SAME


@given(arms_with_slides(inner=True), st.integers(0, 99), st.data())
@settings(max_examples=60)
def test_where_there_is_no_difference_the_robot_is_the_same(tree: Any, seed: int, data: Any) -> None:
    reference = disguised(dh_table(tree, "tip"), seed)
    cells = sorted(differences(reference, reference))
    i, cell = data.draw(st.sampled_from([one for one in cells if one[1] != "beta"]))
    changed = with_cell(reference, i, cell, getattr(reference.rows[i], cell) + CHANGE)
    if max(differences(dh_table(tree, "tip", like=changed), changed).values()) < 0.5 * CHANGE:
        judged = compare(chain(tree, "tip"), changed)
        assert judged.metres + judged.radians <= SAME
