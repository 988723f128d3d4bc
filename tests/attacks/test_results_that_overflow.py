"""A result that leaves the range of doubles is refused by every way of asking, checked or not."""

from collections.abc import Callable

import numpy as np
import pytest

import urdfkin
from urdfkin.compiled.plan import LANES
from urdfkin.compiled.python_numbers import LARGE
from urdfkin.errors import NotFiniteError, RangeError
from urdfkin.model.base_motion import BaseMotion
from urdfkin.robot import Robot

pytestmark = pytest.mark.filterwarnings("ignore::urdfkin.UrdfWarning")

FRAME = "tool0"
#: Rates or accelerations of this size give w^2 d, or w x vel, beyond all numbers.
HUGE = 1e200
METHODS: dict[str, Callable[..., object]] = {
    "acceleration": lambda r, q, v, a, **o: r.acceleration(q, v, a, FRAME, **o),
    "acceleration, local": lambda r, q, v, a, **o: r.acceleration(q, v, a, FRAME, "local", **o),
    "acceleration, world": lambda r, q, v, a, **o: r.acceleration(q, v, a, FRAME, "world", **o),
    "accelerations": lambda r, q, v, a, **o: r.acceleration(q, v, a, [FRAME, "base_link"], **o),
    "acceleration_breakdown": lambda r, q, v, a, **o: r.acceleration_breakdown(q, v, a, FRAME, **o),
}


@pytest.fixture(scope="module")
def ur5() -> Robot:
    return urdfkin.load("ur5")


@pytest.mark.parametrize("verify", [True, False, "sample"])
@pytest.mark.parametrize("method", METHODS)
def test_of_a_single_configuration_and_of_a_batch(ur5: Robot, method: str, verify: bool | str) -> None:
    q, v = ur5.sample(3 * LANES + 1, 1), np.ones((3 * LANES + 1, 6))
    for row in (0, LANES, 3 * LANES):
        wild = v.copy()
        wild[row] = HUGE
        with pytest.raises(RangeError):
            METHODS[method](ur5, q, wild, v, verify=verify)
        with pytest.raises(RangeError):
            METHODS[method](ur5, q[row], wild[row], v[row], verify=verify)
    METHODS[method](ur5, q, v, v, verify=verify)


@pytest.mark.parametrize("reference", ["local", "world", "local_world_aligned"])
def test_of_a_prepared_frame_which_then_counts_nothing(reference: str) -> None:
    robot = urdfkin.load("ur5")
    fast, q, v = robot.prepare(FRAME, reference), robot.sample(1)[0], np.ones(6)
    before = fast.acceleration(q, v, v)
    for wild in (np.full(6, HUGE), np.full(6, -HUGE), np.full(6, 1e308)):
        with pytest.raises(RangeError):
            fast.acceleration(q, wild, v)
    with pytest.raises(NotFiniteError):
        fast.acceleration(q, np.full(6, np.nan), v)
    np.testing.assert_array_equal(fast.acceleration(q, v, v), before)
    assert [line.unchecked for line in robot.certificate().lines] == [2]


@pytest.mark.parametrize("threads", [1, 2, 3, None])
@pytest.mark.parametrize("row", [0, 2500, 4999])
def test_in_the_part_of_any_thread(ur5: Robot, threads: int | None, row: int) -> None:
    q, v = ur5.sample(5000, 1), np.ones((5000, 6))
    v[row] = HUGE
    with pytest.raises(RangeError, match=f"sample {row} of 5000"):
        ur5.acceleration(q, v, v, FRAME, threads=threads, verify=False)
    with pytest.raises(RangeError):
        ur5.jacobian_rate(q, v * 1e108, FRAME, "local", threads=threads, verify=False)


def test_on_a_base_that_moves_too_fast(ur5: Robot) -> None:
    q, v = ur5.sample(4), np.ones((4, 6))
    one, several = np.full(6, HUGE), np.ones((4, 6))
    several[2] = HUGE
    for rates in (one, several):
        with pytest.raises(RangeError):
            ur5.acceleration(q, v, v, FRAME, base=BaseMotion(velocity=rates), verify=False)


def test_of_a_robot_that_is_itself_of_that_size() -> None:
    robot = urdfkin.load(
        '<robot name="r"><link name="a"/><link name="b"/><link name="c"/><joint name="j" type="continuous">'
        '<parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint><joint name="k" type="fixed">'
        '<parent link="b"/><child link="c"/><origin xyz="1e250 0 0"/></joint></robot>'
    )
    fast = robot.prepare("c")
    for rate in (1e30, 1e44):  # of an ordinary robot nobody would look
        with pytest.raises(RangeError):
            fast.acceleration(np.zeros(1), np.array([rate]), np.zeros(1))
        with pytest.raises(RangeError):
            robot.acceleration([0.0], [rate], [0.0], "c", verify=False)
    assert fast.acceleration(np.zeros(1), np.array([2.0]), np.zeros(1))[0] == -4e250


@pytest.mark.parametrize("method", METHODS)
def test_results_that_exist_are_handed_out_however_large(ur5: Robot, method: str) -> None:
    # A power of two scales every product exactly: the bits are those of the same motion, slower.
    factor = 2.0**450
    assert factor > LARGE
    q, v = ur5.sample(5, 2), np.random.default_rng(3).normal(size=(5, 6))
    slow, fast = (METHODS[method](ur5, q, v * f, v * f * f, verify=False) for f in (1.0, factor))
    if isinstance(slow, np.ndarray):
        np.testing.assert_array_equal(slow * factor * factor, fast)
        single = ur5.prepare(FRAME).acceleration(q[0], v[0] * factor, v[0] * factor * factor)
        if method == "acceleration" and isinstance(fast, np.ndarray):
            np.testing.assert_array_equal(single, fast[0])
    METHODS[method](ur5, q, v * factor, v * factor * factor)


def test_the_limit_is_where_nothing_can_overflow_below_it() -> None:
    # N joints of the largest numbers that are not looked at: the bound on w^2 d in the limit's comment.
    joints = 10_000
    assert np.isfinite(4.0 * joints**3 * LARGE**6)
