"""MuJoCo as the oracle: it reads the robot itself and computes the same, or states why it cannot."""

import warnings
from typing import Any

import numpy as np
import pytest

import urdfkin
from scripts.fuzzing import robots
from tests.urdf.lint.cases.arm import arm, fixed
from urdfkin.errors import UnknownNameError
from urdfkin.model.reference import Reference
from urdfkin.urdf.catalogue import catalogue
from urdfkin.verify import oracles
from urdfkin.verify.mujoco import MujocoOracle
from urdfkin.verify.verifier import NotVerifiedWarning

SUBJECTS: dict[str, tuple[str, dict[str, Any]]] = {
    "an arm": (arm(axis='<axis xyz="1 2 -3"/>'), {}),
    "a slide": (arm(attributes='type="prismatic"'), {}),
    "a planar joint below a floating one": (
        arm(attributes='type="floating"', axis="", limit="", second='type="planar"'),
        {},
    ),
    "a follower": (arm(follow='<mimic joint="j1" multiplier="-2" offset="0.3"/>'), {}),
    "a follower set free": (arm(follow='<mimic joint="j1" multiplier="-2"/>'), {"mimic": False}),
    "names that MuJoCo takes": (
        arm(base='<link name="base"/><link name="world"/>', more=fixed("l1", "tool", "world")),
        {},
    ),
    "hung from a floating joint": (arm(), {"root_joint": "floating"}),
    "hung from a planar joint": (arm(), {"root_joint": "planar"}),
}


def base_motion(rng: np.random.Generator, size: float) -> urdfkin.BaseMotion:
    R = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R * np.linalg.det(R), size * rng.normal(size=3)
    return urdfkin.BaseMotion(T, *rng.normal(size=(2, 6)))


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
def test_mujoco_agrees_in_every_quantity_and_reference(name: str, far: float | None) -> None:
    text, options = SUBJECTS[name]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", urdfkin.UrdfWarning)
        robot = urdfkin.load(text, oracle="mujoco", **options)
    ask_everything(robot, 5, None if far is None else base_motion(np.random.default_rng(0), far))
    certificate = robot.certificate()
    assert certificate.verified, certificate
    assert certificate.oracle == f"MuJoCo {oracles.MUJOCO.version()}"
    assert "checked by MuJoCo" in str(certificate)
    assert all(line.worst < 40.0 for line in certificate.lines), certificate


@pytest.mark.slow
@pytest.mark.parametrize("name", catalogue())
def test_mujoco_agrees_about_every_robot_of_the_catalogue(name: str) -> None:
    robot = urdfkin.load(name, oracle="mujoco")
    q = robot.sample(1)
    v, a = np.random.default_rng(0).normal(size=(2, 1, robot.nv))
    robot.jacobian_rate(q, v, robot.link_frames)
    robot.acceleration(q, v, a, robot.link_frames)
    assert robot.certificate().verified


@pytest.mark.slow
@pytest.mark.parametrize("family", robots.FAMILIES)
def test_mujoco_agrees_about_odd_robots_or_says_why_not(family: str) -> None:
    agreed = 0
    for number in range(4):
        case = robots.robot(7, family, number)
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


def test_a_lever_that_is_nothing_is_nothing_to_mujoco() -> None:
    """The rest of a robot, however large, has no part in a frame at the root."""
    far = fixed("far", "l1", "end").replace("</joint>", '<origin xyz="1e60 0 0"/></joint>')
    text = arm(origin='<origin rpy="0.1 0.2 0.3"/>', more=f'<link name="end"/>{far}')
    with pytest.warns(urdfkin.UrdfWarning):
        robot = urdfkin.load(text, oracle="mujoco")
    J = robot.jacobian([0.3, 0.4], "link:l1")
    assert (J[:3] == 0.0).all()
    assert robot.certificate().verified


def test_a_chain_that_is_too_deep_for_mujoco_is_not_handed_to_it() -> None:
    links = "".join(f'<link name="l{i}"/>' for i in range(1_102))
    joints = "".join(fixed(f"j{i}", f"l{i}", f"l{i + 1}") for i in range(1_101))
    text = f'<robot name="r">{links}{joints}</robot>'
    robot = urdfkin.load(text, oracle="mujoco")
    with pytest.warns(NotVerifiedWarning, match=r"chains of up to 1,000 links: found 1,101"):
        robot.placement([], "l9")


def test_what_pinocchio_refuses_mujoco_may_check() -> None:
    with pytest.warns(urdfkin.UrdfWarning, match="URDF303"):
        robot = urdfkin.load(arm(origin='<origin xyz="0\t0 1"/>'), oracle="mujoco")
    robot.placement(robot.neutral(), "tool")
    assert robot.certificate().verified


@pytest.mark.parametrize(
    ("method", "quantity"),
    [("placements", "placement"), ("jacobians", "jacobian"), ("velocities", "velocity")],
)
def test_a_disagreement_with_mujoco_is_raised_in_its_name(
    method: str, quantity: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    right = getattr(MujocoOracle, method)
    monkeypatch.setattr(MujocoOracle, method, lambda *given: right(*given) + 1e-9)
    robot = urdfkin.load(arm(), oracle="mujoco")
    inputs = (robot.neutral(),) if quantity != "velocity" else (robot.neutral(), [1.0, 1.0])
    with pytest.raises(urdfkin.VerificationError, match="disagrees with MuJoCo's") as caught:
        robot.compute(quantity, inputs, "tool")
    assert "oracle" in str(caught.value), "the line that reproduces it asks MuJoCo again"


def test_what_mujoco_does_not_know_is_a_reason() -> None:
    text = arm(robot='name="r" version="1.1"', origin='<origin quat_xyzw="0 0 1 0"/>')
    with pytest.warns(urdfkin.UrdfWarning):
        robot = urdfkin.load(text, oracle="mujoco")
    with pytest.warns(NotVerifiedWarning, match="MuJoCo does not know quat_xyzw"):
        robot.placement(robot.neutral(), "tool")
    assert not robot.certificate().verified


def test_an_oracle_that_nobody_knows_is_an_error() -> None:
    with pytest.raises(UnknownNameError, match=r"unknown oracle 'mujuco'.*did you mean mujoco"):
        urdfkin.load(arm(), oracle="mujuco")  # type: ignore[arg-type]


def test_an_oracle_that_is_not_installed_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("urdfkin.urdf.mujoco.installed_version", lambda _: None)
    with pytest.raises(urdfkin.InputError, match=r"MuJoCo is not installed; pip install 'mujoco>=4,<5'"):
        urdfkin.load(arm(), oracle="mujoco")
