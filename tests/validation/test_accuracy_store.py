"""Accuracy results in a store: an interrupted study resumes, and damaged files are computed again."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest

from tests.cli.running import urdfkin
from urdfkin.cli.validate import study_all
from urdfkin.errors import InputError
from urdfkin.robot import Robot
from urdfkin.robot.loading import load
from urdfkin.validation import accuracy
from urdfkin.validation.accuracy import AccuracyStudy
from urdfkin.validation.campaign import StoreWarning, read_stored_report, validate
from urdfkin.validation.store import AccuracyStore, FailedStudy, Store, StudySettings, open_store

ROBOTS = ["planar_two_link", "no such robot", "double_pendulum"]
STUDIED = ["planar_two_link", "double_pendulum"]
COMMAND = ("validate", *ROBOTS, "--samples", "0", "--accuracy", "--accuracy-samples", "1")


class Recorder:
    """Accuracy study that records its robots, and that is interrupted or fails at a robot."""

    def __init__(self) -> None:
        self.robots: list[str] = []
        self.interrupted_at = self.failing = ""
        self._study = accuracy.accuracy_study

    def __call__(self, robot: Robot, **options: Any) -> AccuracyStudy:
        if robot.source == self.interrupted_at:
            raise KeyboardInterrupt
        self.robots.append(robot.source)
        if robot.source == self.failing:
            raise InputError("not to be studied")
        return self._study(robot, **options)


@pytest.fixture
def study(monkeypatch: pytest.MonkeyPatch) -> Recorder:
    recorder = Recorder()
    monkeypatch.setattr(accuracy, "accuracy_study", recorder)
    return recorder


@pytest.fixture
def expected(study: Recorder, tmp_path: Path) -> list[Any]:
    """Accuracy results of a run without a store."""
    urdfkin(*COMMAND, "--json", str(tmp_path / "one.json"))
    study.robots = []
    return results(tmp_path / "one.json")


def results(path: Path) -> list[Any]:
    return [robot["accuracy"] for robot in json.loads(path.read_text())["robots"]]


@pytest.mark.slow
def test_an_interrupted_study_resumes_and_gives_the_report_of_one_run(
    study: Recorder, expected: list[Any], tmp_path: Path
) -> None:
    again, store = tmp_path / "again.json", str(tmp_path / "s")
    study.interrupted_at = "double_pendulum"
    assert urdfkin(*COMMAND, "--store", store).code == 130
    assert read_stored_report(store).interrupted
    assert "accuracy study: 1 of 2 robots" in urdfkin("report status", store).text
    study.interrupted_at = ""
    assert urdfkin(*COMMAND, "--store", store, "--json", str(again)).code == 2  # because of the missing robot
    assert study.robots == STUDIED
    assert results(again) == expected
    assert expected[1] is None
    assert not read_stored_report(store).interrupted
    assert (
        json.loads(json.dumps([r["accuracy"] for r in read_stored_report(store).as_dict()["robots"]]))
        == expected
    )


@pytest.mark.slow
def test_other_settings_of_the_study_reuse_no_result_and_keep_the_chunks(
    study: Recorder, tmp_path: Path
) -> None:
    store = str(tmp_path)
    urdfkin(*COMMAND, "--store", store)
    chunks = sorted(tmp_path.glob("chunks/*/*.chunk"))
    for command in ((*COMMAND[:-1], "2"), (*COMMAND, "--accuracy-moving-base")):
        study.robots = []
        urdfkin(*command, "--store", store)
        assert study.robots == STUDIED
    assert sorted(tmp_path.glob("chunks/*/*.chunk")) == chunks
    assert len(list(tmp_path.glob("chunks/*/*.accuracy"))) == 6
    (first, *_) = read_stored_report(store).studies
    assert first is not None
    assert first.moving_base


def test_shards_study_each_robot_once_and_can_be_merged_to_the_report_of_one_run(
    study: Recorder, expected: list[Any], tmp_path: Path
) -> None:
    whole, again = str(tmp_path / "whole"), tmp_path / "again.json"
    shards = [(f"{i}/2", str(tmp_path / str(i))) for i in (1, 2)]
    for shard, store in shards:
        urdfkin(*COMMAND, "--store", store, "--shard", shard)
    assert study.robots == STUDIED
    merged = urdfkin("report merge", whole, *(store for _, store in shards))
    assert "accuracy study: 2 of 2 robots" in merged.text
    urdfkin("report", whole, "--json", str(again))
    assert results(again) == expected
    urdfkin(*COMMAND[:-1], "2", "--store", shards[1][1], "--shard", "2/2")
    again_merged = urdfkin("report merge", whole, *(store for _, store in shards))
    assert again_merged.code == 2
    assert "--accuracy-samples 2 --seed 0, and --accuracy-samples 1 --seed 0 in" in again_merged.err


def test_a_damaged_result_is_reported_and_computed_again(study: Recorder, tmp_path: Path) -> None:
    urdfkin(*COMMAND, "--store", str(tmp_path))
    for i, place in enumerate(sorted(tmp_path.glob("chunks/*/*.accuracy"))):
        content = place.read_bytes()
        place.write_bytes(content[:-1] if i else content[:60] + bytes([content[60] ^ 1]) + content[61:])
    study.robots = []
    with pytest.warns(StoreWarning, match="is computed again"):
        assert read_stored_report(tmp_path).interrupted
    again = urdfkin(*COMMAND, "--store", str(tmp_path))
    assert again.err.count("is computed again") == 2
    assert study.robots == STUDIED
    (tmp_path / "accuracy.json").write_text("{}")
    with pytest.warns(StoreWarning, match="cannot be read"):
        assert read_stored_report(tmp_path).studies == ()


def test_status_and_merge_report_a_missing_result_of_the_study(study: Recorder, tmp_path: Path) -> None:
    store, whole = str(tmp_path / "store"), str(tmp_path / "whole")
    urdfkin("validate", *STUDIED, *COMMAND[4:], "--store", store)
    assert urdfkin("report status", store).code == 0
    next((tmp_path / "store").glob("chunks/*/*.accuracy")).unlink()
    status = urdfkin("report status", store)
    assert status.code == 3
    assert "accuracy study: 1 of 2 robots done\nno process uses the store; to resume" in status.text
    assert f"{whole}: 1 result of the accuracy study missing" in urdfkin("report merge", whole, store).text


def test_a_failed_study_is_reported_each_time_and_retried_on_request(study: Recorder, tmp_path: Path) -> None:
    study.failing = "planar_two_link"
    command = (*COMMAND, "--store", str(tmp_path))
    message = "urdfkin: planar_two_link: no accuracy result: InputError: not to be studied"
    for _ in range(2):
        assert message in urdfkin(*command).err
    assert study.robots == STUDIED
    assert not read_stored_report(tmp_path).interrupted
    study.failing = ""
    assert "no accuracy result" not in urdfkin(*command, "--retry", "failed").err
    assert None not in read_stored_report(tmp_path).studies


def test_a_text_that_changed_after_the_comparison_is_not_studied(study: Recorder, tmp_path: Path) -> None:
    robot, store = tmp_path / "a.urdf", tmp_path / "s"
    robot.write_text('<robot name="a"><link name="l"/></robot>')
    report = validate([str(robot)], samples=0, store=store)
    robot.write_text('<robot name="b"><link name="l"/></robot>')
    how = {"mimic": None, "root_joint": None, "xacro_args": None}
    found = study_all(report, [str(robot)], StudySettings(1, 0, False), store=store, how=how)
    assert found.studies == (None,)
    assert study.robots == []
    assert not list(store.glob("chunks/*/*.accuracy"))


def test_a_stored_result_of_a_study_is_read_back_exactly(tmp_path: Path) -> None:
    validate("planar_two_link", samples=0, store=tmp_path)
    with open_store(tmp_path, Store.open_read_only(tmp_path, pytest.fail).manifest, pytest.fail) as store:
        kept = AccuracyStore(store, StudySettings(1, 0, False))
        found = accuracy.accuracy_study(load("planar_two_link"), samples=1)
        for each in (found, FailedStudy("why \ud800")):
            kept.write(0, each)
            assert json.dumps(asdict(kept.read(0))) == json.dumps(asdict(each))  # type: ignore[arg-type]
