"""From the smallest numbers to the largest: no false alarm, no result refused that exists, no slip hidden."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import urdfkin
from urdfkin.errors import RangeError
from urdfkin.kinematics.number_kinds import product
from urdfkin.kinematics.roundings import EPS, LEAST_UNIT, SMALLEST
from urdfkin.model.base_motion import STILL_STATE, BaseMotion
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.verify.bounds import magnitudes
from urdfkin.verify.quantities import VELOCITY

#: A planar, a floating and a sliding joint between turning ones, and two followers.
ODD = """<robot name="odd">
<link name="l0"/><link name="l1"/><link name="l2"/><link name="l3"/><link name="l4"/>
<link name="l5"/><link name="l6"/>
<joint name="a" type="planar"><parent link="l0"/><child link="l1"/>
  <origin xyz="0.1 0.2 0.3" rpy="0.3 0.4 0.5"/><axis xyz="0 0 1"/></joint>
<joint name="b" type="continuous"><parent link="l1"/><child link="l2"/>
  <origin xyz="0.3 -0.2 0.1" rpy="0.1 0.2 0.3"/><axis xyz="1 2 3"/></joint>
<joint name="c" type="prismatic"><parent link="l2"/><child link="l3"/><origin xyz="0 0 1e-310" rpy="1 2 3"/>
  <axis xyz="0 1 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="d" type="floating"><parent link="l3"/><child link="l4"/><origin rpy="1 0 0"/></joint>
<joint name="e" type="continuous"><parent link="l4"/><child link="l5"/><origin xyz="0.3 0 0"/>
  <axis xyz="0 0 1"/><mimic joint="b" multiplier="-1e-5" offset="0.2"/></joint>
<joint name="f" type="prismatic"><parent link="l5"/><child link="l6"/><origin xyz="0 0.2 0" rpy="0 1 0"/>
  <axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/>
  <mimic joint="c" multiplier="3"/></joint></robot>"""
pytestmark = pytest.mark.filterwarnings("ignore::urdfkin.UrdfWarning")
#: Coordinates of the robot above that are lengths.
LENGTHS = [0, 1, 4, 5, 6, 7]
REFERENCES = ("local", "world", "local_world_aligned")


def numbers(rng: np.random.Generator, exponent: int, size: int) -> FloatArray:
    """Numbers about 10 to the exponent, some of them zero."""
    wide: FloatArray = rng.normal(size=size) * np.exp2(math.log2(10.0) * exponent)
    wide[rng.random(size) < 0.2] = 0.0
    return wide


def everything(robot: Robot, q: FloatArray, v: FloatArray, a: FloatArray, base: BaseMotion | None) -> int:
    """Every quantity of the last link in every reference; how many leave the range of doubles."""
    beyond = 0
    for reference in REFERENCES:
        for compute in (
            lambda reference: robot.placement(q, "l6", base=base),
            lambda reference: robot.velocity(q, v, "l6", reference, base=base),
            lambda reference: robot.jacobian(q, "l6", reference, base=base),
            lambda reference: robot.jacobian_rate(q, v, "l6", reference, base=base),
            lambda reference: robot.hessian(q, "l6", reference, base=base),
            lambda reference: robot.acceleration(q, v, a, "l6", reference, base=base),
            lambda reference: robot.acceleration_breakdown(q, v, a, "l6", reference, base=base),
        ):
            try:
                compute(reference)
            except RangeError:
                beyond += 1
    return beyond


exponents = st.integers(-323, 300)


@pytest.mark.long
@settings(max_examples=150)
@given(st.tuples(*[exponents] * 6), st.booleans(), st.integers(0, 2**32 - 1))
def test_numbers_of_any_size_are_verified_or_leave_the_range(
    sizes: tuple[int, ...], moving: bool, seed: int
) -> None:
    robot = urdfkin.load(ODD)
    rng = np.random.default_rng(seed)
    q = robot.sample(1, seed % 1000)[0]
    q[LENGTHS] = numbers(rng, sizes[0], len(LENGTHS))
    v, a = numbers(rng, sizes[1], robot.nv), numbers(rng, sizes[2], robot.nv)
    base = None
    if moving:
        T = np.eye(4)
        T[:3, 3] = numbers(rng, sizes[3], 3)
        base = BaseMotion(T, numbers(rng, sizes[4], 6), numbers(rng, sizes[5], 6))
    beyond = everything(robot, q, v, a, base)
    used = sizes if moving else sizes[:3]
    if max(used) < 75:  # no product of three or four of them overflows
        assert beyond == 0


@pytest.mark.long
@settings(max_examples=60)
@given(st.integers(-323, -140), st.integers(-2, 2), st.integers(0, 2**32 - 1))
def test_small_rates_beside_coordinates_of_ordinary_size_are_verified(
    rate: int, length: int, seed: int
) -> None:
    robot = urdfkin.load(ODD)
    rng = np.random.default_rng(seed)
    q = robot.sample(1, seed % 1000)[0]
    q[LENGTHS] = numbers(rng, length, len(LENGTHS))
    assert everything(robot, q, numbers(rng, rate, robot.nv), numbers(rng, rate, robot.nv), None) == 0


PLANAR = """<robot name="t"><link name="a"/><link name="b"/><joint name="f" type="planar"><parent link="a"/>
<child link="b"/><origin rpy="0.3 0.4 0.5"/><axis xyz="0 0 1"/></joint></robot>"""


@pytest.mark.parametrize("size", [1e-323, 1e-310, 1e-200, 1e-170, 1e-154])
def test_rates_whose_squares_vanish_are_verified_and_their_slips_are_not_excused(size: float) -> None:
    robot = urdfkin.load(PLANAR)
    q, v = np.array([0.0, 0.0, 0.7]), np.array([size, 2.0 * size, 0.0])
    robot.velocity(q, v, "b")
    assert robot.certificate().verified
    plan = robot.plan([1])
    bound = VELOCITY.bound(
        plan,
        magnitudes(plan, q[np.newaxis], v[np.newaxis], None, STILL_STATE),
        urdfkin.Reference.LOCAL_WORLD_ALIGNED,
    )
    allowed = float((bound.k * np.maximum(EPS * bound.scale, LEAST_UNIT)).max())
    assert allowed <= 100.0 * max(EPS * math.hypot(size, 2.0 * size), LEAST_UNIT)


@pytest.mark.parametrize("size", [1e155, 1e160, 1e200, 1e300])
def test_a_place_whose_square_overflows_is_verified(size: float) -> None:
    robot = urdfkin.load(PLANAR)
    assert np.isfinite(robot.placement([size, 0.0, 0.7], "b")).all()
    assert np.isfinite(robot.velocity([size, 0.0, 0.7], [size, 1.0, 0.0], "b")).all()
    base = BaseMotion(np.block([[np.eye(3), np.full((3, 1), size / 2)], [np.zeros(3), 1.0]]))
    assert np.isfinite(robot.placement([0.0, 0.0, 0.7], "b", base=base)).all()
    assert robot.certificate().verified


def test_a_product_counts_as_the_smallest_normal_number_unless_a_factor_is_zero() -> None:
    x = np.array([0.0, 1e-200, 1e-200, 5e-324, 1.0, 0.0])
    y = np.array([1e-200, 1e-200, 1e-50, 5e-324, 2.0, 0.0])
    assert product(x, y).tolist() == [0.0, SMALLEST, 1e-200 * 1e-50, SMALLEST, 2.0, 0.0]


def test_a_scale_of_zero_still_means_equal() -> None:
    robot = urdfkin.load("panda")
    q = robot.neutral()
    robot.velocity(q, np.zeros(robot.nv), "panda_hand")
    size = magnitudes(robot.plan([5]), q[np.newaxis], np.zeros((1, robot.nv)), None, np.zeros((1, 24)))
    assert not size.vel.any()
    assert not size.w.any()
    assert "velocity" in [line.quantity for line in robot.certificate().lines]
