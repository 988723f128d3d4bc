"""A comparison finds every kind of change, and calls a regression what is one and nothing else."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest

from tests.report.documents import arms, failing
from urdfkin.report.compare import compare, markdown_of, model_changes


def words(old: Any, new: Any, **how: Any) -> list[tuple[bool, str]]:
    return [(change.regression, str(change)) for change in compare(old, new, **how).changes]


def test_a_report_equals_itself() -> None:
    assert compare(arms(), arms()).changes == ()


def _drop_robot(d: Any) -> None:
    del d["robots"][1]


def _fail(d: Any) -> None:
    d["robots"][0]["checks"][0]["failed"] = 2


def _forget_quantity(d: Any) -> None:
    del d["robots"][0]["checks"][0]


def _fewer_results(d: Any) -> None:
    d["robots"][0]["checks"][0]["results"] -= 1


def _worse(d: Any) -> None:
    d["robots"][0]["checks"][0]["worst"] = 100.0


def _beyond_numbers(d: Any) -> None:
    d["robots"][0]["checks"][0]["worst"] = None


def _verdict(d: Any) -> None:
    d["robots"][0]["verdict"] = "not verified"


def _interrupt(d: Any) -> None:
    d["interrupted"] = True


def test_a_robot_is_known_again_in_a_file_of_another_name() -> None:
    moved = arms()
    moved["robots"][1]["source"] = "models/ur5_v2.urdf"
    assert words(arms(), moved) == [(False, "ur5: file: ur5 -> models/ur5_v2.urdf")]


def test_of_two_new_files_that_call_their_robot_alike_none_is_taken_for_the_old_one() -> None:
    doubled = arms()
    ur5 = doubled["robots"].pop(1)
    doubled["robots"] += [ur5 | {"source": "first.urdf"}, ur5 | {"source": "second.urdf"}]
    assert (True, "ur5: robot: verified -> nothing") in words(arms(), doubled)


WORSE: list[tuple[Callable[[Any], None], str]] = [
    (_drop_robot, "ur5: robot: verified -> nothing"),
    (_fail, "panda: placement: 0 outside the bound -> 2 outside the bound"),
    (_forget_quantity, "panda: placement: compared -> nothing"),
    (_fewer_results, "panda: placement: 225 results -> 224 results"),
    (_worse, "-> 100.00 eps*scale"),
    (_beyond_numbers, "-> inf eps*scale"),
    (_verdict, "panda: verdict: verified -> not verified"),
    (_interrupt, "run: finished -> interrupted"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("spoil", "line"), WORSE, ids=[spoil.__name__ for spoil, _ in WORSE])
def test_what_got_worse_is_a_regression_and_its_return_is_not(
    spoil: Callable[[Any], None], line: str
) -> None:
    spoiled = arms()
    spoil(spoiled)
    there = compare(arms(), spoiled)
    assert there.exit_code == 1
    assert any(change.regression and line in str(change) for change in there.changes), words(arms(), spoiled)
    back = compare(spoiled, arms())
    assert back.exit_code == 0
    assert len(back.changes) >= (0 if spoil is _fewer_results else 1)


def test_a_run_that_passed_and_does_not_is_a_regression_with_the_reason() -> None:
    new = arms()
    new["asked"] = 3
    line = "outcome: passed -> not passed, 1 of 3 robots without a report"
    assert (True, line) in words(arms(), new)
    assert compare(new, arms()).exit_code == 0


def test_a_robot_that_moves_otherwise_is_told_joint_by_joint_and_is_no_regression() -> None:
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


def test_a_change_too_small_for_the_words_of_a_pose_is_told_by_how_far_it_is() -> None:
    new: Any = arms()
    joint = new["robots"][1]["model"]["joints"][2]
    joint["placement"][2][3] += 1e-11
    joint["axis"] = [0.0, math.sin(1e-11), math.cos(1e-11)]
    told = {change.what.rpartition(", ")[2]: str(change) for change in compare(arms(), new).changes}
    assert told["origin"].endswith(": moved by 10 pm, rotated by 0 rad")
    assert told["axis"].endswith("rotated by 10 prad")


def test_a_joint_that_follows_another_way_is_told_as_a_rule() -> None:
    old: Any = arms()
    new: Any = arms()
    for document, mimic in ((old, None), (new, {"leader": "wheel", "multiplier": -2.0, "offset": 0.25})):
        document["robots"][1]["model"]["joints"][2]["mimic"] = mimic
    (told,) = model_changes(old["robots"][1]["model"], new["robots"][1]["model"])
    assert told[0].endswith(", mimic rule")
    assert told[1:] == ("none", "-2 * wheel +0.25")


def test_a_joint_that_is_gone_or_new_is_told_by_its_name() -> None:
    old: Any = arms()
    new: Any = arms()
    new["robots"][1]["model"]["joints"][2]["name"] = "other"
    name = old["robots"][1]["model"]["joints"][2]["name"]
    lines = words(arms(), new)
    assert (False, f"ur5: joint {name}: revolute -> nothing") in lines
    assert (False, "ur5: joint other: nothing -> revolute") in lines


def test_a_bound_that_is_wider_for_the_same_joints_is_a_regression() -> None:
    new: Any = arms()
    check = new["robots"][0]["checks"][1]
    check["bound"][1] *= 3.0
    old_words, new_words = (f"{d['robots'][0]['checks'][1]['bound'][1]:g} eps*scale" for d in (arms(), new))
    found = [str(change) for change in compare(arms(), new).regressions]
    assert len(found) == 1
    assert old_words in found[0]
    assert found[0].endswith(new_words)
    assert compare(new, arms()).exit_code == 0
    new["robots"][0]["joints"].append("another")
    assert not any("bound" in str(change) for change in compare(arms(), new).regressions)


def test_tables_that_are_compared_no_more_are_a_regression() -> None:
    new = arms()
    chain = new["robots"][0]["chains"][0]
    chain["samples"] = 0
    what = f"panda: tables from {chain['base']} to {chain['tip']}: compared -> nothing"
    assert (True, what) in words(arms(), new)
    del new["robots"][0]["chains"][0]
    assert (True, what) in words(arms(), new)
    assert compare(new, arms()).exit_code == 0


def test_a_share_of_the_bound_counts_from_the_factor_on_and_from_a_tenth() -> None:
    for share_old, share_new, regression in (
        (0.2, 0.39, False),
        (0.2, 0.41, True),
        (0.01, 0.099, False),
        (0.04, 0.11, True),
        (0.2, None, True),
    ):
        old, new = arms(), arms()
        old["robots"][0]["checks"][0]["share_of_bound"] = share_old
        new["robots"][0]["checks"][0]["share_of_bound"] = share_new
        assert bool(compare(old, new).regressions) is regression, (share_old, share_new)


def test_versions_settings_and_new_robots_are_changes_and_no_regressions() -> None:
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


def test_fewer_samples_are_a_regression_and_more_are_none() -> None:
    new = arms()
    new["samples"] = 2
    assert (True, "samples: 6 -> 2") in words(arms(), new)
    assert (False, "samples: 2 -> 6") in words(new, arms())


def test_growth_counts_from_the_factor_on_and_above_a_single_rounding() -> None:
    old, new = arms(), arms()
    for worst_old, worst_new, factor, regression in (
        (3.0, 5.9, 2.0, False),
        (3.0, 6.1, 2.0, True),
        (3.0, 6.1, 3.0, False),
        (0.1, 1.9, 2.0, False),
        (0.1, 2.1, 2.0, True),
    ):
        old["robots"][0]["checks"][0]["worst"] = worst_old
        new["robots"][0]["checks"][0]["worst"] = worst_new
        assert bool(compare(old, new, factor).regressions) is regression, (worst_old, worst_new, factor)


def test_findings_are_counted_by_code() -> None:
    new = arms()
    new["robots"][0]["findings"].append(
        {
            "code": "URDF999", "severity": "warning", "message": "m", "found": None, "remedy": None,
            "file": "f", "line": 1, "column": 1, "element": None, "name": None, "oracle": None, "also": [7],
        }
    )  # fmt: skip
    assert (False, "panda: warning URDF999: nothing -> 2") in words(arms(), new)


def test_the_markdown_leads_with_regressions_and_fits_a_comment() -> None:
    found = compare(arms(), failing())
    markdown = markdown_of(arms(), failing(), found)
    lines = [line for line in markdown.splitlines() if "→" in line or line.startswith("| ")]
    assert markdown.startswith("## ❌ ")
    assert "❌ regression" in lines[lines.index("| --- | --- | --- | --- |") + 1]
    assert len(markdown_of(arms(), failing(), found, limit=900)) <= 900
