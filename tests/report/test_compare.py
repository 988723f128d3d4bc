"""A comparison of reports finds each kind of change, and which changes are regressions."""

import copy
import math
from copy import deepcopy
from functools import reduce
from operator import getitem
from typing import Any, cast

import pytest

from tests.report.documents import arms, failing
from urdfkin.report.compare import compare, markdown_of, model_changes


def words(old: Any, new: Any, **how: Any) -> list[tuple[bool, str]]:
    return [(change.regression, str(change)) for change in compare(old, new, **how).changes]


def test_a_report_equals_itself_and_a_robot_in_a_renamed_file_is_recognized() -> None:
    assert compare(arms(), arms()).changes == ()
    moved = arms()
    moved["robots"][1]["source"] = "models/ur5_v2.urdf"
    assert words(arms(), moved) == [(False, "ur5: file: ur5 -> models/ur5_v2.urdf")]
    doubled = arms()
    ur5 = doubled["robots"].pop(1)
    doubled["robots"] += [ur5 | {"source": "first.urdf"}, ur5 | {"source": "second.urdf"}]
    assert (True, "ur5: robot: verified -> nothing") in words(arms(), doubled)


#: Changes: path in the document, new value (None: the entry is deleted), part of the line about the change.
WORSE: dict[str, tuple[tuple[Any, ...], Any, str]] = {
    "a robot is gone": (("robots", 1), None, "ur5: robot: verified -> nothing"),
    "failures": (("robots", 0, "checks", 0, "failed"), 2, "0 outside the bound -> 2 outside the bound"),
    "a quantity is gone": (("robots", 0, "checks", 0), None, "panda: placement: compared -> nothing"),
    "fewer results": (("robots", 0, "checks", 0, "results"), 224, "placement: 225 results -> 224 results"),
    "more": (("robots", 0, "checks", 0, "worst"), 100.0, "-> 100.00 eps*scale"),
    "beyond numbers": (("robots", 0, "checks", 0, "worst"), "no number", "-> inf eps*scale"),
    "a verdict": (("robots", 0, "verdict"), "not verified", "panda: verdict: verified -> not verified"),
    "an interrupt": (("interrupted",), True, "run: finished -> interrupted"),
}


@pytest.mark.slow
@pytest.mark.parametrize("what", WORSE)
def test_a_change_for_the_worse_is_a_regression_and_the_reverse_change_is_not(what: str) -> None:
    (*path, key), value, line = WORSE[what]
    spoiled: Any = arms()
    home = reduce(getitem, path, spoiled)
    if value is None:
        del home[key]
    else:
        home[key] = None if value == "no number" else value
    there = compare(arms(), spoiled)
    assert there.exit_code == 1
    assert any(change.regression and line in str(change) for change in there.changes), words(arms(), spoiled)
    back = compare(spoiled, arms())
    assert back.exit_code == 0
    assert len(back.changes) >= (what != "fewer results")


#: The worst disagreement before and after, the allowed factor, and whether the change is a regression.
GROWTH = [
    (10.0, 19.9, 2.0, False), (10.0, 20.0, 2.0, False), (10.0, 20.1, 2.0, True), (3.0, 6.1, 3.0, False),
    (0.1, 1.9, 2.0, False), (0.1, 2.1, 2.0, True),
]  # fmt: skip


@pytest.mark.parametrize(("before", "after", "factor", "regression"), GROWTH)
def test_growth_above_the_factor_and_above_a_single_rounding_is_a_regression(
    before: float, after: float, factor: float, regression: bool
) -> None:
    old, new = arms(), arms()
    for document, worst in ((old, before), (new, after)):
        document["robots"][0]["checks"][0]["worst"] = worst
    assert compare(old, new, factor).exit_code == int(regression)


def test_a_failed_run_and_fewer_samples_are_regressions() -> None:
    new = arms()
    new["robots_requested"] = 3
    line = "outcome: passed -> not passed, 1 of 3 robots without a report"
    assert (True, line) in words(arms(), new)
    assert compare(new, arms()).exit_code == 0
    new = arms()
    new["samples"] = 2
    assert (True, "samples: 6 -> 2") in words(arms(), new)
    assert (False, "samples: 2 -> 6") in words(new, arms())


def test_a_tiny_change_of_a_joint_is_reported() -> None:
    new: Any = arms()
    joint = new["robots"][1]["model"]["joints"][2]
    axis = joint["axis"]
    joint["axis"] = [-x for x in axis]
    joint["placement"][0][3] += 0.25
    joint["limit"]["upper"] = 1.5
    changed = {change.what: change for change in compare(arms(), new).changes}
    start = f"joint {joint['name']}, "
    assert changed.keys() == {start + "axis", start + "origin", start + "upper limit"}
    assert not any(change.regression for change in changed.values())
    assert changed[start + "axis"].robot == "ur5"
    assert changed[start + "axis"].new == "-z, rotated by 3.142 rad"
    assert changed[start + "origin"].new.endswith(": moved by 250 mm, rotated by 0 rad")
    assert changed[start + "upper limit"].new == "1.5"
    new = arms()
    joint = new["robots"][1]["model"]["joints"][2]
    joint["placement"][2][3] += 1e-11
    joint["axis"] = [0.0, math.sin(1e-11), math.cos(1e-11)]
    told = {change.what.rpartition(", ")[2]: str(change) for change in compare(arms(), new).changes}
    assert told["origin"].endswith(": moved by 1e-11 m, rotated by 0 rad")
    assert told["axis"].endswith("rotated by 1e-11 rad")


def test_a_changed_mimic_rule_and_a_missing_or_new_joint_are_reported() -> None:
    before, after = (cast("Any", arms())["robots"][1]["model"] for _ in range(2))
    before["joints"][2]["mimic"] = None
    after["joints"][2]["mimic"] = {"mimicked_joint": "wheel", "multiplier": -2.0, "offset": 0.25}
    (told,) = model_changes(before, after)
    assert told[0].endswith(", mimic rule")
    assert told[1:] == ("none", "-2 * wheel +0.25")
    new: Any = arms()
    joint = new["robots"][1]["model"]["joints"][2]
    name, joint["name"] = joint["name"], "other"
    lines = words(arms(), new)
    assert (False, f"ur5: joint {name}: revolute -> nothing") in lines
    assert (False, "ur5: joint other: nothing -> revolute") in lines


def test_a_wider_bound_and_tables_no_longer_compared_are_regressions() -> None:
    new: Any = arms()
    check = new["robots"][0]["checks"][1]
    check["bound"][1] *= 3.0
    old_words, new_words = (f"{d['robots'][0]['checks'][1]['bound'][1]:g} eps*scale" for d in (arms(), new))
    (found,) = map(str, compare(arms(), new).regressions)
    assert old_words in found
    assert found.endswith(new_words)
    assert compare(new, arms()).exit_code == 0
    new["robots"][0]["joints"].append("another")
    assert not any("bound" in str(change) for change in compare(arms(), new).regressions)
    new = arms()
    chain = new["robots"][0]["chains"][0]
    chain["samples"] = 0
    what = f"panda: tables from {chain['base']} to {chain['tip']}: compared -> nothing"
    assert (True, what) in words(arms(), new)
    del new["robots"][0]["chains"][0]
    assert (True, what) in words(arms(), new)
    assert compare(new, arms()).exit_code == 0


def test_a_quantity_no_longer_compared_with_the_second_oracle_is_a_regression() -> None:
    pair = {"failed": 0, "worst": 1.0, "bound_ratio": 0.1}
    alone = {"urdfkin": 0, "pinocchio": 0, "second_oracle": 0}
    second = {"by": "mujoco", "urdfkin": pair, "pinocchio": pair, "alone": alone, "undecided": 0}
    old: Any = arms()
    for check in old["robots"][0]["checks"][:2]:
        check["second_oracle"] = second
    assert words(old, arms()) == [(True, "panda: comparisons with mujoco: 2 -> nothing")]
    assert words(arms(), old) == [(False, "panda: comparisons with mujoco: nothing -> 2")]
    new = deepcopy(old)
    del new["robots"][0]["checks"][0]["second_oracle"]
    assert words(old, new) == [(True, "panda: comparisons with mujoco: 2 -> 1")]


def test_a_ratio_to_the_bound_above_a_tenth_that_grows_by_more_than_the_factor_is_a_regression() -> None:
    grown = (0.2, 0.41), (0.04, 0.11), (0.2, None)
    for share_old, share_new in (*grown, (0.2, 0.39), (0.01, 0.099)):
        old, new = arms(), arms()
        old["robots"][0]["checks"][0]["bound_ratio"] = share_old
        new["robots"][0]["checks"][0]["bound_ratio"] = share_new
        regression = (share_old, share_new) in grown
        assert bool(compare(old, new).regressions) is regression, (share_old, share_new)


def test_other_versions_settings_and_new_robots_are_no_regressions() -> None:
    new = arms()
    new["versions"]["pin"] = "4.99.0"
    new["seed"] = 7
    old = arms()
    del old["robots"][1]
    lines = words(old, new)
    assert (False, f"version of pin: {old['versions']['pin']} -> 4.99.0") in lines
    assert (False, "seed: 0 -> 7") in lines
    assert (False, "ur5: robot: nothing -> verified") in lines
    assert compare(old, new).exit_code == 0


def test_the_markdown_begins_with_regressions_and_counts_the_omitted_changes() -> None:
    found = compare(arms(), failing())
    markdown = markdown_of(arms(), failing(), found)
    lines = [line for line in markdown.splitlines() if "→" in line or line.startswith("| ")]
    assert markdown.startswith("## ❌ ")
    same = compare(arms(), arms())
    assert markdown_of(arms(), arms(), same).startswith("## ✅ No regression, 0 changes\n")
    assert "❌ regression" in lines[lines.index("| --- | --- | --- | --- |") + 1]
    assert len(markdown_of(arms(), failing(), found, max_characters=900)) <= 900
    old: Any = arms()
    new = copy.deepcopy(old)
    for check in new["robots"][0]["checks"]:
        check["failed"] = 2
    found = compare(old, new)
    whole = markdown_of(old, new, found)
    room = len(whole) + 100  # 100 characters are reserved for the last line
    assert markdown_of(old, new, found, room) == whole
    cut = markdown_of(old, new, found, room - 1)
    assert cut.endswith("\n1 further change left out: the comment is full.\n")
    assert len(cut) <= room - 1


def test_repeated_robots_are_numbered() -> None:
    old: Any = arms()
    old["robots"] = [copy.deepcopy(old["robots"][1]) for _ in range(4)]
    for place, name in enumerate(["ur5", "ur5 (2)", "ur5 (3)", "ur5 (4)"]):
        new = copy.deepcopy(old)
        new["robots"][place]["checks"][0]["results"] -= 1
        (line,) = (line for _, line in words(old, new) if "results" in line)
        assert line.startswith(f"{name}: ")


@pytest.mark.parametrize(("before", "after"), [(0, 1), (1, 0), (1, 3), (2, 1), (2, 2), (0, 0)])
def test_merged_findings_count_separately_and_notes_do_not_count(before: int, after: int) -> None:
    old: Any = arms()
    new = copy.deepcopy(old)
    finding = {"code": "URDF999", "severity": "warning", "other_lines": []}
    note = {"code": "URDF998", "severity": "note", "other_lines": []}
    old["robots"][0]["findings"] = [finding] * before
    new["robots"][0]["findings"] = [finding | {"other_lines": list(range(after - 1))}] * bool(after) + [note]
    found = [line for _, line in words(old, new) if "URDF99" in line]
    expected = f"panda: warning URDF999: {before or 'nothing'} -> {after or 'nothing'}"
    assert found == ([] if before == after else [expected])
