"""A crash affects only the robot of the crashed process, and each task is given to one worker."""

import os
import pickle
import signal
import time
from collections.abc import Iterator
from itertools import chain, repeat
from multiprocessing.reduction import ForkingPickler
from pathlib import Path
from typing import Any
from unittest.mock import DEFAULT, Mock

import numpy as np
import pytest

from tests.attacks.test_validation_signals import children
from tests.reading import present
from tests.validation import canned_worker, faulty_worker
from tests.validation.test_store import numbers
from urdfkin.urdf.sources import Origin
from urdfkin.validation import answer, engines, memory, worker_processes
from urdfkin.validation.answer import Answer
from urdfkin.validation.campaign import validate
from urdfkin.validation.chunk import Chunk, Chunking
from urdfkin.validation.collector import CampaignProgress
from urdfkin.validation.engines import RobotTasks, Task, WorkQueue
from urdfkin.validation.robot_input import RobotInput

ROBOTS = ["double_pendulum", "ur5", "iris_simple"]
CRASH = "ur5: the process that validated the robot {}: found signal SIGSEGV"
HOW: list[dict[str, Any]] = [{"jobs": 2}, {"jobs": 2, "isolate": True}, {"isolate": True}]


@pytest.fixture
def crashes(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A file with the number of times that the robot ur5 crashes its process."""
    monkeypatch.setattr(worker_processes, "WORKER_MODULE", faulty_worker.MODULE)
    monkeypatch.setenv(faulty_worker.FAULT, str(tmp_path / "crashes"))
    return tmp_path / "crashes"


@pytest.mark.long
def test_results_do_not_depend_on_the_number_of_processes() -> None:
    robots = ["ur5", "double_pendulum", "<robot/>", "no such robot"]
    alone = validate(robots, samples=60)
    assert [robot.verdict for robot in alone.robots] == ["verified"] * 2 + ["bad input"] * 2
    for how in HOW:
        assert numbers(validate(robots, samples=60, **how)) == numbers(alone)


@pytest.mark.long
@pytest.mark.parametrize("how", HOW)
def test_a_crash_is_the_result_of_its_robot_and_the_other_robots_are_verified(
    how: dict[str, Any], crashes: Path
) -> None:
    crashes.write_text("99")
    report = validate(ROBOTS, samples=60, **how)
    assert [robot.verdict for robot in report.robots] == ["verified", "not verified", "verified"]
    twice = "crashed; a second process, for this robot only, also crashed"
    assert report.robots[1].reason == CRASH.format("crashed" if "isolate" in how else twice)
    assert not report.passed
    assert report.exit_code == 3


@pytest.mark.long
def test_a_robot_that_crashed_one_process_is_retried_and_verified_in_full(crashes: Path) -> None:
    crashes.write_text("1")
    report = validate(ROBOTS, samples=60, jobs=2)
    assert report.passed
    assert crashes.read_text() == "0"
    assert numbers(report) == numbers(validate(ROBOTS, samples=60))


@pytest.mark.long
def test_an_interrupt_kills_processes_that_hang_in_compiled_code(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(worker_processes, "WORKER_MODULE", faulty_worker.MODULE)
    monkeypatch.setenv(faulty_worker.FAULT, "hang")
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


def test_a_robot_for_which_no_process_starts_is_not_verified(monkeypatch: pytest.MonkeyPatch) -> None:
    fail = Mock(side_effect=OSError(24, "Too many open files"))
    monkeypatch.setattr(worker_processes, "_start_interpreter", fail)
    for how in HOW:
        report = validate(["ur5", "planar_two_link"], samples=60, **how)
        assert [robot.verdict for robot in report.robots] == ["not verified"] * 2
        reason = "no process could be started: OSError: [Errno 24] Too many open files"
        assert {robot.reason for robot in report.robots} == {reason}
        assert not report.passed


@pytest.mark.long
def test_running_processes_take_the_work_of_a_process_that_does_not_start(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    starts, fail = worker_processes._start_interpreter, OSError(24, "Too many open files")
    for how in HOW[:2]:
        # `DEFAULT` is the result of the wrapped function.
        start = Mock(wraps=starts, side_effect=chain([DEFAULT, fail], repeat(DEFAULT)))
        monkeypatch.setattr(worker_processes, "_start_interpreter", start)
        assert validate(["double_pendulum", "planar_two_link"], samples=60, **how).passed
        assert start.call_count >= 2


def test_a_worker_runs_no_file_of_the_current_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    started = Mock(side_effect=InterruptedError)
    monkeypatch.setattr("subprocess.Popen", started)
    monkeypatch.syspath_prepend("")
    with pytest.raises(InterruptedError):
        worker_processes._start_interpreter(3)
    command = started.call_args.args[0]
    assert command[1] == "-I"
    path = command[3].partition("sys.path[:] = ")[2].partition("; from")[0]
    assert "''" not in path
    assert "site-packages" in path


@pytest.mark.long
def test_killed_processes_change_no_result(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    robots, right = ["planar_two_link", "double_pendulum", "<robot/>", "iris_simple"], answer.answer_chunk

    def store_answer(chunk: Chunk) -> Answer:
        found = right(chunk)
        name = canned_worker.file_name(bytes(ForkingPickler.dumps(chunk)))
        (tmp_path / name).write_bytes(pickle.dumps(found))
        return found

    monkeypatch.setattr(engines, "answer_chunk", store_answer)
    monkeypatch.setattr(memory, "limit", lambda *_: None)  # the limit is part of a chunk, and would change
    expected = numbers(validate(robots, samples=100))
    monkeypatch.setattr(worker_processes, "WORKER_MODULE", "tests.validation.canned_worker")
    monkeypatch.setenv("URDFKIN_TEST_ANSWERS", str(tmp_path))
    killed, others = 0, set(children(os.getpid()))  # processes of other tests
    for seed in range(20):
        rng = np.random.default_rng(seed)

        def kill(_: CampaignProgress, rng: np.random.Generator = rng) -> None:
            nonlocal killed
            # A single process may be the second try of a robot, whose crash would be the robot's result.
            if len(workers := sorted({*children(os.getpid())} - others)) == 2 and rng.uniform() < 0.4:
                time.sleep(rng.uniform(0.0, 0.02))
                os.kill(int(rng.choice(workers)), signal.SIGKILL)
                killed += 1

        assert numbers(validate(robots, samples=100, jobs=2, progress=kill)) == expected
    assert killed > 20


# -- the queue of tasks ------------------------------------------------------------------------------


CUT, NO_ROBOT = Chunking(100), RobotInput(b"", Origin(""))


def work(robots: int) -> Iterator[Iterator[Task]]:
    """Return four chunks for each robot."""
    return (iter([Task(i, CUT.make_chunk(NO_ROBOT, 0, k)) for k in range(4)]) for i in range(robots))


def take(queue: WorkQueue, tasks: RobotTasks | None = None) -> tuple[Task, RobotTasks]:
    """Take the next task of a worker's robot, or the first task for a worker without a robot."""
    task = queue.next(tasks) if tasks is not None else None
    return (task, tasks) if task is not None and tasks is not None else present(queue.take_for_idle_worker())


def test_two_workers_start_with_different_robots_and_both_work_on_the_last_robot() -> None:
    queue, tasks = WorkQueue(work(3)), list[RobotTasks | None]([None, None])
    taken = list[tuple[int, int, int]]()
    for turn in range(12):
        task, tasks[turn % 2] = take(queue, tasks[turn % 2])
        taken.append((turn % 2, task.robot, task.chunk.index))
    assert {(worker, robot) for worker, robot, _ in taken} == {(0, 0), (1, 1), (0, 2), (1, 2)}
    assert sorted((robot, chunk) for _, robot, chunk in taken) == [(i, k) for i in range(3) for k in range(4)]
    assert queue.take_for_idle_worker() is None


@pytest.mark.parametrize("shared", [True, False])
def test_a_returned_task_is_assigned_again_and_a_withdrawn_robot_has_no_task(shared: bool) -> None:
    queue = WorkQueue(work(2), share_robots=shared)
    task, tasks = take(queue)
    queue.put_back(task, tasks)
    assert take(queue)[0] == task
    assert [left.chunk.index for left in queue.take_remaining_tasks(0)] == [1, 2, 3]
    assert queue.next(tasks) is None
    assert take(queue)[0].robot == 1


def test_a_free_worker_joins_the_robot_with_the_most_remaining_chunks_if_sharing_is_allowed() -> None:
    queue = WorkQueue(work(2))
    (_, first), (_, second) = take(queue), take(queue)
    for _ in range(2):
        queue.next(first)
    task, tasks = take(queue)
    assert tasks is second
    assert (task.robot, task.chunk.index) == (1, 1)
    queue = WorkQueue(work(1), share_robots=False)
    assert queue.take_for_idle_worker() is not None
    assert queue.take_for_idle_worker() is None
