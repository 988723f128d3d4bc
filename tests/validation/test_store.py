"""A store goes on where it was ended, trusts no file, and reports what one run would have reported."""

import gc
import itertools
import json
import os
import resource
import signal
import subprocess
import sys
import time
import tracemalloc
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.attacks.test_validation_runs import Refusing
from tests.cli.running import urdfkin as run
from urdfkin.errors import InputError, SourceError
from urdfkin.validation import answer, manifest, results
from urdfkin.validation.answer import (
    Answer,
    DamagedError,
    Failure,
    decode_answer,
    encode_answer,
    pack,
    unpack,
)
from urdfkin.validation.campaign import StoreWarning, chunks_of_shard, stored, validate
from urdfkin.validation.chunk import Chunk, ChunkResult, Cut, chunks, run_chunk
from urdfkin.validation.collector import CampaignProgress, Progress, ResultCollector
from urdfkin.validation.engines import Task
from urdfkin.validation.outcome import ValidationVerdict
from urdfkin.validation.robot_input import subject
from urdfkin.validation.store import Store

ROBOTS = ["planar_two_link", "no such robot", "double_pendulum"]
SAMPLES = 60


def numbers(report: Any) -> str:
    """A report's document without its times."""
    document = json.loads(json.dumps(report.as_dict()))
    del document["started"], document["seconds"]
    for robot in document["robots"]:
        del robot["seconds"], robot["timings"]
    return json.dumps(document)


@pytest.fixture(scope="module")
def undisturbed() -> str:
    return numbers(validate(ROBOTS, samples=SAMPLES))


@pytest.fixture
def ran(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, int]]:
    """The chunks that were computed; after `ran.limit` of them the run is interrupted."""
    found: list[tuple[str, int]] = []

    def counting(chunk: Chunk) -> ChunkResult:
        found.append((chunk.subject.label, chunk.index))
        return run_chunk(chunk)

    monkeypatch.setattr(answer, "run_chunk", counting)
    return found


def interrupted_after(chunks_: int) -> Progress:
    def stop(standing: CampaignProgress) -> None:
        if standing.chunks_done >= chunks_:
            raise KeyboardInterrupt

    return stop


def files(folder: Path) -> list[Path]:
    return sorted((folder / "chunks").glob("*/*"))


@pytest.mark.slow
def test_a_stores_report_is_the_one_of_a_single_run(undisturbed: str, tmp_path: Path) -> None:
    assert numbers(validate(ROBOTS, samples=SAMPLES, store=tmp_path)) == undisturbed
    assert numbers(stored(tmp_path)) == undisturbed


def test_what_is_there_is_not_redone(undisturbed: str, ran: list[tuple[str, int]], tmp_path: Path) -> None:
    first = validate(ROBOTS, samples=SAMPLES, store=tmp_path, progress=interrupted_after(2))
    assert first.interrupted
    assert stored(tmp_path).interrupted
    assert len(ran) == 2
    assert numbers(validate(ROBOTS, samples=SAMPLES, store=tmp_path)) == undisturbed
    assert len(ran) == len(set(ran)) == 7
    assert numbers(validate(ROBOTS, samples=SAMPLES, store=tmp_path)) == undisturbed
    assert len(ran) == 7


@pytest.mark.slow
@pytest.mark.parametrize(
    ("how", "said"),
    [({"samples": 61}, "samples 60 and 61"), ({"seed": 1}, "seed 0 and 1"),
     ({"robots": ["ur5"]}, "number of robots 3 and 1"), ({"mimic": False}, "robot 1 planar_two_link (sha")],
)  # fmt: skip
def test_a_store_of_other_settings_is_refused_and_both_are_shown(how: Any, said: str, tmp_path: Path) -> None:
    validate(ROBOTS, samples=SAMPLES, store=tmp_path, progress=interrupted_after(1))
    with pytest.raises(InputError, match="belongs to another campaign") as error:
        validate(how.pop("robots", ROBOTS), store=tmp_path, **{"samples": SAMPLES, **how})
    assert said in str(error.value)


def test_changed_code_never_meets_old_results_and_its_digest_is_of_what_computes(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    validate(ROBOTS, samples=SAMPLES, store=tmp_path, progress=interrupted_after(1))
    before = Store.reading(tmp_path, pytest.fail).manifest
    changed = results.provenance() | {"code": "0" * 64}
    monkeypatch.setattr(manifest, "provenance", lambda: changed)
    with pytest.raises(InputError, match=r"code \w{12} and 000000000000"):
        validate(ROBOTS, samples=SAMPLES, store=tmp_path)
    after = replace(before, provenance=changed)
    assert {before.key(0, i) for i in range(2)}.isdisjoint(after.key(0, i) for i in range(2))
    package = tmp_path / "package"
    for place in ("kinematics/equations.py", "cli/validate.py", "urdf/lint/rules/joints.toml"):
        (package / place).parent.mkdir(parents=True)
        (package / place).write_text("1")
    monkeypatch.setattr(results, "_PACKAGE", package)
    digest = results._code()
    (package / "cli" / "validate.py").write_text("2")
    assert results._code() == digest
    for place in ("kinematics/equations.py", "urdf/lint/rules/joints.toml"):
        (package / place).write_text("2")
        assert results._code() != digest
        digest = results._code()


def test_a_changed_file_is_not_taken_for_what_it_was_and_another_folder_is_left_alone(tmp_path: Path) -> None:
    robot = tmp_path / "a.urdf"
    robot.write_text('<robot name="a"><link name="l"/></robot>')
    old = subject(str(robot))
    robot.write_text('<robot name="b"><link name="l"/></robot>')
    for ask in (old.read, old.carried):
        with pytest.raises(InputError, match="has changed since the validation began"):
            ask()
    assert subject(str(robot)).carried().read().name == "b"
    (tmp_path / "thesis.tex").write_text("")
    with pytest.raises(InputError, match="not empty and is not a store"):
        validate("ur5", samples=0, store=tmp_path)
    with pytest.raises(SourceError):
        stored(tmp_path)


def test_what_failed_is_tried_again_when_asked_for_and_may_be_another_text(tmp_path: Path) -> None:
    good, bad = tmp_path / "good.urdf", tmp_path / "bad.urdf"
    good.write_text('<robot name="a"><link name="l"/></robot>')
    bad.write_text("<robot/>")
    robots, store = [str(good), str(bad)], tmp_path / "store"
    assert validate(robots, samples=0, store=store).robots[1].verdict == ValidationVerdict.BAD_INPUT
    bad.write_text('<robot name="mended"><link name="l"/></robot>')
    with pytest.raises(InputError, match="another campaign"):
        validate(robots, samples=0, store=store)
    again = validate(robots, samples=0, store=store, retry="failed")
    assert [robot.name for robot in again.robots] == ["a", "mended"]
    assert again.passed
    assert numbers(stored(store)) == numbers(validate(robots, samples=0))
    good.write_text('<robot name="other"><link name="l"/></robot>')
    with pytest.raises(InputError, match="another campaign"):
        validate(robots, samples=0, store=store, retry="failed")


def test_what_the_machinery_lost_is_not_kept_as_the_robots_failure(
    monkeypatch: pytest.MonkeyPatch, undisturbed: str, tmp_path: Path
) -> None:
    broken = validate(ROBOTS, samples=SAMPLES, store=tmp_path, executor=Refusing(1, when_asked=True))
    assert broken.robots[0].verdict == ValidationVerdict.NOT_VERIFIED
    assert numbers(validate(ROBOTS, samples=SAMPLES, store=tmp_path)) == undisturbed


# -- damage ------------------------------------------------------------------------------------------


def result() -> ChunkResult:
    (chunk,) = chunks(subject("planar_two_link"), 0, 0)
    return run_chunk(chunk)


def test_an_answer_is_read_back_to_the_last_bit() -> None:
    found = result()
    odd: Any = {"worst": float("inf"), "by_frame": (0.1 + 0.2, 5e-324, float("inf"))}
    tallies = {key: replace(tally, **odd) for key, tally in found.tallies.items()}
    other = replace(found, tallies=tallies, summary=None)
    for each in (found, other, Failure(ValidationVerdict.BAD_INPUT, "no \ud800")):
        again = decode_answer("k", encode_answer("k", each))
        assert json.dumps(_plain(again)) == json.dumps(_plain(each))


def _plain(found: Answer) -> Any:
    data = asdict(found)
    if isinstance(found, ChunkResult):
        data["tallies"] = [(*key, asdict(tally)) for key, tally in found.tallies.items()]
    return data


@pytest.mark.parametrize(
    "forge",
    [
        lambda body: body.pop("result"),
        lambda body: body["result"].update(samples="many"),
        lambda body: body["result"].update(timings=None),
        lambda body: body["tallies"][0].pop(),
        lambda body: body["tallies"][0][1].update(worst="small"),
        lambda body: body["result"]["summary"]["model"].pop("joints"),
        lambda body: body["result"]["summary"]["chains"][0].update(samples=-1),
        lambda body: body.update(failure={"verdict": "fine", "reason": "none"}),
    ],
)
def test_a_chunk_of_another_layout_is_damaged_though_its_checksum_is_right(forge: Any) -> None:
    body = unpack("k", encode_answer("k", result()))
    forge(body)
    with pytest.raises(DamagedError, match="not a chunk of urdfkin"):
        decode_answer("k", pack("k", body))


def test_no_byte_of_a_chunk_can_be_changed_or_cut_off_unnoticed() -> None:
    whole = encode_answer("k", Failure(ValidationVerdict.BAD_INPUT, "why"))
    for place in range(len(whole)):
        for bit in (1, 128):
            damaged = bytearray(whole)
            damaged[place] ^= bit
            with pytest.raises(DamagedError):
                decode_answer("k", bytes(damaged))
        with pytest.raises(DamagedError):
            decode_answer("k", whole[:place])
    with pytest.raises(DamagedError, match="another chunk"):
        decode_answer("other", whole)
    with pytest.raises(DamagedError):
        decode_answer("k", whole + b"\0")


@pytest.mark.slow
def test_a_damaged_store_is_reported_and_made_whole(undisturbed: str, tmp_path: Path) -> None:
    validate(ROBOTS, samples=SAMPLES, store=tmp_path)
    there = files(tmp_path)
    second, third = (place.read_bytes() for place in there[1:3])
    cut, changed = second[: len(second) // 2], third[: len(third) // 2] + b"x" + third[len(third) // 2 + 1 :]
    for place, content in zip(there, (b"", cut, changed, there[5].read_bytes()), strict=False):
        place.write_bytes(content)
    with pytest.warns(StoreWarning, match="is damaged and is computed again: ") as told:
        partly = stored(tmp_path)
    assert len(told) == 4
    assert partly.interrupted or partly.robots[1].verdict == ValidationVerdict.NOT_VERIFIED
    with pytest.warns(StoreWarning, match="is damaged and is computed again: "):
        assert numbers(validate(ROBOTS, samples=SAMPLES, store=tmp_path)) == undisturbed
    assert numbers(stored(tmp_path)) == undisturbed
    assert len(list((tmp_path / "damaged").iterdir())) == 4


@pytest.mark.slow
def test_a_renamed_chunk_is_reported_and_put_aside(undisturbed: str, tmp_path: Path) -> None:
    validate(ROBOTS, samples=SAMPLES, store=tmp_path)
    first, second, third, *_ = files(tmp_path)
    first.rename(first.with_name("copy of it.chunk"))
    second.rename(second.with_suffix(".old"))
    third.rename(third.parents[1] / first.parent.name / third.name)
    with pytest.warns(StoreWarning, match="no chunk of this campaign has this name") as told:
        assert stored(tmp_path).interrupted
    assert len(told) == 3
    with pytest.warns(StoreWarning, match="no chunk of this campaign has this name") as told:
        assert numbers(validate(ROBOTS, samples=SAMPLES, store=tmp_path)) == undisturbed
    assert len(told) == 3
    assert len(list((tmp_path / "damaged").iterdir())) == 3
    assert numbers(stored(tmp_path)) == undisturbed


OTHER = "not a file with the layout urdfkin-campaign/1"
MANIFESTS = {
    b"": "not a JSON file", b"\xff": "not a JSON file", b"{}": OTHER, b"[]": OTHER, b"null": OTHER,
    b'{"schema": "urdfkin-campaign/2"}': "unknown version of the layout urdfkin-campaign",
    b'{"schema": "urdfkin-campaign/1"}': r"does not conform to the layout .*: found \$: .*`robots`",
}  # fmt: skip


@pytest.mark.parametrize("content", MANIFESTS)
def test_a_manifest_that_is_none_is_refused(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "manifest.json").write_bytes(content)
    for ask in (stored, lambda store: validate("ur5", samples=0, store=store)):
        with pytest.raises(InputError, match=MANIFESTS[content]):
            ask(tmp_path)


@pytest.mark.parametrize(
    ("entry", "value"),
    [("samples", "10"), ("seed", 0.5), ("provenance", {"pin": 4}), ("robots", [["arm.urdf", "0" * 64]]),
     ("robots", [[{"source": "arm.urdf", "mimic": 1}, ""]]), ("started", None)],
)  # fmt: skip
def test_a_tampered_manifest_is_refused_with_the_place(entry: str, value: object, tmp_path: Path) -> None:
    validate("planar_two_link", samples=0, store=tmp_path)
    place = tmp_path / "manifest.json"
    place.write_text(json.dumps(json.loads(place.read_text()) | {entry: value}))
    words = rf"manifest.json: does not conform .* found \$\.{entry}.*write it again"
    with pytest.raises(InputError, match=words):
        stored(tmp_path)


# -- parts -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("robots", "samples", "parts"), [(1, 1000, 3), (7, 60, 4), (2, 0, 5), (68, 1000, 9)])
def test_the_parts_cover_everything_once(robots: int, samples: int, parts: int) -> None:
    cut = Cut(samples)
    dealt = [chunks_of_shard(robots, cut, f"{i + 1}/{parts}") for i in range(parts)]
    for robot in range(robots):
        assert [i for part in dealt for i in part[robot]] == list(range(len(cut)))
    sizes = [sum(map(len, part)) for part in dealt]
    assert max(sizes) - min(sizes) <= 1


@pytest.mark.parametrize("word", ["0/4", "5/4", "1", "a/b", "1/0", "-1/4", "1/4/2", " 1/4"])
def test_what_is_no_part_is_refused(word: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="must have the form i/n"):
        validate("ur5", samples=0, store=tmp_path, shard=word)


def test_parts_from_several_machines_merge_to_the_report_of_one_run(undisturbed: str, tmp_path: Path) -> None:
    for i in (1, 2, 3):
        part = validate(ROBOTS, samples=SAMPLES, store=tmp_path / str(i), shard=f"{i}/3")
        assert {robot.verdict for robot in part.robots} <= {
            ValidationVerdict.VERIFIED,
            ValidationVerdict.BAD_INPUT,
        }
    whole = tmp_path / "whole"
    early = run("report merge", str(whole), str(tmp_path / "1"), str(tmp_path / "3"))
    assert "chunks missing" in early.text
    assert stored(whole).interrupted
    merged = run("report merge", str(whole), *(str(tmp_path / str(i)) for i in (1, 2, 3)))
    assert merged.text.endswith("complete\n"), merged.err
    assert numbers(stored(whole)) == undisturbed


def test_parts_may_share_a_folder_and_begin_at_the_same_time(undisturbed: str, tmp_path: Path) -> None:
    for i in (2, 1, 3):
        validate(ROBOTS, samples=SAMPLES, store=tmp_path, shard=f"{i}/3")
    assert numbers(stored(tmp_path)) == undisturbed
    # the second comes after the first has its lock, and before it has written what the campaign is
    other = tmp_path / "other"
    (other / ".writing" / "1-of-2").mkdir(parents=True)
    (other / "lock-1-of-2").touch()
    assert validate("planar_two_link", samples=0, store=other, shard="1/1").passed


@pytest.mark.parametrize(("samples", "cuts"), [(60, (1, 2, 3)), (1000, (1, 5, 40))])
def test_samples_do_not_depend_on_the_cut(samples: int, cuts: tuple[int, ...], monkeypatch: Any) -> None:
    tree = subject("ur5").load().tree
    drawn = []
    for draws in cuts:
        monkeypatch.setattr(Cut, "_draws", draws)
        each = [chunk.draw(tree) for chunk in chunks(subject("ur5"), samples, 3)]
        drawn.append(np.concatenate([np.hstack((x.q, x.v, x.a)) for x in each]))
    assert all(np.array_equal(drawn[0], other) for other in drawn)
    assert len(drawn[0]) == samples + 3


# -- memory ------------------------------------------------------------------------------------------


def _peak(chunks_: int) -> int:
    """Bytes at most while so many chunks of a robot are gathered, none in its turn."""
    found, robot = result(), subject("planar_two_link")
    found = replace(found, tallies=dict(list(found.tallies.items())[:2]))
    cut = Cut(1000 * chunks_)
    assert len(cut) == chunks_
    gathering = ResultCollector([robot], cut, [range(chunks_)])
    pairs = ((i + 1, i) for i in range(0, chunks_, 2))
    gc.collect()
    tracemalloc.start()
    for index in itertools.chain.from_iterable(pairs):
        task = Task(0, cut.chunk(robot, 0, index))
        gathering.enter(task, replace(found, samples=task.chunk.configurations))
        if index % 1000 == 0:  # else the peak depends on when the collector runs
            gc.collect()
    (report,) = gathering.reports()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert report.verdict == ValidationVerdict.VERIFIED
    return peak


@pytest.mark.slow
def test_memory_does_not_grow_with_samples() -> None:
    assert _peak(10_000) < _peak(10) + 500_000  # what the collector has not come to; held, it were 100 MB


def test_neighbours_add_up_in_any_order() -> None:
    all_chunks = list(chunks(subject("planar_two_link"), 60, 0))
    results = [run_chunk(chunk) for chunk in all_chunks]
    reports = set()
    for order in itertools.permutations(range(3)):
        gathering = ResultCollector([all_chunks[0].subject], Cut(60), [range(len(results))])
        for i in order:
            gathering.enter(Task(0, all_chunks[i]), results[i])
        (report,) = gathering.reports()
        data = {k: v for k, v in report.as_dict().items() if k not in ("seconds", "timings")}
        reports.add(json.dumps(data))
    assert len(reports) == 1


# -- processes that end, discs that are full, two at once --------------------------------------------

_COMMAND = [sys.executable, "-m", "urdfkin", "validate", *ROBOTS, "--samples", str(SAMPLES), "--store"]


def _run(folder: Path, *words: str, **how: Any) -> subprocess.CompletedProcess[str]:
    command = [*_COMMAND, str(folder), *words]
    return subprocess.run(command, capture_output=True, text=True, check=False, **how)


@pytest.mark.long
def test_a_client_killed_at_any_time_loses_nothing_that_was_kept(undisturbed: str, tmp_path: Path) -> None:
    """Killed by SIGKILL at random times, again and again, until one gets through."""
    rng, seen = np.random.default_rng(20), 0
    quiet: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    for _ in range(4):
        with subprocess.Popen([*_COMMAND, str(tmp_path / "s")], **quiet) as process:
            deadline = time.monotonic() + 60
            while len(files(tmp_path / "s")) <= seen and process.poll() is None:
                assert time.monotonic() < deadline
                time.sleep(0.01)
            time.sleep(rng.uniform(0.0, 0.05))
            process.kill()
        assert len(files(tmp_path / "s")) > seen or process.returncode == 2
        seen = len(files(tmp_path / "s"))
    assert _run(tmp_path / "s").returncode == 2
    assert numbers(stored(tmp_path / "s")) == undisturbed


@pytest.mark.long
def test_a_full_disc_is_said_and_what_was_kept_is_gone_on_with(undisturbed: str, tmp_path: Path) -> None:
    """No file may become longer than one that holds a failure, but not a result."""

    def limit() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (2500, 2500))

    full = _run(tmp_path / "s", preexec_fn=limit)
    assert full.returncode == 3, full.stderr
    words = "the store cannot be written: found File too large; free some disk space"
    assert words in " ".join(full.stdout.split())
    assert numbers(validate(ROBOTS, samples=SAMPLES, store=tmp_path / "s")) == undisturbed


@pytest.mark.long
def test_a_second_client_is_refused_and_told_who_is_at_work(tmp_path: Path) -> None:
    refused = list[str]()

    def second(_: object) -> None:
        if not refused:
            refused.append(_run(tmp_path).stderr)

    assert not validate(ROBOTS, samples=SAMPLES, store=tmp_path, progress=second).interrupted
    assert "another process uses this store: found process " in refused[0]


@pytest.mark.long
def test_two_clients_that_begin_at_one_time_leave_what_one_would(undisturbed: str, tmp_path: Path) -> None:
    how: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, "text": True}
    both = [subprocess.Popen([*_COMMAND, str(tmp_path / "s")], **how) for _ in range(2)]
    said = [process.communicate()[1] for process in both]
    assert sum("another process uses this store" in err for err in said) <= 1
    assert numbers(stored(tmp_path / "s")) == undisturbed


def test_a_clock_that_is_set_back_changes_nothing(
    undisturbed: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    validate(ROBOTS, samples=SAMPLES, store=tmp_path, progress=interrupted_after(2))
    monkeypatch.setattr(time, "time", lambda: 0.0)
    for place in files(tmp_path):
        os.utime(place, (4e9, 4e9))
    assert numbers(validate(ROBOTS, samples=SAMPLES, store=tmp_path)) == undisturbed


def test_status_says_what_is_done_what_failed_and_what_is_left(tmp_path: Path) -> None:
    validate(ROBOTS, samples=SAMPLES, store=tmp_path, progress=interrupted_after(5))
    found = run("report status", str(tmp_path))
    assert found.code == 3
    assert "robots: 2 of 3 done, 1 of them failed" in found.text
    assert "chunks: 3 done, 3 missing" in found.text
    assert "failed: 'no such robot': " in found.text
    assert "on one processor" in found.text
    assert "no process is running" in found.text
    validate(ROBOTS, samples=SAMPLES, store=tmp_path)
    assert "chunks: 6 done, 0 missing" in run("report status", str(tmp_path)).text


def test_a_campaign_of_a_robot_from_another_format_is_resumed(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    arm = tmp_path / "arm.xml"
    arm.write_text(
        '<mujoco model="arm"><worldbody><body name="upper">'
        '<joint name="shoulder" type="hinge" axis="0 0 1" range="-1 1"/>'
        '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><body name="tip" pos="1 0 0"/>'
        "</body></worldbody></mujoco>"
    )
    first, again = (validate(str(arm), samples=2, store=tmp_path / "store") for _ in range(2))
    assert (first.passed, again.passed) == (True, True)
