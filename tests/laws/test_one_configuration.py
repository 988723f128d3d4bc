"""A configuration has the same result, to the last bit, alone, prepared, and as any row of a batch."""

import warnings
from collections.abc import Iterator

import numpy as np
import pytest

import urdfkin
from tests.laws.everything import by_the_robot, differing, on_its_way_alone, prepared
from tests.laws.subjects import NAMES, robot_of, state
from tests.robots.odd_urdfs import Urdf
from urdfkin.compiled.plan import LANES
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot

#: Rows of a block, of the next, and of one that was filled up.
SAMPLES = 2 * LANES + 3
ROWS = (0, 7, 8, LANES - 1, LANES, 2 * LANES, SAMPLES - 1)
KINDS = ("revolute", "prismatic", "continuous")


def loaded(urdf: Urdf) -> Robot:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", urdfkin.UrdfWarning)
        return urdfkin.load(urdf.text, verify=False)


def chain(joints: int) -> Robot:
    """A chain in which each kind of axial joint is met."""
    urdf = Urdf(f"chain_{joints}", joints)
    for i in range(joints):
        urdf.add(KINDS[i % 3])
    return loaded(urdf)


def mixed(floating: bool) -> Robot:
    """Planar and floating joints between others, so that blocks of q and of v begin elsewhere."""
    urdf = Urdf("mixed", 5)
    for kind in ("revolute", "planar", "prismatic", *["floating"] * floating, "continuous", "planar"):
        urdf.add(kind)
    urdf.add("revolute", mimic=("joint_0", -0.7, 0.2))
    return loaded(urdf)


def broom(branches: int, joints: int) -> Robot:
    """Branches from one link: the path to a tip needs some blocks of coordinates, and not others."""
    urdf = Urdf(f"broom_{branches}_{joints}", branches)
    for branch in range(branches):
        for i in range(joints):
            urdf.add(KINDS[(branch + i) % 3], None if i else 0, joint=f"b{branch}_{i:02}")
    return loaded(urdf)


def faults(robot: Robot, frame: str, q: FloatArray, v: FloatArray, a: FloatArray) -> Iterator[str]:
    """Where a row of a batch is not what it is alone, or prepared."""
    batch = dict(by_the_robot(robot, frame, q, v, a))
    for k in [row for row in ROWS if row < len(q)]:
        ways = {"alone": by_the_robot, "prepared": prepared, "as a block": on_its_way_alone}
        for way, compute in ways.items():
            for what, one in compute(robot, frame, q[k], v[k], a[k]):
                if differing(batch[what][k], one):
                    yield f"{what} of {frame}, row {k}, {way}"


def all_frames_faults(robot: Robot, q: FloatArray, v: FloatArray, a: FloatArray) -> Iterator[str]:
    """Where a frame among all is not what it is by itself."""
    for reference in urdfkin.Reference:
        together = {
            "placement": robot.placement(q, robot.link_frames),
            "velocity": robot.velocity(q, v, robot.link_frames, reference),
            "jacobian": robot.jacobian(q, robot.link_frames, reference),
            "acceleration": robot.acceleration(q, v, a, robot.link_frames, reference),
        }
        for f, frame in enumerate(f"link:{name}" for name in robot.link_names):
            alone = {
                "placement": robot.placement(q, frame),
                "velocity": robot.velocity(q, v, frame, reference),
                "jacobian": robot.jacobian(q, frame, reference),
                "acceleration": robot.acceleration(q, v, a, frame, reference),
            }
            for what, results in together.items():
                if differing(np.ascontiguousarray(results[:, f]), alone[what]):
                    yield f"{what} of {frame} {reference.name}"


@pytest.mark.slow
@pytest.mark.parametrize("joints", [*range(1, 21), 30, 33, 64, 70])
def test_a_chain_of_any_width(joints: int) -> None:
    robot = chain(joints)
    assert list(faults(robot, robot.tip_frame, *state(robot, SAMPLES, joints))) == []


@pytest.mark.parametrize("name", NAMES)
def test_a_robot_of_every_kind(name: str) -> None:
    robot = robot_of(name)
    assert list(faults(robot, robot.tip_frame, *state(robot, SAMPLES, 2))) == []


@pytest.mark.parametrize("floating", [False, True])
def test_planar_floating_and_following_joints(floating: bool) -> None:
    robot = mixed(floating)
    assert list(faults(robot, robot.tip_frame, *state(robot, SAMPLES, 3))) == []


@pytest.mark.slow
@pytest.mark.parametrize(("branches", "joints"), [(2, 4), (3, 8), (5, 7), (4, 17)])
def test_each_tip_of_a_tree_though_it_needs_only_some_of_the_coordinates(branches: int, joints: int) -> None:
    robot = broom(branches, joints)
    for leaf in robot.tree.leaves():
        frame = robot.tree.frame_name(leaf)
        assert list(faults(robot, frame, *state(robot, LANES + 1, 4))) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", ["tree_8", "mimic_hand_40_sliding", "planar_and_floating_in_the_middle"])
def test_each_frame_of_a_tree_is_the_same_among_all_and_by_itself(name: str) -> None:
    robot = robot_of(name)
    assert list(all_frames_faults(robot, *state(robot, LANES + 1, 5))) == []


@pytest.mark.slow
@pytest.mark.parametrize("size", [1e5, 1e7, 1e300])
def test_large_angles_do_not_change_what_stands_beside_them(size: float) -> None:
    for robot in (robot_of("panda"), mixed(floating=True)):
        q, v, a = state(robot, SAMPLES, 6)
        ours = robot.tree.q_index[robot.tree.joint_index(robot.joint_names[0])]
        q[[3, 8, LANES + 2], ours] = [size, -size, np.nextafter(size, 0.0)]
        assert list(faults(robot, robot.tip_frame, q, v, a)) == []
        q[:, ours] = size * np.linspace(-1.0, 1.0, SAMPLES)
        assert list(faults(robot, robot.tip_frame, q, v, a)) == []


def test_the_signs_of_zeros_and_the_smallest_numbers() -> None:
    for robot in (robot_of("panda"), mixed(floating=False), chain(9)):
        values = np.array([0.0, -0.0, 5e-324, -5e-324, 1e-310, np.finfo(float).tiny, np.pi, -np.pi / 2])
        generator = np.random.default_rng(7)
        q, v, a = (generator.choice(values, (SAMPLES, n)) for n in (robot.nq, robot.nv, robot.nv))
        q[0], q[1], v[0], a[0] = 0.0, -0.0, -0.0, 0.0
        assert list(faults(robot, robot.tip_frame, q, v, a)) == []
