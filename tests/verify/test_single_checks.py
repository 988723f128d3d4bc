"""The check of one configuration has the comparison and the bound of the check of a batch."""

import cProfile
import pickle
import pstats
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import urdfkin
from tests.laws.subjects import NAMES, robot_of, state
from urdfkin import Reference, VerificationError
from urdfkin.compiled.evaluate import jacobians
from urdfkin.compiled.machine.single import make_single_evaluator
from urdfkin.compiled.preload import use_only
from urdfkin.errors import InputError
from urdfkin.kinematics.roundings import EPS
from urdfkin.model.base_motion import FIXED_BASE_STATE
from urdfkin.model.configuration import draw_base_motion, draw_samples
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.verify.bounds import Bound, compute_magnitudes
from urdfkin.verify.call import Call
from urdfkin.verify.oracle import Oracle, QueryBatch
from urdfkin.verify.quantities import JACOBIAN, QUANTITIES
from urdfkin.verify.verifier import compute_bound

ARMS = ("panda", "ur5", "talos", "kinova", "tiago", "elbow", "planar_two_link")
METHODS = {"placement": 1, "velocity": 2, "jacobian": 1, "hessian": 1, "acceleration": 3}


@pytest.fixture(autouse=True)
def _compiled() -> Iterator[None]:
    with use_only("compiled"):
        yield


def entries(robot: Robot) -> dict[str, tuple[int, float, float, int]]:
    return {x.quantity: (x.checked, x.worst, x.bound_ratio, x.unchecked) for x in robot.certificate().lines}


@pytest.mark.slow
@pytest.mark.parametrize("name", ARMS)
def test_the_check_of_a_single_call_records_the_results_of_the_check_of_a_batch(name: str) -> None:
    prompt, usual = urdfkin.load(name), urdfkin.load(name)
    frame = prompt.tip_frame
    for seed, reference in enumerate(Reference):
        drawn = draw_samples(prompt.tree, 6, np.random.default_rng(seed), with_zero_and_limits=True)
        for row in zip(drawn.q, drawn.v, drawn.a, strict=True):
            for method, count in METHODS.items():
                where: tuple[Any, ...] = (frame,) if method == "placement" else (frame, reference)
                inputs = tuple(x.copy() for x in row[:count])
                one = getattr(prompt, method)(*inputs, *where)
                other = getattr(usual, method)(*(x[np.newaxis] for x in inputs), *where)
                assert one.tobytes() == other.tobytes()
                assert entries(prompt) == entries(usual)
    assert prompt.certificate().verified
    # Even the first call of each method used the function for single configurations.
    fast = prompt._checked[frame]
    assert all(getattr(fast, f"_{method}").__name__ == "compute_and_check" for method in METHODS)


def planted(robot: Robot, method: str, place: int, by: float) -> Any:
    """Return the checked function of a method with one number that is wrong by `by`, or by one ulp for 0."""
    frame = robot.tip_frame
    plan = robot.plan([robot.tree.frame_link(frame)])
    compute, _ = make_single_evaluator(method, plan, Reference.LOCAL_WORLD_ALIGNED)

    def wrong(*given: Any) -> FloatArray | None:
        result = compute(*given)
        assert result is not None
        x = result.flat[place]
        result.flat[place] = x + (by if x <= 0.0 else -by) if by else np.nextafter(x, np.inf)
        return result

    return robot.verifier.make_checked_function(method, wrong, plan, frame, Reference.LOCAL_WORLD_ALIGNED)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["panda", "ur5", "tiago"])
@pytest.mark.parametrize("method", METHODS)
def test_an_error_in_any_number_of_a_single_result_is_detected(name: str, method: str) -> None:
    robot = urdfkin.load(name)
    q, v, a = (x[0].copy() for x in state(robot, 1, 4))
    inputs = (q, v, a)[: METHODS[method]]
    quantity = QUANTITIES[method]
    call = Call(robot.tree, robot.plan, robot.tip_frame, Reference.LOCAL_WORLD_ALIGNED, None, inputs)
    bound, shape = compute_bound(quantity, call.select(slice(0, 1))), quantity.result_shape(robot.nv)
    bounds = np.broadcast_to(EPS * bound.k * bound.scale, (1, 1, *shape)).ravel()
    step = max(1, len(bounds) // 60)  # some entries of a Hessian
    for place in range(0, len(bounds), step):
        check = planted(robot, method, place, 2.0 * bounds[place])
        with pytest.raises(VerificationError) as caught:
            check(*inputs, None)
        wrong = np.unravel_index(place, shape)
        assert abs(caught.value.ours - caught.value.theirs)[wrong] > caught.value.bound[wrong]
    (line,) = robot.certificate().lines
    assert (line.quantity, line.checked, line.unchecked) == (quantity.name, 0, 0)
    assert line.bound_ratio > 1.0
    assert not robot.certificate().verified


def test_a_result_that_is_not_finite_is_detected() -> None:
    robot = urdfkin.load("ur5")
    for bad in (np.inf, np.nan):
        with pytest.raises(VerificationError):
            planted(robot, "jacobian", 7, bad)(np.zeros(6), None)


def test_only_a_call_with_verify_false_counts_as_not_checked() -> None:
    robot = urdfkin.load("panda")
    q, frame = robot.neutral(), "panda_hand"
    for _ in range(3):
        robot.jacobian(q, frame)
    assert entries(robot)["jacobian"][0::3] == (3, 0)
    robot.jacobian(q, frame, verify=False)
    robot.jacobian(q, frame, verify="sample")
    assert entries(robot)["jacobian"][0::3] == (4, 1)
    unchecked = urdfkin.load("panda", verify=False)
    unchecked.jacobian(q, frame, verify=True)
    assert entries(unchecked)["jacobian"][0::3] == (1, 0)


def test_a_prepared_frame_and_the_unpickled_copy_check_results_on_request() -> None:
    robot = urdfkin.load("panda", verify=False)
    q = robot.neutral()
    fast = robot.prepare("panda_hand", verify=True)
    assert (fast.jacobian(q) == robot.prepare("panda_hand").jacobian(q)).all()
    assert (fast.jacobian(q.tolist()) == fast.jacobian(q)).all()
    assert entries(robot)["jacobian"][0::3] == (3, 1)
    copied = pickle.loads(pickle.dumps(fast))
    copied.velocity(q, q)
    assert copied._robot.certificate().verified
    with pytest.raises(InputError, match="verify"):
        robot.prepare("panda_hand", verify="sample")  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["panda", "ur5", "talos"])
def test_a_checked_jacobian_needs_at_most_130_function_calls(name: str) -> None:
    robot = urdfkin.load(name)
    q, frame = robot.sample(1)[0].copy(), robot.tip_frame
    for _ in range(2):
        robot.jacobian(q, frame)
    with cProfile.Profile() as profile:
        robot.jacobian(q, frame)
    assert pstats.Stats(profile).total_calls <= 130  # type: ignore[attr-defined]


# -- the bound, and Pinocchio's results --------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize("subject", [*NAMES, "ur5", "tiago"])
def test_magnitudes_of_one_configuration_are_equal_alone_and_in_a_batch(subject: str, moving: bool) -> None:
    robot = robot_of(subject) if subject in NAMES else urdfkin.load(subject, verify=False)
    rng = np.random.default_rng(1)
    drawn = draw_samples(robot.tree, 9, rng, with_zero_and_limits=True)
    drawn.v[3], drawn.a[4], drawn.v[5] = 0.0, 1e-310, 1e-200
    n = len(drawn.q)
    base = draw_base_motion(n, rng).state((n,)) if moving else FIXED_BASE_STATE
    plan = robot.plan(range(len(robot.link_names)))
    for v, a in ((None, None), (drawn.v, None), (drawn.v, drawn.a)):
        every = compute_magnitudes(plan, drawn.q, v, a, base)
        for k in range(n):
            at = slice(k, k + 1)
            rates = (None if x is None else x[at] for x in (v, a))
            one = compute_magnitudes(
                plan, drawn.q[at], next(rates), next(rates), base[at] if moving else base
            )
            for field in ("p", "roundings") if v is None else ("p", "w", "vel", "alpha", "acc", "roundings"):
                assert getattr(one, field)[0].tobytes() == getattr(every, field)[k].tobytes(), field


@pytest.mark.parametrize("name", ["ur5", "panda", "tiago", "a1"])
@pytest.mark.parametrize("moving", [False, True])
def test_a_bound_that_is_computed_once_is_valid_for_every_configuration(name: str, moving: bool) -> None:
    robot = urdfkin.load(name)
    q, rng = robot.sample(5, 1), np.random.default_rng(2)
    base = draw_base_motion(5, rng) if moving else None
    for frame in (robot.tip_frame, [*robot.link_names[-2:]]):
        for quantity in (QUANTITIES["placement"], JACOBIAN, QUANTITIES["hessian"]):
            for reference in Reference:
                part = Call(robot.tree, robot.plan, frame, reference, base, (q,)).select(slice(0, 5))
                size = compute_magnitudes(part.plan, part.q, None, None, part.state)
                expected = quantity.bound(part.plan, size, reference)
                shape = expected.scale.shape
                for found in (compute_bound(quantity, part), compute_bound(quantity, part)):
                    assert isinstance(found, Bound)
                    np.testing.assert_array_equal(np.broadcast_to(found.scale, shape), expected.scale)
                    np.testing.assert_array_equal(found.k + 0.0 * expected.k, expected.k)


@pytest.mark.parametrize("name", ["ur5", "panda", "talos", "a1", "tiago"])
def test_two_computations_of_a_jacobian_in_pinocchio_differ_by_less_than_half_the_bound(name: str) -> None:
    robot = urdfkin.load(name)
    oracle: Oracle = robot.verifier.oracle()
    q, frame = robot.sample(20, 3), robot.tip_frame
    plan = robot.plan([robot.tree.frame_link(frame)])
    size = compute_magnitudes(plan, q, None, None, FIXED_BASE_STATE)
    for reference in Reference:
        alone = oracle.jacobians(QueryBatch((frame,), (q,), reference))
        among = oracle.jacobians(QueryBatch((frame, robot.link_names[0]), (q,), reference))[:, :1]
        bound = JACOBIAN.bound(plan, size, reference)
        assert (np.abs(alone - among) <= 0.5 * EPS * bound.k * bound.scale).all()
        assert alone.shape == jacobians(plan, q, reference).shape
