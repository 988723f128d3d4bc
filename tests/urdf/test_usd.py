"""USD stages become the robots that UsdPhysics describes, and what a tree cannot hold is listed."""

import contextlib
import json
import math
import os
import re
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pxr")

import urdfkin
from tests.cli.running import urdfkin as command
from urdfkin.comparison.certificate import certificate, recheck
from urdfkin.comparison.result import Question
from urdfkin.errors import InputError, OracleError, SourceError
from urdfkin.kinematics.rotation import quaternion_of, rotation_about, rotation_from_rpy, rotation_of
from urdfkin.model.conventions.convention import transcoded
from urdfkin.model.tree import LARGEST_ANGLE, Joint, KinematicTree, pose
from urdfkin.report.diff import as_data, headline
from urdfkin.urdf import usd
from urdfkin.verify import usd_check

HEAD = '#usda 1.0\n(\n    defaultPrim = "arm"\n    metersPerUnit = {unit}\n    upAxis = "{up}"\n)\n'


def body(name: str, place: str = "", inside: str = "", schemas: str = "") -> str:
    """Write a rigid body; `place` is (x, y, z), in stage units."""
    ops = (
        f'double3 xformOp:translate = {place}\nuniform token[] xformOpOrder = ["xformOp:translate"]'
        if place
        else ""
    )
    head = f'def Xform "{name}" (prepend apiSchemas = ["PhysicsRigidBodyAPI"{schemas}])'
    return f"{head} {{\n{ops}\n{inside}\n}}\n"


def joint(name: str, kind: str, first: str, second: str, more: str = "", schemas: str = "") -> str:
    """Write a joint between two bodies of /arm; an empty name is the world."""
    ends = "".join(f"rel physics:body{i} = </arm/{end}>\n" for i, end in enumerate((first, second)) if end)
    api = f" (prepend apiSchemas = [{schemas}])" if schemas else ""
    return f'def Physics{kind}Joint "{name}"{api} {{\n{ends}{more}\n}}\n'


ROOT = ', "PhysicsArticulationRootAPI"'
#: An arm of two links: a turn about z at (0, 0, 1), then a slide along y from (2, 0, 0).
LINKS = body("base", schemas=ROOT) + body("upper", "(0, 0, 1)") + body("lower", "(2, 0, 1)")
JOINTS = joint(
    "shoulder", "Revolute", "base", "upper",
    'uniform token physics:axis = "Z"\npoint3f physics:localPos0 = (0, 0, 1)\n'
    "float physics:lowerLimit = -90\nfloat physics:upperLimit = 180",
) + joint(
    "rail", "Prismatic", "upper", "lower",
    'uniform token physics:axis = "Y"\npoint3f physics:localPos0 = (2, 0, 0)\n'
    "float physics:lowerLimit = -1\nfloat physics:upperLimit = 3",
)  # fmt: skip


def stage(content: str, unit: float = 1.0, up: str = "Z") -> str:
    return f'{HEAD.format(unit=unit, up=up)}def Xform "arm" {{\n{content}\n}}\n'


Write = Callable[..., Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def of(text: str, name: str = "robot.usda") -> Path:
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        return path

    return of


def loaded(path: Path | str, **options: Any) -> urdfkin.Robot:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", urdfkin.UrdfWarning)
        return urdfkin.load(path, **options)


def codes(robot: urdfkin.Robot) -> dict[str, str | None]:
    return {finding.code: finding.name for finding in robot.findings if finding.code.startswith("USD")}


def of_urdf(T: Any) -> Any:
    return pytest.approx(T, abs=1e-6)


def test_joints_move_as_usdphysics_defines_them(write: Write) -> None:
    robot = loaded(write(stage(LINKS + JOINTS)))
    assert robot.name == "arm"
    assert robot.link_names == ("base", "upper", "lower")
    T = robot.placement([math.pi / 2, 0.5], "lower")
    assert T[:3, 3] == pytest.approx([-0.5, 2.0, 1.0])
    assert T[:3, 0] == pytest.approx([0.0, 1.0, 0.0])
    assert codes(robot) == {}


def test_the_certificate_states_what_openusd_confirms(write: Write) -> None:
    robot = loaded(write(stage(LINKS + JOINTS)))
    robot.placement([0.1, 0.2], "lower")
    certificate = robot.certificate()
    assert certificate.verified
    assert re.search(
        r"OpenUSD [\d.]+: its UsdPhysics parser reads the same 2 joints \(.*\); "
        r"UsdGeom's transforms of 3 prims agree at q = 0",
        certificate.reading or "",
    )


def test_limits_are_degrees_and_a_joint_without_limits_is_continuous(write: Write) -> None:
    free = joint("shoulder", "Revolute", "base", "upper", 'uniform token physics:axis = "Z"')
    robot = loaded(write(stage(LINKS + JOINTS)))
    limit = robot.tree.joints[0].limit
    assert limit is not None
    assert (limit.lower, limit.upper) == pytest.approx((-math.pi / 2, math.pi))
    robot = loaded(write(stage(body("base") + body("upper") + free)))
    assert robot.tree.joints[0].kind.value == "continuous"


@pytest.mark.parametrize(("unit", "length"), [(1.0, 2.0), (0.01, 0.02), (0.0254, 0.0508)])
def test_lengths_are_in_the_stages_unit(write: Write, unit: float, length: float) -> None:
    robot = loaded(write(stage(LINKS + JOINTS, unit=unit)))
    assert robot.placement([0.0, 0.0], "lower")[0, 3] == pytest.approx(length)
    limit = robot.tree.joints[1].limit
    assert limit is not None
    assert limit.upper == pytest.approx(3.0 * unit)


def test_a_stage_with_y_up_is_turned_so_that_z_is_up(write: Write) -> None:
    fixed = joint("mount", "Fixed", "", "base")
    robot = loaded(write(stage(LINKS + JOINTS + fixed, up="Y")))
    # upper is at z = 1 of the stage, which is y = -1 of a world with z up
    assert robot.placement([0.0, 0.0], "upper")[:3, 3] == pytest.approx([0.0, -1.0, 0.0])
    assert robot.link_names[0] == "world"


def test_a_joint_frame_counts_on_both_sides(write: Write) -> None:
    offset = joint(
        "j", "Revolute", "base", "tip",
        'uniform token physics:axis = "X"\npoint3f physics:localPos0 = (1, 0, 0)\n'
        "quatf physics:localRot0 = (0.70710677, 0, 0, 0.70710677)\n"
        "point3f physics:localPos1 = (0, 3, 0)\nquatf physics:localRot1 = (0.70710677, 0, 0, 0.70710677)",
    )  # fmt: skip
    robot = loaded(write(stage(body("base", schemas=ROOT) + body("tip", "(1, -3, 0)") + offset)))
    assert robot.placement([0.0], "tip")[:3, 3] == pytest.approx([1.0, -3.0, 0.0])
    # the axis is the y axis of the base through (1, 0, 0)
    turned = robot.placement([math.pi / 2], "tip")
    assert turned[:3, 3] == pytest.approx([1.0, -3.0, 0.0])
    assert turned[:3, 2] == pytest.approx([1.0, 0.0, 0.0])
    assert codes(robot) == {}


def test_a_joint_that_is_written_from_the_child_to_the_parent_moves_the_other_way(write: Write) -> None:
    reverse = joint(
        "j", "Revolute", "tip", "base",
        'uniform token physics:axis = "Z"\npoint3f physics:localPos1 = (1, 0, 0)',
    )  # fmt: skip
    robot = loaded(write(stage(body("base", schemas=ROOT) + body("tip", "(1, 0, 0)") + reverse)))
    assert robot.link_names[0] == "base"
    T = robot.placement([math.pi / 2], "tip")
    assert T[:3, 3] == pytest.approx([1.0, 0.0, 0.0])
    assert T[:3, 0] == pytest.approx([0.0, -1.0, 0.0])


def test_nested_bodies_and_scaled_bodies_have_rigid_frames(write: Write) -> None:
    inner = body("tip", "(1, 0, 0)")
    scaled = (
        'def Xform "base" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsArticulationRootAPI"]) {\n'
        "float3 xformOp:scale = (2, 2, 2)\n"
        'uniform token[] xformOpOrder = ["xformOp:scale"]\n' + inner + "}\n"
    )
    own = joint(
        "j", "Revolute", "base", "base/tip",
        'uniform token physics:axis = "Z"\npoint3f physics:localPos0 = (1, 0, 0)',
    )  # fmt: skip
    robot = loaded(write(stage(scaled + own)))
    assert robot.placement([0.0], "tip")[:3, 3] == pytest.approx([2.0, 0.0, 0.0])
    assert codes(robot) == {}


def test_a_joint_to_a_prim_below_a_body_moves_the_body(write: Write) -> None:
    base = body(
        "base",
        inside='def Xform "flange" {\ndouble3 xformOp:translate = (0, 0, 2)\n'
        'uniform token[] xformOpOrder = ["xformOp:translate"]\n}',
        schemas=ROOT,
    )
    own = joint("j", "Revolute", "base/flange", "tip", 'uniform token physics:axis = "Z"')
    robot = loaded(write(stage(base + body("tip", "(0, 0, 2)") + own)))
    assert robot.placement([0.0], "tip")[:3, 3] == pytest.approx([0.0, 0.0, 2.0])
    # a plain Xform of a body is a frame
    assert robot.placement([0.0], "flange")[:3, 3] == pytest.approx([0.0, 0.0, 2.0])


def test_a_spherical_joint_is_refused_with_its_path(write: Write) -> None:
    ball = joint("ball", "Spherical", "base", "upper")
    with pytest.raises(InputError, match=r"joint /arm/ball: urdfkin does not support spherical joints"):
        loaded(write(stage(LINKS + ball)))


def locked(*names: str) -> str:
    return "".join(
        f"float limit:{name}:physics:low = 1\nfloat limit:{name}:physics:high = -1\n" for name in names
    )


def limited(*names: str) -> str:
    return ", ".join(f'"PhysicsLimitAPI:{name}"' for name in names)


ALL = ("transX", "transY", "transZ", "rotX", "rotY", "rotZ")


@pytest.mark.parametrize(
    ("free", "kind"),
    [
        ((), "fixed"),
        (("rotY",), "continuous"),
        (("transZ",), "prismatic"),
        (("transX", "transY", "rotZ"), "planar"),
    ],
)
def test_a_d6_joint_with_the_freedoms_of_another_kind_is_that_joint(
    write: Write, free: tuple[str, ...], kind: str
) -> None:
    shut = [name for name in ALL if name not in free]
    d6 = joint("j", "", "base", "tip", locked(*shut), limited(*shut))
    robot = loaded(write(stage(body("base", schemas=ROOT) + body("tip") + d6)))
    assert robot.tree.joints[0].kind.value == kind
    if free == ("rotY",):
        assert robot.placement([math.pi / 2], "tip")[:3, 0] == pytest.approx([0.0, 0.0, -1.0])


def test_a_d6_joint_with_other_freedoms_is_refused(write: Write) -> None:
    shut = ALL[:4]
    d6 = joint("j", "", "base", "tip", locked(*shut), limited(*shut))
    with pytest.raises(InputError, match=r"degrees of freedom.*rotY, rotZ"):
        loaded(write(stage(body("base") + body("tip") + d6)))


def test_a_joint_that_closes_a_loop_is_listed_with_its_path(write: Write) -> None:
    closing = joint(
        "closing",
        "Revolute",
        "lower",
        "base",
        "point3f physics:localPos1 = (2, 0, 1)\nbool physics:excludeFromArticulation = true",
    )
    robot = loaded(write(stage(LINKS + JOINTS + closing)))
    assert robot.nq == 2
    assert codes(robot) == {"USD101": "/arm/closing"}
    robot = loaded(write(stage(LINKS + JOINTS + closing.replace("true", "false"))))
    assert codes(robot) == {"USD101": "/arm/closing"}


def test_a_disabled_joint_and_a_lost_target_are_listed(write: Write) -> None:
    off = joint("off", "Fixed", "upper", "lower", "bool physics:jointEnabled = false")
    lost = joint("lost", "Fixed", "upper", "nowhere")
    robot = loaded(write(stage(LINKS + JOINTS + off + lost)))
    assert codes(robot) == {"USD101": "/arm/off", "USD201": "/arm/lost"}


def test_a_body_without_a_joint_is_listed(write: Write) -> None:
    robot = loaded(write(stage(LINKS + JOINTS + body("stray"))))
    assert codes(robot) == {"USD202": "/arm/stray"}


NEWTON = '"NewtonMimicAPI"'
PHYSX = '"PhysxMimicJointAPI:rotZ"'


@pytest.mark.parametrize(
    ("schema", "words"),
    [
        (
            NEWTON,
            "rel newton:mimicJoint = </arm/shoulder>\n"
            "float newton:mimicCoef0 = 30\nfloat newton:mimicCoef1 = -2",
        ),
        (
            PHYSX,
            "rel physxMimicJoint:rotZ:referenceJoint = </arm/shoulder>\n"
            "float physxMimicJoint:rotZ:gearing = 2\nfloat physxMimicJoint:rotZ:offset = -30",
        ),
    ],
)
def test_mimic_joints_of_newton_and_physx_follow_their_rule(write: Write, schema: str, words: str) -> None:
    follower = joint(
        "wrist", "Revolute", "upper", "hand", f'uniform token physics:axis = "Z"\n{words}', schema
    )
    robot = loaded(
        write(
            stage(
                body("base", schemas=ROOT)
                + body("upper", "(0, 0, 1)")
                + body("hand", "(0, 0, 1)")
                + JOINTS.partition("def PhysicsPrismatic")[0]
                + follower
            )
        )
    )
    rule = robot.tree.joints[1].mimic
    assert robot.nq == 1
    assert rule is not None
    assert rule.leader == "shoulder"
    assert (rule.multiplier, rule.offset) == pytest.approx((-2.0, math.pi / 6))


def test_a_rule_between_an_angle_and_a_length_is_not_scaled_and_is_listed(write: Write) -> None:
    rail = 'def PhysicsPrismaticJoint "rail" (prepend apiSchemas = ["NewtonMimicAPI"])'
    text = stage(LINKS + JOINTS.replace('def PhysicsPrismaticJoint "rail"', rail))
    start = text.index("{", text.index(rail)) + 1
    rule = "\nrel newton:mimicJoint = </arm/shoulder>\nfloat newton:mimicCoef1 = 0.5\n"
    robot = loaded(write(text[:start] + rule + text[start:]))
    assert codes(robot) == {"USD203": "/arm/rail"}
    (mimic,) = [joint.mimic for joint in robot.tree.joints if joint.mimic]
    assert (mimic.leader, mimic.multiplier) == ("shoulder", 0.5)


def test_value_clips_are_refused_before_they_name_a_file(write: Write, tmp_path: Path) -> None:
    secret = tmp_path / "secret.usda"
    secret.write_text("#usda 1.0\nTOPSECRET")
    clips = (
        f"\nclips = {{\ndictionary default = {{\nasset[] assetPaths = [@{secret}@]\n"
        f'asset manifestAssetPath = @{secret}@\nstring primPath = "/base"\n'
        "double2[] active = [(0, 0)]\ndouble2[] times = [(0, 0)]\n}\n}\n"
    )
    text = stage(LINKS + JOINTS)
    at = text.index("(", text.index('"upper"')) + 1
    path = write(text[:at] + clips + text[at:])
    with pytest.raises(urdfkin.UrdfkinError, match="value clips") as caught:
        loaded(path)
    assert "TOPSECRET" not in str(caught.value)


def test_a_mimic_rule_without_its_leader_is_listed(write: Write) -> None:
    lost = JOINTS.replace(
        'def PhysicsPrismaticJoint "rail"',
        'def PhysicsPrismaticJoint "rail" (prepend apiSchemas = ["NewtonMimicAPI"])',
    )
    robot = loaded(write(stage(LINKS + lost)))
    assert codes(robot) == {"USD203": "/arm/rail"}
    assert robot.nq == 2


def test_units_and_axes_that_a_stage_does_not_state_are_findings(write: Write) -> None:
    text = stage(LINKS + JOINTS)
    plain = text.replace("    metersPerUnit = 1.0\n", "").replace('    upAxis = "Z"\n', "")
    assert plain != text
    robot = loaded(write(plain))
    assert codes(robot) == {"USD301": None, "USD302": None}
    assert "centimetre" in next(one.message for one in robot.findings if one.code == "USD301")


def test_limits_in_radians_are_found(write: Write) -> None:
    robot = loaded(write(stage(LINKS + JOINTS.replace("= -90", "= -1.5708").replace("= 180", "= 3.14159"))))
    assert codes(robot) == {"USD303": "/arm/shoulder"}


def test_a_prim_that_is_not_where_its_joints_place_it_is_found(write: Write) -> None:
    robot = loaded(
        write(stage((LINKS + JOINTS).replace("localPos0 = (0, 0, 1)", "localPos0 = (0, 0, 1.001)")))
    )
    assert codes(robot) == {"USD304": "/arm/upper"}
    finding = next(one for one in robot.findings if one.code == "USD304")
    assert "0.001 m" in finding.message
    assert "elsewhere" in str(robot.certificate().reading)


def test_a_stage_may_show_the_robot_in_another_configuration(write: Write) -> None:
    posed = LINKS.replace("(2, 0, 1)", "(2, 0.75, 1)")
    robot = loaded(write(stage(posed + JOINTS)))
    assert codes(robot) == {}
    robot.placement([0.0, 0.0], "lower")
    assert "with 1 joints off zero" in str(robot.certificate().reading)


def test_several_articulations_need_a_choice(write: Write) -> None:
    two = (
        stage(LINKS + JOINTS)
        + stage(LINKS + JOINTS).replace("/arm", "/other").replace('"arm"', '"other"').partition(")\n")[2]
    )
    path = write(two)
    with pytest.raises(InputError, match=r"2 articulations.*/arm/base, /other/base"):
        loaded(path)
    assert loaded(path, articulation="/other/base").name == "other"
    with pytest.raises(InputError, match="/arm/base"):
        loaded(path, articulation="/arm/bas")


VARIANTS = """def Xform "arm" (
    variants = { string gripper = "short" }
    prepend variantSets = "gripper"
) {
CONTENT
    variantSet "gripper" = {
        "short" {
            over "lower" {
                double3 xformOp:translate = (2, 0, 1)
            }
            over "rail" {
                point3f physics:localPos0 = (2, 0, 0)
            }
        }
        "long" {
            over "lower" {
                double3 xformOp:translate = (5, 0, 1)
            }
            over "rail" {
                point3f physics:localPos0 = (5, 0, 0)
            }
        }
    }
}
"""


def test_a_variant_is_selected(write: Write) -> None:
    inner = LINKS.replace("translate = (2, 0, 1)", "translate")
    # an attribute in the file itself is stronger than one in a variant
    rail = JOINTS.replace("point3f physics:localPos0 = (2, 0, 0)\n", "")
    path = write(HEAD.format(unit=1, up="Z") + VARIANTS.replace("CONTENT", inner + rail))
    before = path.read_bytes()
    assert loaded(path).placement([0.0, 0.0], "lower")[0, 3] == pytest.approx(2.0)
    robot = loaded(path, variant={"gripper": "long"})
    assert robot.placement([0.0, 0.0], "lower")[0, 3] == pytest.approx(5.0)
    assert codes(robot) == {}
    assert path.read_bytes() == before
    assert "--variant gripper=long" in robot.origin.words
    with pytest.raises(InputError, match="long"):
        loaded(path, variant={"gripper": "lon"})
    with pytest.raises(InputError, match="gripper"):
        loaded(path, variant={"griper": "long"})
    found = command("placement", str(path), "--variant", "gripper=long", "--q", "0 0", "--format", "json")
    assert found.code == 0, found.err
    assert "5.0" in found.text


def test_references_payloads_and_instances_are_followed(write: Write) -> None:
    write(stage(LINKS + JOINTS), "parts/arm.usda")
    for arc in ("references", "payload", "instanceable = true\n    references"):
        head = '#usda 1.0\n(\n    metersPerUnit = 1\n    upAxis = "Z"\n)\n'
        text = f'{head}def "mine" (\n    {arc} = @./parts/arm.usda@</arm>\n) {{ }}\n'
        robot = loaded(write(text))
        assert robot.link_names == ("base", "upper", "lower")
        assert robot.placement([0.0, 0.0], "lower")[0, 3] == pytest.approx(2.0)
        assert codes(robot) == {}


def test_crate_files_and_packages_are_read(write: Write, tmp_path: Path) -> None:
    from pxr import Sdf, UsdUtils  # noqa: PLC0415

    path = write(stage(LINKS + JOINTS))
    crate, package = tmp_path / "robot.usdc", tmp_path / "robot.usdz"
    assert Sdf.Layer.FindOrOpen(str(path)).Export(str(crate))
    assert UsdUtils.CreateNewUsdzPackage(str(path), str(package))
    for file in (crate, package):
        robot = loaded(file)
        assert robot.placement([0.0, 0.0], "lower")[0, 3] == pytest.approx(2.0)


# -- nothing is dropped silently -----------------------------------------------------------------------------


def findings(robot: urdfkin.Robot) -> list[tuple[str, str | None, str]]:
    return [(one.code, one.name, one.message) for one in robot.findings if one.code.startswith("USD")]


GEAR = """def PhysxPhysicsGearJoint "gear" {
rel physics:body0 = </arm/upper>
rel physics:body1 = </arm/lower>
}
"""


def test_a_gear_joint_and_a_tendon_are_listed(write: Write) -> None:
    tendon = 'def MjcTendon "tendon" {\n}\n'
    robot = loaded(write(stage(LINKS + JOINTS + GEAR + tendon)))
    assert findings(robot) == [
        ("USD101", "/arm/gear", "a tree cannot represent this PhysxPhysicsGearJoint"),
        ("USD101", "/arm/tendon", "a tree cannot represent this MjcTendon"),
    ]


def with_schemas(schemas: str, words: str = "") -> str:
    """Write the arm whose slide has applied schemas."""
    rail = f'def PhysicsPrismaticJoint "rail" (prepend apiSchemas = [{schemas}])'
    text = stage(LINKS + JOINTS.replace('def PhysicsPrismaticJoint "rail"', rail))
    start = text.index("{", text.index(rail)) + 1
    return f"{text[:start]}\n{words}\n{text[start:]}"


@pytest.mark.parametrize("schema", ["MjcEqualityJointAPI", "PhysxTendonAxisAPI:t", "OtherMimicAPI"])
def test_a_coupling_that_is_not_read_is_listed(write: Write, schema: str) -> None:
    robot = loaded(write(with_schemas(f'"{schema}"')))
    assert findings(robot) == [("USD101", "/arm/rail", f"urdfkin does not read {schema}")]
    robot = loaded(write(with_schemas(f'"{schema}", "PhysxTendonAxisAPI:u"')))
    what = f"urdfkin does not read {schema}, PhysxTendonAxisAPI:u"
    assert findings(robot) == [("USD101", "/arm/rail", what)]


def test_an_equality_of_mujoco_is_listed_only_for_terms_that_its_mimic_rule_lacks(write: Write) -> None:
    words = "rel newton:mimicJoint = </arm/slide>\nfloat mjc:coef2 = {}"
    both = '"NewtonMimicAPI", "MjcEqualityJointAPI"'
    slide = body("side") + joint("slide", "Prismatic", "base", "side", 'uniform token physics:axis = "Y"\n'
        "float physics:lowerLimit = -1\nfloat physics:upperLimit = 1")  # fmt: skip
    for coefficient, expected in ((0, {}), (1, {"USD101": "/arm/rail"})):
        text = with_schemas(both, words.format(coefficient)).rstrip().removesuffix("}") + slide + "}"
        robot = loaded(write(text))
        assert codes(robot) == expected
        assert robot.nq == 2


def test_a_disabled_mimic_rule_is_listed(write: Write) -> None:
    words = "rel newton:mimicJoint = </arm/shoulder>\nbool newton:mimicEnabled = false"
    robot = loaded(write(with_schemas(NEWTON, words)))
    assert findings(robot) == [("USD101", "/arm/rail", "the mimic rule of this joint is disabled")]


def test_a_blocked_value_counts_as_one_that_is_not_written(write: Write) -> None:
    blocked = joint(
        "shoulder", "Revolute", "base", "upper",
        "uniform token physics:axis = None\nfloat physics:lowerLimit = None\n"
        "float physics:upperLimit = None\npoint3f physics:localPos1 = None\n"
        "quatf physics:localRot1 = None\nbool physics:jointEnabled = None\n"
        "bool physics:excludeFromArticulation = None\n"
        "point3f physics:localPos0 = (0, 0, 1)",
    )  # fmt: skip
    robot = loaded(write(stage(body("base", schemas=ROOT) + body("upper", "(0, 0, 1)") + blocked)))
    (made,) = robot.tree.joints
    assert made.kind.value == "continuous"
    assert made.axis == pytest.approx([1.0, 0.0, 0.0])
    assert findings(robot) == []
    shut = [name for name in ALL if name != "rotY"]
    d6 = joint(
        "j", "", "base", "tip",
        locked(*shut) + "float limit:rotY:physics:low = None\nfloat limit:rotY:physics:high = 90",
        limited(*ALL),
    )  # fmt: skip
    with pytest.raises(InputError, match=r"joint /arm/j: .* is blocked.*limit:rotY:physics:low = None"):
        loaded(write(stage(body("base", schemas=ROOT) + body("tip") + d6)))


@pytest.mark.parametrize(("free", "factor"), [("rotY", math.pi / 180.0), ("transZ", 0.5)])
def test_a_d6_joint_keeps_the_limits_of_its_free_direction(write: Write, free: str, factor: float) -> None:
    shut = [name for name in ALL if name != free]
    ends = f"float limit:{free}:physics:low = -45\nfloat limit:{free}:physics:high = 90"
    d6 = joint("j", "", "base", "tip", locked(*shut) + ends, limited(*ALL))
    robot = loaded(write(stage(body("base", schemas=ROOT) + body("tip") + d6, unit=0.5)))
    limit = robot.tree.joints[0].limit
    assert limit is not None
    assert (limit.lower, limit.upper) == pytest.approx((-45 * factor, 90 * factor))


def test_the_prototypes_of_a_point_instancer_are_left_out_and_listed(write: Write) -> None:
    crowd = 'def PointInstancer "crowd" {\nrel prototypes = </arm/crowd/one>\n%s}\n'
    inner = 'def Xform "one" {\n' + body("a") + body("b") + GEAR.replace(
        "PhysxPhysicsGearJoint", "PhysicsRevoluteJoint").replace("/arm/", "/arm/crowd/one/"
    ).replace("/upper", "/a").replace("/lower", "/b") + "}\n"  # fmt: skip
    lead = joint("lead", "Fixed", "upper", "crowd/one/a")
    robot = loaded(write(stage(LINKS + JOINTS + crowd % inner + lead)))
    assert robot.link_names == ("base", "upper", "lower")
    (instancer, joined) = findings(robot)
    assert instancer[:2] == ("USD101", "/arm/crowd")
    assert "2 bodies and 1 joints, which are not read" in instancer[2]
    assert joined[:2] == ("USD201", "/arm/lead")
    assert "is a prototype of a PointInstancer" in joined[2]
    robot = loaded(write(stage(LINKS + JOINTS + crowd % 'def Cube "one" {\n}\n')))
    assert findings(robot) == [("USD102", "/arm/crowd", "kinematics does not use this PointInstancer")]


def test_time_samples_without_a_default_value_are_listed(write: Write) -> None:
    timed = JOINTS.replace("physics:upperLimit = 3", "physics:upperLimit.timeSamples = { 0: 3 }")
    robot = loaded(write(stage(LINKS + timed)))
    assert ("USD104", "/arm/rail") in [one[:2] for one in findings(robot)]
    text = stage(LINKS + JOINTS)
    moving = text.replace("translate = (0, 0, 1)", "translate.timeSamples = { 0: (0, 0, 1) }")
    assert moving != text
    robot = loaded(write(moving))
    timed_finding = next(one for one in findings(robot) if one[0] == "USD104")
    assert timed_finding[1:] == (
        "/arm/upper",
        "xformOp:translate has time samples, but no default value, so urdfkin leaves it out",
    )
    both = "translate = (0, 0, 1)\ndouble3 xformOp:translate.timeSamples = { 0: (0, 0, 5) }"
    assert findings(loaded(write(text.replace("translate = (0, 0, 1)", both)))) == []
    moved = "double3 xformOp:translate.timeSamples = { 0: (1, 0, 0) }\nuniform token[] xformOpOrder = "
    above = text.replace('def Xform "arm" {', f'def Xform "arm" {{\n{moved}["xformOp:translate"]')
    assert [one[:2] for one in findings(loaded(write(above)))] == [("USD104", "/arm")]


def test_a_spline_without_a_default_value_is_listed(write: Write) -> None:
    if not hasattr(usd.library().Usd.Attribute, "HasSpline"):
        pytest.skip("this OpenUSD has no splines")
    spline = "double xformOp:translateZ.spline = {\n1: 1; post held,\n}"
    text = stage(LINKS + JOINTS).replace("double3 xformOp:translate = (0, 0, 1)", spline)
    robot = loaded(write(text.replace('["xformOp:translate"]', '["xformOp:translateZ"]', 1)))
    what = "xformOp:translateZ has a spline, but no default value, so urdfkin leaves it out"
    assert findings(robot)[0] == ("USD104", "/arm/upper", what)


def test_a_layer_in_another_unit_or_with_another_up_axis_is_listed(write: Write) -> None:
    write(stage(LINKS + JOINTS, unit=0.01, up="Y"), "parts/arm.usda")
    head = '#usda 1.0\n(\n    metersPerUnit = 1\n    upAxis = "Z"\n)\n'
    for arc in ("references", "payload", "instanceable = true\n    references"):
        text = f'{head}def Xform "mine" (\n    {arc} = @./parts/arm.usda@</arm>\n) {{\n%s\n}}\n'
        robot = loaded(write(text % ""))
        assert codes(robot) == {"USD301": "/mine", "USD302": "/mine"}
        message = next(one[2] for one in findings(robot) if one[0] == "USD301")
        assert "the layer parts/arm.usda has metersPerUnit 0.01, but the stage 1" in message
        resolved = (
            "double3 xformOp:rotateXYZ:unitsResolve = (90, 0, 0)\n"
            "double3 xformOp:scale:unitsResolve = (0.01, 0.01, 0.01)\n"
            'uniform token[] xformOpOrder = ["xformOp:rotateXYZ:unitsResolve", "xformOp:scale:unitsResolve"]'
        )
        robot = loaded(write(text % resolved))
        assert codes(robot) == {}
        assert robot.placement([0.0, 0.0], "lower")[0, 3] == pytest.approx(0.02)
    # a layer of shapes only
    write(f'{HEAD.format(unit=0.01, up="Y")}def Cube "arm" {{\n}}\n', "parts/cube.usda")
    shape = 'def "shape" (references = @./parts/cube.usda@</arm>) {\n}\n'
    robot = loaded(write(stage(LINKS.replace('def Xform "upper"', shape + 'def Xform "upper"') + JOINTS)))
    assert codes(robot) == {"USD102": None}


def test_a_sublayer_in_another_unit_is_listed(write: Write) -> None:
    write(stage(JOINTS, unit=0.01), "joints.usda")
    text = stage(LINKS).replace("(\n", "(\n    subLayers = [@./joints.usda@]\n", 1)
    assert codes(loaded(write(text))) == {"USD301": "/arm"}


def test_a_variant_inside_an_instance_is_selected(write: Write) -> None:
    inner = LINKS.replace("translate = (2, 0, 1)", "translate")
    rail = JOINTS.replace("point3f physics:localPos0 = (2, 0, 0)\n", "")
    write(HEAD.format(unit=1, up="Z") + VARIANTS.replace("CONTENT", inner + rail), "arm.usda")
    head = '#usda 1.0\n(\n    metersPerUnit = 1\n    upAxis = "Z"\n    defaultPrim = "outer"\n)\n'
    part = f'{head}def Xform "outer" {{\ndef "inner" (\n    instanceable = true\n    references = '
    write(part + "@./arm.usda@</arm>\n) {\n}\n}\n", "nested.usda")
    whole = f'{head}def "outer" (\n    instanceable = true\n    references = @./nested.usda@\n) {{\n}}\n'
    path = write(whole)
    for name, length in (("short", 2.0), ("long", 5.0)):
        robot = loaded(path, variant={"gripper": name})
        assert robot.placement([0.0, 0.0], "lower")[0, 3] == pytest.approx(length)
        assert codes(robot) == {}


SHEAR = (
    "float xformOp:rotateZ = 45\nfloat3 xformOp:scale = (1, 2, 1)\n"
    'uniform token[] xformOpOrder = ["xformOp:scale", "xformOp:rotateZ"]\n'
)


def test_a_sheared_frame_is_no_link_but_a_sheared_body_is_refused(write: Write) -> None:
    frame = f'def Xform "skew" {{\n{SHEAR}}}\n'
    robot = loaded(
        write(stage(body("base", inside=frame, schemas=ROOT) + LINKS.partition("}\n")[2] + JOINTS))
    )
    assert robot.link_names == ("base", "upper", "lower")
    assert [one[:2] for one in findings(robot)] == [("USD102", "/arm/base/skew")]
    above = stage(LINKS + JOINTS).replace('"arm" {', '"arm" {\nfloat3 xformOp:scale = (1, 2, 1)\n'
        'uniform token[] xformOpOrder = ["xformOp:scale"]')  # fmt: skip
    turned = above.replace('(0, 0, 1)\nuniform token[] xformOpOrder = ["xformOp:translate"]',
        '(0, 0, 1)\nfloat xformOp:rotateZ = 45\n'
        'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateZ"]')  # fmt: skip
    assert turned != above
    with pytest.raises(InputError, match=r"/arm/upper: .* has shear.*: found the scale 1, 2, 1 of /arm"):
        loaded(write(turned))


def test_the_articulation_above_all_prims_has_a_name(write: Write) -> None:
    text = stage(LINKS + JOINTS + joint("mount", "Fixed", "", "base") + body("stray"))
    robot = loaded(write(text), articulation="/")
    assert robot.name == "arm"
    assert codes(robot) == {"USD202": "/arm/stray"}
    other = text.partition(")\n")[2].replace("/arm", "/other").replace('"arm"', '"other"')
    two = loaded(write(text + other, "cell.usda"), articulation="/")
    assert (two.name, two.nq) == ("cell", 4)
    with pytest.raises(InputError, match="unknown articulation"):
        loaded(write(text), articulation="")


def test_a_joint_that_is_listed_already_is_not_listed_for_its_schema(write: Write) -> None:
    weld = joint(
        "weld", "Fixed", "lower", "base", "bool physics:excludeFromArticulation = true",
        '"MjcEqualityWeldAPI"',
    )  # fmt: skip
    what = "a tree cannot represent this FixedJoint, which is outside the articulation"
    assert findings(loaded(write(stage(LINKS + JOINTS + weld)))) == [("USD101", "/arm/weld", what)]


# -- hostile files ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("reference", "why"),
    [
        ("../../secret.usda", "outside"),
        ("/etc/passwd.usda", "outside"),
        ("https://example.org/a.usda", "fetches nothing"),
        ("omniverse://host/a.usda", "fetches nothing"),
        ("./link.usda", "outside"),
        ("./.hidden/a.usda", "outside"),
        ("./notes.txt", "not USD"),
        ('`"./${X}.usda"`', "expression"),
    ],
)
@pytest.mark.parametrize("arc", ["sublayer", "reference", "payload", "variant"])
def test_a_reference_outside_the_folder_is_refused(
    write: Write, tmp_path: Path, reference: str, why: str, arc: str
) -> None:
    (tmp_path / "secret.usda").write_text(stage(LINKS + JOINTS))
    path = write("", "robot/robot.usda")
    (path.parent / "link.usda").symlink_to(tmp_path / "secret.usda")
    (path.parent / "notes.txt").write_text("#usda 1.0\n")
    own = f"({'payload' if arc == 'payload' else 'references'} = @{reference}@</arm>)"
    text = {
        "sublayer": f"#usda 1.0\n(\n    subLayers = [@{reference}@]\n)\n",
        "variant": "#usda 1.0\n"
        'def "x" (\n variants = { string s = "a" }\n prepend variantSets = "s"\n) {\n'
        f'variantSet "s" = {{\n"a" {{ }}\n"b" {own} {{ }}\n}}\n}}\n',
    }.get(arc, f'#usda 1.0\ndef "x" {own} {{ }}\n')
    path.write_text(text)
    with pytest.raises(InputError, match=why):
        usd.files_of(usd.library(), str(path))
    if arc == "reference":
        with pytest.raises(InputError, match=why):
            loaded(path)


def test_layers_that_refer_to_each_other_end(write: Write) -> None:
    write(stage(LINKS + JOINTS).replace("(\n", "(\n    subLayers = [@./b.usda@]\n", 1), "a.usda")
    path = write(stage(LINKS + JOINTS).replace("(\n", "(\n    subLayers = [@./a.usda@]\n", 1), "b.usda")
    robot = loaded(path)
    assert "USD103" in codes(robot)


def test_a_missing_layer_is_a_finding(write: Write) -> None:
    robot = loaded(write(stage(LINKS + JOINTS + 'def "x" (references = @./gone.usda@</a>) { }')))
    assert codes(robot) == {"USD103": None}


def test_a_crate_file_that_is_cut_short_is_an_error(write: Write, tmp_path: Path) -> None:
    from pxr import Sdf  # noqa: PLC0415

    crate = tmp_path / "robot.usdc"
    Sdf.Layer.FindOrOpen(str(write(stage(LINKS + JOINTS)))).Export(str(crate))
    whole = crate.read_bytes()
    for share in (0.01, 0.3, 0.6, 0.9, 0.99):
        cut = tmp_path / f"cut{share}.usdc"
        cut.write_bytes(whole[: int(share * len(whole))])
        with pytest.raises(InputError):
            loaded(cut)


def test_a_changed_crate_file_never_ends_the_callers_process(write: Write, tmp_path: Path) -> None:
    from pxr import Sdf  # noqa: PLC0415

    crate, rng = tmp_path / "robot.usdc", np.random.default_rng(0)
    Sdf.Layer.FindOrOpen(str(write(stage(LINKS + JOINTS)))).Export(str(crate))
    whole = np.frombuffer(crate.read_bytes(), np.uint8)
    for k in range(12):
        damaged = whole.copy()
        damaged[rng.integers(0, len(whole), 20)] = rng.integers(0, 256, 20)
        file = tmp_path / f"damaged{k}.usdc"
        file.write_bytes(damaged.tobytes())
        with contextlib.suppress(urdfkin.UrdfkinError):
            loaded(file, verify=False)


def test_large_layers_and_devices_are_refused(write: Write, tmp_path: Path) -> None:
    path = write(stage(LINKS + JOINTS + 'def "x" (references = @./large.usda@</a>) { }'))
    with (tmp_path / "large.usda").open("wb") as file:
        file.truncate(200_000_000)
    with pytest.raises(InputError, match="too large"):
        loaded(path)
    (tmp_path / "large.usda").unlink()
    os.mkfifo(tmp_path / "large.usda")
    with pytest.raises(InputError, match="not a regular file"):
        loaded(path)
    with pytest.raises(SourceError):
        loaded(tmp_path / "none.usda")


def test_text_that_is_no_usd_is_an_error(write: Write) -> None:
    for text in ("<robot/>", "#usda 1.0\ndef Xform {", "PXR-USDC"):
        with pytest.raises(InputError):
            loaded(write(text))


def test_a_stage_without_joints_is_an_error(write: Write) -> None:
    with pytest.raises(InputError, match="no joint between bodies"):
        loaded(write(stage(LINKS)))


# -- a slip of the reader is noticed -------------------------------------------------------------------------


def slipped(monkeypatch: pytest.MonkeyPatch, path: Path) -> urdfkin.Robot:
    """Load a stage in this process, where a slip can be planted."""
    from urdfkin.verify import usd_process  # noqa: PLC0415

    def ask(_: list[str], request: bytes, *rest: Any) -> tuple[bytes, int]:
        return json.dumps(usd_process.answer_of(json.loads(request))).encode() + b"\n", 0

    monkeypatch.setattr(usd_check, "ask_python", ask)
    return loaded(path)


@pytest.mark.parametrize("slip", ["unit", "degrees", "swapped", "axis"])
def test_openusds_parser_notices_a_slip_of_our_reader(
    write: Write, monkeypatch: pytest.MonkeyPatch, slip: str
) -> None:
    path = write(stage(LINKS + JOINTS, unit=0.5))
    assert slipped(monkeypatch, path).nq == 2
    side, motion = usd._Reader._side, usd._Reader._motion

    def wrong_side(self: Any, prim: Any, i: int, target: str | None) -> Any:
        found = side(self, prim, 1 - i if slip == "swapped" else i, target)
        assert found is not None
        T = found[1].copy()
        T[:3, 3] *= 2.0 if slip == "unit" else 1.0
        return found[0], T, *found[2:]

    def wrong_motion(self: Any, prim: Any) -> Any:
        kind, axis, (lower, upper), free = motion(self, prim)
        factor = 180.0 / math.pi if slip == "degrees" else 1.0
        return kind, axis, (lower * factor, upper * factor), "rotX" if slip == "axis" else free

    monkeypatch.setattr(usd._Reader, "_side", wrong_side)
    monkeypatch.setattr(usd._Reader, "_motion", wrong_motion)
    with pytest.raises(OracleError, match="OpenUSD's parser of UsdPhysics reads another joint"):
        slipped(monkeypatch, path)


# -- the same robot in several formats -----------------------------------------------------------------------


@dataclass(frozen=True)
class Slip:
    """A mistake of a converter, in one joint."""

    kind: str
    joint: str


def as_usd(robot: urdfkin.Robot, spell: Callable[[str], str] = str, slip: Slip | None = None) -> str:
    """Write a robot of revolute, continuous, prismatic and fixed joints as a stage, as a converter would."""
    tree = robot.tree
    place = robot.placement(np.zeros(robot.nq), list(robot.link_names))
    lines = []
    for k, link in enumerate(tree.links):
        api = '"PhysicsRigidBodyAPI"' + (', "PhysicsArticulationRootAPI"' if k == 0 else "")
        x, y, z, w = quaternion_of(place[k, :3, :3]).tolist()
        lines.append(
            f'def Xform "{spell(link)}" (prepend apiSchemas = [{api}]) {{\n'
            f"double3 xformOp:translate = {tuple(place[k, :3, 3].tolist())}\n"
            f"quatd xformOp:orient = ({w!r}, {x!r}, {y!r}, {z!r})\n"
            'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:orient"]\n}\n'
        )
    lines.append('def Scope "joints" {\n')
    for k, one in enumerate(tree.joints):
        lines.append(_joint_in_usd(tree, k, one, spell, slip if slip and slip.joint == one.name else None))
    lines.append("}\n")
    return stage("".join(lines))


def _joint_in_usd(
    tree: KinematicTree, k: int, one: Joint, spell: Callable[[str], str], slip: Slip | None
) -> str:
    kind = slip.kind if slip else ""
    turns = one.kind.turns
    R = _with_first_axis(-one.axis if kind == "axis sign" else one.axis)
    A, B = one.T_parent_joint @ pose(R), pose(R)
    if kind == "centimetres":
        A = pose(A[:3, :3], 100.0 * A[:3, 3])
    if kind == "a micrometre":
        A = A @ pose(p=(0.6e-6, 0.8e-6, 0.0))
    if kind == "a microradian":
        A = A @ pose(rotation_about(np.array([0.6, 0.8, 0.0]), 1e-6))
    if kind == "another zero":
        A = A @ pose(rotation_about(np.array([1.0, 0.0, 0.0]), 1e-6))
    if kind == "other frames on the axis":
        on = pose(rotation_about(np.array([1.0, 0.0, 0.0]), 0.7), (0.25, 0.0, 0.0))
        A, B = A @ on, B @ on
    if kind == "mirrored frame":
        mirror = np.diag([1.0, -1.0, 1.0])
        A = pose(A[:3, :3], mirror @ A[:3, 3])
    ends = [spell(tree.links[one.parent]), spell(tree.links[k + 1])]
    if kind == "exchanged bodies":
        ends.reverse()
    words = [f"rel physics:body{i} = </arm/{end}>" for i, end in enumerate(ends)]
    for i, T in enumerate((A, B)):
        x, y, z, w = quaternion_of(T[:3, :3]).tolist()
        words.append(f"point3f physics:localPos{i} = {tuple(T[:3, 3].tolist())}")
        words.append(f"quatf physics:localRot{i} = ({w!r}, {x!r}, {y!r}, {z!r})")
    schemas = ""
    if one.mimic is not None and kind != "mimic dropped":
        factor = 180.0 / math.pi if turns else 1.0
        schemas = ' (prepend apiSchemas = ["NewtonMimicAPI"])'
        words.append(f"rel newton:mimicJoint = </arm/joints/{spell(one.mimic.leader)}>")
        words.append(f"float newton:mimicCoef0 = {one.mimic.offset * factor!r}")
        factor = 1.000001 if kind == "a millionth" else 1.0
        words.append(f"float newton:mimicCoef1 = {one.mimic.multiplier * factor!r}")
    if one.limit is not None and one.kind.bounded:
        factor = 180.0 / math.pi if turns and kind != "radians" else 1.0
        words.append(f"float physics:lowerLimit = {one.limit.lower * factor!r}")
        words.append(f"float physics:upperLimit = {one.limit.upper * factor!r}")
    name = {"fixed": "Fixed", "prismatic": "Prismatic"}.get(one.kind.value, "Revolute")
    return f'def Physics{name}Joint "{spell(one.name)}"{schemas} {{\n' + "\n".join(words) + "\n}\n"


def _with_first_axis(axis: Any) -> Any:
    """A rotation whose x axis is a unit vector."""
    other = np.eye(3)[int(np.argmin(np.abs(axis)))]
    y = np.cross(axis, other)
    y /= np.linalg.norm(y)
    return np.column_stack((axis, y, np.cross(axis, y)))


ROBOTS = (
    "panda",
    "ur5",
    "so101",
    "talos_left_arm",
    "ur10",
    "solo12",
    "finger_edu",
    "g1",
    "allegro_left_hand",
    "bolt",
)


@pytest.mark.parametrize("name", ROBOTS[:3])
def test_rounding_to_single_precision_explains_the_difference_from_the_urdf(write: Write, name: str) -> None:
    robot = loaded_name(name)
    found = urdfkin.same(robot, loaded(write(as_usd(robot, transcoded))), boxes=0)
    assert found.single is not None
    assert found.up_to_single
    assert (found.unexplained, found.within_single) == ((), False)
    assert 0.0 < found.written[0] <= found.single[0] < 5e-6
    assert found.holds(Question())
    assert found.holds(Question(strict=True)) is not bool(found.remarks)
    assert found.holds(Question(within=5e-6))
    assert not found.holds(Question(within=0.0))


def loaded_name(name: str) -> urdfkin.Robot:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", urdfkin.UrdfWarning)
        return urdfkin.load(name)


def test_two_micrometres_are_not_explained_by_single_precision(write: Write) -> None:
    robot = loaded_name("panda")
    text = as_usd(robot)
    assert "0.333" in text
    found = urdfkin.same(robot, loaded(write(text.replace("0.333", "0.33300001"))), boxes=0)
    assert found.up_to_single
    found = urdfkin.same(robot, loaded(write(text.replace("0.333", "0.333002"))), boxes=0)
    assert not found.up_to_single
    assert not found


ODD = (
    '<robot name="r"><link name="a"/><link name="b.0"/><link name="c.0"/>'
    '<joint name="j.0" type="revolute"><parent link="a"/><child link="b.0"/>{limit}</joint>'
    '<joint name="k.0" type="{kind}"><parent link="b.0"/><child link="c.0"/><origin xyz="1 0 0"/>'
    '<axis xyz="0 1 0"/>{rest}</joint></robot>'
)
RANGE = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'


def test_a_joint_that_never_moves_or_is_fixed_is_matched_by_its_spelling_in_usd(write: Write) -> None:
    idle = f'{RANGE}<mimic joint="j.0" multiplier="0"/>'
    kinds = {"idle": ("revolute", idle), "free": ("revolute", RANGE), "fixed": ("fixed", "")}
    robots = {
        name: loaded_name(ODD.format(limit=RANGE, kind=kind, rest=rest))
        for name, (kind, rest) in kinds.items()
    }
    free = loaded(write(as_usd(robots["free"], transcoded)))
    assert "tn__k0_k3" in [one.name for one in free.tree.joints]
    for name in ("idle", "fixed"):
        as_named = urdfkin.same(robots[name], robots["free"], boxes=0)
        for a, b in ((robots[name], free), (free, robots[name])):
            found = urdfkin.same(a, b, boxes=0)
            assert [one.what for one in found.differences] == [one.what for one in as_named.differences]


#: A slide whose long range multiplies the rounding of its rotation, and an elbow after it.
LONG_SLIDE = (
    '<robot name="arm"><link name="rail"/><link name="carriage"/><link name="forearm"/><link name="tip"/>'
    '<joint name="slide" type="prismatic"><parent link="rail"/><child link="carriage"/>'
    '<origin xyz="0 0 0.1" rpy="0.3 0.4 0.5"/><axis xyz="0.6 0.8 0"/>'
    '<limit lower="-1000" upper="1000" effort="1" velocity="1"/></joint>'
    '<joint name="elbow" type="revolute"><parent link="carriage"/><child link="forearm"/>'
    '<origin xyz="0.333 0 0" rpy="0.1 0.2 0.3"/><axis xyz="0 0.6 0.8"/>'
    '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
    '<joint name="wrist" type="continuous"><parent link="forearm"/><child link="tip"/>'
    '<origin xyz="0.25 0.1 0"/><axis xyz="0 0 1"/></joint></robot>'
)


def test_an_error_below_the_rounding_of_a_long_slide_is_found_and_its_joint_named(write: Write) -> None:
    robot = urdfkin.load(LONG_SLIDE)
    text = as_usd(robot)
    assert urdfkin.same(robot, loaded(write(text)), boxes=0).up_to_single
    assert "(0.333," in text
    stage_file = write(text.replace("(0.333,", "(0.33305,"))
    found = urdfkin.same(robot, loaded(stage_file), boxes=0)
    assert found.single is not None
    assert 4e-5 < found.written[0] < found.single[0]  # the sum of all roundings does not exclude the error
    assert found.within_single
    assert not found.up_to_single
    assert not found.holds(Question())
    [one] = map(str, found.unexplained)
    assert one == "joint elbow: origin 50.01 µm off, rounding explains at most 14.9 nm"
    done = command("same", "-", str(stage_file), "--boxes", "0", stdin=LONG_SLIDE)
    assert done.code == 1, done.text + done.err
    assert "joint elbow" in " ".join(done.text.split())


@pytest.mark.parametrize("kind", ["a micrometre", "a microradian", "another zero"])
@pytest.mark.parametrize("name", ["slide", "elbow", "wrist"])
def test_an_error_beyond_the_rounding_of_its_own_joint_is_never_explained(
    write: Write, kind: str, name: str
) -> None:
    if (kind, name) == ("another zero", "slide"):
        kind = "a microradian"
    robot = urdfkin.load(LONG_SLIDE)
    found = urdfkin.same(robot, loaded(write(as_usd(robot, slip=Slip(kind, name)))), bounds=False)
    assert not found
    assert [one.place for one in found.unexplained] == [f"joint {name}"]


def test_a_joint_frame_elsewhere_on_the_axis_is_the_same_joint(write: Write) -> None:
    robot = urdfkin.load(LONG_SLIDE)
    for name in ("slide", "elbow", "wrist"):
        stage_text = as_usd(robot, slip=Slip("other frames on the axis", name))
        found = urdfkin.same(robot, loaded(write(stage_text)), boxes=0)
        assert found.up_to_single, found.unexplained
        assert not urdfkin.same(loaded(write(stage_text)), robot, bounds=False).unexplained


def test_a_mimic_multiplier_that_is_off_by_a_millionth_is_not_explained(write: Write) -> None:
    robot = loaded_name("panda")
    name = next(one.name for one in robot.tree.joints if one.mimic is not None)
    found = urdfkin.same(robot, loaded(write(as_usd(robot, slip=Slip("a millionth", name)))), bounds=False)
    assert not found
    assert str(found.unexplained[0]).startswith(f"joint {name}: mimic multiplier 1.00000")


def test_a_robot_at_another_place_in_the_stage_is_not_explained_by_rounding(write: Write) -> None:
    robot = urdfkin.load(LONG_SLIDE)
    mount = joint("mount", "Fixed", "", "rail", "point3f physics:localPos0 = (0, 0, 0.5)")
    found = urdfkin.same(robot, loaded(write(as_usd(robot) + mount)), bounds=False)
    assert [str(one) for one in found.unexplained] == ["link rail: base at another place"]


def test_a_certificate_up_to_single_precision_is_rechecked(write: Write) -> None:
    robots = urdfkin.load(LONG_SLIDE), loaded(write(as_usd(urdfkin.load(LONG_SLIDE))))
    document = certificate(urdfkin.same(*robots, boxes=0))
    assert document["verdict"] == "same up to single precision"
    assert recheck(document, *robots) == []
    document["verdict"] = "same"
    assert recheck(document, *robots) == ["`verdict`: the models give same up to single precision, not same"]


SLIPS = {
    "axis sign": "senses",
    "centimetres": "USD304",
    "radians": "USD303",
    "mimic dropped": "independent joint in B",
    "exchanged bodies": "USD304",
    "mirrored frame": "USD304",
}


@pytest.mark.long
@pytest.mark.parametrize("name", ROBOTS)
def test_each_slip_of_a_converter_is_found_and_named(write: Write, name: str) -> None:
    robot = loaded_name(name)
    for kind, slip_word in SLIPS.items():
        word = slip_word
        moving = [one for one in robot.tree.joints if one.kind.nq == 1]
        if kind == "mimic dropped":
            moving = [one for one in moving if one.mimic is not None]
        elif kind == "radians":
            moving = [one for one in moving if one.kind.value == "revolute"]
        elif kind == "mirrored frame":
            moving = [one for one in moving if abs(one.T_parent_joint[1, 3]) > 1e-3]
        elif kind in ("centimetres", "exchanged bodies"):
            moving = [one for one in moving if np.linalg.norm(one.T_parent_joint[:3, 3]) > 1e-3]
        if not moving:
            continue
        slipped_stage = loaded(write(as_usd(robot, transcoded, Slip(kind, moving[len(moving) // 2].name))))
        found = urdfkin.same(robot, slipped_stage, boxes=0)
        said = [
            *found.up_to,
            *(one.words for one in (*found.differences, *found.remarks)),
            *codes(slipped_stage),
        ]
        limit = moving[len(moving) // 2].limit
        if kind == "radians" and limit is not None and limit.upper > LARGEST_ANGLE:
            word = ": limits "  # too large for a joint angle in radians, so only `same` finds it
        assert not found.up_to_single or kind == "radians", (kind, name)
        assert any(word in one for one in said), (kind, name, said)
        if kind == "radians":
            assert any(one.what == "limits" for one in found.remarks)


def test_three_formats_are_compared_in_pairs(
    write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mujoco = pytest.importorskip("mujoco")
    robot = loaded_name("planar_two_link")
    urdf = tmp_path / "arm.urdf"
    urdf.write_text(robot.urdf)
    stage_file = write(as_usd(robot), "arm.usda")
    mjcf = tmp_path / "arm.xml"
    links = '<body name="link_1"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
    assert mujoco
    T, tip = (robot.placement([0.0, 0.0], name)[:3, 3].tolist() for name in ("link_2", "tip"))
    tip = np.subtract(tip, T).tolist()
    mjcf.write_text(
        f'<mujoco><compiler angle="radian"/><worldbody>{links}<joint name="joint_1" axis="0 0 1"/>'
        f'<body name="link_2" pos="{T[0]!r} {T[1]!r} {T[2]!r}">'
        '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
        f'<joint name="joint_2" axis="0 0 1"/><site name="tip" pos="{tip[0]!r} {tip[1]!r} {tip[2]!r}"/>'
        "</body></body></worldbody></mujoco>"
    )
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")  # a narrow terminal breaks rows into lines
    files = [str(file.relative_to(tmp_path)) for file in (urdf, mjcf, stage_file)]
    done = command("same", *files, "--boxes", "0")
    assert done.code == 0, done.text + done.err
    assert done.text.count("same up to single precision") == 2
    assert done.text.count("arm.urdf") == 2
    done = command("same", *files, "--map", "a=b")
    assert done.code == 2
    assert "more than two robots" in done.err


def test_diff_with_a_stage_lists_a_slip_at_its_joint_and_not_the_rounding(
    write: Write, tmp_path: Path
) -> None:
    text = LONG_SLIDE.replace("elbow", "elbow-1").replace("forearm", "forearm.1")
    robot = urdfkin.load(text)
    plain = urdfkin.diff(robot, loaded(write(as_usd(robot, transcoded))))
    assert (plain.changes, plain.total) == ((), None)
    assert plain.rounding is not None
    assert 0.0 < plain.rounding[0] < 1e-3
    unbounded = urdfkin.diff(robot, loaded(write(as_usd(robot, transcoded))), effects=False)
    assert headline(unbounded) == "nothing changed, apart from rounding to single precision"
    assert as_data(unbounded)["rounding"] == {"metres": None, "radians": None}
    stage_file = write(as_usd(robot, transcoded, Slip("a micrometre", "elbow-1")))
    found = urdfkin.diff(robot, loaded(stage_file))
    assert [str(one) for one in found.changes] == ["joint elbow-1: origin 0.997 µm off"]
    assert [one.element for one in found.effects] == ["joint elbow-1"]
    assert 0.9e-6 < found.effects[0].interval.lower < 1.3e-6
    assert found.rounding is None
    flipped = urdfkin.diff(robot, loaded(write(as_usd(robot, transcoded, Slip("axis sign", "elbow-1")))))
    assert [str(one) for one in flipped.changes] == ["joint elbow-1: axis turned by 3.142 rad"]


def test_diff_compares_all_pairs_of_three_formats(write: Write, tmp_path: Path) -> None:
    robot = urdfkin.load(LONG_SLIDE)
    files = [tmp_path / "arm.urdf", tmp_path / "new.urdf"]
    files[0].write_text(LONG_SLIDE)
    files[1].write_text(LONG_SLIDE.replace('"0.25 0.1 0"', '"0.26 0.1 0"'))
    words = ["diff", *map(str, files), str(write(as_usd(robot)))]
    done = command(*words, "--format", "json")
    assert done.code == 1
    sizes = [[(one["what"], one["size"]) for one in pair["changes"]] for pair in done.data["pairs"]]
    assert sizes == [[("origin x", None)], [], [("origin", "10 mm off")]]
    rounding = [pair["rounding"] is not None for pair in done.data["pairs"]]
    assert rounding == [False, True, False]
    table = command(*words, "--no-effects", "--format", "csv").text.splitlines()
    assert table[0] == "A,B,element,what,old,new,alone"
    assert len(table) == 3
    markdown = command(*words, "--format", "markdown").text
    assert markdown.count("| joint wrist |") == 2
    assert "nothing changed, apart from rounding to single precision" in markdown
    assert command("diff", str(files[0]), words[-1]).code == 0


def test_check_states_the_place_of_a_finding(write: Write) -> None:
    path = write(stage(LINKS + JOINTS.replace("= -90", "= -1.5708").replace("= 180", "= 3.14159")))
    done = command("check", str(path))
    assert done.code == 0
    assert "USD303 warning: prim '/arm/shoulder'" in done.text
    assert command("check", "--strict", str(path)).code == 1
    assert command("check", "--strict", "--ignore", "USD303", str(path)).code == 0
    assert command("check", "--strict", "--select", "USD2", str(path)).code == 0
    run = json.loads(command("check", "--output-format", "sarif", str(path)).text)["runs"][0]
    result = run["results"][0]
    assert run["tool"]["driver"]["rules"][result["ruleIndex"]]["id"] == result["ruleId"] == "USD303"
    ball = write(stage(LINKS + joint("ball", "Spherical", "base", "upper")))
    done = command("check", str(ball))
    assert done.code == 2
    assert "spherical" in done.err


@pytest.mark.parametrize("up", ["Z", "Y"])
def test_newtons_importer_and_kinematics_place_the_links_alike(write: Write, up: str) -> None:
    sim = pytest.importorskip("newton")
    offset = joint(
        "wrist", "Revolute", "lower", "hand",
        'uniform token physics:axis = "X"\npoint3f physics:localPos0 = (0.3, 0.1, -0.2)\n'
        "quatf physics:localRot0 = (0.8, 0, 0.6, 0)\npoint3f physics:localPos1 = (0, 0.4, 0)\n"
        "quatf physics:localRot1 = (0.6, 0.8, 0, 0)",
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
            assert pose(rotation_of([x, y, z, w]))[:3, :3] == pytest.approx(T[:3, :3], abs=1e-5)


def _frames(first: Sequence[float], rotation: Sequence[float] = (1, 0, 0, 0)) -> str:
    """Return the frames of a joint prim: the origin in the first body and a rotation; body 1 has identity."""
    ends = (first, (0, 0, 0)), (rotation, (1, 0, 0, 0))
    origin, turn = [[", ".join(repr(float(x)) for x in one) for one in two] for two in ends]
    return (
        f'uniform token physics:axis = "Z"\n'
        f"point3f physics:localPos0 = ({origin[0]})\n point3f physics:localPos1 = ({origin[1]})\n"
        f"quatf physics:localRot0 = ({turn[0]})\n quatf physics:localRot1 = ({turn[1]})\n"
    )


def _urdf(*joints: tuple[str, str, str, str, str]) -> str:
    """Return a URDF with revolute joints about z and fixed joints: name, kind, parent, child, origin."""
    links = dict.fromkeys(link for joint in joints for link in joint[2:4])
    text = "".join(f'<link name="{link}"/>' for link in links)
    for name, kind, parent, child, origin in joints:
        text += (
            f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
            f'<origin {origin}/><axis xyz="0 0 1"/></joint>'
        )
    return f'<robot name="arm">{text}</robot>'


def _explained(urdf: str, file: Path) -> bool:
    """Return whether single precision explains all differences; the order of the two models has no effect."""
    a, b = loaded(urdf), loaded(file)
    forward, backward = (urdfkin.same(*two, bounds=False) for two in ((a, b), (b, a)))
    assert forward.up_to_single == backward.up_to_single
    return forward.up_to_single


@pytest.mark.parametrize(("error", "explained"), [(0.0, True), (1e-6, False), (1e-4, False)])
def test_the_rounding_of_a_far_link_explains_no_error_of_a_joint_beside_it(
    write: Write, error: float, explained: bool
) -> None:
    """The URDF's elbow follows a link 1 km away; the stage's elbow does not."""
    urdf = _urdf(
        ("turn", "continuous", "base", "b", 'xyz="0 0 0.1"'),
        ("mount", "fixed", "b", "far", 'xyz="1000 0 0"'),
        ("elbow", "continuous", "far", "tip", 'xyz="-999.7 0.1 0.2"'),
    )
    file = write(
        stage(
            body("base", schemas=ROOT) + body("b") + body("far") + body("tip")
            + joint("turn", "Revolute", "base", "b", _frames((0, 0, 0.1)))
            + joint("mount", "Fixed", "b", "far", _frames((1000, 0, 0)))
            + joint("elbow", "Revolute", "b", "tip", _frames((0.3 + error, 0.1, 0.2)))
        )
    )  # fmt: skip
    assert _explained(urdf, file) == explained


@pytest.mark.parametrize(("error", "explained"), [(0.0, True), (3e-5, False)])
def test_the_rounding_of_a_far_joint_explains_no_error_of_the_next(
    write: Write, error: float, explained: bool
) -> None:
    """Only the URDF has the link that carries the second joint."""
    urdf = _urdf(
        ("first", "continuous", "base", "only", 'xyz="1000 0 0" rpy="0.3 0.4 0.5"'),
        ("glue", "fixed", "only", "b", ""),
        ("second", "continuous", "only", "tip", 'xyz="0.3 0.1 0.2"'),
    )
    turned = np.roll(quaternion_of(rotation_from_rpy([0.3, 0.4, 0.5])), 1)
    file = write(
        stage(
            body("base", schemas=ROOT) + body("b") + body("tip")
            + joint("first", "Revolute", "base", "b", _frames((1000, 0, 0), turned.tolist()))
            + joint("second", "Revolute", "b", "tip", _frames((0.3 + error, 0.1, 0.2)))
        )
    )  # fmt: skip
    assert _explained(urdf, file) == explained


@pytest.mark.parametrize("noise", [0.0, 1e-17])
def test_a_quaternion_of_the_identity_explains_no_angle(write: Write, noise: float) -> None:
    urdf = _urdf(("turn", "continuous", "base", "tip", 'xyz="0 0 0.1" rpy="0 1e-7 0"'))
    file = write(
        stage(
            body("base", schemas=ROOT) + body("tip")
            + joint("turn", "Revolute", "base", "tip", _frames((0, 0, 0.1), (1, 0, 0, noise)))
        )
    )  # fmt: skip
    assert not _explained(urdf, file)


@pytest.mark.parametrize(("written", "explained"), [("double3", False), ("float3", True)])
def test_a_translation_in_double_precision_is_not_rounded(
    write: Write, written: str, explained: bool
) -> None:
    urdf = _urdf(
        ("turn", "continuous", "base", "b", 'xyz="0 0 0.1"'),
        ("mount", "fixed", "b", "tool", 'xyz="1000 0 0"'),
    )
    inside = (
        f'def Xform "tool" {{ {written} xformOp:translate = (1000, 2e-5, 0)\n'
        'uniform token[] xformOpOrder = ["xformOp:translate"]\n}'
    )
    file = write(
        stage(
            body("base", schemas=ROOT) + body("b", inside=inside)
            + joint("turn", "Revolute", "base", "b", _frames((0, 0, 0.1)))
        )
    )  # fmt: skip
    assert _explained(urdf, file) == explained
