"""A robot is loaded from any text, file, stream or object of another library, or the error has a reason."""

import importlib
import io
import math
import os
import sys
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryFile
from threading import Thread
from types import ModuleType, SimpleNamespace
from typing import Any
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np
import pinocchio as pin
import pytest
import yourdfpy
from lxml import etree

import urdfkin
from tests.cli.running import python
from tests.cli.running import urdfkin as urdfkin_command
from tests.reading import present
from tests.urdf.lint.cases.arm import arm, axis
from tests.urdfs import joint, limit, loaded
from tests.urdfs import robot as urdf
from urdfkin import InputError, SourceError, UnknownNameError, UrdfError
from urdfkin.errors import OracleError
from urdfkin.system.files import MAX_BYTES, read_standard_input
from urdfkin.urdf.catalogue import catalogue
from urdfkin.urdf.sources import Source, read_source
from urdfkin.verify import conversions

Write = Callable[..., Path]
MOST_HERE = 1000


def test_at_most_one_byte_more_than_the_limit_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    data, large = b"<" * 5000, tmp_path / "large.urdf"
    large.write_bytes(data)
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(data)))
    streams = io.BytesIO(data), io.StringIO(data.decode())
    sources: tuple[Source, ...] = (large, os.fspath(large), *streams, "-", "panda", Path("/dev/zero"))
    for source in sources:
        assert len(read_source(source, MOST_HERE).data) == MOST_HERE + 1
    assert len(read_source("panda").data) > MOST_HERE + 1
    assert MAX_BYTES == 100_000_000


@pytest.mark.parametrize("data", [b"#usda 1.0\n", b"PXR-USDC\x00\x09"])
def test_a_usd_file_as_text_is_refused_with_the_reason(data: bytes) -> None:
    for source in (data, io.BytesIO(data)):
        with pytest.raises(UrdfError, match=r"this is USD, not XML.* a suffix such as \.usda"):
            urdfkin.load(source)


def test_a_folder_that_cannot_be_listed_is_not_called_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(_: Path) -> None:
        raise PermissionError

    monkeypatch.setattr(Path, "iterdir", refuse)
    with pytest.raises(SourceError, match=f"no such file; the folder {tmp_path} cannot be read"):
        read_source(tmp_path / "arm.urdf")


def test_standard_input_is_read_completely_without_a_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(b"0.1,0.2\n0.3,0.4\n")))
    assert read_standard_input() == b"0.1,0.2\n0.3,0.4\n"


def test_a_package_address_is_a_file_or_an_error(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write("<robot/>", "arm_description/urdf/arm.urdf")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(path.parents[2]))
    read = read_source("package://arm_description/urdf/arm.urdf")
    assert (read.data, read.source) == (b"<robot/>", str(path))
    with pytest.raises(SourceError, match=r"^package://nowhere/arm.urdf: the package 'nowhere' is"):
        read_source("package://nowhere/arm.urdf")
    with pytest.raises(SourceError, match=r"^model://nowhere/arm.urdf: the package 'nowhere' is"):
        read_source("model://nowhere/arm.urdf")


@pytest.mark.parametrize("name", ["arm.xml", "arm.usda"])
def test_a_package_address_may_be_an_mjcf_or_usd_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.chdir(tmp_path)
    tool = Path("tool")
    tool.mkdir()
    (tool / "package.xml").write_text("<package><name>tool</name></package>")
    (tool / "arm.xml").write_text(
        '<mujoco><worldbody><body name="a"><joint/><geom size="1"/></body></worldbody></mujoco>'
    )
    (tool / "arm.usda").write_text("#usda 1.0\n")
    address = f"package://tool/{name}"
    if name == "arm.xml":
        assert urdfkin.load(address).origin.source == str(tmp_path / "tool" / name)
        assert "MJCF102" in urdfkin_command("check", address).text
    else:
        with pytest.raises(InputError, match="no joint between bodies"):
            urdfkin.load(address)


def test_no_name_of_the_catalogue_contains_a_dot_or_a_separator() -> None:
    assert not [name for name in catalogue() if set(name) & {".", "/", os.sep}]


# -- parsers -----------------------------------------------------------------------------------------------

FOLLOWS = arm(follow='<mimic joint="j1" multiplier="-0.5"/>')


@pytest.mark.parametrize("text", [arm(), FOLLOWS, axis("1e-13 0 1")], ids=["plain", "follows", "tilted"])
def test_load_parses_the_text_once_and_the_oracle_parses_mimic_rules_again(
    text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    parsers = list[expat.XMLParserType]()
    create = expat.ParserCreate

    def noted(encoding: str) -> expat.XMLParserType:
        parsers.append(create(encoding))
        return parsers[-1]

    monkeypatch.setattr(expat, "ParserCreate", noted)
    robot = urdfkin.load(text)
    assert len(parsers) == 1
    if text == FOLLOWS:
        robot.placement([0.3], "tool")
        assert robot.certificate().verified
        assert len(parsers) == 2


# -- other libraries ---------------------------------------------------------------------------------------

ROBOTS = ("panda", "talos", "ur5", "polar", "kinova")


def file(name: str) -> str:
    return str(catalogue()[name].path)


def yourdfpys(path: str) -> yourdfpy.URDF:
    return yourdfpy.URDF.load(path, build_scene_graph=False, load_meshes=False)


HOLDERS: dict[str, Callable[[str], Any]] = {
    "yourdfpy": yourdfpys,
    "yourdfpy's robot": lambda path: yourdfpys(path).robot,
    "ElementTree": ElementTree.parse,
    "an element": lambda path: ElementTree.parse(path).getroot(),
    "lxml": etree.parse,
    "lxml's element": lambda path: etree.parse(path).getroot(),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("holder", HOLDERS)
def test_an_object_of_another_library_is_the_robot_of_its_file(holder: str, name: str) -> None:
    one, other = loaded(file(name)), loaded(HOLDERS[holder](file(name)))
    assert other.coordinate_names == one.coordinate_names
    q, frames = one.sample(3, seed=1), one.link_frames
    np.testing.assert_allclose(other.placement(q, frames), one.placement(q, frames), atol=3e-14)
    joints = [[(x.name, x.kind, x.mimic, x.limit) for x in robot.tree.joints] for robot in (one, other)]
    assert joints[0] == joints[1]
    assert other.certificate().verified


@pytest.mark.parametrize("holder", HOLDERS)
def test_an_object_of_another_library_has_the_joint_order_of_its_file(holder: str, tmp_path: Path) -> None:
    path = tmp_path / "r.urdf"
    path.write_text(urdf(joint("b", "continuous", "l0", "l1"), joint("a", "continuous", "l0", "l2")))
    robot = loaded(HOLDERS[holder](str(path)))
    assert (robot.joint_names, robot.convention("urdf").joint_names) == (("a", "b"), ("b", "a"))


def test_comments_and_instructions_of_an_element_tree_are_ignored_and_findings_are_reported() -> None:
    text = '<?x y?><robot name="r"><!-- arm --><link name="a"/><link name="b"/></robot>'
    for tree in (etree.fromstring(text), ElementTree.fromstring(text)):
        with pytest.raises(UrdfError, match=r"<ElementTree>.*URDF411"):
            urdfkin.load(tree)


@pytest.mark.parametrize("value", [1.5, "a\0b"])
def test_an_element_tree_that_is_no_xml_is_an_error_of_urdfkin(value: Any) -> None:
    with pytest.raises(urdfkin.UrdfkinError):
        urdfkin.load(ElementTree.Element("robot", {"name": value}))


@pytest.mark.parametrize(
    ("name", "value"),
    [("type", "ball"), ("name", None), ("axis", np.ones(2)), ("limit", None), ("origin", 1)],
)
def test_a_yourdfpy_robot_that_is_no_urdf_is_an_error_of_urdfkin(name: str, value: Any) -> None:
    robot = yourdfpys(file("polar"))
    setattr(robot.robot.joints[0], name, value)
    with pytest.raises(urdfkin.UrdfkinError):
        urdfkin.load(robot)


@pytest.mark.parametrize(
    ("joints", "words"),
    [(0, "1 links agree"), (2, "3 links agree"), (320, "not compared with the model itself: nv is 320")],
)
def test_a_model_without_bodies_is_compared_by_its_joints_if_memory_allows(joints: int, words: str) -> None:
    model = pin.Model()
    for k in range(joints):
        model.addJoint(k, pin.JointModelRX(), pin.SE3.Random(), f"turn_{k}")
    made = loaded(model)
    assert made.link_names == ("universe", *(f"turn_{k}_link" for k in range(joints)))
    assert words in made.verifier.source_notes


def test_an_axis_of_a_yourdfpy_robot_that_is_no_unit_vector_is_a_warning() -> None:
    robot = yourdfpys(file("polar"))
    slide = next(joint for joint in robot.robot.joints if joint.type == "prismatic")
    slide.axis = 2.0 * np.asarray(slide.axis)
    with pytest.warns(urdfkin.UrdfWarning, match="URDF50"):
        urdfkin.load(robot)


def test_a_finding_and_the_certificate_name_a_quaternion_that_yourdfpy_may_have_ignored(write: Write) -> None:
    texts = {}
    for rotation in ('quat_xyzw="0 0 1 0"', 'rpy="0 0 1"', 'xyz="1 2 3"'):
        path = write(urdf(joint("j", "continuous", "a", "b", rotation), attributes='version="1.1"'), "r.urdf")
        robot = urdfkin.load(yourdfpys(str(path)))
        robot.placement([0.0], "b")
        texts[rotation] = [str(f) for f in robot.findings], robot.certificate().source_notes
    assert texts['rpy="0 0 1"'] == ([], "")
    assert texts['xyz="1 2 3"'] == texts['quat_xyzw="0 0 1 0"']
    (finding,), reading = texts['quat_xyzw="0 0 1 0"']
    assert "<yourdfpy>:1:1: URDF512 note: yourdfpy ignores quat_xyzw, so the rotation of joint j " in finding
    assert "instead of the file; yourdfpy ignores the attribute quat_xyzw" in reading


def test_a_yourdfpy_robot_that_is_not_connected_is_refused() -> None:
    robot = yourdfpys(file("polar"))
    robot.robot.joints.pop()
    with pytest.raises(InputError, match="a robot must have one root link"):
        urdfkin.load(robot)


# -- Pinocchio's models --------------------------------------------------------------------------------


def placement(model: Any, q: Any, frame: int) -> Any:
    """Return the placement of a frame by Pinocchio."""
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    return data.oMf[frame].homogeneous


@pytest.mark.slow
@pytest.mark.parametrize("name", [*ROBOTS, "tiago_dual", "anymal"])
def test_a_pinocchio_model_is_the_robot_of_its_urdf(name: str) -> None:
    robot = loaded(file(name), mimic=False)
    made = loaded(pin.buildModelFromUrdf(file(name)))
    assert made.frame_names == robot.frame_names
    assert made.tree.links == robot.tree.links
    assert [joint.parent for joint in made.tree.joints] == [joint.parent for joint in robot.tree.joints]
    for ours, theirs in zip(robot.tree.joints, made.tree.joints, strict=True):
        np.testing.assert_allclose(theirs.T_parent_joint, ours.T_parent_joint, atol=1e-15)
        assert (theirs.kind, theirs.limit) == (ours.kind, ours.limit)
    q, v, a = robot.sample(3, seed=2), *np.random.default_rng(1).standard_normal((2, 3, robot.nv))
    found = made.acceleration(q, v, a, made.tip_frame)
    np.testing.assert_allclose(found, robot.acceleration(q, v, a, made.tip_frame), rtol=1e-10, atol=1e-10)
    assert "compared with the model itself" in str(made.certificate())


def test_a_pinocchio_model_may_have_joints_and_frames_in_any_order() -> None:
    model = pin.Model()
    model.name = "by hand"
    generator = np.random.default_rng(3)
    pin.seed(3)
    axes = generator.standard_normal((2, 3))
    tilted, along = axes / np.linalg.norm(axes, axis=1, keepdims=True)
    last = model.addJoint(0, pin.JointModelPlanar(), pin.SE3.Random(), "z")
    model.addJoint(last, pin.JointModelRevoluteUnaligned(*tilted), pin.SE3.Random(), "b")
    last = model.addJoint(last, pin.JointModelRUBY(), pin.SE3.Random(), "a")
    model.addJoint(last, pin.JointModelPrismaticUnaligned(*along), pin.SE3.Random(), "slide")
    model.addFrame(pin.Frame("tool", last, 0, pin.SE3.Random(), pin.FrameType.OP_FRAME))
    model.addFrame(pin.Frame("tool", last, model.nframes - 1, pin.SE3.Random(), pin.FrameType.SENSOR))
    made = loaded(model)
    assert made.joint_names == ("z", "a", "slide", "b")  # Pinocchio's order for a URDF
    q = made.sample(1, seed=4)[0]
    full = np.zeros(model.nq)
    value = dict(zip(made.coordinate_names, q, strict=True))
    for j in range(1, model.njoints):
        joint, name = model.joints[j], model.names[j]
        own = [value[f"z.{x}"] for x in ("x", "y")] if name == "z" else [] if joint.nq == 2 else [value[name]]
        angle = value["z.angle"] if name == "z" else value.get(name, 0.0)
        own += [math.cos(angle), math.sin(angle)] if joint.nq > 1 else []
        full[joint.idx_q : joint.idx_q + joint.nq] = own
    for frame, link in ((model.nframes - 2, "tool"), (model.nframes - 1, "tool_")):
        np.testing.assert_allclose(made.placement(q, link), placement(model, full, frame), atol=1e-13)


@pytest.mark.parametrize("kind", ["continuous", "revolute", "prismatic"])
def test_a_joint_of_a_pinocchio_model_may_have_any_axis(kind: str) -> None:
    tilted = joint("j", kind, "b", "c", 'xyz="1 2 3"', "0 0.6 -0.8", limit())
    text = urdf(joint("i", "continuous", "a", "b", axis="1 0 0"), tilted)
    robot, made = loaded(text), loaded(pin.buildModelFromXML(text))
    assert made.tree.joints[1].kind == robot.tree.joints[1].kind
    assert made.tree.joints[1].axis.tolist() == [0.0, 0.6, -0.8]
    q = [0.5, 0.3]
    np.testing.assert_allclose(made.placement(q, "c"), robot.placement(q, "c"), atol=1e-15)
    assert made.certificate().verified


def slider(lower: float, upper: float) -> pin.Model:
    model = pin.Model()
    model.name = "slider"
    ends = (np.array([x]) for x in (1.0, 1.0, lower, upper))
    model.addJoint(0, pin.JointModelPX(), pin.SE3.Identity(), "j", *ends)
    return model


def test_only_a_missing_limit_of_a_prismatic_joint_of_a_pinocchio_model_is_replaced() -> None:
    for given, expected in (
        ((-2000.0, math.inf), (-2000.0, 1000.0)), ((-math.inf, 2000.0), (-1000.0, 2000.0)),
        ((-math.inf, math.inf), (-1000.0, 1000.0)), ((2000.0, math.inf), (2000.0, 3000.0)),
    ):  # fmt: skip
        limits = present(loaded(slider(*given)).tree.joints[0].limit)
        assert (limits.lower, limits.upper) == expected


@pytest.mark.parametrize("numbers", [(math.nan, 1.0), (0.0, math.nan)], ids=["lower", "upper"])
def test_a_limit_of_a_pinocchio_model_or_a_yourdfpy_robot_that_is_nan_is_an_error(
    numbers: tuple[float, float],
) -> None:
    with pytest.raises(UrdfError, match="URDF301"):
        urdfkin.load(slider(*numbers))
    written = '<limit lower="{}" upper="{}" effort="1" velocity="1"/>'.format(*numbers)
    robot = yourdfpy.URDF.load(io.BytesIO(urdf(joint("j", "prismatic", "a", "b", more=written)).encode()))
    with pytest.raises(UrdfError, match="URDF301"):
        urdfkin.load(robot)


def test_a_floating_base_of_a_pinocchio_model_is_a_floating_joint() -> None:
    model = pin.buildModelFromUrdf(file("a1"), pin.JointModelFreeFlyer())
    made = loaded(pin.RobotWrapper(model))
    assert (made.nq, made.nv) == (model.nq, model.nv)
    assert made.coordinate_names == loaded(file("a1"), root_joint="floating").coordinate_names


def test_joints_of_a_pinocchio_model_without_an_equivalent_are_refused() -> None:
    for kind in (pin.JointModelSpherical, pin.JointModelTranslation):
        model = pin.Model()
        model.addJoint(0, kind(), pin.SE3.Identity(), "wrist")
        with pytest.raises(InputError, match="joint wrist: URDF has no equivalent of this joint"):
            urdfkin.load(model)
    with pytest.raises(InputError, match=r"mimic joint.*build the model with mimic=False"):
        urdfkin.load(pin.buildModelFromUrdf(file("panda"), mimic=True))


@pytest.mark.parametrize("number", [(0, 1), (0, 3)], ids=["turned", "moved"])
def test_an_error_of_the_conversion_slightly_above_the_rounding_bound_is_found(
    number: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    right = conversions._compute_model_placements

    def moved(*arguments: Any) -> Any:
        T = right(*arguments)
        assert np.linalg.norm(T[0, -1, :3, 3]) > 0.1  # at the root, the bound is zero
        T[:, -1, *number] += 3e-13
        return T

    monkeypatch.setattr(conversions, "_compute_model_placements", moved)
    with pytest.raises(OracleError, match=r"made from a pinocchio.Model differs from the model"):
        urdfkin.load(pin.buildModelFromUrdf(file("ur5")))


@pytest.mark.parametrize(
    ("name", "root_joint"), [("ur5", None), ("kinova", None), ("a1", "floating"), ("a1", "planar")]
)
def test_pinocchio_model_returns_a_new_model_of_the_robot(name: str, root_joint: str | None) -> None:
    robot = loaded(file(name), root_joint=root_joint)
    model, again = robot.pinocchio_model(), robot.pinocchio_model()
    assert model is not again
    q, tip = robot.sample(1, seed=5)[0], robot.tip_frame
    T = placement(model, robot.to_pinocchio(q), model.getFrameId(tip))
    np.testing.assert_allclose(T, robot.placement(q, tip), atol=1e-13)


def test_pinocchio_model_has_mimic_joints_on_request() -> None:
    robot = urdfkin.load("panda")
    model = robot.pinocchio_model(mimic=True)
    assert model.nq == robot.nq == robot.pinocchio_model().nq - 1
    q = robot.sample(1)[0]
    T = placement(model, robot.to_pinocchio(q, mimic=True), model.getFrameId("panda_rightfinger"))
    np.testing.assert_allclose(T, robot.placement(q, "panda_rightfinger"), atol=1e-14)


def test_a_robot_that_pinocchio_refuses_has_no_model() -> None:
    with pytest.warns(urdfkin.UrdfWarning):
        robot = urdfkin.load('<robot name="r"><?x y?><link name="a"/></robot>')
    with pytest.raises(OracleError, match="Pinocchio refuses the file"):
        robot.pinocchio_model()


# -- robot_descriptions --------------------------------------------------------------------------------


@pytest.fixture
def package(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    """Create a package robot_descriptions with a robot, and with descriptions that cannot be loaded."""
    names = ["toy_description", "far_description", "empty_description"]
    texts = {
        "toy_description": f"URDF_PATH = {file('polar')!r}",
        "far_description": "raise RuntimeError('clone failed\\nfatal: no route to host')",
        "empty_description": "",
        "other_description": "raise AssertionError('imported')",
        "__init__": f"DESCRIPTIONS = dict.fromkeys({names!r})",
    }
    path, *_ = (write(text, f"robot_descriptions/{name}.py") for name, text in texts.items())
    monkeypatch.syspath_prepend(path.parents[1])
    for name in [name for name in sys.modules if name.startswith("robot_descriptions")]:
        monkeypatch.delitem(sys.modules, name)


@pytest.mark.usefixtures("package")
def test_a_description_is_loaded_by_its_name_and_by_its_module() -> None:
    assert urdfkin.load("toy_description").name == "polar"
    assert urdfkin.load(importlib.import_module("robot_descriptions.toy_description")).name == "polar"
    for name in ("toy_description", "far_description", "empty_description"):
        sys.modules.pop(f"robot_descriptions.{name}", None)
    sys.modules.pop("robot_descriptions")


@pytest.mark.usefixtures("package")
def test_an_invalid_description_is_an_error_and_no_unlisted_module_is_imported() -> None:
    for name, error, words in (
        ("toys", UnknownNameError, "unknown robot description 'toys_description'; did you mean toy_desc"),
        ("other", UnknownNameError, "unknown"),  # a module that is not in DESCRIPTIONS
        ("far", SourceError, r"cannot be downloaded: found fatal: no route to host; .*the network"),
        ("empty", InputError, "neither URDF_PATH nor XACRO_PATH nor MJCF_PATH"),
    ):
        with pytest.raises(error, match=words):
            urdfkin.load(f"{name}_description")
    sys.modules.pop("robot_descriptions")


@pytest.mark.slow
def test_a_description_module_with_a_xacro_file_has_default_arguments(write: Write) -> None:
    inside = '<xacro:arg name="tool" default="none"/><link name="base_$(arg tool)"/>'
    text = f'<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">{inside}</robot>'
    module = ModuleType("arm_description")
    module.__dict__.update(XACRO_PATH=str(write(text, "arm.xacro")), XACRO_ARGS={"tool": "gripper"})
    assert urdfkin.load(module).link_names == ("base_gripper",)
    assert urdfkin.load(module, xacro_args={"tool": "saw"}).link_names == ("base_saw",)


@pytest.mark.slow
def test_without_robot_descriptions_the_error_names_the_package_to_install() -> None:
    done = python(
        "import sys\nsys.modules['robot_descriptions'] = None\nimport importlib.util as u\n"
        "find = u.find_spec\nu.find_spec = lambda name: None if name.startswith('robot_d') else find(name)\n"
        "import urdfkin\ntry: urdfkin.load('panda_description')\nexcept urdfkin.InputError as e: print(e)"
    )
    assert done.stdout.startswith("panda_description: robot_descriptions is not installed; pip install")


def test_a_file_named_like_a_description_is_loaded(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(write(urdfkin.load("polar", verify=False).urdf, "my_description").parent)
    assert urdfkin.load("my_description").name == "polar"


def test_a_stream_that_cannot_be_read_is_an_error_of_urdfkin(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_bytes(arm().replace("<robot", "<!-- \xe9 --><robot").encode("latin-1"))
    closed = io.StringIO(arm())
    closed.close()
    for read in (urdfkin.load, urdfkin.check):
        with pytest.raises(SourceError, match=r"<file>: cannot be read: .*closed file.*; open the file"):
            read(closed)
        with path.open() as text, pytest.raises(SourceError, match=r"arm.urdf: .*open the file in binary"):
            read(text)
        with (tmp_path / "new").open("w") as new, pytest.raises(SourceError, match="not readable"):
            read(new)
        with pytest.raises(InputError, match="must return text or bytes: found NoneType"):
            read(SimpleNamespace(read=lambda _: None))


def test_an_unbuffered_stream_is_read_completely() -> None:
    text = arm().encode() + b" " * 200_000 + b"<!-- the end -->"
    reader, writer = os.pipe()

    def write_text() -> None:
        with os.fdopen(writer, "wb") as other:
            other.write(text)

    thread = Thread(target=write_text)
    with os.fdopen(reader, "rb", buffering=0) as stream:
        thread.start()
        assert read_source(stream).data == text
        thread.join()


def test_the_source_of_a_stream_is_never_the_name_of_another_robot(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("panda").write_text(arm())
    with Path("panda").open() as stream:
        robot = urdfkin.load(stream)
    assert robot.origin.source == "./panda"
    assert urdfkin.load(robot.origin.source).name == robot.name
    with TemporaryFile("w+") as stream:
        stream.write(arm())
        stream.seek(0)
        assert urdfkin.load(stream).origin.source == "<file>"
