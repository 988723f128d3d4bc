"""Every form of a report has each verdict with the reason, and the outcome of the run."""

import io
import json
from collections.abc import Callable
from html import unescape
from typing import Any

import pytest
from rich.console import Console

from tests.reading import present
from tests.report.documents import arms, failing
from tests.report.test_texts import read
from tests.urdfs import chain
from urdfkin.report.html import as_html
from urdfkin.report.markdown import as_markdown
from urdfkin.report.reading import contradictions
from urdfkin.report.terminal import print_report
from urdfkin.validation import robot_summary
from urdfkin.validation.campaign import validate
from urdfkin.validation.collector import CampaignProgress
from urdfkin.validation.document import Document, outcome_of
from urdfkin.verify.tables import TableCheck


def _outside(_: pytest.MonkeyPatch) -> Document:
    document = failing()
    del document["robots"][1:], document["sha256"][1:]
    return document | {"robots_requested": 1, "reason": "1 of 1 robot disagrees"}


def _tables(monkeypatch: pytest.MonkeyPatch) -> Document:
    found = TableCheck(13, 0.0021, 0.0, {"placement": 5e9}, {"placement": 2.5e7}, False)
    monkeypatch.setattr(robot_summary, "check_table", lambda *_: found)
    return _document("ur5")


def _tables_without_numbers(monkeypatch: pytest.MonkeyPatch) -> Document:
    right = robot_summary.make_chains

    def without(*args: Any) -> tuple[Any, ...]:
        return tuple(chain | {"bound_ratio": None, "worst": None} for chain in right(*args))

    monkeypatch.setattr(robot_summary, "make_chains", without)
    return _document("ur5")


def _crashed(monkeypatch: pytest.MonkeyPatch) -> Document:
    def crash(_: object) -> None:
        raise MemoryError

    monkeypatch.setattr("urdfkin.validation.answer.run_chunk", crash)
    return _document("ur5")


def _interrupted(_: pytest.MonkeyPatch) -> Document:
    def stop(state: CampaignProgress) -> None:
        if state.chunks_done == 3:
            raise KeyboardInterrupt

    return _document(["planar_two_link", "double_pendulum", "ur5"], samples=50, progress=stop)


def _missing(_: pytest.MonkeyPatch) -> Document:
    return arms() | {
        "robots_requested": 3,
        "verdict": "not verified",
        "reason": "1 of 3 robots without a report",
    }


HUGE = chain([""] * 320, origin="", name="huge")
TWO_TREES = '<robot name="r"><link name="a"/><link name="b"/></robot>'


def _document(robots: Any, **how: Any) -> Document:
    document: Document = json.loads(json.dumps(validate(robots, **{"samples": 2} | how).as_dict()))
    return document


#: Document, verdicts, part of a robot's reason, exit code, and types of JUnit's failures and errors.
CASES: dict[str, tuple[Callable[[pytest.MonkeyPatch], Document], list[str], str, int, list[str]]] = {
    "results outside": (
        _outside, ["disagrees"], "3 of 8,000 results lie outside their bound", 1,
        ["disagreement", "disagrees"],
    ),
    "tables": (
        _tables, ["disagrees"], "the Denavit-Hartenberg tables from base_link to tool0 disagree with "
        "Pinocchio: 2.5e+07 times the bound, tip 0.0021 m off", 1, ["disagrees"],
    ),
    "tables, no number": (
        _tables_without_numbers, ["disagrees"], "disagree with Pinocchio: by an infinite amount",
        1, ["disagrees"],
    ),
    "refused": (lambda _: _document(HUGE), ["not verified"], "memory grows with nv^3", 3, ["not verified"]),
    "bad input": (lambda _: _document(TWO_TREES), ["bad input"], "URDF", 2, ["bad input"]),
    "crash": (_crashed, ["not verified"], "please report it: MemoryError: no message", 3, ["not verified"]),
    "interrupt": (
        _interrupted, ["verified", "not verified", "not verified"],
        "interrupted: 0 of 53 samples were compared", 130, ["not passed", "not verified", "not verified"],
    ),
    "nothing": (lambda _: _document([]), [], "", 3, ["not passed"]),
    "missing": (_missing, ["verified", "verified"], "", 3, ["not passed"]),
}  # fmt: skip


def terminal(document: Document) -> str:
    stream = io.StringIO()
    print_report(document, Console(file=stream, width=400))
    return stream.getvalue()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::urdfkin.UrdfWarning")
@pytest.mark.parametrize("name", CASES)
def test_every_format_of_a_report_has_the_verdicts_and_the_reason(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    make, verdicts, reason, code, junit = CASES[name]
    document = make(monkeypatch)
    found = outcome_of(document)
    assert list(contradictions(document)) == []
    assert [robot["verdict"] for robot in document["robots"]] == verdicts
    assert (found.exit_code, found.passed, document["verdict"]) == (code, False, found.verdict)
    assert document["reason"] == found.reason
    assert found.reason
    root = read(document)
    forms = {
        "terminal": terminal(document),
        "markdown": unescape(as_markdown(document)).replace("\\", ""),
        "html": unescape(as_html(document)).replace("\\", ""),
        "junit": " ".join(text for case in root.iter() for text in (*case.attrib.values(), case.text or "")),
    }
    reasons = {robot["reason"] for robot in document["robots"] if robot["verdict"] != "verified"}
    assert reason == "" or any(reason in (each or "") for each in reasons)
    for form, text in forms.items():
        if form != "junit" or name in ("interrupt", "nothing", "missing"):
            assert found.reason in text, form
        if reason:
            assert reason in text, form
        for verdict in verdicts:
            assert verdict in text, form
    errors = [kind for kind in junit if kind in ("bad input", "not passed")]  # all others are failures
    failures = [kind for kind in junit if kind not in errors]
    assert [element.get("type") for element in root.iter("failure")] == failures
    assert [element.get("type") for element in root.iter("error")] == errors
    assert (root.get("failures"), root.get("errors")) == (str(len(failures)), str(len(errors)))
    assert "✅ Verified" not in forms["markdown"]
    assert ">Verified against" not in forms["html"].replace("\n", "")


@pytest.mark.slow
def test_no_format_of_the_report_of_a_passed_run_has_a_failure() -> None:
    document = arms()
    assert (document["verdict"], document["reason"], outcome_of(document).exit_code) == ("verified", None, 0)
    assert [robot["reason"] for robot in document["robots"]] == [None, None]
    for text in (terminal(document), as_markdown(document), as_html(document)):
        assert "ot passed" not in text
    root = read(document)
    assert (root.get("failures"), root.get("errors")) == ("0", "0")
    assert len(root.findall("testsuite")) == 2


def test_the_traceback_of_a_crash_is_in_the_document_and_in_junit(monkeypatch: pytest.MonkeyPatch) -> None:
    document = _crashed(monkeypatch)
    assert present(document["robots"][0].get("error")).startswith("Traceback (most recent call last)")
    assert "in crash" in (read(document).findtext(".//failure") or "")
