"""Without Numba, Python numbers give a few configurations the same bits as the kernels."""

import math
import os
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import urdfkin
from scripts.check_bits import MODES, RobotInputs, find_interpreted_differences, have_equal_bits
from tests.cli.running import imported, process, python
from urdfkin.compiled import preload
from urdfkin.compiled.preload import use_only
from urdfkin.compiled.python_numbers import Number, fma, one, sine_cosine, zero
from urdfkin.errors import NotFiniteError, RangeError
from urdfkin.model.base_motion import BaseMotion
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.urdf.catalogue import catalogue

#: Modules that one result does not need.
HEAVY = {"numba", "llvmlite", "scipy", "trimesh", "networkx", "jsonschema", "mpmath", "yourdfpy", "jinja2"}

_FEW = ("panda", "ur5", "simple_humanoid", "planar_two_link")
NAMES = [pytest.param(name, marks=() if name in _FEW else pytest.mark.slow) for name in catalogue()]


def in_both_ways(compute: Callable[[], FloatArray]) -> list[FloatArray]:
    found = []
    for way in MODES:
        with use_only(way):
            found.append(compute())
    return found


@pytest.mark.parametrize("name", NAMES)
def test_every_quantity_of_every_robot_is_bitwise_equal_to_the_kernels_result(name: str) -> None:
    assert list(find_interpreted_differences(RobotInputs.load(name))) == []


@pytest.mark.parametrize("root_joint", [None, "floating", "planar"])
def test_results_with_a_moving_base_a_free_root_and_an_imu_are_bitwise_equal(root_joint: str | None) -> None:
    robot = urdfkin.load("ur5", root_joint=root_joint, verify=False)
    generator = np.random.default_rng(0)
    q, (v, a) = robot.sample(2, seed=1), generator.standard_normal((2, 2, robot.nv))
    base = BaseMotion(velocity=generator.standard_normal(6), acceleration=generator.standard_normal(6))
    for reference in ("local", "world", "local_world_aligned"):
        results = in_both_ways(lambda r=reference: robot.acceleration(q, v, a, "tool0", r, base=base))  # type: ignore[misc]
        assert have_equal_bits(*results)
    assert have_equal_bits(*in_both_ways(lambda: robot.imu(q, v, a, "tool0", base=base)))


def test_the_negative_of_one_is_minus_one() -> None:
    assert (-one()).x == -1.0
    assert -zero() is zero()


def test_the_sine_is_bitwise_equal_to_the_kernels_for_angles_of_every_size() -> None:
    robot = urdfkin.load("planar_two_link", verify=False)
    generator = np.random.default_rng(0)
    angles = generator.standard_normal((200, 2)) * 10.0 ** generator.uniform(-9.0, 9.0, (200, 2))
    angles[:20] = np.pi / 4 * np.arange(-20, 20).reshape(20, 2)
    assert have_equal_bits(*in_both_ways(lambda: robot.placement(angles, "tip")))


def test_the_sine_of_a_number_that_is_not_finite_is_nan() -> None:
    for x in (math.inf, -math.inf, math.nan):
        assert all(math.isnan(y.x) for y in sine_cosine(None, 0, Number(x)))


def test_a_fused_product_is_rounded_once_and_overflows_without_an_error() -> None:
    x = 1.0 + 2.0**-30
    assert fma(x, x, -1.0 - 2.0**-29) == 2.0**-60
    assert fma(1e300, 1e300, 0.0) == math.inf
    assert math.isnan(fma(math.inf, 0.0, 1.0))


def test_invalid_numbers_raise_the_same_errors_with_and_without_kernels() -> None:
    robot = urdfkin.load("planar_two_link", verify=False)
    for way in MODES:
        with use_only(way):
            with pytest.raises(urdfkin.InputError):
                robot.placement([math.nan, 0.0])
            with pytest.raises(RangeError):
                robot.velocity([0.0, 0.0], [1e308, 1e308])
    assert issubclass(NotFiniteError, urdfkin.InputError)


def test_a_certificate_does_not_depend_on_the_use_of_kernels() -> None:
    certificates = []
    for way in MODES:
        with use_only(way):
            robot = urdfkin.load("tiago")  # it has mimic joints
            robot.jacobian(robot.sample(3), robot.link_names[-3:])
            certificates.append(robot.certificate())
    assert certificates[0] == certificates[1]


def test_a_command_for_one_configuration_imports_no_compiler_and_no_library_for_meshes() -> None:
    own = str(Path(urdfkin.__file__).parents[1] / "robots" / "elbow.urdf")
    lines = [
        "jacobian OWN --q random", "placement OWN", "velocity OWN --q random --v random",
        "jacobian-rate OWN --q random --v random", "hessian OWN --q random",
        "acceleration OWN --q random --v random --a random", "imu OWN --q random --v random --a random",
        "analytical-jacobian OWN --q random", "singular-values OWN --q random", "info OWN", "chain OWN",
        "screws OWN", "dh OWN", "same OWN OWN", "jacobian OWN --format json", "jacobian tiago",
    ]  # fmt: skip
    assert imported([line.replace("OWN", own) for line in lines], HEAVY) == {}


def test_a_single_result_creates_no_cache(tmp_path: Path) -> None:
    done = process("jacobian", "elbow", XDG_CACHE_HOME=str(tmp_path / "none"))
    assert (done.code, "compil" in done.err) == (0, False)
    assert not (tmp_path / "none").exists()


# -- choice between kernels and Python -------------------------------------------------------------


@pytest.fixture
def unspent(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[str]]:
    loaded: list[str] = []
    for name in ("_seconds_spent", "_kernels", "_background"):
        monkeypatch.setattr(preload, name, {})

    def load(name: str, module: str) -> str:
        loaded.append(name)
        return name

    monkeypatch.setattr(preload, "load_kernel", load)
    yield loaded
    preload._kill_background()


def test_a_kernel_on_disk_is_loaded_after_enough_time_was_spent_without_the_kernel(
    unspent: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(preload, "_is_on_disk", lambda name: True)
    assert preload.get_kernel("jacobians") is None
    preload.add_time("jacobians", 0.9 * preload.LOAD_AFTER)
    assert preload.get_kernel("jacobians") is None
    assert preload.get_kernel("placements", expected_seconds=0.9 * preload.LOAD_AFTER) is None
    assert preload.get_kernel("jacobians", expected_seconds=0.2 * preload.LOAD_AFTER) == "jacobians"
    assert unspent == ["jacobians"]


def test_a_missing_kernel_is_compiled_in_the_background_and_a_large_batch_does_not_wait(
    unspent: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    begun: list[str] = []
    monkeypatch.setattr(preload, "_is_on_disk", lambda name: False)

    def begin(name: str, module: str) -> bool:
        begun.append(name)
        return True

    monkeypatch.setattr(preload, "_compile_in_background", begin)
    assert preload.get_kernel("jacobians", expected_seconds=0.9 * preload.COMPILE_AFTER) is None
    assert (begun, unspent) == (["jacobians"], [])
    assert preload.get_kernel("jacobians", expected_seconds=preload.COMPILE_AFTER) == "jacobians"


def test_without_a_kernel_cache_folder_no_compiling_process_starts(
    unspent: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(preload, "kernel_cache_folder", lambda: None)
    assert not preload._compile_in_background("jacobians", preload.KERNELS_MODULE)
    assert preload._background == {}


class Started:
    """A process that never ends by itself."""

    stdin = None

    def poll(self) -> int | None:
        return None

    def kill(self) -> None: ...

    def wait(self) -> None: ...


@pytest.mark.usefixtures("unspent")
def test_threads_that_need_a_missing_kernel_start_one_compiling_process(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    started: list[Started] = []

    def start(names: Sequence[str], module: str) -> Started:
        time.sleep(0.05)  # The other threads arrive while the process starts.
        started.append(Started())
        return started[-1]

    monkeypatch.setattr(preload, "kernel_cache_folder", lambda: tmp_path)
    monkeypatch.setattr(preload, "_start_compiler", start)
    together = threading.Barrier(4)

    def ask(_: int) -> bool:
        together.wait()
        return preload._compile_in_background("jacobians", preload.KERNELS_MODULE)

    with ThreadPoolExecutor(4) as pool:
        assert all(pool.map(ask, range(4)))
    assert list[object](preload._background.values()) == started


def without_cache(folder: Path) -> dict[str, str]:
    return os.environ | {"XDG_CACHE_HOME": str(folder), "NUMBA_CACHE_DIR": ""}


_LONG = """
import time, urdfkin
from urdfkin.compiled import preload
preload.LOAD_AFTER = preload.BACKGROUND_AFTER = 0.0
robot = urdfkin.load("one_link", verify=False)
robot.placement([0.0])
process, = preload._background.values()
print(process.pid, process.poll(), flush=True)
"""


@pytest.mark.slow
@pytest.mark.parametrize("end", ["", "import os; os._exit(0)", "import os, signal; os.kill(os.getpid(), 9)"])
def test_the_compiling_process_ends_with_the_parent_process(end: str, tmp_path: Path) -> None:
    done = python(_LONG + end, check=False, env=without_cache(tmp_path))
    pid, state = done.stdout.split()
    assert (state, done.stderr) == ("None", "")
    assert _ends(int(pid))


def _ends(pid: int) -> bool:
    for _ in range(100):
        try:
            if Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z":
                return True
        except FileNotFoundError:
            return True
        time.sleep(0.05)
    return False


@pytest.mark.long
def test_a_kernel_compiled_in_the_background_is_used_when_it_is_ready(tmp_path: Path) -> None:
    code = """
import time
from urdfkin.compiled import preload
import urdfkin
preload.LOAD_AFTER, preload.COMPILE_AFTER = 0.05, 1e9
robot = urdfkin.load("one_link", verify=False)
begin, before = time.perf_counter(), robot.placement([0.5])
while "placements" not in preload._kernels and time.perf_counter() < begin + 120.0:
    assert (robot.placement([0.5]) == before).all()
print("placements" in preload._kernels)
"""
    done = python(code, env=without_cache(tmp_path))
    assert (done.stdout, done.stderr) == ("True\n", "")


@pytest.mark.slow
def test_after_many_single_calls_the_function_for_single_calls_is_used() -> None:
    robot: Robot = urdfkin.load("panda", verify=False)
    q, begin = robot.neutral(), time.perf_counter()
    fast: Any = robot._prepare("panda_hand", Reference.LOCAL_WORLD_ALIGNED)
    before = robot.jacobian(q, "panda_hand")
    fast.always_load = False
    while hasattr(fast._jacobian, "func") and time.perf_counter() < begin + 120.0:
        assert (robot.jacobian(q, "panda_hand") == before).all()
    assert not hasattr(fast._jacobian, "func")
