"""A process that dies costs its robot and nothing else; everything else is as in one process."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from urdfkin.validation import workers
from urdfkin.validation.campaign import validate
from urdfkin.validation.outcome import Verdict

DEADLY = "ur5"
ROBOTS = ["double_pendulum", DEADLY, "iris_simple"]
HOW: list[dict[str, Any]] = [{"jobs": 2}, {"jobs": 2, "isolate": True}, {"isolate": True}]


@pytest.fixture
def deaths(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """Workers that die over a robot: as often as the file says."""
    monkeypatch.setattr(workers, "WORKER", "tests.validation.deadly_worker")
    path = tmp_path / "deaths"
    monkeypatch.setenv("URDFKIN_TEST_DEATHS", str(path))
    return path


def numbers(report: Any) -> Any:
    return [
        {key: value for key, value in robot.items() if key not in ("seconds", "timings")}
        for robot in report.as_dict()["robots"]
    ]


@pytest.mark.slow
@pytest.mark.parametrize("how", HOW, ids=str)
def test_processes_change_no_number(how: dict[str, Any]) -> None:
    with_them = validate(["ur5", "double_pendulum"], samples=60, **how)
    without = validate(["ur5", "double_pendulum"], samples=60)
    assert with_them.passed
    assert numbers(with_them) == numbers(without)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("how", "words"), [(HOW[0], "died twice, then alone"), (HOW[1], "died"), (HOW[2], "died")]
)
def test_a_death_is_that_robots_result_and_the_others_go_on(
    how: dict[str, Any], words: str, deaths: Path
) -> None:
    deaths.write_text("99")
    report = validate(ROBOTS, samples=60, **how)
    assert [robot.verdict for robot in report.robots] == [
        Verdict.VERIFIED,
        Verdict.NOT_VERIFIED,
        Verdict.VERIFIED,
    ]
    reason = f"ur5: the process that checked it {words}: found signal SIGSEGV"
    assert report.robots[1].reason == reason
    assert not report.passed
    assert report.exit_code == 3


@pytest.mark.slow
def test_a_robot_over_which_one_worker_died_is_tried_again_and_verified_in_full(deaths: Path) -> None:
    deaths.write_text("1")
    report = validate(ROBOTS, samples=60, jobs=2)
    assert report.passed
    assert deaths.read_text() == "0"
    assert numbers(report) == numbers(validate(ROBOTS, samples=60))


@pytest.mark.slow
def test_what_cannot_be_read_is_reported_as_without_processes() -> None:
    robots = ["<robot/>", "no such robot"]
    plain = validate(robots, samples=60)
    assert {robot.verdict for robot in plain.robots} == {Verdict.BAD_INPUT}
    assert plain.exit_code == 2
    for how in HOW:
        assert numbers(validate(robots, samples=60, **how)) == numbers(plain)
