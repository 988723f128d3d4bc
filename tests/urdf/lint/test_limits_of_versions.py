"""`check` reports each limit that urdfdom refuses, for each URDF version and each joint type."""

from collections.abc import Iterator

import pinocchio as pin
import pytest

from tests.urdf.lint.cases.arm import arm
from urdfkin.urdf.lint import Severity, check
from urdfkin.urdf.records import FURTHER_LIMITS

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
        marked = any(finding.oracle is not None for finding in findings)
        refused = any(finding.severity is Severity.ERROR for finding in findings)
        if pinocchio_reads(text):
            assert not marked, (limit, [str(finding) for finding in findings])
        else:
            assert marked or refused, (limit, [str(finding) for finding in findings])


@pytest.mark.slow
@pytest.mark.parametrize("name", FURTHER_LIMITS)
@pytest.mark.parametrize("value", ["-1", "inf", "nan", "", "fast"])
@pytest.mark.parametrize("kind", KINDS)
def test_limits_of_urdf_1_2_are_checked_on_every_joint_and_only_in_version_1_2(
    kind: str, value: str, name: str
) -> None:
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
