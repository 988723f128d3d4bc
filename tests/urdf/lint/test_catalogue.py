"""The robots everybody uses: no error, no warning without a word about it, and a page that says so."""

import pytest

from scripts import make_pages
from urdfkin.urdf.catalogue import catalogue
from urdfkin.urdf.lint import Severity, check


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
