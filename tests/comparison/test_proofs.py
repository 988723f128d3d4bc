"""The proofs of `same` hold for random pairs of arms, and forged certificates are rejected."""

import copy
import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import urdfkin
from tests.comparison.pairs import counted_elsewhere, loaded, written
from tests.reading import present
from tests.urdfs import built, joint, limit, mimic
from urdfkin.comparison.bounds import tighten
from urdfkin.comparison.certificate import Rounding, certificate, recheck
from urdfkin.comparison.result import Sameness, Verdict
from urdfkin.comparison.verdict import Comparator
from urdfkin.dh.compare import TableComparison
from urdfkin.dh.table import DHTable, SnapReport
from urdfkin.model.configuration import ASSUMED_LIMIT
from urdfkin.model.mechanisms.matcher import align
from urdfkin.model.mechanisms.mechanism import variables_of
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot

AXES = ("0 0 1", "0 1 0", "1 0 0", "0.6 0 0.8", "0 -0.6 0.8")


def arm(kinds: list[str], numbers: FloatArray, rules: dict[int, tuple[int, float]]) -> Robot:
    """Return a chain of joints; `rules` has the mimicked joint and the multiplier of each mimic joint."""
    parts = []
    for i, (kind, row) in enumerate(zip(kinds, numbers, strict=True)):
        inside = limit(round(-0.3 - row[6], 3), round(0.4 + row[7], 3)) * (kind in ("revolute", "prismatic"))
        inside += mimic(f"j{rules[i][0]}", rules[i][1], row[8]) if i in rules else ""
        origin = 'xyz="{} {} {}" rpy="{} {} {}"'.format(*row[:6])
        parts.append(joint(f"j{i}", kind, f"l{i}", f"l{i + 1}", origin, AXES[int(row[9]) % 5], inside))
    return built(*parts, verify=False)


def random_pair(seed: int) -> tuple[Robot, Robot]:
    """Return two arms that differ in numbers, limits, kinds and mimic rules."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 6))
    kinds = [str(kind) for kind in rng.choice(["revolute"] * 4 + ["prismatic"] * 2 + ["continuous"], n)]
    numbers = np.round(rng.random((n, 10)), 3)
    numbers[:, 8] *= rng.random() < 0.3
    numbers[:, 9] = rng.integers(0, 5, n)
    rules = {
        i: (int(rng.integers(i)), float(rng.choice([1, -1, 2, 0.5])))
        for i in range(1, n)
        if rng.random() < 0.4
    }
    others, other, free = list(kinds), numbers.copy(), dict(rules)
    for _ in range(int(rng.integers(1, 3))):
        i = int(rng.integers(n))
        match int(rng.integers(5)):
            case 0:
                other[i, :6] += rng.choice([1e-6, 1e-3, 0.1]) * rng.normal(size=6)
            case 1:
                other[i, 6:8] *= 0.5
            case 2:
                free.pop(i, None)
            case 3 if i:
                free[i] = int(rng.integers(i)), float(rng.choice([1.1, -1, 2]))
            case 4:
                others[i] = "continuous" if kinds[i] == "revolute" else kinds[i]
    return arm(kinds, numbers, rules), arm(others, other, free)


def largest_distance(a: Robot, b: Robot, links: list[str]) -> tuple[float, float]:
    """Return the largest distance and angle of links at samples of all independent joints of A and B."""
    rng = np.random.default_rng(0)
    ends: dict[str, tuple[float, float]] = {}
    for robot in (a, b):
        for name, low, high in zip(robot.coordinate_names, *robot.limits, strict=True):
            known = ends.get(name, (-math.inf, math.inf))
            ends[name] = max(low, known[0]), min(high, known[1])
    for name, low, high in zip(a.coordinate_names, *a.limits, strict=True):
        if not ends[name][0] < ends[name][1]:
            ends[name] = low, high
    values = {}
    for name, pair in ends.items():
        low, high = np.clip(pair, -math.pi, math.pi)
        inside = rng.uniform(low, high, 1000)
        values[name] = np.where(rng.random(1000) < 0.3, rng.choice([low, high], 1000), inside)
    Ts = [
        robot.placement(np.stack([values[name] for name in robot.coordinate_names], axis=-1), links)
        for robot in (a, b)
    ]
    turns = np.swapaxes(Ts[0][..., :3, :3], -1, -2) @ Ts[1][..., :3, :3]
    cosines = np.clip((np.trace(turns, axis1=-2, axis2=-1) - 1.0) / 2.0, -1.0, 1.0)
    off = np.linalg.norm(Ts[0][..., :3, 3] - Ts[1][..., :3, 3], axis=-1)
    return float(off.max()), float(np.arccos(cosines).max())


@pytest.mark.slow
@pytest.mark.parametrize(
    "seed", [*range(100), *(pytest.param(k, marks=pytest.mark.long) for k in range(100, 1500))]
)
def test_no_sample_of_two_random_arms_exceeds_a_proven_bound(seed: int) -> None:
    a, b = random_pair(seed)
    found = urdfkin.same(a, b, boxes=2**10)
    off, turned = largest_distance(a, b, [f"l{i}" for i in range(len(a.tree.links))])
    names = set(a.coordinate_names), set(b.coordinate_names)
    # Otherwise, rules connect coordinates with different names.
    if names[0] <= names[1] or names[1] <= names[0]:
        assert off <= found.bound_as_written[0] + 1e-9
        assert turned <= found.bound_as_written[1] + 3e-7
    assert found.verdict is not Verdict.SAME or off < 1e-9
    assert all(frame.lower <= frame.upper + 1e-12 for frame in found.frames)
    assert found.verdict is Verdict.DIFFERS or recheck(certificate(found), a, b) == []


def hinge(more: str) -> str:
    return joint("hinge", "revolute", "base", "door", more=more)


def mount(parent: str, length: float = 1.0) -> str:
    return joint("mount", "fixed", parent, "tool", f'xyz="{length} 0 0"', axis="")


def test_a_joint_without_limits_behind_a_difference_leaves_no_bound() -> None:
    behind = joint("free", "floating", "door", "body", axis=""), mount("body", 0.0)
    a = built(hinge(limit(-0.5, 0.5)), *behind)
    b = built(joint("hinge", "fixed", "base", "door"), *behind)
    found = urdfkin.same(a, b)
    assert [one.upper for one in found.frames if one.frame == "tool"] == [math.inf]
    assert not found.within(1.0)
    far = np.array([0.5, 100.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    off = a.placement(far, "tool") - b.placement(far[1:], "tool")
    assert np.linalg.norm(off[:3, 3]) > 40.0, "the distance indeed exceeds 1 m"


def test_within_is_false_if_a_different_root_link_exceeds_the_distance() -> None:
    a = built(joint("slide", "prismatic", "base", "tip", axis="1 0 0", more=limit(-2, 2)))
    b = built(joint("slide", "prismatic", "tip", "base", axis="-1 0 0", more=limit(-2, 2)))
    found = urdfkin.same(a, b)
    assert found.verdict is Verdict.SAME_AFTER
    assert not found.within(1e-6)
    off = a.placement([1.5], "tip") - b.placement([1.5], "tip")
    assert np.linalg.norm(off[:3, 3]) == 1.5
    assert found.as_written is not None
    assert found.as_written.lower == pytest.approx(2.0)
    assert found.as_written.upper == math.inf
    document = certificate(found)
    assert recheck(document, a, b) == []
    assert document["as_written"] is not None
    document["as_written"]["upper"] = 2.1
    assert any("not proven" in line for line in recheck(document, a, b))


def test_the_bound_of_a_box_includes_the_multipliers_of_both_prismatic_mimic_joints() -> None:
    arm = joint("turn", "revolute", "base", "arm", 'xyz="0 {} 0"', more=limit())
    rest = joint("slide", "prismatic", "arm", "tool", axis="1 0 0", more=limit(-9, 9) + "{}")
    lever = joint("lever", "revolute", "base", "handle", 'xyz="0 0 9"', more=limit())
    a, b = (built(arm.format(y), rest.format(mimic("lever", m)), lever) for y, m in ((0, 1.0), (-5, 2.0)))
    comparator = Comparator((a, b), {}, bounds=True)
    written = comparator.align_as_written(comparator.alignment())
    search = comparator.search(written, variables_of(written, comparator.tolerance), as_written=True)
    (frame,) = (one for one in written.frames if a.tree.links[one.a] == "tool")
    q = a.sample(1000, seed=0)
    off = np.linalg.norm((b.placement(q, "tool") - a.placement(q, "tool"))[:, :3, 3], axis=1).max()
    assert off > 5.7
    assert tighten(search, frame, 5.2, 7.0) >= off


def test_the_limits_of_a_mimic_joint_do_not_restrict_the_joint_that_it_mimics() -> None:
    turn = joint("turn", "continuous", "base", "wheel")
    a, b = (built(turn, hinge(limit(-0.1, 0.1) + mimic("turn", m)), mount("door")) for m in (1.0, 1.1))
    found = urdfkin.same(a, b)
    off = np.linalg.norm((a.placement([3.0], "tool") - b.placement([3.0], "tool"))[:3, 3])
    assert off > 0.29
    assert found.bound_as_written[0] >= off
    assert not found.within(0.02)


def test_the_limits_of_a_mimicked_joint_in_only_one_model_are_used() -> None:
    lever = joint("lever", "revolute", "base", "handle", 'xyz="0 5 0"', "0 1 0", limit(-3, 3))
    a = built(hinge(limit(-0.1, 0.1)), mount("door"))
    b = built(hinge(limit(-0.1, 0.1) + mimic("lever")), mount("door"), lever)
    (tool,) = (frame for frame in urdfkin.same(a, b).frames if frame.frame == "tool")
    off = np.linalg.norm((a.placement([0.1], "tool") - b.placement([-3.0], "tool"))[:3, 3])
    assert off > 1.99
    assert tool.upper >= off


def test_equal_robots_with_different_independent_joints_have_a_remark() -> None:
    wrist = joint("wrist", "revolute", "door", "hand", 'xyz="1 0 0"', "0 1 0", limit(-2, 2) + "{}")
    a = built(hinge(limit()), wrist.format(mimic("hinge", 2)))
    b = built(hinge(limit() + mimic("wrist", 0.5)), wrist.format(""))
    found = urdfkin.same(a, b)
    assert found.verdict is Verdict.SAME
    assert [one.words for one in found.remarks] == [
        "joint wrist is a mimic joint in A and an independent joint in B, with the same motion: 2.0 hinge +0"
    ]
    assert found.exit_code(strict=True) == 1
    assert found.to_b([0.7]).tolist() == [1.4]


def test_the_axes_of_joints_that_never_move_are_not_compared() -> None:
    idle = joint("idle", "revolute", "door", "hand", axis="{}", more=limit() + mimic("hinge", 0))
    a, b = (built(hinge(limit()), idle.format(axis)) for axis in ("0 0 1", "0 1 0"))
    assert urdfkin.same(a, b).verdict is Verdict.SAME


@pytest.fixture(scope="module")
def one_millimetre() -> tuple[Robot, Robot, Sameness]:
    """A floating arm, and the same arm with a link that is 1 mm longer."""
    free = joint("free", "floating", "world", "base", axis="")
    grip = joint("grip", "fixed", "tool", "grip", axis="")
    a, b = (built(free, hinge(limit()), mount("door", length), grip) for length in (1.0, 1.001))
    return a, b, urdfkin.same(a, b)


@pytest.fixture(scope="module")
def reversed_axis() -> tuple[Robot, Robot, Sameness]:
    """An arm, and the same arm with one axis reversed."""
    lift = joint("lift", "revolute", "door", "fore", 'xyz="1 0 0"', "{}", limit())
    a, b = (built(hinge(limit()), lift.format(axis), mount("fore")) for axis in ("0 1 0", "0 -1 0"))
    return a, b, urdfkin.same(a, b)


def forge_lower(document: Any) -> None:
    (tool,) = (one for one in document["frames"] if one["frame"] == "tool")
    tool["q_a"][0], tool["lower"], tool["upper"] = 5.0, 4.9, None


def forge_order(document: Any) -> None:
    (tool,) = (one for one in document["frames"] if one["frame"] == "tool")
    tool["upper"] = 0.5 * tool["lower"]


def forge_frame(document: Any) -> None:
    document["as_written"].update(
        frame="door", frame_b="door", lower=0.0, upper=1e-9, radians=1e-9, radians_seen=0.0, q_a=[], q_b=[]
    )


FORGED: dict[str, tuple[str, Callable[[Any], None], str]] = {
    "another pose of a floating joint": (
        "one_millimetre",
        forge_lower,
        "are not corresponding configurations",
    ),
    "a lower bound above the upper bound": ("one_millimetre", forge_order, "larger than the upper bound"),
    "another engine": ("one_millimetre", lambda d: d["checked"].update(by="NASA 1.0"), "`checked`"),
    "a nearer frame": ("reversed_axis", forge_frame, "has a larger distance"),
    "no distance as written": ("reversed_axis", lambda d: d.update(as_written=None), "is missing"),
}


@pytest.mark.parametrize("forged", FORGED)
def test_a_recheck_rejects_a_certificate_with_forged_contents(
    forged: str, request: pytest.FixtureRequest
) -> None:
    pair, forge, words = FORGED[forged]
    a, b, found = request.getfixturevalue(pair)
    document = written(found)
    assert recheck(document, a, b) == []
    forge(document)
    assert any(words in line for line in recheck(document, a, b))


def test_a_recheck_accepts_other_rounding_errors_of_a_conversion() -> None:
    a = built(joint("far", "planar", "world", "base", 'xyz="6 0 6"', axis=""), verify=False)
    b = loaded(counted_elsewhere(a.tree))
    document = written(urdfkin.same(a, b))
    before = document["joints"][0]["conversion"]["before"]
    for size, accepted in ((1e-14, True), (1e-9, False)):
        before[2][0] += size
        assert (recheck(document, a, b) == []) is accepted


def test_a_recheck_rejects_the_verdict_differs_if_another_alignment_agrees(
    reversed_axis: tuple[Robot, Robot, Sameness], monkeypatch: pytest.MonkeyPatch
) -> None:
    a = reversed_axis[0]
    comparator = Comparator((a, copy.copy(a)), {}, bounds=True)
    choices = align(*comparator.mechanisms, {}).choices
    moved = choices.X.copy()
    moved[2, 3] = 0.5
    raised = align(*comparator.mechanisms, {}, replace(choices, X=moved))
    with monkeypatch.context() as patched:
        patched.setattr(Comparator, "alignment", lambda _: raised)
        found = urdfkin.same(a, copy.copy(a))
    assert found.verdict is Verdict.DIFFERS, "B is held half a metre too high"
    assert any("another alignment" in line for line in recheck(certificate(found), a, copy.copy(a)))


def tilted_slide(axis: str) -> Robot:
    """Return a slide that a continuous joint drives, with a tool behind a rotated frame."""
    drive = joint("drive", "continuous", "base", "drum", "", "0 0 1")
    frame = 'xyz="0.1 0 0" rpy="0.3 0.2 0.1"'
    slide = joint("slide", "prismatic", "drum", "tool", frame, axis, limit(-1, 1) + mimic("drive", 0.01))
    return built(drive, slide, verify=False)


def test_the_bound_on_rounding_states_the_travel_of_a_joint_without_limits() -> None:
    robots = tilted_slide("0.6 0 0.8"), tilted_slide("0.6 0 0.8000000000000002")
    found = urdfkin.same(*robots)
    assert (found.verdict, found.unlimited) == (Verdict.SAME, ("slide",))
    assert f"; this result holds if joints without limits travel at most {ASSUMED_LIMIT:g} m" in str(found)

    def distance(travel: float) -> float:
        ends = [robot.placement([travel / 0.01], "tool")[:3, 3] for robot in robots]
        return float(np.linalg.norm(ends[1] - ends[0]))

    metres, radians = found.rounding
    assert metres >= ASSUMED_LIMIT * radians  # A tilt of the slide moves the tool at the end of the travel.
    assert distance(ASSUMED_LIMIT) <= metres < distance(1e6)


@pytest.mark.parametrize("documented", [Sameness, Rounding, TableComparison, SnapReport, DHTable.unlimited])
def test_each_class_with_a_bound_documents_the_assumed_travel(documented: object) -> None:
    assert re.search(rf"\b{ASSUMED_LIMIT:g}\s+m\b", present(documented.__doc__))


@pytest.mark.parametrize("page", ["same.md", "dh.md", "dh-at-work.md"])
def test_each_page_about_bounds_states_the_assumed_travel(page: str) -> None:
    text = " ".join((Path(__file__).parents[2] / "docs" / page).read_text(encoding="utf-8").split())
    limit = f"{ASSUMED_LIMIT:g} m"
    assert re.search(rf"\b(at most|within|between -{limit} and) {limit}\b", text)


@pytest.mark.parametrize("root_joint", ["planar", "floating"])
def test_planar_and_floating_joints_count_as_joints_without_limits(root_joint: str) -> None:
    robot = urdfkin.load("planar_two_link", root_joint=root_joint, verify=False)
    assert urdfkin.same(robot, robot, bounds=False).unlimited == ("root_joint",)
    assert urdfkin.same("planar_two_link", "planar_two_link", bounds=False).unlimited == ()


@pytest.mark.parametrize("single", ["revolute", "prismatic"])
def test_a_joint_with_a_single_value_and_another_kind_in_b_is_a_difference(single: str) -> None:
    def arm(kind: str) -> Robot:
        lift = joint("lift", "revolute", "base", "arm", "", "0 0 1", limit())
        ends = limit(0.5, 0.5) if kind == single else limit()
        return built(lift, joint("last", kind, "arm", "tool", "", "0 1 0", ends), verify=False)

    found = urdfkin.same(arm("revolute"), arm("prismatic"))
    assert [(one.place, one.what) for one in found.differences] == [("joint last", "kind")]
