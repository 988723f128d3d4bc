"""How other libraries read a file: the element that causes a difference is named."""

import json
from pathlib import Path

import numpy as np
import pytest

import urdfkin
from scripts.make_libraries import FEATURES
from tests.cli.running import urdfkin as run
from tests.comparison.pairs import files_of
from urdfkin.comparison import readers
from urdfkin.comparison.readers import compare_readers

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore::urdfkin.UrdfWarning")]
pytest.importorskip("mujoco")
ROTATED = "has a different rotation at q = 0"
TEXTS = {name: feature.text for name, feature in FEATURES.items()}


@pytest.mark.parametrize(
    ("feature", "library", "joint", "element", "words"),
    [
        ("mimic", "mujoco", "j2", "mimic", "MuJoCo leaves the joint free"),
        ("mimic of a mimic", "yourdfpy", "j3", "mimic", "yourdfpy applies a different mimic rule"),
        ("prismatic, axis of length 2", "yourdfpy", "j2", "axis", "yourdfpy moves the joint 2 times as far"),
        ("quat_xyzw (URDF 1.1)", "mujoco", "j2", "origin quat_xyzw", f"MuJoCo {ROTATED}"),
    ],
)
def test_the_element_that_explains_a_difference_is_named(
    feature: str, library: str, joint: str, element: str, words: str
) -> None:
    (found,) = compare_readers(urdfkin.load(TEXTS[feature]), [library])
    assert found.refused is None
    assert [(one.joint, one.element, one.words) for one in found.differences] == [(joint, element, words)]
    assert not found.agrees
    assert found.worst > 0.1


#: The end of the second joint's origin, and the beginning of its axis.
ANGLES = ' rpy="0.1 0.2 0.3"/><axis xyz="0 1'


@pytest.mark.parametrize(
    ("change", "element", "words"),
    [
        (('xyz="0 1 0"', 'xyz="0 -1 0"'), "axis", "X turns the joint in the opposite direction"),
        (('xyz="0 1 0"', 'xyz="0.6 0 0.8"'), "axis", "X uses a different joint axis: 0.6 0 0.8"),
        (('type="revolute">\n  <parent link="a"', 'type="prismatic">\n  <parent link="a"'), "axis", None),
        (('3"/><axis xyz="0 1 0"', '4"/><axis xyz="0 1 0"'), "origin rpy", None),
        ((f'.3"{ANGLES}', f'.4"{ANGLES}'), "origin xyz", None),
    ],
)  # fmt: skip
def test_a_changed_element_is_named(
    change: tuple[str, str], element: str, words: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = TEXTS["two revolute"]
    assert text.count(change[0]) == 1
    monkeypatch.setattr(readers, "_library_input", lambda _: (text.replace(*change), "urdf"))
    (found,) = compare_readers(urdfkin.load(text), ["pinocchio"])
    (one,) = found.differences
    assert (one.joint, one.element) == ("j2", element)
    assert words is None or one.words == words.replace("X", "Pinocchio")


@pytest.mark.parametrize("library", ["pinocchio", "mujoco", "yourdfpy"])
@pytest.mark.parametrize("robot", ["a1", "ur5"])
def test_libraries_agree_on_robots_without_special_features(robot: str, library: str) -> None:
    (found,) = compare_readers(urdfkin.load(robot), [library])
    assert found.agrees, found


def test_an_added_root_joint_is_no_difference_and_a_locked_joint_is_an_error() -> None:
    robot = urdfkin.load(TEXTS["two revolute"], root_joint="floating")
    (found,) = compare_readers(robot, ["yourdfpy"])
    assert found.agrees, found
    assert (found.same_order, found.missing) == (True, ())
    with pytest.raises(urdfkin.InputError, match="cannot lock joints"):
        compare_readers(urdfkin.load(TEXTS["two revolute"]).with_locked_joints({"j1": 0.1}), ["yourdfpy"])


def test_an_mjcf_file_is_read_by_mujoco_and_by_no_reader_of_urdf(tmp_path: Path) -> None:
    path = tmp_path / "robot.xml"
    path.write_text(
        '<mujoco><worldbody><body name="a" pos="0 0 1"><joint name="j" axis="0 0 1"/><geom size="0.1"/>'
        '<body name="b" pos="1 0 0" euler="10 20 30"><joint name="k" type="slide" axis="0 1 0"/>'
        '<geom size="0.1"/></body></body></worldbody></mujoco>'
    )
    mujoco, yourdfpy = compare_readers(urdfkin.load(str(path)), ["mujoco", "yourdfpy"])
    assert mujoco.agrees, mujoco
    assert mujoco.joints == ("j", "k")
    assert yourdfpy.refused == "the adapter of the library does not read MJCF"
    assert {one.library for one in compare_readers(urdfkin.load(str(path)))} <= {"Pinocchio", "MuJoCo"}


TWO_HINGES = (
    '<mujoco><worldbody><body name="a"><joint name="x" axis="0 0 1"/><joint name="y" axis="0 1 0"/>'
    '<geom size="0.1"/></body></worldbody></mujoco>'
)


@pytest.mark.parametrize("root_joint", [None, "floating"])
@pytest.mark.parametrize("library", ["pinocchio", "mujoco"])
def test_the_motion_of_the_first_body_of_an_mjcf_file_is_compared(
    tmp_path: Path, library: str, root_joint: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, other = tmp_path / "robot.xml", tmp_path / "other.xml"
    path.write_text(TWO_HINGES)
    other.write_text(TWO_HINGES.replace("0 0 1", "1 0 0"))
    robot = urdfkin.load(str(path), root_joint=root_joint)
    (found,) = compare_readers(robot, [library])
    assert found.agrees, found
    assert (found.joints, found.same_order, found.missing) == (("x", "y"), True, ("x_link",))
    monkeypatch.setattr(readers, "_library_input", lambda _: (str(other), "mjcf"))
    (found,) = compare_readers(robot, [library])
    assert found.worst > 0.1


def test_mujoco_and_urdfkin_use_the_same_names_for_mjcf_elements_without_a_name(tmp_path: Path) -> None:
    path = tmp_path / "robot.xml"
    path.write_text('<mujoco><worldbody><body><joint/><geom size="0.1"/></body></worldbody></mujoco>')
    (found,) = compare_readers(urdfkin.load(str(path)), ["mujoco"])
    assert found.agrees, found
    assert (found.joints, found.missing) == (("joint0",), ())


@pytest.mark.parametrize("source", [TWO_HINGES, TWO_HINGES.encode()], ids=["text", "bytes"])
def test_mjcf_without_a_file_is_an_error(source: str | bytes) -> None:
    with pytest.raises(urdfkin.InputError, match="other libraries read MJCF only from a file"):
        compare_readers(urdfkin.load(source))


USD = """#usda 1.0
( metersPerUnit = 1
  upAxis = "Z" )
def Xform "arm" (prepend apiSchemas = ["PhysicsArticulationRootAPI"]) {
  def Xform "base" (prepend apiSchemas = ["PhysicsRigidBodyAPI"]) {}
  def Xform "upper" (prepend apiSchemas = ["PhysicsRigidBodyAPI"]) {
    double3 xformOp:translate = (0, 0, 0.5)
    uniform token[] xformOpOrder = ["xformOp:translate"]
  }
  def PhysicsFixedJoint "mount" {
    rel physics:body1 = </arm/base>
  }
  def PhysicsRevoluteJoint "shoulder" {
    uniform token physics:axis = "Y"
    rel physics:body0 = </arm/base>
    rel physics:body1 = </arm/upper>
    point3f physics:localPos0 = (0, 0, 0.5)
    float physics:lowerLimit = -90
    float physics:upperLimit = 90
  }
}
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "arm.usda"


def from_usd(path: Path, text: str) -> urdfkin.Robot:
    pytest.importorskip("pxr")
    path.write_text(text)
    return urdfkin.load(str(path))


def let_newton_read(path: Path, text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the library read another text than urdfkin has read."""
    path.write_text(text)
    monkeypatch.setattr(readers, "_library_input", lambda _: (str(path), "usd"))


def test_a_usd_file_is_read_by_newton_only(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = from_usd(path, USD)
    monkeypatch.setattr(readers, "version", lambda name: None if name == "newton" else "1.0")
    with pytest.raises(urdfkin.InputError, match=r"no installed library reads USD.*pip install newton"):
        compare_readers(robot)
    assert compare_readers(robot, ["yourdfpy"])[0].refused == "the adapter of the library does not read USD"


def test_newton_reads_a_usd_file_like_urdfkin(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("newton")
    robot = from_usd(path, USD)
    (found,) = compare_readers(robot)
    assert (found.agrees, found.joints, found.missing) == (True, ("shoulder",), ())
    moved = USD.replace("(0, 0, 0.5)\n    float", "(0, 0, 0.501)\n    float")
    let_newton_read(path, moved, monkeypatch)
    (found,) = compare_readers(robot)
    assert [one.joint for one in found.differences] == ["shoulder"]
    assert found.worst == pytest.approx(1e-3, rel=1e-2)


#: A hand whose joint mimics the shoulder. The axis misses the hand's origin, so urdfkin adds a link.
HAND = (
    USD.rstrip().removesuffix("}")
    + """
  def Xform "hand" (prepend apiSchemas = ["PhysicsRigidBodyAPI"]) {
    double3 xformOp:translate = (0.3, 0, 0.4)
    uniform token[] xformOpOrder = ["xformOp:translate"]
  }
  def PhysicsRevoluteJoint "wrist" (prepend apiSchemas = ["NewtonMimicAPI"]) {
    uniform token physics:axis = "X"
    rel physics:body0 = </arm/upper>
    rel physics:body1 = </arm/hand>
    point3f physics:localPos0 = (0.3, 0, 0)
    point3f physics:localPos1 = (0, 0, 0.1)
    rel newton:mimicJoint = </arm/shoulder>
    float newton:mimicCoef0 = 30
    float newton:mimicCoef1 = -2
  }
}
"""
)


def test_newton_moves_mimic_joints_and_lacks_no_link_that_urdfkin_added(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("newton")
    robot = from_usd(path, HAND)
    assert set(robot.link_names) == {"base", "upper", "hand", "wrist_link", "world"}
    (found,) = compare_readers(robot)
    assert (found.agrees, found.joints, found.missing) == (True, ("shoulder",), ())
    assert found.same_order
    let_newton_read(path, HAND.replace("mimicCoef1 = -2", "mimicCoef1 = -2.1"), monkeypatch)
    assert compare_readers(robot)[0].worst > 0.01
    plain = HAND.replace("(0, 0, 0.1)", "(0, 0, 0)").replace("(0.3, 0, 0.4)", "(0.3, 0, 0.5)")
    robot = from_usd(path, plain)
    path.write_text(plain.replace('(prepend apiSchemas = ["NewtonMimicAPI"])', ""))
    (one,) = compare_readers(robot)[0].differences
    assert (one.joint, one.words) == ("wrist", "Newton leaves the joint free")


def test_a_body_that_a_library_lacks_is_missing_and_a_link_without_a_prim_is_not(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = from_usd(path, HAND)
    poses = [{"base": np.eye(4).tolist()}] * 3
    answer = json.dumps({"joints": ["shoulder"], "poses": poses}).encode()
    monkeypatch.setattr(readers, "version", lambda _: "1.0")
    monkeypatch.setattr(readers, "run_python", lambda *_: (answer, 0))
    (found,) = compare_readers(robot, ["newton"], samples=2)
    assert found.missing == ("upper", "hand")


def test_a_library_that_hangs_or_crashes_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = urdfkin.load(TEXTS["mimic"])
    monkeypatch.setattr(readers, "python_command", lambda _: ["/bin/sh", "-c", "kill -11 $$"])
    assert compare_readers(robot, ["yourdfpy"])[0].refused == "its process ended with -11"
    monkeypatch.setattr(readers, "python_command", lambda _: ["/bin/sh", "-c", "sleep 20"])
    monkeypatch.setattr(readers, "_TIMEOUT", 0.2)
    assert compare_readers(robot, ["yourdfpy"])[0].refused == "no answer in 0.2 s"


def test_the_command_readers_prints_and_writes_every_format(tmp_path: Path) -> None:
    (path,) = files_of(tmp_path, TEXTS["mimic"])
    done = run("readers", path, "--with", "mujoco,yourdfpy")
    assert done.code == 1
    assert "MuJoCo leaves the joint free" in done.text
    data = run("readers", path, "--with", "mujoco,yourdfpy", "--format", "json").data
    assert [one["library"] for one in data["readers"]] == ["MuJoCo", "yourdfpy"]
    assert json.dumps(data)
    assert run("readers", path, "--with", "mujoco", "--format", "csv").text.count("\n") == 2
    assert run("readers", path, "--with", "yourdfpy").code == 0
    assert "did you mean" in run("readers", path, "--with", "mujocco").err
