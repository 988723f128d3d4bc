"""JUnit XML conforms to Jenkins' schema, and the text of a failure contains all information."""

from pathlib import Path
from typing import Any

import pytest
from lxml import etree

from tests.report.documents import HOSTILE_ROBOT, arms, failing, hostile
from urdfkin.report.junit import as_junit
from urdfkin.validation.document import Document

SCHEMA = etree.XMLSchema(etree.parse(Path(__file__).parents[1] / "fixtures" / "junit-10.xsd"))


def junit_of(data: bytes) -> etree._Element:
    """Return JUnit XML that conforms to the schema."""
    root = etree.fromstring(data)
    SCHEMA.assertValid(root)
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
