"""The fuzzer makes the same mutants each time, survives its workers, and would notice what it looks for."""

import sys
from pathlib import Path

import pytest

import urdfkin
from scripts import fuzz
from scripts.fuzzing import GOOD
from scripts.fuzzing.judge import judge
from scripts.fuzzing.mutations import FAMILIES, mutant
from tests.diagnostics.cases.arm import arm, fixed

pytestmark = pytest.mark.slow


def test_a_mutant_depends_on_seed_and_number_alone() -> None:
    robots = fuzz.files()
    mutants = [mutant(0, number, robots) for number in range(50)]
    assert mutants == [mutant(0, number, robots) for number in range(50)]
    assert len({data for _, data in mutants}) > 45
    assert mutants != [mutant(1, number, robots) for number in range(50)]


@pytest.mark.slow
@pytest.mark.slow
def test_every_mutator_is_used_and_nearly_all_change_something() -> None:
    robots = fuzz.files()
    originals = {path.stem: path.read_bytes() for path in robots}
    used, changed = set(), 0
    for number in range(1000):
        what, data = mutant(5, number, robots)
        used |= set(what.split()[1:])
        changed += data != originals[what.split()[0]]
    assert used == {mutate.__name__.strip("_") for family in FAMILIES for mutate in family}
    assert changed > 950


@pytest.mark.parametrize(
    ("text", "word"),
    [
        (arm(), "verified"),
        (arm(axis='<axis xyz="0 0 0"/>'), "refused"),
        (arm(origin='<origin xyz="0\t0 1"/>'), "not verified, with a finding that says why"),
        (
            arm(
                follow='<mimic joint="j1" multiplier="1e300"/>',
                more='<link name="end"/>'
                + fixed("e", "tool", "end").replace("</j", '<origin xyz="1 0 0"/></j'),
            ),
            "too large to compute, with a finding",
        ),
    ],
)
def test_the_judge_tells_what_happened(text: str, word: str) -> None:
    outcome = judge(text.encode())
    assert outcome.word == word, outcome
    assert word in GOOD


def test_a_check_that_is_blind_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(urdfkin, "check", lambda data: [], raising=False)
    assert judge(arm(axis='<axis xyz="0 0 0"/>').encode()).word == "load refuses what check does not"
    assert judge(arm(origin='<origin xyz="0\t0 1"/>').encode()).word not in GOOD


def test_a_traceback_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(data: bytes) -> None:
        raise KeyError(data)

    monkeypatch.setattr(urdfkin, "check", fails, raising=False)
    assert judge(arm().encode()).word == "traceback: KeyError"


WORKER = "import os, sys, time; print('ready', flush=True); sys.stdin.readline(); {}"


@pytest.mark.parametrize(
    ("then", "word"),
    [("os._exit(11)", "kills the process"), ("os.abort()", "kills the process"), ("time.sleep(60)", "hangs")],
)
def test_a_worker_that_dies_or_hangs_is_an_outcome_and_is_replaced(then: str, word: str) -> None:
    worker = fuzz.Worker([sys.executable, "-c", WORKER.format(then)], timeout=1.0)
    for _ in range(2):
        assert worker.judge(0)[0] == word
    worker.stop()


@pytest.mark.slow
def test_a_short_run_finds_nothing(tmp_path: Path) -> None:
    counts = fuzz.fuzz(range(400), seed=20, jobs=1, timeout=60.0, keep=tmp_path)
    assert set(counts) <= set(GOOD), sorted(tmp_path.iterdir())
    assert sum(counts.values()) == 400
    assert counts["verified"] > 100
