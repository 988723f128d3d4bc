"""An error of one robot is the result of this robot only, and every robot has a result."""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import pytest

from tests.validation import faulty_worker
from urdfkin.errors import UrdfkinError
from urdfkin.validation import answer, engines, worker_processes
from urdfkin.validation.campaign import validate
from urdfkin.validation.chunk import Chunk, Chunking, ChunkResult, run_chunk
from urdfkin.validation.document import ValidationVerdict, outcome
from urdfkin.validation.engines import ExecutorEngine, SerialEngine, Task
from urdfkin.validation.results import ValidationReport
from urdfkin.validation.robot_input import RobotInput, make_robot_input

ROBOTS = ["double_pendulum", "ur5", "planar_two_link"]
ROOT = Path(__file__).parents[2]
run = partial(subprocess.run, capture_output=True, text=True, check=False)


def chunks(robot: RobotInput, samples: int, seed: int) -> Iterator[Chunk]:
    cut = Chunking(samples)
    return (cut.make_chunk(robot, seed, index) for index in range(len(cut)))


def verdicts(report: ValidationReport) -> list[str]:
    return [str(robot.verdict) for robot in report.robots]


ENGINES: dict[str, Callable[[], Any]] = {
    "serial": dict,
    "executor": lambda: {"executor": ThreadPoolExecutor(2)},
    "jobs": lambda: {"jobs": 2},
    "isolate": lambda: {"jobs": 2, "isolate": True},
}
ERRORS = [*(("serial", error) for error in faulty_worker.ERRORS), ("executor", "memory"),
          *(("jobs", error) for error in ("unpicklable", "pinocchio")),
          *(("isolate", error) for error in ("unpicklable", "recursion"))]  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize(("engine", "error"), ERRORS)
def test_an_error_of_a_robot_is_its_result_and_the_other_robots_are_verified(
    engine: str, error: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(faulty_worker.FAULT, error)
    monkeypatch.setattr(worker_processes, "WORKER_MODULE", faulty_worker.MODULE)
    monkeypatch.setattr(answer, "run_chunk", faulty_worker.run_faulty)
    report = validate(ROBOTS, samples=60, **ENGINES[engine]())
    assert verdicts(report) == ["verified", "not verified", "verified"]
    robot = report.robots[1]
    assert str(robot.reason).startswith("unexpected error in urdfkin, please report it: ")
    assert faulty_worker.ERRORS[error][1] in str(robot.reason)
    assert "in run_faulty" in str(robot.error)
    assert report.as_dict()["robots"][1]["error"] == robot.error
    assert (report.passed, report.exit_code) == (False, 3)


class Refusing(Executor):
    """An executor that breaks after some chunks, when a result is read or when a chunk is submitted."""

    def __init__(self, chunks: int, *, when_asked: bool) -> None:
        self._left, self._when_asked = chunks, when_asked

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future = Future[Any]()
        self._left -= 1
        if self._left >= 0:
            future.set_result(fn(*args, **kwargs))
        elif self._when_asked:
            future.set_exception(BrokenExecutor("a worker died"))
        else:
            raise BrokenExecutor("a worker died")
        return future


@pytest.mark.parametrize("when_asked", [True, False])
def test_robots_after_the_breakdown_of_an_executor_are_not_verified(when_asked: bool) -> None:
    report = validate(ROBOTS, samples=30, executor=Refusing(2, when_asked=when_asked))
    assert verdicts(report) == ["verified", "not verified", "not verified"]
    for robot in report.robots[1:]:
        assert "BrokenExecutor: a worker died" in str(robot.reason)
    assert report.robots_requested == 3


@pytest.mark.long
def test_a_process_pool_can_run_the_chunks() -> None:
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        report = validate(["ur5", "no such robot"], samples=30, executor=pool)
    assert verdicts(report) == ["verified", "bad input"]


@pytest.mark.long
def test_an_executor_has_a_bounded_number_of_chunks_at_a_time_and_runs_all_chunks(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    submitted, most = 0, 0

    class Counted(Future[Any]):
        def result(self, timeout: float | None = None) -> Any:
            nonlocal submitted
            submitted -= 1
            return super().result(timeout)

    class Counting(Executor):
        def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
            nonlocal submitted, most
            submitted += 1
            most = max(most, submitted)
            future = Counted()
            future.set_result(fn(*args, **kwargs))
            return future

    monkeypatch.setattr(engines, "MAX_IN_FLIGHT", 3)
    report = validate(["planar_two_link", "double_pendulum"], samples=200, executor=Counting())
    assert report.passed
    assert (most, submitted) == (3, 0)
    assert {robot.samples for robot in report.robots} == {203}


@pytest.mark.parametrize("how", [{}, {"executor": ThreadPoolExecutor(1)}], ids=["serial", "executor"])
def test_the_remaining_chunks_of_a_failed_robot_are_not_run(
    how: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(engines, "MAX_IN_FLIGHT", 1)
    ran: list[int] = []

    def failing(chunk: Chunk) -> ChunkResult:
        ran.append(chunk.index)
        if chunk.index == 1:
            raise UrdfkinError("no")
        return run_chunk(chunk)

    monkeypatch.setattr(answer, "run_chunk", failing)
    robot = validate("planar_two_link", samples=100, **how).robots[0]
    assert ran == [0, 1]
    assert (robot.verdict, robot.reason, robot.samples) == (ValidationVerdict.BAD_INPUT, "no", 28)


def test_a_disagreement_takes_precedence_over_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(chunk: Chunk) -> ChunkResult:
        if chunk.index == 1:
            raise MemoryError
        result = run_chunk(chunk)
        return replace(result, error_stats={k: replace(t, failed=1) for k, t in result.error_stats.items()})

    monkeypatch.setattr(answer, "run_chunk", failing)
    report = validate("planar_two_link", samples=50)
    robot = report.robots[0]
    assert robot.verdict is ValidationVerdict.DISAGREES
    assert str(robot.reason).startswith("20 of ")
    assert "results lie outside their bound; unexpected error" in str(robot.reason)
    assert "MemoryError: no message" in str(robot.reason)
    assert report.exit_code == 1


def test_an_error_of_the_engine_is_the_result_of_each_unfinished_robot(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    right = SerialEngine.run

    def breaks(self: SerialEngine, work: engines.Work, enter: engines.AnswerCallback) -> None:
        right(self, list(work)[:1], enter)
        raise OSError("no more of anything")

    monkeypatch.setattr(SerialEngine, "run", breaks)
    report = validate(ROBOTS, samples=1)
    assert verdicts(report) == ["verified", "not verified", "not verified"]
    assert "OSError: no more of anything" in str(report.robots[2].reason)
    assert "Traceback" in str(report.robots[2].error)


def test_a_run_with_missing_robots_or_without_robots_has_not_passed() -> None:
    whole = validate(["planar_two_link", "double_pendulum"], samples=0)
    assert whole.passed
    part = ValidationReport(whole.robots[:1], 2, 0, 0, whole.started, 1.0)
    for report, reason in (
        (part, "1 of 2 robots without a report"),
        (validate([]), "no robot was validated"),
    ):
        assert (report.passed, report.exit_code) == (False, 3)
        assert report.outcome.reason == report.as_dict()["reason"] == reason


def test_an_interrupted_run_has_not_passed_even_where_every_robot_is_verified() -> None:
    whole = validate(["planar_two_link"], samples=0)
    ended = replace(whole, interrupted=True)
    assert (whole.passed, whole.exit_code, whole.as_dict()["verdict"]) == (True, 0, "verified")
    assert (ended.passed, ended.exit_code, ended.as_dict()["verdict"]) == (False, 130, "interrupted")
    assert ended.robots[0].verdict == "verified"


@pytest.mark.parametrize(
    ("verdicts", "interrupted", "code"),
    [
        (["verified", "disagrees", "bad input", "not verified"], True, 1),
        (["verified", "bad input", "not verified"], True, 130),
        (["verified", "bad input", "not verified"], False, 2),
        (["verified", "not verified"], False, 3),
    ],
)
def test_exit_code_1_means_only_a_disagreement(verdicts: list[str], interrupted: bool, code: int) -> None:
    found = outcome(verdicts, robots_requested=len(verdicts), interrupted=interrupted)
    assert found.exit_code == code
    assert not found.passed


@pytest.mark.parametrize("engine", ["serial", "executor"])
def test_an_interrupt_keeps_finished_chunks_and_drops_waiting_chunks(
    engine: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    ran: list[tuple[str, int]] = []

    def interrupted(chunk: Chunk) -> ChunkResult:
        ran.append((chunk.robot_input.label, chunk.index))
        if ran[-1] == ("ur5", 1):
            raise KeyboardInterrupt
        return run_chunk(chunk)

    monkeypatch.setattr(engines, "MAX_IN_FLIGHT", 1)
    monkeypatch.setattr(answer, "run_chunk", interrupted)
    executor = None if engine == "serial" else Refusing(10**6, when_asked=True)
    report = validate(ROBOTS, samples=60, executor=executor)
    assert ran[-1] == ("ur5", 1)
    assert (report.interrupted, report.exit_code) == (True, 130)
    first, second, third = report.robots
    assert first.verdict is ValidationVerdict.VERIFIED
    assert (second.samples, second.results > 0) == (28, True)
    assert second.verdict is ValidationVerdict.NOT_VERIFIED
    assert second.reason == "interrupted: 28 of 63 samples were compared"
    assert (third.samples, third.results) == (0, 0)
    assert third.reason == "interrupted: 0 of 63 samples were compared"


def test_an_executors_waiting_chunks_are_cancelled_on_an_interrupt() -> None:
    made: list[Future[Any]] = []

    class Never(Executor):
        def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
            made.append(Future())
            if len(made) == 3:
                raise KeyboardInterrupt
            return made[-1]

    tasks = [Task(0, chunk) for chunk in chunks(make_robot_input("ur5"), 100, 0)]
    with pytest.raises(KeyboardInterrupt):
        ExecutorEngine(Never()).run([tasks], lambda *_: None)
    assert [future.cancelled() for future in made] == [True, True, False]


@pytest.mark.long
@pytest.mark.parametrize("descriptors", [6, 7, 8, 9, 12])
def test_with_too_few_file_descriptors_each_robot_is_reported(descriptors: int) -> None:
    arguments = "validate double_pendulum ur5 --isolate --jobs 2 --samples 2"
    done = run(["bash", "-c", f"ulimit -n {descriptors}; exec {sys.executable} -m urdfkin {arguments}"])
    verified = sum(line.endswith("verified") and "not" not in line for line in done.stdout.splitlines())
    assert (done.returncode == 0) == (verified == 2), done.stdout + done.stderr
    assert done.returncode in (0, 2, 3, 70)


@pytest.mark.long
def test_robots_are_checked_from_a_deleted_folder(tmp_path: Path) -> None:
    gone = tmp_path / "gone"
    gone.mkdir()
    command = f"exec {sys.executable} -m urdfkin validate ur5 --isolate --samples 2"
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    done = run(["sh", "-c", f"cd {gone} && rmdir {gone} && {command}"], env=env)
    assert done.returncode == 0, done.stderr
    assert "1 robot, " in done.stdout


@pytest.mark.long
@pytest.mark.parametrize("how", ["jobs=2", "isolate=True"])
def test_a_script_needs_no_main_guard_and_modules_of_the_current_folder_are_not_run(
    how: str, tmp_path: Path
) -> None:
    for planted in ("urdfkin", "multiprocessing", "json", "pickle", "queue"):
        (tmp_path / f"{planted}.py").write_text("print('planted')\nraise SystemExit(9)\n")
    script = tmp_path / "scripts" / "script.py"
    script.parent.mkdir()
    script.write_text(
        "print('once')\nfrom urdfkin.validation.campaign import validate\n"
        f"report = validate(['double_pendulum', 'planar_two_link'], samples=30, {how})\n"
        "print(report.passed, len(report.robots))\n"
    )
    done = run([sys.executable, str(script)], cwd=tmp_path)
    assert done.stdout.splitlines() == ["once", "True 2"], done.stderr
