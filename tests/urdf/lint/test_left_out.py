"""What an MJCF file says and a tree cannot hold is said by `load`, word for word, and nothing else is."""

import warnings

import pytest

import urdfkin
from tests.urdf.lint.cases.left_out import CASES, Mjcf
from urdfkin.urdf.lint.pages import OF_MJCF

pytest.importorskip("mujoco")


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_each_thing_alone_is_said_in_its_words_and_nothing_else(case: Mjcf) -> None:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        robot = urdfkin.load(case.text, verify=False)
    found = [(f.code, f.message) for f in robot.findings if f.code in OF_MJCF]
    assert sorted(found) == sorted(case.findings)
    assert sum("MJCF101" in str(w.message) for w in caught) == [code for code, _ in found].count("MJCF101")


def test_every_rule_has_cases_with_it_and_without() -> None:
    for code in OF_MJCF:
        assert {any(code == one for one, _ in case.findings) for case in CASES} == {True, False}
