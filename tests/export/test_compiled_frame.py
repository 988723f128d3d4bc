"""A compiled frame has the results of `Robot` within the bound, its errors, and its record of checks."""

import itertools
import pickle
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import urdfkin
from tests.laws.subjects import state
from tests.robots.odd_urdfs import urdf_of
from urdfkin.errors import InputError, RangeError, UnknownNameError
from urdfkin.export import c, compiled_frame
from urdfkin.export.code import exportable_quantities
from urdfkin.export.compiled_frame import NoCompilerError, load_library
from urdfkin.model.tree import freeze
from urdfkin.robot import Robot
from urdfkin.verify.certificate import VerificationError
from urdfkin.verify.quantities import find_quantity

needs_compiler = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")


@pytest.mark.slow
@needs_compiler
@pytest.mark.filterwarnings("ignore::urdfkin.urdf.findings.UrdfWarning")
@pytest.mark.parametrize("name", ["panda", "planar_and_floating_in_the_middle"])
def test_compiled_results_agree_with_pinocchio_and_are_equal_in_single_calls_and_batches(name: str) -> None:
    robot = urdfkin.load("panda" if name == "panda" else urdf_of(name))
    fast = robot.compile(robot.tip_frame, "local_world_aligned")
    inputs = state(robot, 37, 5)
    asked = (
        exportable_quantities()
        if name == "panda"
        else [find_quantity("jacobian"), find_quantity("acceleration")]
    )
    for row in asked:
        given = inputs[: len(row.inputs)]
        found = getattr(fast, row.method)(*given)
        by_two = getattr(fast, row.method)(*given, threads=2)
        one_by_one = np.array([getattr(fast, row.method)(*(x[k] for x in given)) for k in range(37)])
        assert found.tobytes() == by_two.tobytes() == one_by_one.tobytes()
    certificate = robot.certificate()
    checked = [line for line in certificate.lines if line.checked]
    assert len(checked) == len(asked)
    assert all(line.checked == 103 and line.bound_ratio < 1.0 for line in checked)
    assert all(line.unchecked == 3 * 37 for line in certificate.lines)


@needs_compiler
def test_the_certificate_counts_only_the_returned_results_of_an_unverified_compiled_frame() -> None:
    robot = urdfkin.load("planar_two_link", verify=False)
    robot.compile("tip").placement(np.zeros((5, 2)))
    assert [(line.checked, line.unchecked) for line in robot.certificate().lines] == [(0, 5)]


@pytest.fixture(scope="module")
def arm() -> Robot:
    return urdfkin.load("planar_two_link", verify=False)


def test_a_compiled_frame_accepts_any_batch_shape_and_writes_into_out(arm: Robot) -> None:
    fast, frame = arm.compile(arm.tip_frame), arm.tip_frame
    q = np.linspace(-1.0, 1.0, 24).reshape(3, 4, 2)
    expected = arm.jacobian(q, frame)
    assert np.abs(fast.jacobian(q) - expected).max() < 1e-15
    assert np.abs(fast.jacobian(q.tolist()) - expected).max() < 1e-15
    out = np.empty((3, 4, 6, 2))
    assert fast.jacobian(q, out=out) is out
    assert np.abs(out - expected).max() < 1e-15
    one = np.empty((6, 2))
    assert fast.jacobian(q[1, 2].copy(), out=one) is one
    assert one.tobytes() == out[1, 2].tobytes()
    v = np.ones(2)
    assert np.abs(fast.velocity(q, v) - arm.velocity(q, v, frame)).max() < 1e-15
    assert fast.jacobian(np.empty((0, 2))).shape == (0, 6, 2)


def test_results_of_a_large_batch_equal_those_of_small_batches_at_any_alignment_of_out(arm: Robot) -> None:
    fast, n = arm.compile(arm.tip_frame), 30_000  # results of 2.9 MB
    q = arm.sample(n, seed=3)
    expected = np.concatenate([fast.jacobian(q[i : i + 1000]) for i in range(0, n, 1000)])
    for first in range(8):
        room = np.full(12 * n + 16, np.pi)
        fast.jacobian(q, out=room[first : first + 12 * n].reshape(n, 6, 2))
        assert room[first : first + 12 * n].tobytes() == expected.tobytes()
        assert (np.delete(room, slice(first, first + 12 * n)) == np.pi).all()


def test_a_very_large_angle_is_correct_and_leaves_the_other_lanes_unchanged(arm: Robot) -> None:
    fast, q = arm.compile(arm.tip_frame), np.tile([0.3, -0.4], (11, 1))
    before = fast.placement(q)
    q[5] = 1e9, -3e15
    after = fast.placement(q)
    assert np.delete(after, 5, axis=0).tobytes() == np.delete(before, 5, axis=0).tobytes()
    assert np.abs(after[5] - arm.placement(q[5], arm.tip_frame)).max() < 1e-15


def test_a_compiled_frame_refuses_values_that_are_not_finite_and_wrong_shapes(arm: Robot) -> None:
    fast = arm.compile(arm.tip_frame)
    for bad in ([np.nan, 0.0], np.full((20, 2), np.inf)):
        with pytest.raises(InputError, match="finite"):
            fast.jacobian(np.array(bad))
    inputs = np.zeros((3, 20, 2))
    for place in np.ndindex(inputs.shape):
        inputs[place] = (np.nan, np.inf, -np.inf)[sum(place) % 3]
        with pytest.raises(InputError, match="finite"):
            fast.acceleration(*inputs)
        inputs[place] = 0.0
    with pytest.raises(InputError, match="needs 2 numbers"):
        fast.jacobian(np.zeros(3))
    with pytest.raises(InputError, match="out must be"):
        fast.jacobian(np.zeros(2), out=np.empty(3))
    with pytest.raises(UnknownNameError):
        arm.compile("nowhere")


@needs_compiler
@pytest.mark.parametrize("n", [1, 3, 40])
def test_a_compiled_frame_refuses_large_velocities_with_a_result_outside_the_range(
    arm: Robot, n: int
) -> None:
    fast, q, v, a = arm.compile(arm.tip_frame), *np.zeros((3, n, 2))
    out = np.empty((n, 6))
    for k in (0, n - 1):
        v[k] = 1e200
        with pytest.raises(RangeError, match="leaves the range of double precision"):
            fast.acceleration(q, v, a, out=out)
        with pytest.raises(RangeError, match="leaves the range of double precision"):
            fast.acceleration(q[k], v[k], a[k])
        assert np.isfinite(fast.velocity(q, v)).all()  # These results are inside the range.
        v[k] = 0.0


def test_arrays_with_and_without_conversion_give_equal_results_and_errors() -> None:
    robot = urdfkin.load("ur5", verify=False)
    fast, n = robot.compile("tool0"), 37
    q, v, a = robot.sample(n, seed=1), *np.random.default_rng(1).standard_normal((2, n, 6))
    expected, out = fast.acceleration(q.tolist(), v.tolist(), a.tolist()), np.empty((n, 6))
    before = robot.certificate().lines[0].unchecked
    ways = (q, v, a), (np.asfortranarray(q), v[:], a), (q, v, a.astype(">f8")), (q.tolist(), v, a)
    for (one, two, three), threads in itertools.product(ways, (None, 1, 2)):
        out[:] = np.nan
        assert fast.acceleration(one, two, three, out=out, threads=threads) is out
        assert out.tobytes() == expected.tobytes()
    assert robot.certificate().lines[0].unchecked == before + 12 * n
    with pytest.warns(urdfkin.DegreesWarning):
        fast.acceleration(np.full((n, 6), 90.0), v, a, out=out)
    shared = np.zeros((2 * n, 6))
    for bad, to, words in (
        ((q, v, a), np.empty((n, 5)), "out must be"),
        ((q, v, a), np.empty((6, n)).T, "out must be"),
        ((q, v, a), freeze(np.zeros((n, 6))), "out must be"),
        ((shared[:n], v, a), shared[1 : n + 1], "share memory"),
        ((q[:, :5], v, a), out, "needs 6 numbers"),
        ((q[:5], v, a), out, "broadcast"),
    ):
        with pytest.raises(InputError, match=words):
            fast.acceleration(*bad, out=to)
    for x in (q, v, a):
        x[n - 1, 5], kept = np.nan, x[n - 1, 5]
        with pytest.raises(InputError, match="finite"):
            fast.acceleration(q, v, a, out=out)
        x[n - 1, 5] = kept
    with pytest.raises(InputError, match="threads"):
        fast.acceleration(q, v, a, out=out, threads=0)


def test_nan_is_refused_at_every_place_of_rows_that_do_not_fill_the_registers() -> None:
    free = urdfkin.load("panda", mimic=False)
    fast, inputs = free.compile(free.tip_frame), np.zeros((3, 20, 9))
    fast.acceleration(*inputs)
    for place in np.ndindex(inputs.shape):
        inputs[place] = np.nan
        with pytest.raises(InputError, match="finite"):
            fast.acceleration(*inputs)
        inputs[place] = 0.0


def test_a_compiled_frame_is_cached_and_an_unpickled_copy_gives_equal_results(arm: Robot) -> None:
    fast = arm.compile(arm.tip_frame)
    assert arm.compile(arm.tip_frame) is fast
    assert arm.compile(arm.tip_frame, "local") is not fast
    copy = pickle.loads(pickle.dumps(fast))
    assert copy.jacobian(np.zeros(2)).tobytes() == fast.jacobian(np.zeros(2)).tobytes()


def test_without_a_compiler_a_compiled_frame_returns_the_results_of_the_robot(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def none(code: object) -> object:
        raise NoCompilerError("cc is not installed")

    monkeypatch.setattr(compiled_frame, "load_library", none)
    robot = urdfkin.load("planar_two_link", verify=False)
    fast, q = robot.compile(robot.tip_frame), np.array([0.3, -0.4])
    assert fast.jacobian(q).tobytes() == robot.jacobian(q, robot.tip_frame).tobytes()
    assert fast.jacobian(np.tile(q, (3, 1)))[2].tobytes() == fast.jacobian(q).tobytes()


@pytest.mark.slow
@needs_compiler
def test_machine_code_with_wrong_results_is_refused(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def wrong(code: Any) -> object:
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
        format_literal = c.format_literal
        monkeypatch.setattr(c, "format_literal", lambda x: format_literal(x * (1.0 + 1e-12)))
        return load_library(code)

    monkeypatch.setattr(compiled_frame, "load_library", wrong)
    robot = urdfkin.load("planar_two_link")
    with pytest.raises(VerificationError, match="jacobian"):
        robot.compile(robot.tip_frame).jacobian([0.3, -0.4])
