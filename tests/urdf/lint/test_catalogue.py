"""The robots everybody uses: no error, no warning without a word about it, and a page that says so."""

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

from urdfkin.urdf.catalogue import catalogue
from urdfkin.urdf.lint import Severity, check

SCRIPT = Path(__file__).parents[3] / "scripts" / "make_findings.py"


@pytest.fixture(scope="module")
def script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_findings", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


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
def test_the_page_of_findings_is_current(script: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)
    assert script.PAGE.read_text("utf-8") == script.page(), "run python scripts/make_findings.py"


@pytest.mark.slow
def test_a_robot_is_told_a_handful_of_things_at_most(script: ModuleType) -> None:
    assert max(len(script.warnings_of(robot)) for robot in catalogue()) <= 5
