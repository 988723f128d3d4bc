"""Pinocchio reads the same robot from a text that `check` accepts, and refuses a text as a finding states.

The texts consist of unusual pieces. Most pieces of a text are usual ones, so that many texts have no error.
"""

import random
from collections.abc import Iterator

import numpy as np
import pinocchio as pin
import pytest

from tests.reading import tree_of
from urdfkin.model.tree import JointKind, KinematicTree
from urdfkin.urdf.lint import Finding, PinocchioReading, Severity, check_text


def attributes(element: str, *values: str) -> list[str]:
    return [f"<{element} {value}/>" for value in values]


#: Alternatives of each piece, the usual one first.
SLOTS: dict[str, list[str]] = {
    "head": [
        '<?xml version="1.0"?>\n', "", "\n \n", "\ufeff", '<?xml version="1.1"?>',
        '<?xml version="1.0" encoding="utf-8" standalone="yes"?>',
        '<?xml version="1.0"?>\n<?xml-stylesheet href="a"?>\n<?b?>',
        '<?xml version="1.0"?><!-- c --><?late?>',
        "<?a > <robot> ?>", "<!-- a comment > <robot> -->\n", "<!---->", "<!-- c --><?late?>\n",
        "<!DOCTYPE robot>", "<!DOCTYPE robot ><!-- c -->", "<?a?><!DOCTYPE robot>",
        "<!DOCTYPE robot><?late?>",
        '<!DOCTYPE robot [<!ENTITY e "1">]>', "text ", "<![CDATA[text]]>",
    ],
    "robot": [
        'name="r"', "name='r'", 'name=""', "", 'name="a&amp;b&#x43;"', 'name="r" xmlns:d="http://d"',
        'name="r" xmlns="http://d"', 'name="r" d:version="3"',
        *(f'name="r" version="{v}"' for v in ("1.0", "1.1", "1.2", "01.0", "+1.0", " 1.0", "1.00", "1.02")),
        *(f'name="r" version="{v}"' for v in ("1.0 ", "1.3", "2.0", "1", "", "1.1.0", "0.9", "1.-1", "1,0")),
        *(f'name="r" version="{v}"' for v in ("1.0a", "١.٠", "1. 1", "1.+1", "0x1.0", "1e0.0", "&#49;.0")),
    ],
    "between": [
        "", "<!-- <joint/> -->", "<!-- > -->", "text", "&lt;&#x41;", "<![CDATA[ <joint> ]] ]>]]>", "<?late?>",
        "<gazebo><?late?></gazebo>", "<d:x/>", "<d:joint d:name='a'><d:parent/></d:joint>", "<unknown/>",
        "<Ünknown Ä='1'/>", "<x.y-z_0/>", "<robot/>", '<group><link name="q"/></group>',
        '<gazebo reference="b"><joint name="j" type="x"/><link/></gazebo>',
        '<transmission name="t"><joint name="j"><x/></joint></transmission>',
        *(f'<material name="m">{x}</material>' for x in attributes("color", 'rgba="1 0 0 1"', 'rgba="x"')),
        '<material name="m"/>', '<material name="m"><texture/></material>', "<material/>",
        '<material name="m"/><material name="m"/>',
        *("<a>" * depth + "</a>" * depth for depth in (400, 497, 498)),
    ],
    "link": [
        "", "<visual/>", "<inertial/>", "<inertial>text<?late?></inertial>", "<origin xyz='x'/>",
        '<visual><origin xyz="x"/><geometry><sphere radius="1"/></geometry></visual>',
        '<visual name="v"><geometry><box size="1 1"/></geometry></visual>',
        '<visual><geometry><mesh filename="$(arg a).stl" scale="1"/></geometry></visual>',
        "<visual><geometry/></visual><visual><geometry><cone/></geometry></visual>",
        '<visual><geometry><capsule radius="1" length="1"/></geometry><material name="n"/></visual>',
        '<collision><geometry><cylinder radius="x" length=""/></geometry></collision>',
        '<inertial><mass value="-1"/></inertial>',
        '<inertial><origin rpy="1 2"/><mass value="1 "/><inertia ixx="x"/></inertial>',
    ],
    "kind": ["revolute", "continuous", "prismatic", "fixed", "planar", "floating", "Revolute", "screw", ""],
    "name": [
        "j", "j k", " j ", "ä", "&#x6a;", "j&#10;", "link", "b", "<", "j&quot;", "root_joint", "universe",
    ],
    "ends": [
        '<parent link="a"/><child link="b"/>',
        '<child link="b" x="1"/><!-- c --><parent link="a"></parent>',
        '<parent link="a"/><parent link="q"/><child link="b"/>',
        '<parent link="a "/><child link="b"/>',
        '<parent link="&#97;"/><child link="b"/>',
    ],
    "origin": [
        '<origin xyz="1 2 3" rpy="0.1 0.2 0.3"/>', "", "<origin rpy='0.1 0.2 0.3'></origin>",
        '<origin xyz="1 2 3">text</origin>', "<origin>1 2 3</origin>",
        '<origin xyz="1 2 3"/><origin xyz="3 2 1"/>',
        *(f'<origin xyz="{xyz}"/>' for xyz in (
            "1 2 3", "", " 1  2 3 ", "1\t2 3", "1\n2 3", "1&#32;2&#x20;3", "1&#9;2 3", "&#49; 2 3",
            "+1. .5e0 -0", "1e400 0 0", "1e-400 4e-320 0", "0x1 0 0", "nan inf 0", "1,0 0 0",
            f"0.{'3' * 500} 0 0", f"{'1' * 3000} 0 0",
        )),
        *attributes(
            "origin", "", 'rpy=""', 'quat_xyzw="0 0 0.6 0.8"', 'quat_xyzw="0 0 0 1" rpy="0 0 1"',
            'xyz="1 2 3" rpyy="1 1 1"',
        ),
    ],
    "axis": [
        '<axis xyz="0 0.6 0.8"/>', "", "<axis/>", "<axis>0 0 1</axis>", "<axis><!-- 0 0 1 --></axis>",
        '<axis a="1"/>', '<axis xyz="0 0 1"/><axis xyz="1 0 0"/>',
        *(f'<axis xyz="{xyz}"/>' for xyz in (
            "", "0 0 0", "0 0 2", "0 0 1e-9", "0 0 1e200", "0 0", "x", "0 0 1 ",
        )),
    ],
    "limit": ['<limit lower="-1" upper="1" effort="1" velocity="1"/>', "", *attributes(
        "limit", "", 'effort="1" velocity="1"', 'lower="-1" upper="1"',
        'lower="1" upper="-1" effort="1" velocity="1"', 'lower="-1" upper="1" effort="-1" velocity="1"',
        'lower="-1 " upper="1" effort="1" velocity="1"', 'lower=" -1" upper="1" effort="1" velocity="1"',
        'lower="" upper="1" effort="1" velocity="1"', 'lower="-1" upper="1" effort="1" velocity="0"',
        'lower="-1" upper="1" effort="1" velocity="1" acceleration="x"',
        'lower="-1" upper="1" effort="1" velocity="1" acceleration="1" jerk="1"',
        'lower="-1" upper="1" effort="1e400" velocity="1"',
    )],
    "others": [
        "", "<unknown><parent link='q'/></unknown>", "text", '<mimic joint="j"/>', '<mimic multiplier="x"/>',
        "<![CDATA[<axis/>]]>",
        *attributes("dynamics", "", 'damping="0"', 'friction="x"', 'damping="1 "', 'damping=""'),
        *attributes("calibration", "", 'rising="x"', 'reference_position="x" falling=" 1"'),
        *attributes(
            "safety_controller", "", 'k_velocity="1"', 'k_velocity="1" k_position="x"', 'k_velocity=""',
        ),
    ],
    "tail": ["\n", "", "<!-- the end -->", "<?late?>", "text", "\0", "<robot/>", " \n\t"],
}  # fmt: skip

PLAIN = 0.8


def assembled(part: dict[str, str]) -> bytes:
    joint = f"{part['origin']}{part['ends']}{part['axis']}{part['limit']}{part['others']}"
    return (
        f"{part['head']}<robot {part['robot']}>{part['between']}"
        f'<link name="a">{part["link"]}</link><link name="b"/>'
        f'<joint name="{part["name"]}" type="{part["kind"]}">{joint}</joint>'
        f"</robot>{part['tail']}"
    ).encode()


def some_odd_pieces(choose: random.Random) -> bytes:
    odd = ((slot, x[0] if choose.random() < PLAIN else choose.choice(x)) for slot, x in SLOTS.items())
    return assembled(dict(odd))


def every_odd_piece() -> Iterator[bytes]:
    """Yield texts with one unusual piece, for each kind of joint and each URDF version."""
    plain = {slot: pieces[0] for slot, pieces in SLOTS.items()}
    for kind in SLOTS["kind"][:6]:
        for version in ("", ' version="1.1"', ' version="1.2"'):
            for slot, pieces in SLOTS.items():
                for piece in pieces:
                    yield assembled({**plain, "kind": kind, "robot": f'name="r"{version}', slot: piece})


def judged(data: bytes) -> None:
    findings = check_text(data, fold=False)
    if any(finding.severity is Severity.ERROR for finding in findings):
        return
    marks = {finding.pinocchio_reading for finding in findings} - {None}
    model = read_by_pinocchio(data)
    if PinocchioReading.REFUSES in marks:
        assert model is None, (data, said(findings))
        return
    assert model is not None, (data, said(findings))
    if not marks:
        assert_same(tree_of(data), model, data)


def said(findings: tuple[Finding, ...]) -> list[str]:
    return [str(finding) for finding in findings]


def read_by_pinocchio(data: bytes) -> pin.Model | None:
    try:
        return pin.buildModelFromXML(data.decode("utf-8-sig"))
    except (ValueError, RuntimeError):
        return None


NV = {JointKind.FIXED: 0, JointKind.PLANAR: 3, JointKind.FLOATING: 6}


def assert_same(tree: KinematicTree, model: pin.Model, data: bytes) -> None:
    (joint,) = tree.joints
    assert model.name == tree.name, data
    assert model.nv == NV.get(joint.kind, 1), data
    assert {frame.name for frame in model.frames} == {"universe", *tree.links, joint.name}, data
    pin_data = model.createData()
    pin.framesForwardKinematics(model, pin_data, pin.neutral(model))
    place = pin_data.oMf[model.getFrameId(tree.links[1], pin.FrameType.BODY)].homogeneous
    np.testing.assert_allclose(place, joint.T_parent_joint, rtol=1e-14, atol=1e-14, err_msg=repr(data))
    if joint.kind.has_axis:
        frame = model.getFrameId(tree.links[1], pin.FrameType.BODY)
        J = pin.computeFrameJacobian(model, pin_data, pin.neutral(model), frame, pin.LOCAL).reshape(6)
        moved = J[:3] if joint.kind is JointKind.PRISMATIC else J[3:]
        np.testing.assert_allclose(moved, joint.axis, rtol=1e-14, atol=1e-14, err_msg=repr(data))
    if joint.kind in (JointKind.REVOLUTE, JointKind.PRISMATIC):
        assert joint.limit is not None
        read = (model.lowerPositionLimit[0], model.upperPositionLimit[0])
        assert read == (joint.limit.lower, joint.limit.upper), data


@pytest.mark.long
def test_each_unusual_piece_is_read_equally_by_both_libraries_or_is_reported() -> None:
    for data in every_odd_piece():
        judged(data)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(4))
def test_combined_unusual_pieces_are_read_equally_by_both_libraries_or_are_reported(seed: int) -> None:
    choose = random.Random(seed)
    for _ in range(500):
        judged(some_odd_pieces(choose))
