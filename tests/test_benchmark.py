"""The benchmark compares results before it times anything, and its figures are what it measured."""

import json
import os
import subprocess
import sys
import xml.dom.minidom
from pathlib import Path

import numpy as np
import pytest

import urdfkin
from scripts import benchmark
from scripts.benchmarking.bare import bare_urdf
from scripts.benchmarking.calls import Calls
from scripts.benchmarking.chains import TIP, chain_urdf
from scripts.benchmarking.clock import Table, measure
from scripts.benchmarking.contenders import CONTENDERS, find
from scripts.benchmarking.conventions import breadth_first, positions, spread
from scripts.benchmarking.subject import SUBJECTS, Subject
from scripts.benchmarking.tables import tables
from scripts.benchmarking.work import DifferenceError, Work, agree
from urdfkin.robot import Robot
from urdfkin.tree import FloatArray

ROOT = Path(__file__).parent.parent


@pytest.mark.slow
def test_the_quick_benchmark_finds_equal_results_and_writes_every_section(tmp_path: Path) -> None:
    file, picture = tmp_path / "figures.json", tmp_path / "figures.svg"
    command = [sys.executable, str(ROOT / "scripts/benchmark.py"), "--quick", "--json", str(file)]
    run = subprocess.run(
        [*command, "--plot", str(picture)],
        check=True,
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    figures = json.loads(file.read_text())
    assert {row["section"] for row in figures["rows"]} | {"memory"} == set(benchmark.SECTIONS)
    assert all(0 < row["minimum_ns"] <= row["median_ns"] for row in figures["rows"])
    batches = [row for row in figures["rows"] if row["section"] == "batch"]
    assert {(row["robot"], row["quantity"]) for row in batches} == {
        (robot, quantity) for robot in ("panda", "talos") for quantity in ("jacobian", "acceleration")
    }
    assert all(entry["peak_bytes"] >= 0.9 * entry["output_bytes"] for entry in figures["memory"])
    assert set(figures["libraries"]) == {contender.library for contender in find()}
    assert [words.title for words in tables(figures) if words.title not in run.stdout] == []
    assert len(picture.read_bytes()) < 60_000
    xml.dom.minidom.parse(str(picture))


def test_a_wrong_number_fails_the_run_and_names_who_has_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    right = Robot.jacobian

    def wrong(self: Robot, *arguments: object, **options: object) -> FloatArray:
        J = right(self, *arguments, **options)  # type: ignore[arg-type]
        return J + 1e-8

    monkeypatch.setattr(Robot, "jacobian", wrong)
    assert benchmark.main(["--quick", "--no-peers", "--only", "single"]) == 1
    message = capsys.readouterr().err
    assert "panda, single jacobian: urdfkin, robot.jacobian(verify=False)" in message
    assert "differ by 1e-08" in message


@pytest.mark.parametrize("theirs", [np.ones((3, 6)) + 2e-9, np.full((3, 6), np.nan), np.ones((3, 6, 1))])
def test_another_number_no_number_and_another_shape_are_differences(theirs: FloatArray) -> None:
    reference = Work("reference", 3, lambda: None, lambda: np.ones((3, 6)))
    agree([reference, Work("floor", 3, lambda: None)], reference, "ones")
    with pytest.raises(DifferenceError, match="ones: other"):
        agree([Work("other", 3, lambda: None, lambda: theirs)], reference, "ones")


def test_each_contender_computes_once_untimed_and_once_timed_in_each_round() -> None:
    counts = {"slow": 0, "fast": 0}

    def compute(who: str) -> None:
        counts[who] += 1
        sum(range(100_000 if who == "slow" else 100))

    works = [Work(who, 10, lambda who=who: compute(who)) for who in counts]  # type: ignore[misc]
    slow, fast = measure(Table("batch", "none", "sum", 1), works, 5, works[0])
    assert counts == {"slow": 10, "fast": 10}
    assert slow.ratio == 1.0
    assert fast.ratio is not None
    assert fast.ratio > 1.0
    assert fast.median_ns < slow.minimum_ns


def test_a_library_that_is_missing_is_listed_and_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(CONTENDERS, "jax_batch", "no_such_library")
    last = find()[-1]
    assert (last.library, last.state, last.module) == ("no_such_library", "not installed", None)
    assert {contender.library for contender in find(peers=False)} == {"urdfkin", "pin"}


@pytest.mark.parametrize(("name", "frame"), SUBJECTS)
def test_the_bare_urdf_is_the_same_robot(name: str, frame: str) -> None:
    whole = urdfkin.load(name, verify=False, mimic=False)
    bare = urdfkin.load(bare_urdf(whole.urdf), verify=False)
    assert bare.joint_names == whole.joint_names
    q = whole.sample(3, seed=1)
    np.testing.assert_array_equal(bare.placement(q, frame), whole.placement(q, frame))
    assert "mimic" not in bare_urdf(whole.urdf)
    assert "mesh" not in bare_urdf(whole.urdf)


@pytest.mark.parametrize("joints", [1, 12, 100])
def test_a_chain_has_its_joints_in_a_row_about_axes_of_all_directions(joints: int) -> None:
    robot = urdfkin.load(chain_urdf(joints), verify=False)
    assert robot.joint_names == tuple(f"joint{i:03}" for i in range(joints))
    assert len([i for i in robot.tree.path(robot.tree.frame_link(TIP)) if robot.tree.joints[i].nv]) == joints
    axes = np.array([joint.axis for joint in robot.tree.joints if joint.nv])
    np.testing.assert_allclose(np.linalg.norm(axes, axis=1), 1.0)
    assert joints == 1 or np.linalg.matrix_rank(axes) == 3


def test_a_loop_stores_what_single_calls_return_and_turns_the_order_round() -> None:
    with Subject(chain_urdf(3), TIP, 4) as subject:
        calls = Calls("sum", {"f": np.outer}, ("x = q + v", "f(a, x)[:, :1] * [[1.0]]"), order=[2, 0, 1])
        loop, order = calls.loop(), [2, 0, 1]
        out = np.empty((4, 3, 1))
        loop(out, *(x[:, order] for x in (subject.q, subject.v, subject.a)))
        np.testing.assert_array_equal(out[:, :, 0], subject.a[:, order] * (subject.q + subject.v)[:, [2]])
        single = calls.single(subject, "acceleration")
        assert single.result is not None
        np.testing.assert_array_equal(single.result(), out)
        assert single.n == 4
        single.compute()


def test_breadth_first_goes_link_after_link_in_the_files_order() -> None:
    joints = [("shoulder", "base", "upper"), ("wrist", "upper", "hand"), ("neck", "base", "head")]
    body = "".join(
        f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/></joint>'
        for name, parent, child in joints
    )
    assert breadth_first(f'<robot name="x">{body}</robot>') == ["shoulder", "neck", "wrist"]


def test_columns_come_to_their_places_by_name() -> None:
    assert positions(("a", "b", "c"), ("c", "a")) == [2, 0]
    full = spread(np.ones((1, 6, 2)) * [3.0, 5.0], [2, 0], 3)
    np.testing.assert_array_equal(full[0, 0], [5.0, 0.0, 3.0])
