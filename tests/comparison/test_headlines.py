"""The headline, the exit code and the page of `same` answer the user's question."""

import math
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path

import pytest

import urdfkin
from tests import urdfs
from tests.cli.running import urdfkin as run
from tests.comparison.pairs import certified, files_of
from tests.comparison.test_pairs import FOLLOWING
from tests.reading import present
from tests.urdfs import joint, limit, mimic
from urdfkin.comparison.result import SameQuestion, Verdict
from urdfkin.robot import Robot

pytestmark = pytest.mark.filterwarnings("ignore")


def arm(
    mount: str = '<origin xyz="0 0 0"/>',
    tool: str = '<origin xyz="0 0 0.1"/>',
    second: str = "revolute",
    limits: tuple[float, float] = (-1.0, 1.0),
    shoulder: str = "0 0 0",
) -> str:
    """Return a robot with a world, a base that is fixed to the world, two joints and a tool."""
    return urdfs.robot(
        f'<joint name="mount" type="fixed"><parent link="world"/><child link="base"/>{mount}</joint>',
        joint("turn", "revolute", "base", "upper", f'xyz="0 0 0.1" rpy="{shoulder}"', more=limit(*limits)),
        joint("bend", second, "upper", "lower", 'xyz="0 0 0.3"', "0 1 0", limit()),
        f'<joint name="hold" type="fixed"><parent link="lower"/><child link="tcp"/>{tool}</joint>',
        name="arm",
    )


def finger(multiplier: float) -> str:
    """Return two fingers with equal limits; the second finger mimics the first."""
    ends = limit(-0.005, 0.055)
    return urdfs.robot(
        joint("ja", "prismatic", "palm", "a", axis="0 0 -1", more=ends),
        joint("jb", "prismatic", "palm", "b", more=ends + mimic("ja", multiplier)),
        name="finger",
    )


def headline(a: str | Robot, b: str | Robot, **asked: float) -> str:
    from urdfkin.report.same import headline as of

    return of(urdfkin.same(a, b, **asked), SameQuestion(**asked))  # type: ignore[arg-type]


def test_a_moved_tool_is_equivalent_up_to_tools_and_not_within_a_smaller_distance() -> None:
    a, b = arm(), arm(tool='<origin xyz="0 0 0.15"/>')
    found = urdfkin.same(a, b)
    assert (found.verdict, found.up_to) == (Verdict.SAME_AFTER, ("tools",))
    assert headline(a, b).startswith("EQUIVALENT up to tools")
    assert "without changes of B, tcp is 50 mm off" in headline(a, b)
    assert not found.within(1e-6)
    assert not found.within(0.0499)
    assert found.within(0.0501)
    assert [found.exit_code(within=most) for most in (None, 1e-6, 0.0501)] == [0, 1, 0]
    asked = headline(a, b, within=1e-6)
    assert asked.startswith("NOT WITHIN 1e-06 m and rad, without changes of model B: tcp is 50 mm off")


def test_a_rotated_tool_is_reported_in_radians() -> None:
    from urdfkin.report.diff import headline as of

    a, b = arm(), arm(tool='<origin xyz="0 0 0.1" rpy="0 0 0.02"/>')
    assert "without changes of B, tcp is 20 mrad off" in headline(a, b)
    assert not urdfkin.same(a, b).within(0.019)
    assert of(urdfkin.diff(a, b)) == "1 change; together they turn tcp by up to 20 mrad"


@pytest.mark.parametrize("rename", [False, True])
def test_within_counts_shifted_zeros_as_written_also_with_different_names(rename: bool) -> None:
    a, b = arm(), arm(shoulder="0 0 0.001")
    for name in ("world", "base", "upper", "lower", "tcp", "turn", "bend", "hold", "mount") * rename:
        b = b.replace(f'"{name}"', f'"other_{name}"')
    found = urdfkin.same(a, b)
    assert found
    assert found.up_to == ("zeros",)
    assert headline(a, b).startswith("EQUIVALENT up to zeros")
    assert len(found.links) == 5
    assert found.bound_as_written[1] == pytest.approx(1e-3, rel=1e-6)
    assert not found.within(1e-4)
    assert found.within(1.001e-3)


def test_a_difference_in_orientation_alone_is_reported_in_radians() -> None:
    a, b = arm(), arm().replace('<axis xyz="0 1 0"/>', '<axis xyz="0.01 1 0"/>')
    a, b = (text.replace('<origin xyz="0 0 0.1"/>', "") for text in (a, b))
    said = headline(a, b)
    assert " 0 m " not in said
    assert said.startswith("DIFFERS by up to ")
    assert "mrad" in said.split(";")[0]
    worst = max(urdfkin.same(a, b).frames, key=lambda frame: frame.radians_seen)
    assert worst.radians_seen > 0.005


def test_a_joint_of_a_different_type_is_a_difference_without_an_upper_bound() -> None:
    a, b = arm(), arm(second="prismatic")
    found = urdfkin.same(a, b)
    worst = present(found.worst)
    # The joint turns by 1 rad in A and moves by 1 m in B.
    far = math.hypot(1.0, 0.1 * math.sin(1.0), 0.1 * (1.0 - math.cos(1.0)))
    assert worst.lower == pytest.approx(far, rel=1e-3)
    assert math.isinf(worst.upper)
    assert headline(a, b).startswith("DIFFERS by 1.005 m or more and 1 rad or more (no bound is proven)")
    assert not found.within(10.0)
    assert certified(found, urdfkin.load(a), urdfkin.load(b))


@pytest.mark.parametrize("below", ["", '<link name="table"/>'])
def test_a_robot_with_a_different_mount_is_equivalent_up_to_the_base(below: str) -> None:
    a, b = arm(), arm(mount='<origin xyz="1 0 0.5"/>')
    if below:
        more = f"{below}{joint('under', 'fixed', 'table', 'world')}</robot>"
        a, b = (text.replace("</robot>", more) for text in (a, b))
    found = urdfkin.same(a, b)
    assert (found.verdict, found.up_to) == (Verdict.SAME_AFTER, ("base",))
    assert found.differences == ()
    assert len(found.after) == 1
    assert "without changes of B, base is 1.118 m off" in headline(a, b)
    assert found.exit_code() == 0
    assert found.exit_code(within=1.0) == 1
    assert certified(found, urdfkin.load(a), urdfkin.load(b))


def test_a_moved_mount_on_a_base_with_two_arms_is_a_difference() -> None:
    more = f'<link name="arm2"/>{joint("other", "revolute", "world", "arm2", more=limit())}</robot>'
    a, b = (arm(mount=f'<origin xyz="{x} 0 0"/>').replace("</robot>", more) for x in (0.0, 1.0))
    assert urdfkin.same(a, b, bounds=False).verdict is Verdict.DIFFERS


def test_the_headline_counts_joints_with_different_limits() -> None:
    a, b = arm(), arm(limits=(-1.0, 2.0))
    assert headline(a, b).endswith("; limits of 1 joint differ")
    assert headline("ur5", "ur5_limited").endswith("; limits of 5 joints differ")


def test_intervals_cover_the_files_limits_although_mimic_joints_exceed_limits() -> None:
    a, b = finger(-1.0), finger(-1.01)
    found = urdfkin.same(a, b)
    assert present(found.worst).lower == pytest.approx(550e-6, rel=1e-3)
    assert [found.exit_code(within=most) for most in (1e-4, 5.49e-4, 5.6e-4)] == [1, 1, 0]
    said = "NOT WITHIN 0.0001 m and rad, without changes of model B: b is 0.55 mm"
    assert headline(a, b, within=1e-4).startswith(said)
    own = "joint ja ranges over -0.005 to 0.055 m; the limits of its mimic joints (jb) allow only values"
    ends = ("A", "0.005"), ("B", "0.0049505")
    assert found.narrowed == tuple(f"{model}: {own} from -0.005 to {end}" for model, end in ends)


def test_without_computed_bounds_no_difference_is_within_a_distance() -> None:
    a, b = arm(), arm().replace('<axis xyz="0 1 0"/>', '<axis xyz="0.01 1 0"/>')
    assert not urdfkin.same(a, b, bounds=False).within(1.0)


def test_the_exit_code_and_text_of_same_depend_on_the_option_within(tmp_path: Path) -> None:
    texts = arm(), arm(tool='<origin xyz="0 0 0.15"/>'), finger(-1.0), finger(-1.01)
    a, b, f, g = files_of(tmp_path, *texts)
    assert run("same", a, b).code == 0
    done = run("same", a, b, "--within", "1e-6")
    assert done.code == 1
    assert "NOT WITHIN 1e-06 m and rad" in done.text
    done = run("same", f, g, "--within", "1e-3")
    assert done.code == 0
    assert "WITHIN 0.001 m and rad" in done.text
    assert "allow only values from -0.005 to 0.005" in done.text


def test_strict_allows_no_difference_in_limits_or_links(tmp_path: Path) -> None:
    link = '<joint name="extra" type="fixed"><parent link="lower"/><child link="camera"/></joint>'
    texts = arm(), arm(limits=(-1.0, 0.5)), arm().replace("</robot>", f'<link name="camera"/>{link}</robot>')
    a, *others = files_of(tmp_path, *texts)
    assert run("same", a, a, "--strict").code == 0
    for other in others:
        assert run("same", a, other).code == 0
        assert run("same", a, other, "--strict").code == 1


def test_the_page_shows_the_verdict_within_the_distance_and_the_origin_of_the_models(tmp_path: Path) -> None:
    arms = arm(tool='<origin xyz="0 0 0.15"/>'), arm()
    a, b, *both = files_of(tmp_path, finger(-1.0), finger(-1.01), *arms)
    page = str(tmp_path / "page.html")
    assert run("same", a, b, "--within", "1e-3", "--html", page).code == 0
    text = Path(page).read_text()
    assert 'class="verdict good"' in text
    assert "<h1>WITHIN 0.001 m and rad" in text
    assert urdfkin.load(a).sha256 in text
    assert f"urdfkin <b>{version('urdfkin')}</b>" in text
    assert f"urdfkin same {a} {b} --within 0.001" in text
    assert "<time datetime=" in text
    assert "ja 0.055 m" in text
    assert "mm</text>" in text or " m</text>" in text  # a scale
    assert run("same", a, b, "--within", "1e-4", "--html", page).code == 1
    assert 'class="verdict bad"' in Path(page).read_text()
    assert run("same", a, a, "--strict", "--html", page).code == 0
    assert run("same", *both, "--strict", "--html", page).code == 1
    assert 'class="verdict bad"' in Path(page).read_text()
    assert run("same", *both, "--within", "0.01", "--html", page).code == 1
    text = Path(page).read_text()
    assert "<h2>Where tcp is 50 mm off without changes of B</h2>" in text
    assert 'class="gap"' in text


def test_a_table_is_compared_at_the_frames_that_both_models_name() -> None:
    table = urdfkin.load("ur5").dh("tool0", "base")
    assert urdfkin.same("ur5", table, within=1e-9).within(1e-9)
    tool = table.tool.copy()
    tool[2, 3] += 0.05
    found = urdfkin.same("ur5", replace(table, tool=tool))
    assert found
    assert not found.within(1e-3)


def test_the_repr_of_a_result_states_the_verdict() -> None:
    found = urdfkin.same(arm(), arm(tool='<origin xyz="0 0 0.15"/>', shoulder="0 0 0.5"), bounds=False)
    assert repr(found) == "<Sameness arm, arm: equivalent up to zeros, tools>"


def test_a_link_that_moved_on_a_body_without_joints_is_a_difference() -> None:
    first, second = (joint(a + b, "fixed", a, b, 'xyz="{} 0 0"', axis="") for a, b in ("ab", "bc"))
    text = urdfs.robot(first, second)
    found = urdfkin.same(text.format(0, 1), text.format(0.5, 0.5))
    assert found.verdict is Verdict.DIFFERS
    assert present(found.worst).lower == pytest.approx(0.5)


def test_a_distance_without_a_lower_bound_is_reported_as_an_upper_bound() -> None:
    words = headline(FOLLOWING.format(0.5, 0.1), FOLLOWING.format(0.5, 0.1 + 6e-13))
    assert words.startswith("DIFFERS by up to ")
    assert "0 m" not in words
    assert "at most" in words
