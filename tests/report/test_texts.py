"""Reports in Markdown, on a terminal and as JUnit XML: complete, with escaped names, limited in size."""

import copy
import io
from pathlib import Path
from typing import Any, cast

import pytest
from lxml import etree
from markdown_it import MarkdownIt
from rich.console import Console

from tests.report.documents import HOSTILE_ROBOT, arms, failing, hostile
from urdfkin.errors.escape import markdown_code, markdown_text
from urdfkin.report.compare import compare, document
from urdfkin.report.junit import as_junit
from urdfkin.report.listing import print_document
from urdfkin.report.markdown import MAX_CHARACTERS, as_markdown, fence_code
from urdfkin.report.terminal import print_report
from urdfkin.validation.document import Document

GITHUB_LIMIT = 65_536


def rendered(markdown: str) -> str:
    return str(MarkdownIt("commonmark", {"html": True}).enable("table").render(markdown))


def test_failures_come_first_in_markdown_and_the_command_repeats_the_run() -> None:
    html = rendered(as_markdown(arms()))
    assert html.count("<tr>") == 3
    assert "✅ Verified against Pinocchio" in html
    assert "urdfkin validate panda ur5 --samples 6 --seed 0" in html
    markdown = as_markdown(failing())
    assert markdown.index("broken.urdf") < markdown.index("| `ur5`")
    assert "❌ Not verified" in markdown
    assert "3 of" in markdown
    assert "urdfkin velocity panda --frame" in markdown


def test_names_and_texts_are_escaped_in_markdown_and_a_fence_is_longer_than_backticks_inside() -> None:
    assert markdown_code(HOSTILE_ROBOT) in as_markdown(hostile())
    shown = rendered(markdown_text("a|b `c` *d* <e> @f #g [h](i)")).strip().replace("\u2060", "")
    assert shown == "<p>a|b `c` *d* &lt;e&gt; @f #g [h](i)</p>"
    assert fence_code("a ``` b").startswith("````sh\n")


@pytest.mark.slow
def test_a_comment_on_a_thousand_robots_is_limited_and_counts_the_omitted_robots() -> None:
    document = arms()
    document["robots"] = [copy.deepcopy(document["robots"][0]) for _ in range(1000)]
    markdown = as_markdown(document)
    assert len(markdown) <= MAX_CHARACTERS < GITHUB_LIMIT
    assert "further robots left out" in markdown


def printed(document: Document, width: int, **how: Any) -> str:
    stream = io.StringIO()
    print_report(document, Console(file=stream, width=width, markup=False, highlight=False), **how)
    return stream.getvalue()


def one(document: Document) -> Document:
    document["robots"] = document["robots"][:1]
    return document


@pytest.mark.parametrize("width", [80, 100, 140])
@pytest.mark.parametrize("make", [arms, failing, hostile, lambda: one(arms())])
def test_only_commands_are_wider_than_the_terminal(make: Any, width: int) -> None:
    lines = printed(make(), width).splitlines()
    assert [line for line in lines if len(line) > width and "urdfkin" not in line] == []


def test_robots_that_an_interrupted_validation_did_not_reach_share_one_line() -> None:
    document = failing()
    broken = document["robots"][2]
    waiting = {"verdict": "not verified", "reason": "interrupted: 0 of 9 samples were compared"}
    document["robots"] += [cast("Any", broken | waiting | {"source": f"arm{i}"}) for i in range(5)]
    lines = printed(document, 140).splitlines()
    assert (
        "arm0, arm1, arm2 and 2 more robots: not verified: interrupted: 0 of 9 samples were compared" in lines
    )
    assert not any(line.startswith("arm4:") for line in lines)
    assert "broken.urdf: bad input: broken.urdf: the URDF has an error" in lines
    document["robots"].pop()
    lines = printed(document, 140).splitlines()
    assert "arm3: not verified: interrupted: 0 of 9 samples were compared" in lines


def test_text_without_a_terminal_has_no_escape_sequence_and_no_markup() -> None:
    assert "\x1b" not in printed(arms(), 80)
    named = arms()
    named["robots"][0]["source"] = "[bold red]name[/]"
    assert "[bold" in printed(named, 80)
    stream = io.StringIO()
    old, new = arms(), failing()
    print_document(Console(file=stream, width=80, markup=False), document(old, new, compare(old, new)))
    text = stream.getvalue()
    assert "REGRESSION panda: verdict: verified -> disagrees" in text
    assert "regressions" in text.splitlines()[-1]


def test_with_80_columns_quantities_are_rows_and_with_100_columns_they_are_columns() -> None:
    text = printed(arms(), 80)
    for words in ("panda", "ur5", "Jacobian rate", "acceleration", "data.J", "verified"):
        assert words in text
    head = next(line for line in printed(arms(), 100).splitlines() if "robot" in line and "results" in line)
    for word in ("place", "vel", "J", "J-dot", "acc", "data.J", "verdict"):
        assert word in head


def test_failures_have_a_command_and_a_reason() -> None:
    text = printed(failing(), 80)
    assert "urdfkin velocity panda --frame" in text
    assert "broken.urdf: bad input" in text
    assert "URDF502" in text
    assert "urdfkin velocity panda --frame" not in printed(arms(), 80)
    assert "urdfkin velocity panda --frame" in printed(arms(), 80, cases=True)


# -- JUnit XML ----------------------------------------------------------------------------------------

JUNIT_SCHEMA = etree.XMLSchema(etree.parse(Path(__file__).parents[1] / "fixtures" / "junit-10.xsd"))


def junit_of(data: bytes) -> etree._Element:
    """Return JUnit XML that conforms to the schema."""
    root = etree.fromstring(data)
    JUNIT_SCHEMA.assertValid(root)
    return root


def read(document: Document) -> etree._Element:
    return junit_of(as_junit(document))


@pytest.mark.parametrize("make", [arms, failing, hostile])
def test_junit_xml_conforms_to_the_published_schema(make: Any) -> None:
    read(make())


def test_there_is_a_case_for_each_robot_quantity_and_reference() -> None:
    document = arms()
    root = read(document)
    suites = root.findall("testsuite")
    assert [suite.get("name") for suite in suites] == ["panda", "ur5"]
    for suite, robot in zip(suites, document["robots"], strict=True):
        names = [case.get("name") for case in suite.findall("testcase")]
        assert len(names) == len(set(names)) == len(robot["checks"]) + 1
        assert names[-1] == "verdict"
        assert "acceleration, local" in names
        assert suite.get("tests") == str(len(names))
    assert root.get("tests") == str(sum(len(robot["checks"]) + 1 for robot in document["robots"]))


def test_the_text_of_a_failure_contains_all_information() -> None:
    root = read(failing())
    found, verdict = root.findall(".//failure")
    assert "disagrees: 3 of" in (verdict.text or "")
    for words in (
        "velocity, local of panda",
        "outside their bound: 3",
        "worst inf",
        "replay: urdfkin velocity",
    ):
        assert words in (found.text or "")
    assert root.get("failures") == "2"
    assert "URDF502" in str(root.findtext("testsuite[@name='broken.urdf']/testcase/error"))
    assert root.get("errors") == "1"


def test_names_are_unchanged_and_forbidden_characters_are_replaced_by_their_codes() -> None:
    document = hostile()
    document["robots"][1]["source"] = "bell\x07\ufffe"
    suites = read(document).findall("testsuite")
    assert [suite.get("name") for suite in suites] == [HOSTILE_ROBOT, "bell\\x07\\xfffe"]
