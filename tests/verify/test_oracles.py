"""The libraries that check urdfkin: Pinocchio, MuJoCo, and yourdfpy as the second reader."""

import sys
import warnings
from collections.abc import Callable
from dataclasses import replace
from functools import reduce
from pathlib import Path
from types import ModuleType
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

import urdfkin
from scripts.fuzzing import robots
from tests import urdfs
from tests.cli.running import process
from tests.random_chains import shift
from tests.urdf.lint.cases.arm import arm, fixed
from tests.urdfs import joint, loaded, mimic
from urdfkin.errors import InstallationError, UnknownNameError
from urdfkin.model.configuration import draw_base_motion
from urdfkin.model.reference import Reference
from urdfkin.urdf.catalogue import catalogue
from urdfkin.validation.campaign import validate
from urdfkin.validation.document import ValidationVerdict
from urdfkin.verify import oracles, second_reader
from urdfkin.verify.mujoco import MujocoOracle
from urdfkin.verify.pinocchio import pinocchio, version
from urdfkin.verify.second_reader import SecondReading, compare_with_yourdfpy
from urdfkin.verify.verifier import NotVerifiedWarning


@pytest.fixture
def impostor(tmp_path: Path) -> str:
    """Return a folder, for the start of Python's path, with PyPI's project `pinocchio` (plugins for nose)."""
    (tmp_path / "pinocchio").mkdir()
    (tmp_path / "pinocchio" / "__init__.py").write_text('__version__ = "0.1"\n')
    about = tmp_path / "pinocchio-0.5.1.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: pinocchio\nVersion: 0.5.1\n")
    (about / "RECORD").write_text("pinocchio/__init__.py,,\npinocchio-0.5.1.dist-info/METADATA,,\n")
    return str(tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize(
    "words", ["jacobian elbow --q random", "validate elbow --samples 1", "dh elbow", "--version"]
)
def test_another_project_named_pinocchio_is_reported_with_the_remedy(impostor: str, words: str) -> None:
    done = process(*words.split(), PYTHONPATH=impostor)
    assert done.code == 2, "1 would mean a disagreement"
    assert "pinocchio 0.5.1, another project" in done.err
    assert "pip uninstall pinocchio; pip install 'pin>=4,<5'" in done.err
    assert len(done.err.splitlines()) == 1
    assert "Traceback" not in done.err
    assert "4.1.0" not in done.text + done.err


@pytest.mark.slow
def test_another_project_named_pinocchio_does_not_matter_without_verification(impostor: str) -> None:
    done = process("placement", "elbow", "--no-verify", PYTHONPATH=impostor)
    assert done.code == 3
    assert "NOT VERIFIED" in done.text


@pytest.mark.slow
def test_a_file_pinocchio_py_on_the_python_path_is_reported(tmp_path: Path) -> None:
    (tmp_path / "pinocchio.py").write_text("")
    done = process("--version", PYTHONPATH=str(tmp_path))
    assert f"rename or remove {tmp_path / 'pinocchio.py'}" in done.err


def module(**words: object) -> ModuleType:
    made = ModuleType("pinocchio")
    made.__dict__.update({"__file__": "/there/pinocchio/__init__.py"} | words)
    return made


def test_the_reported_pinocchio_version_is_that_of_the_imported_module(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "pinocchio", module(buildModelFromXML=None, __version__="4.98.7"))
    assert version() == "4.98.7"


def test_an_older_pinocchio_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pinocchio", module(buildModelFromXML=None, __version__="3.9.0"))
    with pytest.raises(InstallationError, match=r"needs Pinocchio 4 .*: found 3\.9\.0; pip install 'pin"):
        pinocchio()
    assert version() == "not installed"


def test_without_pinocchio_the_error_names_the_package_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pinocchio", None)
    robot = urdfkin.load("elbow")
    with pytest.raises(InstallationError, match="pip install 'pin>=4,<5'"):
        robot.placement(robot.neutral(), "tool")


# -- muJoCo as the oracle: it reads the robot itself and computes the same, or states why it cannot ----------


SUBJECTS: dict[str, tuple[str, dict[str, Any]]] = {
    "an arm": (arm(axis='<axis xyz="1 2 -3"/>'), {}),
    "a slide": (arm(attributes='type="prismatic"'), {}),
    "a planar joint below a floating one": (
        arm(attributes='type="floating"', axis="", limit="", second='type="planar"'), {},
    ),
    "a follower": (arm(follow='<mimic joint="j1" multiplier="-2" offset="0.3"/>'), {}),
    "a follower set free": (arm(follow='<mimic joint="j1" multiplier="-2"/>'), {"mimic": False}),
    "names that MuJoCo takes": (
        arm(base='<link name="base"/><link name="world"/>', more=fixed("l1", "tool", "world")), {},
    ),
    "hung from a floating joint": (arm(), {"root_joint": "floating"}),
    "hung from a planar joint": (arm(), {"root_joint": "planar"}),
}  # fmt: skip


def ask_everything(robot: urdfkin.Robot, n: int, base: urdfkin.BaseMotion | None) -> None:
    rng = np.random.default_rng(1)
    q, (v, a), frames = robot.sample(n), rng.normal(size=(2, n, robot.nv)), robot.all_frames
    robot.placement(q, frames, base=base)
    for reference in Reference:
        robot.velocity(q, v, frames, reference, base=base)
        robot.jacobian(q, frames, reference, base=base)
        robot.jacobian_rate(q, v, frames, reference, base=base)
        robot.acceleration(q, v, a, frames, reference, base=base)
    robot.analytical_jacobian(q, frames[-1], "quaternion", base=base)


@pytest.mark.slow
@pytest.mark.parametrize("name", SUBJECTS)
@pytest.mark.parametrize("far", [None, 1.0, 1e6], ids=lambda far: f"base {far}")
def test_mujoco_agrees_for_every_quantity_and_reference_frame(name: str, far: float | None) -> None:
    text, options = SUBJECTS[name]
    robot, base = loaded(text, oracle="mujoco", **options), None
    if far is not None:
        base = draw_base_motion(1, np.random.default_rng(0))
        base = replace(base, placement=shift(far, far, far) @ base.placement)
    ask_everything(robot, 5, base)
    certificate = robot.certificate()
    assert certificate.verified, certificate
    assert certificate.oracle == f"MuJoCo {oracles.MUJOCO.version()}"
    assert "checked by MuJoCo" in str(certificate)
    assert all(line.worst < 40.0 for line in certificate.lines), certificate


@pytest.mark.slow
@pytest.mark.parametrize("name", catalogue())
def test_mujoco_agrees_for_every_robot_of_the_catalogue(name: str) -> None:
    robot = urdfkin.load(name, oracle="mujoco")
    q = robot.sample(1)
    v, a = np.random.default_rng(0).normal(size=(2, 1, robot.nv))
    robot.jacobian_rate(q, v, robot.link_frames)
    robot.acceleration(q, v, a, robot.link_frames)
    assert robot.certificate().verified


@pytest.mark.slow
@pytest.mark.parametrize("family", robots.FAMILIES)
def test_mujoco_agrees_for_unusual_robots_or_a_reason_is_given(family: str) -> None:
    agreed = 0
    for number in range(4):
        case = robots.make_robot(7, family, number)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            try:
                robot = urdfkin.load(case.data, root_joint=case.root_joint, mimic=case.mimic, oracle="mujoco")
            except urdfkin.UrdfError:
                continue
            ask_everything(robot, 2, None)
        certificate = robot.certificate()
        agreed += certificate.verified
        reasons = " ".join(str(w.message) for w in caught if w.category is NotVerifiedWarning)
        assert certificate.verified or "MuJoCo does not" in reasons, certificate
    assert agreed


def test_a_jacobian_without_a_lever_arm_is_zero_and_verified_by_mujoco() -> None:
    far = fixed("far", "l1", "end").replace("</joint>", '<origin xyz="1e60 0 0"/></joint>')
    text = arm(origin='<origin rpy="0.1 0.2 0.3"/>', more=f'<link name="end"/>{far}')
    with pytest.warns(urdfkin.UrdfWarning):
        robot = urdfkin.load(text, oracle="mujoco")
    J = robot.jacobian([0.3, 0.4], "link:l1")
    assert (J[:3] == 0.0).all()
    assert robot.certificate().verified


def test_a_too_deep_chain_is_not_passed_to_mujoco() -> None:
    joints = (fixed(f"j{i}", f"l{i}", f"l{i + 1}") for i in range(1_101))
    robot = urdfkin.load(urdfs.robot(*joints), oracle="mujoco")
    with pytest.warns(NotVerifiedWarning, match=r"chains of up to 1,000 links: found 1,101"):
        robot.placement([], "l9")


def test_mujoco_can_check_a_file_that_pinocchio_refuses() -> None:
    with pytest.warns(urdfkin.UrdfWarning, match="URDF303"):
        robot = urdfkin.load(arm(origin='<origin xyz="0\t0 1"/>'), oracle="mujoco")
    robot.placement(robot.neutral(), "tool")
    assert robot.certificate().verified


@pytest.mark.parametrize("quantity", ["placement", "jacobian", "velocity"])
def test_the_error_about_a_disagreement_with_mujoco_names_mujoco(
    quantity: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    method = {"velocity": "velocities"}.get(quantity, f"{quantity}s")
    right = getattr(MujocoOracle, method)
    monkeypatch.setattr(MujocoOracle, method, lambda *given: right(*given) + 1e-9)
    robot = urdfkin.load(arm(), oracle="mujoco")
    inputs = (robot.neutral(),) if quantity != "velocity" else (robot.neutral(), [1.0, 1.0])
    with pytest.raises(urdfkin.VerificationError, match="disagrees with MuJoCo's") as caught:
        robot.compute(quantity, inputs, "tool")
    assert "oracle" in str(caught.value), "the line that reproduces it asks MuJoCo again"


def test_an_attribute_that_mujoco_does_not_read_is_a_reason_for_no_verification() -> None:
    text = arm(robot='name="r" version="1.1"', origin='<origin quat_xyzw="0 0 1 0"/>')
    with pytest.warns(urdfkin.UrdfWarning):
        robot = urdfkin.load(text, oracle="mujoco")
    with pytest.warns(NotVerifiedWarning, match="MuJoCo does not read the attribute quat_xyzw"):
        robot.placement(robot.neutral(), "tool")
    assert not robot.certificate().verified


def test_an_unknown_oracle_is_an_error_with_the_nearest_name() -> None:
    with pytest.raises(UnknownNameError, match=r"unknown oracle 'mujuco'.*did you mean mujoco"):
        urdfkin.load(arm(), oracle="mujuco")  # type: ignore[arg-type]


def test_the_error_about_a_missing_oracle_names_the_package_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("urdfkin.urdf.mujoco.installed_version", lambda _: None)
    with pytest.raises(urdfkin.InputError, match=r"MuJoCo is not installed; pip install 'mujoco>=4,<5'"):
        urdfkin.load(arm(), oracle="mujoco")


# -- yourdfpy reads each URDF a second time, and a different tree is reported --------------------------------


_ENDS = '<limit lower="-1" upper="2" effort="3" velocity="4"/>'
ARM = urdfs.robot(
    joint("turn", "revolute", "base", "a", 'xyz="0.1 0.2 0.3" rpy="0.1 -0.2 2.5"', more=_ENDS),
    joint("slide", "prismatic", "a", "b", axis="1 0 0", more=_ENDS + mimic("turn", 0.5, 0.25)),
    joint("tool", "fixed", "b", "c", axis=""),
    name="arm",
)


def reading(text: str, **how: Any) -> SecondReading:
    robot = loaded(text, verify=False, **how)
    added = robot.root_joint is not None
    return compare_with_yourdfpy(robot.urdf, robot.tree, mimic=robot.verifier.mimic, root_joint=added)


QUICK = ("panda", "talos", "elbow")


@pytest.mark.parametrize(
    "name", [*QUICK, *(pytest.param(x, marks=pytest.mark.slow) for x in catalogue() if x not in QUICK)]
)
def test_both_urdf_readers_agree_on_every_robot_of_the_catalogue(name: str) -> None:
    robot = loaded(name, verify=False)
    found = compare_with_yourdfpy(robot.urdf, robot.tree, mimic=robot.verifier.mimic)
    assert (found.differences, found.unread) == ((), None)
    assert found.joints == len(robot.tree.joints)
    assert name not in QUICK or not found.known


@pytest.mark.parametrize("how", [{}, {"mimic": False}, {"root_joint": "floating"}])
def test_options_of_load_cause_no_difference_between_the_readers(how: dict[str, Any]) -> None:
    assert reading(ARM, **how).differences == ()


def more(x: float, *at: int) -> Callable[[Any], Any]:
    """Return a function that adds `x` to one number of an array."""
    return lambda array: array + x * np.equal(np.indices(array.shape).T, at).all(axis=-1).T


#: Attribute of a joint that yourdfpy reads, a change of the attribute, and the reported difference.
PLANTED: dict[str, tuple[str, Callable[[Any], Any], str]] = {
    "axis": ("axis", more(1e-9, 1), "joint turn: axis"),
    "origin": ("origin", more(1e-12, 0, 3), "joint turn: origin"),
    "rotation": ("origin", more(1e-14, 0, 0), "joint turn: rotation"),
    "limit": ("limit.upper", lambda _: 2.5, "joint turn: limit"),
    "parent": ("parent", lambda _: "c", "joint turn: from c to a"),
    "name": ("name", lambda _: "other", "joint turn: yourdfpy finds 0, urdfkin finds 1"),
    "kind": ("type", lambda _: "continuous", "joint turn: type continuous, not revolute"),
    "mimic rule": ("mimic.multiplier", lambda x: 2.0 * x, "joint slide: mimic rule"),
}


def plant(monkeypatch: pytest.MonkeyPatch, what: str) -> str:
    """Let yourdfpy read a joint wrongly; return the difference to report."""
    right, (attribute, change, words) = second_reader.read_with_yourdfpy, PLANTED[what]

    def wrong(text: str) -> Any:
        robot = right(text)
        *owners, name = attribute.split(".")
        owner = reduce(getattr, owners, next(j for j in robot.joints if words.startswith(f"joint {j.name}:")))
        setattr(owner, name, change(getattr(owner, name)))
        return robot

    monkeypatch.setattr(second_reader, "read_with_yourdfpy", wrong)
    return words


@pytest.mark.parametrize("what", PLANTED)
def test_an_error_of_the_second_reader_is_reported_as_a_difference(
    what: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = plant(monkeypatch, what)
    found = reading(ARM).differences
    assert any(words in text for text in found)
    assert len(found) == 1 or what != "mimic rule"


def test_a_different_axis_of_the_second_reader_fails_the_validation(monkeypatch: pytest.MonkeyPatch) -> None:
    words = plant(monkeypatch, "axis")
    (robot,) = validate(ARM, samples=0).robots
    assert robot.verdict is ValidationVerdict.DISAGREES
    assert "yourdfpy" in str(robot.reason)
    assert words in str(robot.reason)
    assert robot.failed == 0


def test_known_faults_of_the_second_reader_are_listed_and_are_no_differences() -> None:
    text = ARM.replace('axis xyz="0 0 1"', 'axis xyz="0 0 2"')
    text = text.replace("<robot", '<robot version="1.2"').replace('rpy="0.1 -0.2 2.5"', 'quat_xyzw="0 0 1 1"')
    found = reading(text)
    assert found.differences == ()
    assert found.known == ("does not normalise an axis: turn", "ignores quat_xyzw: turn")


def test_a_file_that_yourdfpy_cannot_read_is_reported_and_is_no_failure(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(second_reader, "read_with_yourdfpy", Mock(side_effect=KeyError("link")))
    report = validate(ARM, samples=0)
    assert report.passed
    assert report.as_dict()["robots"][0]["second_reader"]["unread"] == "KeyError: 'link'"  # type: ignore[index]


def test_a_file_with_a_document_type_is_not_passed_to_yourdfpy() -> None:
    found = compare_with_yourdfpy("<!DOCTYPE robot>" + ARM, loaded(ARM, verify=False).tree)
    assert found.unread == "the file has a document type declaration"


def test_the_declared_encoding_of_a_file_causes_no_difference_between_the_readers() -> None:
    text = ARM.replace("turn", "drehen_ä")
    assert reading(text).differences == ()
    declared = '<?xml version="1.0" encoding="latin-1"?>' + text
    assert compare_with_yourdfpy(declared, loaded(text, verify=False).tree).differences == ()
