"""A process that dies costs its robot and nothing else, and every task is dealt once."""

import os
import pickle
import signal
import time
from collections.abc import Iterator
from multiprocessing.reduction import ForkingPickler
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.attacks.test_validation_signals import children
from tests.validation import canned_worker
from tests.validation.test_store import numbers
from urdfkin.urdf.sources import Origin
from urdfkin.validation import answer, engines, memory, worker_processes
from urdfkin.validation.answer import Answer
from urdfkin.validation.campaign import validate
from urdfkin.validation.chunk import Chunk, Cut
from urdfkin.validation.collector import CampaignProgress
from urdfkin.validation.engines import RobotTasks, Task, WorkQueue
from urdfkin.validation.outcome import ValidationVerdict
from urdfkin.validation.robot_input import RobotInput

ROBOTS = ["double_pendulum", "ur5", "iris_simple"]
DIED = "ur5: the process that validated the robot {}: found signal SIGSEGV"
HOW: list[dict[str, Any]] = [{"jobs": 2}, {"jobs": 2, "isolate": True}, {"isolate": True}]


@pytest.fixture
def deaths(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """Workers that die over a robot: as often as the file says."""
    monkeypatch.setattr(worker_processes, "WORKER", "tests.validation.deadly_worker")
    path = tmp_path / "deaths"
    monkeypatch.setenv("URDFKIN_TEST_DEATHS", str(path))
    return path


@pytest.mark.long
@pytest.mark.parametrize("how", HOW, ids=str)
def test_processes_change_no_number(how: dict[str, Any]) -> None:
    with_them = validate(["ur5", "double_pendulum"], samples=60, **how)
    without = validate(["ur5", "double_pendulum"], samples=60)
    assert with_them.passed
    assert numbers(with_them) == numbers(without)


@pytest.mark.long
@pytest.mark.parametrize("how", HOW)
def test_a_death_is_that_robots_result_and_the_others_go_on(how: dict[str, Any], deaths: Path) -> None:
    deaths.write_text("99")
    report = validate(ROBOTS, samples=60, **how)
    verdicts = [ValidationVerdict.VERIFIED, ValidationVerdict.NOT_VERIFIED, ValidationVerdict.VERIFIED]
    assert [robot.verdict for robot in report.robots] == verdicts
    twice = "crashed twice; the second process computed nothing else"
    assert report.robots[1].reason == DIED.format("crashed" if "isolate" in how else twice)
    assert not report.passed
    assert report.exit_code == 3


@pytest.mark.long
def test_a_robot_over_which_one_worker_died_is_tried_again_and_verified_in_full(deaths: Path) -> None:
    deaths.write_text("1")
    report = validate(ROBOTS, samples=60, jobs=2)
    assert report.passed
    assert deaths.read_text() == "0"
    assert numbers(report) == numbers(validate(ROBOTS, samples=60))


@pytest.mark.long
def test_what_cannot_be_read_is_reported_as_without_processes() -> None:
    robots = ["<robot/>", "no such robot"]
    plain = validate(robots, samples=60)
    assert {robot.verdict for robot in plain.robots} == {ValidationVerdict.BAD_INPUT}
    assert plain.exit_code == 2
    for how in HOW:
        assert numbers(validate(robots, samples=60, **how)) == numbers(plain)


@pytest.mark.long
def test_a_worker_that_notices_nothing_is_killed_with_its_crew(monkeypatch: pytest.MonkeyPatch) -> None:
    """A library's process lives on after an interrupt; what hangs in compiled code must not."""
    monkeypatch.setattr(worker_processes, "WORKER", "tests.validation.sleeping_worker")
    started: list[Any] = []
    right = worker_processes._start_interpreter

    def kept(pipe: int) -> Any:
        started.append(right(pipe))
        if len(started) == 2:
            raise KeyboardInterrupt
        return started[-1]

    monkeypatch.setattr(worker_processes, "_start_interpreter", kept)
    try:
        report = validate(["ur5", "panda"], samples=0, isolate=True, jobs=2)
        assert report.interrupted
        assert started[0].poll() == -9
    finally:
        for process in started:
            process.kill()
            process.wait()


def test_a_robot_for_which_no_process_can_be_started_is_not_verified(monkeypatch: pytest.MonkeyPatch) -> None:
    def none(_: int) -> None:
        raise OSError(24, "Too many open files")

    monkeypatch.setattr(worker_processes, "_start_interpreter", none)
    for how in HOW:
        report = validate(["ur5", "planar_two_link"], samples=60, **how)
        assert [robot.verdict for robot in report.robots] == [ValidationVerdict.NOT_VERIFIED] * 2
        reason = "no process could be started: OSError: [Errno 24] Too many open files"
        assert {robot.reason for robot in report.robots} == {reason}
        assert not report.passed


@pytest.mark.long
def test_what_does_not_start_any_more_is_done_by_those_that_are_up(monkeypatch: pytest.MonkeyPatch) -> None:
    right, asked = worker_processes._start_interpreter, 0

    def one(pipe: int) -> Any:
        nonlocal asked
        asked += 1
        if asked == 2:
            raise OSError(24, "Too many open files")
        return right(pipe)

    monkeypatch.setattr(worker_processes, "_start_interpreter", one)
    for how in HOW[:2]:
        asked = 0
        assert validate(["double_pendulum", "planar_two_link"], samples=60, **how).passed
        assert asked >= 2


def test_a_worker_runs_nothing_of_the_current_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    codes: list[list[str]] = []

    class RecordedError(Exception):
        pass

    def started(command: list[str], **_: object) -> None:
        codes.append(command)
        raise RecordedError

    monkeypatch.setattr("subprocess.Popen", started)
    monkeypatch.syspath_prepend("")
    with pytest.raises(RecordedError):
        worker_processes._start_interpreter(3)
    assert codes[0][1] == "-I"
    path = codes[0][3].partition("sys.path[:] = ")[2].partition("; from")[0]
    assert "''" not in path
    assert "site-packages" in path


@pytest.mark.long
def test_workers_killed_at_any_time_change_no_number(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Twenty seeds: when, which of two, and how often; real processes, whose answers are known beforehand."""
    robots, right = ["planar_two_link", "double_pendulum", "<robot/>", "iris_simple"], answer.answer

    def remembered(chunk: Chunk) -> Answer:
        found = right(chunk)
        (tmp_path / canned_worker.name(bytes(ForkingPickler.dumps(chunk)))).write_bytes(pickle.dumps(found))
        return found

    monkeypatch.setattr(engines, "answer", remembered)
    monkeypatch.setattr(memory, "limit", lambda *_: None)  # it is part of a chunk, and free memory changes
    expected = numbers(validate(robots, samples=100))
    monkeypatch.setattr(worker_processes, "WORKER", "tests.validation.canned_worker")
    monkeypatch.setenv("URDFKIN_TEST_ANSWERS", str(tmp_path))
    killed, others = 0, set(children(os.getpid()))  # of the tests that ran before
    for seed in range(20):
        rng = np.random.default_rng(seed)

        def kill(_: CampaignProgress, rng: np.random.Generator = rng) -> None:
            nonlocal killed
            # One process is a robot's second, alone with it, whose death is its result.
            if len(crew := sorted({*children(os.getpid())} - others)) == 2 and rng.uniform() < 0.4:
                time.sleep(rng.uniform(0.0, 0.02))
                os.kill(int(rng.choice(crew)), signal.SIGKILL)
                killed += 1

        assert numbers(validate(robots, samples=100, jobs=2, progress=kill)) == expected
    assert killed > 20


# -- who has which task ----------------------------------------------------------------------------


CUT, NOBODY = Cut(100), RobotInput(b"", Origin(""))


def work(robots: int) -> Iterator[Iterator[Task]]:
    """Four chunks for each robot."""
    return (iter([Task(i, CUT.chunk(NOBODY, 0, k)) for k in range(4)]) for i in range(robots))


def step(deal: WorkQueue, row: RobotTasks | None) -> tuple[tuple[int, int] | None, RobotTasks | None]:
    """What somebody with a row, or without, is given; and the row that they have then."""
    if row is not None and (task := deal.next(row)) is not None:
        return (task.robot, task.chunk.index), row
    if (found := deal.first()) is None:
        return None, None
    task, row = found
    return (task.robot, task.chunk.index), row


def test_two_have_a_robot_each_and_share_the_last_and_what_is_put_back_is_dealt_again() -> None:
    deal, rows = WorkQueue(work(3)), list[RobotTasks | None]([None, None])
    seen = [list[tuple[int, int]](), list[tuple[int, int]]()]
    for turn in (0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1):
        given, rows[turn] = step(deal, rows[turn])
        assert given is not None
        seen[turn].append(given)
    assert {robot for robot, _ in seen[0]} == {0, 2}
    assert {robot for robot, _ in seen[1]} == {1, 2}
    assert sorted(seen[0] + seen[1]) == [(i, k) for i in range(3) for k in range(4)]
    assert deal.first() is None
    for shared in (True, False):
        deal = WorkQueue(work(2), shared=shared)
        found = deal.first()
        assert found is not None
        task, row = found
        deal.put_back(task, row)
        again = deal.first()
        assert again is not None
        assert again[0] == task
        assert [left.chunk.index for left in deal.withdraw(0)] == [1, 2, 3]
        assert deal.next(row) is None
        assert [(step(deal, None)[0] or (0, 0))[0]] == [1]


def test_help_goes_to_the_robot_of_which_most_is_left_and_nobody_helps_where_each_is_alone() -> None:
    deal = WorkQueue(work(2))
    (_, first), (_, second) = deal.first() or ((), RobotTasks(())), deal.first() or ((), RobotTasks(()))
    for _ in range(2):
        deal.next(first)
    task, row = deal.first() or (None, None)
    assert task is not None
    assert row is second
    assert (task.robot, task.chunk.index) == (1, 1)
    deal = WorkQueue(work(1), shared=False)
    assert deal.first() is not None
    assert deal.first() is None
