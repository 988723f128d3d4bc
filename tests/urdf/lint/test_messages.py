"""A message is true for every file that has the finding, and its remedy removes the problem."""

import pytest

from tests.urdf.lint.cases.arm import arm, base_link, fixed, shape
from urdfkin.urdf.lint import Finding, check

_QUATERNION = '<origin quat_xyzw="{}"/>'
_UNNAMED = '<material><color rgba="1 0 0 1"/></material>'
_AT_ZERO = " if all translations are 0"
_TIP = '<origin xyz="2 0 0"/>'
_NUMBER = '<link name="m\u00b2\u00e4"/><link name="m2\u00e4"/>'
_FORK = "".join(
    fixed(name, "base", name).replace("</j", '<origin xyz="2e-5 0 0"/></j') for name in ("l1", "tool")
)


def _quaternion(numbers: str) -> str:
    return arm(robot='name="r" version="1.1"', origin=_QUATERNION.format(numbers))


def _only(text: str | bytes, code: str, root_joint: str | None = None) -> Finding:
    data = text if isinstance(text, bytes) else text.encode()
    (finding,) = [one for one in check(data, root_joint=root_joint) if one.code == code]
    return finding


MESSAGES: dict[str, tuple[str | bytes, str, str]] = {
    "latin1-declared": (
        arm(head='<?xml version="1.0" encoding="ISO-8859-1"?><!-- \u00e4 -->').encode("latin-1"),
        "URDF102",
        "a byte is not UTF-8, and the file declares ISO-8859-1",
    ),
    "ascii-declared": (
        arm(head='<?xml version="1.0" encoding="US-ASCII"?><!-- \u00e4 -->'),
        "URDF103",
        'the declared encoding is not UTF-8: found "US-ASCII"',
    ),
    "subset-without-definitions": (
        arm(head="<!DOCTYPE robot []>"), "URDF106", "has brackets [ ], which can define entities",
    ),
    "long-material": (arm(more=f'<material name="{"m" * 10_001}"/>'), "URDF117", "name of <material> is too"),
    "quaternion-zero": (_quaternion("0 0 0 0"), "URDF513", "the quaternion is zero"),
    "quaternion-huge": (_quaternion("0 0 0 1e200"), "URDF513", "the quaternion has no usable length"),
    "planar-without-xyz": (
        arm(attributes='type="planar"', limit="", axis="<axis/>"), "URDF505", "found <axis> without xyz",
    ),
    "axis-of-a-fixed-joint": (
        arm(attributes='type="fixed"', limit="", axis='<axis xyz="x 0 1"/>'), "URDF510",
        "a part of xyz is not a number; a fixed joint ignores its axis",
    ),
    "negative-pi": (
        arm(origin='<origin rpy="-1.5708 0 0"/>'), "URDF601",
        "rpy contains a rounded -pi/2, off by 3.7e-06 rad",
    ),
    "lookalikes": (arm(more=_NUMBER), "URDF407", "another name looks the same or nearly the same"),
    "extension": (base_link("<contact/>"), "URDF207", "keep the element if another program needs it"),
    "namespace": (arm(robot='name="r" xmlns="http://a"'), "URDF213", "readers that support namespaces find"),
    "tiny-fork": (
        '<robot name="r"><link name="base"/><link name="l1"/><link name="tool"/>' + _FORK + "</robot>",
        "URDF604",
        "the joint origins along the longest chain of the robot add up to 20 um",
    ),
    "mesh-without-package": (
        base_link(shape('<mesh filename="package:///a.stl"/>')), "URDF706", "write package://NAME/PATH",
    ),
    "materials-without-names": (arm(more=2 * _UNNAMED), "URDF709", "two materials of the robot have no name"),
}  # fmt: skip


@pytest.mark.parametrize("name", MESSAGES)
def test_a_message_states_what_the_file_contains(name: str) -> None:
    text, code, message = MESSAGES[name]
    assert message in _only(text, code).sentence


def test_the_remedy_for_a_rounded_negative_multiple_of_pi_has_the_sign() -> None:
    remedy = _only(arm(origin='<origin rpy="-1.5708 0 0"/>'), "URDF601").remedy or ""
    assert "write -1.5707963267948966 if you mean -pi/2;" in remedy


@pytest.mark.parametrize(
    ("kind", "condition"), [("prismatic", " if all translations are 0"), ("revolute", "")]
)
def test_the_displacement_by_a_rounded_angle_has_a_condition_if_a_joint_translates(
    kind: str, condition: str
) -> None:
    text = arm(attributes=f'type="{kind}"', origin='<origin rpy="3.14 0 0"/>', follow=_TIP)
    assert f"which moves the links below by up to 3.2 mm{condition}:" in f"{_only(text, 'URDF601').sentence}:"


def test_the_remedy_for_a_reserved_name_advises_against_the_root_joint_that_was_given() -> None:
    text = arm().replace('"j1"', '"root_joint"')
    given = _only(text, "URDF403", root_joint="floating")
    assert given.remedy == "rename the joint, or load without root_joint"
    assert _only(text, "URDF403").remedy == "rename the joint before you load the robot with root_joint"
