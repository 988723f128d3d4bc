"""yourdfpy reads each URDF a second time, and a different tree is reported."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import urdfkin
from urdfkin.urdf.catalogue import catalogue
from urdfkin.validation.campaign import validate
from urdfkin.validation.outcome import Verdict
from urdfkin.verify import second_reader
from urdfkin.verify.second_reader import SecondReading, second_reading

ARM = """<robot name="arm">
<link name="base"/><link name="a"/><link name="b"/><link name="c"/>
<joint name="turn" type="revolute"><parent link="base"/><child link="a"/><axis xyz="0 0 1"/>
  <origin xyz="0.1 0.2 0.3" rpy="0.1 -0.2 2.5"/><limit lower="-1" upper="2" effort="3" velocity="4"/></joint>
<joint name="slide" type="prismatic"><parent link="a"/><child link="b"/><axis xyz="1 0 0"/>
  <limit lower="-1" upper="2" effort="3" velocity="4"/>
  <mimic joint="turn" multiplier="0.5" offset="0.25"/></joint>
<joint name="tool" type="fixed"><parent link="b"/><child link="c"/></joint>
</robot>"""


def quiet_load(source: str, **how: Any) -> urdfkin.Robot:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", urdfkin.UrdfWarning)
        return urdfkin.load(source, verify=False, **how)


def reading(text: str, **how: Any) -> SecondReading:
    robot = quiet_load(text, **how)
    added = robot.root_joint is not None
    return second_reading(robot.urdf, robot.tree, mimic=robot.verifier.mimic, root_joint=added)


@pytest.mark.parametrize("name", ["panda", "talos", "elbow"])
def test_both_readers_agree_on_the_catalogue(name: str) -> None:
    robot = urdfkin.load(name, verify=False)
    found = second_reading(robot.urdf, robot.tree)
    assert (found.differences, found.known, found.unread) == ((), (), None)
    assert found.joints == len(robot.tree.joints)


@pytest.mark.slow
def test_both_readers_agree_on_the_whole_catalogue() -> None:
    for name in catalogue():
        robot = quiet_load(name)
        found = second_reading(robot.urdf, robot.tree, mimic=robot.verifier.mimic)
        assert (found.differences, found.unread) == ((), None), name


@pytest.mark.parametrize("how", [{}, {"mimic": False}, {"root_joint": "floating"}])
def test_options_of_load_are_no_difference(how: dict[str, Any]) -> None:
    assert reading(ARM, **how).differences == ()


def bend(joint: Any) -> None:
    joint.axis = joint.axis + np.array([0.0, 1e-9, 0.0])


def shift(joint: Any) -> None:
    joint.origin = joint.origin.copy()
    joint.origin[0, 3] += 1e-12


def tilt(joint: Any) -> None:
    joint.origin = joint.origin.copy()
    joint.origin[0, 0] += 1e-14


def widen(joint: Any) -> None:
    joint.limit.upper = 2.5


def hang(joint: Any) -> None:
    joint.parent = "c"


def rename(joint: Any) -> None:
    joint.name = "other"


def change_kind(joint: Any) -> None:
    joint.type = "continuous"


PLANTED: dict[str, tuple[Callable[[Any], None], str]] = {
    "axis": (bend, "joint turn: axis"),
    "origin": (shift, "joint turn: origin"),
    "rotation": (tilt, "joint turn: rotation"),
    "limit": (widen, "joint turn: limit"),
    "parent": (hang, "joint turn: from c to a"),
    "name": (rename, "joint turn: 0 times, not 1"),
    "kind": (change_kind, "joint turn: type continuous, not revolute"),
}


def plant(monkeypatch: pytest.MonkeyPatch, fault: Callable[[Any], None], index: int = 0) -> None:
    right = second_reader.read

    def wrong(text: str) -> Any:
        robot = right(text)
        fault(robot.joints[index])
        return robot

    monkeypatch.setattr(second_reader, "read", wrong)


@pytest.mark.parametrize("what", PLANTED)
def test_a_planted_difference_is_reported(what: str, monkeypatch: pytest.MonkeyPatch) -> None:
    fault, words = PLANTED[what]
    plant(monkeypatch, fault)
    assert any(words in text for text in reading(ARM).differences)


def test_a_different_mimic_rule_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    def double(joint: Any) -> None:
        joint.mimic.multiplier *= 2.0

    plant(monkeypatch, double, 1)
    (difference,) = reading(ARM).differences
    assert difference.startswith("joint slide: mimic rule")


def test_a_bent_axis_fails_the_validation(monkeypatch: pytest.MonkeyPatch) -> None:
    plant(monkeypatch, bend)
    report = validate(ARM, samples=0)
    (robot,) = report.robots
    assert robot.verdict is Verdict.DISAGREES
    assert "yourdfpy" in str(robot.reason)
    assert "joint turn: axis" in str(robot.reason)
    assert robot.failed == 0


def test_known_faults_are_named_and_not_counted() -> None:
    text = ARM.replace('axis xyz="0 0 1"', 'axis xyz="0 0 2"')
    text = text.replace("<robot", '<robot version="1.2"').replace('rpy="0.1 -0.2 2.5"', 'quat_xyzw="0 0 1 1"')
    found = reading(text)
    assert found.differences == ()
    assert found.known == ("does not normalise an axis: turn", "ignores quat_xyzw: turn")


def test_a_file_that_yourdfpy_cannot_read_is_named_and_is_no_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(text: str) -> None:
        raise KeyError("link")

    monkeypatch.setattr(second_reader, "read", refuse)
    report = validate(ARM, samples=0)
    assert report.passed
    assert report.as_dict()["robots"][0]["second_reader"]["unread"] == "KeyError: 'link'"  # type: ignore[index]


def test_a_document_type_is_not_given_to_yourdfpy() -> None:
    found = second_reading("<!DOCTYPE robot>" + ARM, quiet_load(ARM).tree)
    assert found.unread == "the file has a document type"


def test_the_declared_encoding_of_the_file_does_not_matter() -> None:
    assert reading(ARM.replace("turn", "drehen_ä")).differences == ()
    declared = '<?xml version="1.0" encoding="latin-1"?>' + ARM.replace("turn", "drehen_ä")
    tree = quiet_load(ARM.replace("turn", "drehen_ä")).tree
    assert second_reading(declared, tree).differences == ()
