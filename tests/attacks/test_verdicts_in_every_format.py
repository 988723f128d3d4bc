"""Every form of a report has each verdict with the reason, and the outcome of the run."""

import io
import json
from collections.abc import Callable
from typing import Any

import pytest
from lxml import etree
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
    return document | {"asked": 1, "reason": "1 of 1 robot disagrees"}


def _tables(monkeypatch: pytest.MonkeyPatch) -> Document:
    found = TableCheck(13, 0.0021, 0.0, {"placement": 5e9}, {"placement": 2.5e7}, False)
    monkeypatch.setattr(robot_summary, "check_table", lambda *_: found)
    return _document("ur5")


def _tables_without_numbers(monkeypatch: pytest.MonkeyPatch) -> Document:
    right = robot_summary.chains_of

    def without(*args: Any) -> tuple[Any, ...]:
        return tuple(chain | {"share_of_bound": None, "worst": None} for chain in right(*args))

    monkeypatch.setattr(robot_summary, "chains_of", without)
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
    return arms() | {"asked": 3, "verdict": "not verified", "reason": "1 of 3 robots without a report"}


HUGE = chain([""] * 320, origin="", name="huge")
TWO_TREES = '<robot name="r"><link name="a"/><link name="b"/></robot>'


def _document(robots: Any, **how: Any) -> Document:
    document: Document = json.loads(json.dumps(validate(robots, **{"samples": 2} | how).as_dict()))
    return document


#: Document, verdicts, part of a robot's reason, exit code, and JUnit's (failures, errors).
CASES: dict[str, tuple[Callable[[pytest.MonkeyPatch], Document], list[str], str, int, tuple[int, int]]] = {
    "results outside": (_outside, ["disagrees"], "3 of 8,000 results lie outside their bound", 1, (2, 0)),
    "tables": (
        _tables, ["disagrees"], "the Denavit-Hartenberg tables from base_link to tool0 disagree with "
        "Pinocchio: 2.5e+07 times the bound, tip 0.0021 m off", 1, (1, 0),
    ),
    "tables, no number": (
        _tables_without_numbers, ["disagrees"], "disagree with Pinocchio: by an infinite amount", 1, (1, 0),
    ),
    "refused": (lambda _: _document(HUGE), ["not verified"], "memory grows with nv^3", 3, (1, 0)),
    "bad input": (lambda _: _document(TWO_TREES), ["bad input"], "URDF", 2, (0, 1)),
    "crash": (_crashed, ["not verified"], "please report it: MemoryError: no message", 3, (1, 0)),
    "interrupt": (
        _interrupted, ["verified", "not verified", "not verified"],
        "interrupted: 0 of 53 samples were compared", 130, (2, 1),
    ),
    "nothing": (lambda _: _document([]), [], "", 3, (0, 1)),
    "missing": (_missing, ["verified", "verified"], "", 3, (0, 1)),
}  # fmt: skip


def terminal(document: Document) -> str:
    stream = io.StringIO()
    print_report(document, Console(file=stream, width=400))
    return stream.getvalue()


def unescaped(text: str) -> str:
    for escaped, plain in (("&#39;", "'"), ("&lt;", "<"), ("&gt;", ">"), ("&amp;", "&"), ("\\", "")):
        text = text.replace(escaped, plain)
    return text


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
        "markdown": unescaped(as_markdown(document)),
        "html": unescaped(as_html(document)),
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
    assert (int(root.get("failures", "0")), int(root.get("errors", "0"))) == junit
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


@pytest.mark.filterwarnings("ignore::urdfkin.UrdfWarning")
def test_in_junit_only_bad_input_is_an_error_and_other_verdicts_are_failures(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name, kind, type_ in (
        ("results outside", "failure", "disagrees"),
        ("refused", "failure", "not verified"),
        ("bad input", "error", "bad input"),
    ):
        case = read(CASES[name][0](monkeypatch)).xpath("//testcase[@name='verdict']")
        assert isinstance(case, list)
        assert isinstance(case[0], etree._Element)
        (outcome,) = case[0]
        assert (outcome.tag, outcome.get("type")) == (kind, type_)
    checks = read(CASES["results outside"][0](monkeypatch)).xpath("//failure[@type='disagreement']")
    assert isinstance(checks, list)
    assert len(checks) == 1


def test_a_crash_has_a_traceback_and_an_interrupted_robot_has_its_number_of_samples(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    document = _crashed(monkeypatch)
    error = present(document["robots"][0].get("error"))
    assert error.startswith("Traceback (most recent call last)")
    assert "in crash" in (read(document).findtext(".//failure") or "")
    monkeypatch.undo()
    robot = _interrupted(monkeypatch)["robots"][1]
    assert (robot["samples"], robot["results"] > 0) == (28, True)
    assert robot["reason"] == "interrupted: 28 of 53 samples were compared"
