"""With isolation a process that dies is a robot's result; everything else is as without."""

import os
import signal
import time
from typing import Any

import pytest

from urdfkin.origin import Origin
from urdfkin.validation import isolation
from urdfkin.validation.campaign import validate
from urdfkin.validation.chunk import Chunk, ChunkResult, Subject, chunks, run_chunk
from urdfkin.validation.isolation import DiedError, run_isolated
from urdfkin.validation.report import Verdict

pytestmark = pytest.mark.slow

DEADLY = "ur5"


def dies(chunk: Chunk) -> ChunkResult:
    """What a crash of compiled code looks like from outside."""
    if chunk.subject.source == DEADLY:
        os.kill(os.getpid(), signal.SIGSEGV)
    return run_chunk(chunk)


def _deadly_child(pipe: Any, work: list[Chunk]) -> None:
    setattr(isolation, "run_chunk", dies)  # noqa: B010 - mypy does not let a foreign name be replaced
    isolation._serve(pipe, work)


def _sleeping_child(pipe: Any, work: list[Chunk]) -> None:
    time.sleep(60)


@pytest.mark.slow
def test_isolation_changes_no_number() -> None:
    with_it = validate(["ur5", "double_pendulum"], samples=30, isolate=True)
    without = validate(["ur5", "double_pendulum"], samples=30)
    assert with_it.passed

    def numbers(report: Any) -> Any:
        return [
            {key: value for key, value in robot.items() if key not in ("seconds", "timings")}
            for robot in report.as_dict()["robots"]
        ]

    assert numbers(with_it) == numbers(without)


@pytest.mark.slow
def test_a_death_is_that_robots_result_and_the_others_go_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(isolation, "_child", _deadly_child)
    report = validate(["double_pendulum", DEADLY, "iris_simple"], samples=3, isolate=True, jobs=2)
    assert [robot.verdict for robot in report.robots] == [
        Verdict.VERIFIED,
        Verdict.NOT_VERIFIED,
        Verdict.VERIFIED,
    ]
    assert "the process that checked it died: found signal SIGSEGV" in str(report.robots[1].reason)
    assert not report.passed


def test_what_cannot_be_read_is_reported_as_without_isolation() -> None:
    robots = ["<robot/>", "no such robot"]
    isolated, plain = (validate(robots, samples=1, isolate=isolate) for isolate in (True, False))
    assert [r.reason for r in isolated.robots] == [r.reason for r in plain.robots]
    assert {robot.verdict for robot in isolated.robots} == {Verdict.BAD_INPUT}


def test_a_check_that_takes_too_long_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(isolation, "_child", _sleeping_child)
    with pytest.raises(DiedError, match=r"no answer in 0\.5 s"):
        list(run_isolated(list(chunks(Subject("iris_simple", Origin("iris_simple")), 1, 0)), patience=0.5))


def test_the_command_isolates() -> None:
    from click.testing import CliRunner  # noqa: PLC0415

    from urdfkin.cli import cli  # noqa: PLC0415

    done = CliRunner().invoke(cli, ["validate", "iris_simple", "--samples", "2", "--isolate"])
    assert done.exit_code == 0, done.output
