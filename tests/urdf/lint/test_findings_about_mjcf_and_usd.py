"""`load` reports each part of an MJCF or USD file that a tree cannot represent, and nothing else."""

import warnings
from pathlib import Path

import pytest

import urdfkin
from tests.urdf.lint.cases.left_out import CASES, Mjcf
from tests.urdfs import loaded
from urdfkin.urdf.lint.pages import OF_OTHERS, explain, page

OF_MJCF = [code for code in OF_OTHERS if code.startswith("MJCF")]


@pytest.mark.slow
@pytest.mark.parametrize("code", OF_OTHERS)
def test_only_the_bad_example_on_a_page_about_mjcf_or_usd_has_the_finding(code: str, tmp_path: Path) -> None:
    of_mjcf, rule = code in OF_MJCF, OF_OTHERS[code]
    pytest.importorskip("mujoco" if of_mjcf else "pxr")
    found = []
    for text in (page(code).example, page(code).cure):
        file = tmp_path / ("robot.xml" if of_mjcf else "robot.usda")
        file.write_text(text.lstrip())
        findings = loaded(file, verify=False).findings
        codes = {code} if of_mjcf else OF_OTHERS.keys()
        found.append({(one.code, one.severity) for one in findings if one.code in codes})
    assert found == [{(code, rule.severity)}, set()]
    assert explain(rule).startswith(f"{code} {rule.slug} ({rule.severity.value})")


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_each_mjcf_case_has_exactly_the_expected_findings_and_warnings(case: Mjcf) -> None:
    pytest.importorskip("mujoco")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        robot = urdfkin.load(case.text, verify=False)
    of_mjcf = [f for f in robot.findings if f.code in OF_MJCF]
    places = [" ".join(filter(None, (f.element, f.name))) for f in of_mjcf]
    found = [
        (f.code, f"{place}: {f.message}" if place else f.message)
        for f, place in zip(of_mjcf, places, strict=True)
    ]
    assert sorted(found) == sorted(case.findings)
    assert sum("MJCF101" in str(w.message) for w in caught) == [code for code, _ in found].count("MJCF101")


def test_every_rule_has_cases_with_and_without_the_finding() -> None:
    for code in OF_MJCF:
        assert {any(code == one for one, _ in case.findings) for case in CASES} == {True, False}
