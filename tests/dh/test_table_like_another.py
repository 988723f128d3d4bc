"""A table with the frames of a published table has the numbers and exactly the motion of the URDF."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from tests.cli.running import good, refused
from tests.cli.test_dh import run
from tests.dh.arms import CONVENTIONS, arm, disguised, elbow, with_cells
from tests.random_chains import TURNS, configurations, rotation, shift, trees
from urdfkin.dh import DHConvention, DHTable, export, make_dh_table, parse_units, read_table, table_from_rows
from urdfkin.dh.compare import compare
from urdfkin.dh.convert import to_convention
from urdfkin.dh.parse_table import published_tables, read_mapping, reference_path, suggest_published_tables
from urdfkin.errors import InputError
from urdfkin.model.chain import make_chain
from urdfkin.model.tree import FloatArray, KinematicTree
from urdfkin.robot.loading import load


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("kinds", ["RRRRRR", "RRPRRR"])
def test_a_table_like_an_equivalent_table_has_the_cells_of_that_table(seed: int, kinds: str) -> None:
    tree = elbow(kinds)
    reference = disguised(make_dh_table(tree, "tip"), seed)
    table = make_dh_table(tree, "tip", like=reference)
    for i, (row, other) in enumerate(zip(table.rows, reference.rows, strict=True)):
        free = {"theta"} if row.kind.turns else {"d"}  # this table has the URDF's zeros
        free |= {0: {"d"}, 5: {"a", "alpha", "d"}}.get(i, set())
        for name in {"a", "alpha", "d"} - free:
            off = getattr(row, name) - getattr(other, name)
            off = math.remainder(off, 2 * math.pi) if name == "alpha" else off
            assert abs(off) < 1e-12, (i, name)
    assert table.rows[0].theta == reference.rows[0].theta
    q = configurations(6)
    np.testing.assert_allclose(table.placement(q), make_chain(tree, "tip").placement(q), atol=1e-13)


@pytest.mark.slow
@given(trees(min_joints=1, max_joints=6, mimics=False, tame=True), st.integers(0, 99))
@settings(max_examples=25)
def test_a_table_like_another_agrees_with_the_urdf_within_rounding(tree: KinematicTree, seed: int) -> None:
    for convention in CONVENTIONS:
        reference = to_convention(disguised(make_dh_table(tree, "tip"), seed), convention)
        table = make_dh_table(tree, "tip", convention=convention, like=reference)
        q = np.linspace(-1, 1, len(table.rows))
        apart = np.abs(table.placement(q) - make_chain(tree, "tip").placement(q)).max()
        assert apart <= 20 * float(table.rounding(q)) + 1e-13


def test_the_base_contains_the_offset_if_the_first_two_axes_are_parallel_and_d_is_zero() -> None:
    rows = [[0.5, 0, 0, 0], [0.3, "pi/2", 0, 0], [0.2, 0, 0, 0]]
    reference = table_from_rows(rows, "standard", base=shift(0.0, 0.0, 0.4))
    tree = load(reference).tree
    for like in (reference, replace(reference, base=np.eye(4))):
        table = make_dh_table(tree, "tip", like=like)
        assert [row.cells for row in table.rows] == [row.cells for row in reference.rows]
        np.testing.assert_array_equal(table.base, reference.base)


@pytest.mark.parametrize("twist", [1.0, 0.25, 0.05])
def test_the_zero_of_a_prismatic_joint_may_be_in_d_of_a_coaxial_revolute_joint(twist: float) -> None:
    rows = [[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0, "P"], [0.0, twist, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0]]
    tree = load(table_from_rows(rows, "standard")).tree
    tip = tree.links[-1]
    reference = disguised(make_dh_table(tree, tip), 0)
    table = make_dh_table(tree, tip, like=reference)
    for row, other in zip(table.rows[:3], reference.rows, strict=False):
        assert (row.a, row.alpha, row.beta) == pytest.approx((other.a, other.alpha, other.beta))
    assert table.rows[2].d == reference.rows[2].d
    q = configurations(4)
    np.testing.assert_allclose(table.placement(q), make_chain(tree, tip).placement(q), atol=1e-14)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(set(published_tables()) - {"kinova"}))
def test_a_table_like_a_vendors_table_has_every_cell_of_that_table(name: str) -> None:
    data, reference = read_mapping(reference_path(name)), read_table(reference_path(name))
    ends = (reference.tip_frame, reference.base_frame, str(reference.convention))
    table = load(reference.robot).dh(*ends, like=reference, snap=data.get("snap", 0.0))
    for row, other in zip(table.rows, reference.rows, strict=True):
        assert (row.cells, row.sense) == (other.cells, 1)
    np.testing.assert_array_equal(table.base, np.eye(4))
    np.testing.assert_allclose(table.tool, reference.tool, atol=1e-15)


def test_a_table_like_kinovas_has_kinovas_zeros_and_the_lengths_of_the_urdf() -> None:
    reference = read_table(reference_path("kinova"))
    table = load("kinova").dh(reference.tip_frame, reference.base_frame, like=reference, snap=1e-9)
    text = export(table, "terminal", parse_units("degrees", "millimetres"))
    assert "-q1 + 180" in text
    assert "q2 - 90" in text
    for row, other in zip(table.rows, reference.rows, strict=True):
        assert (row.alpha, row.a) == pytest.approx((other.alpha, other.a), abs=1e-12)
        assert row.d == pytest.approx(other.d, abs=6e-5)  # the sheet rounds D3 + D4 and D5 + D6 to 0.1 mm
    assert table.rows[3].d == pytest.approx(-0.31105, abs=1e-9)


def test_a_reference_table_of_a_different_robot_is_refused() -> None:
    other = table_from_rows([[0.1, 1.0, 0.2, 0.0]] * 6, "standard")
    with pytest.raises(InputError, match=r"a different robot.*use --compare to see the differences"):
        make_dh_table(elbow(), "tip", like=other)
    with pytest.raises(InputError, match="the table and the path have different joints"):
        make_dh_table(elbow(), "tip", like=replace(other, rows=other.rows[:3]))


@pytest.mark.parametrize(
    "options",
    [
        {"last": "flange"},
        {"parallel_offset": "first"},
        {"parallel_offset": "each"},
        {"first": "joint"},
        {"sign": "a"},
        {"flip": ["j2"]},
    ],
)
def test_an_option_that_the_published_table_determines_is_refused(options: dict[str, Any]) -> None:
    tree = elbow()
    reference = make_dh_table(tree, "tip")
    (name,) = options
    with pytest.raises(InputError, match=f"`{name}` and `like` exclude each other"):
        make_dh_table(tree, "tip", like=reference, **options)


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_the_option_sign_makes_a_or_alpha_nonnegative(convention: str) -> None:
    inner = slice(0, 5) if convention == "standard" else slice(1, 6)
    by_a = make_dh_table(elbow(), "tip", convention=convention, sign="a").rows[inner]
    by_alpha = make_dh_table(elbow(), "tip", convention=convention, sign="alpha").rows[inner]
    assert all(row.a >= 0 for row in by_a)
    assert all(row.alpha >= 0 for row in by_alpha)
    assert any(row.alpha < 0 for row in by_a)
    assert any(row.a < 0 for row in by_alpha)


@pytest.mark.parametrize("sign", ["theta", "a", "alpha"])
@pytest.mark.parametrize("kinds", ["RRRRRR", "PRRRRR", "RRPRRR", "RRRRRP"])
def test_tables_with_craigs_first_row_and_minimal_prismatic_rows_are_exact(kinds: str, sign: str) -> None:
    tree = elbow(kinds)
    table = make_dh_table(tree, "tip", convention="modified", first="joint", sign=sign, slide="minimal")
    assert (table.rows[0].d, table.rows[0].theta) == (0.0, 0.0)
    q = configurations(6)
    np.testing.assert_allclose(table.placement(q), make_chain(tree, "tip").placement(q), atol=1e-13)


def test_a_minimal_prismatic_row_has_a_equal_to_zero() -> None:
    tree = arm(
        shift(0, 0, 0.3), shift(0.2, 0.1, 0) @ rotation("x", 1.2), shift(0.3, 0.2, 0.1) @ rotation("y", 0.7),
        kinds="RPR", tip=shift(0.1, 0, 0.2),
    )  # fmt: skip
    drawn, minimal = (make_dh_table(tree, "tip", slide=slide) for slide in ("drawn", "minimal"))
    assert drawn.rows[1].a > 0.1
    assert minimal.rows[1].a == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("slide", ["drawn", "minimal"])
@pytest.mark.parametrize("kinds", ["PRRR", "RRPRRR", "RRRRPR"])
def test_a_table_like_another_may_have_other_positions_of_prismatic_axes(kinds: str, slide: str) -> None:
    # In the first arm, the second and third axes are parallel, and no two others.
    square = rotation("x", math.pi / 2)
    steps = [shift(0.1, 0.2, 0.3) @ square, shift(0.3, 0.2, 0.1), shift(0.4, 0.3, 0.1) @ square]
    tree = elbow(kinds) if kinds != "PRRR" else arm(shift(0.1, 0, 0), *steps, kinds=kinds)
    reference = make_dh_table(tree, "tip", slide={"drawn": "minimal", "minimal": "drawn"}[slide])
    table = make_dh_table(tree, "tip", like=reference, slide=slide)
    q = configurations(len(kinds))
    np.testing.assert_allclose(table.placement(q), make_chain(tree, "tip").placement(q), atol=1e-13)


def test_columns_are_printed_in_the_requested_order() -> None:
    result = good("dh ur5 --like ur5 --columns alpha,a,d,theta --snap 1e-6 --degrees")
    lines = [line.split() for line in result.text.splitlines()]
    assert ["i", "joint", "alpha", "[deg]", "a", "[m]", "d", "[m]", "theta", "[deg]"] in lines
    assert ["1", "shoulder_pan_joint", "90", "0", "0.089159", "q1"] in lines
    for form in ("markdown", "latex"):
        text = run("ur5", "--like", "ur5", "--columns", "theta, d, a, alpha", "--format", form).text
        head = next(line for line in text.splitlines() if "joint" in line and "alpha" in line)
        assert head.index("theta") < head.index("alpha")
    assert run("ur5", "--columns", "a,b,c,d").code == 2


@pytest.mark.slow
def test_a_hint_names_the_published_table_of_a_robot() -> None:
    assert suggest_published_tables("xarm7") == [
        "published modified table of this robot: --like xarm7_modified --snap 1e-04",
        "published standard table of this robot: --like xarm7_standard --snap 1e-04",
    ]
    assert suggest_published_tables("nobody") == []
    assert "hint: published standard table of this robot: --like ur5" in run("ur5").text
    assert "published" not in run("ur5", "--like", "ur5").text
    for name in published_tables():
        assert DHConvention(read_mapping(reference_path(name))["convention"])


def test_the_option_sign_is_refused_with_the_option_like() -> None:
    assert "--sign does nothing with --like" in refused("dh ur5 --like ur5 --sign a")


# -- zeros of prismatic joints -------------------------------------------------------------------------

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
    """Return the pose from one axis to the next, with a tilt."""
    relation = draw(st.sampled_from(sorted(tilts)))
    nearly = relation.startswith("nearly")
    a, b = draw(st.floats(0.05, 0.5)) if nearly else draw(length), draw(length) if nearly else 0.0
    lean = rotation("x", draw(tilts[relation]))
    before, after = (rotation("z", draw(turn)) @ shift(0.0, 0.0, draw(length)) for _ in range(2))
    return before @ shift(a, b, 0.0) @ lean @ after


@st.composite
def arms_with_slides(draw: st.DrawFn, *, inner: bool = False) -> KinematicTree:
    """Return two to six joints, at least one prismatic; with `inner`, the first and last are revolute."""
    kinds = draw(st.lists(st.sampled_from("RRP"), min_size=1 if inner else 2, max_size=4 if inner else 6))
    kinds = ["R", *kinds, "R"] if inner else kinds
    assume("P" in kinds)
    steps = [draw(step()) for _ in range(len(kinds) + 1)]
    return arm(*steps[:-1], kinds="".join(kinds), tip=steps[-1])


def differences(table: DHTable, other: DHTable) -> dict[tuple[int, str], float]:
    """Return the differences, by row and name, that no zero, base or tool explains."""
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
    apart = np.abs(table.placement(q) - make_chain(tree, "tip").placement(q)).max()
    return bool(apart <= 20.0 * np.max(table.rounding(q)) + 1e-13)


@st.composite
def arms_with_a_slide(draw: st.DrawFn) -> KinematicTree:
    """Return one prismatic joint between revolute joints, without a tool."""
    before, after = (draw(st.integers(1, 3)) for _ in range(2))
    kinds = "R" * before + "P" + "R" * after
    return arm(*(draw(step()) for _ in kinds), kinds=kinds)


@pytest.mark.slow
@given(arms_with_a_slide(), st.integers(0, 99))
@settings(max_examples=100)
def test_a_shifted_zero_of_one_prismatic_joint_is_no_difference_within_rounding(
    tree: KinematicTree, seed: int
) -> None:
    reference = disguised(make_dh_table(tree, "tip"), seed)
    table = make_dh_table(tree, "tip", like=reference)
    assert is_the_urdf(table, tree)
    assert max(differences(table, reference).values()) <= EXACT


@pytest.mark.slow
@given(arms_with_slides(), st.integers(0, 99), *map(st.sampled_from, (CONVENTIONS, CONVENTIONS)))
@settings(max_examples=100)
def test_shifted_zeros_of_prismatic_joints_are_no_difference_in_any_convention(
    tree: Any, seed: int, there: str, here: str
) -> None:
    reference = disguised(make_dh_table(tree, "tip"), seed)
    table = make_dh_table(tree, "tip", convention=here, like=to_convention(reference, there))
    assert table.convention == here
    assert is_the_urdf(table, tree)
    assert max(differences(to_convention(table, "standard"), reference).values()) <= SAME


def along_slides(reference: DHTable) -> list[int]:
    """Return the rows whose d is exactly parallel to the axis of a neighbouring prismatic joint."""
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


@pytest.mark.slow
@given(arms_with_slides(inner=True), st.integers(0, 99), st.floats(-0.5, 0.5))
@settings(max_examples=50)
def test_a_length_along_a_prismatic_joint_may_be_in_d_of_either_row(
    tree: KinematicTree, seed: int, moved: float
) -> None:
    reference = disguised(make_dh_table(tree, "tip"), seed)
    assume(beside := along_slides(reference))
    i = beside[seed % len(beside)]
    reference = with_cells(reference, i, d=reference.rows[i].d + moved)
    table = make_dh_table(tree, "tip", like=reference)
    assert is_the_urdf(table, tree)
    assert max(differences(table, reference).values()) <= SAME


@pytest.mark.slow
@given(arms_with_slides(inner=True), st.integers(0, 99), st.data())
@settings(max_examples=60)
def test_a_changed_cell_without_a_difference_leaves_the_robot_the_same(
    tree: Any, seed: int, data: Any
) -> None:
    reference = disguised(make_dh_table(tree, "tip"), seed)
    cells = sorted(differences(reference, reference))
    i, cell = data.draw(st.sampled_from([one for one in cells if one[1] != "beta"]))
    changed = with_cells(reference, i, **{cell: getattr(reference.rows[i], cell) + CHANGE})
    if max(differences(make_dh_table(tree, "tip", like=changed), changed).values()) < 0.5 * CHANGE:
        judged = compare(make_chain(tree, "tip"), changed)
        assert judged.metres + judged.radians <= SAME
