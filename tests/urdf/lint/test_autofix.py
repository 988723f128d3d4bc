"""A fix removes its finding, changes no other byte, and does not change the robot."""

import codecs
import dataclasses
import difflib
import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import urdfkin
from tests.reading import present
from tests.urdf.lint.cases import CASES
from tests.urdf.lint.cases.arm import Case, arm, axis, limit
from tests.urdfs import joint, robot
from urdfkin.system.files import Edit
from urdfkin.urdf.catalogue import catalogue
from urdfkin.urdf.findings import MAX_COMPLETE_FINDINGS, Fix
from urdfkin.urdf.lint import Severity
from urdfkin.urdf.lint.autofix import MAX_AXIS_TILT, FixResult, find_differences, fix_text
from urdfkin.urdf.lint.rules.joints import unit_vector
from urdfkin.urdf.lint.runner import Examination, examine
from urdfkin.urdf.sources import UrdfText, read_source


def mended(data: bytes | str, look: Callable[[UrdfText], Examination] = examine) -> FixResult:
    """Apply the fixes of all findings."""
    return fix_text(text_of(data), look, lambda: lambda _: True)


def text_of(data: bytes | str) -> UrdfText:
    return UrdfText(data.encode() if isinstance(data, str) else data, "<bytes>", "<bytes>")


def codes(data: bytes) -> list[str]:
    return [finding.code for finding in examine(text_of(data)).findings]


SLOPPY = """<?xml version="1.0"?>\r
<robot name='r'>   <!-- keep: rpy="1.5708 0 0" -->\r
  <link name="a"/><link name="b"/><link name="c"/>\r
\t<joint  name='j' type="continuous">\r
    <parent link="a"/>  <child link="b"/>\r
    <origin rpy = '1.5708   -3.1416 0.5'   xyz="0 0 1" colour="red"/>\r
    <axis\txyz="0 0 2" />\r
    <limit  lower="-1"\r
            effort="1" upper="2"\r
            velocity="3"/>\r
  </joint>\r
  <joint name="k" type="fixed"><parent link="b"/><child link="c"/>\r
    <mimic joint="j"/>\r
  </joint>\r
</robot>\r
"""
TIDY = (
    SLOPPY.replace("'1.5708   -3.1416 0.5'", "'1.5707963267948966   -3.141592653589793 0.5'")
    .replace(' colour="red"', "").replace('"0 0 2"', '"0 0 1"').replace("    <mimic joint=\"j\"/>\r\n", "")
    .replace('<limit  lower="-1"\r\n            effort="1" upper="2"', '<limit\r\n            effort="1"')
)  # fmt: skip


def test_a_fix_changes_only_the_bytes_of_its_finding() -> None:
    done = mended(SLOPPY)
    assert done.text.data.decode() == TIDY
    assert sorted(f.code for f in done.fixed_findings) == [
        "URDF208",
        "URDF503",
        "URDF510",
        "URDF510",
        "URDF601",
    ]
    assert codes(done.text.data) == []
    assert mended(codecs.BOM_UTF8 + SLOPPY.encode()).text.data == codecs.BOM_UTF8 + TIDY.encode()
    lines = difflib.ndiff(SLOPPY.splitlines(), TIDY.splitlines())
    assert sum(line.startswith("- ") for line in lines) == 5


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_fixed_findings_of_an_unusual_document_disappear_and_no_new_findings_appear(case: Case) -> None:
    before, done = examine(text_of(case.data)), mended(case.data)
    after = examine(done.text)
    assert len(after.findings) == len(before.findings) - len(done.fixed_findings)
    if any(finding.severity is Severity.ERROR for finding in before.findings):
        assert done.fixed_findings == ()
    else:
        assert done.unfixed_reasons == {}
        assert [finding.code for finding in after.findings if finding.fix] == []
    if not done.fixed_findings:
        assert done.text.data == case.data


@pytest.mark.parametrize(
    "text",
    [
        arm(origin='<origin xyz="0 0 1" xzy="0 0 2"/>'),  # a misspelt attribute
        arm(origin='<origin xyz="0 0 1" pose="0 0 2 0 0 0"/>'),
        arm(axis='<axis xyz="0 0 1" rpy="1 0 0"/>'),
        arm(axis='<axis xyz="1e-13 0 2"/>'),  # Pinocchio would replace the unit vector by 0 0 1
        limit('lower="2" upper="-2" effort="1" velocity="1"'),
        axis("0 0 0"),
    ],
)
def test_a_finding_whose_remedy_needs_a_decision_is_not_fixed(text: str) -> None:
    assert codes(text.encode())
    assert mended(text).text.data == text.encode()


@pytest.mark.parametrize(
    ("damage", "objection"),
    [
        (b'"0 0 2"', "the fix would change the axis of joint j1"),
        (b'effort="10"', "the fix would change the limit of joint j1"),
        (b'<origin xyz="0 0 0.3"', "the fix would change the origin of joint j1"),
        (b'rpy="0.1 0.2', "the fix would change the orientation of joint j1"),
        (b'<link name="l1"', "the fix would change the links or joints"),
        (b"</robot>", "the fix would cause URDF105"),
    ],
)
def test_a_fix_that_would_change_the_robot_is_not_applied(damage: bytes, objection: str) -> None:
    text = arm(axis='<axis xyz="0 0 2"/>')

    def look(asked: UrdfText) -> Examination:
        found = examine(asked)
        at = found.data.find(damage)
        digit = next((k for k in range(at, at + len(damage)) if found.data[k : k + 1].isdigit()), at + 1)
        edits = [Edit(digit, digit + 1, "7")]
        own = [f.fix for f in found.findings if f.code == "URDF503" and f.fix]
        if own and damage != b'"0 0 2"':
            edits = sorted([*edits, *own[0].edits], key=lambda edit: edit.start)
        elif own:
            edits = [Edit(own[0].edits[0].start, own[0].edits[0].end, "0 1e-7 1")]
        wrong = {"URDF503": Fix(tuple(edits))}
        findings = (dataclasses.replace(f, fix=wrong.get(f.code, f.fix)) for f in found.findings)
        return dataclasses.replace(found, findings=tuple(findings))

    done = mended(text, look)
    assert done.text.data == text.encode()
    assert done.fixed_findings == ()
    objections = (objection, "URDF503 would remain after the fix", "the fix would cause")
    assert done.unfixed_reasons["URDF503"].startswith(objections)


numbers = st.floats(-1e3, 1e3).filter(lambda x: x == 0.0 or abs(x) > 1e-6)


@pytest.mark.slow
@given(st.tuples(numbers, numbers, numbers).filter(lambda v: math.hypot(*v) > 1e-3))
def test_rounding_rotates_a_unit_vector_by_at_most_half_of_tilt(vector: tuple[float, float, float]) -> None:
    a, b = [list(map(Fraction, v)) for v in (vector, unit_vector(vector))]
    cross = sum((a[i] * b[j] - a[j] * b[i]) ** 2 for i, j in ((0, 1), (1, 2), (2, 0)))
    lengths = sum(x * x for x in a) * sum(x * x for x in b)
    assert cross <= (MAX_AXIS_TILT / 2) ** 2 * lengths * (1 + Fraction(1, 10**9))
    assert abs(math.hypot(*unit_vector(vector)) - 1.0) < 1e-12


SPOILT = {
    "long axes": ('<axis xyz="0 0 1"', '<axis xyz="0 0 2.5"'),
    "unknown attributes": ("<axis ", '<axis  shade="3" '),
    "tabs between numbers": ('<origin rpy="', '<origin rpy=" '),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ur5", "panda", "talos_reduced", "kinova"])
def test_same_proves_that_a_fixed_robot_is_the_same(name: str) -> None:
    text = catalogue()[name].path.read_text("utf-8")
    for old, new in SPOILT.values():
        text = text.replace(old, new)
    done = mended(text)
    assert {"URDF208", "URDF503"} <= {finding.code for finding in done.fixed_findings}
    pi = [
        finding.fix.max_rotation
        for finding in done.fixed_findings
        if finding.code == "URDF601" and finding.fix
    ]
    found = urdfkin.same(name, done.text.data)
    if not pi:
        assert found
        return
    # The sum of all rotations bounds the rotation of each link, and each robot is smaller than 10 m.
    assert found.exit_code(within=sum(pi) * 10.0) == 0
    assert sum(pi) < 1e-2


def test_the_fix_of_a_rounded_pi_rotates_no_frame_by_more_than_its_bound() -> None:
    rough = arm(origin='<origin xyz="0 0 0.3" rpy="1.5708 0 -3.1416"/>')
    done = mended(rough)
    (finding,) = done.fixed_findings
    a, b = (urdfkin.load(data) for data in (rough, done.text.data))
    R_a, R_b = (robot.placement(robot.neutral(), "l1")[:3, :3] for robot in (a, b))
    assert (
        0.0 < math.sqrt(float(((R_a - R_b) ** 2).sum()) / 2.0) <= present(finding.fix).max_rotation < 1.2e-5
    )


def test_a_change_of_any_field_of_a_joint_is_a_difference_except_for_positions_in_the_file() -> None:
    record = present(examine(read_source(arm())).robot)
    first, *others = record.joints
    places = {"element", "axis_element", "origin_element", "mimic"}
    changed: dict[str, Any] = {
        "name": "x", "kind": "prismatic", "parent": "tool", "child": "tool", "xyz": (9.0, 0.0, 0.0),
        "rpy": (1.0, 0.2, 0.3), "quaternion": (0.0, 0.0, 0.0, 1.0), "axis": (1.0, 0.0, 0.0), "limit": None,
    }  # fmt: skip
    assert {field.name for field in dataclasses.fields(first)} == places | changed.keys()
    for name, value in changed.items():
        other = dataclasses.replace(record, joints=[dataclasses.replace(first, **{name: value}), *others])
        assert list(find_differences(record, other, {})) != [], name
    assert list(find_differences(record, record, {})) == []


def test_a_file_with_an_error_is_not_fixed() -> None:
    done = mended(limit('lower="1" upper="-1" effort="1" velocity="1"').replace("<axis ", '<axis shade="3" '))
    assert done.unfixed_reasons == {"URDF208": "the file has an error (URDF507); correct this error first"}


@pytest.mark.slow
def test_findings_beyond_the_number_of_stored_ones_are_also_fixed() -> None:
    many = MAX_COMPLETE_FINDINGS + 5
    text = robot(*(joint(f"j{i}", "fixed", "l0", f"l{i}", axis="") for i in range(1, many)))
    done = mended(text.replace("<link ", '<link shade="3" '))
    assert (len(done.fixed_findings), done.unfixed_reasons) == (many, {})
    assert b"shade" not in done.text.data
