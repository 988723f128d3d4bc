"""Each built-in convention: the library's results with converted inputs are ours, or statements agree.

The differences are within the bound that `tests/model/conventions/libraries.py` derives. MuJoCo and Pinocchio
run everywhere. The others run where they are installed:
`pip install drake idyntree roboticstoolbox-python newton[importers] urdf-usd-converter`;
then `pip uninstall usd-core` and `pip install --force-reinstall usd-exchange`, which has the same modules.
Conventions of libraries that cannot be installed agree with published statements.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import urdfkin
from tests import urdfs
from tests.model.conventions.libraries import LIBRARIES, Library
from tests.urdfs import joint
from urdfkin.kinematics.roundings import PINOCCHIO_ROUNDINGS
from urdfkin.model.base_motion import FIXED_BASE_STATE
from urdfkin.model.conventions import BUILT_IN_NAMES, Convention, Conversion, find_convention
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.system.plain_xml import parse_xml
from urdfkin.verify.bounds import compute_magnitudes
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
        size = compute_magnitudes(plan, q[None], v[None], None, FIXED_BASE_STATE)
        reach = _farthest_mass(robot, q) if library.at_mass else 0.0
        roundings = size.roundings * library.roundings / PINOCCHIO_ROUNDINGS
        size = replace(size, p=size.p + reach, vel=size.vel + size.w * reach, roundings=roundings)
        for quantity, theirs, ours in (
            (PLACEMENT, T, robot.placement(q, frame)),
            (VELOCITY, conversion.reorder_six_vector(twist), robot.velocity(q, v, frame)),
            (JACOBIAN, conversion.from_jacobian(q, J), robot.jacobian(q, frame)),
        ):
            bound = quantity.bound(plan, size, Reference.LOCAL_WORLD_ALIGNED)
            more = 1.0 + library.more / quantity.factors if quantity is not PLACEMENT else 1.0
            yield np.abs(theirs - ours), (library.eps * more * bound.k * bound.scale)[0, 0]


def _farthest_mass(robot: Robot, q: FloatArray) -> float:
    """Return an upper bound of the distance of all centres of mass from the root and from their links."""
    origins = parse_xml(robot.urdf).iterfind("link/inertial/origin")
    masses = [[float(x) for x in origin.get("xyz", "0 0 0").split()] for origin in origins]
    places = robot.placement(q, robot.link_frames)[:, :3, 3]
    return float(np.linalg.norm(places, axis=-1).max() + np.linalg.norm(masses or [[0.0] * 3], axis=-1).max())


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
    "quaternion": ("xyzw", "wxyz"), "six_vectors": ("linear first", "angular first"),
    "linear": ("body", "parent"),
    "angular": ("body", "parent"), "base_v": ("linear first", "angular first"), "angle": ("rad", "deg"),
    "base_q": ("position first", "quaternion first"), "point": ("origin", "centre of mass"),
}  # fmt: skip


def mistaken(right: Convention, field: str) -> dict[str, Any]:
    return {field: next(value for value in STATED[field] if value != getattr(right, field))}


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("mistake", STATED)
@pytest.mark.parametrize("name", LIBRARIES)
def test_a_mistake_in_a_convention_is_detected(name: str, mistake: str, tmp_path: Path) -> None:
    if name == "rtb" and mistake not in ("six_vectors", "angle"):  # it has no floating joint
        return
    robot = _loaded("go2" if mistake == "point" else "a1", name)  # the A1's base has its mass at the origin
    library = LIBRARIES[name](robot, tmp_path)
    wrong = _conversion(robot, name, library, **mistaken(find_convention(name), mistake))
    assert max(found.max() for found, _ in _differences(robot, library, wrong)) > 1e-3


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


# -- statements about libraries that cannot be installed ---------------------------------------------


Rows = list[tuple[str, str, str]]


def _rows(robot: Robot) -> Rows:
    """Return name, parent and child of each joint in the order of the file."""
    joints: Any = ElementTree.fromstring(robot.urdf).iterfind("joint")
    return [(x.get("name"), x.find("parent").get("link"), x.find("child").get("link")) for x in joints]


def _depth_first(rows: Rows, link: str) -> list[str]:
    below = sorted(row for row in rows if row[1] == link)
    return [name for joint, _, child in below for name in (joint, *_depth_first(rows, child))]


def _breadth_first(rows: Rows, links: list[str]) -> list[str]:
    """Return the joints by depth; the rows of siblings keep their order. A fixed joint connects one link."""
    level = [row for link in links for row in rows if row[1] == link]
    return [row[0] for row in level] + _breadth_first(rows, [row[2] for row in level]) if level else []


ORDERS: dict[str, Callable[[Rows, str], list[str]]] = {
    "urdfkin": _depth_first,
    "urdf": lambda rows, root: [row[0] for row in rows],
    "alphabetical": lambda rows, root: sorted(row[0] for row in rows),
    "kdl": _depth_first,  # kdl_parser follows child_links, which urdfdom fills from a std::map by name
    "isaacgym": _depth_first,
    "isaaclab": lambda rows, root: _breadth_first(sorted(rows), [root]),
    "isaaclab3": lambda rows, root: _breadth_first(rows, [root]),
    "ros": lambda rows, root: [row[0] for row in rows],
}
#: Order of the base's quaternion, and axes of its velocity [linear; angular] of the link's origin.
BASES = {
    "urdfkin": ("xyzw", "local"),
    "urdf": ("xyzw", "local"),
    "alphabetical": ("xyzw", "local"),
    "isaacgym": ("xyzw", "local_world_aligned"),  # legged_robot.py: root_states
    "isaaclab": ("wxyz", "local_world_aligned"),  # articulation_data.py: root_link_state_w
    "isaaclab3": ("xyzw", "local_world_aligned"),
    "ros": ("xyzw", "local"),  # Quaternion.msg, Odometry.msg
}


def _wrong(convention: Convention) -> list[str]:
    """Return the statements that a convention contradicts.

    The file of the A1 has the right legs first. The centre of mass of the Go2's base is not at its origin.
    """
    return [*_wrong_for("a1", convention), *_wrong_for("go2", convention)]


def _wrong_for(dog: str, convention: Convention) -> list[str]:
    name = convention.name
    free = name in BASES
    robot = urdfkin.load(dog, verify=False, root_joint="floating" if free else None)
    conversion, root = robot.convention(convention), robot.link_names[int(free)]
    q, v = robot.sample(1, 2)[0], np.random.default_rng(3).standard_normal(robot.nv)
    their_q, their_v = conversion.to(q, v)
    order = [joint for joint in ORDERS[name](_rows(robot), root) if joint in set(robot.joint_names)]
    values = dict(zip(robot.coordinate_names, q, strict=True))
    rates = dict(zip(robot.velocity_names, v, strict=True))
    six, joints, found = np.arange(6.0), slice(7, None) if free else slice(None), []
    if not np.array_equal(their_q[joints], [values[joint] for joint in order]):
        found.append("order of q")
    if not np.array_equal(their_v[6:] if free else their_v, [rates[joint] for joint in order]):
        found.append("order of v")
    if not np.array_equal(conversion.reorder_six_vector(six), six):
        found.append("six_vectors")
    if free:
        quaternion, axes = BASES[name]
        T = robot.placement(q, root)
        turn = Rotation.from_matrix(T[:3, :3]).as_quat(scalar_first=quaternion == "wxyz")
        if not np.allclose(their_q[:3], T[:3, 3], 0, 1e-15):
            found.append("position")
        if min(np.abs(their_q[3:7] - sign * turn).max() for sign in (1, -1)) > 1e-14:
            found.append("quaternion")
        if not np.allclose(their_v[:6], robot.velocity(q, v, root, axes), 0, 1e-14):
            found.append("velocity")
    return found


def test_each_convention_is_compared_with_a_library_or_a_statement() -> None:
    assert set(ORDERS) | set(LIBRARIES) == set(BUILT_IN_NAMES)
    assert set(ORDERS) - set(BASES) == {"kdl"}  # it has no floating joint


@pytest.mark.parametrize("name", ORDERS)
def test_a_convention_agrees_with_its_sources(name: str) -> None:
    assert _wrong(find_convention(name)) == []


@pytest.mark.parametrize("mistake", [*STATED, "order"])
@pytest.mark.parametrize("name", ORDERS)
def test_a_mistake_in_a_convention_contradicts_the_sources(name: str, mistake: str) -> None:
    right = find_convention(name)
    if mistake == "order":
        joints = list(urdfkin.load("a1", verify=False).convention(name).joint_names)
        joints[0], joints[1] = joints[1], joints[0]
        root = ["root_joint"] * (name in BASES)
        wrong = replace(right, order="given", joints=(*root, *joints))
    elif name == "kdl" and mistake in ("quaternion", "linear", "angular", "base_v", "base_q", "point"):
        return
    else:
        wrong = replace(right, **mistaken(right, mistake))
    assert _wrong(wrong)


# -- published joint orders of Isaac Lab and Isaac Gym ---------------------------------------------


LEGS = ("LF", "LH", "RF", "RH")
SIDES = ("left", "right")
#: github.com/isaac-sim/IsaacLab/issues/270 and source/isaaclab_tasks/test/core/test_anymal_symmetry.py.
ANYMAL = [f"{leg}_{part}" for part in ("HAA", "HFE", "KFE") for leg in LEGS]
#: github.com/isaac-sim/IsaacLab/issues/270: "in the isaac gym environments".
ANYMAL_GYM = [f"{leg}_{part}" for leg in LEGS for part in ("HAA", "HFE", "KFE")]
#: github.com/ccwss-maker/unitree_go2_simulation, file `cmd`: the printed joint_names of Isaac Lab.
GO2 = [f"{leg}_{part}_joint" for part in ("hip", "thigh", "calf") for leg in ("FL", "FR", "RL", "RR")]
#: Isaac Lab 3 has siblings in the order of the file.
GO1 = [f"{leg}_{part}_joint" for part in ("hip", "thigh", "calf") for leg in ("FR", "FL", "RR", "RL")]
#: github.com/Improbable-AI/walk-these-ways, go1_gym_deploy/utils/cheetah_state_estimator.py: joint_idxs, from
#: the order of the file and of the motors (FR, FL, RR, RL) to that of Isaac Gym.
GO1_GYM = [3, 4, 5, 0, 1, 2, 9, 10, 11, 6, 7, 8]
#: github.com/NVlabs/GR00T-WholeBodyControl/issues/78, which cites policy_parameters.hpp: mujoco_to_isaaclab.
G1 = [
    0, 6, 12, 1, 7, 13, 2, 8, 14, 3, 9, 15, 22, 4, 10, 16, 23, 5, 11, 17, 24, 18, 25, 19, 26, 20, 27, 21, 28,
]  # fmt: skip
#: github.com/RoboCubPilot/g1_deploy_mujoco/issues/5: the first joints of the policy.
G1_NAMES = ["left_hip_pitch_joint", "right_hip_pitch_joint", "waist_yaw_joint", "left_hip_roll_joint"]


def _pairs(words: str) -> list[str]:
    """Return the names of both sides, but "torso" once."""
    both = " ".join(f"left_{word} right_{word}" for word in words.split())
    return both.replace("left_torso right_torso", "torso").split()


#: github.com/jiemingcui/gaponet, tasks/humanoid_amass/motions/joint_names.py: h1_2_with_hand_fix_joints.
H1_2 = _pairs(
    "hip_yaw torso hip_pitch shoulder_pitch hip_roll shoulder_roll knee shoulder_yaw ankle_pitch elbow"
    " ankle_roll wrist_roll wrist_pitch wrist_yaw"
)
#: docs.isaacsim.omniverse.nvidia.com/latest/robot_setup_tutorials/tutorial_rig_legged_robot.html: dof_names.
H1 = _pairs("hip_yaw torso hip_roll shoulder_pitch hip_pitch shoulder_roll knee shoulder_yaw ankle elbow")
#: github.com/isaac-sim/IsaacSim, the docstring of dof_names of Articulation: the Franka Panda with its hand.
PANDA = [*(f"panda_joint{k}" for k in range(1, 8)), "panda_finger_joint1", "panda_finger_joint2"]


def _humanoid(leg: str, arm: str) -> str:
    """Return a robot with two legs on the pelvis and two arms on the torso, the right ones first."""
    chains = [("pelvis", [f"{side}_{part}" for part in leg.split()]) for side in SIDES[::-1]]
    chains.append(("pelvis", ["torso"]))
    chains += [("torso_link", [f"{side}_{part}" for part in arm.split()]) for side in SIDES[::-1]]
    joints = []
    for root, names in chains:
        parents = [root, *(f"{name}_link" for name in names[:-1])]
        joints += [joint(x, "continuous", at, f"{x}_link") for x, at in zip(names, parents, strict=True)]
    return urdfs.robot(*joints)


H1_URDF = _humanoid(
    "hip_yaw hip_roll hip_pitch knee ankle", "shoulder_pitch shoulder_roll shoulder_yaw elbow"
)
H1_2_URDF = _humanoid(
    "hip_yaw hip_pitch hip_roll knee ankle_pitch ankle_roll",
    "shoulder_pitch shoulder_roll shoulder_yaw elbow wrist_roll wrist_pitch wrist_yaw",
)


@pytest.mark.parametrize(
    ("robot", "convention", "published"),
    [
        ("anymal_c", "isaaclab", ANYMAL), ("anymal_c", "isaacgym", ANYMAL_GYM), ("go2", "isaaclab", GO2),
        (H1_URDF, "isaaclab", H1), (H1_2_URDF, "isaaclab", H1_2), ("panda", "isaaclab", PANDA),
        ("go1", "isaaclab3", GO1),
    ],
    ids=["anymal_c", "anymal_c isaacgym", "go2", "h1", "h1_2", "panda", "go1 isaaclab3"],
)  # fmt: skip
def test_the_joint_order_of_a_convention_is_the_published_order(
    robot: str, convention: str, published: list[str]
) -> None:
    loaded = urdfkin.load(robot, verify=False)
    assert list(loaded.convention(convention).joint_names) == published
    if robot != "panda":  # a chain whose last two joints are siblings
        assert list(loaded.convention("urdf").joint_names) != published


def test_isaac_gym_sorts_the_legs_of_the_go1_by_name_and_not_by_position_in_the_file() -> None:
    go1 = urdfkin.load("go1", verify=False)
    written = go1.convention("urdf").joint_names
    assert [written.index(name) for name in go1.convention("isaacgym").joint_names] == GO1_GYM


def test_the_g1_has_the_published_permutation_from_mujoco_to_isaac_lab() -> None:
    g1 = urdfkin.load("g1", verify=False)
    mujoco, isaaclab = g1.convention("mujoco"), g1.convention("isaaclab")
    assert list(isaaclab.joint_names[:4]) == G1_NAMES
    assert [mujoco.joint_names.index(name) for name in isaaclab.joint_names] == G1
    q = g1.sample(3)
    assert np.array_equal(mujoco.to(q)[:, G1], isaaclab.to(q))


def test_a_fixed_joint_counts_as_a_level_only_if_the_importer_keeps_it() -> None:
    ends = {"a": ("flange", "x"), "b": ("base", "y"), "c": ("y", "z")}
    turning = (joint(name, "continuous", *links) for name, links in ends.items())
    robot = urdfkin.load(urdfs.robot(joint("mount", "fixed", "base", "flange"), *turning), verify=False)
    kept = replace(find_convention("isaaclab"), order="breadth first, with fixed joints")
    assert robot.convention("isaaclab").joint_names == ("a", "b", "c")
    assert robot.convention(kept).joint_names == ("b", "c", "a")
