"""Each rule's page is true; the robots everybody uses; what a comment silences."""

from __future__ import annotations

import re
import tomllib
import warnings
from dataclasses import fields
from pathlib import Path

import pytest

import urdfkin
from scripts import make_pages
from tests.urdf.lint.cases.arm import arm
from tests.urdf.lint.examples import document
from tests.urdf.lint.others import ask
from urdfkin.errors import UnknownNameError
from urdfkin.urdf.catalogue import catalogue
from urdfkin.urdf.findings import WRITTEN_OUT, Rule
from urdfkin.urdf.lint import DEFAULT_LIMITS, Finding, Limits, Severity, check, rules
from urdfkin.urdf.lint.pages import RULES, TOPICS, Page, explain, find_rule, page, page_files, topic_pages

HERE = Path(rules.__file__).parent
EVERY_RULE = pytest.mark.parametrize("rule", RULES.values(), ids=lambda rule: rule.id)


#: Three codes are only seen in small examples with a limit lowered, one with a limit raised.
_LIMITS = {
    "too-deep-for-pinocchio": Limits(depth=5_000),
    "too-large": Limits(bytes=100),
    "too-many-elements": Limits(elements=10),
    "markup-too-long": Limits(markup=100),
}


def told(rule: Rule, example: str) -> list[Finding]:
    return check(document(example).encode(), limits=_LIMITS.get(rule.slug, DEFAULT_LIMITS))


@EVERY_RULE
def test_the_bad_example_has_the_finding(rule: Rule) -> None:
    findings = told(rule, page(rule.id).example)
    assert rule.id in [finding.code for finding in findings], findings


@EVERY_RULE
def test_the_bad_example_of_an_error_is_refused_and_of_others_is_not(rule: Rule) -> None:
    findings = told(rule, page(rule.id).example)
    assert any(f.severity is Severity.ERROR for f in findings) == (
        rule.severity is Severity.ERROR or rule.slug == "stray-text"
    ), findings


@EVERY_RULE
def test_the_good_example_has_no_error_and_not_this_finding(rule: Rule) -> None:
    findings = told(rule, page(rule.id).cure)
    assert not [f for f in findings if f.severity is Severity.ERROR or f.code == rule.id], findings


@EVERY_RULE
def test_the_oracles_mark_stands_on_the_finding(rule: Rule) -> None:
    assert {f.oracle for f in told(rule, page(rule.id).example) if f.code == rule.id} == {rule.oracle}


@EVERY_RULE
def test_ids_and_titles_keep_their_form(rule: Rule) -> None:
    assert re.fullmatch(r"URDF[1-9][0-9]{2}", rule.id)
    assert re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", rule.slug)
    assert not page(rule.id).title.endswith(".")
    assert page(rule.id).why.endswith(".")
    assert re.match(
        r"Pinocchio (reads|refuses) the example\b.*; yourdfpy (reads|refuses) the example\b.*\.$",
        page(rule.id).others,
    )


@EVERY_RULE
def test_the_page_fits_a_terminal(rule: Rule) -> None:
    text = explain(rule)
    assert rule.id in text.splitlines()[0]
    assert max(map(len, text.splitlines())) <= 104
    assert all(character.isprintable() or character == "\n" for character in text)


@pytest.mark.parametrize("topic", TOPICS)
def test_the_pages_of_a_topic_are_those_of_its_rules_in_their_order(topic: str) -> None:
    assert list(topic_pages(topic)) == [rule.id for rule in TOPICS[topic]]


@pytest.mark.parametrize("topic", TOPICS)
def test_a_file_of_pages_holds_nothing_that_is_not_read(topic: str) -> None:
    data = tomllib.loads(page_files()[topic].read_text("utf-8"))
    known = {field.name for field in fields(Page)} | {"parts"}
    assert data.keys() - {rule.id for rule in TOPICS[topic]} <= {"cure", "others", "parts", "question"}
    assert all(data[rule.id].keys() <= known for rule in TOPICS[topic])


def test_every_module_of_rules_is_a_topic() -> None:
    topics = {*TOPICS, "left_out"}  # which is of MJCF: `load` says it, not `check`
    assert {path.stem for path in HERE.glob("*.py")} - {"__init__"} == topics - {"parser"}
    assert {path.stem for path in HERE.glob("*.toml")} == topics - {"parser"}
    assert all(file.is_file() for file in page_files().values())
    assert page_files().keys() == topics
    assert sum(map(len, TOPICS.values())) == len(RULES)


def test_short_names_are_unique() -> None:
    assert len({rule.slug for rule in RULES.values()}) == len(RULES)


def test_a_code_is_found_by_id_number_and_short_name() -> None:
    assert find_rule("urdf502") is find_rule("502") is find_rule("Axis-Without-Direction")
    with pytest.raises(UnknownNameError, match="did you mean"):
        find_rule("URDF5O2")


@pytest.fixture(scope="module")
def verdicts() -> dict[str, dict[str, str]]:
    return dict(zip(RULES, ask([document(page(code).example) for code in RULES]), strict=True))


@pytest.mark.slow
@EVERY_RULE
def test_the_others_do_with_the_bad_example_what_the_page_says(
    rule: Rule, verdicts: dict[str, dict[str, str]]
) -> None:
    pinocchio, yourdfpy = re.findall(r"(?:Pinocchio|; yourdfpy) (reads|refuses) the ex", page(rule.id).others)
    assert verdicts[rule.id] == {"pinocchio": pinocchio, "yourdfpy": yourdfpy}


# -- the robots everybody uses: no error, no warning without a word about it, and a page that says so --------


@pytest.mark.slow
@pytest.mark.parametrize("robot", catalogue())
def test_no_robot_of_the_catalogue_has_an_error(robot: str) -> None:
    assert [str(finding) for finding in check(robot) if finding.severity is Severity.ERROR] == []


def test_the_missing_leaders_are_errors_when_mimic_is_asked_for() -> None:
    errors = [f for f in check("alex_psyonic_hands", mimic=True) if f.severity is Severity.ERROR]
    assert [finding.code for finding in errors] == ["URDF520"] * 8


@pytest.mark.slow
@pytest.mark.parametrize("robot", catalogue())
def test_no_robot_of_the_catalogue_is_unverifiable(robot: str) -> None:
    assert [str(finding) for finding in check(robot) if finding.oracle is not None] == []


@pytest.mark.slow
def test_the_page_of_findings_is_current(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)
    page = make_pages.path_of("findings").read_text("utf-8")
    assert page == make_pages.page("findings"), "run python scripts/make_pages.py findings"


@pytest.mark.slow
def test_a_robot_is_told_a_handful_of_things_at_most() -> None:
    assert max(len(make_pages.warnings_of(robot)) for robot in catalogue()) <= 5


# -- what a comment silences is not warned of; what it cannot change stays as it is --------------------------

COMMENT = "<!-- urdfkin: ignore[{}] as drawn -->\n"


def test_load_does_not_warn_of_it() -> None:
    text = arm(axis='<axis xyz="0 0 2"/>')
    with pytest.warns(urdfkin.UrdfWarning, match="URDF503"):
        urdfkin.load(text)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        robot = urdfkin.load(COMMENT.format("URDF503") + text.partition("\n")[2])
    assert list(robot.findings) == []


def test_a_robot_that_pinocchio_refuses_stays_unverified() -> None:
    text = COMMENT.format("URDF303") + arm(head="", origin='<origin xyz="0\t0 1"/>').lstrip()
    assert check(text) == []
    robot = urdfkin.load(text)
    with pytest.warns(urdfkin.NotVerifiedWarning):
        robot.placement(robot.neutral(), "tool")
    assert not robot.certificate().verified


def test_the_nearest_comment_speaks_and_the_others_are_told_to_be_unused() -> None:
    text = arm(head="", axis="\n" + COMMENT.format("URDF503") + '<axis xyz="0 0 2"/>').lstrip()
    (unused,) = check(COMMENT.format("URDF503") + text)
    assert (unused.code, unused.line) == ("URDF121", 1)


@pytest.mark.slow
def test_more_findings_than_are_written_out_are_silenced_too() -> None:
    links = '<link name="a"/>' + "<link name='b'/>"
    joint = '<joint name="j" type="fixed"><parent link="a"/><child link="b"/>{}</joint>'
    many = "<odd/>" * (WRITTEN_OUT + 5)
    text = f"<robot name='r'>{links}{joint.format(many)}</robot>"
    assert len(check(text)) == WRITTEN_OUT
    assert check(COMMENT.format("URDF207") + text) == []
