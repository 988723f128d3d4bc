"""`load` reports each part of an MJCF or USD file that a tree cannot represent, and nothing else."""

import warnings
from pathlib import Path

import pytest

import urdfkin
from tests.urdf.lint.cases.left_out import CASES, Mjcf
from urdfkin.urdf.lint.pages import OF_OTHERS, page

OF_MJCF = [code for code in OF_OTHERS if code.startswith("MJCF")]
OF_USD = [code for code in OF_OTHERS if code.startswith("USD")]


@pytest.mark.slow
@pytest.mark.parametrize("code", OF_USD)
def test_the_example_of_a_page_about_usd_has_the_finding_and_the_corrected_example_has_none(
    code: str, tmp_path: Path
) -> None:
    pytest.importorskip("pxr")
    found = {}
    for which in ("example", "cure"):
        file = tmp_path / f"{which}.usda"
        file.write_text(getattr(page(code), which).lstrip())
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            robot = urdfkin.load(file, verify=False)
        found[which] = [finding.code for finding in robot.findings if finding.code in OF_USD]
    assert found == {"example": [code], "cure": []}


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_each_case_has_exactly_its_findings_and_warns_of_those_that_affect_the_motion(case: Mjcf) -> None:
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


def test_every_rule_has_cases_with_it_and_without() -> None:
    for code in OF_MJCF:
        assert {any(code == one for one, _ in case.findings) for case in CASES} == {True, False}
