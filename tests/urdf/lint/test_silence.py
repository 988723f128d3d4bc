"""What a comment silences is not warned of; what it cannot change stays as it is."""

from __future__ import annotations

import warnings

import pytest

import urdfkin
from tests.urdf.lint.cases.arm import arm
from urdfkin.urdf.findings import WRITTEN_OUT
from urdfkin.urdf.lint import check

COMMENT = "<!-- urdfkin: ignore[{}] as drawn -->\n"


def test_load_does_not_warn_of_it() -> None:
    text = arm(axis='<axis xyz="0 0 2"/>')
    with pytest.warns(urdfkin.UrdfWarning, match="URDF503"):
        urdfkin.load(text)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        robot = urdfkin.load(COMMENT.format("URDF503") + text.partition("\n")[2])
    assert list(robot.findings) == []


def test_a_robot_that_pinocchio_refuses_stays_unverified() -> None:
    text = COMMENT.format("URDF303") + arm(head="", origin='<origin xyz="0\t0 1"/>').lstrip()
    assert check(text) == []
    robot = urdfkin.load(text)
    with pytest.warns(urdfkin.NotVerifiedWarning):
        robot.placement(robot.neutral(), "tool")
    assert not robot.certificate().verified


def test_the_nearest_comment_speaks_and_the_others_are_told_to_be_unused() -> None:
    text = arm(head="", axis="\n" + COMMENT.format("URDF503") + '<axis xyz="0 0 2"/>').lstrip()
    (unused,) = check(COMMENT.format("URDF503") + text)
    assert (unused.code, unused.line) == ("URDF121", 1)


@pytest.mark.slow
def test_more_findings_than_are_written_out_are_silenced_too() -> None:
    links = '<link name="a"/>' + "<link name='b'/>"
    joint = '<joint name="j" type="fixed"><parent link="a"/><child link="b"/>{}</joint>'
    many = "<odd/>" * (WRITTEN_OUT + 5)
    text = f"<robot name='r'>{links}{joint.format(many)}</robot>"
    assert len(check(text)) == WRITTEN_OUT
    assert check(COMMENT.format("URDF207") + text) == []
