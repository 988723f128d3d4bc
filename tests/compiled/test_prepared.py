"""A prepared frame gives the same result or error as the robot's general implementation."""

import copy
import ctypes
import pickle
import sys
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numba
import numpy as np
import pytest

import urdfkin
from tests.cli.running import python
from tests.laws.subjects import differing, robot_of, state
from urdfkin import Reference
from urdfkin.compiled.machine.single import array_layout_is_known, make_single_evaluator, one_configuration
from urdfkin.compiled.plan import KernelArgs
from urdfkin.compiled.prepared import PreparedFrame
from urdfkin.errors import InputError, UnknownNameError, UrdfkinError
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot

FRAME = "panda_hand"


@pytest.fixture(scope="module")
def panda() -> Robot:
    return urdfkin.load("panda", verify=False)


def outcome(compute: Callable[[], FloatArray]) -> FloatArray | str:
    try:
        return compute()
    except UrdfkinError as error:
        return f"{type(error).__name__}: {error}"


def ways(
    robot: Robot, frame: str, method: str, inputs: tuple[Any, ...], **out: Any
) -> list[FloatArray | str]:
    """Results of a prepared frame, of the robot, and of the robot with one thread (no prepared frame)."""
    fast, by_robot = getattr(robot.prepare(frame, "local"), method), getattr(robot, method)
    reference = () if method == "placement" else ("local",)
    return [
        outcome(lambda: fast(*inputs, **out)),
        outcome(lambda: by_robot(*inputs, frame, *reference, verify=False, **out)),
        outcome(lambda: by_robot(*inputs, frame, *reference, verify=False, threads=1, **out)),
    ]


def agree(outcomes: list[FloatArray | str]) -> bool:
    first = outcomes[0]
    if isinstance(first, str):
        return all(isinstance(other, str) and other == first for other in outcomes)
    return not any(isinstance(other, str) or differing(first, other) for other in outcomes[1:])


METHODS = {"placement": 1, "velocity": 2, "jacobian": 1, "acceleration": 3}

_SPACED = np.zeros((8, 3))
_SPACED[:, 1] = np.linspace(-1.0, 1.0, 8)
_PACKED = np.zeros(8, dtype=np.dtype([("flag", "i1"), ("x", "f8")]))
_PACKED["x"] = 0.25
_READ_ONLY = np.linspace(-1.0, 1.0, 8)
_READ_ONLY.setflags(write=False)

#: Inputs for an array of 8 numbers, valid and invalid.
GIVEN: dict[str, Any] = {
    "a list": [0.1] * 8,
    "a tuple of whole numbers": (1,) * 8,
    "a list of NumPy's numbers": list(np.full(8, 0.1, dtype=np.float32)),
    "float32": np.full(8, 0.1, dtype=np.float32),
    "float16": np.full(8, 0.1, dtype=np.float16),
    "longdouble": np.full(8, 0.1, dtype=np.longdouble),
    "int64": np.arange(8),
    "bool": np.ones(8, dtype=bool),
    "objects": np.full(8, 0.1).astype(object),
    "of the other byte order": np.full(8, 0.1, dtype=">f8"),
    "every third number": _SPACED[:, 1],
    "reversed": np.linspace(-1.0, 1.0, 8)[::-1],
    "not aligned": _PACKED["x"],
    "read-only": _READ_ONLY,
    "one of another process": pickle.loads(pickle.dumps(np.full(8, 0.1))),
    "a batch": np.full((3, 8), 0.1),
    "a batch of none": np.zeros((0, 8)),
    "a column": np.zeros((8, 1)),
    "too short": np.zeros(7),
    "too long": np.zeros(9),
    "empty": np.zeros(0),
    "an empty list": [],
    "an empty set": set(),
    "a number": 1.0,
    "an array without axes": np.array(1.0),
    "none": None,
    "text": "12345678",
    "texts": ["1"] * 8,
    "complex": np.zeros(8, dtype=complex),
    "dates": np.zeros(8, dtype="M8[s]"),
    "a ragged list": [[1.0, 2.0], [3.0]],
    "too large for a float": [10**400] * 8,
    "an integer too large for anything": 10**400,
    "nan": np.array([0, 0, np.nan, 0, 0, 0, 0, 0.0]),
    "inf off the path": np.array([0, 0, 0, 0, 0, 0, 0, np.inf]),
    "a list with nan": [0.0] * 7 + [float("nan")],
}


@pytest.mark.slow
@pytest.mark.parametrize("given", GIVEN)
@pytest.mark.parametrize("method", METHODS)
def test_unusual_inputs_give_the_same_result_or_error(panda: Robot, method: str, given: str) -> None:
    usual = [np.linspace(-0.5, 0.9, 8), np.linspace(1.0, -1.0, 8), np.full(8, 0.3)][: METHODS[method]]
    for place in range(len(usual)):
        inputs = tuple(GIVEN[given] if i == place else x for i, x in enumerate(usual))
        assert agree(ways(panda, FRAME, method, inputs)), place


_FROZEN = np.zeros((6, 8))
_FROZEN.setflags(write=False)

#: Values of `out` for a Jacobian, valid and invalid.
OUTS: dict[str, Any] = {
    "right": np.full((6, 8), np.nan),
    "of the wrong shape": np.zeros((8, 6)),
    "flat": np.zeros(48),
    "of a batch": np.zeros((1, 6, 8)),
    "float32": np.zeros((6, 8), dtype=np.float32),
    "of the other byte order": np.zeros((6, 8), dtype=">f8"),
    "in columns": np.zeros((6, 8), order="F"),
    "every second number": np.zeros((6, 16))[:, ::2],
    "read-only": _FROZEN,
    "a list": [[0.0] * 8] * 6,
    "an empty list": [],
    "a number": 1.0,
}


@pytest.mark.parametrize("out", OUTS)
def test_unusual_outs_give_the_same_result_or_error(panda: Robot, out: str) -> None:
    q = np.linspace(-0.5, 0.9, 8)
    outcomes = ways(panda, FRAME, "jacobian", (q,), out=OUTS[out])
    assert agree(outcomes)
    if out == "right":
        assert not np.isnan(OUTS[out]).any()
    else:
        assert str(outcomes[0]).startswith("InputError: out must be a writable C-contiguous float64 array")


@pytest.mark.parametrize("method", METHODS)
def test_out_is_returned(panda: Robot, method: str) -> None:
    inputs = [x[0] for x in state(panda, 1, 1)][: METHODS[method]]
    fast = getattr(panda.prepare(FRAME), method)
    expected = fast(*inputs)
    out = np.full_like(expected, np.nan)
    assert fast(*inputs, out=out) is out
    assert not differing(out, expected)
    listed = np.full_like(expected, np.nan)
    assert fast(*(x.tolist() for x in inputs), out=listed) is listed
    assert not differing(listed, expected)


def test_an_out_that_shares_memory_with_an_input_is_refused_and_not_changed() -> None:
    robot = urdfkin.load("ur5", verify=False)
    memory = np.linspace(-1.0, 1.0, 60)
    before = memory.copy()
    words = "out must not share memory with q, v or a"
    for reference in Reference:
        fast, q = robot.prepare("tool0", reference), np.ones(6)
        for start in (0, 1, 5):
            inside = memory[start : start + 6]
            with pytest.raises(InputError, match=words):
                fast.velocity(q, memory[:6], out=inside)
            with pytest.raises(InputError, match=words):
                fast.velocity(memory[:6], q, out=inside)
            with pytest.raises(InputError, match=words):
                fast.acceleration(q, q, memory[:6], out=inside)
        for start in (1, 20, 41):
            with pytest.raises(InputError, match=words):
                fast.jacobian(memory[start : start + 6], out=memory[6:42].reshape(6, 6))
    for start in (1, 8, 21):
        with pytest.raises(InputError, match=words):
            robot.prepare("tool0").placement(memory[start : start + 6], out=memory[6:22].reshape(4, 4))
    assert (memory == before).all()
    # Adjacent arrays share no memory.
    robot.prepare("tool0").velocity(np.ones(6), memory[:6], out=memory[6:12])
    robot.prepare("tool0").velocity(np.ones(6), memory[12:18], out=memory[6:12])


def test_results_share_no_memory(panda: Robot) -> None:
    for method, count in METHODS.items():
        inputs = [x[0] for x in state(panda, 1, 2)][:count]
        fast = getattr(panda.prepare(FRAME), method)
        results = [fast(*inputs) for _ in range(4)]
        expected = results[0].copy()
        results[1][...] = 7.0
        assert not differing(results[0], expected)
        assert not differing(fast(*inputs), expected)
        for i, one in enumerate(results):
            assert one.flags.writeable
            assert one.flags.c_contiguous
            assert not any(np.shares_memory(one, other) for other in results[i + 1 :])


@pytest.mark.parametrize("root_joint", [None, "floating"])
@pytest.mark.parametrize("name", ["floating_root", "planar_and_floating_in_the_middle", "a1"])
def test_the_quaternion_of_a_floating_joint_is_normalised(name: str, root_joint: str | None) -> None:
    robot = robot_of(name, root_joint=root_joint if name == "a1" else None)
    q, v, a = (x[0] for x in state(robot, 1, 3))
    for method, count in METHODS.items():
        inputs = (q, v, a)[:count]
        assert agree(ways(robot, robot.tip_frame, method, inputs))
        nearly = (q * (1.0 + 4e-7), v, a)[:count]  # Only a quaternion is restricted.
        assert agree(ways(robot, robot.tip_frame, method, nearly))
        off = (q * 1.01, v, a)[:count]
        outcomes = ways(robot, robot.tip_frame, method, off)
        assert agree(outcomes)
        floats = any(joint.kind.nq == 7 for joint in robot.tree.joints)
        assert isinstance(outcomes[0], str) == floats


def test_unknown_names_raise_the_same_error_as_the_robot(panda: Robot) -> None:
    q = panda.neutral()
    panda.jacobian(q, FRAME, Reference.WORLD)  # An earlier call must not change the errors.
    for frame in ("pnda_hand", "", 3):
        with pytest.raises((InputError, UnknownNameError)) as long:
            panda.jacobian(q, frame, threads=1)  # type: ignore[arg-type]
        for way in (panda.prepare, lambda frame: panda.jacobian(q, frame)):
            with pytest.raises(type(long.value)) as caught:
                way(frame)  # type: ignore[arg-type]
            # A robot also accepts several frames, and its message for other types says so.
            assert str(caught.value) == str(long.value) or (
                way == panda.prepare and not isinstance(frame, str)
            )
    with pytest.raises(InputError, match="a frame must be a name of a link or joint"):
        panda.prepare(["panda_hand"])  # type: ignore[arg-type]
    for reference in ("globe", "", None, 1, 1.0, True, ["local"], {"local": 1}):
        for refer in (panda.prepare, lambda frame, other: panda.jacobian(q, frame, other)):
            with pytest.raises(UnknownNameError, match="unknown reference"):
                refer(FRAME, reference)  # type: ignore[arg-type]


def test_a_robot_without_moving_joints_has_empty_jacobians() -> None:
    robot = urdfkin.load('<robot name="r"><link name="a"/></robot>', verify=False)
    fast = robot.prepare("a")
    assert fast.jacobian(np.zeros(0)).shape == (6, 0)
    assert (fast.placement(np.zeros(0)) == np.eye(4)).all()
    assert not fast.velocity(np.zeros(0), np.zeros(0)).any()


def test_a_copy_works_after_the_original_is_deleted() -> None:
    robot = urdfkin.load("panda", verify=False)
    q, fast = robot.sample(1, 5)[0], robot.prepare(FRAME, "world")
    expected = fast.jacobian(q)
    text = pickle.dumps(fast)
    copies: list[PreparedFrame] = [copy.copy(fast), copy.deepcopy(fast), pickle.loads(text)]
    again: Robot = pickle.loads(pickle.dumps(robot))
    copies.append(again.prepare(FRAME, "world"))
    del robot, fast, again
    for other in copies:
        assert (other.frame, other.reference) == (FRAME, Reference.WORLD)
        assert not differing(other.jacobian(q), expected)


@pytest.mark.slow
def test_a_prepared_frame_can_be_sent_to_another_process(tmp_path: Any) -> None:
    robot = urdfkin.load("panda", verify=False)
    q, fast = robot.sample(1, 6)[0], robot.prepare(FRAME)
    (tmp_path / "fast").write_bytes(pickle.dumps((fast, q, fast.jacobian(q))))
    program = (
        "import pickle, sys; fast, q, J = pickle.load(open(sys.argv[1], 'rb'));"
        "assert (fast.jacobian(q) == J).all()"
    )
    assert python(program, str(tmp_path / "fast")).stderr == ""


def test_a_wrong_number_of_arguments_returns_none(panda: Robot) -> None:
    q, fast = panda.neutral(), panda.prepare(FRAME)
    fast.jacobian(q)
    compute, task = make_single_evaluator(
        "jacobian", panda.plan([panda.tree.frame_link(FRAME)]), fast.reference
    )
    for arguments in ((), (q,), (q, None, None), (q, q, None), (None, None), (q, q), (None, q)):
        assert compute(*arguments) is None
    assert task[KernelArgs.COUNT] == 0
    assert compute(q, None) is not None
    assert task[KernelArgs.COUNT] == 1


def test_the_memory_layout_of_arrays_is_known() -> None:
    assert array_layout_is_known()


@pytest.mark.parametrize("method", METHODS)
def test_reference_counts_do_not_change(panda: Robot, method: str) -> None:
    inputs = [x[0] for x in state(panda, 1, 7)][: METHODS[method]]
    fast = getattr(panda.prepare(FRAME), method)
    out, wrong = fast(*inputs), np.zeros(5)
    things = (*inputs, out, wrong)
    before = [sys.getrefcount(thing) for thing in things]
    for _ in range(100):
        fast(*inputs, out=out)
        assert sys.getrefcount(fast(*inputs)) == sys.getrefcount(np.empty(3))
        with pytest.raises(InputError):
            fast(*inputs, out=wrong)
    assert [sys.getrefcount(thing) for thing in things] == before


def test_while_the_function_is_busy_the_robot_computes_the_same_result(panda: Robot) -> None:
    q, fast = panda.sample(1, 8)[0], panda.prepare(FRAME)
    expected = fast.jacobian(q)
    task = fast._jacobian.__self__[0]  # type: ignore[attr-defined]
    task[KernelArgs.BUSY] = 1
    try:
        assert fast._jacobian(q, None) is None
        assert not differing(fast.jacobian(q), expected)
    finally:
        task[KernelArgs.BUSY] = 0
    again = fast._jacobian(q, None)
    assert again is not None
    assert not differing(again, expected)


def test_threads_that_share_a_prepared_frame_get_their_own_results() -> None:
    robot = urdfkin.load("panda", verify=False)
    fast, qs = robot.prepare(FRAME), robot.sample(4, 9)
    expected = robot.jacobian(qs, FRAME, threads=1)
    results = np.zeros((4, 200, 6, robot.nv))

    def work(k: int) -> None:
        for out in results[k]:
            fast.jacobian(qs[k], out=out)

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(work, range(4)))
    assert not differing(results, np.repeat(expected[:, np.newaxis], 200, axis=1))
    assert robot.certificate().lines[0].unchecked == 4 + 800


@pytest.mark.slow
def test_threads_without_the_interpreter_lock_get_correct_results_or_none() -> None:
    robot = urdfkin.load("panda", verify=False)
    fast, qs = robot.prepare(FRAME), robot.sample(2, 10)
    expected = robot.jacobian(qs, FRAME, threads=1)
    fast.jacobian(qs[0])
    bound = fast._jacobian.__self__  # type: ignore[attr-defined]
    word, calls, begun = ctypes.c_int64, 20_000, threading.Barrier(2)
    compute = ctypes.CFUNCTYPE(word, word, word, word)(one_configuration.address)

    @numba.njit(nogil=True)
    def ask(bound: int, arguments: int, to: int, out: FloatArray, right: FloatArray) -> tuple[int, int]:
        done = wrong = 0
        for _ in range(calls):
            if compute(bound, arguments, 2) == to:
                done += 1
                wrong += not (out == right).all()
                out[:] = 0.0
        return done, wrong

    def work(k: int) -> tuple[int, int]:
        q, out = qs[k], np.empty((6, robot.nv))
        arguments = (word * 2)(id(q), id(out))
        begun.wait()
        done, wrong = ask(id(bound), ctypes.addressof(arguments), id(out), out, expected[k])
        return done, wrong

    begun_with = int(bound[0][KernelArgs.COUNT])
    ask.compile("UniTuple(int64, 2)(int64, int64, int64, float64[:, ::1], float64[:, ::1])")
    with ThreadPoolExecutor(2) as pool:
        (first, wrong), (second, also_wrong) = pool.map(work, range(2))
    assert (wrong, also_wrong) == (0, 0)
    assert bound[0][KernelArgs.COUNT] - begun_with == first + second
    assert max(first, second) > 0  # A thread may find the function busy at each call.
