"""`same`: verdicts, changes of B, remarks and certificates."""

import copy
import json
import math
import time
from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import urdfkin
from tests.cli.running import refused
from tests.cli.running import urdfkin as run
from tests.comparison import pairs
from tests.comparison.pairs import certified, changed, files_of, moves_alike, robot, written
from tests.dh.arms import disguised
from tests.dh.test_compare import nearly_coincident
from tests.reading import present
from tests.urdfs import built, joint, limit, mimic
from urdfkin.comparison.certificate import SAME, certificate, difference_text, recheck
from urdfkin.comparison.result import Sameness, Verdict
from urdfkin.comparison.verdict import Comparator
from urdfkin.dh import make_dh_table
from urdfkin.model.mechanisms.joint_matching import Axis
from urdfkin.model.mechanisms.matcher import MechanismMatcher
from urdfkin.model.mechanisms.mechanism import Alignment, FreeJointConversion, Mechanism, Screw
from urdfkin.model.tree import FloatArray, JointKind, Limit
from urdfkin.robot import Robot
from urdfkin.urdf.writer import to_urdf

pytestmark = pytest.mark.filterwarnings("ignore")


def other(name: str, what: str) -> Robot:
    return present(changed(name, what))


def test_a_robot_is_the_same_as_itself_and_pinocchio_finds_no_distance() -> None:
    found = urdfkin.same("panda", "panda")
    assert found
    assert found.verdict is Verdict.SAME
    assert (found.after, found.differences, found.remarks) == ((), (), ())
    assert str(found.confirmation).endswith("finds at most 0 m at 8 configurations, within the bounds")
    assert found.worst is None


@pytest.mark.parametrize("bounds", [True, False])
def test_a_distance_that_pinocchio_finds_between_equal_robots_is_an_error(
    bounds: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    a = urdfkin.load("ur5")
    rounding = urdfkin.same(a, a, bounds=False).rounding[0]

    def distances(self: Comparator, alignment: Alignment, variables: object) -> FloatArray:
        return np.full(len(alignment.frames), 1.01 * rounding)

    monkeypatch.setattr(Comparator, "pinocchio_distances", distances)
    with pytest.raises(urdfkin.UrdfkinError, match="Pinocchio finds a distance above the proven bound"):
        urdfkin.same(a, a, bounds=bounds)


def test_different_robots_without_bounds_are_not_called_confirmed() -> None:
    found = urdfkin.same("ur5", "ur10", bounds=False).confirmation
    assert str(found) == "not checked by Pinocchio: bounds=False, so there is no bound to check"


def _tried(
    monkeypatch: pytest.MonkeyPatch, a: Robot, b: Robot
) -> list[tuple[MechanismMatcher, tuple[int, int], Alignment]]:
    """Compare two robots, and return each pair of bodies from which they were aligned."""
    tried, run = list[tuple[MechanismMatcher, tuple[int, int], Alignment]](), MechanismMatcher._match_from

    def noted(self: MechanismMatcher, base: tuple[int, int], X: FloatArray) -> Alignment:
        tried.append((self, base, found := run(self, base, X)))
        return found

    monkeypatch.setattr(MechanismMatcher, "_match_from", noted)
    urdfkin.same(a, b, bounds=False)
    return tried


@pytest.mark.parametrize("what", ["all of it, no name left", "rounded"])
@pytest.mark.parametrize("name", ["panda", "polar"])
def test_the_number_of_matches_does_not_exceed_the_bound_of_the_start_bodies(
    monkeypatch: pytest.MonkeyPatch, name: str, what: str
) -> None:
    tried = _tried(monkeypatch, robot(name), other(name, what))
    assert tried
    assert all(found.match_count <= self._match_count_bound(base) for self, base, found in tried)


def test_start_bodies_that_cannot_improve_the_match_are_not_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    text = robot("panda").urdf
    near = urdfkin.load(text.replace('"panda_link0"', '"world"').replace("0.316", "0.316001"))
    starts = {base for _, base, _ in _tried(monkeypatch, urdfkin.load(text), near)}
    assert starts == {(0, 0), (0, 1), (0, 8), (0, 9)}  # without the bound: all ten bodies of B


def test_different_limits_are_a_remark_and_not_a_difference_of_motion() -> None:
    found = urdfkin.same("ur5", "ur5_limited")
    assert found.verdict is Verdict.SAME
    assert {one.what for one in found.remarks} == {"limits"}
    assert (found.exit_code(), found.exit_code(strict=True)) == (0, 1)


@pytest.mark.slow
@pytest.mark.parametrize("what", ["all of it", "axes flipped", "zeros shifted", "all renamed"])
@pytest.mark.parametrize("name", ["panda", "talos", "polar"])
def test_the_listed_conversions_make_both_robots_move_alike(name: str, what: str) -> None:
    a, b = robot(name), other(name, what)
    found = urdfkin.same(a, b, bounds=False)
    assert found
    assert moves_alike(found, a, b)


@pytest.mark.slow
def test_the_distance_does_not_depend_on_the_order_of_the_models() -> None:
    a, b = robot("elbow"), other("elbow", "tilted by 0.001")
    there, back = present(urdfkin.same(a, b).worst), present(urdfkin.same(b, a).worst)
    assert (there.lower, there.upper) == pytest.approx((back.lower, back.upper), rel=5e-3)


def test_a_missing_mimic_rule_is_detected() -> None:
    a, b = robot("panda"), urdfkin.load(robot("panda").urdf, mimic=False, verify=False)
    found = urdfkin.same(a, b)
    words = "joint panda_finger_joint2 is a mimic joint in A and an independent joint in B: 1.0"
    assert [one.words for one in found.differences] == [f"{words} panda_finger_joint1 +0"]
    assert present(found.worst).lower == pytest.approx(0.04)  # one finger open, the other closed


@pytest.mark.slow
def test_a_joint_that_is_fixed_in_only_one_model_is_named_with_a_bound_of_the_effect() -> None:
    found = urdfkin.same("icub", "icub_reduced")
    joints = {f"joint neck_{way}" for way in ("pitch", "roll", "yaw")}
    assert {one.place for one in found.differences} == joints
    worst = present(found.worst)
    assert worst.lower <= worst.upper <= 1.05 * worst.lower


def test_a_different_tool_is_a_conversion_and_not_a_difference() -> None:
    tree = urdfkin.load("panda").tree
    at = tree.joint_index("panda_hand_tcp_joint")
    T = tree.joints[at].T_parent_joint @ pairs.pose([0.0, 0.0, 0.0], [0.0, 0.0, 0.125])
    b = pairs.with_joint(tree, at, replace(tree.joints[at], T_parent_joint=T))
    found = urdfkin.same(robot("panda"), pairs.loaded(b))
    assert found.verdict is Verdict.SAME_AFTER
    moved = 'moved by xyz="0.0 0.0 0.125" rpy="0.0 0.0 0.0"'
    assert found.after == (f"frame panda_hand_tcp of B is frame panda_hand_tcp of A, {moved}",)
    worst = present(found.as_written)
    assert worst.frame == "panda_hand_tcp"
    assert worst.lower == pytest.approx(0.125)
    assert (found.exit_code(), found.exit_code(strict=True)) == (0, 1)


@pytest.mark.slow
def same_as_own_table(seed: int) -> Sameness:
    """Compare a random arm with its own table; the table has other signs, zeros, base and tool."""
    tree = nearly_coincident(seed)
    table = disguised(make_dh_table(tree, "tip"), seed)
    joints = (
        replace(joint, kind=JointKind.CONTINUOUS)
        if joint.kind.turns
        else replace(joint, limit=Limit(-1.0, 1.0, 1.0, 1.0))
        for joint in tree.joints
    )
    return urdfkin.same(to_urdf(replace(tree, joints=tuple(joints))), table, bounds=False)


# The joints of arm 21 are not nearly parallel. The other arms have axes with tilts down to 1e-9 rad.
# For the arms 5, 16, 22, 43, 50 and 51, only all axes together determine the base and the zero offsets.
@pytest.mark.slow
@pytest.mark.parametrize("seed", [5, 8, 10, 16, 17, 21, 22, 27, 36, 43, 50, 51, 52])
def test_an_arm_is_equivalent_to_its_own_table_although_the_frames_differ(seed: int) -> None:
    found = same_as_own_table(seed)
    assert found.verdict is Verdict.SAME_AFTER
    assert "tools" in found.up_to


@pytest.mark.parametrize("tilt", [1e-2, 1e-6, 1e-9, 1e-11])
def test_the_nearest_point_of_nearly_parallel_lines_is_exact(tilt: float) -> None:
    line = Screw(np.array([0.0, 0.0, 1.0]), np.zeros(3))
    crossing = Screw(np.array([0.0, math.sin(tilt), math.cos(tilt)]), np.array([0.01, 0.0, 5.0]))
    found = Axis(crossing, True, line).nearest_point_coordinate(line.direction)
    assert found == pytest.approx(5.0, abs=1e-15 / tilt)


def test_a_table_of_a_robot_is_the_same_robot() -> None:
    found = urdfkin.same("ur5", urdfkin.load("ur5").dh("tool0", "base"))
    assert found.differences == ()
    assert len(found.joints) == 6


def test_joints_can_be_paired_by_hand() -> None:
    a, b = robot("panda"), other("panda", "all renamed")
    name = next(one.b for one in urdfkin.same(a, b, bounds=False).joints if one.a == "panda_joint1")
    assert urdfkin.same(a, b, map={"panda_joint1": name}, bounds=False)
    with pytest.raises(urdfkin.UnknownNameError, match="unknown joint 'panda_jointl'; did you mean"):
        urdfkin.same(a, b, map={"panda_jointl": name})
    with pytest.raises(urdfkin.InputError, match=r"cannot be matched.*'panda_joint1' of A"):
        urdfkin.same(a, a, map={"panda_joint1": "panda_joint2"})
    with pytest.raises(urdfkin.InputError, match="not a mapping of joint names"):
        urdfkin.same(a, a, map=["panda_joint1"])  # type: ignore[arg-type]
    with pytest.raises(urdfkin.InputError, match="occurs twice"):
        urdfkin.same(a, b, map={"panda_joint1": name, "panda_joint2": name})


@pytest.mark.parametrize(("name", "seconds"), [("panda", 1.0), ("talos", 5.0)])
def test_a_comparison_of_equal_robots_takes_a_few_seconds_at_most(name: str, seconds: float) -> None:
    a, b = urdfkin.load(name), urdfkin.load(name)
    began = time.process_time()
    assert urdfkin.same(a, b)
    assert time.process_time() - began <= seconds


def fingers(names: str, tilt: float, multiplier: float, offset: float) -> Robot:
    """Return a palm with two fingers; the second finger mimics the first."""
    palm, a, b, mimicked_joint, follower = names.split()
    rule = limit() + mimic(mimicked_joint, multiplier, offset)
    first = joint(
        mimicked_joint, "revolute", palm, a, f'xyz="-0.03 0 0.05" rpy="0 {tilt} 0"', "0 -1 0", limit()
    )
    second = joint(follower, "revolute", palm, b, 'xyz="0.03 0 0.05"', "0 1 0", rule)
    return built(first, second, verify=False)


def test_a_mimic_rule_determines_the_zero_of_a_joint_with_an_empty_link() -> None:
    found = urdfkin.same(fingers("palm a b ja jb", 0, 1, 0), fingers("L0 L1 L2 k1 k2", -0.5, 1, 0.5))
    assert found.verdict is Verdict.SAME_AFTER, found.differences
    assert found.after == ("q[k1] = q[ja] - 0.5",)


@pytest.mark.parametrize(("multiplier", "offset"), [(1.001, 0.0), (1, 0.001)])
def test_links_of_equal_names_determine_the_zero_before_a_mimic_rule_does(
    multiplier: float, offset: float
) -> None:
    a, b = (fingers("palm a b ja jb", 0, *rule) for rule in ((1, 0), (multiplier, offset)))
    found = urdfkin.same(a, b, bounds=False)
    assert [one.what for one in found.differences] == ["mimic rule"]


def telescope(names: str, x: float) -> Robot:
    """Return four prismatic joints along one axis; the third joint is shifted by x (m)."""
    joints = []
    for i, name in enumerate(names):
        origin = f'xyz="{x if i == 2 else 0} 0 0.2"'
        joints.append(joint(name, "prismatic", f"l{i}", f"l{i + 1}", origin, more=limit(0, 0.3)))
    return built(*joints, verify=False)


def test_prismatic_joints_with_equal_names_are_not_reordered(monkeypatch: pytest.MonkeyPatch) -> None:
    tried = list[tuple[str, ...]]()
    taken = Mechanism.reorder

    def reorder(mechanism: Mechanism, names: Sequence[str]) -> Mechanism:
        tried.append(tuple(names))
        return taken(mechanism, names)

    monkeypatch.setattr(Mechanism, "reorder", reorder)
    found = urdfkin.same(telescope("abcd", 0.0), telescope("abcd", 0.001), bounds=False)
    assert found.verdict is Verdict.DIFFERS
    assert tried == []
    urdfkin.same(telescope("abcd", 0.0), telescope("badc", 0.001), bounds=False)
    assert tried == [tuple("abcd"), tuple("dcba")]  # the order in A, and the reverse order


@pytest.mark.parametrize("order", ["yx", "zyx", "yzx"])
def test_prismatic_joints_with_equal_names_may_have_another_order_in_b(order: str) -> None:
    axes = {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1"}

    def gantry(names: Sequence[str], links: str) -> Robot:
        bodies = ["base", *(f"{links}{i}" for i in range(len(names) - 1)), "tool"]
        sides = zip(names, bodies, bodies[1:], strict=False)
        parts = [joint(n, "prismatic", p, c, "", axes[n], limit(0, 0.3)) for n, p, c in sides]
        return built(*parts, verify=False)

    found = urdfkin.same(gantry(sorted(order), "a"), gantry(order, "b"), bounds=False)
    assert found.verdict is Verdict.SAME, found.differences


@pytest.mark.parametrize("compared", [urdfkin.same, urdfkin.diff])
def test_a_robot_with_an_overflowing_square_of_a_length_is_refused(compared: Any) -> None:
    joints = (joint("j", "fixed", "a", "b", f'xyz="0 0 {z}"', axis="") for z in ("1", "1e308"))
    robots = [built(one, verify=False) for one in joints]
    with pytest.raises(urdfkin.InputError, match=r"model B, r: .*found 1e\+308 m"):
        compared(*robots)


def with_frames(names: str, frames: Collection[int] = (), frame: str = "fixed") -> Robot:
    """Return a chain of three joints; a fixed or idle joint precedes the links with these numbers."""
    parts = list[str]()
    for i, name in enumerate(names):
        child = f"m{i + 1}" if i + 1 in frames else f"l{i + 1}"
        origin = f'xyz="0.{i} 0.1 0.3" rpy="1.57 0.{i} 0"'
        parts.append(joint(name, "revolute", f"l{i}", child, origin, more=limit()))
        if child[0] == "m":
            idle_rule = limit() + mimic(names[0], 0) if frame != "fixed" else ""
            axis = "" if frame == "fixed" else "0 1 0"
            parts.append(joint(f"frame{i + 1}", frame, child, f"l{i + 1}", "", axis, idle_rule))
    return built(*parts)


@pytest.mark.parametrize("names", ["abc", "xyz"])
@pytest.mark.parametrize("frame", ["fixed", "revolute"])
@pytest.mark.parametrize("frames", [(2,), (1, 2, 3)])
def test_a_frame_between_a_joint_and_its_link_is_no_difference(
    names: str, frame: str, frames: Collection[int]
) -> None:
    models = with_frames("abc"), with_frames(names, frames, frame)
    for a, b in (models, models[::-1]):
        found = urdfkin.same(a, b)
        assert found.verdict is Verdict.SAME, found.differences
        assert certified(found, a, b)


def with_tool(turn: str, mount: str, x: float) -> Robot:
    """Return an arm whose tool is x (m) away from its first link."""
    return built(
        joint(turn, "revolute", "base", "arm", more=limit()),
        joint("elbow", "revolute", "arm", "fore", 'xyz="1 0 1"', "0 1 0", limit()),
        joint(mount, "fixed", "arm", "tool", f'xyz="{x} 0 0"', axis=""),
    )


def test_a_fixed_joint_with_the_name_of_another_moving_joint_hides_no_tool() -> None:
    models = with_tool("shoulder", "mount", 1.0), with_tool("turn", "shoulder", 2.0)
    for a, b in (models, models[::-1]):
        found = urdfkin.same(a, b)
        assert found.up_to == ("tools",)
        assert not found.within(0.5)
        assert certified(found, a, b)
    found = urdfkin.same(models[0], with_tool("turn", "shoulder", 1.0))
    assert found.verdict is Verdict.SAME
    assert ("tool", "tool") in found.links


@pytest.mark.parametrize("x", [1.0, 2.0])
def test_two_fixed_joints_with_exchanged_names_of_moving_joints_are_not_free(x: float) -> None:
    def arm(turn: str, mount: str, x: float) -> Robot:
        return built(
            joint(turn, "revolute", "base", "upper", more=limit()),
            joint(mount, "fixed", "upper", "fore", f'xyz="{x} 0 0"', axis=""),
            joint("wrist", "revolute", "fore", "hand", 'xyz="1 0 1"', "0 1 0", limit()),
        )

    a, b = arm("j", "k", 1.0), arm("k", "j", x)
    found = urdfkin.same(a, b)
    assert bool(found) is (x == 1.0)
    assert found.up_to == ()
    assert certified(found, a, b)


def test_a_certificate_passes_the_recheck_if_a_fixed_joint_separated_no_bodies() -> None:
    a = built(
        *(joint(name, "fixed", "base", f"l_{name}", f'xyz="0 {y} 0"', axis="") for y, name in enumerate("jk"))
    )
    b = built(
        joint("j", "revolute", "other", "arm", more=limit()),
        joint("k", "revolute", "arm", "l_k", 'xyz="1 0 0"', "1 0 0", limit()),
    )
    for models in ((a, b), (b, a)):
        assert certified(urdfkin.same(*models), *models)


def on_a_root(root: str, *more: str) -> Robot:
    """Return a robot with two legs on the root link."""
    legs = [
        joint(name, "revolute", root, link, f'xyz="0 {y} 1"', axis, limit())
        + joint(f"{name}_knee", "revolute", link, f"{link}_foot", 'xyz="1 0 0"', "0 1 0", limit())
        for name, link, y, axis in (("j", "b", 0, "0 0 1"), ("k", "c", 1, "1 0 0"))
    ]
    return built(*more, *legs)


def test_root_links_of_equal_names_are_at_one_place_in_a_comparison_as_written() -> None:
    displaced = joint("f", "fixed", "w", "a", 'xyz="0.1 0 0" rpy="0 0 0.5"', axis="")
    models = on_a_root("a"), on_a_root("w", displaced)
    for a, b in (models, models[::-1]):
        found = urdfkin.same(a, b)
        assert found.verdict is Verdict.DIFFERS
        assert found.up_to == ("base",)
        assert present(found.as_written).lower > 0.6
        assert not found.within(0.6)
        assert certified(found, a, b)


# -- certificates ------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def compared() -> tuple[Robot, Robot, Any]:
    a, b = robot("elbow"), other("elbow", "tilted by 0.001")
    return a, b, written(urdfkin.same(a, b))


def test_a_written_certificate_passes_the_recheck(compared: tuple[Robot, Robot, Any], tmp_path: Path) -> None:
    a, b, document = compared
    (tmp_path / "c.json").write_text(json.dumps(document))
    assert recheck(SAME.read(tmp_path / "c.json"), a, b) == []


@pytest.mark.parametrize(
    ("name", "what"), [("elbow", None), pytest.param("panda", "all of it", marks=pytest.mark.slow)]
)
def test_a_certificate_of_a_robot_and_a_modified_copy_passes_the_recheck(name: str, what: str | None) -> None:
    a = robot(name)
    b = a if what is None else other(name, what)
    assert certified(urdfkin.same(a, b), a, b)


@pytest.mark.parametrize("names", [{"j": "z"}, {"j": "z", "k": "a"}])
def test_a_certificate_of_branches_with_new_names_passes_the_recheck(names: dict[str, str]) -> None:
    legs = [
        joint(name, "revolute", "base", f"{name}_link", f'xyz="{x} 0.2 0"', axis, limit())
        for name, x, axis in (("j", 0.0, "0 0 1"), ("k", 0.3, "1 0 0"), ("l", 0.7, "0 0.6 0.8"))
    ]
    a = built(*legs)
    text = a.urdf
    for old, new in names.items():
        text = text.replace(f'"{old}', f'"{new}')
    b = urdfkin.load(text)
    found = urdfkin.same(a, b)
    assert found
    assert certified(found, a, b)


def confirmed(**changed: Any) -> dict[str, Any]:
    """Return a confirmation by Pinocchio, with a distance that Pinocchio does not find."""
    done = {"state": "confirmed", "by": "Pinocchio 4.1.0", "configurations": 8, "metres": 1e-19, "reason": ""}
    return done | changed


FORGED: dict[str, Any] = {
    "its upper bound is wrong": lambda d: d["frames"][-1].update(upper=0.99 * d["frames"][-1]["lower"]),
    "finds": lambda d: d["frames"][-1].update(lower=1.01 * d["frames"][-1]["lower"]),
    "are not corresponding configurations": lambda d: d["frames"][-1]["q_b"].__setitem__(0, 0.123),
    "or a value exceeds a limit": lambda d: [d["frames"][-1][q].__setitem__(1, 50.0) for q in ("q_a", "q_b")],
    "`verdict`: the models give differs": lambda d: d.update(verdict="same"),
    "`differences`: this difference is missing": lambda d: d.update(differences=[]),
    "`differences`: this is not a difference": lambda d: d["differences"].append(
        {**d["differences"][0], "place": "joint x"}),
    "has no interval": lambda d: d["frames"].pop(),
    "a frame has two intervals": lambda d: d["frames"].append(d["frames"][-1]),
    "rad at `q_a`, `q_b`, not": lambda d: d["frames"][-1].update(radians_seen=0.1),
    "`remarks`: the models give a different entry": lambda d: d["remarks"].append(d["differences"][0]),
    "`up_to`: the models give a different entry": lambda d: d["up_to"].append("senses"),
    "`tools`: the models give different entries": lambda d: d["tools"].append(
        {"a": "tool", "b": "tool", "pose": np.eye(4).tolist()}),
    "`links`: the models give a different entry": lambda d: d["links"].pop(),
    "`joints`: the models give a different entry": lambda d: d["joints"].pop(),
    "`rounding`: the models give a different entry": lambda d: d["rounding"].update(metres=1.0),
    "`base_links`: the models give a different entry": lambda d: d.update(base_links=["tool"] * 2),
    "`base`: the matrix is not a rigid motion": lambda d: d["base"][2].__setitem__(2, -1.0),
    "model A: its name is": lambda d: d["a"].update(name="another"),
    "`differences`: the size or a value is wrong": lambda d: d["differences"][0].update(radians=1e-6),
    "a value is wrong in": lambda d: d["differences"][0].update(metres=0.5),
    "value is wrong in: joint": lambda d: d["differences"][0].update(a=0.5),
    "this difference is missing: link forearm": lambda d: d["differences"][0].update(detail="alone"),
    "an entry is listed twice": lambda d: d["differences"].append(d["differences"][0]),
    "must contain a confirmation": lambda d: d.update(checked=confirmed(configurations=7)),
    "must contain a confirmation at": lambda d: d.update(checked=confirmed(reason="no need")),
    "or the reason": lambda d: d.update(checked=confirmed(state="not asked", reason="I was lazy")),
    "or the reason why": lambda d: d.update(
        checked=confirmed(state="not verified", by="", configurations=0, metres=0.0)),
    "or the reason why Pinocchio did not confirm the bounds": lambda d: d.update(checked=confirmed(by="")),
    "`checked`: Pinocchio finds at most": lambda d: d.update(checked=confirmed()),
    "the order joint_2, joint_1 is not possible": lambda d: d["orders"].append(["joint_2", "joint_1"]),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("said", FORGED)
def test_a_forged_certificate_fails_the_recheck(compared: tuple[Robot, Robot, Any], said: str) -> None:
    a, b, document = compared
    forged = copy.deepcopy(document)
    FORGED[said](forged)
    assert any(said in line for line in recheck(forged, a, b))


def test_a_wrong_certificate_is_rejected_without_a_search_in_boxes(
    compared: tuple[Robot, Robot, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    a, b, document = compared
    asked = list[str]()
    monkeypatch.setattr("urdfkin.comparison.certificate.tighten", lambda *_: asked.append("boxes"))
    forged = copy.deepcopy(document)
    forged["base"][0][3] += 0.25
    assert recheck(forged, a, b)
    forged = copy.deepcopy(document)
    for frame in forged["frames"]:  # bounds below the distance at some configurations
        frame["lower"], frame["upper"] = 0.1 * frame["lower"], 0.5 * frame["upper"]
    assert any("its upper bound is wrong" in line for line in recheck(forged, a, b))
    assert asked == []


def test_a_certificate_with_an_unknown_joint_is_refused(compared: tuple[Robot, Robot, Any]) -> None:
    a, b, document = compared
    forged = copy.deepcopy(document)
    forged["joints"][0]["b"] = "elsewhere"
    words = "names a joint or link that one of the models does not have: .*'elsewhere'"
    with pytest.raises(urdfkin.InputError, match=words):
        recheck(forged, a, b)


def test_a_distant_base_must_also_be_a_rigid_motion(compared: tuple[Robot, Robot, Any]) -> None:
    a, b, document = compared
    forged = copy.deepcopy(document)
    forged["base"] = [[2.0, 0.0, 0.0, 1e12], *document["base"][1:]]
    assert recheck(forged, a, b) == ["`base`: the matrix is not a rigid motion"]


@pytest.mark.slow
@pytest.mark.parametrize("end", ["upper", "lower"])
def test_a_recheck_also_proves_the_distance_of_the_models_as_written(end: str) -> None:
    a, b = robot("elbow"), other("elbow", "axes flipped")
    document = written(urdfkin.same(a, b))
    assert recheck(document, a, b) == []
    document["as_written"][end] *= 0.9 if end == "upper" else 1.1
    assert any(line.startswith("`as_written`: frame ") for line in recheck(document, a, b))


@pytest.mark.parametrize("kind", ["planar", "floating"])
def test_the_transform_of_a_free_joint_must_be_a_rigid_motion_of_the_joint(kind: str) -> None:
    kinds = JointKind(kind)
    lift, lower, mirror = np.eye(4), np.eye(4), np.diag([1.0, 1.0, -1.0, 1.0])
    lift[2, 3], lower[2, 3] = 0.1, -0.1
    assert FreeJointConversion(lift, lower).holds_for(kinds)
    assert FreeJointConversion(lift, np.eye(4)).holds_for(kinds) is (kind == "floating")
    assert not FreeJointConversion(mirror, mirror).holds_for(kinds)


def test_a_certificate_of_a_different_version_is_refused(compared: tuple[Robot, Robot, Any]) -> None:
    a, _, document = compared
    words = "model B: the certificate belongs to another version of this robot"
    with pytest.raises(urdfkin.InputError, match=words):
        recheck(document, a, a)


# -- the command -------------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_exit_code_of_same_states_the_verdict(tmp_path: Path) -> None:
    models = robot("elbow"), other("elbow", "axes flipped"), other("elbow", "tilted by 0.01")
    base, flipped, tilted = files_of(tmp_path, *(model.urdf for model in models))
    ways = [base], [flipped], [flipped, "--strict"]
    assert [run("same", base, *words).code for words in ways] == [0, 0, 1]
    assert run("same", base, tilted, "--within", "0.011").code == 0  # 6 mm and 10 mrad
    assert run("same", base, tilted, "--within", "0.009").code == 1
    forms = [f for name in ("certificate", "markdown", "html") for f in (f"--{name}", str(tmp_path / name))]
    done = run("same", base, tilted, *forms)
    assert done.code == 1
    assert "; first difference: joint joint_4: its axis is tilted by 10 mrad" in done.text
    assert (tmp_path / "html").read_text().count('<svg viewBox="-150') == 3
    assert "| tool |" in (tmp_path / "markdown").read_text()
    again = run("same", base, tilted, "--recheck", str(tmp_path / "certificate"))
    assert again.code == 1
    assert again.text.startswith("the certificate holds: differs; first difference: joint joint_4")
    again = run("same", base, tilted, "--recheck", str(tmp_path / "certificate"), "--format", "json")
    assert again.code == 1
    assert json.loads(again.text) == {"holds": True, "verdict": "differs", "errors": []}
    message = refused("same", base, flipped, "--recheck", str(tmp_path / "certificate"))
    assert "another version of this robot" in message


def test_xacro_arguments_are_passed_only_to_the_xacro_file(tmp_path: Path) -> None:
    text = robot("elbow").urdf
    (tmp_path / "elbow.urdf").write_text(text)
    named = (
        text.replace("<robot ", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" ', 1)
        .replace('name="tool"', 'name="$(arg tool)"')
        .replace('link="tool"', 'link="$(arg tool)"')
    )
    at = named.index(">", named.index("<robot")) + 1
    (tmp_path / "elbow.xacro").write_text(f'{named[:at]}<xacro:arg name="tool" default="hand"/>{named[at:]}')
    both = [str(tmp_path / name) for name in ("elbow.xacro", "elbow.urdf")]
    assert "link hand is tool" in run("same", *both).text
    assert "link hand is tool" not in run("same", *both, "--xacro-arg", "tool:=tool").text
    assert run("same", *both[1:], *both[1:], "--xacro-arg", "tool:=tool").code == 2


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "name two robots to compare: urdfkin same A B"),
        (["panda"], "name two robots"),
        (["panda", "pandaa"], "did you mean"),
        (["panda", "panda", "--map", "x"], "a pair of joints is JOINT_OF_A=JOINT_OF_B"),
        (["panda", "panda", "--map", "x=y"], "unknown joint 'x'"),
        (["-", "-"], "only one of the robots can come from standard input"),
        (["panda", "panda", "--recheck", "/dev/null"], "not a JSON file"),
    ],
)
def test_arguments_that_cannot_be_compared_are_refused_in_one_line(words: list[str], said: str) -> None:
    assert said in refused("same", *words)


def test_the_printed_schema_is_valid_and_fits_the_output() -> None:
    from jsonschema import Draft202012Validator

    done = run("same", "--schema")
    Draft202012Validator.check_schema(done.data)
    made = run("same", "elbow", "elbow", "--format", "json").data
    Draft202012Validator(done.data).validate(made)


def with_k(kind: str, more: str = "", pitch: float = 0.0) -> Robot:
    """Load an arm whose second joint k has a kind and more elements."""
    k = joint("k", kind, "b", "c", f'xyz="1 0 0" rpy="0 {pitch} 0"', "0 1 0" * (kind != "fixed"), more)
    first = joint("j", "revolute", "a", "b", more=limit())
    return built(first, k, joint("l", "revolute", "c", "d", 'xyz="0 1 0"', "1 0 0", limit()))


def idle(kind: str, offset: float) -> Robot:
    return with_k(kind, limit() + mimic("j", 0, offset))


@pytest.mark.parametrize(("kind", "offset"), [("revolute", 0.0), ("revolute", 0.25), ("continuous", 3.0)])
def test_a_mimic_joint_with_multiplier_zero_is_a_fixed_joint_at_its_offset(kind: str, offset: float) -> None:
    models = [idle(kind, offset), with_k("fixed", pitch=offset)]
    for which, (a, b) in zip("AB", (models, models[::-1]), strict=True):
        found = urdfkin.same(a, b)
        assert found.verdict is Verdict.SAME, found
        words = f"its mimic rule has the multiplier 0, so the joint's value is always {offset:g} rad"
        remark = f"joint k never moves in {which}: {words}"
        assert remark in [one.words for one in found.remarks]
        assert found.exit_code(strict=True) == 1
        document = certificate(found)
        assert remark in [difference_text(one) for one in document["remarks"]]
        assert recheck(document, a, b) == []
        document["remarks"] = []
        assert recheck(document, a, b) != []


@pytest.mark.parametrize(("kind", "what"), [("fixed", "fixed"), ("revolute", "mimic rule")])
def test_a_joint_that_never_moves_can_be_matched_with_a_moving_joint_by_hand(kind: str, what: str) -> None:
    still = with_k(kind, limit() + mimic("j", 0) if kind != "fixed" else "")
    text = with_k("revolute", limit()).urdf.replace('"k"', '"moves"').replace('"c"', '"other"')
    models = still, urdfkin.load(text)
    for a, b, names in ((*models, {"k": "moves"}), (*models[::-1], {"moves": "k"})):
        found = urdfkin.same(a, b, map=names)
        assert [one.what for one in found.differences] == [what]
        assert certified(found, a, b)


def test_a_mimic_joint_with_multiplier_zero_and_a_joint_fixed_elsewhere_differ_by_a_bounded_angle() -> None:
    models = idle("revolute", 0.25), with_k("fixed", pitch=0.2)
    for a, b in (models, models[::-1]):
        found = urdfkin.same(a, b)
        assert found.verdict is Verdict.DIFFERS
        assert present(found.worst).radians == pytest.approx(0.05)
        assert not any("only in" in one.what for one in found.differences)


def test_a_mimic_joint_with_multiplier_zero_and_an_independent_joint_differ_in_the_rule() -> None:
    found = urdfkin.same(idle("revolute", 0.0), with_k("revolute", limit()))
    assert [one.what for one in found.differences] == ["mimic rule"]


def test_a_prismatic_joint_that_never_moves_is_stated_in_metres() -> None:
    found = urdfkin.same(idle("prismatic", 0.5), with_k("fixed"))
    assert found.verdict is Verdict.DIFFERS
    assert "the joint's value is always 0.5 m" in str(found.remarks[0].words)


def test_a_recheck_repeats_the_choice_that_only_an_axis_is_displaced() -> None:
    a = built(joint("j", "revolute", "base", "arm", 'xyz="1 0 0"', "0 1 0", limit(-1, 1)), verify=False)
    b = pairs.loaded(pairs.bent_axis(pairs.shifted(a.tree), 0.5))
    found = urdfkin.same(a, b)
    assert found.verdict is Verdict.DIFFERS
    assert certified(found, a, b)


def test_a_tiny_multiplier_of_a_mimic_joint_is_no_raw_error() -> None:
    a = built(
        joint("a", "revolute", "l0", "l1", "", "0 0 1", limit(-1, 1)),
        joint("b", "revolute", "l1", "l2", 'xyz="1 0 0"', "0 0 1", limit(-1, 1) + mimic("a")),
        joint("c", "revolute", "l2", "l3", 'xyz="1 0 0"', "0 0 1", limit(-1, 1) + mimic("a", "1e-320", 1)),
        verify=False,
    )
    assert urdfkin.same(a, a).verdict is Verdict.SAME
