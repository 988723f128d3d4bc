"""A finding says everything in one line, survives a trip to another process, and never acts on a terminal."""

import json
import pickle

import pytest

from urdfkin.errors import UrdfkinError
from urdfkin.urdf.findings import Reporter
from urdfkin.urdf.lint import Finding, PinocchioReading, Severity, UrdfError, check, check_text
from urdfkin.urdf.lint.runner import read_urdf

FINDING = Finding(
    "URDF502", Severity.ERROR, "the axis is zero", 'xyz="0 0 0"', "turn it", "a.urdf", 3, 7, "joint", "j"
)


def test_a_finding_prints_as_a_linter_does() -> None:
    line = "a.urdf:3:7: URDF502 error: joint 'j': the axis is zero: found xyz=\"0 0 0\"; turn it"
    assert str(FINDING) == line


def test_a_finding_is_plain_data() -> None:
    assert json.loads(json.dumps(FINDING.as_dict()))["severity"] == "error"
    assert pickle.loads(pickle.dumps(FINDING)) == FINDING


def test_an_error_carries_all_findings_and_prints_the_first() -> None:
    findings = check('<robot name="r">' + '<link name="a"/>' * 9 + "</robot>")
    error = UrdfError(findings)
    assert isinstance(error, UrdfkinError)
    assert len(error.findings) == 8
    assert str(error).startswith("<text>: the URDF has 8 errors; run 'urdfkin explain URDF402' for details")
    assert str(error).count("another link has this name") == UrdfError.SHOWN
    assert "3 more" in str(error)
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.findings) == (str(error), error.findings)


@pytest.mark.parametrize("evil", ["\u202e", "\x9b31m", "\u2066", "\u200b"])
def test_a_name_cannot_act_on_a_terminal(evil: str) -> None:
    text = f'<robot name="r"><link name="a{evil}b"/><joint name="{evil}" type="{evil}"/></robot>'
    report = Reporter(f"{evil}.urdf", text.encode())
    assert read_urdf(report) is not None
    for finding in report.findings():
        assert evil not in str(finding)


def test_many_warnings_of_one_kind_are_folded_and_the_weightiest_stays() -> None:
    joints = "".join(
        f'<joint name="j{i}" type="fixed"><parent link="a"/><child link="b{i}"/>'
        f'<origin xyz="{100 + 100 * (i == 3)} 0 0"/></joint>\n'
        for i in range(6)
    )
    links = '<link name="a"/>' + "".join(f'<link name="b{i}"/>' for i in range(6))
    text = f'<robot name="r">\n{links}\n{joints}</robot>'.encode()
    (folded,) = check_text(text)
    assert (folded.name, folded.also) == ("j3", (3, 4, 5, 7, 8))
    assert len(check_text(text, fold=False)) == 6


def test_with_mimic_off_what_is_wrong_with_it_is_a_note() -> None:
    text = (
        '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="continuous">'
        '<parent link="a"/><child link="b"/><mimic joint="nobody"/></joint></robot>'
    )
    assert [f.severity for f in check(text)] == [Severity.ERROR]
    assert [f.severity for f in check(text, mimic=False)] == [Severity.NOTE]


@pytest.mark.parametrize(("tag", "name"), [("link", "universe"), ("joint", "root_joint")])
def test_names_a_root_joint_needs_are_errors_when_there_is_one(tag: str, name: str) -> None:
    link, joint = (name, "j") if tag == "link" else ("b", name)
    text = (
        f'<robot name="r"><link name="a"/><link name="{link}"/><joint name="{joint}" type="fixed">'
        f'<parent link="a"/><child link="{link}"/></joint></robot>'
    )
    assert [f.severity for f in check(text)] == [Severity.WARNING]
    assert [f.severity for f in check(text, root_joint="floating")] == [Severity.ERROR]


def test_what_pinocchio_refuses_is_marked() -> None:
    text = '<robot name="r"><link name="a"/><link name="b"/>{}</robot>'
    joint = '<joint name="j" type="fixed"><parent link="a"/><child link="b"/><origin xyz="0\t0 1"/></joint>'
    assert [f.oracle for f in check(text.format(joint))] == [PinocchioReading.REFUSES]
