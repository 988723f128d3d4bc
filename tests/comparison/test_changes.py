"""`diff`: the changes between two versions of a robot, and the effect of each change."""

from pathlib import Path

import pytest

import urdfkin
from tests.cli.running import urdfkin as run
from tests.comparison.pairs import files_of
from tests.reading import present
from tests.urdfs import joint
from tests.urdfs import robot as urdf
from urdfkin.comparison.diff import ModelChange
from urdfkin.report.diff import lines_of, markdown_of

OLD = """<robot name="arm">
  <link name="base"/>
  <link name="upper"><inertial><mass value="2"/>
    <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <link name="lower"><visual><geometry><box size="1 1 1"/></geometry></visual></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <axis xyz="0 0 1"/><limit lower="-2" upper="2" velocity="1" effort="1"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/>
    <origin xyz="0.4 0 0"/><axis xyz="0 0 1"/><limit lower="-2" upper="2" velocity="1" effort="1"/></joint>
</robot>"""
FIXED = (
    '<link name="{1}"/><joint name="{0}" type="fixed"><parent link="lower"/><child link="{1}"/>'
    '<origin xyz="{2} 0 0"/></joint></robot>'
)
NEW = (
    OLD.replace('xyz="0.4 0 0"', 'rpy="0 0 0" xyz="0.425 0 0"')
    .replace('mass value="2"', 'mass value="2.5"')
    .replace('upper="2"', 'upper="1.5"', 1)
    .replace("</robot>", FIXED.format("flange", "tool", 0))
)


def test_each_changed_attribute_is_reported_and_equal_values_are_not() -> None:
    assert [str(change) for change in urdfkin.diff(OLD, NEW).changes] == [
        "joint shoulder: limit upper 2 -> 1.5", "joint elbow: origin x 0.4 -> 0.425", "joint flange: new",
        "link upper: inertial mass 2 -> 2.5", "link tool: new",
    ]  # fmt: skip
    assert not urdfkin.diff(OLD, OLD.replace("0.4 0 0", "4e-1 0.0 -0"))


def test_a_limit_or_a_damping_of_zero_is_not_a_change_if_it_is_the_default() -> None:
    text = urdf(joint("j", "revolute", "a", "b", more='<limit upper="1" effort="1" velocity="1"/>{}'))
    old = text.format('<dynamics damping="0.1"/>')
    new = text.replace("<limit ", '<limit lower="0" ').format('<dynamics damping="0.1" friction="0"/>')
    assert not urdfkin.diff(old, new)
    found = urdfkin.diff(old, new.replace('lower="0"', 'lower="-1"'))
    assert [str(change) for change in found.changes] == ["joint j: limit lower 0 -> -1"]


def test_a_floating_joint_that_becomes_planar_has_no_proven_bound() -> None:
    old, new = (urdf(joint("j", kind, "a", "b")) for kind in ("floating", "planar"))
    found = urdfkin.diff(old, new)
    assert [str(effect) for effect in found.effects] == ["alone moves b without a proven bound"]
    assert lines_of(found)[-1].endswith("; together they move b without a proven bound")


def test_the_effect_of_each_joint_and_the_total_effect_are_reported() -> None:
    found = urdfkin.diff(OLD, NEW)
    [effect] = found.effects
    assert effect.element == "joint elbow"
    assert effect.interval.frame == "lower"
    assert effect.interval.lower == pytest.approx(0.025, rel=1e-9)
    # A translation has the same distance in all configurations, so the bound is this distance.
    assert effect.interval.lower <= effect.interval.upper == pytest.approx(0.025, rel=1e-9)
    assert present(found.total).lower == pytest.approx(0.025, rel=1e-9)


def test_the_total_effect_of_two_opposite_changes_is_smaller() -> None:
    three = OLD.replace("</robot>", FIXED.format("wrist", "tip", 0.3))
    bent = three.replace('xyz="0.4 0 0"', 'xyz="0.4 0 0" rpy="0 0 0.5"')
    bent = bent.replace('xyz="0.3 0 0"', 'xyz="0.3 0 0" rpy="0 0 -0.5"')
    found = urdfkin.diff(three, bent)
    assert str(found.effects[1]).startswith("alone turns tip by up to 500 mrad")
    chord = 2 * 0.3 * 0.24740395925452294  # chord of 0.5 rad at 0.3 m
    assert present(found.total).lower == pytest.approx(chord, rel=1e-6)


def test_a_change_of_the_name_is_reported_without_an_effect() -> None:
    found = urdfkin.diff(OLD, OLD.replace('name="arm"', 'name="leg"'))
    assert found.changes == (ModelChange("robot", "name", "arm", "leg"),)
    assert (found.effects, found.total) == ((), None)


def test_diff_prints_changes_and_effects_in_every_format(tmp_path: Path) -> None:
    old, new = files_of(tmp_path, OLD, NEW)
    page = str(tmp_path / "comment.md")
    done = run("diff", old, new, "--markdown", page)
    assert done.code == 1
    assert "joint elbow: origin x 0.4 -> 0.425\n    alone moves lower by up to 25 mm" in done.text
    text = Path(page).read_text()
    assert "| joint elbow | origin x | 0\\.4 | 0\\.425 | moves lower by up to 25 mm |" in text
    assert "| link tool: new |" in text
    assert run("diff", old, new, "--no-effects", "--format", "json").data["effects"] == []
    assert run("diff", old, old).code == 0
    assert run("diff", old, "nowhere.urdf").code == 2


MJCF = """<mujoco model="arm"><compiler angle="radian"/><worldbody>
  <body name="upper"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
    <joint name="shoulder" axis="0 0 1" range="-2 1.5" limited="true"/>
    <body name="lower" pos="0.425 0 0"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <joint name="elbow" axis="0 0.1 1" range="-2 2" limited="true"/></body></body>
</worldbody></mujoco>"""


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_differences_between_a_urdf_and_an_mjcf_file_are_reported_at_the_joint(tmp_path: Path) -> None:
    pytest.importorskip("mujoco", reason="MuJoCo reads MJCF")
    found = urdfkin.diff(OLD, MJCF)
    said = [str(change) for change in found.changes]
    assert said[:2] == ["joint elbow: origin 25 mm off", "joint elbow: axis turned by 99.67 mrad"]
    assert "joint shoulder: limits -2 to 2 -> -2 to 1.5" in said
    assert "joint shoulder: velocity 1 -> none" in said
    assert "link world: new" not in said  # the link world of MJCF is the link base
    [effect] = found.effects
    assert effect.element == "joint elbow"
    assert effect.interval.lower == pytest.approx(0.025, rel=1e-6)
    assert found.total is not None
    (old,), new = files_of(tmp_path, OLD), tmp_path / "new.xml"
    new.write_text(MJCF)
    assert "joint elbow: origin 25 mm off\n" in run("diff", old, str(new)).text
    assert not urdfkin.diff(MJCF, MJCF)
    same_robot = MJCF.replace("0.425", "0.4").replace("0 0.1 1", "0 0 1").replace("-2 1.5", "-2 2")
    assert {change.what for change in urdfkin.diff(OLD, same_robot).changes} == {"velocity", "effort"}


@pytest.mark.filterwarnings("ignore")
def test_limits_of_a_urdf_and_an_mjcf_file_are_compared_as_written() -> None:
    pytest.importorskip("mujoco", reason="MuJoCo reads MJCF")
    # The elbows have different zeros. `same` converts the limits; `diff` lists the limits of the files.
    turned = MJCF.replace('pos="0.425 0 0"', 'pos="0.4 0 0" euler="0 0 0.5"').replace("0 0.1 1", "0 0 1")
    three = OLD.replace("</robot>", FIXED.format("wrist", "tip", 0.3))
    site = '<site name="tip" pos="0.3 0 0"/>'
    found = urdfkin.diff(three, turned.replace("</body></body>", f"{site}</body></body>"))
    elbow = [str(one) for one in found.changes if one.element == "joint elbow"]
    assert elbow[0] == "joint elbow: origin turned by 500 mrad"
    assert elbow[1:] == [f"joint elbow: {what} 1 -> none" for what in ("velocity", "effort")]
    limits = [str(one) for one in found.changes if one.what == "limits"]
    assert limits == ["joint shoulder: limits -2 to 2 -> -2 to 1.5"]


@pytest.mark.filterwarnings("ignore")
def test_untrusted_names_are_escaped_in_markdown() -> None:
    found = urdfkin.diff(OLD, OLD.replace('"lower"', '"&lt;b&gt;|@all"'), effects=False)
    assert "<b>" not in markdown_of(found)
    assert "|@all" not in markdown_of(found)
