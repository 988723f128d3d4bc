"""A fit to wrong data is refused, and the error names the mistake; a good fit is never refused."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import urdfkin
from tests.calibration.arms import BRANCHED, Bench, bench, pose
from tests.calibration.test_parameters import table
from tests.reading import present
from urdfkin.calibration.calibrate import Calibration, ImplausibleError, calibrate
from urdfkin.calibration.parameters import make_table_model
from urdfkin.dh.table import DHConvention
from urdfkin.model.tree import FloatArray

pytestmark = pytest.mark.slow

ALL = ["base", "tool", "origins"]
#: URDF text or catalogue name, tip and base of each arm.
ARMS = {
    "ur5": ("ur5", "tool0", "base"),
    "panda": ("panda", "panda_hand", "panda_link0"),
    "z1": ("z1", "link06", "link00"),
    "branched": (BRANCHED, "hand", "trunk"),
    "through the trunk": (BRANCHED, "hand", "b"),
}
NAMES = [pytest.param(name, marks=pytest.mark.long if name in ("panda", "z1") else ()) for name in ARMS]


@cache
def arm(name: str) -> Bench:
    text, tip, base = ARMS[name]
    return bench(text, ("origins",), tip, base, poses=30)


def fitted(
    name: str, q: FloatArray, *, full_poses: bool = True, fit: list[str] | None = None, **how: Any
) -> Calibration:
    true = arm(name)
    T = pose(1, 2.0) @ true.noisy(1e-4, 2e-4, 3) @ pose(2, 0.2)
    wanted = ALL if fit is None else fit
    poses = T if "base" in wanted else true.noisy(1e-4, 2e-4, 3)
    return true.calibrate(poses if full_poses else poses[:, :3, 3], q, fit=wanted, **how)


def refused(name: str, q: FloatArray, **how: Any) -> str:
    with pytest.raises(ImplausibleError) as error:
        fitted(name, q, **how)
    return str(error.value)


def reason(name: str, q: FloatArray, **how: Any) -> str:
    return refused(name, q, **how).split("likeliest reason: ")[1]


@pytest.mark.parametrize("full_poses", [True, False])
@pytest.mark.parametrize("fit", [ALL, ["origins"]], ids=["anywhere", "origins"])
@pytest.mark.parametrize("name", NAMES)
def test_joint_angles_in_degrees_are_identified_as_the_mistake(
    name: str, fit: list[str], full_poses: bool
) -> None:
    true = arm(name)
    slides = [joint == "two" for joint in true.robot.coordinate_names]
    q = np.where(slides, true.q, np.degrees(true.q))
    assert reason(name, q, fit=fit, full_poses=full_poses).startswith("joint angles are in degrees")


def test_values_that_are_all_multiplied_by_180_over_pi_are_identified_as_the_mistake() -> None:
    name = "through the trunk"
    assert "multiplied by 180/pi" in reason(name, np.degrees(arm(name).q))


@pytest.mark.parametrize("full_poses", [True, False])
@pytest.mark.parametrize("by", [1, -1, 2])
@pytest.mark.parametrize("name", NAMES)
def test_shifted_rows_of_q_are_identified_as_the_mistake(name: str, by: int, full_poses: bool) -> None:
    said = reason(name, np.roll(arm(name).q, by, axis=0), full_poses=full_poses)
    rows = "one row" if abs(by) == 1 else "2 rows"
    row = f"i {'+' if by > 0 else '-'} {abs(by)}"
    words = f"q is shifted by {rows} relative to the poses; the correct q of pose i is in row {row}"
    assert said.startswith(words)


@pytest.mark.parametrize("fit", [ALL, ["origins"]], ids=["anywhere", "origins"])
@pytest.mark.parametrize("name", NAMES)
def test_the_joint_with_the_wrong_sign_is_named(name: str, fit: list[str]) -> None:
    true = arm(name)
    columns = true.model.coupling.q_index(true.robot.tree)
    for joint, column in zip(true.model.coupling.names, columns, strict=True):
        q = true.q.copy()
        q[:, column] *= -1.0
        said = refused(name, q, fit=fit)
        if "base" in fit and name == "branched" and joint in ("three", "four"):
            assert "the sign" in said  # it has the effect of another joint's zero and a free base or tool
        else:
            assert f"likeliest reason: the sign of joint {joint!r} is wrong" in said, said


def test_two_wrong_signs_are_named() -> None:
    q = arm("ur5").q * [1.0, -1.0, 1.0, 1.0, -1.0, 1.0]
    said = reason("ur5", q, fit=["origins"])
    assert said.startswith("the signs of joints 'shoulder_lift_joint', 'wrist_2_joint' are wrong")


def test_a_gain_or_a_tilted_axis_does_not_hide_a_wrong_sign() -> None:
    q = arm("ur5").q * [1.0, 1.0, -1.0, 1.0, 1.0, 1.0]
    assert "'elbow_joint' is wrong" in reason("ur5", q, fit=["origins", "gains"])
    q = arm("ur5").q
    assert "degrees" in reason("ur5", np.degrees(q), fit=["origins", "gains"])
    # A reversed axis fits measured positions exactly.
    q = arm("through the trunk").q.copy()
    q[:, arm("through the trunk").robot.coordinate_names.index("three")] *= -1.0
    said = refused("through the trunk", q, full_poses=False, fit=["origins"])
    assert "'three' is wrong" in said


def test_prismatic_joints_in_millimetres_are_identified_as_the_mistake() -> None:
    name = "through the trunk"
    slides = [joint == "two" for joint in arm(name).robot.coordinate_names]
    said = reason(name, np.where(slides, 1e3 * arm(name).q, arm(name).q))
    assert said.startswith("values of prismatic joints are in mill")


def test_data_for_a_table_are_checked_like_data_for_a_robot() -> None:
    drawn = table(DHConvention.STANDARD)
    model = make_table_model(drawn, ("origins",))
    q = np.random.default_rng(5).uniform(-1.5, 1.5, (40, 4))
    T = model.chain.poses(q, model.chain.initial_values + 1e-3)
    calibrate(drawn, q, T)
    with pytest.raises(ImplausibleError, match="q is shifted by one row"):
        calibrate(drawn, np.roll(q, 1, axis=0), T)
    with pytest.raises(ImplausibleError, match="the sign of joint"):
        calibrate(drawn, q * [1.0, -1.0, 1.0, 1.0], T)


@pytest.mark.parametrize("full_poses", [True, False])
@pytest.mark.parametrize("name", NAMES)
def test_good_data_are_never_refused(name: str, full_poses: bool) -> None:
    text, tip, base = ARMS[name]
    for error, noise, poses, seed in [
        (2e-3, 0.0, 20, 0),
        (0.0, 1e-3, 40, 1),  # calibrated already: the residuals are only noise
        (1e-3, 5e-3, 60, 2),
        (1e-2, 1e-4, 15, 3),
        (3e-2, 1e-5, 30, 4),
    ]:
        true = bench(text, ("origins",), tip, base, poses=poses, error=error, seed=seed)
        T = true.noisy(noise, noise, seed)
        for fit in (["origins"], ALL):
            found = true.calibrate(T if full_poses else T[:, :3, 3], fit=fit)
            assert not found.plausibility.objections


def test_unexplained_wrong_data_are_refused_without_a_likely_reason() -> None:
    q = np.random.default_rng(0).permutation(arm("ur5").q)
    said = refused("ur5", q)
    assert "of the reach" in said
    assert "do not explain the error" in said


def test_few_distinct_configurations_are_refused() -> None:
    q = arm("ur5").q
    true = np.tile(np.arange(4), 8)[:30]
    T = arm("ur5").noisy(1e-4, 1e-4, 0)[true]
    words = "4 distinct configurations among 30 poses give 24 numbers for 24"
    with pytest.raises(ImplausibleError, match=words):
        arm("ur5").calibrate(T, q[true])
    jittered = q[true] + 1e-8 * np.random.default_rng(0).standard_normal((30, 6))
    with pytest.raises(ImplausibleError, match="distinct configurations among 30 poses"):
        arm("ur5").calibrate(T, jittered)


def test_values_beyond_a_turn_are_refused_as_degrees_unless_declared_as_radians() -> None:
    true = arm("branched")
    q = true.q.copy()
    q[:, true.robot.coordinate_names.index("four")] += 4.0 * np.pi  # a continuous joint after two full turns
    said = refused("branched", q, fit=["origins"])
    assert "joint values of more than one turn look like degrees: joint 'four'" in said
    found = fitted("branched", q, fit=["origins"], radians=True)
    assert not found.plausibility.objections


@pytest.mark.parametrize("name", ["three", "tool"])
def test_a_tilted_axis_is_reported_even_if_the_joint_is_named_like_the_tool(name: str) -> None:
    text = BRANCHED.replace('"three"', f'"{name}"')
    true = urdfkin.load(text.replace('xyz="0.48 0.6 0.64"', 'xyz="0.6 0.48 -0.64"'))
    q = true.sample(60, seed=1)
    T = true.placement(q, "hand")
    p = T[:, :3, 3] + T[:, :3, :3] @ [0.05, 0.02, 0.1]
    found = calibrate(urdfkin.load(text), q, p, tip="hand", fit=["tool", "origins"], force=True)
    assert any(
        f"tilts the axis of joint {name!r}" in objection for objection in found.plausibility.objections
    )


def test_a_refused_fit_is_returned_with_force() -> None:
    found = fitted("ur5", np.roll(arm("ur5").q, 1, axis=0), force=True)
    assert found.plausibility.objections
    assert found.plausibility.reason is not None


def test_only_parameters_beyond_two_standard_deviations_are_written() -> None:
    names = [str(parameter) for parameter in arm("ur5").model.chain.parameters]
    truth = np.zeros(len(names))
    truth[names.index("elbow_joint y")] = 1e-3
    true, q = replace(arm("ur5"), truth=truth), arm("ur5").robot.sample(60, 5)
    T = true.poses(q)
    T[:, :3, 3] += 5e-5 * np.random.default_rng(1).standard_normal((60, 3))
    few, every = true.calibrate(T, q), true.calibrate(T, q, write_all=True)
    assert len(every.written_parameters) == every.identification.rank
    assert len(few.written_parameters) <= 4
    assert (present(every.full_fit).parameter_values == present(few.full_fit).parameter_values).all()
    # The written parameters move the tip as the true ones do, within the noise.
    found = few.model.chain.poses(true.values(q), present(few.written_fit).parameter_values)
    assert np.abs(found - true.poses(q)).max() < 1e-4
    assert set(few.origins) == {few.parameters[k].element for k in few.written_parameters}


CATALOGUE_ARMS = (
    *("ur3", "ur5", "ur10", "panda", "z1", "xarm7"),
    *("kinova", "so100", "talos_left_arm", "elbow", "polar"),
)


@pytest.mark.long
@settings(max_examples=16)
@given(
    name=st.sampled_from(CATALOGUE_ARMS),
    mistake=st.sampled_from(("none", "none", "degrees", "rows one later", "rows one earlier")),
    full_poses=st.booleans(),
    fit=st.sampled_from((["origins"], ALL)),
    poses=st.integers(25, 60),
    error=st.floats(-5.0, -2.5),
    noise=st.floats(-6.0, -3.0),
    seed=st.integers(0, 10**6),
)
def test_random_good_data_are_verified_and_random_wrong_data_refused(
    name: str,
    mistake: str,
    full_poses: bool,
    fit: list[str],
    poses: int,
    error: float,
    noise: float,
    seed: int,
) -> None:
    robot = urdfkin.load(name)
    tip, base = robot.tip_frame, robot.base_frame
    true = bench(name, ("origins",), tip, base, poses=poses, error=10.0**error, seed=seed)
    T = true.noisy(10.0**noise, 10.0**noise, seed)
    q = np.degrees(true.q) if mistake == "degrees" else true.q
    q = np.roll(q, {"rows one later": 1, "rows one earlier": -1}.get(mistake, 0), axis=0)
    measured = T if full_poses else T[:, :3, 3], q
    if mistake == "none":
        found = calibrate(robot, *measured[::-1], tip=tip, base=base, fit=fit)
        assert present(found.certificate).verified
    else:
        with pytest.raises(ImplausibleError):
            true.calibrate(*measured, fit=fit)
