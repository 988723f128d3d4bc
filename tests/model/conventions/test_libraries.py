"""Each built-in convention that a library defines: the library's results with converted inputs are ours.

The differences are within the bound that `tests/model/conventions/libraries.py` derives. MuJoCo and Pinocchio
run everywhere. The others run where they are installed:
`pip install drake idyntree roboticstoolbox-python newton[importers] urdf-usd-converter`;
then `pip uninstall usd-core` and `pip install --force-reinstall usd-exchange`, which has the same modules.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import urdfkin
from tests.model.conventions.libraries import LIBRARIES, Library
from urdfkin.kinematics.roundings import ROUNDINGS
from urdfkin.model.base_motion import STILL_STATE
from urdfkin.model.conventions import Convention, Conversion, find_convention
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.system.plain_xml import plain_xml
from urdfkin.verify.bounds import magnitudes
from urdfkin.verify.quantities import JACOBIAN, PLACEMENT, VELOCITY

ROBOTS = (
    "a1", "anymal_c", "baxter", "go2", "hyq", "icub", "kinova", "panda", "romeo_small", "solo12", "so101",
    "simple_humanoid", "talos_reduced", "tiago", "tiago_dual", "ur5", "ur10", "ur3_gripper", "xarm7", "z1",
)  # fmt: skip
#: The toolbox turns an axis that is not parallel to x, y or z, as the iCub's.
OTHERS = {("rtb", "icub"): "b1"}
#: Robots with a floating base and branches, for the planted mistakes.
FEW = ("a1", "tiago", "panda")


def _loaded(name: str, library: str) -> Robot:
    root = None if library == "rtb" else "floating"
    return urdfkin.load(name, root_joint=root, verify=False)


def _differences(
    robot: Robot, library: Library, conversion: Conversion, seed: int = 0
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield |theirs - ours| and the bound for placements, velocities and Jacobians of three links."""
    q, v = robot.sample(1, seed)[0], np.random.default_rng(seed + 100).standard_normal(robot.nv)
    their_q, their_v = conversion.to(q, v)
    for link in {robot.link_names[-1], robot.link_names[len(robot.link_names) // 2], robot.tip_frame}:
        T, twist, J = library.evaluate(their_q, their_v, link)
        frame = f"link:{link}"
        plan = robot.plan([robot.tree.link_index(link)])
        size = magnitudes(plan, q[None], v[None], None, STILL_STATE)
        reach = _farthest_mass(robot, q) if library.at_mass else 0.0
        roundings = size.roundings * library.roundings / ROUNDINGS
        size = replace(size, p=size.p + reach, vel=size.vel + size.w * reach, roundings=roundings)
        for quantity, theirs, ours in (
            (PLACEMENT, T, robot.placement(q, frame)),
            (VELOCITY, conversion.six(twist), robot.velocity(q, v, frame)),
            (JACOBIAN, conversion.from_jacobian(q, J), robot.jacobian(q, frame)),
        ):
            bound = quantity.bound(plan, size, Reference.LOCAL_WORLD_ALIGNED)
            more = 1.0 + library.more / quantity.factors if quantity is not PLACEMENT else 1.0
            yield np.abs(theirs - ours), (library.eps * more * bound.k * bound.scale)[0, 0]


def _farthest_mass(robot: Robot, q: FloatArray) -> float:
    """Return an upper bound of the distance of all centres of mass from the root and from their links."""
    origins = plain_xml(robot.urdf).iterfind("link/inertial/origin")
    masses = [[float(x) for x in origin.get("xyz", "0 0 0").split()] for origin in origins]
    places = robot.placement(q, robot.link_frames)[:, :3, 3]
    return float(np.linalg.norm(places, axis=-1).max() + np.linalg.norm(masses or [[0.0] * 3], axis=-1).max())


def _worst(robot: Robot, library: Library, conversion: Conversion) -> float:
    return max(float(found.max()) for found, _ in _differences(robot, library, conversion))


def _conversion(robot: Robot, name: str, library: Library, **changes: Any) -> Conversion:
    joints = library.names if name == "idyntree" else None
    return robot.convention(replace(find_convention(name), **changes), joints)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    ("name", "robot_name"),
    [(name, OTHERS.get((name, robot), robot)) for name in LIBRARIES for robot in ROBOTS],
)
def test_results_of_a_library_in_its_convention_equal_those_of_urdfkin(
    name: str, robot_name: str, tmp_path: Any
) -> None:
    robot = _loaded(robot_name, name)
    library = LIBRARIES[name](robot, tmp_path)
    conversion = _conversion(robot, name, library)
    assert list(conversion.joint_names) == library.names
    for found, bound in _differences(robot, library, conversion):
        assert (found <= bound).all()


#: The two values of what a convention with a floating base states: a mistake is the other one.
STATED = {
    "quaternion": ("xyzw", "wxyz"), "six": ("linear first", "angular first"), "linear": ("body", "parent"),
    "angular": ("body", "parent"), "base_v": ("linear first", "angular first"), "angle": ("rad", "deg"),
    "base_q": ("position first", "quaternion first"), "point": ("origin", "centre of mass"),
}  # fmt: skip


def mistaken(right: Convention, field: str) -> dict[str, Any]:
    return {field: next(value for value in STATED[field] if value != getattr(right, field))}


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("mistake", STATED)
@pytest.mark.parametrize("name", LIBRARIES)
def test_a_mistake_in_a_convention_is_detected(name: str, mistake: str, tmp_path: Path) -> None:
    if name == "rtb" and mistake not in ("six", "angle"):  # it has no floating joint
        return
    robot = _loaded("go2" if mistake == "point" else "a1", name)  # the A1's base has its mass at the origin
    library = LIBRARIES[name](robot, tmp_path)
    wrong = _conversion(robot, name, library, **mistaken(find_convention(name), mistake))
    assert _worst(robot, library, wrong) > 1e-3


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("robot_name", FEW)
@pytest.mark.parametrize("name", LIBRARIES)
def test_two_exchanged_joints_are_detected(name: str, robot_name: str, tmp_path: Path) -> None:
    robot = _loaded(robot_name, name)
    library = LIBRARIES[name](robot, tmp_path)
    joints = list(library.names)
    joints[1], joints[2] = joints[2], joints[1]
    wrong = robot.convention(name, joints)
    links = robot.link_names[1:]
    q = robot.sample(1)[0]
    theirs = np.array([library.evaluate(wrong.to(q), np.zeros(wrong.nv), link)[0] for link in links])
    assert np.abs(theirs - robot.placement(q, robot.link_frames[1:])).max() > 1e-3
