"""The pages of the rules are true, robots of the catalogue have no errors, and comments silence findings."""

import re
import tomllib
import warnings
from dataclasses import fields
from pathlib import Path

import pytest

import urdfkin
from scripts import make_pages
from tests import urdfs
from tests.urdf.lint.cases.arm import arm
from tests.urdf.lint.others import ask
from urdfkin.errors import UnknownNameError
from urdfkin.urdf.catalogue import catalogue
from urdfkin.urdf.findings import MAX_COMPLETE_FINDINGS, Rule
from urdfkin.urdf.lint import DEFAULT_SIZE_LIMITS, Finding, Severity, SizeLimits, check, rules
from urdfkin.urdf.lint.pages import (
    TOPICS,
    URDF_RULES,
    Page,
    explain,
    find_rule,
    page,
    page_file_by_topic,
    topic_pages,
)

HERE = Path(rules.__file__).parent
EVERY_RULE = pytest.mark.parametrize("rule", URDF_RULES.values(), ids=lambda rule: rule.id)


#: Limits with which the examples of some rules are checked.
_LIMITS = {
    "too-deep-for-pinocchio": SizeLimits(depth=5_000),
    "too-large": SizeLimits(bytes=100),
    "too-many-elements": SizeLimits(elements=10),
    "markup-too-long": SizeLimits(markup=100),
}


def document(example: str) -> str:
    """Return an example as a whole URDF; see `urdfkin.urdf.lint.pages.Page`."""
    text = example.strip("\n")
    if not text.startswith(("<joint", "<link", "<material", "<!--")):
        return example
    links = '<link name="base"/>\n<link name="tip"/>\n' if text.startswith(("<joint", "<!--")) else ""
    return f'<robot name="example">\n{links}{text}\n</robot>\n'


def findings_of(rule: Rule, example: str) -> list[Finding]:
    return check(document(example).encode(), limits=_LIMITS.get(rule.slug, DEFAULT_SIZE_LIMITS))


@EVERY_RULE
def test_the_bad_example_has_the_finding_and_an_error_only_if_the_rule_is_an_error(rule: Rule) -> None:
    findings = findings_of(rule, page(rule.id).example)
    assert {f.pinocchio_reading for f in findings if f.code == rule.id} == {rule.pinocchio_reading}, findings
    assert any(f.severity is Severity.ERROR for f in findings) == (
        rule.severity is Severity.ERROR or rule.slug == "stray-text"
    ), findings


@EVERY_RULE
def test_the_corrected_example_has_no_error_and_not_the_finding(rule: Rule) -> None:
    findings = findings_of(rule, page(rule.id).correction)
    assert not [f for f in findings if f.severity is Severity.ERROR or f.code == rule.id], findings


@EVERY_RULE
def test_codes_and_texts_of_rules_have_the_required_form_and_pages_fit_a_terminal(rule: Rule) -> None:
    text = explain(rule)
    assert rule.id in text.splitlines()[0]
    assert max(map(len, text.splitlines())) <= 104
    assert all(character.isprintable() or character == "\n" for character in text)
    assert re.fullmatch(r"URDF[1-9][0-9]{2}", rule.id)
    assert re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", rule.slug)
    assert not page(rule.id).title.endswith(".")
    assert page(rule.id).why.endswith(".")
    assert re.match(
        r"Pinocchio (reads|refuses) the example\b.*; yourdfpy (reads|refuses) the example\b.*\.$",
        page(rule.id).other_readers,
    )


@pytest.mark.parametrize("topic", TOPICS)
def test_a_file_of_pages_has_a_page_for_each_rule_in_order_and_no_other_content(topic: str) -> None:
    assert list(topic_pages(topic)) == [rule.id for rule in TOPICS[topic]]
    data = tomllib.loads(page_file_by_topic()[topic].read_text("utf-8"))
    known = {field.name for field in fields(Page)} | {"parts"}
    assert data.keys() - {rule.id for rule in TOPICS[topic]} <= {
        "correction",
        "other_readers",
        "parts",
        "question",
    }
    assert all(data[rule.id].keys() <= known for rule in TOPICS[topic])


def test_every_module_of_rules_has_a_file_of_pages() -> None:
    topics = {*TOPICS, "left_out"}
    assert {path.stem for path in HERE.glob("*.py")} - {"__init__"} == topics - {"parser"}
    assert {path.stem for path in HERE.glob("*.toml")} == topics - {"parser"}
    assert all(file.is_file() for file in page_file_by_topic().values())
    assert page_file_by_topic().keys() == topics
    assert sum(map(len, TOPICS.values())) == len(URDF_RULES)


def test_a_rule_is_found_by_its_code_its_digits_and_its_unique_short_name() -> None:
    assert len({rule.slug for rule in URDF_RULES.values()}) == len(URDF_RULES)
    assert find_rule("urdf502") is find_rule("502") is find_rule("Axis-Without-Direction")
    with pytest.raises(UnknownNameError, match="did you mean"):
        find_rule("URDF5O2")


@pytest.fixture(scope="module")
def verdicts() -> dict[str, dict[str, str]]:
    return dict(zip(URDF_RULES, ask([document(page(code).example) for code in URDF_RULES]), strict=True))


@pytest.mark.slow
@EVERY_RULE
def test_pinocchio_and_yourdfpy_read_the_bad_example_if_the_page_says_so(
    rule: Rule, verdicts: dict[str, dict[str, str]]
) -> None:
    pinocchio, yourdfpy = re.findall(
        r"(?:Pinocchio|; yourdfpy) (reads|refuses) the ex", page(rule.id).other_readers
    )
    assert verdicts[rule.id] == {"pinocchio": pinocchio, "yourdfpy": yourdfpy}


# -- the robots of the catalogue -----------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("robot", catalogue())
def test_no_robot_of_the_catalogue_has_an_error_or_cannot_be_verified(robot: str) -> None:
    wrong = [
        str(one)
        for one in check(robot)
        if one.severity is Severity.ERROR or one.pinocchio_reading is not None
    ]
    assert wrong == []


def test_missing_mimicked_joints_are_errors_if_mimic_is_true() -> None:
    errors = [f for f in check("alex_psyonic_hands", mimic=True) if f.severity is Severity.ERROR]
    assert [finding.code for finding in errors] == ["URDF520"] * 8


@pytest.mark.slow
def test_the_page_of_findings_is_current(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)
    page = make_pages.page_path("findings").read_text("utf-8")
    assert page == make_pages.make_page("findings"), "run python scripts/make_pages.py findings"


@pytest.mark.slow
def test_a_robot_of_the_catalogue_has_at_most_five_warnings() -> None:
    assert max(len(make_pages.list_warnings(robot)) for robot in catalogue()) <= 5


# -- comments ------------------------------------------------------------------------------------------------

COMMENT = "<!-- urdfkin: ignore[{}] as drawn -->\n"


def test_load_does_not_warn_of_a_silenced_finding() -> None:
    text = arm(axis='<axis xyz="0 0 2"/>')
    with pytest.warns(urdfkin.UrdfWarning, match="URDF503"):
        urdfkin.load(text)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        robot = urdfkin.load(COMMENT.format("URDF503") + text.partition("\n")[2])
    assert list(robot.findings) == []


def test_a_comment_does_not_make_a_robot_verified_that_pinocchio_refuses() -> None:
    text = COMMENT.format("URDF303") + arm(head="", origin='<origin xyz="0\t0 1"/>').lstrip()
    assert check(text) == []
    robot = urdfkin.load(text)
    with pytest.warns(urdfkin.NotVerifiedWarning):
        robot.placement(robot.neutral(), "tool")
    assert not robot.certificate().verified


def test_the_nearest_comment_silences_a_finding_and_all_other_comments_are_unused() -> None:
    text = arm(head="", axis="\n" + COMMENT.format("URDF503") + '<axis xyz="0 0 2"/>').lstrip()
    (unused,) = check(COMMENT.format("URDF503") + text)
    assert (unused.code, unused.line) == ("URDF121", 1)


def test_a_comment_before_an_element_silences_a_finding_about_deep_nesting_inside() -> None:
    text = arm(more="{}<gazebo>" + "<a>" * 300 + "</a>" * 300 + "</gazebo>")
    assert [finding.code for finding in check(text.format(""))] == ["URDF109"]
    assert check(text.format("\n" + COMMENT.format("URDF109"))) == []


@pytest.mark.slow
def test_findings_beyond_the_number_of_stored_ones_are_also_silenced() -> None:
    text = urdfs.robot(
        urdfs.joint("j", "fixed", "a", "b", axis="", more="<odd/>" * (MAX_COMPLETE_FINDINGS + 5))
    )
    assert len(check(text)) == MAX_COMPLETE_FINDINGS
    assert check(COMMENT.format("URDF207") + text) == []


def test_a_misspelt_mimicked_joint_is_not_suggested_to_be_the_mimic_joint_itself() -> None:
    text = arm(follow='<mimic joint="jj2"/>')
    remedies = [str(finding.remedy) for finding in check(text) if finding.code == "URDF520"]
    assert [remedy.partition(" (")[0] for remedy in remedies] == ["name a joint of the robot"]
