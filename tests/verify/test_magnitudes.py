"""The sizes of terms: nothing that is computed exceeds them, and where all terms add up they are reached."""

import numpy as np
import pytest

import urdfkin
from tests.laws.subjects import NAMES, robot_of, state
from urdfkin.compiled.evaluate import accelerations, placements, velocities
from urdfkin.kinematics.roundings import EPS, ROUNDINGS
from urdfkin.model.base_motion import STILL_STATE, BaseMotion
from urdfkin.model.tree import FloatArray
from urdfkin.verify.bounds import Magnitudes, magnitudes

ARM = """<robot name="r">
<link name="l0"/><link name="l1"/><link name="l2"/><link name="l3"/><link name="tip"/>
<joint name="a" type="continuous"><parent link="l0"/><child link="l1"/><axis xyz="0 0 1"/></joint>
<joint name="b" type="continuous"><parent link="l1"/><child link="l2"/><origin xyz="2 0 0"/>
<axis xyz="0 0 1"/></joint><joint name="c" type="prismatic"><parent link="l2"/><child link="l3"/>
<origin xyz="1 0 0"/><axis xyz="1 0 0"/><limit lower="-9" upper="9" effort="1" velocity="1"/></joint>
<joint name="d" type="fixed"><parent link="l3"/><child link="tip"/><origin xyz="0.5 0 0"/></joint></robot>"""


def length(x: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(x, axis=-1))


def exceed(found: FloatArray, size: FloatArray) -> bool:
    return bool((found > size * (1.0 + 100.0 * EPS) + 100.0 * EPS * (size > 0.0)).any())


@pytest.mark.slow
@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize("sizes", [(1.0, 1.0), (1e-3, 1e3), (1e3, 1e-3), (0.0, 1.0), (1.0, 0.0)])
@pytest.mark.parametrize("subject", NAMES)
def test_nothing_exceeds_its_size(subject: str, sizes: tuple[float, float], moving: bool) -> None:
    robot = robot_of(subject)
    q, v, a = state(robot, 20, 1)
    v, a = sizes[0] * v, sizes[1] * a
    rng = np.random.default_rng(2)
    base = BaseMotion(velocity=rng.normal(size=6), acceleration=rng.normal(size=6)).state(())
    base = base if moving else STILL_STATE
    plan = robot.plan(range(len(robot.link_names)))
    size = magnitudes(plan, q, v, a, base)
    vel, acc = velocities(plan, q, v, base=base), accelerations(plan, q, v, a, base=base)
    assert not exceed(length(placements(plan, q, base=base)[..., :3, 3]), size.p)
    assert not exceed(length(vel[..., :3]), size.vel)
    assert not exceed(length(vel[..., 3:]), size.w)
    assert not exceed(length(acc[..., :3]), size.acc)
    assert not exceed(length(acc[..., 3:]), size.alpha)
    places = magnitudes(plan, q, None, None, base)
    assert (places.p == size.p).all()
    assert (places.roundings == size.roundings).all()


def of_the_arm(q: list[float], v: list[float], a: list[float]) -> Magnitudes:
    robot = urdfkin.load(ARM)
    return magnitudes(robot.plan([4]), np.array([q]), np.array([v]), np.array([a]), STILL_STATE)


def test_where_all_terms_point_the_same_way_the_sizes_are_reached() -> None:
    size = of_the_arm([0.0, 0.0, 0.25], [2.0, 3.0, 0.0], [0.0, 0.0, 0.0])
    # Stretched out: 2 m turn with 2 rad/s, 1.75 m with 5 rad/s.
    assert size.p == 3.75
    assert size.w == 5.0
    assert size.vel == 2.0 * 2.0 + 5.0 * 1.75
    assert size.alpha == 2.0 * 2.0 + 3.0 * (2.0 + 3.0)  # Pinocchio's v w x z, before it vanishes
    assert size.acc == (4.0 + 4.0) * 2.0 + (size.alpha + 25.0) * 1.75
    assert size.roundings == 5 * ROUNDINGS


def test_slides_and_second_rates_count_as_7_130_has_them() -> None:
    size = of_the_arm([0.0, 0.0, -0.25], [0.5, 0.0, 3.0], [7.0, 0.0, 11.0])
    alpha = 7.0 + 0.25
    assert size.p == 3.75
    assert size.vel == 0.5 * 3.75 + 3.0
    assert size.alpha == alpha
    assert size.acc == (alpha + 0.25) * 3.75 + 11.0 + 2.0 * 3.0 * 0.5
