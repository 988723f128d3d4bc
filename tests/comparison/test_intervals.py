"""The interval of the largest distance contains the largest distance, and is narrow."""

import itertools
import math
from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

import urdfkin
from tests.comparison import pairs
from tests.comparison.pairs import changed, robot
from tests.comparison.searching import far, searched
from tests.reading import present
from tests.urdfs import built, joint, limit, mimic
from tests.urdfs import robot as urdf
from urdfkin.comparison.bounds import BoxBounds, DistanceSearch, tighten
from urdfkin.comparison.certificate import certificate, recheck
from urdfkin.comparison.result import Verdict
from urdfkin.comparison.verdict import Comparator
from urdfkin.model.mechanisms.matcher import align
from urdfkin.model.mechanisms.mechanism import (
    AS_WRITTEN,
    AlignmentChoices,
    FramePair,
    Screw,
    screw_motion,
    variables_of,
)
from urdfkin.model.mechanisms.upper_bound import (
    FINE_GRID,
    Grid,
    curvature_bounds,
    point_support,
    relevant_joints,
    upper_bounds,
)
from urdfkin.model.tree import FloatArray
from urdfkin.report.same import configuration_text
from urdfkin.robot import Robot
from urdfkin.urdf.writer import to_urdf

CASES: dict[str, tuple[str, Callable[[Robot], str]]] = {
    "elbow, tilted": ("elbow", lambda r: to_urdf(pairs.tilted(r.tree, 1e-2))),
    "polar, lengthened": ("polar", lambda r: to_urdf(pairs.lengthened(r.tree, 1e-3))),
    "elbow, an axis bent": ("elbow", lambda r: to_urdf(pairs.bent_axis(r.tree, 1e-4))),
    "panda, rounded": ("panda", lambda r: to_urdf(pairs.rounded(r.tree))),
    "panda, a follower": ("panda", lambda r: to_urdf(pairs.with_another_rule(r.tree))),
    "ur5 and ur10": ("ur5", lambda r: to_urdf(pairs.bounded(urdfkin.load("ur10", verify=False).tree))),
}
#: Largest quotient of the bounds of an interval, for models with many differences; otherwise 1.02.
WIDTH = {"panda, rounded": 2.0}


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("case", CASES)
def test_the_interval_contains_the_result_of_a_global_search_at_fifty_digits(case: str) -> None:
    name, change = CASES[case]
    a = robot(name)
    b = urdfkin.load(change(a), verify=False)
    found = urdfkin.same(a, b)
    tools = {line.split()[1] for line in found.after if line.startswith("frame ")}
    worst = max((f for f in found.frames if f.frame not in tools), key=lambda f: f.upper)
    found_elsewhere = searched(a, b, found.to_b, worst)
    assert worst.lower <= far(a, b, np.array(worst.q_a), np.array(worst.q_b), worst), "it is attained"
    assert found_elsewhere <= worst.upper
    assert worst.lower >= 0.9999 * found_elsewhere, "nothing worse is found by another search"
    assert worst.upper <= WIDTH.get(case, 1.02) * worst.lower


@pytest.mark.parametrize("seed", range(4))
def test_a_support_function_is_a_close_upper_bound(seed: int) -> None:
    rng = np.random.default_rng(seed)
    grid, p = Grid(16, 48), rng.standard_normal(3)
    reach, points = point_support(grid, p), p[np.newaxis]
    for _ in range(3):
        axis = rng.standard_normal(3)
        screw = Screw(axis / np.linalg.norm(axis), rng.standard_normal(3))
        low, high = sorted(rng.uniform(-4.0, 4.0, 2))
        reach = reach.rotate(screw, low, high)
        turns = [screw_motion(screw, t, turns=True) for t in np.linspace(low, high, 60)]
        points = np.concatenate([points @ T[:3, :3].T + T[:3, 3] for T in turns])
        points = points[rng.permutation(len(points))[:4000]]
    u = rng.standard_normal((200, 3))
    u /= np.linalg.norm(u, axis=1)[:, np.newaxis]
    size = np.linalg.norm(points, axis=1).max()
    slack = reach.evaluate(u) - (points @ u.T).max(axis=0)
    assert (slack >= -1e-12).all()
    assert np.median(slack) <= 0.03 * size
    assert reach.max_distance() >= size


def test_a_frame_with_an_unlimited_translation_has_no_bound() -> None:
    turn = joint("turn", "continuous", "a", "b", 'rpy="{} 0 0"')
    text = urdf(turn, joint("fly", "floating", "b", "c", axis=""))
    found = urdfkin.same(text.format("0"), text.format("0.1"))
    assert found.differences[0].place == "joint turn"
    worst = present(found.worst)
    assert worst.frame == "c"
    assert math.isinf(worst.upper)


# -- branch and bound ---------------------------------------------------------------------------------


#: Robots, changes and frames: revolute joints, a prismatic joint, mimic joints, a tilted axis.
BOXES = [
    ("panda", "rounded", "panda_hand_tcp"), ("panda", "rounded", "panda_leftfinger"),
    ("ur3_gripper", "tilted by 0.01", "wrist_3_link"), ("elbow", "axis bent", "tool"),
    ("panda", "other rule", "panda_rightfinger"), ("so100", "rounded", "jaw"),
]  # fmt: skip


def search_of(
    a: Robot, b: Robot, link: str, choices: AlignmentChoices | None = None
) -> tuple[DistanceSearch, FramePair]:
    comparator = Comparator((a, b), {}, bounds=True)
    found = align(*comparator.mechanisms, {}, choices)
    frame = next(one for one in found.frames if a.tree.links[one.a] == link)
    return comparator.search(found, variables_of(found, comparator.tolerance)), frame


def bounds_of(search: DistanceSearch, frame: FramePair) -> tuple[Sequence[str], FloatArray]:
    """Return the variables' names, and bounds on the second derivatives by the variables."""
    steps, some = relevant_joints(search.alignment, search.variables, frame)
    return curvature_bounds(steps, [one for one in some if one is not None], search.variables, frame)


def compare_with_difference_quotients(search: DistanceSearch, frame: FramePair) -> bool:
    """Compare bounds on second derivatives with difference quotients; return whether there are bounds."""
    names, M = bounds_of(search, frame)
    if not np.isfinite(M).all():
        return False
    boxes = BoxBounds(search, frame, names)
    c, step = search.random_values(200)[:, boxes.at], 1e-3
    largest = np.zeros_like(M)
    for i in range(len(names)):
        h = step * np.eye(len(names))[i]
        D, G = boxes.evaluate_at_centers(c)
        ahead, behind = boxes.evaluate_at_centers(c + h), boxes.evaluate_at_centers(c - h)
        slope = (ahead[0] - behind[0]) / (2.0 * step)
        size = np.abs(G).max() + np.abs(D).max()
        assert np.abs(slope - G[..., i]).max() <= 1e-5 * size + 1e-12
        largest[i] = np.linalg.norm((ahead[1] - behind[1]) / (2.0 * step), axis=1).max(axis=0)
    assert (largest <= M + 1e-11).all()
    assert M.max() <= 10.0 * largest.max()
    return True


def with_tool(*joints: str) -> Robot:
    """Return a robot with a tool that is fixed to the link `fore`."""
    return built(*joints, joint("mount", "fixed", "fore", "tool", 'xyz="1 0 0"', axis=""))


def two_joints(elbow: str, multiplier: float | None) -> Robot:
    """Return an arm whose second joint has an origin, and mimics the first joint if there is a multiplier."""
    reach = 3.0 * max(1.0, abs(multiplier or 0.0))
    more = limit(-reach, reach) + ("" if multiplier is None else mimic("j1", multiplier))
    first = joint("j1", "revolute", "base", "upper", more=limit(-3, 3))
    return with_tool(first, joint("j2", "revolute", "upper", "fore", elbow, "0 1 0", more))


@pytest.mark.parametrize("multiplier", [None, 5.0, -0.25])
@pytest.mark.parametrize(
    "elbow",
    ['xyz="1.01 0.02 0" rpy="0.01 0 0.02"', 'xyz="1.5 0 0.3"', 'xyz="1 0 -0.9"', 'xyz="1 0 0" rpy="0.5 0 0"'],
)
def test_second_derivatives_are_bounded_for_tilted_and_parallel_axes_and_mimic_joints(
    elbow: str, multiplier: float | None
) -> None:
    a, b = two_joints('xyz="1 0 0"', multiplier), two_joints(elbow, multiplier)
    assert compare_with_difference_quotients(*search_of(a, b, "tool"))


def test_a_prismatic_mimic_joint_is_bounded_together_with_the_mimicked_joint() -> None:
    s = 0.01

    def arm(slide: str) -> Robot:
        first = joint("j1", "revolute", "base", "upper", more=limit())
        second = joint("j2", "prismatic", "upper", "fore", slide, "1 0 0", limit() + mimic("j1"))
        return built(first, second, joint("j3", "revolute", "fore", "tool", "", "0 1 0", limit()))

    search, frame = search_of(arm('xyz="0 0 0"'), arm(f'xyz="{s} 0 0" rpy="0 0 {-s}"'), "tool")
    upper = upper_bounds(search.alignment, search.variables, frame, FINE_GRID)[0]
    attained = s * np.sqrt(2.0)
    assert search.largest_distances([frame])[0][0] == pytest.approx(attained, rel=0.01)
    # A proven bound is not below the attained distance, even if the target is.
    assert tighten(search, frame, 1.01 * s, upper) >= 0.99 * attained


def test_mimic_joints_with_different_multipliers_have_no_bound_on_second_derivatives() -> None:
    _, M = bounds_of(*search_of(two_joints('xyz="1 0 0"', 0.5), two_joints('xyz="1 0 0"', 0.6), "tool"))
    assert np.isinf(M).all()


@pytest.mark.parametrize("variables", [1, 2, 5])
def test_the_bound_of_a_box_by_first_derivatives_is_not_less_than_the_corners(variables: int) -> None:
    rng = np.random.default_rng(variables)
    D, G = rng.normal(size=(50, 3)), rng.normal(size=(50, 3, variables))
    D[0] = 0.0
    h = rng.uniform(0.1, 2.0, variables)
    boxes = cast(BoxBounds, SimpleNamespace(evaluate_at_centers=lambda c: (D, G)))
    bound = BoxBounds.bounds(boxes, np.zeros((50, variables)), h)
    signs = np.array(list(itertools.product((-1.0, 1.0), repeat=variables)))
    corners = np.linalg.norm(D[:, np.newaxis] + np.einsum("nij,sj->nsi", G, signs * h), axis=-1).max(axis=1)
    assert (bound >= corners * (1.0 - 1e-12)).all()
    lengths = np.linalg.norm(D, axis=1)
    along = np.abs((D[:, :, np.newaxis] * G).sum(axis=1)) / np.maximum(lengths, 1e-300)[:, None]
    assert (bound <= lengths + np.linalg.norm(G, axis=1) @ h + 1e-12).all()
    assert (bound >= lengths + along @ h).all()
    if variables == 1:
        np.testing.assert_allclose(bound, corners, rtol=1e-12)


@pytest.mark.parametrize("tool", [(0.0, 0.0, 0.0), (0.1, -0.2, 0.3)])
def test_the_jacobian_of_a_tool_point_agrees_with_finite_differences(tool: tuple[float, ...]) -> None:
    arm, none = robot("panda"), cast(BoxBounds, None)  # the point depends on no box
    q, step = arm.sample(5, seed=1), 1e-6
    p, J = BoxBounds._position_and_jacobian(none, arm, q, "panda_hand", np.array(tool))
    expected = arm.placement(q, "panda_hand") @ [*tool, 1.0]
    np.testing.assert_allclose(p, expected[:, :3], atol=1e-14)
    for i, h in enumerate(step * np.eye(arm.nv)):
        ahead, behind = (
            BoxBounds._position_and_jacobian(none, arm, x, "panda_hand", np.array(tool))[0]
            for x in (q + h, q - h)
        )
        np.testing.assert_allclose((ahead - behind) / (2.0 * step), J[..., i], atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "what", "link"), BOXES)
def test_no_second_derivative_is_larger_than_its_bound(name: str, what: str, link: str) -> None:
    search, frame = search_of(robot(name), present(changed(name, what)), link)
    assert compare_with_difference_quotients(search, frame) or what == "other rule"


@pytest.mark.slow
def test_with_many_differences_the_upper_bound_is_tightened_close_to_the_lower_bound() -> None:
    search, frame = search_of(robot("panda"), present(changed("panda", "rounded")), "panda_hand_tcp")
    lower, _ = search.largest_distances([frame])[0]
    upper, _ = upper_bounds(search.alignment, search.variables, frame, FINE_GRID)
    assert upper > 1.6 * lower
    assert tighten(search, frame, 1.05 * lower, upper) == 1.05 * lower
    assert tighten(search, frame, 0.99 * lower, upper, max_boxes=2**14) > lower, "what is wrong is not proven"
    assert tighten(search, frame, 1.05 * lower, upper, max_boxes=0) == upper


def two_turns(place: str, inside: str) -> Robot:
    """Return an arm with two joints about z; the second joint contains the text `inside`."""
    first = joint("j1", "revolute", "base", "upper", f'xyz="{place} 0 0"', more=limit())
    return with_tool(first, joint("j2", "revolute", "upper", "fore", more=limit() + inside))


def test_a_joint_that_mimics_in_only_one_model_is_bounded_as_a_separate_variable() -> None:
    a, b = two_turns("0", mimic("j1")), two_turns("-5", "")
    search, frame = search_of(a, b, "tool", AS_WRITTEN)
    q = a.sample(500, seed=0)
    apart = b.placement(np.hstack([q, np.ones_like(q)]), "tool") - a.placement(q, "tool")
    attained = float(np.linalg.norm(apart[:, :3, 3], axis=1).max())
    assert attained > 5.5
    assert tighten(search, frame, 5.3, 7.0) >= attained


def test_the_worst_configuration_names_a_joint_that_is_independent_only_in_b() -> None:
    a, b = two_turns("0", mimic("j1")), two_turns("0", "")
    found, turned = urdfkin.same(a, b), urdfkin.same(b, a)
    worst = present(found.worst)
    q = {"j1": worst.q_a[0], "j2": worst.q_b[1]}
    apart = b.placement(q, "tool")[:3, 3] - a.placement({"j1": q["j1"]}, "tool")[:3, 3]
    assert np.linalg.norm(apart) == pytest.approx(worst.lower)
    assert configuration_text(found, worst) == f"j1 {q['j1']:.6g} rad, j2 of B {q['j2']:.6g} rad"
    assert "of B" not in configuration_text(turned, present(turned.worst))


@pytest.mark.slow
def test_a_bound_proven_by_boxes_is_confirmed_by_a_recheck() -> None:
    a, b = robot("so100"), present(changed("so100", "rounded"))
    found = urdfkin.same(a, b)
    plain, worst = present(urdfkin.same(a, b, boxes=0).worst), present(found.worst)
    assert worst.lower == plain.lower
    assert worst.upper <= plain.upper
    assert recheck(certificate(found), a, b) == []


def test_the_distance_between_robots_without_moving_joints_is_reported() -> None:
    text = urdf(joint("j", "fixed", "base", "mount", 'xyz="0.3 {} 0"', axis=""))
    found = urdfkin.same(text.format(0), text.format(0.004))
    assert found.verdict is Verdict.SAME_AFTER  # another tool is no difference
    worst = present(found.worst_as_written)
    assert worst.lower == pytest.approx(0.004, rel=1e-9)
    assert 0.004 <= worst.upper <= 0.00402
