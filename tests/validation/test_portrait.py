"""A report tells what a robot is: its parts, findings, tables that were checked, and where time went."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import urdfkin
from urdfkin.dh import dh_table
from urdfkin.validation import robot_summary as chains_module
from urdfkin.validation.campaign import validate
from urdfkin.validation.outcome import Verdict
from urdfkin.validation.robot_summary import MOST, chains_of
from urdfkin.validation.timings import Clock, total
from urdfkin.verify.pinocchio import PinocchioOracle


def test_the_chains_of_a_catalogues_robot_are_its_limbs_checked_in_both_conventions() -> None:
    robot = urdfkin.load("talos")
    chains: Any = chains_of(robot, robot.verifier.oracle())
    assert [chain["limb"] for chain in chains] == ["left_arm", "right_arm", "left_leg", "right_leg", "head"]
    for chain in chains:
        assert chain["samples"] >= 10
        assert 0.0 < chain["worst"] < 50.0
        assert chain["share_of_bound"] < 1.0
        joints = [row["joint"] for row in chain["standard"]["rows"]]
        assert joints == [row["joint"] for row in chain["modified"]["rows"]]


def test_another_robots_chains_are_its_leaves_one_for_each_set_of_joints() -> None:
    robot = urdfkin.load(urdfkin.load("talos").urdf)
    chains = chains_of(robot, None)
    sets = [tuple(row["joint"] for row in chain["standard"]["rows"]) for chain in chains]
    assert len(sets) == len(set(sets)) <= MOST
    assert all(chain["limb"] is None and chain["samples"] == 0 for chain in chains)


def test_a_floating_root_has_no_table_and_no_trouble() -> None:
    report = validate("ur5", samples=0, root_joint="floating")
    assert report.passed
    assert report.command == "urdfkin validate ur5 --samples 0 --seed 0 --root-joint floating"


def test_a_wrong_table_fails_its_robot(monkeypatch: pytest.MonkeyPatch) -> None:
    right = dh_table

    def wrong(*args: str) -> object:
        table = right(*args)  # type: ignore[arg-type]
        return replace(table, tool=table.tool @ shifted)

    shifted = np.eye(4)
    shifted[0, 3] = 1e-9
    monkeypatch.setattr(chains_module, "dh_table", wrong)
    robot = validate("ur5", samples=0).robots[0]
    assert robot.failed == 0
    assert robot.verdict is Verdict.DISAGREES


@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_of_both_conventions_the_worse_table_is_told(
    convention: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot, right = urdfkin.load("ur5"), dh_table
    good: Any
    (good,) = chains_of(robot, robot.verifier.oracle())

    def wrong(*args: str) -> object:
        table = right(*args)  # type: ignore[arg-type]
        return replace(table, tool=table.tool @ shifted) if args[-1] == convention else table

    shifted = np.eye(4)
    shifted[0, 3] = 1e-9
    monkeypatch.setattr(chains_module, "dh_table", wrong)
    bad: Any
    (bad,) = chains_of(robot, robot.verifier.oracle())
    assert bad["metres"] == pytest.approx(1e-9, rel=1e-3)
    assert bad["worst"] > 1e4 * good["worst"]
    assert bad["share_of_bound"] > 1.0 > good["share_of_bound"]


def test_time_is_told_by_whose_work_it_was() -> None:
    robot = validate("ur5", samples=10).robots[0]
    assert robot.clock is not None
    parts = robot.clock.as_dict()
    assert all(seconds > 0.0 for seconds in parts.values())
    np.testing.assert_allclose(sum(parts.values()), robot.seconds, rtol=0.02, atol=1e-3)
    both = total([Clock(1.0, 2.0, 3.0, 4.0), Clock(10.0, 20.0, 30.0, 40.0)])
    assert both == Clock(11.0, 22.0, 33.0, 44.0)


def test_what_must_agree_exactly_and_does_not_can_still_be_written(monkeypatch: pytest.MonkeyPatch) -> None:
    right = PinocchioOracle.placements

    def wrong(*args: object) -> object:
        T = right(*args).copy()  # type: ignore[arg-type]
        T[..., 3, 0] = 1e-3
        return T

    monkeypatch.setattr(PinocchioOracle, "placements", wrong)
    report = validate("ur5", samples=2)
    assert not report.passed
    text = json.dumps(report.as_dict(), allow_nan=False)
    check = next(c for c in json.loads(text)["robots"][0]["checks"] if c["quantity"] == "placement")
    assert check["worst"] is None
    assert check["share_of_bound"] is None
    assert check["failed"] == check["results"]
