"""How many numbers poses can tell is known for every arm; what stands still does what others do."""

from __future__ import annotations

import numpy as np
import pytest

from tests.calibration.arms import BRANCHED, bench
from urdfkin.calibration.calibrate import calibrate, doubts
from urdfkin.calibration.fit import stacked
from urdfkin.robot.loading import load

ARMS = {"ur5": ("tool0", "base"), "panda": ("panda_hand", "panda_link0"), BRANCHED: ("hand", "b")}


@pytest.mark.slow
@pytest.mark.parametrize("complete", [True, False])
@pytest.mark.parametrize("arm", ARMS, ids=["ur5", "panda", "branched, up and down"])
def test_turning_joints_have_four_numbers_sliding_ones_two_and_the_tip_six(arm: str, complete: bool) -> None:
    tip, base = ARMS[arm]
    robot = load(arm, verify=False)
    found = calibrate(robot, tip=tip, base=base, fit=["base", "tool", "origins"], complete=complete)
    kinds = [joint.kind.turns for joint in robot.chain(tip, base).joints]
    law = sum(4 if turns else 2 for turns in kinds) + 6 - (0 if complete else 3)
    assert found.identification.rank == law
    assert len(found.identification.still) == len(found.parameters) - law
    gains = calibrate(robot, tip=tip, base=base, fit=["base", "tool", "origins", "gains"], complete=complete)
    assert gains.identification.rank == law + len(kinds)


def test_no_kept_parameter_has_to_be_large_for_one_that_stands_still() -> None:
    # Axes that are nearly parallel, and nearly square: where four parameters need hundreds of metres.
    arm = bench("ur5", ("origins",), "tool0", "base", poses=40, error=1e-3)
    true = calibrate(arm.robot, arm.q, arm.T, tip="tool0", base="base")
    told = calibrate(true.written.text, tip="tool0", base="base")
    values = told.model.coupling.values(told.model.coupling.select(arm.robot.tree, arm.q))
    J = stacked(told.model, values, complete=True)
    kept, still = list(told.identification.kept), list(told.identification.still)
    shares = np.linalg.lstsq(J[:, kept], J[:, still], rcond=None)
    assert np.abs(J[:, kept] @ shares[0] - J[:, still]).max() < 1e-11
    assert np.abs(shares[0]).max() < 4.0


def test_what_stands_still_says_what_does_the_same() -> None:
    found = calibrate("ur5", tip="tool0", base="base", fit=["base", "origins"], complete=False)
    reasons = {str(found.parameters[k]): why for k, why in found.identification.still.items()}
    assert reasons["shoulder_pan_joint rz"] == "same effect as base rz"
    assert reasons["elbow_joint z"] == "same effect as shoulder_lift_joint z"
    assert reasons["wrist_3_link-tool0_fixed_joint rx"] == "no effect on the measured numbers"


def test_a_joint_that_never_moved_is_told_of() -> None:
    arm = bench("ur5", ("origins",), "tool0", "base", poses=40)
    q = arm.q.copy()
    q[:, 2] = 0.4
    values = arm.model.coupling.values(arm.model.coupling.select(arm.robot.tree, q))
    found = calibrate(arm.robot, q, arm.model.way.poses(values, arm.truth), tip="tool0", base="base")
    assert found.identification.rank == 26
    assert any(
        "26 parameters are identifiable from these poses; more varied poses would identify 4 more: " in line
        for line in doubts(found)
    )


@pytest.mark.slow
def test_poses_that_hardly_excite_a_parameter_are_told_of() -> None:
    arm = bench("ur5", ("origins",), "tool0", "base", poses=40)
    q = arm.q.copy()
    q[:, 2] = 0.4 + 1e-3 * q[:, 2]
    values = arm.model.coupling.values(arm.model.coupling.select(arm.robot.tree, q))
    T = arm.model.way.poses(values, arm.truth)
    found = calibrate(arm.robot, q, T, tip="tool0", base="base")
    assert found.identification.rank == 30
    (line,) = doubts(found)
    assert line.startswith("poorly observable: elbow_joint")
    assert not doubts(calibrate(arm.robot, arm.q, arm.T, tip="tool0", base="base"))
