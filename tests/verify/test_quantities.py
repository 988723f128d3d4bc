"""A row of the table of quantities is computed, checked, validated, displayed and replayed."""

import inspect
import json
import shlex
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import urdfkin
from scripts.check_bits import MODES
from tests.cli.running import urdfkin as command
from urdfkin.compiled import evaluate
from urdfkin.compiled.plan import CompiledTree
from urdfkin.compiled.preload import use_only
from urdfkin.errors import InputError, UnknownNameError
from urdfkin.kinematics.registry import equations
from urdfkin.model.configuration import draw_base_motion, draw_samples, zero_and_limit_configurations
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray
from urdfkin.report.html import as_html
from urdfkin.report.markdown import as_markdown
from urdfkin.robot import Robot
from urdfkin.robot.frame_motion import frame_motion
from urdfkin.verify import bounds
from urdfkin.verify.bounds import Magnitudes
from urdfkin.verify.oracle import Oracle, QueryBatch, couple_columns
from urdfkin.verify.quantities import (
    QUANTITIES,
    VELOCITY,
    Quantity,
    quantities_by_command,
    recursive_quantities,
)

# -- a new row: the angular velocity -------------------------------------------------------------------


def turning(*x: Any, out: FloatArray | None = None, **how: Any) -> FloatArray:
    result = evaluate.velocities(*x, **how)[..., 3:]
    if out is None:
        return result
    out[...] = result
    return out


def pinocchios(oracle: Oracle, x: QueryBatch) -> FloatArray:
    return oracle.velocities(x)[..., 3:]


def size(plan: CompiledTree, magnitudes: Magnitudes, reference: Reference) -> FloatArray:
    return bounds.velocity_scale(plan, magnitudes, reference)[..., 3:]


TURNING = replace(
    VELOCITY, name="angular velocity", title="angular velocity", shape=(3,), compute=turning,
    ask_oracle=pinocchios,
    scale=size, heading="turns", labels=("wx", "wy", "wz"), units={"angular": "rad/s"},
    command="angular-velocity", summary="angular velocity of a frame",
    help_text="How fast it turns.",
    example="urdfkin angular-velocity ur5",
)  # fmt: skip


@pytest.fixture
def row(monkeypatch: pytest.MonkeyPatch) -> Quantity:
    monkeypatch.setitem(QUANTITIES, TURNING.name, TURNING)
    return TURNING


@pytest.mark.usefixtures("row")
def test_a_new_quantity_is_computed_checked_and_certified() -> None:
    robot = urdfkin.load("ur5")
    q = robot.sample(5)
    out = np.empty((5, 2, 3))
    found = robot.compute("angular velocity", (q, q), ["tool0", "wrist_1_link"], "local", out=out)
    assert found is out
    six = robot.velocity(q, q, ["tool0", "wrist_1_link"], "local", verify=False)
    np.testing.assert_array_equal(found, six[..., 3:])
    (line,) = (line for line in robot.certificate().lines if line.quantity == "angular velocity")
    assert (line.checked, line.unchecked) == (10, 0)
    assert 0.0 < line.bound_ratio < 1.0


def test_an_error_of_a_new_quantity_is_detected_with_a_command_that_repeats_the_computation(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    wrong = replace(TURNING, compute=lambda *x, **how: turning(*x, **how) * (1.0 + 1e-10))
    monkeypatch.setitem(QUANTITIES, wrong.name, wrong)
    robot = urdfkin.load("ur5")
    q = robot.sample(1)[0]
    with pytest.raises(urdfkin.VerificationError, match="the angular velocity of tool0") as caught:
        robot.compute("angular velocity", (q, q), "tool0")
    line = caught.value.reproduce
    assert line.startswith("urdfkin angular-velocity ur5 --frame tool0")
    assert command(*shlex.split(line)[1:]).code == 1


@pytest.mark.slow
@pytest.mark.usefixtures("row")
def test_a_new_quantity_is_validated_and_included_in_every_report() -> None:
    report = urdfkin.validate("ur5", samples=4)
    (robot,) = report.robots
    assert report.passed
    error_stats = robot.stats_of("angular velocity")
    assert len(error_stats) == 3
    assert all(
        stats.results == 7 * len(robot.frames) and 0.0 < stats.bound_ratio < 1.0 for stats in error_stats
    )
    replay = robot.replay(("angular velocity", "local"))
    assert replay is not None
    assert command(*shlex.split(replay)[1:]).code == 0
    document: Any = report.as_dict()
    named = [check["quantity"] for check in document["robots"][0]["checks"]]
    assert named.count("angular velocity") == 3
    assert "turns" in as_markdown(document)
    assert "angular velocity" in as_html(document)


@pytest.mark.usefixtures("row")
def test_a_new_quantity_has_a_command_with_help_and_every_output_format() -> None:
    assert "angular velocity of a frame" in command("--help").text
    text = " ".join(command("angular-velocity", "--help").text.split())
    assert "Angular velocity of a frame (eq. 7.127, 7.128). How fast it turns. ROBOT is" in text
    words = ["angular-velocity", "ur5", "--frame", "tool0", "--v", "1,0,0,0,0,0"]
    assert "angular [rad/s]" in command(*words).text
    document = json.loads(command(*words, "--format", "json").out)
    assert (document["quantity"], document["rows"]) == ("angular velocity", ["wx", "wy", "wz"])
    assert "a" not in document
    assert document["result"] == [[0.0, 0.0, 1.0]]
    assert command(*words, "--format", "csv").text.splitlines()[0] == "sample,wx,wy,wz"


@pytest.mark.usefixtures("row")
def test_a_new_quantity_is_checked_along_a_trajectory() -> None:
    robot = urdfkin.load("ur5")
    q = robot.sample(3)
    x = frame_motion(robot, (q, q, q), "tool0")
    assert x.agrees
    assert x.checks["angular velocity"].bound_ratio.shape == (3,)


# -- the table -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("row", QUANTITIES.values(), ids=lambda row: row.name)
def test_the_equations_of_each_quantity_exist_in_the_equation_table(row: Quantity) -> None:
    assert set(row.equations) <= set(equations())
    assert row.equations


@pytest.mark.parametrize("row", recursive_quantities(), ids=lambda row: row.name)
def test_a_robot_has_a_method_for_each_quantity_with_the_declared_inputs(row: Quantity) -> None:
    parameters = list(inspect.signature(getattr(Robot, row.method)).parameters)
    takes = [*row.inputs, "frame", *(["reference"] if row.has_reference else [])]
    assert parameters == ["self", *takes, "base", "out", "verify", "threads"]
    robot = urdfkin.load("polar")
    inputs = [robot.sample(2)] * len(row.inputs)
    found = robot.compute(row.name, inputs, "slider")
    np.testing.assert_array_equal(found, getattr(robot, row.method)(*inputs, "slider"))
    assert found.shape == (2, *row.result_shape(robot.nv))
    assert robot.certificate().verified


def test_the_quantities_with_a_command_are_those_listed_here() -> None:
    commands = "placement velocity jacobian jacobian-rate hessian acceleration"
    assert list(quantities_by_command()) == commands.split()


def test_an_unknown_quantity_or_wrong_inputs_are_refused() -> None:
    robot = urdfkin.load("polar")
    with pytest.raises(UnknownNameError, match="unknown quantity 'jacobain'; did you mean jacobian"):
        robot.compute("jacobain", ([0.0, 0.0],), "slider")
    with pytest.raises(InputError, match=r"the velocity takes \(q, v\)"):
        robot.compute("velocity", ([0.0, 0.0],), "slider")
    with pytest.raises(InputError, match="has a method of its own; call analytical_jacobian"):
        robot.compute("analytical jacobian", ([0.0, 0.0],), "slider")


# -- J_full G adds the columns of mimic joints to those of mimicked joints -----------------------------


@given(st.data())
def test_coupled_columns_are_the_product_with_g_to_the_last_bit(data: st.DataObject) -> None:
    nv, full = data.draw(st.integers(1, 5)), data.draw(st.integers(1, 8))
    index = np.array(data.draw(st.tuples(*[st.integers(0, nv - 1)] * full)), dtype=np.int64)
    factor = np.array(data.draw(st.tuples(*[st.floats(-2.0, 2.0)] * full)))
    columns = np.array(data.draw(st.permutations(range(full)))[: data.draw(st.integers(0, full))], np.int64)
    shape = data.draw(st.sampled_from([(), (1,), (3, 6), (2, 0, 6), (2, 3, 6)]))
    numbers = st.floats() | st.just(np.inf) | st.just(np.nan)
    pool = data.draw(st.lists(numbers, min_size=1, max_size=30))
    J = np.resize(np.array(pool), (*shape, full))
    expected = np.zeros((*shape, nv))
    with np.errstate(all="ignore"):
        for column in columns:
            expected[..., index[column]] += J[..., column] * factor[column]
    for way in MODES:
        with use_only(way):
            np.testing.assert_array_equal(couple_columns(J, columns, index, factor, nv), expected)


def test_coupled_columns_of_read_only_views_are_correct() -> None:
    J = np.arange(24.0).reshape(2, 3, 4).swapaxes(0, 1)
    J.setflags(write=False)
    places = np.array([0, 2], dtype=np.int64)
    found = couple_columns(J, places, np.array([0, 0, 1, 1]), np.array([1.0, 1.0, -2.0, 1.0]), 2)
    np.testing.assert_array_equal(found, J[..., [0, 2]] * [1.0, -2.0])


@pytest.mark.parametrize("rows", [0, 1])
def test_coupled_columns_of_a_robot_without_joint_velocities_are_empty(rows: int) -> None:
    nothing = np.zeros(0, dtype=np.int64)
    assert couple_columns(np.zeros((rows, 6, 0)), nothing, nothing, np.zeros(0), 0).shape == (rows, 6, 0)


# -- random samples of a validation --------------------------------------------------------------------


@pytest.mark.parametrize("with_zero_and_limits", [True, False])
def test_special_configurations_come_first_on_request(with_zero_and_limits: bool) -> None:
    robot = urdfkin.load("panda")
    drawn = draw_samples(robot.tree, 40, np.random.default_rng(0), with_zero_and_limits=with_zero_and_limits)
    extra = 3 if with_zero_and_limits else 0
    assert drawn.q.shape[0] == drawn.v.shape[0] == drawn.a.shape[0] == 40 + extra
    assert (drawn.q[:3] == zero_and_limit_configurations(robot.tree)).all() == with_zero_and_limits
    limits = [joint.limit for joint in robot.tree.joints if joint.nq == 1]
    assert zero_and_limit_configurations(robot.tree)[1].tolist() == [limit.lower for limit in limits if limit]
    assert zero_and_limit_configurations(robot.tree)[2].tolist() == [limit.upper for limit in limits if limit]


def test_every_eighth_sample_has_joint_velocities_a_hundred_times_as_large() -> None:
    drawn = draw_samples(
        urdfkin.load("panda").tree, 400, np.random.default_rng(0), with_zero_and_limits=False
    )
    demand_large_rates(drawn.v, drawn.a)


def demand_large_rates(*rates: FloatArray) -> None:
    for each in rates:
        sizes = np.sqrt((each**2).mean(axis=-1))
        assert 80.0 < sizes[::8].mean() < 120.0
        assert 0.8 < np.delete(sizes, np.s_[::8]).mean() < 1.2


def test_every_sample_has_a_different_placement_and_motion_of_the_base() -> None:
    base = draw_base_motion(400, np.random.default_rng(0))
    assert base.batch_shape == (400,)
    assert np.abs(base.placement[:, :3, 3]).max() <= 2.0
    assert np.unique(base.placement[:, :3, :3].round(6), axis=0).shape[0] == 400
    demand_large_rates(base.velocity, base.acceleration)


def test_more_configurations_than_fit_into_memory_are_refused_in_one_line() -> None:
    robot = urdfkin.load("ur5", verify=False)
    with pytest.raises(InputError) as caught:
        robot.sample(10**15)
    assert str(caught.value) == (
        "ur5: this number of configurations does not fit into memory: found n = 1000000000000000, which are "
        "48000000 GB; draw several smaller samples, each with another seed"
    )
    assert caught.value.__cause__ is None
