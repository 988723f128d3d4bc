"""An infinite or NaN number raises an error with the name of the joint, with and without a check."""

import itertools
from collections.abc import Callable, Iterator

import numpy as np
import pytest

import urdfkin
from tests.laws.subjects import robot_of, state
from urdfkin.compiled.plan import LANES
from urdfkin.errors import InputError, NotFiniteError
from urdfkin.model.base_motion import BaseMotion
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.robot.frame_motion import frame_motion

Compute = Callable[..., object]

#: A frame whose path contains neither the finger nor the joints after link 3.
FRAME = "panda_link3"
#: Number of inputs of a method, from q, v and a; and a call of the method.
METHODS: dict[str, tuple[int, Compute]] = {
    "placement": (1, lambda r, q, **o: r.placement(q, FRAME, **o)),
    "velocity": (2, lambda r, q, v, **o: r.velocity(q, v, FRAME, **o)),
    "velocity, local": (2, lambda r, q, v, **o: r.velocity(q, v, FRAME, "local", **o)),
    "jacobian": (1, lambda r, q, **o: r.jacobian(q, FRAME, "world", **o)),
    "acceleration": (3, lambda r, q, v, a, **o: r.acceleration(q, v, a, FRAME, **o)),
    "acceleration, local": (3, lambda r, q, v, a, **o: r.acceleration(q, v, a, FRAME, "local", **o)),
    "jacobian_rate": (2, lambda r, q, v, **o: r.jacobian_rate(q, v, FRAME, **o)),
    "hessian": (1, lambda r, q, **o: r.hessian(q, FRAME, "local", **o)),
    "placements": (1, lambda r, q, **o: r.placement(q, [FRAME, "panda_link1"], **o)),
    "velocities": (2, lambda r, q, v, **o: r.velocity(q, v, [FRAME], **o)),
    "jacobians": (1, lambda r, q, **o: r.jacobian(q, [FRAME], **o)),
    "accelerations": (3, lambda r, q, v, a, **o: r.acceleration(q, v, a, [FRAME], **o)),
    "analytical_jacobian": (1, lambda r, q, **o: r.analytical_jacobian(q, FRAME, "quaternion", **o)),
    "acceleration_breakdown": (3, lambda r, q, v, a, **o: r.acceleration_breakdown(q, v, a, FRAME, **o)),
    "frame_motion": (3, lambda r, q, v, a, **o: frame_motion(r, (q, v, a), FRAME)),
}
BAD = (np.nan, np.inf, -np.inf)


@pytest.fixture(scope="module")
def panda() -> Robot:
    return urdfkin.load("panda")


def spoiled(inputs: list[FloatArray], samples: tuple[int, ...]) -> Iterator[tuple[int, int, float]]:
    """Replace each number of some samples in turn; yield the indices of input and number, and the value."""
    places = ((i, sample, k) for i, x in enumerate(inputs) for sample in samples for k in range(x.shape[-1]))
    for (which, sample, coordinate), bad in zip(places, itertools.cycle(BAD), strict=False):
        x = inputs[which]
        right, x[sample, coordinate] = x[sample, coordinate], bad
        yield which, coordinate, bad
        x[sample, coordinate] = right


@pytest.mark.parametrize("verify", [True, False, "sample"])
@pytest.mark.parametrize("method", METHODS)
def test_nan_is_reported_at_each_position_of_a_batch(panda: Robot, method: str, verify: bool | str) -> None:
    count, compute = METHODS[method]
    inputs = list(state(panda, 2 * LANES + 3, 1)[:count])
    names = panda.coordinate_names, panda.velocity_names, panda.velocity_names
    for which, coordinate, bad in spoiled(inputs, (0, LANES - 1, LANES, 2 * LANES + 2)):
        with pytest.raises(NotFiniteError, match=f"{'qva'[which]} must be finite") as caught:
            compute(panda, *inputs, verify=verify)
        assert caught.value.where == names[which][coordinate]
        assert str(bad) in str(caught.value)


@pytest.mark.parametrize("method", [name for name in METHODS if name != "frame_motion"])
def test_nan_is_reported_at_each_position_of_a_single_configuration(panda: Robot, method: str) -> None:
    count, compute = METHODS[method]
    inputs = list(state(panda, 1, 2)[:count])
    for which, coordinate, _ in spoiled(inputs, (0,)):
        for verify in (True, False):
            with pytest.raises(NotFiniteError, match=f"{'qva'[which]} must be finite") as caught:
                compute(panda, *(x[0] for x in inputs), verify=verify)
            assert caught.value.where == panda.velocity_names[coordinate]


@pytest.mark.parametrize("row", [0, 100, 2500, 4998, 4999])
def test_an_invalid_number_is_reported_in_the_rows_of_each_thread(panda: Robot, row: int) -> None:
    q, v, a = state(panda, 5000, 3)
    a[row, 7] = np.nan
    for threads in (1, 2, 3, None):
        with pytest.raises(NotFiniteError, match="a must be finite"):
            panda.acceleration(q, v, a, FRAME, threads=threads, verify=False)
    q[row, 6] = np.inf
    for threads in (1, 2, 3, None):
        with pytest.raises(NotFiniteError, match="q must be finite"):
            panda.jacobian(q, FRAME, threads=threads, verify=False)


@pytest.mark.parametrize("verify", [True, False])
def test_nan_is_reported_in_coordinates_of_planar_and_floating_joints(verify: bool) -> None:
    robot = robot_of("planar_and_floating_in_the_middle")
    inputs = list(state(robot, 2, 4))
    for which, coordinate, _ in spoiled(inputs, (0, 1)):
        name = (robot.velocity_names if which else robot.coordinate_names)[coordinate]
        # The error about a quaternion names only the joint.
        joint = name.split(".")[0]
        with pytest.raises(InputError, match=joint):
            robot.acceleration(inputs[0], inputs[1], inputs[2], robot.tip_frame, verify=verify)


def test_nan_is_reported_on_a_moving_base(panda: Robot) -> None:
    q = panda.sample(LANES + 1, 5)
    q[-1, -1] = np.nan
    base = BaseMotion(velocity=np.ones((LANES + 1, 6)))
    for verify in (True, False):
        with pytest.raises(NotFiniteError, match="panda_finger_joint1"):
            panda.placement(q, FRAME, base=base, verify=verify)


def test_nan_is_reported_in_an_input_that_is_broadcast(panda: Robot) -> None:
    v = panda.neutral()
    v[3] = np.nan
    with pytest.raises(NotFiniteError) as caught:
        panda.velocity(panda.sample(40, 6), v, FRAME, verify=False)
    assert caught.value.where == "panda_joint4"
