"""A comparison counts: robots that were given several times, findings of one code, growth beyond a factor."""

from __future__ import annotations

import copy
from typing import Any

import pytest

from tests.report.documents import arms
from urdfkin.report.compare import compare, markdown_of


def words(old: Any, new: Any, **how: Any) -> list[str]:
    return [str(change) for change in compare(old, new, **how).changes]


def test_robots_that_were_given_several_times_are_told_apart_by_number() -> None:
    old: Any = arms()
    old["robots"] = [copy.deepcopy(old["robots"][1]) for _ in range(4)]
    for place, name in enumerate(["ur5", "ur5 (2)", "ur5 (3)", "ur5 (4)"]):
        new = copy.deepcopy(old)
        new["robots"][place]["checks"][0]["results"] -= 1
        (line,) = (line for line in words(old, new) if "results" in line)
        assert line.startswith(f"{name}: ")


@pytest.mark.parametrize(("before", "after"), [(0, 1), (1, 0), (1, 3), (2, 1), (2, 2), (0, 0)])
def test_findings_of_one_code_are_counted_and_notes_are_not(before: int, after: int) -> None:
    old: Any = arms()
    new = copy.deepcopy(old)
    finding = {"code": "URDF999", "severity": "warning", "also": []}
    note = {"code": "URDF998", "severity": "note", "also": []}
    old["robots"][0]["findings"] = [finding] * before
    new["robots"][0]["findings"] = [finding] * after + [note]
    found = [line for line in words(old, new) if "URDF99" in line]
    expected = f"panda: warning URDF999: {before or 'nothing'} -> {after or 'nothing'}"
    assert found == ([] if before == after else [expected])


def test_places_beside_the_first_are_findings_too() -> None:
    old: Any = arms()
    new = copy.deepcopy(old)
    new["robots"][0]["findings"] = [{"code": "URDF999", "severity": "error", "also": [3, 4]}]
    (line,) = (line for line in words(old, new) if "URDF999" in line)
    assert line.endswith("-> 3")


@pytest.mark.parametrize(("new_worst", "grew"), [(19.9, False), (20.0, False), (20.1, True)])
def test_a_disagreement_may_grow_up_to_the_factor(new_worst: float, grew: bool) -> None:
    old: Any = arms()
    old["robots"][0]["checks"][0]["worst"] = 10.0
    new = copy.deepcopy(old)
    new["robots"][0]["checks"][0]["worst"] = new_worst
    assert compare(old, new, 2.0).exit_code == int(grew)


def test_the_heading_is_the_verdict_with_a_capital() -> None:
    old: Any = arms()
    new = copy.deepcopy(old)
    assert markdown_of(old, new, compare(old, new)).startswith("## ✅ No regression, 0 changes\n")
    new["robots"][0]["checks"][0]["failed"] = 2
    assert markdown_of(old, new, compare(old, new)).startswith("## ❌ ")


def test_what_fits_is_shown_and_what_does_not_is_counted() -> None:
    old: Any = arms()
    new = copy.deepcopy(old)
    for check in new["robots"][0]["checks"]:
        check["failed"] = 2
    found = compare(old, new)
    whole = markdown_of(old, new, found)
    room = len(whole) + 100  # what is kept free for the last line
    assert markdown_of(old, new, found, room) == whole
    assert markdown_of(old, new, found, room - 1).endswith(
        "\n1 further change left out: the comment is full.\n"
    )
    assert len(markdown_of(old, new, found, room - 1)) <= room - 1
