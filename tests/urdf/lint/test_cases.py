"""Odd documents have the expected findings: URDFs, MJCF and USD files, limits, any bytes, large files."""

import math
import re
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

import urdfkin
from tests import urdfs
from tests.urdf.lint.cases import CASES, left_out
from tests.urdf.lint.cases.arm import Case, arm
from urdfkin.errors import InputError
from urdfkin.urdf.lint import Finding, Severity, SizeLimits, check, check_text
from urdfkin.urdf.lint.pages import MJCF_AND_USD_RULES, explain, page
from urdfkin.urdf.records import FURTHER_LIMITS

SNAPSHOT = Path(__file__).with_name("messages.txt")


def verdict(findings: list[Finding]) -> str:
    severities = {finding.severity for finding in findings}
    if Severity.ERROR in severities:
        return "reject"
    return "accept-with-warning" if Severity.WARNING in severities else "accept"


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_document_has_the_expected_verdict_and_each_finding_has_a_place_and_a_remedy(case: Case) -> None:
    findings = check(case.data)
    printed = [str(finding) for finding in findings]
    assert verdict(findings) == case.verdict, printed
    assert case.findings <= {(finding.code, finding.line) for finding in findings}, printed
    lines = re.split(rb"\r\n|\r|\n", case.data)
    for finding in findings:
        assert 1 <= finding.column <= len(lines[finding.line - 1].decode("utf-8", "replace")) + 1
        assert finding.severity is Severity.NOTE or finding.found or finding.remedy, str(finding)


def messages() -> str:
    """Return the printed findings of all cases that have findings."""
    lines: list[str] = []
    for case in CASES:
        if printed := [str(finding) for finding in check(case.data, fold=True)]:
            lines += [f"== {case.name}", *printed]
    return "\n".join(lines) + "\n"


def test_the_messages_of_findings_equal_the_stored_snapshot() -> None:
    assert messages() == SNAPSHOT.read_text("utf-8"), (
        "messages changed: read the changes, then run python -m tests.urdf.lint.test_cases to accept them"
    )


# -- parts of MJCF and USD files ---------------------------------------------------------------------------

OF_MJCF = [code for code in MJCF_AND_USD_RULES if code.startswith("MJCF")]


@pytest.mark.slow
@pytest.mark.parametrize("code", MJCF_AND_USD_RULES)
def test_only_the_bad_example_on_a_page_about_mjcf_or_usd_has_the_finding(code: str, tmp_path: Path) -> None:
    of_mjcf, rule = code in OF_MJCF, MJCF_AND_USD_RULES[code]
    pytest.importorskip("mujoco" if of_mjcf else "pxr")
    found = []
    for text in (page(code).example, page(code).correction):
        file = tmp_path / ("robot.xml" if of_mjcf else "robot.usda")
        file.write_text(text.lstrip())
        findings = urdfs.loaded(file, verify=False).findings
        codes = {code} if of_mjcf else MJCF_AND_USD_RULES.keys()
        found.append({(one.code, one.severity) for one in findings if one.code in codes})
    assert found == [{(code, rule.severity)}, set()]
    assert explain(rule).startswith(f"{code} {rule.slug} ({rule.severity.value})")


@pytest.mark.slow
@pytest.mark.parametrize("case", left_out.CASES, ids=lambda case: case.name)
def test_each_mjcf_case_has_exactly_the_expected_findings_and_warnings(case: left_out.Mjcf) -> None:
    pytest.importorskip("mujoco")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        robot = urdfkin.load(case.text, verify=False)
    found = []
    for one in robot.findings:
        place = " ".join(filter(None, (one.element, one.name)))
        if one.code in OF_MJCF:
            found.append((one.code, f"{place}: {one.message}" if place else one.message))
    assert sorted(found) == sorted(case.findings)
    assert sum("MJCF101" in str(w.message) for w in caught) == [code for code, _ in found].count("MJCF101")


def test_every_rule_about_mjcf_has_cases_with_and_without_the_finding() -> None:
    for code in OF_MJCF:
        assert {any(code == one for one, _ in case.findings) for case in left_out.CASES} == {True, False}


# -- limits in each version of URDF ------------------------------------------------------------------------

KINDS = ("revolute", "continuous", "prismatic", "fixed", "planar", "floating")
VERSIONS = ("1.0", "1.1", "1.2")
USUAL = {"lower": "-1", "upper": "1", "effort": "10", "velocity": "5"}
#: Values of an attribute: negative, infinite, no number, and valid.
ODD = ("-1", "inf", "-inf", "nan", "", "fast", "1e400", "0x10", "1 ", "0", "-0", "+1", "1e-400")


def limits() -> Iterator[dict[str, str]]:
    """Yield limits with an odd attribute, with missing attributes, or with a lower limit above the upper."""
    for name in (*USUAL, *FURTHER_LIMITS):
        yield from ({**USUAL, name: value} for value in ODD)
    for subset in range(16):
        yield {name: value for i, (name, value) in enumerate(USUAL.items()) if subset >> i & 1}
    yield {**USUAL, "lower": "2"}
    yield {"lower": "2", "upper": "1"}
    yield {"lower": "2", "effort": "1", "velocity": "1"}


def joint_with(limit: dict[str, str], kind: str, version: str) -> str:
    axis = '<axis xyz="0 0 1"/>' if kind in KINDS[:3] else ""
    words = " ".join(f'{name}="{value}"' for name, value in limit.items())
    robot = f'name="r" version="{version}"'
    return arm(robot=robot, attributes=f'type="{kind}"', axis=axis, limit=f"<limit {words}/>")


def pinocchio_reads(text: str) -> bool:
    try:
        pin.buildModelFromXML(text)
    except ValueError:
        return False
    return True


@pytest.mark.slow
@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("kind", KINDS)
def test_a_limit_has_an_error_or_a_mark_exactly_if_pinocchio_refuses_it(kind: str, version: str) -> None:
    for limit in limits():
        text = joint_with(limit, kind, version)
        findings = check(text.encode())
        marked = any(finding.pinocchio_reading is not None for finding in findings)
        refused = any(finding.severity is Severity.ERROR for finding in findings)
        right = not marked if pinocchio_reads(text) else marked or refused
        assert right, (limit, [str(finding) for finding in findings])


@pytest.mark.slow
@pytest.mark.parametrize("name", FURTHER_LIMITS)
@pytest.mark.parametrize("value", ["-1", "inf", "nan", "", "fast"])
@pytest.mark.parametrize("kind", KINDS)
def test_limits_of_urdf_1_2_are_checked_only_in_version_1_2(kind: str, value: str, name: str) -> None:
    codes = {
        version: {f.code for f in check(joint_with({**USUAL, name: value}, kind, version).encode())}
        for version in VERSIONS
    }
    code = "URDF509" if value == "-1" else "URDF301"
    assert [version for version in VERSIONS if code in codes[version]] == ["1.2"], codes


@pytest.mark.parametrize("kind", KINDS)
def test_a_lower_limit_above_the_upper_is_an_error_on_every_joint_in_version_1_2(kind: str) -> None:
    text = joint_with({**USUAL, "lower": "2"}, kind, "1.2")
    assert "URDF507" in [finding.code for finding in check(text.encode())]
    assert not pinocchio_reads(text)


# -- any bytes ---------------------------------------------------------------------------------------------

DOCUMENTS = [case.data for case in CASES if len(case.data) < 5_000]

#: Words and characters with a meaning in XML or in a URDF.
TOKENS = [
    *(b"<joint ", b"</joint>", b"<link name='", b"/>", b">", b"'", b'"', b"&", b"&#9;", b"<!--", b"-->"),
    *(b"<![CDATA[", b"]]>", b"<!DOCTYPE robot [", b"nan", b"1e400", b"${x}", b"\xff", b"\0", b"\xef\xbb\xbf"),
    *(b"mimic", b"xyz", b"xmlns='a'", b"version='1.1'", b"quat_xyzw='0 0 0 1'", b"type='planar'", b"base"),
    *(b"l1", b"\t", b"\r\n"),
]


@given(st.binary(max_size=400), st.lists(st.sampled_from(TOKENS), max_size=40))
def test_the_check_of_any_bytes_and_tokens_raises_no_exception(data: bytes, tokens: list[bytes]) -> None:
    check_text(data)
    check_text(b"<robot name='r'>" + b" ".join(tokens))


@given(st.sampled_from(DOCUMENTS), st.data())
def test_a_changed_document_always_has_the_same_findings(document: bytes, data: st.DataObject) -> None:
    start = data.draw(st.integers(0, len(document)))
    length = data.draw(st.integers(0, 40))
    mutant = document[:start] + data.draw(st.sampled_from([*TOKENS, b""])) + document[start + length :]
    findings = check_text(mutant)
    assert list(findings) == sorted(findings, key=lambda finding: (finding.line, finding.column))
    assert findings == check_text(mutant)


# -- large files -------------------------------------------------------------------------------------------

MANY = 50_000


def chain(back: str = "", mimic: bool = False) -> bytes:
    """Write a chain of many joints, with each link and each joint on its own line."""
    follow = ["", *(urdfs.mimic(f"j{i}") * mimic for i in range(MANY - 1))]
    text = urdfs.chain(follow, origin="", axis="").replace("<joint", "\n<joint").replace("<link", "\n<link")
    return text.replace("</robot>", f"{back}</robot>").encode()


def timed(data: bytes, seconds: float = 20.0) -> tuple[Finding, ...]:
    start = time.process_time()
    findings = check_text(data)
    assert time.process_time() - start < seconds
    return findings


@pytest.mark.long
def test_a_chain_of_50000_links_has_no_finding_and_a_loop_has_one_error_on_its_line() -> None:
    assert timed(chain()) == ()
    back = urdfs.joint("back", "fixed", f"l{MANY}", "l0", axis="")
    (finding,) = timed(chain("\n" + back))
    assert (finding.code, finding.line) == ("URDF412", 2 * MANY + 3)
    codes = {finding.code for finding in timed(chain(mimic=True))}
    assert codes == {"URDF525"}


@pytest.mark.long
def test_suggestions_for_5000_unknown_links_take_a_limited_time() -> None:
    joints = "".join(urdfs.joint(f"j{i}", "fixed", f"x{i}", f"l{i}", axis="") for i in range(5_000))
    links = "".join(f'<link name="l{i}"/>' for i in range(5_000))
    findings = timed(f'<robot name="r">{links}{joints}</robot>'.encode())
    assert sum(finding.count for finding in findings) == 5_000


@pytest.mark.long
@pytest.mark.parametrize(
    ("limits", "code"),
    [
        (SizeLimits(bytes=10), "URDF108"), (SizeLimits(elements=1), "URDF114"),
        (SizeLimits(depth=1), "URDF115"), (SizeLimits(attributes=0), "URDF116"),
        (SizeLimits(name=2), "URDF117"),
    ],
)  # fmt: skip
def test_the_message_about_each_limit_names_the_option_that_raises_it(limits: SizeLimits, code: str) -> None:
    (finding,) = check_text(b'<robot name="r"><link name="a"/></robot>', limits=limits)
    assert finding.code == code
    assert "--max-" in str(finding.remedy)


@pytest.mark.parametrize("offset", [0.0, 2.71828, 27.182818])
def test_limits_with_the_remedy_for_a_mimic_joint_have_no_finding(offset: float) -> None:
    text = urdfs.robot(
        urdfs.joint("a", "prismatic", "l0", "l1", more=urdfs.limit(-1.0, 1.0)),
        urdfs.joint(
            "b", "prismatic", "l1", "l2",
            more=urdfs.limit(-0.5, 0.5) + f'<mimic joint="a" multiplier="7e-4" offset="{offset}"/>',
        ),
    )  # fmt: skip
    found = [one for one in check(text) if one.code == "URDF527"]
    assert len(found) == (offset != 0.0)
    for finding in found:
        remedy = str(finding.remedy).removeprefix("write ").removesuffix(", as the mimic rule demands")
        corrected = text.replace(str(finding.found), remedy)
        assert corrected != text
        assert not [one for one in check(corrected) if one.code == "URDF527"]


@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_pinocchio_accepts_the_remedy_for_a_continuous_mimic_joint(kind: str) -> None:
    limit = urdfs.limit()
    text = urdfs.robot(
        urdfs.joint("a", kind, "l0", "l1", more=limit),
        urdfs.joint("b", "continuous", "l1", "l2", more=limit + '<mimic joint="a"/>'),
    )
    (finding,) = [one for one in check(text) if one.code == "URDF524"]
    assert finding.remedy == 'write type="revolute" for the mimic joint'
    corrected = text.replace('name="b" type="continuous"', 'name="b" type="revolute"')
    assert not [one for one in check(corrected) if one.code == "URDF524"]
    assert pin.buildModelFromXML(corrected, mimic=True).nq == 1


def test_a_mimic_rule_between_two_continuous_joints_has_no_finding_because_pinocchio_applies_it() -> None:
    rule = '<mimic joint="a" multiplier="2" offset="0.3"/>'
    text = urdfs.robot(
        urdfs.joint("a", "continuous", "l0", "l1"), urdfs.joint("b", "continuous", "l1", "l2", more=rule)
    )
    assert check(text) == []
    model = pin.buildModelFromXML(text, mimic=True)
    data = model.createData()
    pin.framesForwardKinematics(model, data, np.array([math.cos(0.7), math.sin(0.7)]))
    tip = data.oMf[model.getFrameId("l2")].homogeneous
    np.testing.assert_allclose(tip, urdfs.loaded(text).placement([0.7], "l2"), atol=1e-14)


def test_a_free_mimic_joint_can_have_limits_that_exclude_zero() -> None:
    text = urdfs.robot(
        urdfs.joint("a", "revolute", "l0", "l1", more=urdfs.limit(-1.0, 1.0)),
        urdfs.joint("b", "revolute", "l1", "l2", more=urdfs.limit(0.5, 2.5) + urdfs.mimic("a", 1.0, 1.5)),
    )
    for mimic in (True, False):
        codes = [finding.code for finding in check(text, mimic=mimic)]
        assert ("URDF608" in codes) is not mimic


@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_a_continuous_joint_must_not_be_mimicked_by_another_kind(kind: str) -> None:
    text = urdfs.robot(
        urdfs.joint("a", "continuous", "l0", "l1", more=urdfs.limit()),
        urdfs.joint("b", kind, "l1", "l2", more=urdfs.limit() + '<mimic joint="a"/>'),
    )
    with pytest.raises(ValueError, match="configuration spaces have different sizes"):
        pin.buildModelFromXML(text, mimic=True)
    (finding,) = [one for one in check(text) if one.code == "URDF524"]
    assert finding.remedy == 'write type="revolute" for the mimicked joint'
    corrected = text.replace('"continuous"', '"revolute"')
    assert not [one for one in check(corrected) if one.code == "URDF524"]
    assert pin.buildModelFromXML(corrected, mimic=True).nq == 1


@pytest.mark.parametrize(
    "make",
    [
        lambda: SizeLimits(bytes="10"),  # type: ignore[arg-type]
        lambda: SizeLimits(depth=1.5),  # type: ignore[arg-type]
        lambda: SizeLimits(markup=0),
        lambda: SizeLimits(name=-1),
        lambda: {"bytes": 10},
        lambda: None,
    ],
)
def test_limits_of_a_wrong_type_or_size_are_an_error_of_urdfkin(make: Callable[[], Any]) -> None:
    with pytest.raises(InputError):
        check('<robot name="r"><link name="a"/></robot>', limits=make())


@pytest.mark.long
def test_a_number_that_is_too_long_is_an_error_only_if_kinematics_uses_the_number() -> None:
    joint = '<joint name="j" type="fixed"><parent link="a"/><child link="b"/><origin xyz="0 0 {}"/></joint>'
    mass = '<inertial><mass value="{}"/></inertial>'
    text = '<robot name="r"><link name="a">{}</link><link name="b"/>' + joint + "</robot>"
    for inside, origin, severity in (("", "1" * 9, "error"), (mass.format("1" * 9), "1", "warning")):
        findings = check_text(text.format(inside, origin).encode(), limits=SizeLimits(number=8))
        assert ("URDF305", severity) in [(f.code, f.severity.value) for f in findings]


if __name__ == "__main__":
    SNAPSHOT.write_text(messages(), "utf-8")
