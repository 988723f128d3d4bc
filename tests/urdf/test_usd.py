"""The conversion of USD stages to kinematic trees, and their comparison with other formats."""

import contextlib
import json
import math
import os
import re
import time
from collections.abc import Callable, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

pytest.importorskip("pxr")

import urdfkin
from tests import urdfs
from tests.cli.running import good, python, refused
from tests.cli.running import urdfkin as command
from tests.reading import present
from tests.urdfs import loaded
from urdfkin.comparison.certificate import certificate, recheck
from urdfkin.comparison.result import Sameness, SameQuestion, Verdict
from urdfkin.errors import InputError, OracleError, SourceError
from urdfkin.kinematics.rotation import (
    quaternion_of,
    rotation_about,
    rotation_from_quaternion,
    rotation_from_rpy,
)
from urdfkin.kinematics.roundings import SINGLE_ROUNDOFF
from urdfkin.model.conventions.convention import encode_usd_name
from urdfkin.model.tree import MAX_PLAUSIBLE_ANGLE, KinematicTree, pose
from urdfkin.report.diff import as_data, headline
from urdfkin.urdf import usd
from urdfkin.verify import usd_check

pytestmark = pytest.mark.slow

HEAD = '#usda 1.0\n(\n    defaultPrim = "arm"\n    metersPerUnit = {unit}\n    upAxis = "{up}"\n)\n'


def moved(*operations: tuple[str, str, object]) -> str:
    """Write the transform of a prim, with operations such as ("double3", "translate", (0, 0, 1))."""
    words = [f"{kind} xformOp:{name} = {value}\n" for kind, name, value in operations]
    order = ", ".join(f'"xformOp:{name}"' for _, name, _ in operations)
    return "".join([*words, f"uniform token[] xformOpOrder = [{order}]\n"])


def body(name: str, place: str = "", inside: str = "", schemas: str = "") -> str:
    """Write a rigid body at `place`, (x, y, z) in the unit of the stage."""
    head = f'def Xform "{name}" (prepend apiSchemas = ["PhysicsRigidBodyAPI"{schemas}])'
    placed = moved(("double3", "translate", place)) if place else ""
    return f"{head} {{\n{placed}{inside}\n}}\n"


def joint(
    name: str, kind: str, first: str, second: str, more: str = "", schemas: str = "", *,
    axis: str = "", limits: Sequence[object] = (), **frames: object,
) -> str:  # fmt: skip
    """Write a joint between two bodies of /arm; the name of the world is empty."""
    words = [f"rel physics:body{i} = </arm/{end}>" for i, end in enumerate((first, second)) if end]
    words += [f'uniform token physics:axis = "{axis}"'] if axis else []
    words += [f"{_TYPES[key[:-1]]} physics:{key} = {value}" for key, value in frames.items()]
    words += [f"float physics:{end}Limit = {x}" for end, x in zip(("lower", "upper"), limits, strict=False)]
    api = f" (prepend apiSchemas = [{schemas}])" if schemas else ""
    return f'def Physics{kind}Joint "{name}"{api} {{\n' + "\n".join([*words, more]) + "\n}\n"


_TYPES = {"localPos": "point3f", "localRot": "quatf"}
ROOT = ', "PhysicsArticulationRootAPI"'
BASE = body("base", schemas=ROOT)
#: The transform of the link `upper`.
UP = ("double3", "translate", "(0, 0, 1)")
#: An arm of two links: a revolute joint about z at (0, 0, 1), then a prismatic joint along y at (2, 0, 0).
LINKS = BASE + body("upper", "(0, 0, 1)") + body("lower", "(2, 0, 1)")
SHOULDER = joint("shoulder", "Revolute", "base", "upper", axis="Z", limits=(-90, 180), localPos0=(0, 0, 1))
RAIL = joint("rail", "Prismatic", "upper", "lower", axis="Y", limits=(-1, 3), localPos0=(2, 0, 0))
JOINTS = SHOULDER + RAIL
ARM = LINKS + JOINTS


def stage(content: str, unit: float = 1.0, up: str = "Z") -> str:
    return f'{HEAD.format(unit=unit, up=up)}def Xform "arm" {{\n{content}\n}}\n'


Write = Callable[..., Path]
Read = Callable[..., urdfkin.Robot]


@pytest.fixture
def read(write: Write) -> Read:
    """Load the robot of a stage whose prim /arm has this content."""
    return lambda content, **options: loaded(write(stage(content, **options)))


@pytest.fixture
def converted(write: Write) -> Read:
    """Load the stage of a robot, in which one joint has a mistake."""
    return lambda robot, *mistake, **options: loaded(write(as_usd(robot, *mistake)), **options)


def codes(robot: urdfkin.Robot) -> dict[str, str | None]:
    return {finding.code: finding.name for finding in robot.findings if finding.code.startswith("USD")}


def findings(robot: urdfkin.Robot) -> list[str]:
    """Return the findings about a stage: `USD304 /arm/upper: the message`."""
    found = [one for one in robot.findings if one.code.startswith("USD")]
    return [f"{' '.join(filter(None, (one.code, one.name)))}: {one.message}" for one in found]


def reach(robot: urdfkin.Robot) -> float:
    """Return the x coordinate of the link `lower` at q = 0."""
    return float(robot.placement([0.0, 0.0], "lower")[0, 3])


@pytest.mark.parametrize(
    ("scale", "unit", "message"),
    [
        ("1e200", 1.0, "/arm/base: the scale of a prim is too small or too large: found 1e.200"),
        ("1e-200", 1.0, "/arm/base: the scale of a prim is too small or too large: found 1e-200"),
        ("1e-6", 1.0, "/arm/base: OpenUSD's physics does not read a scale below 1e-05: found 1e-06"),
        ("1", 1e200, "metersPerUnit must be a positive number from 1e-30 to 1e.30: found 1e.200"),
    ],
)
def test_a_scale_beyond_the_range_of_openusd_is_refused_with_the_prim(
    scale: str, unit: float, message: str, write: Write
) -> None:
    text = stage(moved(("double3", "scale", f"({scale}, {scale}, {scale})")) + ARM, unit=unit)
    with pytest.raises(InputError, match=message):
        loaded(write(text))


def test_the_position_of_a_prim_beyond_the_range_of_doubles_is_refused(read: Read) -> None:
    with pytest.raises(InputError, match=r"/arm/lower: the position of a prim is too large: found 1e.300"):
        read(BASE + body("upper", "(0, 0, 1)") + body("lower", "(1e300, 0, 1)") + JOINTS)


def test_a_prismatic_joint_with_one_limit_keeps_this_limit_and_the_note_names_the_other(read: Read) -> None:
    rail = joint("rail", "Prismatic", "upper", "lower", axis="Y", limits=(-1, "inf"), localPos0=(2, 0, 0))
    robot = read(LINKS + SHOULDER + rail)
    limit = present(robot.tree.joints[1].limit)
    assert (limit.lower, limit.upper) == (-1.0, 1000.0)
    what = "a prismatic joint without an upper limit gets +1000 m, because URDF requires limits"
    assert findings(robot) == [f"USD102 /arm/rail: {what}"]


@pytest.mark.parametrize(
    ("given", "expected"),
    [((2000, "inf"), (2000.0, 3000.0)), (("-inf", -1000), (-2000.0, -1000.0))],
    ids=["lower", "upper"],
)
def test_a_limit_that_replaces_a_missing_limit_leaves_the_joint_a_range(
    read: Read, given: tuple[Any, Any], expected: tuple[float, float]
) -> None:
    rail = joint("rail", "Prismatic", "upper", "lower", axis="Y", limits=given, localPos0=(2, 0, 0))
    robot = read(LINKS + SHOULDER + rail)
    limit = present(robot.tree.joints[1].limit)
    assert (limit.lower, limit.upper) == expected
    assert f"gets {expected[given[0] == 2000]:+g} m" in findings(robot)[0]


def test_joints_move_as_usdphysics_defines_and_the_certificate_states_the_checks(read: Read) -> None:
    robot = read(ARM)
    assert (robot.name, robot.link_names) == ("arm", ("base", "upper", "lower"))
    T = robot.placement([math.pi / 2, 0.5], "lower")
    assert T[:3, 3] == pytest.approx([-0.5, 2.0, 1.0])
    assert T[:3, 0] == pytest.approx([0.0, 1.0, 0.0])
    assert codes(robot) == {}
    limit = present(robot.tree.joints[0].limit)
    assert (limit.lower, limit.upper) == pytest.approx((-math.pi / 2, math.pi))
    certificate = robot.certificate()
    assert certificate.verified
    assert re.search(
        r"OpenUSD [\d.]+: UsdPhysics and urdfkin read the same 2 joints \(.*\); "
        r"UsdGeom's transforms of 3 prims agree at q = 0",
        certificate.source_notes or "",
    )


def test_a_convention_in_file_order_has_the_joints_in_the_order_of_their_prims(read: Read) -> None:
    links = BASE + body("first", "(1, 0, 0)") + body("second", "(2, 0, 0)") + body("third", "(3, 0, 0)")
    ends = {"n": ("base", "second"), "b": ("second", "third"), "a": ("base", "first")}
    robot = read(links + "".join(joint(name, "Revolute", *two, axis="Z") for name, two in ends.items()))
    assert robot.convention("usd").joint_names == ("n", "b", "a")
    assert robot.convention("mujoco").joint_names == ("n", "b", "a")
    assert robot.joint_names == ("a", "n", "b")


@pytest.mark.parametrize("unit", [0.01, 0.0254])
def test_lengths_are_in_the_unit_of_the_stage(read: Read, unit: float) -> None:
    robot = read(ARM, unit=unit)
    assert reach(robot) == pytest.approx(2.0 * unit)
    assert present(robot.tree.joints[1].limit).upper == pytest.approx(3.0 * unit)


def test_a_stage_with_y_up_is_turned_so_that_z_is_up(read: Read) -> None:
    robot = read(ARM + joint("mount", "Fixed", "", "base"), up="Y")
    # The link `upper` is at z = 1 in the stage, which is y = -1 in a world with z up.
    assert robot.placement([0.0, 0.0], "upper")[:3, 3] == pytest.approx([0.0, -1.0, 0.0])
    assert robot.link_names[0] == "world"


def test_the_joint_frames_in_both_bodies_determine_the_joint(read: Read) -> None:
    turn = (0.70710677, 0, 0, 0.70710677)
    offset = joint(
        "j", "Revolute", "base", "tip", axis="X",
        localPos0=(1, 0, 0), localRot0=turn, localPos1=(0, 3, 0), localRot1=turn,
    )  # fmt: skip
    robot = read(BASE + body("tip", "(1, -3, 0)") + offset)
    assert robot.placement([0.0], "tip")[:3, 3] == pytest.approx([1.0, -3.0, 0.0])
    # The axis is parallel to the y axis of the base, through (1, 0, 0).
    turned = robot.placement([math.pi / 2], "tip")
    assert turned[:3, 3] == pytest.approx([1.0, -3.0, 0.0])
    assert turned[:3, 2] == pytest.approx([1.0, 0.0, 0.0])
    assert codes(robot) == {}


def test_a_joint_from_the_child_to_the_parent_has_the_opposite_axis(read: Read) -> None:
    reverse = joint("j", "Revolute", "tip", "base", axis="Z", localPos1=(1, 0, 0))
    robot = read(BASE + body("tip", "(1, 0, 0)") + reverse)
    assert robot.link_names[0] == "base"
    assert robot.tree.joints[0].kind.value == "continuous"
    T = robot.placement([math.pi / 2], "tip")
    assert T[:3, 3] == pytest.approx([1.0, 0.0, 0.0])
    assert T[:3, 0] == pytest.approx([0.0, -1.0, 0.0])


def test_nested_bodies_and_scaled_bodies_have_rigid_frames(read: Read) -> None:
    scaled = moved(("float3", "scale", (2, 2, 2))) + body("tip", "(1, 0, 0)")
    own = joint("j", "Revolute", "base", "base/tip", axis="Z", localPos0=(1, 0, 0))
    robot = read(body("base", inside=scaled, schemas=ROOT) + own)
    assert robot.placement([0.0], "tip")[:3, 3] == pytest.approx([2.0, 0.0, 0.0])
    assert codes(robot) == {}


def test_a_joint_to_a_prim_below_a_body_moves_the_body(read: Read) -> None:
    flange = f'def Xform "flange" {{\n{moved(("double3", "translate", (0, 0, 2)))}}}'
    own = joint("j", "Revolute", "base/flange", "tip", axis="Z")
    robot = read(body("base", inside=flange, schemas=ROOT) + body("tip", "(0, 0, 2)") + own)
    for name in ("tip", "flange"):
        assert robot.placement([0.0], name)[:3, 3] == pytest.approx([0.0, 0.0, 2.0])


def locks(directions: Sequence[str]) -> str:
    """Write limits that lock these directions of a D6 joint."""
    low, high = "float limit:{0}:physics:low = 1\n", "float limit:{0}:physics:high = -1\n"
    return "".join((low + high).format(name) for name in directions)


def limit_schemas(directions: Sequence[str]) -> str:
    return ", ".join(f'"PhysicsLimitAPI:{name}"' for name in directions)


def d6(free: str, more: str = "", applied: Sequence[str] = ()) -> str:
    """Write two bodies and a joint with these degrees of freedom between them."""
    shut = [name for name in ALL if name not in free.split()]
    own = joint("j", "", "base", "tip", locks(shut) + more, limit_schemas(applied or shut))
    return BASE + body("tip") + own


ALL = ("transX", "transY", "transZ", "rotX", "rotY", "rotZ")


@pytest.mark.parametrize(
    ("free", "kind"),
    [("", "fixed"), ("rotY", "continuous"), ("transZ", "prismatic"), ("transX transY rotZ", "planar")],
)
def test_the_free_directions_of_a_d6_joint_determine_its_kind(read: Read, free: str, kind: str) -> None:
    robot = read(d6(free))
    assert robot.tree.joints[0].kind.value == kind
    if free == "rotY":
        assert robot.placement([math.pi / 2], "tip")[:3, 0] == pytest.approx([0.0, 0.0, -1.0])


@pytest.mark.parametrize(("free", "factor"), [("rotY", math.pi / 180.0), ("transZ", 0.5)])
def test_a_d6_joint_has_the_limits_of_its_free_direction(read: Read, free: str, factor: float) -> None:
    ends = f"float limit:{free}:physics:low = -45\nfloat limit:{free}:physics:high = 90"
    limit = present(read(d6(free, ends, ALL), unit=0.5).tree.joints[0].limit)
    assert (limit.lower, limit.upper) == pytest.approx((-45 * factor, 90 * factor))


NEWTON = '"NewtonMimicAPI"'
PHYSX = '"PhysxMimicJointAPI:rotZ"'
FOLLOWS = "rel newton:mimicJoint = </arm/{}>\n"
GEARED = (
    "rel physxMimicJoint:{0}:referenceJoint = </arm/shoulder>\n"
    "float physxMimicJoint:{0}:gearing = {1}\nfloat physxMimicJoint:{0}:offset = {2}\n"
)


#: Applied schemas, the attributes of the joint, and the multiplier and offset of the rule.
#: The grippers of Robotiq and Isaac Sim have joints about z with the schema PhysxMimicJointAPI:rotX.
MIMICS = {
    "of Newton": (
        NEWTON, FOLLOWS.format("shoulder") + "float newton:mimicCoef0 = 30\nfloat newton:mimicCoef1 = -2",
        (-2.0, math.pi / 6),
    ),
    "of PhysX": (PHYSX, GEARED.format("rotZ", 2, -30), (-2.0, math.pi / 6)),
    "of PhysX, whose schema names another direction than the joint's axis": (
        '"PhysxMimicJointAPI:rotX", "PhysxJointAPI"', GEARED.format("rotX", -1, 0)
        + "float physxMimicJoint:rotX:naturalFrequency = 5000\nfloat physxMimicJoint:rotX:dampingRatio = 0",
        (1.0, 0.0),
    ),
}  # fmt: skip


@pytest.mark.parametrize(("schema", "words", "expected"), MIMICS.values(), ids=MIMICS)
def test_mimic_joints_follow_their_rule(read: Read, schema: str, words: str, expected: object) -> None:
    follower = joint("wrist", "Revolute", "upper", "hand", words, schema, axis="Z")
    links = BASE + body("upper", "(0, 0, 1)") + body("hand", "(0, 0, 1)")
    robot = read(links + SHOULDER + follower)
    rule = present(robot.tree.joints[1].mimic)
    assert (robot.nq, rule.mimicked_joint) == (1, "shoulder")
    assert (rule.multiplier, rule.offset) == pytest.approx(expected)
    # The stage shows the mimic joint at angle 0, which the rule with an offset does not allow.
    assert codes(robot) == ({"USD304": "/arm/hand"} if rule.offset else {})


def with_schemas(schemas: str, words: str = "") -> str:
    """Write the arm whose prismatic joint has applied schemas."""
    plain = 'def PhysicsPrismaticJoint "rail"'
    return ARM.replace(plain + " {", f"{plain} (prepend apiSchemas = [{schemas}]) {{\n{words}")


def test_a_mimic_rule_between_an_angle_and_a_length_is_not_scaled_and_is_reported(read: Read) -> None:
    robot = read(with_schemas(NEWTON, FOLLOWS.format("shoulder") + "float newton:mimicCoef1 = 0.5"))
    assert codes(robot) == {"USD203": "/arm/rail"}
    (mimic,) = [joint.mimic for joint in robot.tree.joints if joint.mimic]
    assert (mimic.mimicked_joint, mimic.multiplier) == ("shoulder", 0.5)


@pytest.mark.parametrize(
    ("kind", "words", "message"),
    [
        ("Prismatic", FOLLOWS.format("tool"), "this joint mimics itself"),
        ("Fixed", FOLLOWS.format("shoulder"), "a fixed joint cannot mimic another joint"),
        ("Prismatic", "", "the mimic rule of this joint names no mimicked joint"),
        ("Prismatic", FOLLOWS.format("none"), "this joint mimics /arm/none, which is not a joint with one"),
    ],
)
def test_a_useless_mimic_rule_is_reported_with_its_reason(
    read: Read, kind: str, words: str, message: str
) -> None:
    tool = joint("tool", kind, "lower", "tip", words, NEWTON)
    robot = read(ARM + body("tip", "(0, 0, 1)") + tool)
    assert [text for text in findings(robot) if message in text], findings(robot)


def test_value_clips_are_refused_before_their_files_are_read(write: Write) -> None:
    secret = write("#usda 1.0\nTOPSECRET", "secret.usda")
    clips = (
        f"\nclips = {{\ndictionary default = {{\nasset[] assetPaths = [@{secret}@]\n"
        f'asset manifestAssetPath = @{secret}@\nstring primPath = "/base"\n'
        "double2[] active = [(0, 0)]\ndouble2[] times = [(0, 0)]\n}\n}\n"
    )
    head = 'def Xform "upper" ('
    with pytest.raises(urdfkin.UrdfkinError, match="value clips") as caught:
        loaded(write(stage((ARM).replace(head, head + clips))))
    assert "TOPSECRET" not in str(caught.value)
    assert str(caught.value).endswith("; flatten the stage: usdcat --flatten")  # A copy does not help.


def test_the_joint_to_the_world_may_be_the_articulation_root_as_in_isaac_sim(read: Read) -> None:
    mount = joint("root_joint", "Fixed", "", "base", schemas='"PhysicsArticulationRootAPI"')
    robot = read(LINKS.replace(ROOT, "") + JOINTS + mount)
    assert robot.link_names[0] == "world"
    robot.placement([0.0, 0.0], "lower")
    assert "the same 3 joints" in str(robot.certificate().source_notes)


def test_two_trees_below_one_articulation_root_are_chosen_by_their_root_bodies(write: Write) -> None:
    root = 'def Xform "arm" (prepend apiSchemas = ["PhysicsArticulationRootAPI"]) {'
    other = body("other") + body("more", "(0, 1, 0)")
    other += joint("j", "Revolute", "other", "more", axis="Z", localPos0=(0, 1, 0))
    path = write(stage(LINKS.replace(ROOT, "") + JOINTS + other).replace('def Xform "arm" {', root))
    with pytest.raises(InputError, match=r"2 articulations.*/arm/base, /arm/other"):
        loaded(path)
    assert loaded(path, articulation="/arm/other").link_names == ("other", "more")
    assert loaded(path, articulation="/arm/base").nq == 2


def test_units_and_axes_that_a_stage_does_not_state_are_findings(write: Write) -> None:
    robot = loaded(write(f'#usda 1.0\ndef Xform "arm" {{\n{LINKS}{JOINTS}\n}}\n'))
    assert codes(robot) == {"USD301": None, "USD302": None}
    assert re.search("USD301: .*centimetre", str(findings(robot)))


def test_a_prim_with_another_pose_than_its_joints_give_is_reported(read: Read) -> None:
    robot = read((ARM).replace("localPos0 = (0, 0, 1)", "localPos0 = (0, 0, 1.001)"))
    (finding,) = findings(robot)
    assert re.match(r"USD304 /arm/upper: .*\b0\.001 m", finding)
    assert "differently" in str(robot.certificate().source_notes)


def renamed(text: str) -> str:
    """Rename the robot of a stage, and omit the head."""
    return text.replace("/arm", "/other").replace('"arm"', '"other"').partition(")\n")[2]


def test_several_articulations_need_a_choice(write: Write) -> None:
    text = stage(ARM)
    path = write(text + renamed(text))
    with pytest.raises(InputError, match=r"2 articulations.*/arm/base, /other/base"):
        loaded(path)
    assert loaded(path, articulation="/other/base").name == "other"
    with pytest.raises(InputError, match="/arm/base"):
        loaded(path, articulation="/arm/bas")


def test_the_articulation_of_all_prims_has_the_name_of_its_root_prim_or_of_the_file(write: Write) -> None:
    text = stage(ARM + joint("mount", "Fixed", "", "base") + body("stray"))
    robot = loaded(write(text), articulation="/")
    assert robot.name == "arm"
    assert codes(robot) == {"USD202": "/arm/stray"}
    two = loaded(write(text + renamed(text), "cell.usda"), articulation="/")
    assert (two.name, two.nq) == ("cell", 4)
    with pytest.raises(InputError, match="unknown articulation"):
        loaded(write(text), articulation="")


def test_robots_with_the_same_joint_names_may_be_shown_in_different_configurations(write: Write) -> None:
    text = stage(ARM + joint("mount", "Fixed", "", "base"))
    robot = loaded(write(text.replace("(2, 0, 1)", "(2, 0.75, 1)") + renamed(text)), articulation="/")
    assert set(robot.joint_names) == {"shoulder", "rail", "shoulder_", "rail_"}
    assert codes(robot) == {}
    robot.placement(robot.neutral(), "arm_lower")
    assert "with 1 joint not at zero" in str(robot.certificate().source_notes)


def variants() -> str:
    """Write the arm with two grippers: the prismatic joint is at x = 2 or at x = 5."""
    choices = "".join(
        f'"{name}" {{\nover "lower" {{\ndouble3 xformOp:translate = ({x}, 0, 1)\n}}\n'
        f'over "rail" {{\npoint3f physics:localPos0 = ({x}, 0, 0)\n}}\n}}\n'
        for name, x in (("short", 2), ("long", 5))
    )
    # The value of an attribute outside the variants would have priority.
    inner = LINKS.replace("translate = (2, 0, 1)", "translate")
    rail = JOINTS.replace("point3f physics:localPos0 = (2, 0, 0)\n", "")
    return HEAD.format(unit=1, up="Z") + (
        'def Xform "arm" (\nvariants = { string gripper = "short" }\nprepend variantSets = "gripper"\n) {\n'
        f'{inner}{rail}variantSet "gripper" = {{\n{choices}}}\n}}\n'
    )


def test_a_variant_is_selected(write: Write) -> None:
    path = write(variants())
    before = path.read_bytes()
    assert reach(loaded(path)) == pytest.approx(2.0)
    robot = loaded(path, variant={"gripper": "long"})
    assert reach(robot) == pytest.approx(5.0)
    assert codes(robot) == {}
    assert path.read_bytes() == before
    assert "--variant gripper=long" in robot.origin.command_line
    for wrong, named in (({"gripper": "lon"}, "long"), ({"griper": "long"}, "gripper")):
        with pytest.raises(InputError, match=named):
            loaded(path, variant=wrong)
    found = command("placement", str(path), "--variant", "gripper=long", "--q", "0 0", "--format", "json")
    assert found.code == 0, found.err
    assert "5.0" in found.text


def test_validate_locks_the_joints_of_a_variant_once(write: Write) -> None:
    words = ("validate", str(write(variants())), "--variant", "gripper=long", "--samples", "1")
    name = loaded(words[1]).joint_names[0]
    assert good(*words, "--lock", f"{name}=0").code == 0
    done = command(*words, "--lock", "nowhere=0")
    assert done.code == 2
    assert f"{words[1]}: bad input: lock: unknown coordinate 'nowhere'" in " ".join(done.text.split())


@pytest.mark.parametrize("option", [("--variant", "a=b"), ("--articulation", "a")])
def test_check_and_validate_refuse_an_option_of_usd_without_a_usd_file(
    write: Write, option: tuple[str, str]
) -> None:
    for name in ("check", "validate"):
        done = command(name, "ur5", *option)
        assert (done.code, f"{option[0]} does nothing without a USD file" in done.err) == (2, True)
    path = str(write(variants()))
    assert command("check", "ur5", path, "--variant", "gripper=long").code == 0


ARCS = ("references", "payload", "instanceable = true\n    references")
#: Unit and up axis in the head of a stage, and a head with this content only.
UNITS = '    metersPerUnit = 1\n    upAxis = "Z"\n'
PLAIN = f"#usda 1.0\n(\n{UNITS})\n"


def test_a_variant_inside_an_instance_is_selected(write: Write) -> None:
    write(variants(), "arm.usda")
    head = PLAIN.replace("\n)", '\n    defaultPrim = "outer"\n)')
    part = f'{head}def Xform "outer" {{\ndef "inner" (\n    {ARCS[2]} = '
    write(part + "@./arm.usda@</arm>\n) {\n}\n}\n", "nested.usda")
    path = write(f'{head}def "outer" (\n    {ARCS[2]} = @./nested.usda@\n) {{\n}}\n')
    for name, length in (("short", 2.0), ("long", 5.0)):
        robot = loaded(path, variant={"gripper": name})
        assert reach(robot) == pytest.approx(length)
        assert codes(robot) == {}


def binary(write: Write, suffix: str) -> Path:
    """Write the arm in USD's binary format, .usdc, or as a package, .usdz."""
    from pxr import Sdf, UsdUtils

    text = write(stage(ARM))
    path = text.with_suffix(suffix)
    if suffix == ".usdz":
        assert UsdUtils.CreateNewUsdzPackage(str(text), str(path))
    else:
        assert Sdf.Layer.FindOrOpen(str(text)).Export(str(path))
    return path


# -- findings ------------------------------------------------------------------------------------------------

GEAR = """def PhysxPhysicsGearJoint "gear" {
rel physics:body0 = </arm/upper>
rel physics:body1 = </arm/lower>
}
"""
CLOSING = joint("closing", "Revolute", "lower", "base", localPos1=(2, 0, 1))
OUTSIDE = "bool physics:excludeFromArticulation = true"
SPHERICAL = joint("ball", "Spherical", "base", "upper")
CROWD = 'def PointInstancer "crowd" {\nrel prototypes = </arm/crowd/one>\n%s}\n'
PROTOTYPE = joint("gear", "Revolute", "crowd/one/a", "crowd/one/b")
SLIDE = body("side") + joint("slide", "Prismatic", "base", "side", axis="Y", limits=(-1, 1))
IN_RADIANS = ARM.replace("= -90", "= -1.5708").replace("= 180", "= 3.14159")


def equality(coefficient: int) -> str:
    """Write the arm with a prismatic joint that has a mimic rule of Newton and an equality of MuJoCo."""
    words = FOLLOWS.format("slide") + f"float mjc:coef2 = {coefficient}"
    return with_schemas('"NewtonMimicAPI", "MjcEqualityJointAPI"', words) + SLIDE


RELATIONSHIPS = {
    "PhysxMimicJointAPI:rotX": "physxMimicJoint:rotX:referenceJoint", "NewtonMimicAPI": "newton:mimicJoint",
}  # fmt: skip
COUPLINGS = (
    '"MjcEqualityJointAPI"',
    '"PhysxTendonAxisAPI:t"',
    '"OtherMimicAPI"',
    '"OtherMimicAPI", "PhysxTendonAxisAPI:u"',
)
OVER = 'over "ghost" (prepend apiSchemas = ["PhysicsRigidBodyAPI"]) {\n}\n'
PLACE, SAMPLES = "translate = (0, 0, 1)", "translate.timeSamples = { 0: (0, 0, 5) }"

#: Content of /arm, and the findings: the code, the path of the prim and, in some cases, the message.
LISTED: dict[str, tuple[str, list[str]]] = {
    **{
        f"a relationship without {schema}": (
            with_schemas('"PhysicsDriveAPI:linear"', f"rel {name} = </arm/joints/shoulder>"),
            [f"USD203 /arm/rail: {name} has no effect, because {schema} is not applied"],
        )
        for schema, name in RELATIONSHIPS.items()
    },
    "limits that lock a joint, as in Robotiq's gripper": (
        ARM.replace("= -90", "= -0.001").replace("= 180", "= 0.001"), [],
    ),
    "a joint to a prim that a missing layer defines": (
        ARM + OVER + joint("j", "Fixed", "ghost", "lower"), ["USD201 /arm/j"],
    ),
    "a PointInstancer of bodies": (
        ARM + CROWD % f'def Xform "one" {{\n{body("a")}{body("b")}{PROTOTYPE}}}\n'
        + joint("lead", "Fixed", "upper", "crowd/one/a"),
        [
            "USD101 /arm/crowd: the prototypes of this PointInstancer have 2 bodies and 1 joints, "
            "which are not read",
            "USD201 /arm/lead: body1 of this joint names a prim that is a prototype of a PointInstancer: "
            "/arm/crowd/one/a",
        ],
    ),
    "a joint that closes a loop": (ARM + CLOSING, ["USD101 /arm/closing"]),
    "a joint outside the articulation": (
        ARM + CLOSING.replace("\n}", f"\n{OUTSIDE}\n}}"), ["USD101 /arm/closing"],
    ),
    "a distance joint": (
        ARM + joint("rope", "Distance", "upper", "lower"),
        ["USD101 /arm/rope: a tree cannot represent this DistanceJoint"],
    ),
    "a disabled joint": (
        ARM + joint("off", "Fixed", "upper", "lower", "bool physics:jointEnabled = false"),
        ["USD101 /arm/off"],
    ),
    "a lost target": (ARM + joint("lost", "Fixed", "upper", "nowhere"), ["USD201 /arm/lost"]),
    "a body without a joint": (ARM + body("stray"), ["USD202 /arm/stray"]),
    "a mimic rule without a mimicked joint": (with_schemas(NEWTON), ["USD203 /arm/rail"]),
    "a disabled mimic rule": (
        with_schemas(NEWTON, FOLLOWS.format("shoulder") + "bool newton:mimicEnabled = false"),
        ["USD101 /arm/rail: the mimic rule of this joint is disabled"],
    ),
    "limits in radians": (IN_RADIANS, ["USD303 /arm/shoulder"]),
    "a gear joint and a tendon": (
        ARM + GEAR + 'def MjcTendon "tendon" {\n}\n',
        [
            "USD101 /arm/gear: a tree cannot represent this PhysxPhysicsGearJoint",
            "USD101 /arm/tendon: a tree cannot represent this MjcTendon",
        ],
    ),
    **{
        f"a coupling by {schemas}": (
            with_schemas(schemas), ["USD101 /arm/rail: urdfkin does not read " + schemas.replace('"', "")],
        )
        for schemas in COUPLINGS
    },
    "an equality without more terms than the mimic rule": (equality(0), []),
    "an equality with more terms than the mimic rule": (equality(1), ["USD101 /arm/rail"]),
    "a joint with a schema that would be listed": (
        ARM + joint("weld", "Fixed", "lower", "base", OUTSIDE, '"MjcEqualityWeldAPI"'),
        ["USD101 /arm/weld: this FixedJoint is excluded from the articulation"],
    ),
    "a PointInstancer of a shape": (
        ARM + CROWD % 'def Cube "one" {\n}\n',
        ["USD102 /arm/crowd: kinematics does not use this PointInstancer"],
    ),
    **{  # Isaac Sim writes a path without a dot
        f"the missing layer {layer}": (ARM + f'def "x" (references = @{layer}@</a>) {{ }}', ["USD103"])
        for layer in ("./gone.usda", "configuration/gone.usda")
    },
    "time samples of a limit without a default value": (
        ARM.replace("physics:upperLimit = 3", "physics:upperLimit.timeSamples = { 0: 3 }"),
        ["USD104 /arm/rail", "USD102 /arm/rail"],
    ),
    "time samples of a translation without a default value": (
        ARM.replace(PLACE, SAMPLES),
        [
            "USD104 /arm/upper: xformOp:translate has time samples, but no default value, "
            "so urdfkin leaves it out", "USD304 /arm/upper",
        ],
    ),
    "time samples with a default value": (ARM.replace(PLACE, f"{PLACE}\ndouble3 xformOp:{SAMPLES}"), []),
    "time samples above the robot": (
        moved(UP).replace(PLACE, SAMPLES) + ARM, ["USD104 /arm"],
    ),
}  # fmt: skip


@pytest.mark.parametrize(("content", "expected"), LISTED.values(), ids=LISTED)
def test_unsupported_parts_are_reported_with_their_path(
    read: Read, content: str, expected: list[str]
) -> None:
    robot = read(content)
    for found, one in zip(findings(robot), expected, strict=True):
        assert one in (found, found.partition(":")[0])
    assert robot.nq == 2
    assert not {"ghost", "a", "b"} & set(robot.link_names)


def test_a_blocked_value_is_treated_as_missing(read: Read) -> None:
    blocked = joint(
        "shoulder", "Revolute", "base", "upper",
        "uniform token physics:axis = None\nbool physics:jointEnabled = None\n"
        "bool physics:excludeFromArticulation = None",
        localPos0=(0, 0, 1), localPos1=None, localRot1=None, limits=("None", "None"),
    )  # fmt: skip
    robot = read(BASE + body("upper", "(0, 0, 1)") + blocked)
    (made,) = robot.tree.joints
    assert made.kind.value == "continuous"
    assert made.axis == pytest.approx([1.0, 0.0, 0.0])
    assert findings(robot) == []


def test_a_spline_without_a_default_value_is_reported(write: Write) -> None:
    if not hasattr(usd.import_openusd().Usd.Attribute, "HasSpline"):
        pytest.skip("this OpenUSD has no splines")
    spline = "double xformOp:translateZ.spline = {\n1: 1; post held,\n}"
    text = stage(ARM).replace("double3 xformOp:translate = (0, 0, 1)", spline)
    robot = loaded(write(text.replace('["xformOp:translate"]', '["xformOp:translateZ"]', 1)))
    what = "xformOp:translateZ has a spline, but no default value, so urdfkin leaves it out"
    assert findings(robot)[0] == f"USD104 /arm/upper: {what}"


@pytest.mark.parametrize("arc", ARCS)
def test_other_layers_are_read_and_another_unit_or_up_axis_is_reported(write: Write, arc: str) -> None:
    write(stage(ARM, unit=0.01, up="Y"), "parts/arm.usda")
    text = f'{PLAIN}def Xform "mine" (\n    {arc} = @./parts/arm.usda@</arm>\n) {{\n%s\n}}\n'
    robot = loaded(write(text % ""))
    assert codes(robot) == {"USD301": "/mine", "USD302": "/mine"}
    words = "USD301 /mine: the layer parts/arm.usda has metersPerUnit 0.01, but the stage 1"
    assert any(one.startswith(words) for one in findings(robot))
    resolved = moved(
        ("double3", "rotateXYZ:unitsResolve", (90, 0, 0)),
        ("double3", "scale:unitsResolve", (0.01, 0.01, 0.01)),
    )
    robot = loaded(write(text % resolved))
    assert robot.link_names == ("base", "upper", "lower")
    assert codes(robot) == {}
    assert reach(robot) == pytest.approx(0.02)


def test_a_layer_of_shapes_with_another_unit_is_only_reported_as_unused(write: Write, read: Read) -> None:
    write(f'{HEAD.format(unit=0.01, up="Y")}def Cube "arm" {{\n}}\n', "parts/cube.usda")
    shape = 'def "shape" (references = @./parts/cube.usda@</arm>) {\n}\n'
    robot = read(LINKS.replace('def Xform "upper"', shape + 'def Xform "upper"') + JOINTS)
    assert codes(robot) == {"USD102": None}


def sublayered(text: str, layer: str) -> str:
    return text.replace("(\n", f"(\n    subLayers = [@./{layer}@]\n", 1)


def test_a_sublayer_with_another_unit_is_reported(write: Write) -> None:
    write(stage(JOINTS, unit=0.01), "joints.usda")
    assert codes(loaded(write(sublayered(stage(LINKS), "joints.usda")))) == {"USD301": "/arm"}


SCALED, TURNED = ("float3", "scale", (1, 2, 1)), ("float", "rotateZ", 45)


def test_a_sheared_frame_is_no_link(read: Read) -> None:
    frame = f'def Xform "skew" {{\n{moved(SCALED, TURNED)}}}\n'
    robot = read(body("base", inside=frame, schemas=ROOT) + LINKS.partition("}\n")[2] + JOINTS)
    assert robot.link_names == ("base", "upper", "lower")
    assert codes(robot) == {"USD102": "/arm/base/skew"}


# -- hostile files ---------------------------------------------------------------------------------------


SHEARED = moved(SCALED) + ARM.replace(moved(UP), moved(UP, TURNED))
BLOCKED = "float limit:rotY:physics:low = None\nfloat limit:rotY:physics:high = 90"

UNREADABLE = "OpenUSD does not accept this file"
REFUSED = {
    "a spherical joint": (
        stage(LINKS + SPHERICAL), r"joint /arm/ball: urdfkin does not support spherical joints",
    ),
    "a joint with two free rotations": (stage(d6("rotY rotZ")), r"degrees of freedom.*rotY, rotZ"),
    "a stage without joints": (stage(LINKS), "no joint between bodies"),
    "a blocked limit": (
        stage(d6("rotY", BLOCKED, ALL)), r"joint /arm/j: .* is None.*limit:rotY:physics:low = None",
    ),
    "a limit that is not a number": (
        stage(d6("rotY", BLOCKED.replace("None", "nan"), ALL)),
        r"joint /arm/j: a joint limit is not a number: found limit:rotY:physics:low = nan",
    ),
    "a value of another type than in the schema": (
        stage(ARM.replace("float physics:lowerLimit", "double physics:lowerLimit", 1)),
        r"physics:lowerLimit: the type of an attribute differs from its schema: found double; write float",
    ),
    "an up axis in lower case": (stage(ARM, up="y"), "upAxis must be Y or Z: found y"),
    "a sheared body": (stage(SHEARED), r"/arm/upper: .* has shear.*: found the scale 1, 2, 1 of /arm"),
    "a URDF": ("<robot/>", UNREADABLE),
    "a stage without its end": ("#usda 1.0\ndef Xform {", UNREADABLE),
    "a crate file without content": ("PXR-USDC", UNREADABLE),
}  # fmt: skip


@pytest.mark.parametrize(("text", "why"), REFUSED.values(), ids=REFUSED)
def test_a_file_that_is_no_stage_of_a_tree_is_refused_with_the_reason(
    write: Write, text: str, why: str
) -> None:
    with pytest.raises(InputError, match=why):
        loaded(write(text))


@pytest.mark.parametrize(
    ("reference", "why"),
    [
        ("../../secret.usda", "outside"), ("/etc/passwd.usda", "outside"),
        ("https://example.org/a.usda", "downloads nothing"), ("omniverse://host/a.usda", "downloads nothing"),
        ("./link.usda", "outside"), ("./.hidden/a.usda", "outside"), ("./notes.txt", "not USD"),
        ('`"./${X}.usda"`', "expression"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("arc", ["sublayer", "reference", "payload", "variant"])
def test_a_reference_outside_the_folder_is_refused(write: Write, reference: str, why: str, arc: str) -> None:
    path = write("", "robot/robot.usda")
    path.with_name("link.usda").symlink_to(write(stage(ARM), "secret.usda"))
    write("#usda 1.0\n", "robot/notes.txt")
    own = f"({'payload' if arc == 'payload' else 'references'} = @{reference}@</arm>)"
    text = {
        "sublayer": f"#usda 1.0\n(\n    subLayers = [@{reference}@]\n)\n",
        "variant": "#usda 1.0\n"
        'def "x" (\n variants = { string s = "a" }\n prepend variantSets = "s"\n) {\n'
        f'variantSet "s" = {{\n"a" {{ }}\n"b" {own} {{ }}\n}}\n}}\n',
    }.get(arc, f'#usda 1.0\ndef "x" {own} {{ }}\n')
    path.write_text(text)
    with pytest.raises(InputError, match=why):
        usd.find_layer_files(usd.import_openusd(), str(path))
    if arc == "reference":
        with pytest.raises(InputError, match=why):
            loaded(path)


#: Metadata and content of a layer that refers to another layer.
LOOPS = {
    "subLayers": ("    subLayers = [@./{}.usda@]\n", ""),
    "references": ("", 'def "x" (references = @./{}.usda@</x>) {{ }}\n'),
    "payload": ("", 'def "x" (payload = @./{}.usda@</x>) {{ }}\n'),
    "inherits": ("", 'def "x" (inherits = </y>) {{ }}\ndef "y" (inherits = </x>) {{ }}\n'),
}


@pytest.mark.parametrize("arc", LOOPS)
def test_layers_that_refer_to_each_other_in_a_cycle_are_a_finding(write: Write, arc: str) -> None:
    arm, files = stage(ARM).partition(")\n")[2], []
    for own, other in ("ab", "bc", "ca"):
        head, x = (part.format(other) for part in LOOPS[arc])
        files.append(write(f"#usda 1.0\n(\n{head}{UNITS})\n{arm}{x}", f"{own}.usda"))
    for file in files:
        robot = loaded(file)
        assert robot.nq == 2
        assert "USD103" in codes(robot)


def test_two_to_the_power_of_40_prims_are_an_error_in_limited_time(write: Write) -> None:
    # Each of 40 prims has two children that refer to the next prim.
    child = 'def "{}" (references = </p{}>) {{ }}\n'
    prims = "".join(
        f'def "p{k}" {{\n{child.format("a", k + 1)}{child.format("b", k + 1)}}}\n' for k in range(40)
    )
    path = write(stage(ARM) + prims)
    begin = time.monotonic()
    with pytest.raises(InputError, match=r"cannot read this stage.*(does not|did not finish|memory)"):
        usd_check.read_usd(path, timeout=4.0)
    assert time.monotonic() - begin < 30.0


@pytest.mark.parametrize("arc", ["references", "payload", "subLayers"])
def test_layers_of_hundreds_of_megabytes_are_refused_before_they_are_read(write: Write, arc: str) -> None:
    plain, prim = stage(ARM), f'def "x" ({arc} = @./large.usdc@</a>) {{ }}'
    path = write(sublayered(plain, "large.usdc") if arc == "subLayers" else plain + prim)
    with path.with_name("large.usdc").open("wb") as file:
        file.write(b"PXR-USDC")
        file.truncate(700_000_000)
    begin = time.monotonic()
    words = r"large\.usdc: the file is too large: found 700000000 bytes"
    with pytest.raises(SourceError, match=words):
        usd.find_layer_files(usd.import_openusd(), str(path))
    with pytest.raises(InputError, match=words):
        loaded(path)
    assert time.monotonic() - begin < 30.0


def test_the_total_size_of_all_layers_is_limited(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    filler = "#" + 400 * "x" + "\n"
    for k in range(5):
        write(f'#usda 1.0\ndef "a" {{ }}\n{filler}', f"part{k}.usda")
    refs = "".join(f'def "x{k}" (references = @./part{k}.usda@</a>) {{ }}\n' for k in range(5))
    path = write(stage(ARM + refs))
    own = path.stat().st_size
    monkeypatch.setattr(usd, "MAX_BYTES", own + 2000)
    with pytest.raises(SourceError, match=f"too large: found over {own + 2000} bytes"):
        usd.find_layer_files(usd.import_openusd(), str(path))
    monkeypatch.setattr(usd, "MAX_BYTES", own + 5000)
    assert len(usd.find_layer_files(usd.import_openusd(), str(path))) == 6


def test_hundreds_of_layers_are_read_but_not_thousands(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    refs = "".join(f'def "x{k}" (references = @./part{k}.usdc@</a>) {{ }}\n' for k in range(200))
    path = write(stage(ARM + refs))
    part = usd.import_openusd().Sdf.Layer.FindOrOpen(str(write('#usda 1.0\ndef "a" { }\n', "part.usda")))
    for k in range(200):  # the process may have 64 open files
        part.Export(str(path.with_name(f"part{k}.usdc")))
    assert loaded(path).nq == 2
    monkeypatch.setattr(usd, "_MAX_LAYERS", 100)
    with pytest.raises(InputError, match="too many layers: found over 100"):
        usd.find_layer_files(usd.import_openusd(), str(path))


def test_textures_and_other_assets_are_never_opened(write: Write, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.png")  # reading a pipe without a writer would never end
    shape = (
        'def Shader "s" {\nasset inputs:file = @./pipe.png@\nasset inputs:other = @/etc/passwd@\n'
        "asset[] inputs:more = [@./pipe.png@, @https://example.org/a.png@]\n}\n"
    )
    assert loaded(write(stage(ARM + shape))).nq == 2


@pytest.mark.parametrize("suffix", [".usdc", ".usdz"])
def test_a_truncated_binary_file_is_an_error_or_has_the_whole_robot(write: Write, suffix: str) -> None:
    file = binary(write, suffix)
    data, whole = file.read_bytes(), loaded(file)
    assert reach(whole) == pytest.approx(2.0)
    for share in (0.0, 0.01, 0.11, 0.22, 0.3, 0.33, 0.44, 0.56, 0.6, 0.67, 0.78, 0.9, 0.99):
        file.write_bytes(data[: int(share * len(data))])
        try:
            robot = loaded(file)
        except (InputError, SourceError):
            continue
        assert suffix == ".usdz", share
        assert robot.urdf == whole.urdf, share


DEEDS = {
    "write": "open(sys.argv[1], 'wb', buffering=0).write(b'x')",
    "start a process": "import subprocess; subprocess.run(['true'], check=True)",
    "fork": "os.fork()",
}


@pytest.mark.parametrize("deed", DEEDS)
def test_the_confined_process_cannot_write_files_or_start_processes(tmp_path: Path, deed: str) -> None:
    file = tmp_path / "made"
    words = (
        f"import os, sys; from urdfkin.verify import usd_process; usd_process.limit_process(5)\n{DEEDS[deed]}"
    )
    if os.geteuid() == 0 and deed != "write":
        pytest.skip("the kernel does not limit the processes of root")
    assert python(words, str(file), check=False, timeout=60).returncode != 0
    assert not file.exists() or file.stat().st_size == 0


def test_a_reference_to_the_current_folder_is_refused(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(write(stage(ARM), "elsewhere/configuration/arm.usda").parents[1])
    path = write(stage('def "x" (references = @configuration/arm.usda@) { }'), "robot/robot.usda")
    with pytest.raises(InputError, match="outside the folder"):
        loaded(path)


def test_a_pointer_of_git_lfs_is_refused_with_its_remedy(write: Write) -> None:
    pointer = write("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n", "base.usd")
    for path in (pointer, write(stage(LINKS + 'def "x" (references = @base.usd@) { }'))):
        with pytest.raises(InputError, match=r"base\.usd: this file is a pointer of Git LFS.*git lfs pull"):
            loaded(path)


def test_a_damaged_binary_file_never_ends_the_process_that_calls_load(write: Write) -> None:
    rng = np.random.default_rng(0)
    file = binary(write, ".usdc")
    whole = np.frombuffer(file.read_bytes(), np.uint8)
    for _ in range(12):
        damaged = whole.copy()
        damaged[rng.integers(0, len(whole), 20)] = rng.integers(0, 256, 20)
        file.write_bytes(damaged.tobytes())
        with contextlib.suppress(urdfkin.UrdfkinError):
            loaded(file, verify=False)


def test_a_layer_that_is_a_device_and_a_stage_that_does_not_exist_are_refused(write: Write) -> None:
    path = write(stage(ARM + 'def "x" (references = @./pipe.usda@</a>) { }'))
    os.mkfifo(path.with_name("pipe.usda"))
    with pytest.raises(InputError, match="not a regular file"):
        loaded(path)
    with pytest.raises(SourceError):
        loaded(path.with_name("none.usda"))


# -- errors of the reader ------------------------------------------------------------------------------------


def loaded_in_this_process(monkeypatch: pytest.MonkeyPatch, path: Path) -> urdfkin.Robot:
    from urdfkin.verify import usd_process

    def ask(_: list[str], request: bytes, *rest: Any) -> tuple[bytes, int]:
        return json.dumps(usd_process.read_stage(json.loads(request))).encode() + b"\n", 0

    monkeypatch.setattr(usd_check, "run_python", ask)
    return loaded(path)


@pytest.mark.parametrize("mistake", ["unit", "degrees", "swapped", "axis", "no limits"])
def test_the_comparison_with_openusds_parser_finds_an_error_of_the_reader(
    write: Write, monkeypatch: pytest.MonkeyPatch, mistake: str
) -> None:
    path = write(stage(ARM, unit=0.5))
    assert loaded_in_this_process(monkeypatch, path).nq == 2
    side, motion = usd._StageReader._read_joint_frame, usd._StageReader._read_motion

    def wrong_side(self: Any, prim: Any, i: int, target: str | None) -> Any:
        found = present(side(self, prim, 1 - i if mistake == "swapped" else i, target))
        T = found[1].copy()
        T[:3, 3] *= 2.0 if mistake == "unit" else 1.0
        return found[0], T, *found[2:]

    def wrong_motion(self: Any, prim: Any) -> Any:
        kind, axis, (lower, upper), free = motion(self, prim)
        factor = {"degrees": 180.0 / math.pi, "no limits": math.inf}.get(mistake, 1.0)
        return kind, axis, (lower * factor, upper * factor), "rotX" if mistake == "axis" else free

    monkeypatch.setattr(usd._StageReader, "_read_joint_frame", wrong_side)
    monkeypatch.setattr(usd._StageReader, "_read_motion", wrong_motion)
    with pytest.raises(OracleError, match="parser of UsdPhysics and urdfkin disagree about this joint"):
        loaded_in_this_process(monkeypatch, path)


# -- the same robot in several formats -----------------------------------------------------------------------


def as_usd(robot: urdfkin.Robot, mistake: str = "", where: str = "") -> str:
    """Write a robot of revolute, continuous, prismatic and fixed joints as a stage, as a converter would.

    The converter makes a mistake in one joint, `where`.
    """
    tree = robot.tree
    placements, prims = robot.placement(np.zeros(robot.nq), list(tree.links)), list[str]()
    for link, T in zip(tree.links, placements, strict=True):
        placed = moved(("double3", "translate", _point(T)), ("quatd", "orient", _quaternion(T)))
        prims.append(body(encode_usd_name(link), "", placed, ROOT * (link == tree.links[0])))
    joints = (_joint_in_usd(tree, k, mistake * (one.name == where)) for k, one in enumerate(tree.joints))
    return stage("".join([*prims, 'def Scope "joints" {\n', *joints, "}\n"]))


def _point(T: Any) -> tuple[float, ...]:
    return tuple(T[:3, 3].tolist())


def _quaternion(T: Any) -> tuple[float, ...]:
    """Return the quaternion of a pose, its scalar first."""
    return tuple(np.roll(quaternion_of(T[:3, :3]), 1).tolist())


def _joint_in_usd(tree: KinematicTree, k: int, mistake: str) -> str:
    one = tree.joints[k]
    R = _with_first_axis(-one.axis if mistake == "axis sign" else one.axis)
    A, B = one.T_parent_joint @ pose(R), pose(R)
    A[:3, 3] *= {"centimetres": [100.0] * 3, "mirrored frame": [1.0, -1.0, 1.0]}.get(mistake, [1.0] * 3)
    A = A @ _MOVED.get(mistake, np.eye(4))
    B = B @ _MOVED[mistake] if mistake == "other frames on the axis" else B
    frames: dict[str, Any] = {f"localPos{i}": _point(T) for i, T in enumerate((A, B))}
    frames |= {f"localRot{i}": _quaternion(T) for i, T in enumerate((A, B))}
    ends = [encode_usd_name(tree.links[one.parent]), encode_usd_name(tree.links[k + 1])]
    degrees = 180.0 / math.pi if one.kind.turns else 1.0
    rule = one.mimic if mistake != "mimic dropped" else None
    words, limits = "", list[float]()
    if rule is not None:
        multiplier = rule.multiplier * (1.000001 if mistake == "a millionth" else 1.0)
        words = FOLLOWS.format(f"joints/{encode_usd_name(rule.mimicked_joint)}")
        words += f"float newton:mimicCoef0 = {rule.offset * degrees}\nfloat newton:mimicCoef1 = {multiplier}"
    if one.limit is not None and one.kind.has_limits:
        limits = [x * (1.0 if mistake == "radians" else degrees) for x in (one.limit.lower, one.limit.upper)]
    name = {"fixed": "Fixed", "prismatic": "Prismatic"}.get(one.kind.value, "Revolute")
    first, second = ends[::-1] if mistake == "exchanged bodies" else ends
    schema = NEWTON if rule else ""
    return joint(encode_usd_name(one.name), name, first, second, words, schema, limits=limits, **frames)


_X = np.array([1.0, 0.0, 0.0])
#: Mistakes that change the joint frame in the parent body.
_MOVED = {
    "a micrometre": pose(p=(0.6e-6, 0.8e-6, 0.0)),
    "a microradian": pose(rotation_about(np.array([0.6, 0.8, 0.0]), 1e-6)),
    "another zero": pose(rotation_about(_X, 1e-6)),
    "other frames on the axis": pose(rotation_about(_X, 0.7), (0.25, 0.0, 0.0)),
}


def _with_first_axis(axis: Any) -> Any:
    """Return a rotation matrix whose first column is a unit vector."""
    y = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    y /= np.linalg.norm(y)
    return np.column_stack((axis, y, np.cross(axis, y)))


def in_both_orders(a: urdfkin.Robot, b: urdfkin.Robot) -> list[Sameness]:
    """Compare two robots, and then the second with the first."""
    return [urdfkin.same(*robots, bounds=False) for robots in ((a, b), (b, a))]


ROBOTS = [
    "panda", "ur5", "so101", "talos_left_arm", "ur10",
    "solo12", "finger_edu", "g1", "allegro_left_hand", "bolt",
]  # fmt: skip


@pytest.mark.parametrize("name", ROBOTS[:3])
def test_single_precision_explains_the_difference_from_the_urdf(converted: Read, name: str) -> None:
    robot = loaded(name)
    found = urdfkin.same(robot, converted(robot), boxes=0)
    assert found.single is not None
    assert found.up_to_single
    assert (found.unexplained, found.within_single) == ((), False)
    assert 0.0 < found.bound_as_written[0] <= found.single[0] < 5e-6
    assert found.holds(SameQuestion())
    assert found.holds(SameQuestion(strict=True)) is not bool(found.remarks)
    assert found.holds(SameQuestion(within=5e-6))
    assert not found.holds(SameQuestion(within=0.0))


def test_all_outputs_have_the_verdict_up_to_single_precision(write: Write, tmp_path: Path) -> None:
    robot = loaded("ur5")
    urdf, usda = write(robot.urdf, "ur5.urdf"), write(as_usd(robot))
    files = {option: tmp_path / f"file{option}" for option in ("--write-map", "--markdown", "--html")}
    words = [word for option, file in files.items() for word in (option, str(file))]
    done = good("same", str(urdf), str(usda), "--boxes", "0", *words)
    found = urdfkin.same(robot, loaded(usda), boxes=0)
    assert found.up_to_single
    assert found.up_to
    assert "SAME UP TO SINGLE PRECISION" in done.text
    changes = ", ".join(found.up_to)
    heading = f"argest distance over all configurations within limits, after changes of {changes}"
    for text in (" ".join(done.text.split()), files["--markdown"].read_text(), files["--html"].read_text()):
        assert heading in text
    assert re.search(r'^note = .*: same up to single precision"$', files["--write-map"].read_text(), re.M)
    assert str(found.convention().note).endswith(": same up to single precision")
    assert "same up to single precision>" in repr(found)
    assert "same up to single precision" in good("same", str(urdf), str(usda), str(usda), "--boxes", "0").text


def odd(kind: str, more: str) -> urdfkin.Robot:
    """Load a robot of two joints whose names are not valid names of prims."""
    return loaded(
        urdfs.robot(
            urdfs.joint("j.0", "revolute", "a", "b.0", axis="", more=urdfs.limit()),
            urdfs.joint("k.0", kind, "b.0", "c.0", 'xyz="1 0 0"', "0 1 0", more),
        )
    )


def test_a_joint_that_never_moves_is_matched_by_its_name_in_usd(converted: Read) -> None:
    named = odd("revolute", urdfs.limit())
    free = converted(named)
    assert "tn__k0_k3" in [one.name for one in free.tree.joints]
    for robot in (odd("revolute", urdfs.limit() + urdfs.mimic("j.0", 0)), odd("fixed", "")):
        as_named = urdfkin.same(robot, named, boxes=0)
        for a, b in ((robot, free), (free, robot)):
            found = urdfkin.same(a, b, boxes=0)
            assert [one.what for one in found.differences] == [one.what for one in as_named.differences]


#: A robot with a prismatic joint whose long range multiplies the rounding error of its rotation.
LONG_SLIDE = urdfs.robot(
    urdfs.joint("slide", "prismatic", "rail", "carriage", 'xyz="0 0 0.1" rpy="0.3 0.4 0.5"', "0.6 0.8 0",
                urdfs.limit(-1000, 1000)),
    urdfs.joint("elbow", "revolute", "carriage", "forearm", 'xyz="0.333 0 0" rpy="0.1 0.2 0.3"', "0 0.6 0.8",
                urdfs.limit()),
    urdfs.joint("wrist", "continuous", "forearm", "tip", 'xyz="0.25 0.1 0"'),
    name="arm",
)  # fmt: skip


def test_an_error_smaller_than_the_rounding_of_a_long_slide_is_found_at_its_joint(write: Write) -> None:
    robot = urdfkin.load(LONG_SLIDE)
    text = as_usd(robot)
    assert urdfkin.same(robot, loaded(write(text)), boxes=0).up_to_single
    assert "(0.333," in text
    stage_file = write(text.replace("(0.333,", "(0.33305,"))
    found = urdfkin.same(robot, loaded(stage_file), boxes=0)
    assert found.single is not None
    # The sum of all roundings does not exclude the error.
    assert 4e-5 < found.bound_as_written[0] < found.single[0]
    assert found.within_single
    assert not found.up_to_single
    assert not found.holds(SameQuestion())
    [one] = map(str, found.unexplained)
    assert one == "joint elbow: origin 50.01 µm off, rounding explains at most 14.9 nm"
    done = command("same", "-", str(stage_file), "--boxes", "0", stdin=LONG_SLIDE)
    assert done.code == 1, done.err
    assert "joint elbow" in " ".join(done.text.split())


@pytest.mark.parametrize("kind", ["a micrometre", "a microradian", "another zero"])
@pytest.mark.parametrize("name", ["slide", "elbow", "wrist"])
def test_rounding_does_not_explain_a_larger_error_of_a_joint(converted: Read, kind: str, name: str) -> None:
    if (kind, name) == ("another zero", "slide"):
        kind = "a microradian"
    robot = urdfkin.load(LONG_SLIDE)
    found = urdfkin.same(robot, converted(robot, kind, name), bounds=False)
    assert not found
    assert [one.place for one in found.unexplained] == [f"joint {name}"]


def test_a_joint_frame_at_another_point_of_the_axis_is_the_same_joint(converted: Read) -> None:
    robot = urdfkin.load(LONG_SLIDE)
    for name in ("slide", "elbow", "wrist"):
        other = converted(robot, "other frames on the axis", name)
        found = urdfkin.same(robot, other, boxes=0)
        assert found.up_to_single, found.unexplained
        assert not urdfkin.same(other, robot, bounds=False).unexplained


def test_rounding_does_not_explain_an_error_of_a_millionth_in_a_mimic_multiplier(converted: Read) -> None:
    robot = loaded("panda")
    name = next(one.name for one in robot.tree.joints if one.mimic is not None)
    found = urdfkin.same(robot, converted(robot, "a millionth", name), bounds=False)
    assert not found
    assert str(found.unexplained[0]).startswith(f"joint {name}: mimic multiplier 1.00000")


def test_rounding_does_not_explain_another_pose_of_the_robot_in_the_stage(write: Write) -> None:
    robot = urdfkin.load(LONG_SLIDE)
    mount = joint("mount", "Fixed", "", "rail", localPos0=(0, 0, 0.5))
    found = urdfkin.same(robot, loaded(write(as_usd(robot) + mount)), bounds=False)
    assert [str(one) for one in found.unexplained] == ["link rail: base at another place"]


def test_a_certificate_up_to_single_precision_is_rechecked(converted: Read) -> None:
    robots = urdfkin.load(LONG_SLIDE), converted(urdfkin.load(LONG_SLIDE))
    document = certificate(urdfkin.same(*robots, boxes=0))
    assert document["verdict"] == "same up to single precision"
    assert recheck(document, *robots) == []
    document["verdict"] = "same"
    assert recheck(document, *robots) == ["`verdict`: the models give same up to single precision, not same"]


MISTAKES = {
    "axis sign": "senses", "centimetres": "USD304", "radians": "USD303",
    "mimic dropped": "independent joint in B", "exchanged bodies": "USD304", "mirrored frame": "USD304",
}  # fmt: skip


def with_mimic(robot: urdfkin.Robot) -> urdfkin.Robot:
    """Return a robot that has a mimic rule; add a rule if there is none."""
    if any(one.mimic is not None for one in robot.tree.joints):
        return robot
    root = ElementTree.fromstring(robot.urdf)
    moving = [one for one in robot.tree.joints if one.kind.nq == 1]
    mimicked_joint, follower = next(
        two for two in combinations(moving, 2) if two[0].kind.turns == two[1].kind.turns
    )
    rule = {"joint": mimicked_joint.name, "multiplier": "-0.5", "offset": "0.1"}
    [element] = [one for one in root.iterfind("joint") if one.get("name") == follower.name]
    ElementTree.SubElement(element, "mimic", rule)
    return loaded(ElementTree.tostring(root, encoding="unicode"))


@pytest.mark.long
@pytest.mark.parametrize("name", ROBOTS)
def test_each_mistake_of_a_converter_is_detected_and_described(converted: Read, name: str) -> None:
    robot = loaded(name)
    for kind, word in MISTAKES.items():
        moving = [one for one in robot.tree.joints if one.kind.nq == 1]
        if kind == "mimic dropped":
            robot = with_mimic(robot)
            moving = [one for one in robot.tree.joints if one.mimic is not None]
        elif kind == "radians":
            moving = [one for one in moving if one.kind.value == "revolute"]
        elif kind == "mirrored frame":
            moving = [one for one in moving if abs(one.T_parent_joint[1, 3]) > 1e-3]
        elif kind in ("centimetres", "exchanged bodies"):
            moving = [one for one in moving if np.linalg.norm(one.T_parent_joint[:3, 3]) > 1e-3]
        assert moving, kind
        spoilt = moving[len(moving) // 2]
        wrong = converted(robot, kind, spoilt.name)
        found = urdfkin.same(robot, wrong, boxes=0)
        said = [*found.up_to, *codes(wrong)]
        said += [one.words for one in (*found.differences, *found.remarks)]
        # If the limits are too large for radians, only `same` reports the mistake.
        wide = kind == "radians" and spoilt.limit is not None and spoilt.limit.upper > MAX_PLAUSIBLE_ANGLE
        assert not found.up_to_single or kind == "radians", (kind, name)
        assert any((": limits " if wide else word) in one for one in said), (kind, name, said)
        if kind == "radians":
            assert any(one.what == "limits" for one in found.remarks)


def test_three_formats_are_compared_in_pairs(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("mujoco")
    robot = loaded("planar_two_link")
    write(robot.urdf, "arm.urdf")
    monkeypatch.chdir(write(as_usd(robot), "arm.usda").parent)
    elbow, tip = (robot.placement([0.0, 0.0], name)[:3, 3] for name in ("link_2", "tip"))
    inertia = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
    link = f'<body name="{{0}}" pos="{{1}}">{inertia}<joint name="joint_{{0[5]}}" axis="0 0 1"/>'
    write(
        '<mujoco><compiler angle="radian"/><worldbody>' + link.format("link_1", "0 0 0")
        + link.format("link_2", " ".join(map(repr, elbow.tolist())))
        + f'<site name="tip" pos="{" ".join(map(repr, (tip - elbow).tolist()))}"/>'
        "</body></body></worldbody></mujoco>", "arm.xml",
    )  # fmt: skip
    monkeypatch.setenv("COLUMNS", "200")  # a narrow terminal breaks rows into lines
    done = good("same arm.urdf arm.xml arm.usda --boxes 0")
    assert done.text.count("same up to single precision") == 2
    assert done.text.count("arm.urdf") == 2
    assert "more than two robots" in refused("same arm.urdf arm.xml arm.usda --map a=b")


def test_diff_with_a_stage_lists_a_mistake_at_its_joint_and_no_rounding(converted: Read) -> None:
    robot = urdfkin.load(LONG_SLIDE.replace("elbow", "elbow-1").replace("forearm", "forearm.1"))
    plain = urdfkin.diff(robot, converted(robot))
    assert (plain.changes, plain.total) == ((), None)
    assert plain.rounding is not None
    assert 0.0 < plain.rounding[0] < 1e-3
    unbounded = urdfkin.diff(robot, converted(robot), effects=False)
    assert headline(unbounded) == "nothing changed, apart from rounding to single precision"
    assert as_data(unbounded)["rounding"] == {"metres": None, "radians": None}
    found = urdfkin.diff(robot, converted(robot, "a micrometre", "elbow-1"))
    assert [str(one) for one in found.changes] == ["joint elbow-1: origin 0.997 µm off"]
    assert [one.element for one in found.effects] == ["joint elbow-1"]
    assert 0.9e-6 < found.effects[0].interval.lower < 1.3e-6
    assert found.rounding is None
    flipped = urdfkin.diff(robot, converted(robot, "axis sign", "elbow-1"))
    assert [str(one) for one in flipped.changes] == ["joint elbow-1: axis turned by 3.142 rad"]


def test_diff_compares_all_pairs_of_three_formats(write: Write) -> None:
    files = [
        write(LONG_SLIDE, "arm.urdf"),
        write(LONG_SLIDE.replace('"0.25 0.1 0"', '"0.26 0.1 0"'), "new.urdf"),
        write(as_usd(urdfkin.load(LONG_SLIDE))),
    ]
    words = ["diff", *map(str, files)]
    done = command(*words, "--format", "json")
    assert done.code == 1
    sizes = [[(one["what"], one["size"]) for one in pair["changes"]] for pair in done.data["pairs"]]
    assert sizes == [[("origin x", None)], [], [("origin", "10 mm off")]]
    assert [pair["rounding"] is not None for pair in done.data["pairs"]] == [False, True, False]
    table = command(*words, "--no-effects", "--format", "csv").text.splitlines()
    assert (table[0], len(table)) == ("A,B,element,what,old,new,alone", 3)
    markdown = command(*words, "--format", "markdown").text
    assert markdown.count("| joint wrist |") == 2
    assert "nothing changed, apart from rounding to single precision" in markdown
    assert command("diff", words[1], words[3]).code == 0


def test_check_prints_the_position_of_a_finding_in_all_formats(write: Write) -> None:
    path = write(stage(IN_RADIANS))
    done = command("check", str(path))
    assert done.code == 0
    lines = path.read_text().splitlines()
    number, line = next((i, line) for i, line in enumerate(lines, 1) if '"shoulder"' in line)
    assert f"robot.usda:{number}:1: USD303 warning: prim '/arm/shoulder'" in done.text
    assert f"{number} | {line}" in done.text
    [found] = json.loads(command("check", "--format", "json", str(path)).text)["findings"]
    place = found["element"], found["name"], found["line"], found["column"], found["width"]
    assert place == ("prim", "/arm/shoulder", number, 1, len('def PhysicsRevoluteJoint "shoulder"'))
    annotation = command("check", "--format", "github", str(path)).text
    assert f"robot.usda,line={number},col=1,endColumn=36,title=USD303::prim '/arm/shoulder'" in annotation
    assert command("check", "--strict", str(path)).code == 1
    assert command("check", "--strict", "--ignore", "USD303", str(path)).code == 0
    assert command("check", "--strict", "--select", "USD2", str(path)).code == 0
    run = json.loads(command("check", "--output-format", "sarif", str(path)).text)["runs"][0]
    result = run["results"][0]
    assert run["tool"]["driver"]["rules"][result["ruleIndex"]]["id"] == result["ruleId"] == "USD303"
    [location] = result["locations"]
    assert location["logicalLocations"] == [{"name": "/arm/shoulder", "kind": "prim"}]
    assert location["physicalLocation"]["region"] == {"startLine": number, "startColumn": 1, "endColumn": 36}
    done = command("check", str(write(stage(LINKS + SPHERICAL))))
    assert done.code == 2
    assert "spherical" in done.err


def test_a_finding_has_the_line_of_its_prim_between_comments_strings_and_metadata(write: Write) -> None:
    noise = (
        '# def Xform "stray"\n'
        'string a = "def Xform \\"stray\\" {"\nstring b = """\ndef Xform "stray" { " \n"""\n'
        'asset c = @def "stray" {.usda@\nstring[] d = ["}", "{"]\nstring e = \'{\'\n'
        "matrix4d f = ( (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1) )\n"
    )
    data = 'def Scope "notes" (\n customData = {\n string stray = "{"\n dictionary more = {\n}\n}\n) {\n%s}\n'
    text = stage(ARM + data % noise + 'def Scope "in" {\n' + body("stray") + "}\n")
    [finding] = [one for one in loaded(write(text)).findings if one.code == "USD202"]
    assert finding.name == "/arm/in/stray"
    lines = text.splitlines()
    assert lines[finding.line - 1].startswith('def Xform "stray" (prepend')
    assert (finding.column, finding.width) == (1, len('def Xform "stray"'))
    assert finding.line > lines.index('def Scope "in" {')
    write(text, "layer.usda")
    above = loaded(write(sublayered(PLAIN, "layer.usda"), "top.usda"))
    [finding] = [one for one in above.findings if one.code == "USD202"]
    assert (finding.name, finding.line, finding.width) == ("/arm/in/stray", 1, 0)


@pytest.mark.parametrize("up", ["Z", "Y"])
def test_the_newton_simulator_computes_the_same_placements(write: Write, up: str) -> None:
    sim = pytest.importorskip("newton")
    offset = joint(
        "wrist", "Revolute", "lower", "hand", axis="X", localPos0=(0.3, 0.1, -0.2),
        localRot0=(0.8, 0, 0.6, 0), localPos1=(0, 0.4, 0), localRot1=(0.6, 0.8, 0, 0),
    )  # fmt: skip
    mount = joint("mount", "Fixed", "", "base")
    path = write(stage(LINKS + body("hand") + JOINTS + offset + mount, up=up))
    robot = loaded(path)
    builder = sim.ModelBuilder()
    builder.add_usd(str(path))
    model = builder.finalize(device="cpu")
    state, names = model.state(), [label.split("/")[-1] for label in builder.joint_label]
    starts = model.joint_q_start.numpy()
    for q in robot.sample(5, seed=1):
        own = state.joint_q.numpy()
        for name, value in zip(robot.coordinate_names, q, strict=True):
            own[starts[names.index(name)]] = value
        state.joint_q.assign(own)
        sim.eval_fk(model, state.joint_q, state.joint_qd, state)
        for label, seven in zip(builder.body_label, state.body_q.numpy(), strict=True):
            T = robot.placement(q, str(label).rpartition("/")[2])
            assert seven[:3] == pytest.approx(T[:3, 3], abs=1e-5)
            x, y, z, w = seven[3:].astype(float) / np.linalg.norm(seven[3:])
            assert pose(rotation_from_quaternion([x, y, z, w]))[:3, :3] == pytest.approx(T[:3, :3], abs=1e-5)


def turn(name: str, first: str, second: str, place: Sequence[float], rotation: object = (1, 0, 0, 0)) -> str:
    """Write a joint about z with all attributes of its frames."""
    frames: dict[str, Any] = {"localPos0": tuple(place), "localPos1": (0, 0, 0), "localRot0": rotation}
    return joint(name, "Revolute", first, second, axis="Z", **frames, localRot1=(1, 0, 0, 0))


TURN = urdfs.joint("turn", "continuous", "base", "b", 'xyz="0 0 0.1"')
FAR_TURN = np.roll(quaternion_of(rotation_from_rpy([0.3, 0.4, 0.5])), 1)


def beside_a_far_link(error: float) -> tuple[str, str]:
    """Write a URDF whose elbow follows a link 1 km away, and a stage whose elbow does not."""
    mount = urdfs.joint("mount", "fixed", "b", "far", 'xyz="1000 0 0"')
    elbow = urdfs.joint("elbow", "continuous", "far", "tip", 'xyz="-999.7 0.1 0.2"')
    links = BASE + body("b") + body("far") + body("tip")
    joints = turn("turn", "base", "b", (0, 0, 0.1)) + turn("elbow", "b", "tip", (0.3 + error, 0.1, 0.2))
    far = joint("mount", "Fixed", "b", "far", localPos0=(1000, 0, 0))
    return urdfs.robot(TURN, mount, elbow), links + joints + far


def after_a_far_joint(error: float) -> tuple[str, str]:
    """Write a URDF and a stage; only the URDF has the link that carries the second joint."""
    urdf = urdfs.robot(
        urdfs.joint("first", "continuous", "base", "only", 'xyz="1000 0 0" rpy="0.3 0.4 0.5"'),
        urdfs.joint("glue", "fixed", "only", "b"),
        urdfs.joint("second", "continuous", "only", "tip", 'xyz="0.3 0.1 0.2"'),
    )
    joints = turn("first", "base", "b", (1000, 0, 0), tuple(FAR_TURN.tolist()))
    joints += turn("second", "b", "tip", (0.3 + error, 0.1, 0.2))
    return urdf, BASE + body("b") + body("tip") + joints


def unit_quaternion(noise: float) -> tuple[str, str]:
    """Write a URDF with a rotation by 1e-7 rad, and a stage with the identity instead."""
    urdf = urdfs.robot(urdfs.joint("turn", "continuous", "base", "tip", 'xyz="0 0 0.1" rpy="0 1e-7 0"'))
    joints = turn("turn", "base", "tip", (0, 0, 0.1), (1, 0, 0, noise))
    return urdf, BASE + body("tip") + joints


def far_tool(written: str) -> tuple[str, str]:
    """Write a URDF and a stage whose tool, 1 km away, is displaced by 20 micrometres."""
    place = moved((written, "translate", (1000, 2e-5, 0)))
    links = BASE + body("b", inside=f'def Xform "tool" {{ {place}}}')
    mount = urdfs.joint("mount", "fixed", "b", "tool", 'xyz="1000 0 0"')
    return urdfs.robot(TURN, mount), links + turn("turn", "base", "b", (0, 0, 0.1))


#: A URDF with the content of a stage, and whether single precision explains all differences.
ROUNDED = {
    "no error beside a far link": (beside_a_far_link(0.0), True),
    "the rounding of a far link and an error of 1e-6 of a joint beside it": (beside_a_far_link(1e-6), False),
    "the rounding of a far link and an error of 1e-4 of a joint beside it": (beside_a_far_link(1e-4), False),
    "no error after a far joint": (after_a_far_joint(0.0), True),
    "the rounding of a far joint and an error of the next": (after_a_far_joint(3e-5), False),
    "an angle and a quaternion of the identity": (unit_quaternion(0.0), False),
    "an angle and a quaternion of nearly the identity": (unit_quaternion(1e-17), False),
    "a translation in double precision": (far_tool("double3"), False),
    "a translation in single precision": (far_tool("float3"), True),
}


@pytest.mark.parametrize(("models", "explained"), ROUNDED.values(), ids=ROUNDED)
def test_only_the_rounding_of_a_number_explains_a_difference_in_either_order_of_the_models(
    read: Read, models: tuple[str, str], explained: bool
) -> None:
    found = in_both_orders(loaded(models[0]), read(models[1]))
    assert [one.up_to_single for one in found] == [explained] * 2


def with_a_link_between(x: float, *, in_the_stage: bool) -> tuple[str, str]:
    """Write a URDF and a stage with two joints; one of the files has a link of its own between the joints.

    `x` is a number of the second joint: 0.25 is exact in single precision, and 0.1 is rounded. The common
    link `b` has the pose of the link between the joints.
    """
    mount = urdfs.joint("mount", "fixed", "between", "b")
    other = joint("mount", "Fixed", "between", "b", localPos0=(0, 0, 0))
    ours, theirs = ("b", "between") if in_the_stage else ("between", "b")
    urdf = urdfs.robot(
        urdfs.joint("first", "continuous", "base", ours, 'xyz="0 0 0.5"'),
        urdfs.joint("second", "continuous", ours, "tip", f'xyz="{x} 0 0.5"'),
        "" if in_the_stage else mount,
    )
    links = BASE + body("b") + body("tip") + (body("between") + other if in_the_stage else "")
    joints = turn("first", "base", theirs, (0, 0, 0.5)) + turn("second", theirs, "tip", (x, 0, 0.5))
    return urdf, links + joints


def test_two_joints_of_a_stage_without_a_common_link_between_them_may_not_be_rounded(read: Read) -> None:
    urdf, content = with_a_link_between(0.25, in_the_stage=True)
    for found in in_both_orders(loaded(urdf), read(content)):
        assert found.verdict is Verdict.SAME
        assert not found.unexplained
    urdf, content = with_a_link_between(0.1, in_the_stage=True)
    why = "the joints between this link and the nearest common link cannot be compared"
    for found in in_both_orders(loaded(urdf), read(content)):
        assert found.verdict is Verdict.DIFFERS
        assert [(one.place, one.what) for one in found.differences] == [("joint second", "axis")]
        assert [str(one) for one in found.unexplained] == [f"link tip: {why}"]
    # If only the URDF has a link between the joints, the common link `b` is between the joints of the stage.
    urdf, content = with_a_link_between(0.1, in_the_stage=False)
    for found in in_both_orders(loaded(urdf), read(content)):
        assert found.up_to_single, found.unexplained


@pytest.mark.parametrize("names", [("hand", "camera"), ("hand.0", "camera.0")])
@pytest.mark.parametrize("x", [0.25, 0.1])
def test_a_joint_that_moves_no_common_link_is_a_difference_with_and_without_rounding(
    read: Read, x: float, names: tuple[str, str]
) -> None:
    hand, camera = map(encode_usd_name, names)
    urdf = urdfs.robot(
        urdfs.joint("first", "continuous", "base", "b", 'xyz="0 0 0.5"'),
        urdfs.joint("second", "continuous", "b", names[0], f'xyz="{x} 0 0.5"'),
        urdfs.joint("mount", "fixed", "base", names[1], 'xyz="1 0 0"'),
    )

    def content(moved: str, fixed: str) -> str:
        joints = turn("first", "base", "b", (0, 0, 0.5)) + turn("second", "b", moved, (x, 0, 0.5))
        mount = joint("mount", "Fixed", "base", fixed, localPos0=(1, 0, 0))
        return BASE + body("b") + body(hand) + body(camera) + joints + mount

    for found in in_both_orders(loaded(urdf), read(content(hand, camera))):
        assert found.verdict is (Verdict.SAME if x == 0.25 else Verdict.UP_TO_SINGLE)
    for found in in_both_orders(loaded(urdf), read(content(camera, hand))):
        assert found.verdict is Verdict.DIFFERS
        assert {one.what for one in found.differences} >= {"carried by"}
        assert [str(one) for one in found.unexplained] == [
            "joint second: no link after this joint has a matching link in the other model"
        ]


@pytest.mark.parametrize("lock", [{"slide": 0.3}, {"elbow": 0.7}, {"slide": -0.2, "wrist": 1.1}])
def test_the_bounds_on_single_precision_are_those_of_the_locked_joints(
    converted: Read, lock: dict[str, float]
) -> None:
    free = converted(urdfkin.load(LONG_SLIDE))
    at_load, later = converted(urdfkin.load(LONG_SLIDE), lock=lock), free.with_locked_joints(lock)
    assert free.single is not None
    assert at_load.single is not None
    assert later.single is not None
    np.testing.assert_array_equal(later.single.links, at_load.single.links)
    np.testing.assert_array_equal(later.single.joints, at_load.single.joints)
    assert (later.single.joints != free.single.joints).any()


@pytest.mark.parametrize("lock", [{"slide": 0.3}, {"elbow": 0.7}, {"slide": -0.2, "wrist": 1.1}])
def test_locked_joints_may_differ_only_by_rounding(converted: Read, lock: dict[str, float]) -> None:
    text = LONG_SLIDE.replace("1000", "1")
    robot, free = urdfkin.load(text, lock=lock), urdfkin.load(text)
    rounded = converted(free, lock=lock)
    for found in in_both_orders(robot, rounded):
        assert found.up_to_single, found.unexplained
    for name in ("slide", "elbow", "wrist"):
        found = urdfkin.same(robot, converted(free, "a micrometre", name, lock=lock), bounds=False)
        assert not found.up_to_single
        assert found.unexplained


def free_base(kind: str, height: float) -> tuple[str, str]:
    """Write a robot with a free base as a URDF and as a stage; `height` is that of the free joint."""
    urdf = urdfs.robot(
        urdfs.joint("free", kind, "world", "base", f'xyz="0 0 {height}"', ""),
        urdfs.joint("j", "continuous", "base", "tip", 'xyz="0.1 0.2 0.3"'),
        name="arm",
    )
    shut = ("transZ", "rotX", "rotY") if kind == "planar" else ()
    free = joint("free", "", "", "base", locks(shut), limit_schemas(shut), localPos0=(0, 0, height))
    hinge = turn("j", "base", "tip", (0.1, 0.2, 0.3))
    return urdf, stage(BASE + body("tip") + hinge + free)


@pytest.mark.parametrize(("kind", "height"), [("floating", 0.0), ("planar", 0.5)])
def test_only_the_joints_after_a_free_base_may_be_rounded(write: Write, kind: str, height: float) -> None:
    urdf, text = free_base(kind, height)
    for found in in_both_orders(loaded(urdf), loaded(write(text))):
        assert found.up_to_single, found.unexplained
    wrong_hinge = text.replace("(0.1, 0.2, 0.3)", "(0.100001, 0.2, 0.3)")
    found = urdfkin.same(loaded(urdf), loaded(write(wrong_hinge)), bounds=False)
    assert [one.place for one in found.unexplained] == ["joint j"]
    if kind == "planar":  # 0.1 in single precision is 1.5e-9 from 0.1
        urdf, text = free_base(kind, 0.1)
        found = urdfkin.same(loaded(urdf), loaded(write(text)), bounds=False)
        why = "the planar or floating joint that carries this link has different frames in A and B"
        assert [str(one) for one in found.unexplained] == [f"link base: {why}"]


@pytest.mark.parametrize("name", ["panda", "so101", "allegro_left_hand"])
def test_two_rounded_stages_are_the_same_up_to_the_roundings_of_both(converted: Read, name: str) -> None:
    first = converted(loaded(name))
    moving = [one.name for one in first.tree.joints if one.kind.nq == 1]
    where = moving[len(moving) // 2]
    second = converted(first, "other frames on the axis", where)
    for found in in_both_orders(first, second):
        assert found.up_to_single, found.unexplained
        assert found.single is not None
        alone = [one.single.links.max(axis=0) for one in (first, second) if one.single is not None]
        assert max(alone[0][0], alone[1][0]) < found.single[0] <= (alone[0][0] + alone[1][0]) * 1.0001
    for found in in_both_orders(first, converted(first, "a micrometre", where)):
        assert [one.place for one in found.unexplained] == [f"joint {where}"]


def _angle_between(T: Any, U: Any) -> float:
    return float(np.linalg.norm((T - U)[:3, :3])) / math.sqrt(2.0)  # 2 sin(angle / 2), for a small angle


def test_the_bound_of_a_prims_rotation_holds_for_random_transforms_in_single_precision() -> None:
    pxr, rng = usd.import_openusd(), np.random.default_rng(3)
    made, gf = pxr.Usd.Stage.CreateInMemory(), pxr.Gf
    reader = usd._StageReader(pxr, made, "", frozenset())
    reader._cache = pxr.UsdGeom.XformCache(pxr.Usd.TimeCode.Default())

    def placed(op: str, value: Any, precision: str, k: int) -> Any:
        prim = pxr.UsdGeom.Xform.Define(made, f"/{op}{k}{precision}")
        how = [] if op == "Transform" else [getattr(pxr.UsdGeom.XformOp, f"Precision{precision}")]
        getattr(prim, f"Add{op}Op")(*how).Set(value)
        return reader._world_pose(prim.GetPrim())[0]

    orders = ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX")
    worst = dict.fromkeys(("Rotate", "Orient", "Transform"), 0.0)
    for k in range(400):
        degrees = (
            rng.uniform(-360.0, 360.0, 3) if k % 2 else rng.choice([-1.0, 1.0], 3) * (360 - rng.random(3))
        )
        xyzw = rng.normal(size=4)
        xyzw /= np.linalg.norm(xyzw)
        w, v = float(xyzw[3]), xyzw[:3].tolist()
        matrix = pose(rotation_from_quaternion(xyzw)).T
        for op, exact, rounded in (
            (f"Rotate{orders[k % 6]}", gf.Vec3d(*degrees), gf.Vec3f(*degrees)),
            (f"Rotate{'XYZ'[k % 3]}", float(degrees[0]), float(np.float32(degrees[0]))),
            ("Orient", gf.Quatd(w, *v), gf.Quatf(w, *v)),
            ("Transform", gf.Matrix4d(matrix), gf.Matrix4d(matrix.astype(np.float32).astype(np.float64))),
        ):
            angle = _angle_between(placed(op, exact, "Double", k), placed(op, rounded, "Float", k))
            kind = op.rstrip("XYZ")
            worst[kind] = max(worst[kind], angle / SINGLE_ROUNDOFF)
    # The error of an angle above 256 degrees is at most 2^-16 degrees; the errors of several angles add.
    assert 5.0 < worst["Rotate"] <= usd_check._TRANSFORM_ROUNDINGS
    assert 1.0 < worst["Orient"] <= 4.0
    assert 0.5 < worst["Transform"] <= math.sqrt(1.5)


def test_a_difference_that_only_the_second_order_of_the_models_shows_has_the_names_of_a(read: Read) -> None:
    """`camera.0` is attached to `base` in the URDF, and to `x` in the stage.

    In the stage, the position of the camera relative to `x` does not contain the rounding errors of `x`.
    """
    rpy, offset = (0.3, 0.4, 0.5), np.array([0.5, 0.5, 0.5])
    camera = np.array([0.1, 0.2, 0.3]) + rotation_from_rpy(rpy) @ offset
    xyz, turned = " ".join(map(repr, camera.tolist())), 'rpy="0.3 0.4 0.5"'
    urdf = urdfs.robot(
        urdfs.joint("before_x", "fixed", "base", "x", f'xyz="0.1 0.2 0.3" {turned}'),
        urdfs.joint("before_camera", "fixed", "base", "camera.0", f'xyz="{xyz}" {turned}'),
        urdfs.joint("turn", "continuous", "base", "tip", 'xyz="0 0 0.5"'),
    )
    *vector, w = quaternion_of(rotation_from_rpy(rpy)).tolist()
    in_the_stage = encode_usd_name("camera.0")
    joints = (
        turn("turn", "base", "tip", (0, 0, 0.5))
        + joint("before_x", "Fixed", "base", "x", localPos0=(0.1, 0.2, 0.3), localRot0=(w, *vector))
        + joint("before_m", "Fixed", "x", "m", localPos0=(0.5 + 2.0**-24, 0.5, 0.5))
        + joint("before_camera", "Fixed", "m", in_the_stage)
    )
    links = "".join(map(body, ("x", "m", in_the_stage, "tip")))
    robots = loaded(urdf), read(BASE + links + joints)
    for found, name in zip(in_both_orders(*robots), ("camera.0", in_the_stage), strict=True):
        assert [(one.place, one.what) for one in found.unexplained] == [(f"link {name}", "origin")]
    for old, new, name in ((*robots, "camera.0"), (*robots[::-1], in_the_stage)):
        assert f"link {name}" in [change.element for change in urdfkin.diff(old, new).changes]
