"""A store resumes an interrupted run, detects damaged files, and gives the report of one run."""

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
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.attacks.test_validation_runs import Refusing, chunks
from tests.cli.running import refused
from tests.cli.running import urdfkin as run
from tests.reading import present
from urdfkin.errors import InputError, SourceError
from urdfkin.validation import answer, results
from urdfkin.validation.answer import (
    Answer,
    DamagedError,
    Failure,
    decode_answer,
    encode_answer,
    pack,
    unpack,
)
from urdfkin.validation.campaign import StoreWarning, chunks_of_shard, read_stored_report, validate
from urdfkin.validation.chunk import Chunk, Chunking, ChunkResult, run_chunk
from urdfkin.validation.collector import CampaignProgress, ResultCollector
from urdfkin.validation.document import ValidationVerdict
from urdfkin.validation.engines import Task
from urdfkin.validation.robot_input import make_robot_input
from urdfkin.validation.store import Store, open_store

ROBOTS = ["planar_two_link", "no such robot", "double_pendulum"]
SAMPLES = 60


def numbers(report: Any) -> str:
    """Return a report's document without times."""
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
    """The computed chunks, by robot and index."""
    found: list[tuple[str, int]] = []

    def counting(chunk: Chunk) -> ChunkResult:
        found.append((chunk.robot_input.label, chunk.index))
        return run_chunk(chunk)

    monkeypatch.setattr(answer, "run_chunk", counting)
    return found


def run_all(store: Path, **how: Any) -> Any:
    return validate(ROBOTS, **{"samples": SAMPLES, "store": store, **how})


def interrupt(store: Path, chunks_: int = 1) -> Any:
    def stop(state: CampaignProgress) -> None:
        if state.chunks_done >= chunks_:
            raise KeyboardInterrupt

    return run_all(store, progress=stop)


def robot_file(path: Path, name: str) -> Path:
    path.write_text(f'<robot name="{name}"><link name="l"/></robot>')
    return path


def files(folder: Path) -> list[Path]:
    return sorted((folder / "chunks").glob("*/*"))


def test_a_resumed_run_computes_each_chunk_once_and_gives_the_report_of_one_run(
    undisturbed: str, ran: list[tuple[str, int]], tmp_path: Path
) -> None:
    assert interrupt(tmp_path, 2).interrupted
    assert read_stored_report(tmp_path).interrupted
    assert len(ran) == 2
    for _ in range(2):
        assert numbers(run_all(tmp_path)) == numbers(read_stored_report(tmp_path)) == undisturbed
        assert len(ran) == len(set(ran)) == 7


@pytest.mark.slow
@pytest.mark.parametrize(
    ("how", "message"),
    [({"samples": 61}, "samples 60 and 61"), ({"seed": 1}, "seed 0 and 1"),
     ({"robots": ["ur5"]}, "number of robots 3 and 1"), ({"mimic": False}, "robot 1 planar_two_link (sha")],
)  # fmt: skip
def test_a_store_of_other_settings_is_refused_with_both_values(
    how: Any, message: str, tmp_path: Path
) -> None:
    interrupt(tmp_path)
    with pytest.raises(InputError, match="belongs to another campaign") as error:
        validate(how.pop("robots", ROBOTS), store=tmp_path, **{"samples": SAMPLES, **how})
    assert message in str(error.value)


def test_changed_code_reuses_no_result_and_the_digest_covers_all_code_that_computes(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    interrupt(tmp_path)
    before = Store.open_read_only(tmp_path, pytest.fail).manifest
    changed = results.provenance() | {"code": "0" * 64}
    monkeypatch.setattr("urdfkin.validation.store.provenance", lambda: changed)
    with pytest.raises(InputError, match=r"code \w{12} and 000000000000"):
        run_all(tmp_path)
    after = replace(before, provenance=changed)
    assert {before.key(0, i) for i in range(2)}.isdisjoint(after.key(0, i) for i in range(2))
    package = tmp_path / "package"
    for place in ("kinematics/equations.py", "cli/validate.py", "urdf/lint/rules/joints.toml"):
        (package / place).parent.mkdir(parents=True)
        (package / place).write_text("1")
    monkeypatch.setattr(results, "_PACKAGE_FOLDER", package)
    digest = results._digest_code()
    (package / "cli" / "validate.py").write_text("2")
    assert results._digest_code() == digest
    for place in ("kinematics/equations.py", "urdf/lint/rules/joints.toml"):
        (package / place).write_text("2")
        assert results._digest_code() != digest
        digest = results._digest_code()


def test_a_changed_file_is_an_error_and_a_folder_with_other_files_is_refused(tmp_path: Path) -> None:
    robot = robot_file(tmp_path / "a.urdf", "a")
    old = make_robot_input(str(robot))
    robot_file(robot, "b")
    for read in (old.make_robot, old.with_text):
        with pytest.raises(InputError, match="has changed since the validation began"):
            read()
    assert make_robot_input(str(robot)).with_text().make_robot().name == "b"
    (tmp_path / "thesis.tex").write_text("")
    with pytest.raises(InputError, match="not empty and is not a store"):
        validate("ur5", samples=0, store=tmp_path)
    with pytest.raises(SourceError):
        read_stored_report(tmp_path)


def test_a_failed_robot_is_retried_on_request_with_a_changed_text(tmp_path: Path) -> None:
    good, bad = robot_file(tmp_path / "good.urdf", "a"), tmp_path / "bad.urdf"
    bad.write_text("<robot/>")
    robots, store = [str(good), str(bad)], tmp_path / "store"
    assert validate(robots, samples=0, store=store).robots[1].verdict == ValidationVerdict.BAD_INPUT
    robot_file(bad, "mended")
    with pytest.raises(InputError, match="with --retry failed, the file of a failed robot may differ"):
        validate(robots, samples=0, store=store)
    again = validate(robots, samples=0, store=store, retry="failed")
    assert [robot.name for robot in again.robots] == ["a", "mended"]
    assert again.passed
    assert numbers(read_stored_report(store)) == numbers(validate(robots, samples=0))
    robot_file(good, "other")
    with pytest.raises(InputError, match="another campaign"):
        validate(robots, samples=0, store=store, retry="failed")


def test_a_shard_that_retries_keeps_the_failures_of_other_shards(tmp_path: Path) -> None:
    robots = ["planar_two_link", "no such robot"]
    for shard in ("1/2", "2/2"):
        validate(robots, samples=SAMPLES, store=tmp_path, shard=shard)
    validate(robots, samples=SAMPLES, store=tmp_path, shard="1/2", retry="failed")
    report = read_stored_report(tmp_path)
    assert not report.interrupted
    assert report.robots[1].verdict == ValidationVerdict.BAD_INPUT


def test_a_shard_that_retries_deletes_all_failures_of_a_changed_file(tmp_path: Path) -> None:
    robots, store = [str(tmp_path / "bad.urdf")], tmp_path / "store"
    Path(robots[0]).write_text("<robot/>")
    for shard in ("1/2", "2/2"):
        validate(robots, samples=60, store=store, shard=shard)
    robot_file(tmp_path / "bad.urdf", "mended")
    for shard in ("1/2", "2/2"):
        validate(robots, samples=60, store=store, shard=shard, retry="failed")
    assert read_stored_report(store).passed
    assert not (store / "damaged").exists()


def test_a_failure_of_the_executor_is_not_stored_as_a_failure_of_the_robot(
    undisturbed: str, tmp_path: Path
) -> None:
    broken = run_all(tmp_path, executor=Refusing(1, when_asked=True))
    assert broken.robots[0].verdict == ValidationVerdict.NOT_VERIFIED
    assert numbers(run_all(tmp_path)) == undisturbed


# -- damage ------------------------------------------------------------------------------------------


def result() -> ChunkResult:
    (chunk,) = chunks(make_robot_input("planar_two_link"), 0, 0)
    return run_chunk(chunk)


def test_a_stored_answer_of_a_worker_is_read_back_exactly() -> None:
    found = result()
    odd: Any = {"worst": float("inf"), "worst_by_frame": (0.1 + 0.2, 5e-324, float("inf"))}
    error_stats = {key: replace(stats, **odd) for key, stats in found.error_stats.items()}
    other = replace(found, error_stats=error_stats, summary=None)
    for each in (found, other, Failure(ValidationVerdict.BAD_INPUT, "no \ud800")):
        again = decode_answer("k", encode_answer("k", each))
        assert json.dumps(_plain(again)) == json.dumps(_plain(each))


def _plain(found: Answer) -> Any:
    data = asdict(found)
    if isinstance(found, ChunkResult):
        data["error_stats"] = [(*key, asdict(stats)) for key, stats in found.error_stats.items()]
    return data


@pytest.mark.parametrize(
    "forge",
    [
        lambda body: body.pop("result"),
        lambda body: body["result"].update(samples="many"),
        lambda body: body["result"].update(timings=None),
        lambda body: body["error_stats"][0].pop(),
        lambda body: body["error_stats"][0][1].update(worst="small"),
        lambda body: body["result"]["summary"]["model"].pop("joints"),
        lambda body: body["result"]["summary"]["chains"][0].update(samples=-1),
        lambda body: body.update(failure={"verdict": "fine", "reason": "none"}),
    ],
)
def test_a_chunk_of_another_layout_is_damaged_even_with_a_right_checksum(forge: Any) -> None:
    body = unpack("k", encode_answer("k", result()))
    forge(body)
    with pytest.raises(DamagedError, match="not a chunk of urdfkin"):
        decode_answer("k", pack("k", body))


def test_every_changed_or_missing_byte_of_a_chunk_is_detected() -> None:
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
def test_damaged_files_are_reported_and_computed_again(undisturbed: str, tmp_path: Path) -> None:
    run_all(tmp_path)
    there = files(tmp_path)
    second, third = (place.read_bytes() for place in there[1:3])
    cut, changed = second[: len(second) // 2], third[: len(third) // 2] + b"x" + third[len(third) // 2 + 1 :]
    for place, content in zip(there, (b"", cut, changed, there[5].read_bytes()), strict=False):
        place.write_bytes(content)
    mend(tmp_path, "is damaged and is computed again: ", 4, undisturbed)


@pytest.mark.slow
def test_renamed_files_are_reported_and_their_chunks_computed_again(undisturbed: str, tmp_path: Path) -> None:
    run_all(tmp_path)
    first, second, third, *_ = files(tmp_path)
    first.rename(first.with_name("copy of it.chunk"))
    second.rename(second.with_suffix(".old"))
    third.rename(third.parents[1] / first.parent.name / third.name)
    mend(tmp_path, "no chunk of this campaign has this name", 3, undisturbed)


def mend(store: Path, message: str, count: int, undisturbed: str) -> None:
    """Read and resume a damaged store; each damaged file is reported and moved to `damaged`."""
    with pytest.warns(StoreWarning, match=message) as told:
        report = read_stored_report(store)
    assert len(told) == count
    assert report.interrupted or report.robots[1].verdict == ValidationVerdict.NOT_VERIFIED
    with pytest.warns(StoreWarning, match=message) as told:
        assert numbers(run_all(store)) == undisturbed
    assert len(told) == count
    assert numbers(read_stored_report(store)) == undisturbed
    assert len(list((store / "damaged").iterdir())) == count


OTHER = "not a file with the layout urdfkin-campaign/1"
MANIFESTS = {
    b"": "not a JSON file", b"\xff": "not a JSON file", b"{}": OTHER, b"[]": OTHER, b"null": OTHER,
    b'{"schema": "urdfkin-campaign/2"}': "unknown version of the layout urdfkin-campaign",
    b'{"schema": "urdfkin-campaign/1"}': r"does not conform to the layout .*: found \$: .*`robots`",
}  # fmt: skip


@pytest.mark.parametrize("content", MANIFESTS)
def test_a_file_that_is_no_manifest_is_refused(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "manifest.json").write_bytes(content)
    for use in (read_stored_report, lambda store: validate("ur5", samples=0, store=store)):
        with pytest.raises(InputError, match=MANIFESTS[content]):
            use(tmp_path)


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
        read_stored_report(tmp_path)


# -- shards ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("robots", "samples", "count"), [(1, 1000, 3), (7, 60, 4), (2, 0, 5), (68, 1000, 9)])
def test_equal_shards_contain_each_chunk_once(robots: int, samples: int, count: int) -> None:
    cut = Chunking(samples)
    shards = [chunks_of_shard(robots, cut, f"{i + 1}/{count}") for i in range(count)]
    for robot in range(robots):
        assert [i for shard in shards for i in shard[robot]] == list(range(len(cut)))
    sizes = [sum(map(len, shard)) for shard in shards]
    assert max(sizes) - min(sizes) <= 1


@pytest.mark.parametrize("word", ["0/4", "5/4", "1", "a/b", "1/0", "-1/4", "1/4/2", " 1/4"])
def test_an_invalid_shard_specification_is_refused(word: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="must have the form i/n"):
        validate("ur5", samples=0, store=tmp_path, shard=word)


def test_shards_of_several_machines_can_be_merged_to_the_report_of_one_run(
    undisturbed: str, tmp_path: Path
) -> None:
    for i in (1, 2, 3):
        part = run_all(tmp_path / str(i), shard=f"{i}/3")
        assert {robot.verdict for robot in part.robots} <= {"verified", "bad input"}
    whole = tmp_path / "whole"
    early = run("report merge", str(whole), str(tmp_path / "1"), str(tmp_path / "3"))
    assert "chunks missing" in early.text
    assert read_stored_report(whole).interrupted
    merged = run("report merge", str(whole), *(str(tmp_path / str(i)) for i in (1, 2, 3)))
    assert merged.text.endswith("complete\n"), merged.err
    assert numbers(read_stored_report(whole)) == undisturbed


def test_shards_may_share_a_folder_and_begin_at_the_same_time(undisturbed: str, tmp_path: Path) -> None:
    for i in (2, 1, 3):
        run_all(tmp_path, shard=f"{i}/3")
    assert numbers(read_stored_report(tmp_path)) == undisturbed
    # another shard has locked the store, but has not yet written the manifest
    other = tmp_path / "other"
    (other / ".writing" / "1-of-2").mkdir(parents=True)
    (other / "lock-1-of-2").touch()
    assert validate("planar_two_link", samples=0, store=other, shard="1/1").passed


@pytest.mark.parametrize(("samples", "cuts"), [(60, (1, 2, 3)), (1000, (1, 5, 40))])
def test_samples_do_not_depend_on_the_size_of_the_chunks(
    samples: int, cuts: tuple[int, ...], monkeypatch: Any
) -> None:
    tree = make_robot_input("ur5").load().tree
    drawn = []
    for draws in cuts:
        monkeypatch.setattr(Chunking, "_draws_per_chunk", draws)
        each = [chunk.draw(tree) for chunk in chunks(make_robot_input("ur5"), samples, 3)]
        drawn.append(np.concatenate([np.hstack((x.q, x.v, x.a)) for x in each]))
    assert all(np.array_equal(drawn[0], other) for other in drawn)
    assert len(drawn[0]) == samples + 3


# -- memory ------------------------------------------------------------------------------------------


def _peak(chunks_: int) -> int:
    """Return the peak memory while the chunks of a robot are collected, each pair in reverse order."""
    found, robot = result(), make_robot_input("planar_two_link")
    found = replace(found, error_stats=dict(list(found.error_stats.items())[:2]))
    cut = Chunking(1000 * chunks_)
    assert len(cut) == chunks_
    collector = ResultCollector([robot], cut, [range(chunks_)])
    pairs = ((i + 1, i) for i in range(0, chunks_, 2))
    gc.collect()
    tracemalloc.start()
    for index in itertools.chain.from_iterable(pairs):
        task = Task(0, cut.make_chunk(robot, 0, index))
        collector.add(task, replace(found, samples=task.chunk.configuration_count))
        if index % 1000 == 0:  # otherwise, the peak depends on the garbage collector
            gc.collect()
    (report,) = collector.make_reports()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert report.verdict == ValidationVerdict.VERIFIED
    return peak


@pytest.mark.slow
def test_memory_does_not_grow_with_samples() -> None:
    assert _peak(10_000) < _peak(10) + 500_000  # all results together have 100 MB


def test_the_sum_of_chunks_does_not_depend_on_the_order_of_arrival() -> None:
    all_chunks = list(chunks(make_robot_input("planar_two_link"), 60, 0))
    results = [run_chunk(chunk) for chunk in all_chunks]
    reports = set()
    for order in itertools.permutations(range(3)):
        collector = ResultCollector([all_chunks[0].robot_input], Chunking(60), [range(len(results))])
        for i in order:
            collector.add(Task(0, all_chunks[i]), results[i])
        (report,) = collector.make_reports()
        data = {k: v for k, v in report.as_dict().items() if k not in ("seconds", "timings")}
        reports.add(json.dumps(data))
    assert len(reports) == 1


def test_the_progress_counts_a_robot_that_another_parser_reads_differently() -> None:
    (chunk,) = chunks(make_robot_input("planar_two_link"), 0, 0)
    found, states = run_chunk(chunk), list[CampaignProgress]()
    summary = present(found.summary)
    reading = present(summary.second_reader).copy()
    reading["differences"] = ["joint j: axis"]
    collector = ResultCollector([chunk.robot_input], Chunking(0), [range(1)], states.append)
    collector.add(Task(0, chunk), replace(found, summary=replace(summary, second_reader=reading)))
    (report,) = collector.make_reports()
    assert (report.verdict, states[-1].failures) == (ValidationVerdict.DISAGREES, 1)


# -- killed processes, a full disk, two processes at once --------------------------------------------

_COMMAND = [sys.executable, "-m", "urdfkin", "validate", *ROBOTS, "--samples", str(SAMPLES), "--store"]


def _run(folder: Path, *words: str, **how: Any) -> subprocess.CompletedProcess[str]:
    command = [*_COMMAND, str(folder), *words]
    return subprocess.run(command, capture_output=True, text=True, check=False, **how)


@pytest.mark.long
def test_a_process_killed_at_random_times_loses_no_stored_chunk(undisturbed: str, tmp_path: Path) -> None:
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
    assert numbers(read_stored_report(tmp_path / "s")) == undisturbed


@pytest.mark.long
def test_a_full_disk_is_reported_and_the_stored_chunks_are_reused(undisturbed: str, tmp_path: Path) -> None:
    def limit() -> None:
        """Limit the size of files: the file of a failure is smaller, the file of a result is larger."""
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (2500, 2500))

    full = _run(tmp_path / "s", preexec_fn=limit)
    assert full.returncode == 3, full.stderr
    words = "the store cannot be written: found File too large; free some disk space, and"
    assert words in " ".join(full.stdout.split())
    assert numbers(run_all(tmp_path / "s")) == undisturbed


@pytest.mark.long
def test_a_second_process_is_refused_with_the_id_of_the_first(tmp_path: Path) -> None:
    second = cache(lambda: _run(tmp_path).stderr)
    assert not run_all(tmp_path, progress=lambda _: second()).interrupted
    assert "another process uses this store: found process " in second()


@pytest.mark.long
def test_two_processes_that_begin_together_give_the_report_of_one(undisturbed: str, tmp_path: Path) -> None:
    how: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, "text": True}
    both = [subprocess.Popen([*_COMMAND, str(tmp_path / "s")], **how) for _ in range(2)]
    errors = [process.communicate()[1] for process in both]
    assert sum("another process uses this store" in error for error in errors) <= 1
    assert numbers(read_stored_report(tmp_path / "s")) == undisturbed


def test_a_clock_that_is_set_back_changes_no_result(
    undisturbed: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    interrupt(tmp_path, 2)
    monkeypatch.setattr(time, "time", lambda: 0.0)
    for place in files(tmp_path):
        os.utime(place, (4e9, 4e9))
    assert numbers(run_all(tmp_path)) == undisturbed


def test_status_lists_finished_failed_and_missing_chunks(tmp_path: Path) -> None:
    interrupt(tmp_path, 5)
    found = run("report status", str(tmp_path))
    assert found.code == 3
    assert "robots: 2 of 3 done, 1 of them failed" in found.text
    assert "chunks: 3 done, 3 missing" in found.text
    assert "failed: 'no such robot': " in found.text
    assert "on one processor" in found.text
    assert "no process uses the store" in found.text
    run_all(tmp_path)
    assert "chunks: 6 done, 0 missing" in run("report status", str(tmp_path)).text


def test_status_reports_a_damaged_chunk_and_estimates_no_time_from_it(tmp_path: Path) -> None:
    interrupt(tmp_path, 1)
    (only,) = files(tmp_path)
    only.write_bytes(b"")
    found = run("report status", str(tmp_path))
    assert found.code == 3, found.err
    assert "is damaged and is computed again" in found.err
    assert "remaining: " not in found.text


def test_status_names_the_process_of_a_running_shard(tmp_path: Path) -> None:
    interrupt(tmp_path, 2)
    manifest = Store.open_read_only(tmp_path, print).manifest
    with open_store(tmp_path, manifest, print, shard="1/2"):
        found = run("report status", str(tmp_path)).text
    assert f"the store is in use by: process {os.getpid()} on " in found
    assert "no process uses the store" not in found
    assert "no process uses the store" in run("report status", str(tmp_path)).text


def test_stores_of_different_validations_are_not_merged(tmp_path: Path) -> None:
    first, second, whole = (str(tmp_path / name) for name in ("first", "second", "whole"))
    for folder, samples in ((first, 0), (second, 1)):
        validate("planar_two_link", samples=samples, store=folder)
    err = refused("report merge", whole, first, second)
    assert f"{first}: the store belongs to another campaign" in err
    assert f"(in the store, and in {second}) samples 0 and 1; merge only stores of one validation" in err
    assert not Path(whole).exists()


def test_status_prints_the_reason_of_a_failure_on_one_line(tmp_path: Path) -> None:
    bad = tmp_path / "bad.urdf"
    bad.write_text("<robot/>")
    validate(str(bad), samples=0, store=tmp_path / "store")
    line = next(
        line
        for line in run("report status", str(tmp_path / "store")).text.splitlines()
        if line.startswith("  failed: ")
    )
    assert "; run 'urdfkin explain" in line
    assert " error: " in line
    assert "\\n" not in line


def test_a_folder_that_is_not_a_store_is_refused_with_a_remedy(tmp_path: Path) -> None:
    for command in ("report", "report status"):
        err = refused(command, str(tmp_path))
        assert "this is not a folder with results of a validation: found no file manifest.json" in err
        assert "give the folder of `urdfkin validate --store DIR`" in err


def test_only_a_full_disk_gives_the_advice_to_free_disk_space(tmp_path: Path) -> None:
    interrupt(tmp_path, 2)
    with open_store(tmp_path, Store.open_read_only(tmp_path, print).manifest, print) as store:
        (tmp_path / "plain").write_text("")
        with pytest.raises(SourceError, match="correct the folder or its permissions, and repeat"):
            store.write("plain/file", b"")


@pytest.mark.slow
def test_a_stored_validation_of_a_robot_from_another_format_is_resumed(tmp_path: Path) -> None:
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
