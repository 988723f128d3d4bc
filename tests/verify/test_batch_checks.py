"""A check in parts, or of a sample, has the result of a check of all configurations at once."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

import urdfkin
from tests.laws.subjects import state
from urdfkin.errors import InputError, OracleError
from urdfkin.model.base_motion import BaseMotion
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.verify import pinocchio, verifier
from urdfkin.verify.certificate import Certificate
from urdfkin.verify.oracle import Oracle, QueryBatch
from urdfkin.verify.quantities import PLACEMENT, Quantity
from urdfkin.verify.verifier import SAMPLE_SIZE, Verify, split_into_parts

#: Numbers of values in a part: of one configuration, of a few, and of all.
SIZES = (1, 200, 10**9)
FRAMES = ("panda_hand", "panda_link2", "panda_link7")
#: Value of the finger joint that marks the configurations with a wrong result of Pinocchio.
MARK = 0.123456


def calls(
    robot: Robot, q: FloatArray, v: FloatArray, a: FloatArray, base: BaseMotion | None, verify: Verify
) -> dict[str, Callable[[], FloatArray]]:
    asked: dict[str, Any] = {"base": base, "verify": verify}
    return {
        "placement": lambda: robot.placement(q, FRAMES, **asked),
        "velocity": lambda: robot.velocity(q, v, FRAMES[0], "local", **asked),
        "jacobian": lambda: robot.jacobian(q, FRAMES[0], "world", **asked),
        "jacobian rate": lambda: robot.jacobian_rate(q, v, FRAMES[0], **asked),
        "hessian": lambda: robot.hessian(q, FRAMES[0], "local", **asked),
        "acceleration": lambda: robot.acceleration(q, v, a, FRAMES, "world", **asked),
    }


def moving(shape: tuple[int, ...] | None) -> BaseMotion | None:
    if shape is None:
        return None
    generator = np.random.default_rng(8)
    T = np.broadcast_to(np.eye(4), (*shape, 4, 4)).copy()
    T[..., :3, 3] = generator.standard_normal((*shape, 3))
    return BaseMotion(T, *generator.standard_normal((2, *shape, 6)))


def batch(robot: Robot, shape: tuple[int, ...]) -> list[FloatArray]:
    return [x.reshape(*shape, -1) for x in state(robot, int(np.prod(shape)), 4)]


@pytest.fixture(scope="module")
def panda() -> Robot:
    return urdfkin.load("panda")


@pytest.fixture
def fresh(panda: Robot) -> Robot:
    """Empty the ledger, without building Pinocchio's models again."""
    panda.verifier.ledger = type(panda.verifier.ledger)()
    panda._prepared.clear()
    return panda


@pytest.fixture
def lies(monkeypatch: pytest.MonkeyPatch) -> None:
    """Add a relative error of 1e-6 to Pinocchio's results at `MARK`, and a larger error beyond `MARK`."""
    right = verifier.compute_oracle_results

    def wrong(quantity: Quantity, oracle: Oracle, asked: QueryBatch) -> FloatArray:
        theirs, finger = right(quantity, oracle, asked), asked.inputs[0][:, 7]
        size = np.where(np.abs(finger - MARK) < 1e-3, 1e-6 + np.abs(finger - MARK), 0.0)
        # The last row of a placement must be exact: any error in this row would be the worst.
        rows = theirs[..., :3, :] if quantity is PLACEMENT else theirs
        rows *= 1.0 + size.reshape(-1, *[1] * (theirs.ndim - 1))
        return theirs

    def wrong_in_blocks(*asked: Any) -> Iterator[FloatArray]:
        theirs = wrong(*asked)
        return (theirs[i : i + 5] for i in range(0, len(theirs), 5))

    monkeypatch.setattr(verifier, "compute_oracle_results", wrong)
    monkeypatch.setattr(verifier, "yield_oracle_blocks", wrong_in_blocks)


BATCHES = [
    ((), None), ((), ()), ((23,), None), ((23,), ()), ((23,), (23,)), ((2, 11), None), ((2, 11), ()),
    ((2, 11), (2, 11)), ((2, 11), (11,)),
]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("shape", "base"), BATCHES)
@pytest.mark.usefixtures("lies")
def test_the_error_names_the_worst_sample_in_any_part_of_the_batch(
    fresh: Robot, monkeypatch: pytest.MonkeyPatch, shape: tuple[int, ...], base: tuple[int, ...] | None
) -> None:
    q, v, a = batch(fresh, shape)
    first, last, motion = tuple(0 for _ in shape), tuple(size - 1 for size in shape), moving(base)
    for worst, other in ((first, last), (last, first)):
        q[..., 7] = 0.0
        q[(*other, 7)] = MARK
        q[(*worst, 7)] = MARK + 1e-4
        for size in SIZES:
            monkeypatch.setattr(verifier, "_MAX_VALUES", size)
            for quantity, compute in calls(fresh, q, v, a, motion, True).items():
                with pytest.raises(urdfkin.VerificationError) as caught:
                    compute()
                error = caught.value
                assert (error.quantity, error.index) == (quantity, worst), size
                expected = calls(fresh, q, v, a, motion, False)[quantity]()[worst]
                frame = FRAMES.index(error.frame)
                ours = expected[frame] if expected.ndim > error.ours.ndim else expected
                np.testing.assert_array_equal(error.ours, ours)
    assert not any(line.checked for line in fresh.certificate().lines)


@pytest.mark.slow
@pytest.mark.parametrize(("shape", "base"), BATCHES)
def test_the_certificate_does_not_depend_on_the_division_into_parts(
    fresh: Robot, monkeypatch: pytest.MonkeyPatch, shape: tuple[int, ...], base: tuple[int, ...] | None
) -> None:
    found = list[Certificate]()
    q, v, a = batch(fresh, shape)
    for size in SIZES:
        monkeypatch.setattr(verifier, "_MAX_VALUES", size)
        fresh.verifier.ledger = type(fresh.verifier.ledger)()
        for compute in calls(fresh, q, v, a, moving(base), True).values():
            compute()
        found.append(fresh.certificate())
    assert found[0] == found[1] == found[2]
    n, counts = int(np.prod(shape)), {line.quantity: line.checked for line in found[0].lines}
    several = ("placement", "acceleration")
    assert counts == {quantity: n * (3 if quantity in several else 1) for quantity in counts}
    assert len(counts) == 6
    assert found[0].verified


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("mimic", [True, False])
@pytest.mark.parametrize("frames", [FRAMES[:1], FRAMES])
def test_pinocchios_jacobians_are_equal_in_blocks_and_in_one_call(
    monkeypatch: pytest.MonkeyPatch, size: int, mimic: bool, frames: tuple[str, ...]
) -> None:
    robot = urdfkin.load("panda", mimic=mimic)
    oracle: Oracle = robot.verifier.oracle()
    for n in (0, 1, 23):
        query = QueryBatch(frames, (robot.sample(n, 1),), "world")
        at_once = oracle.jacobians(query)
        with monkeypatch.context() as patch:
            patch.setattr(pinocchio, "_FLOATS_PER_BLOCK", size)
            blocks = [block.copy() for block in oracle.jacobian_blocks(query)]
        assert np.concatenate(blocks).tobytes() == at_once.tobytes()
        assert len(blocks) == 1 or all(block.size <= max(size, at_once[0].size) for block in blocks)


def test_blocks_of_jacobians_of_a_robot_without_moving_joints_have_no_columns() -> None:
    robot = urdfkin.load('<robot name="r"><link name="a"/></robot>')
    (block,) = robot.verifier.oracle().jacobian_blocks(QueryBatch(("a",), (np.zeros((40_000, 0)),)))
    assert block.shape == (40_000, 1, 6, 0)
    robot.jacobian(np.zeros((40_000, 0)), "a")
    assert [line.checked for line in robot.certificate().lines] == [40_000]


@pytest.mark.slow
@pytest.mark.parametrize("base", [None, (), (250,)])
@pytest.mark.parametrize("size", SIZES)
def test_with_sample_a_part_of_a_large_batch_is_checked_and_the_rest_counted_as_unchecked(
    fresh: Robot, monkeypatch: pytest.MonkeyPatch, size: int, base: tuple[int, ...] | None
) -> None:
    monkeypatch.setattr(verifier, "_MAX_VALUES", size)
    q, v, a = batch(fresh, (250,))
    for compute in calls(fresh, q, v, a, moving(base), "sample").values():
        compute()
    certificate = fresh.certificate()
    for line in certificate.lines:
        of = {"placement": 3, "acceleration": 3}.get(line.quantity, 1)
        assert (line.checked, line.unchecked) == (SAMPLE_SIZE * of, (250 - SAMPLE_SIZE) * of)
        assert line.worst > 0.0
        assert 0.0 < line.bound_ratio < 1.0
    assert len(certificate.lines) == 6
    assert not certificate.verified
    assert certificate.not_verified == ('verify="sample" checks 100 configurations of a call',)


@pytest.mark.parametrize("n", [0, 1, 99, SAMPLE_SIZE])
def test_with_sample_a_small_batch_is_checked_completely(fresh: Robot, n: int) -> None:
    fresh.jacobian(fresh.sample(n, 1), "panda_hand", verify="sample")
    certificate = fresh.certificate()
    assert [(line.checked, line.unchecked) for line in certificate.lines] == [(n, 0)] * (n > 0)
    assert certificate.verified is (n > 0)
    assert certificate.not_verified == ()


@pytest.mark.parametrize("n", [101, 1000])
@pytest.mark.parametrize("numbers", [1, 6, 48, 10**7])
def test_the_checked_sample_is_deterministic_distinct_and_spread_over_the_batch(n: int, numbers: int) -> None:
    drawn, again = (
        [i for part in split_into_parts("sample", n, numbers) for i in np.arange(n)[part].tolist()]
        for _ in range(2)
    )
    assert drawn == again == sorted(drawn)
    assert len(set(drawn)) == SAMPLE_SIZE
    assert drawn[0] < n // 10
    assert drawn[-1] >= n - n // 10


@pytest.mark.parametrize("numbers", [0, 1, 48, 10**7])
@pytest.mark.parametrize("n", [0, 1, 5000])
def test_the_parts_of_a_complete_check_contain_each_configuration_once(n: int, numbers: int) -> None:
    choices: tuple[Verify, ...] = (True, "sample") if n <= SAMPLE_SIZE else (True,)
    for verify in choices:
        indices = [i for part in split_into_parts(verify, n, numbers) for i in np.arange(n)[part].tolist()]
        assert indices == list(range(n))


@pytest.mark.usefixtures("lies")
def test_an_error_in_the_checked_sample_is_detected_and_an_error_outside_is_not(fresh: Robot) -> None:
    drawn = np.concatenate([np.arange(250)[part] for part in split_into_parts("sample", 250, 48)])
    inside, outside = int(drawn[57]), int(np.setdiff1d(np.arange(250), drawn)[3])
    q, v, a = batch(fresh, (250,))
    q[:, 7] = 0.0
    q[outside, 7] = MARK
    for compute in calls(fresh, q, v, a, None, "sample").values():
        compute()
    q[inside, 7] = MARK
    for shape in ((250,), (5, 50)):
        shaped = [x.reshape(*shape, -1) for x in (q, v, a)]
        for compute in calls(fresh, shaped[0], shaped[1], shaped[2], moving(shape), "sample").values():
            with pytest.raises(urdfkin.VerificationError) as caught:
                compute()
            assert caught.value.index == tuple(np.unravel_index(inside, shape))


def test_a_call_can_override_the_option_verify_of_the_robot() -> None:
    robot = urdfkin.load("ur5", verify="sample")
    q = robot.sample(103, 1)
    robot.placement(q, "tool0")
    robot.placement(q, "tool0", verify=True)
    robot.placement(q[0], "tool0")
    robot.placement(q[0], "tool0", verify=False)
    (line,) = robot.certificate().lines
    assert (line.checked, line.unchecked) == (SAMPLE_SIZE + 103 + 1, 3 + 1)
    assert robot.certificate().not_verified == (
        "the check was turned off by verify=False",
        'verify="sample" checks 100 configurations of a call',
    )


@pytest.mark.parametrize("verify", ["sampled", "", "True", 1, 0, None, np.True_, np.ones(2), ["sample"]])
def test_an_invalid_value_of_verify_is_refused(fresh: Robot, verify: Any) -> None:
    refused = pytest.raises(InputError, match='verify must be True, False or "sample"')
    with refused:
        urdfkin.load("ur5", verify=verify)
    if verify is not None:
        with refused:
            fresh.jacobian(fresh.neutral(), "panda_hand", verify=verify)
    assert fresh.certificate().lines == ()


@pytest.mark.parametrize("count", [0, 4, 6])
def test_an_oracle_that_returns_results_of_too_few_or_too_many_configurations_is_an_error(
    count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = urdfkin.load("planar_two_link")
    q, right = robot.sample(5), verifier.compute_oracle_results
    rows = np.arange(count) % 5
    monkeypatch.setattr(verifier, "compute_oracle_results", lambda *asked: right(*asked)[rows])
    monkeypatch.setattr(verifier, "yield_oracle_blocks", lambda *asked: iter([right(*asked)[rows]]))
    for compute in (robot.placement, robot.jacobian):
        with pytest.raises(OracleError, match=rf"each configuration: found {count} of 5 results"):
            compute(q, "tip")
    assert not robot.certificate().lines
