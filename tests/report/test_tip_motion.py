"""A robot that moves otherwise is told, with how far its tip is from where it was, by hand here."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest

import urdfkin as library
from tests.cli.running import urdfkin
from urdfkin.report.tip_motion import tip_motion
from urdfkin.validation.robot_summary import describe


def arm(axis: str = "0 0 1", length: float = 1.0, kind: str = "revolute", mimic: bool = False) -> str:
    """A joint that turns by up to a right angle either way, and a tip at the end of a link."""
    follower = '<mimic joint="side" multiplier="2" offset="0.1"/>' if mimic else ""
    return (
        '<robot name="r"><link name="base"/><link name="arm"/><link name="tip"/><link name="beside"/>'
        f'<joint name="turn" type="{kind}"><parent link="base"/><child link="arm"/><axis xyz="{axis}"/>'
        f'<limit lower="{-math.pi / 2!r}" upper="{math.pi / 2!r}" effort="1" velocity="1"/>{follower}</joint>'
        '<joint name="end" type="fixed"><parent link="arm"/><child link="tip"/>'
        f'<origin xyz="{length} 0 0"/></joint>'
        '<joint name="side" type="continuous"><parent link="base"/><child link="beside"/>'
        '<axis xyz="0 0 1"/></joint></robot>'
    )


def model(text: str) -> Any:
    robot = library.load(text)
    return {**describe(robot), "tip": "tip", "base": "base"}


def test_a_link_that_is_longer_moves_the_tip_by_as_much() -> None:
    found = tip_motion(model(arm()), model(arm(length=1.1)))
    assert found is not None
    assert (found.base, found.tip) == ("base", "tip")
    assert found.metres == pytest.approx(0.1, abs=1e-15)
    assert found.radians == pytest.approx(0.0, abs=1e-15)


def test_a_flipped_axis_puts_the_tip_on_the_other_side() -> None:
    found = tip_motion(model(arm()), model(arm(axis="0 0 -1")))
    assert found is not None
    # At q the two lie 2 sin q apart, and 2 q is between them: nearly 2 m and pi at the ends of the range.
    assert 1.99 < found.metres < 2.0
    assert 3.1 < found.radians < math.pi
    assert found.metres == pytest.approx(2.0 * math.sin(found.radians / 2.0), abs=1e-12)


@pytest.mark.filterwarnings("ignore:.*URDF527")
def test_a_follower_whose_leader_stands_beside_the_path_is_followed() -> None:
    old, new = model(arm(mimic=True)), model(arm(length=1.25, mimic=True))
    found = tip_motion(old, new)
    assert found is not None
    assert found.metres == pytest.approx(0.25, abs=1e-15)


def test_nothing_is_told_where_nothing_moved_or_nothing_can_be_told() -> None:
    old = model(arm())
    assert tip_motion(old, model(arm())) is None
    assert tip_motion(old, None) is None
    gone: Any = {**old, "links": ["hand" if link == "tip" else link for link in old["links"]]}
    assert tip_motion(old, gone) is None


@pytest.mark.slow
def test_compare_tells_it_and_what_its_exit_code_means(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for name, text in (("old", arm()), ("new", arm(axis="0 0 -1", length=1.1))):
        Path("arm.urdf").write_text(text)
        assert urdfkin("validate", "arm.urdf", "--samples", "1", "--json", f"{name}.json").code == 0
    done = urdfkin("compare", "old.json", "new.json")
    assert done.code == 0
    assert "arm.urdf: joint turn, axis: z -> -z, turned by 3.142 rad" in done.text
    assert 'arm.urdf: joint end, origin: xyz="1.0 0.0 0.0"' in done.text
    assert ' -> xyz="1.1 0.0 0.0" rpy="0.0 0.0 0.0": 100 mm away, turned by 0 rad' in done.text
    assert "where it was -> up to 2." in done.text
    assert done.text.splitlines()[-1].startswith("no regression, ")
    assert "exit 0: changes alone do not fail, a regression would (1)" in done.text
    data = json.loads(urdfkin("compare", "old.json", "new.json", "--format", "json").text)
    assert any("where it was" in change["old"] for change in data["changes"])
