"""`urdfkin validate` and `urdfkin report` write reports in every format, and show progress."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.cli import running
from tests.cli.running import Done, refused
from tests.report.documents import arms, failing, saved
from urdfkin.cli import campaign
from urdfkin.cli.campaign import SpeedEstimator, format_progress
from urdfkin.cli.view import _make_line
from urdfkin.robot.loading import load
from urdfkin.urdf.catalogue import catalogue
from urdfkin.validation.collector import CampaignProgress


@pytest.fixture(autouse=True)
def _eighty_columns(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")


def urdfkin(*words: str | Path) -> Done:
    return running.urdfkin(*map(str, words))


@pytest.fixture
def good(tmp_path: Path) -> Path:
    return saved(tmp_path / "good.json", arms())


@pytest.fixture
def bad(tmp_path: Path) -> Path:
    return saved(tmp_path / "bad.json", failing())


@pytest.mark.slow
def test_validate_writes_every_format_in_one_run(tmp_path: Path) -> None:
    done = running.process(
        "validate", "ur5", "--samples", "2", "--json", "a.json", "--html", "a.html",
        "--junit", "a.xml", "--markdown", "a.md", cwd=tmp_path, PYTHONWARNINGS="error",
    )  # fmt: skip
    assert done.code == 0, done.err
    assert (tmp_path / "a.html").read_text().startswith("<!doctype html>")
    assert (tmp_path / "a.xml").read_bytes().startswith(b"<?xml")
    assert (tmp_path / "a.md").read_text().startswith("## ✅")
    assert json.loads((tmp_path / "a.json").read_text())["verdict"] == "verified"
    assert max(map(len, done.text.splitlines())) <= 80


@pytest.mark.slow
def test_the_accuracy_study_reports_a_moving_base_only_if_requested(tmp_path: Path) -> None:
    data, page = tmp_path / "a.json", tmp_path / "a.html"
    words = "validate", "polar", "--samples", "1", "--accuracy", "--accuracy-samples", "1", "--json", data
    still = urdfkin(*words)
    before = json.loads(data.read_text())["robots"][0]["accuracy"]
    assert json.loads(data.read_text())["command"] == (
        "urdfkin validate polar --samples 1 --seed 0 --accuracy --accuracy-samples 1"
    )
    moving = urdfkin(*words, "--accuracy-moving-base", "--html", page)
    after = json.loads(data.read_text())["robots"][0]["accuracy"]
    assert json.loads(data.read_text())["command"].endswith(" --accuracy-samples 1 --accuracy-moving-base")
    assert (still.code, moving.code) == (0, 0)
    assert "1 sample on a moving base" in moving.text
    assert "moving base" not in still.text
    assert "1 sample on a moving base" in page.read_text()
    assert (before["moving_base"], after["moving_base"]) == (False, True)
    assert before["lines"] != after["lines"]


@pytest.mark.slow
def test_validate_reads_all_urdf_files_in_a_folder_and_its_subfolders(tmp_path: Path) -> None:
    arm = catalogue()["planar_two_link"].path.read_text("utf-8")
    for name in ("a.urdf", "inside/b.urdf", ".hidden/c.urdf", "notes.txt"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(arm)
    text = urdfkin("validate", tmp_path, "--samples", "1").text
    assert "verified: 2 robots" in text
    assert "a.urdf" in text
    assert "inside/b.urdf" in text
    (tmp_path / "empty").mkdir()
    assert "no URDF found" in refused("validate", str(tmp_path / "empty"))


def test_an_empty_name_is_not_the_working_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.urdf").write_text(catalogue()["planar_two_link"].path.read_text("utf-8"))
    monkeypatch.chdir(tmp_path)
    done = urdfkin("validate", "", "--samples", "1")
    assert done.code == 2
    assert "the robot's name is empty" in done.text


def test_a_robot_from_standard_input_is_locked_once_if_its_accuracy_is_studied(tmp_path: Path) -> None:
    path = tmp_path / "r.json"
    urdf = catalogue()["planar_two_link"].path.read_text("utf-8")
    options = ["--samples", "1", "--accuracy", "--accuracy-samples", "1", "--json", str(path)]
    for lock, code in (("joint_1=0.5", 0), ("nowhere=0.5", 2)):
        done = running.urdfkin("validate", "-", *options, "--lock", lock, stdin=urdf)
        robot = json.loads(path.read_text())["robots"][0]
        assert done.code == code, done.text
        assert robot["source"] == "-"
        assert (robot["accuracy"] is not None) == (code == 0)


def test_a_report_rendered_later_equals_the_report_of_validate(tmp_path: Path) -> None:
    data, made = tmp_path / "a.json", []
    for words in (("validate", "planar_two_link", "--samples", "3", "--json", data), ("report", data)):
        files = {form: tmp_path / f"{words[0]}.{form}" for form in ("html", "junit", "markdown")}
        done = urdfkin(*words, *(f"--{form}={file}" for form, file in files.items()))
        assert done.code == 0, done.err
        made.append([file.read_bytes() for file in files.values()])
    assert made[0] == made[1]


def test_report_prints_by_default_with_the_exit_code_of_the_run_and_prints_the_schema(
    good: Path, bad: Path
) -> None:
    for report, code, words in ((good, 0, "2 robots"), (bad, 1, "urdfkin velocity panda --frame")):
        done = urdfkin("report", report)
        assert done.code == code
        assert words in done.text
    assert urdfkin("report --schema").data["$id"] == "urn:urdfkin:validation:1"


@pytest.mark.slow
def test_compare_exits_with_1_for_a_regression_or_a_missing_robot(
    good: Path, bad: Path, tmp_path: Path
) -> None:
    done = urdfkin("report", "compare", good, bad, "--markdown", tmp_path / "c.md")
    assert done.code == 1
    assert "REGRESSION panda: verdict: verified -> disagrees" in done.text
    assert (tmp_path / "c.md").read_text().startswith("## ❌")
    assert urdfkin("report", "compare", bad, good).code == 1  # the second report lacks a robot
    assert urdfkin("report", "compare", good, good).code == 0
    found = urdfkin("report", "compare", good, bad, "--format", "json").data
    assert found["schema"] == "urdfkin-comparison/1"
    assert found["verdict"] == "regression"
    assert any(change["regression"] for change in found["changes"])
    assert found["command"].startswith(f"urdfkin report compare {good} {bad}")


def test_compare_lists_a_changed_axis_and_states_that_changes_alone_exit_with_0(
    good: Path, tmp_path: Path
) -> None:
    changed: Any = arms()
    joint = changed["robots"][1]["model"]["joints"][2]
    joint["axis"] = [-x for x in joint["axis"]]
    done = urdfkin("report", "compare", good, saved(tmp_path / "new.json", changed))
    assert done.code == 0
    words = " ".join(done.text.split())
    assert f"ur5: joint {joint['name']}, axis: z -> -z, rotated by 3.142 rad" in words
    assert words.endswith("no regression, 1 change (exit 0: changes without a regression)")


def test_an_unwritable_report_leaves_existing_files_unchanged(tmp_path: Path) -> None:
    there = tmp_path / "a.json"
    there.write_text("old")
    done = urdfkin("validate", "ur5", "--samples", "0", "--json", there, "--html", "/nowhere/a.html")
    assert done.code == 2
    assert there.read_text() == "old"


@pytest.mark.slow
def test_plot_reports_the_number_of_checked_samples(tmp_path: Path) -> None:
    words = "plot ur5 --to random --seed 1 --samples 11 --panel position -o"
    done = urdfkin(words, tmp_path / "a.png")
    assert done.code == 0, done.err
    assert "11 samples, verified by Pinocchio" in done.text
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


def test_a_line_between_two_random_configurations_moves_the_robot() -> None:
    motion = _make_line(load("ur5"), "random", "random", 1.0, 3, 0, None)
    assert not np.allclose(motion.q[0], motion.q[-1])


# -- progress ----------------------------------------------------------------------------------------

STANDING = CampaignProgress(
    robots_done=2,
    robots=68,
    chunks_done=30,
    chunks=544,
    chunks_from_earlier_run=10,
    failures=0,
    label="panda",
)


@pytest.mark.parametrize("compiling", [0.0, 90.0])
def test_stored_chunks_and_compilation_do_not_change_the_reported_speed(compiling: float) -> None:
    now = [100.0]
    estimator = SpeedEstimator(lambda: now[0])
    now[0] += compiling
    assert estimator.estimate(replace(STANDING, chunks_done=10)) == (None, None)
    now[0] += 5.0
    assert estimator.estimate(STANDING) == (4.0, 128.5)
    assert format_progress(STANDING, estimator) == (
        "2 of 68 robots, 30 of 544 chunks (10 from an earlier run); 4 chunks/s, 2 min 8 s left, none"
        " failed; panda"
    )
    assert "3 failed" in format_progress(replace(STANDING, failures=3), estimator)


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
    monkeypatch.setattr(campaign, "_LINE_INTERVAL", 0.0)
    done = urdfkin("validate planar_two_link --samples 50")
    assert "urdfkin: 1 of 1 robots, 2 of 2 chunks; " in done.err
    assert done.err.endswith("left, none failed; planar_two_link\n")


def test_a_shard_without_a_chunk_succeeds_and_states_the_reason(tmp_path: Path) -> None:
    words = ("validate", "planar_two_link", "--samples", "0", "--store", str(tmp_path / "s"))
    done = urdfkin(*words, "--shard", "1/2")
    assert (done.code, done.err) == (0, "")
    assert "nothing to do, because the validation has fewer chunks than parts" in done.text


@pytest.mark.slow
def test_a_shard_reports_the_result_and_the_next_command(tmp_path: Path) -> None:
    where = str(tmp_path / "s")
    words = ("validate", "planar_two_link", "double_pendulum", "--samples", "0", "--store", where)
    done = urdfkin(*words, "--shard", "2/2")
    assert done.code == 0, done.err
    assert f"shard 2/2 of {where}: 1 robot, " in done.text
    assert "after all parts: run `urdfkin report merge" in done.text
    assert urdfkin("report", where).code == 130
    assert urdfkin(*words, "--shard", "1/2").code == 0
    assert urdfkin("report", where).code == 0
