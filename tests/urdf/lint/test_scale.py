"""Long chains, long loops, deep nesting and big files are checked in linear time, without recursion."""

import time

import pytest

from tests import urdfs
from urdfkin.urdf.lint import Finding, Limits, check_text

pytestmark = pytest.mark.long

MANY = 50_000


def chain(length: int, back: str = "", mimic: bool = False) -> bytes:
    follow = '<mimic joint="j{}"/>' if mimic else ""
    links = "".join(f'<link name="l{i}"/>\n' for i in range(length + 1))
    joints = "".join(
        urdfs.joint(f"j{i}", "continuous", f"l{i}", f"l{i + 1}", axis="", more=follow.format(i - 1) * (i > 0))
        + "\n"
        for i in range(length)
    )
    return f'<robot name="r">\n{links}{joints}{back}</robot>'.encode()


def timed(data: bytes, seconds: float = 20.0) -> tuple[Finding, ...]:
    start = time.process_time()
    findings = check_text(data)
    assert time.process_time() - start < seconds
    return findings


def test_a_chain_of_50000_links_has_no_finding_and_a_loop_has_one_error_on_its_line() -> None:
    assert timed(chain(MANY)) == ()
    back = '<joint name="back" type="fixed"><parent link="l50000"/><child link="l0"/></joint>'
    (finding,) = timed(chain(MANY, back))
    assert (finding.code, finding.line) == ("URDF412", 2 * MANY + 3)
    codes = {finding.code for finding in timed(chain(MANY, mimic=True))}
    assert codes == {"URDF524", "URDF525"}


def test_suggestions_for_5000_unknown_links_take_a_limited_time() -> None:
    joints = "".join(urdfs.joint(f"j{i}", "fixed", f"x{i}", f"l{i}", axis="") for i in range(5_000))
    links = "".join(f'<link name="l{i}"/>' for i in range(5_000))
    findings = timed(f'<robot name="r">{links}{joints}</robot>'.encode())
    assert sum(finding.count for finding in findings) == 5_000


@pytest.mark.parametrize(
    ("limits", "code"),
    [
        (Limits(bytes=10), "URDF108"), (Limits(elements=1), "URDF114"), (Limits(depth=1), "URDF115"),
        (Limits(attributes=0), "URDF116"), (Limits(name=2), "URDF117"),
    ],
)  # fmt: skip
def test_the_message_about_each_limit_names_the_option_that_raises_it(limits: Limits, code: str) -> None:
    (finding,) = check_text(b'<robot name="r"><link name="a"/></robot>', limits=limits)
    assert finding.code == code
    assert "--max-" in str(finding.remedy)


def test_a_number_that_is_too_long_is_an_error_only_if_kinematics_uses_the_number() -> None:
    joint = '<joint name="j" type="fixed"><parent link="a"/><child link="b"/><origin xyz="0 0 {}"/></joint>'
    mass = '<inertial><mass value="{}"/></inertial>'
    text = '<robot name="r"><link name="a">{}</link><link name="b"/>' + joint + "</robot>"
    for inside, origin, severity in (("", "1" * 9, "error"), (mass.format("1" * 9), "1", "warning")):
        findings = check_text(text.format(inside, origin).encode(), limits=Limits(number=8))
        assert ("URDF305", severity) in [(f.code, f.severity.value) for f in findings]


def test_line_numbers_above_65535_are_correct() -> None:
    data = b'<robot name="r">' + b"\n" * 100_000 + b'<link name="a"/><link name="a"/></robot>'
    (finding,) = check_text(data)
    assert finding.line == 100_001
