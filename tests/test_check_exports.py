"""The check of exported files in a library's own environment."""

import json
import math
from pathlib import Path
from typing import Any

import pytest

import urdfkin
from scripts import check_exports
from scripts.run_exported import max_error_ratio
from urdfkin.export import exact

#: An interpreter whose library accepts every file; of each run it stores the files that it was given.
_INTERPRETER = """#!/bin/sh
if [ "$1" = -c ]; then echo 'jax 1.0'; exit; fi
shift
library="$1"
shift
for path in "$@"; do
    name=$(basename "$path" .py)
    echo "$name" >> {folder}/ran
    echo "{{\\"file\\": \\"$name\\", \\"library\\": \\"$library\\", \\"share\\": {share}}}"
done
"""


def environment(folder: Path, share: float) -> Path:
    """Return an environment with such an interpreter, which reports one share of the bound."""
    python = folder / "bin" / "python"
    python.parent.mkdir(exist_ok=True)
    python.write_text(_INTERPRETER.format(folder=folder, share=share), encoding="utf-8")
    python.chmod(0o755)
    return folder


@pytest.mark.slow
def test_a_stopped_run_in_a_library_continues_with_the_remaining_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot, keep = urdfkin.load("planar_two_link"), tmp_path / "jax.jsonl"
    monkeypatch.setattr(check_exports, "leaf_frames", lambda tips: iter([("arm", robot, "tip")]))
    for to, library, share in (("jax", "jax", 0.5), ("array", "torch", 7.0)):
        line = {"file": f"planar_two_link_tip_0_{to}", "library": library, "share": share}
        with keep.open("a", encoding="utf-8") as file:
            file.write(f"{json.dumps(line)}\n")
    assert check_exports.check_library("jax", environment(tmp_path, 0.9), None, keep) == 0
    assert (tmp_path / "ran").read_text("utf-8").split() == ["planar_two_link_tip_0_array"]
    assert len(check_exports.read_lines(keep)) == 3
    assert check_exports.check_library("jax", environment(tmp_path, 0.9), None, keep) == 0
    assert len(check_exports.read_lines(keep)) == 3


@pytest.mark.slow
def test_a_number_outside_the_bound_fails_the_run_in_a_library(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = urdfkin.load("planar_two_link")
    monkeypatch.setattr(check_exports, "leaf_frames", lambda tips: iter([("arm", robot, "tip")]))
    assert check_exports.check_library("jax", environment(tmp_path, 1.5), None, None) == 1


def test_leaves_come_in_one_random_order_after_the_tips(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(check_exports, "example_robot_data_names", lambda: ("hyq", "ur5"))
    names = [(name, frame) for name, _, frame in check_exports.leaf_frames(tips=False)]
    tips = [(name, frame) for name, _, frame in check_exports.leaf_frames(tips=True)]
    robots = {name: urdfkin.load(name) for name in ("hyq", "ur5")}
    in_order = [(name, x.tree.frame_name(leaf)) for name, x in robots.items() for leaf in x.tree.leaves()]
    assert tips == [(name, robot.tip_frame) for name, robot in robots.items()]
    assert names[:2] == tips
    assert set(names) == {*in_order, *tips}
    assert len(names) == len(set(names)) == 8
    assert names == [(name, frame) for name, _, frame in check_exports.leaf_frames(tips=False)]
    assert names[2:] != [one for one in in_order if one not in tips]


@pytest.mark.slow
def test_exact_code_is_checked_with_its_own_proof(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = urdfkin.load("planar_two_link")
    made: Any = exact.make_exact_functions
    found = check_exports.check_frame(robot, "tip", ["sympy-exact"])
    assert found.pop("good")
    assert 0.0 <= found.pop("sympy-exact float64") < 1e-30
    assert not found
    monkeypatch.setattr(exact, "make_exact_functions", lambda *given: made(*given[:-1], False))
    assert not check_exports.check_frame(robot, "tip", ["sympy-exact"])["good"]


@pytest.mark.parametrize("numbers", [[math.nan, 1.0], [1.0, math.nan], [1.0, math.nan, 1.0]])
def test_a_nan_is_the_largest_error_also_if_numbers_follow_it(numbers: list[float]) -> None:
    ones = [1.0] * len(numbers)
    assert math.isnan(max_error_ratio([numbers], [ones], [ones], 2.0**-52))
    assert math.isnan(max_error_ratio([numbers, ones], [ones, ones], [ones, ones], 2.0**-52))
