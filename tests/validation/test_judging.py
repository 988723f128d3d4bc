"""What the judge found is kept: it goes on where it was ended, and trusts no file."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest

from tests.cli.running import urdfkin
from urdfkin.cli.validate import judge_all
from urdfkin.errors import InputError
from urdfkin.robot import Robot
from urdfkin.robot.loading import load
from urdfkin.validation import accuracy
from urdfkin.validation.accuracy import Judgement
from urdfkin.validation.accuracy_store import AccuracyResult, NotJudged, StudySettings
from urdfkin.validation.campaign import StoreWarning, stored, validate
from urdfkin.validation.store import Store, opened

ROBOTS = ["planar_two_link", "no such robot", "double_pendulum"]
WORDS = ("validate", *ROBOTS, "--samples", "0", "--judge", "--judge-samples", "1")


class Judge:
    """The judge, who is told to end at a robot, or to refuse it; and the robots that it was asked about."""

    def __init__(self) -> None:
        self.asked: list[str] = []
        self.ends_at = self.refuses = ""
        self._right = accuracy.judge

    def __call__(self, robot: Robot, **how: Any) -> Judgement:
        if robot.source == self.ends_at:
            raise KeyboardInterrupt
        self.asked.append(robot.source)
        if robot.source == self.refuses:
            raise InputError("not to be judged")
        return self._right(robot, **how)


@pytest.fixture
def judge(monkeypatch: pytest.MonkeyPatch) -> Judge:
    found = Judge()
    monkeypatch.setattr(accuracy, "judge", found)
    return found


def judged(path: Path) -> list[Any]:
    return [robot["judge"] for robot in json.loads(path.read_text())["robots"]]


@pytest.mark.slow
def test_it_goes_on_where_it_ended_and_the_report_is_that_of_one_run(judge: Judge, tmp_path: Path) -> None:
    one, again, store = tmp_path / "one.json", tmp_path / "again.json", str(tmp_path / "s")
    urdfkin(*WORDS, "--json", str(one))
    expected, judge.asked = judged(one), []
    judge.ends_at = "double_pendulum"
    assert urdfkin(*WORDS, "--store", store).code == 130
    assert stored(store).interrupted
    assert "accuracy study: 1 of 2 robots" in urdfkin("report status", store).text
    judge.ends_at = ""
    assert urdfkin(*WORDS, "--store", store, "--json", str(again)).code == 2  # of the robot that is none
    assert judge.asked == ["planar_two_link", "double_pendulum"]
    assert judged(again) == expected
    assert expected[1] is None
    assert not stored(store).interrupted
    assert json.loads(json.dumps([r["judge"] for r in stored(store).as_dict()["robots"]])) == expected


@pytest.mark.slow
def test_other_settings_of_the_judge_never_meet_what_it_found_and_leave_the_chunks(
    judge: Judge, tmp_path: Path
) -> None:
    store, words = str(tmp_path), WORDS[:-1]
    urdfkin(*words, "1", "--store", store)
    chunks = sorted(tmp_path.glob("chunks/*/*.chunk"))
    for more in ((*words, "2"), (*words, "1", "--judge-moving-base")):
        judge.asked = []
        urdfkin(*more, "--store", store)
        assert judge.asked == ["planar_two_link", "double_pendulum"]
    assert sorted(tmp_path.glob("chunks/*/*.chunk")) == chunks
    assert len(list(tmp_path.glob("chunks/*/*.judged"))) == 6
    (first, *_) = stored(store).judgements
    assert first is not None
    assert first.moving_base


def test_parts_judge_each_robot_once_and_merge_to_the_report_of_one_run(judge: Judge, tmp_path: Path) -> None:
    one, whole, again = tmp_path / "one.json", str(tmp_path / "whole"), tmp_path / "again.json"
    urdfkin(*WORDS, "--json", str(one))
    expected, judge.asked = judged(one), []
    shards = [(f"{i}/2", str(tmp_path / str(i))) for i in (1, 2)]
    for shard, store in shards:
        urdfkin(*WORDS, "--store", store, "--shard", shard)
    assert judge.asked == ["planar_two_link", "double_pendulum"]
    merged = urdfkin("report merge", whole, *(store for _, store in shards))
    assert "accuracy study: 2 of 2 robots" in merged.text
    urdfkin("report", whole, "--json", str(again))
    assert judged(again) == expected
    urdfkin(*WORDS[:-1], "2", "--store", shards[1][1], "--shard", "2/2")
    again_merged = urdfkin("report merge", whole, *(store for _, store in shards))
    assert again_merged.code == 2
    assert "--judge-samples 2 --seed 0, and --judge-samples 1 --seed 0 in" in again_merged.err


def test_a_damaged_judgement_is_told_and_made_again(judge: Judge, tmp_path: Path) -> None:
    urdfkin(*WORDS, "--store", str(tmp_path))
    for i, place in enumerate(sorted(tmp_path.glob("chunks/*/*.judged"))):
        content = place.read_bytes()
        place.write_bytes(content[:-1] if i else content[:60] + bytes([content[60] ^ 1]) + content[61:])
    judge.asked = []
    with pytest.warns(StoreWarning, match="is computed again"):
        assert stored(tmp_path).interrupted
    again = urdfkin(*WORDS, "--store", str(tmp_path))
    assert again.err.count("is computed again") == 2
    assert judge.asked == ["planar_two_link", "double_pendulum"]
    (tmp_path / "judge.json").write_text("{}")
    with pytest.warns(StoreWarning, match="cannot be read"):
        assert stored(tmp_path).judgements == ()


def test_what_cannot_be_judged_is_said_each_time_and_retried_if_asked(judge: Judge, tmp_path: Path) -> None:
    judge.refuses = "planar_two_link"
    words = (*WORDS, "--store", str(tmp_path))
    said = "urdfkin: planar_two_link: no accuracy result: InputError: not to be judged"
    assert said in urdfkin(*words).err
    assert said in urdfkin(*words).err
    assert judge.asked == ["planar_two_link", "double_pendulum"]
    assert not stored(tmp_path).interrupted
    judge.refuses = ""
    assert "no accuracy result" not in urdfkin(*words, "--retry", "failed").err
    assert None not in stored(tmp_path).judgements


def test_a_text_that_changed_since_it_was_compared_is_not_judged(judge: Judge, tmp_path: Path) -> None:
    robot, store = tmp_path / "a.urdf", tmp_path / "s"
    robot.write_text('<robot name="a"><link name="l"/></robot>')
    report = validate([str(robot)], samples=0, store=store)
    robot.write_text('<robot name="b"><link name="l"/></robot>')
    how = {"mimic": None, "root_joint": None, "xacro_args": None}
    found = judge_all(report, [str(robot)], StudySettings(1, 0, False), store=store, how=how)
    assert found.judgements == (None,)
    assert judge.asked == []
    assert not list(store.glob("chunks/*/*.judged"))


def test_a_judgement_is_read_back_to_the_last_bit(tmp_path: Path) -> None:
    validate("planar_two_link", samples=0, store=tmp_path)
    with opened(tmp_path, Store.reading(tmp_path, pytest.fail).manifest, pytest.fail) as store:
        kept = AccuracyResult(store, StudySettings(1, 0, False))
        found = accuracy.judge(load("planar_two_link"), samples=1)
        for each in (found, NotJudged("why \ud800")):
            kept.keep(0, each)
            assert json.dumps(asdict(kept.found(0))) == json.dumps(asdict(each))  # type: ignore[arg-type]
