"""Compilation, memory access, and sine and cosine of the kernels."""

import ctypes
import gc
import mmap
import pickle
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

import mpmath
import numpy as np
import pytest

import urdfkin
from tests.laws.subjects import robot_of, state
from urdfkin.compiled import evaluate
from urdfkin.compiled.plan import LANES, CompiledTree, compile_program, compile_tree
from urdfkin.compiled.preload import use_only
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.system.processes import python_command

_TRIED = """
import numba.np.linalg, numpy as np, urdfkin
urdfkin.load("one_link", verify=False).prepare("tip").placement(np.zeros(1))
print("scipy.linalg" in sys.modules)
numba.np.linalg.ensure_blas()
print("scipy.linalg" in sys.modules)
"""


@pytest.mark.long
def test_scipy_is_imported_only_for_compiled_code_that_calls_blas() -> None:
    # Compiling imports more modules, so the list is stored here.
    urdfkin.load("one_link", verify=False).prepare("tip").placement(np.zeros(1))
    done = subprocess.run(python_command(_TRIED), check=True, capture_output=True, text=True)
    assert done.stdout == "False\nTrue\n"


# Kernels use memory addresses; they must not read or write outside their arrays.


#: A number that no forward recursion computes.
GUARD = -1.2345678901234567e308
#: Number of doubles before and after an array; a kernel writes fewer for one configuration.
ZONE = 4096
COUNTS = (0, 1, LANES - 1, LANES, LANES + 1, 2 * LANES + 1)


def guarded(shape: tuple[int, ...], filled: float | FloatArray = GUARD) -> tuple[FloatArray, FloatArray]:
    """Return an array of this shape in the middle of a larger array, and the larger array."""
    size = int(np.prod(shape))
    memory = np.full(size + 2 * ZONE + 1, GUARD)
    inside = memory[ZONE + 1 : ZONE + 1 + size].reshape(shape)  # at an odd address
    inside[...] = filled
    return inside, memory


def kept(memory: FloatArray) -> bool:
    return bool((memory[: ZONE + 1] == GUARD).all() and (memory[-ZONE:] == GUARD).all())


def outputs(robot: Robot) -> Iterator[tuple[str, tuple[int, ...], tuple[str, ...]]]:
    yield "placement", (4, 4), ()
    for reference in ("local", "world", "local_world_aligned"):
        yield "velocity", (6,), (reference,)
        yield "jacobian", (6, robot.nv), (reference,)
        yield "hessian", (6, robot.nv, robot.nv), (reference,)
        yield "acceleration", (6,), (reference,)


@pytest.mark.slow
@pytest.mark.parametrize("n", COUNTS)
@pytest.mark.parametrize("name", ["panda", "planar_and_floating_in_the_middle", "mimic_hand_40_sliding"])
def test_a_batch_is_written_completely_and_not_beyond_the_output(name: str, n: int) -> None:
    robot = robot_of(name)
    q, v, a = (guarded(x.shape, x)[0] for x in state(robot, n, 1))
    for method, own, reference in [*outputs(robot), ("jacobian_rate", (6, robot.nv), ("world",))]:
        inputs = {"velocity": (q, v), "jacobian_rate": (q, v), "acceleration": (q, v, a)}.get(method, (q,))
        out, memory = guarded((n, *own))
        assert getattr(robot, method)(*inputs, robot.tip_frame, *reference, out=out) is out
        assert kept(memory), method
        assert not (out == GUARD).any(), method


@pytest.mark.parametrize("name", ["panda", "tree_8", "mimic_hand_40_sliding"])
def test_a_single_result_is_written_completely_and_not_beyond_the_output(name: str) -> None:
    robot = robot_of(name)
    q, v, a = (guarded(x.shape[1:], x[0])[0] for x in state(robot, 1, 2))
    for method, own, reference in outputs(robot):
        inputs = {"velocity": (q, v), "acceleration": (q, v, a)}.get(method, (q,))
        out, memory = guarded(own)
        assert getattr(robot.prepare(robot.tip_frame, *reference), method)(*inputs, out=out) is out
        assert kept(memory), method
        assert not (out == GUARD).any(), method


@pytest.mark.parametrize("n", COUNTS)
def test_all_frames_are_written_to_their_last_number_and_no_further_by_any_thread(n: int) -> None:
    robot = robot_of("tree_8")
    q, v, a = state(robot, n, 3)
    plan = robot.plan(range(len(robot.link_names)))
    for threads in (1, 3):
        out, memory = guarded((n, len(plan.frames), 6, plan.nv))
        evaluate.jacobians(plan, q, out=out, threads=threads)
        assert kept(memory)
        assert not (out == GUARD).any()
        six, memory = guarded((n, len(plan.frames), 6))
        evaluate.accelerations(plan, q, v, a, Reference.LOCAL, out=six, threads=threads)
        assert kept(memory)
        assert not (six == GUARD).any()


@contextmanager
def before_closed_memory(x: FloatArray) -> Iterator[FloatArray]:
    """A copy of an array. Reading the byte after its last number is a segmentation fault."""
    whole = -(-max(x.nbytes, 1) // mmap.PAGESIZE) * mmap.PAGESIZE
    memory = mmap.mmap(-1, whole + mmap.PAGESIZE)
    numbers = np.frombuffer(memory)
    closed = ctypes.c_void_p(numbers.ctypes.data + whole)
    protect, size = ctypes.CDLL(None, use_errno=True).mprotect, ctypes.c_size_t(mmap.PAGESIZE)
    copy = numbers[whole // 8 - x.size : whole // 8].reshape(x.shape)
    copy[...] = x
    assert protect(closed, size, 0) == 0
    try:
        yield copy
    finally:
        assert protect(closed, size, mmap.PROT_READ | mmap.PROT_WRITE) == 0


@pytest.mark.skipif(sys.platform != "linux", reason="mprotect of the C library")
@pytest.mark.parametrize("name", ["planar_two_link", "ur5", "panda", "talos"])
def test_a_batch_is_not_read_beyond_the_inputs(name: str) -> None:
    robot = urdfkin.load(name, verify=False)
    frame = robot.link_frames[-1]
    for n in (1, LANES - 1, LANES, LANES + 1, 2 * LANES, 3 * LANES + 5):
        inputs = state(robot, n, 5)
        expected = robot.acceleration(inputs[0], inputs[1], inputs[2], frame, verify=False)
        with ExitStack() as stack, use_only("compiled"):
            q, v, a = (stack.enter_context(before_closed_memory(x)) for x in inputs)
            found = robot.acceleration(q, v, a, frame, verify=False)
            assert found.tobytes() == expected.tobytes()
            del q, v, a


@pytest.mark.slow
def test_an_unpickled_plan_has_its_own_addresses() -> None:
    robot = urdfkin.load("a1", verify=False)
    links = [robot.tree.frame_link(frame) for frame in ("FR_foot", "RL_hip", "trunk")]
    q, v, a = state(robot, 21, 4)
    plan = compile_tree(robot.tree, links)
    expected = [evaluate.jacobians(plan, q), evaluate.accelerations(plan, q, v, a)]
    program = compile_program(plan, orientations=False)
    text = pickle.dumps(plan)
    again: CompiledTree = pickle.loads(text)
    anew = compile_program(again, orientations=False)
    assert not set(program.addresses) & set(anew.addresses)
    assert anew.words.tolist() == program.words.tolist()
    assert anew.constants.tolist() == program.constants.tolist()
    del plan, program
    gc.collect()
    rubbish = [np.full(256, -1) for _ in range(200)]  # in the memory that the first plan has used
    found = [evaluate.jacobians(again, q), evaluate.accelerations(again, q, v, a)]
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_array_equal(one, other)
    assert len(rubbish) == 200
    assert not any(x.flags.writeable for x in (again.steps, again.geometry, again.target_columns))


# -- sine and cosine, compared at fifty digits -----------------------------------------------------


ONE_JOINT = """<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="continuous">
  <parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint></robot>"""


def sine_and_cosine(angles: FloatArray) -> FloatArray:
    places = urdfkin.load(ONE_JOINT).placement(angles[:, None], "b", verify=False)
    return np.stack([places[:, 1, 0], places[:, 0, 0]], axis=1)


def units_off(angles: FloatArray) -> FloatArray:
    number = np.vectorize(lambda x: mpmath.mpf(float(x)), otypes=[object])
    with mpmath.workdps(60):
        true = np.array([[f(x) for f in (mpmath.sin, mpmath.cos)] for x in number(angles)])
        off: FloatArray = (number(sine_and_cosine(angles)) - true).astype(np.float64)
    return off / np.spacing(np.abs(true.astype(np.float64)))


@pytest.mark.slow
@pytest.mark.parametrize("largest", [1e-3, 0.8, 4.0, 100.0, 1.6e6, 1e9])
def test_sine_and_cosine_are_accurate_to_two_thirds_of_a_unit_in_the_last_place(largest: float) -> None:
    angles = np.random.default_rng(0).uniform(-largest, largest, 3000)
    assert np.abs(units_off(angles)).max() < 2.0 / 3.0


@pytest.mark.slow
def test_the_typical_error_of_sine_and_cosine_is_that_of_rounding() -> None:
    off = units_off(np.random.default_rng(1).uniform(-np.pi, np.pi, 5000))
    assert np.sqrt(np.square(off).mean(axis=0)).max() < 1.02 / np.sqrt(12.0)


def test_near_a_multiple_of_a_right_angle_the_smaller_of_sine_and_cosine_is_correct_to_1e_27() -> None:
    turns = np.arange(-200, 201) * (np.pi / 2.0)
    angles = np.concatenate([np.nextafter(turns, -np.inf), turns, np.nextafter(turns, np.inf)])
    off = np.abs(units_off(angles))
    assert (off * np.spacing(np.abs(sine_and_cosine(angles))))[off > 2.0 / 3.0].max() < 1e-27
