"""The fuzzer makes the same mutants in each run, survives crashed workers, and detects planted errors."""

import os
import re
import time
from collections import Counter
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
import pinocchio
import pytest

import urdfkin
from scripts import fuzz
from scripts.fuzzing import PASSED, Case, Outcome, mjcf, robots
from scripts.fuzzing.evaluate import evaluate as evaluate_case
from scripts.fuzzing.mutations import FAMILIES, make_mutant
from tests.urdf.lint.cases.arm import arm, fixed
from urdfkin.compiled.prepared import PreparedFrame
from urdfkin.system.processes import run_python
from urdfkin.urdf.records import FURTHER_LIMITS
from urdfkin.verify import mjcf_check

pytestmark = pytest.mark.long


def evaluate(text: str) -> Outcome:
    return evaluate_case(Case("by hand", text.encode()))


def test_a_mutant_depends_only_on_seed_and_number() -> None:
    files = fuzz.find_small_files()
    mutants = [make_mutant(0, number, files) for number in range(50)]
    assert mutants == [make_mutant(0, number, files) for number in range(50)]
    assert len({each.data for each in mutants}) > 45
    assert mutants != [make_mutant(1, number, files) for number in range(50)]


@pytest.mark.parametrize("family", [*robots.FAMILIES, *mjcf.FAMILIES])
def test_a_robot_depends_only_on_seed_family_and_number(family: str) -> None:
    robot = mjcf.make_model if family in mjcf.FAMILIES else robots.make_robot
    made = [robot(0, family, number) for number in range(20)]
    assert made == [fuzz.make_case(0, family, number) for number in range(20)]
    assert len({each.data for each in made}) > 17
    assert made != [robot(1, family, number) for number in range(20)]


def test_the_random_robots_contain_every_unusual_content() -> None:
    made = {
        family: [robots.make_robot(3, family, number) for number in range(200)] for family in robots.FAMILIES
    }
    texts = {family: "".join(each.data.decode() for each in cases) for family, cases in made.items()}
    for name in (*robots.INTERNAL_NAMES, *robots.UNUSUAL_NAMES):
        assert f"name={quoteattr(name)}" in texts["names"], name
    for prefix in robots.PREFIXES:
        assert f"<{prefix}:" in texts["prefixes"], prefix
    assert "xmlns:drake=" in texts["prefixes"]
    for version in ("1.0", "1.1", "1.2"):
        assert f'version="{version}"' in texts["versions"]
    assert "quat_xyzw=" in texts["versions"]
    for limit in FURTHER_LIMITS:
        assert re.search(f'{limit}="(-1.0|-5e-324|inf|nan||1e400|0x10|1.0 )"', texts["versions"]), limit
    assert texts["mimic"].count("<mimic ") > 200
    assert {each.root_joint for each in made["roots"]} == {None, "floating", "planar"}
    for kind in robots.KINDS:
        assert all(f'type="{kind}"' in text for text in texts.values()), kind
    lengths = [abs(float(x)) for xyz in re.findall(r'xyz="([^"]*)"', texts["lengths"]) for x in xyz.split()]
    assert max(lengths) > 1e280
    assert min(x for x in lengths if x) < 1e-310


def test_the_robots_are_distributed_over_the_families() -> None:
    assert fuzz.list_cases(["mutants"], 3, 5) == [("mutants", 0), ("mutants", 1), ("mutants", 2)]
    assert fuzz.list_cases(["names", "roots"], 3, 3) == [("names", 0), ("roots", 0), ("names", 1)]


@pytest.mark.long
def test_every_mutation_is_used_and_nearly_all_change_the_file() -> None:
    files = [path for path in fuzz.find_small_files() if path.stat().st_size < 20_000]  # small files suffice
    originals = {path.stem: path.read_bytes() for path in files}
    used, changed = set(), 0
    for number in range(1000):
        made = make_mutant(5, number, files)
        used |= set(made.name.split()[1:])
        changed += made.data != originals[made.name.split()[0]]
    assert used == {how for family in FAMILIES for how in family}
    assert changed > 950


_END = '<link name="end"/>' + fixed("e", "tool", "end").replace("</j", '<origin xyz="1 0 0"/></j')
LARGE = arm(follow='<mimic joint="j1" multiplier="1e300"/>', more=_END)


@pytest.mark.parametrize(
    ("text", "word"),
    [
        (arm(), "verified"),
        (arm(axis='<axis xyz="0 0 0"/>'), "refused"),
        (arm(origin='<origin xyz="0\t0 1"/>'), "not verified; a finding states the reason"),
        (LARGE, "too large to compute; a finding states the reason"),
    ],
)
def test_the_outcome_of_a_robot_is_reported(text: str, word: str) -> None:
    outcome = evaluate(text)
    assert outcome.result == word, outcome
    assert word in PASSED


def test_a_check_without_findings_is_detected(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(urdfkin, "check", lambda data, **options: [], raising=False)
    assert evaluate(arm(axis='<axis xyz="0 0 0"/>')).result == "load refuses a file that check accepts"
    assert evaluate(arm(origin='<origin xyz="0\t0 1"/>')).result not in PASSED


def test_a_traceback_is_detected(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(data: bytes, **options: object) -> None:
        raise KeyError(data)

    monkeypatch.setattr(urdfkin, "check", fails, raising=False)
    assert evaluate(arm()).result == "traceback: KeyError"


def test_a_file_that_only_pinocchio_refuses_is_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuses(*arguments: object, **options: object) -> None:
        raise ValueError("no reason")

    monkeypatch.setattr(pinocchio, "buildModelFromXML", refuses)
    outcome = evaluate(arm())
    assert outcome.result == "Pinocchio refuses a file that check accepts"
    assert "no reason" in outcome.details
    assert "please report this" in outcome.details
    assert outcome.result not in PASSED


def test_results_that_differ_between_two_calls_are_detected(monkeypatch: pytest.MonkeyPatch) -> None:
    right: Any = PreparedFrame.velocity
    monkeypatch.setattr(PreparedFrame, "velocity", lambda *asked: np.nextafter(right(*asked), 1.0))
    assert evaluate(arm()).result == "two computations of one result differ"


def _fails(how: str, pipe: Connection) -> None:
    pipe.send(fuzz.READY)
    pipe.recv()
    if how == "sleeps":
        time.sleep(60)
    (os.abort if how == "aborts" else partial(os._exit, 11))()


@pytest.mark.parametrize(
    ("how", "word", "details"),
    [
        ("exits", "kills the process", "exit status 11"),
        ("aborts", "kills the process", "exit status -6"),
        ("sleeps", "hangs", "no answer in 1 s"),
    ],
)
def test_a_crash_or_hang_of_a_worker_is_an_outcome_and_the_worker_is_replaced(
    how: str, word: str, details: str
) -> None:
    worker = fuzz.Worker(partial(_fails, how), timeout=1.0)
    for _ in range(2):
        assert worker.evaluate("names", 0) == (word, details)
    worker.stop(0.0)


@pytest.mark.long
def test_a_short_run_of_mutants_finds_no_failure(tmp_path: Path) -> None:
    counts = fuzz.fuzz(fuzz.list_cases(["mutants"], 40, 0), seed=20, jobs=1, timeout=60.0, keep=tmp_path)
    assert set(counts) <= set(PASSED), sorted(tmp_path.iterdir())
    assert sum(counts.values()) == 40
    assert counts["verified"] > 10


@pytest.mark.long
@pytest.mark.parametrize("family", [*robots.FAMILIES, *mjcf.FAMILIES])
def test_a_short_run_of_random_robots_finds_no_failure(family: str) -> None:
    words = Counter(evaluate_case(fuzz.make_case(20, family, number)).result for number in range(5))
    assert set(words) <= set(PASSED), words
    assert words["verified"] > 2


# -- MJCF --------------------------------------------------------------------------------------------------


def test_the_random_mjcf_files_contain_every_unusual_content_and_mujoco_reads_them() -> None:
    made = {
        family: [mjcf.make_model(3, family, number).data for number in range(100)] for family in mjcf.FAMILIES
    }
    texts = {family: b"".join(files) for family, files in made.items()}
    for word in (b'align="true"', b'align="auto"', b'alignfree="true"', b'fusestatic="true"', b"<inertial"):
        assert word in texts["mjcf-free"], word
    for word in (b'active="false"', b"<weld", b'joint2="', b"polycoef="):
        assert word in texts["mjcf-equalities"], word
    for word in (b'class="inner"', b"childclass=", b'angle="degree"', b"eulerseq="):
        assert word in texts["mjcf-classes"], word
    models = [mjcf.compile_model(data) for files in made.values() for data in files]
    assert sum(model is not None for model in models) > 290
    assert sum(model is not None and (model.eq_type == 2).sum() > 2 for model in models) > 20


def test_an_mjcf_reader_that_differs_from_mujoco_is_detected(monkeypatch: pytest.MonkeyPatch) -> None:
    text = (
        '<mujoco><worldbody><body name="b"><freejoint name="f" align="true"/><geom size=".1" pos="1 0 0"/>'
        '<site name="s"/></body></worldbody></mujoco>'
    )
    assert evaluate(text).result == "verified"

    def without_shapes(*arguments: Any) -> tuple[bytes, int | None]:
        output, status = run_python(*arguments)
        return output.splitlines(keepends=True)[0], status

    monkeypatch.setattr(mjcf_check, "run_python", without_shapes)
    assert evaluate(text).result == "MuJoCo reads another robot"
