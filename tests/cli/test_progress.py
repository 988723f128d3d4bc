"""Progress shows finished work, speed, remaining time and failures; without a terminal, as lines."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tests.cli.running import good, urdfkin
from urdfkin.cli import campaign
from urdfkin.cli.campaign import Pace, line
from urdfkin.validation.collector import CampaignProgress

STANDING = CampaignProgress(
    robots_done=2, robots=68, chunks_done=30, chunks=544, chunks_kept=10, failures=0, label="panda"
)


@pytest.mark.parametrize("compiling", [0.0, 90.0])
def test_stored_chunks_and_compilation_do_not_change_the_reported_speed(compiling: float) -> None:
    now = [100.0]
    pace = Pace(lambda: now[0])
    now[0] += compiling
    assert pace.of(replace(STANDING, chunks_done=10)) == (None, None)
    now[0] += 5.0
    assert pace.of(STANDING) == (4.0, 128.5)
    assert line(STANDING, pace) == (
        "2 of 68 robots, 30 of 544 chunks (10 from an earlier run); 4 chunks/s, 2 min 8 s left, none"
        " failed; panda"
    )
    assert "3 failed" in line(replace(STANDING, failures=3), pace)


def test_json_progress_is_printed_from_the_start_to_the_last_chunk() -> None:
    def states(robots: str) -> list[dict[str, Any]]:
        err = urdfkin(f"validate {robots} --samples 50 --json-progress").err
        return [json.loads(text) for text in err.splitlines() if text.startswith("{")]

    first, *_, last = states("planar_two_link nosuch")
    assert last["chunks_done"] == last["chunks"] == 4
    assert (last["robots_done"], last["failures"], last["seconds_left"]) == (2, 1, 0.0)
    assert set(first) == {*STANDING.__slots__, "chunks_per_second", "seconds_left"}
    first, *_ = states("planar_two_link")
    assert (first["chunks_done"], first["chunks"], first["label"]) == (0, 2, "planar_two_link")
    assert first["chunks_per_second"] is None


def test_a_log_gets_progress_lines_at_intervals_and_none_for_a_short_run(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert "chunks" not in urdfkin("validate planar_two_link --samples 50").err
    monkeypatch.setattr(campaign, "_LINES", 0.0)
    done = urdfkin("validate planar_two_link --samples 50")
    assert "urdfkin: 1 of 1 robots, 2 of 2 chunks; " in done.err
    assert done.err.endswith("left, none failed; planar_two_link\n")


@pytest.mark.slow
def test_a_shard_reports_the_result_and_the_next_command(tmp_path: Path) -> None:
    where = str(tmp_path / "s")
    words = ("validate", "planar_two_link", "double_pendulum", "--samples", "0", "--store", where)
    done = good(*words, "--shard", "2/2")
    assert f"shard 2/2 of {where}: 1 robot, " in done.text
    assert "next: run `urdfkin report merge" in done.text
    assert urdfkin("report", where).code == 130
    assert urdfkin(*words, "--shard", "1/2").code == 0
    assert urdfkin("report", where).code == 0
