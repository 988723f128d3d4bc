"""The benchmark compares results before it measures times, and prints the measured times."""

import json
import os
import shutil
import subprocess
import sys
import xml.dom.minidom
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import urdfkin
from scripts import benchmark
from scripts.benchmarking import generated, sections
from scripts.benchmarking.contenders import (
    ALWAYS,
    PEERS,
    Contender,
    breadth_first_joints,
    fill_columns,
    find_indices,
)
from scripts.benchmarking.machine import EMPTY, STORED, USES
from scripts.benchmarking.tables import make_tables
from scripts.benchmarking.timing import Calls, DifferenceError, Row, TimedTask, check_agreement, measure_rows
from scripts.benchmarking.workload import QUANTITIES, ROBOT_FRAMES, TIP, Workload, bare_urdf, chain_urdf
from tests.urdfs import joint, robot
from urdfkin.compiled.plan import StepField, compile_program
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot

ROOT = Path(__file__).parent.parent


@pytest.mark.long
def test_the_quick_benchmark_finds_equal_results_and_writes_every_section(tmp_path: Path) -> None:
    file, picture = tmp_path / "figures.json", tmp_path / "figures.svg"
    command = [sys.executable, str(ROOT / "scripts/benchmark.py"), "--quick", "--json", str(file)]
    run = subprocess.run(
        [*command, "--plot", str(picture)], check=True, cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True,
    )  # fmt: skip
    figures = json.loads(file.read_text())
    shown = {row["section"] for row in figures["rows"]} | {"memory", "where", "first"}
    assert shown == set(benchmark.SECTIONS)
    assert all(0 < row["minimum_ns"] <= row["median_ns"] for row in figures["rows"])
    batches = [row for row in figures["rows"] if row["section"] == "batch"]
    pairs = {(robot, quantity) for robot, _ in ROBOT_FRAMES for quantity in QUANTITIES}
    assert {(row["robot"], row["quantity"]) for row in batches} == pairs
    assert all(entry["peak_bytes"] >= 0.9 * entry["output_bytes"] for entry in figures["memory"])
    robots = {entry["kind"]: entry["robot"] for entry in figures["where"]}
    assert robots == {"batch": "talos", "single": "talos"}
    assert all(0 < entry[STORED] < entry[EMPTY] for entry in figures["first"])
    assert set(figures["libraries"]) == {contender.library for contender in (*ALWAYS, *PEERS)}
    assert [words.title for words in make_tables(figures) if words.title not in run.stdout] == []
    assert len(picture.read_bytes()) < 60_000
    xml.dom.minidom.parse(str(picture))


def test_a_wrong_number_fails_the_run_and_names_the_contender(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    right: Any = Robot.jacobian
    monkeypatch.setattr(Robot, "jacobian", lambda *asked, **how: right(*asked, **how) + 1e-8)
    assert benchmark.main(["--quick", "--no-peers", "--only", "single"]) == 1
    message = capsys.readouterr().err
    assert "panda, single jacobian: urdfkin, robot.jacobian(verify=False)" in message
    assert "differ by 1e-08" in message


@pytest.mark.parametrize("theirs", [np.ones((3, 6)) + 2e-9, np.full((3, 6), np.nan), np.ones((3, 6, 1))])
def test_a_different_number_nan_and_a_different_shape_are_differences(theirs: FloatArray) -> None:
    reference = TimedTask("reference", 3, lambda: None, lambda: np.ones((3, 6)))
    check_agreement([reference, TimedTask("floor", 3, lambda: None)], reference, "ones")
    with pytest.raises(DifferenceError, match="ones: other"):
        check_agreement([TimedTask("other", 3, lambda: None, lambda: theirs)], reference, "ones")


def test_each_contender_computes_once_untimed_and_once_timed_in_each_round() -> None:
    counts = {"slow": 0, "fast": 0}

    def compute(label: str) -> None:
        counts[label] += 1
        sum(range(100_000 if label == "slow" else 100))

    tasks = [TimedTask(label, 10, lambda label=label: compute(label)) for label in counts]  # type: ignore[misc]
    slow, fast = measure_rows(Row("batch", "none", "sum", 1), tasks, 5, tasks[0])
    assert counts == {"slow": 10, "fast": 10}
    assert slow.ratio == 1.0
    assert fast.ratio is not None
    assert fast.ratio > 1.0
    assert fast.median_ns < slow.minimum_ns


def test_a_missing_library_or_program_is_listed_and_not_measured() -> None:
    def never(workload: Workload, quantity: str) -> Iterator[TimedTask]:
        raise AssertionError

    for contender, state in (
        (Contender("none", "no_such_library", batches=never), "not installed"),
        (Contender("numpy", "numpy", batches=never, program="no-such-cc"), "left out, no no-such-cc"),
    ):
        assert contender.version == state
        with Workload(*ROBOT_FRAMES[0], 1) as workload:
            assert contender.make_tasks(workload, "jacobian") == []
            assert contender.make_single_calls(workload, "jacobian") == []


@pytest.mark.parametrize(("name", "frame"), [*ROBOT_FRAMES, ("polar", "slider")])
def test_the_equations_of_a_path_give_the_robots_jacobian_and_acceleration(name: str, frame: str) -> None:
    with Workload(name, frame, 1) as workload:
        q, v, a = workload.q[0], workload.v[0], workload.a[0]
        of_q, of_v = (workload.plan.steps[:, place] for place in (StepField.Q, StepField.V))
        x, rates = q[of_q].tolist(), (v[of_v].tolist(), a[of_v].tolist())
        numbers = [np.sin(x).tolist(), np.cos(x).tolist(), *rates]
        J = np.reshape(generated.frame_results(workload.plan, "jacobian", x, *numbers), (6, workload.nv))
        np.testing.assert_allclose(J, workload.robot.jacobian(q, frame), rtol=0, atol=1e-13)
        six = generated.frame_results(workload.plan, "acceleration", x, *numbers)
        acceleration = workload.robot.acceleration(q, v, a, frame)
        np.testing.assert_allclose(six, acceleration, rtol=0, atol=1e-11)


@pytest.mark.long
@pytest.mark.skipif(shutil.which(generated.COMPILER) is None, reason="no C compiler")
@pytest.mark.parametrize("quantity", QUANTITIES)
def test_generated_code_computes_the_robots_results_and_writes_only_the_output(quantity: str) -> None:
    pytest.importorskip("casadi")
    with Workload("polar", "slider", 17) as workload:
        compute = generated.compile_function(workload, quantity)
        for n in (1, 7, 8, 9, 17):
            inputs = workload.inputs(quantity, n)
            out = np.full((n + 1, *workload.result_shape(quantity)), 7.0)
            compute(n, *(x.ctypes.data for x in (*inputs, *inputs, *inputs)[:3]), out.ctypes.data)
            expected = getattr(workload.robot, quantity)(*inputs, workload.frame)
            np.testing.assert_allclose(out[:n], expected, rtol=0, atol=1e-13)
            assert (out[n] == 7.0).all()


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_a_batch_with_all_its_steps_gives_the_complete_result(quantity: str) -> None:
    with Workload(*ROBOT_FRAMES[0], 9) as workload:
        program = compile_program(workload.plan, orientations=False, columns=quantity == "jacobian")
        sizes = [sections.truncate_program(program, end) for end in range(1, len(sections.PARTS) + 1)]
        np.testing.assert_array_equal(sizes[-1].words, program.words)
        lengths = [len(part.words) for part in sizes]
        assert lengths == sorted(lengths)
        assert lengths[0] < lengths[-1]
        parts = {(x["robot"], x["quantity"]): x for x in sections.batch_step_times(100, 1)}
        entry = parts[workload.name, quantity]
        assert ("columns" in entry["parts"]) == (quantity == "jacobian")
        assert sum(entry["parts"].values()) == pytest.approx(entry["ns"], abs=0.05)


def test_each_measured_first_call_is_a_quantity_of_the_robot() -> None:
    robot = urdfkin.load("one_link", verify=False)
    for use, count in USES.items():
        inputs = [np.zeros(robot.nq)] * count
        if use.startswith("prepared."):
            prepared = robot.prepare("tip")
            assert getattr(prepared, use.removeprefix("prepared."))(*inputs).shape[0] == 6
        else:
            getattr(robot, use)(*inputs, "tip")


@pytest.mark.parametrize(("name", "frame"), ROBOT_FRAMES)
def test_the_bare_urdf_is_the_same_robot(name: str, frame: str) -> None:
    whole = urdfkin.load(name, verify=False, mimic=False)
    bare = urdfkin.load(bare_urdf(whole.urdf), verify=False)
    assert bare.joint_names == whole.joint_names
    q = whole.sample(3, seed=1)
    np.testing.assert_array_equal(bare.placement(q, frame), whole.placement(q, frame))
    assert "mimic" not in bare_urdf(whole.urdf)
    assert "mesh" not in bare_urdf(whole.urdf)


@pytest.mark.parametrize("joints", [1, 12, 100])
def test_a_chain_has_ordered_joints_with_oblique_axes(joints: int) -> None:
    robot = urdfkin.load(chain_urdf(joints), verify=False)
    assert robot.joint_names == tuple(f"joint{i:03}" for i in range(joints))
    assert len([i for i in robot.tree.path(robot.tree.frame_link(TIP)) if robot.tree.joints[i].nv]) == joints
    axes = np.array([joint.axis for joint in robot.tree.joints if joint.nv])
    np.testing.assert_allclose(np.linalg.norm(axes, axis=1), 1.0)
    assert joints == 1 or np.linalg.matrix_rank(axes) == 3


def test_a_loop_stores_the_results_of_single_calls_in_urdfkins_order() -> None:
    with Workload(chain_urdf(3), TIP, 4) as workload:
        calls = Calls("sum", {"f": np.outer}, ("x = q + v", "f(a, x)[:, :1] * [[1.0]]"), order=[2, 0, 1])
        loop, order = calls.make_loop(), [2, 0, 1]
        out = np.empty((4, 3, 1))
        loop(out, *(x[:, order] for x in (workload.q, workload.v, workload.a)))
        np.testing.assert_array_equal(out[:, :, 0], workload.a[:, order] * (workload.q + workload.v)[:, [2]])
        make_single_task = calls.make_single_task(workload, "acceleration")
        assert make_single_task.result is not None
        np.testing.assert_array_equal(make_single_task.result(), out)
        assert make_single_task.n == 4
        make_single_task.compute()


def test_breadth_first_visits_the_links_in_the_files_order() -> None:
    rows = ("shoulder", "base", "upper"), ("wrist", "upper", "hand"), ("neck", "base", "head")
    text = robot(*(joint(name, "revolute", *links) for name, *links in rows))
    assert breadth_first_joints(text) == ["shoulder", "neck", "wrist"]


def test_columns_are_placed_by_joint_name() -> None:
    assert find_indices(("a", "b", "c"), ("c", "a")) == [2, 0]
    full = fill_columns(np.ones((1, 6, 2)) * [3.0, 5.0], [2, 0], 3)
    np.testing.assert_array_equal(full[0, 0], [5.0, 0.0, 3.0])
