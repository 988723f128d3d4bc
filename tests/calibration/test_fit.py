"""A calibration finds known errors up to the noise, with the stated covariance."""

import io
import re
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from tests import urdfs
from tests.calibration.arms import BRANCHED, Bench, bench, pose
from tests.calibration.test_parameters import table
from tests.reading import present
from urdfkin.calibration.calibrate import Calibration, calibrate, list_warnings
from urdfkin.calibration.fit import stack_jacobian
from urdfkin.calibration.parameters import make_table_model
from urdfkin.dh.table import DHConvention
from urdfkin.errors import InputError, UnknownNameError
from urdfkin.kinematics.rotation import log_rotation
from urdfkin.model.tree import FloatArray
from urdfkin.report.calibration import document
from urdfkin.report.listing import print_document
from urdfkin.robot.loading import load

ENDS = ("base", "tool")


def elsewhere(arm: Bench, at: FloatArray, n: int = 20) -> FloatArray:
    """Return poses (n, 4, 4) at configurations that were not measured."""
    return arm.model.chain.poses(arm.values(arm.robot.sample(n, 99)), at)


@pytest.mark.slow
@pytest.mark.parametrize("full_poses", [True, False])
@pytest.mark.parametrize(("arm", "tip", "base"), [("ur5", "tool0", "base"), (BRANCHED, "hand", "b")])
def test_without_noise_the_true_arm_is_identified_within_rounding(
    arm: str, tip: str, base: str, full_poses: bool
) -> None:
    true = bench(arm, ("origins",), tip, base)
    found = true.calibrate(true.T if full_poses else true.T[:, :3, 3])
    fitted = present(found.full_fit).parameter_values
    error = elsewhere(true, fitted) - elsewhere(true, true.truth)
    assert np.abs(error if full_poses else error[:, :3, 3]).max() < 1e-13
    assert present(found.certificate).verified
    written = load(found.updated_urdf.text, verify=False)
    q = true.robot.sample(20, 99)
    T = np.linalg.solve(written.placement(q, base), written.placement(q, tip))
    assert np.abs(T - elsewhere(true, fitted)).max() < 1e-13


@pytest.mark.slow
@pytest.mark.parametrize("full_poses", [True, False])
def test_any_pose_of_the_instrument_and_of_the_target_is_identified(full_poses: bool) -> None:
    true = bench("panda", ("origins",), "panda_hand", "panda_link0", poses=40)
    B, X = pose(1, 4.0), pose(2, 0.3)
    T = B @ true.T @ X
    poses = T if full_poses else T[:, :3, 3]
    found = true.calibrate(poses, fit=[*ENDS, "origins"])
    assert present(found.full_fit).rms()[0] < 1e-13
    rough = true.calibrate(poses, fit=ENDS)
    # The arm's errors of 2 mm and 2 mrad at each joint cause these errors.
    assert np.linalg.norm(present(rough.base)[:3, 3] - B[:3, 3]) < 0.02
    assert np.linalg.norm(present(rough.tool)[:3, 3] - X[:3, 3]) < 0.02


def test_a_target_far_from_the_tip_is_identified_from_positions() -> None:
    true = bench("panda", ("origins",), "panda_hand", "panda_link0", poses=40)
    B, X = pose(1, 4.0), pose(51, 3.0)
    found = true.calibrate((B @ true.T @ X)[:, :3, 3], fit=[*ENDS, "origins"])
    assert present(found.full_fit).rms()[0] < 1e-13


def test_a_fixed_joint_at_the_base_of_a_path_from_child_to_parent_is_identified() -> None:
    true = bench("ur5", ("origins",), "tool0", "base_link")
    found = calibrate(true.robot, true.q, np.linalg.inv(true.T), tip="base_link", base="tool0")
    assert present(found.full_fit).rms()[0] < 1e-13
    forward = true.calibrate()
    assert found.identification.rank == forward.identification.rank
    assert set(found.origins) == set(forward.origins)


def test_joints_named_base_and_tool_are_not_confused_with_the_base_and_the_tool() -> None:
    text = BRANCHED.replace('"three"', '"base"').replace('"four"', '"tool"')
    true = bench(text, ("origins",), "hand", "trunk")
    B, X = pose(1, 4.0), pose(2, 0.3)
    found = true.calibrate(B @ true.T @ X, fit=[*ENDS, "origins"])
    assert present(found.full_fit).rms()[0] < 1e-13
    assert set(found.origins) <= {"base", "tool", "fix"}
    assert np.abs(present(found.base) - B).max() < 0.05


def test_joint_offsets_alone_are_identified() -> None:
    true = bench(BRANCHED, ("offsets",), "hand", "trunk", error=0.05)
    found = true.calibrate(fit=["offsets"])
    assert [str(parameter) for parameter in found.parameters] == ["three rz", "four rz"]
    np.testing.assert_allclose(found.changes, true.truth, atol=1e-14)


def test_the_fits_of_a_calibration_share_no_array_of_values() -> None:
    true = bench(BRANCHED, ("base",), "hand", "trunk")
    found = true.calibrate(fit=["base"])
    before, fitted = present(found.base_tool_fit), present(found.full_fit)
    assert not np.shares_memory(before.parameter_values, fitted.parameter_values)


def test_gains_are_identified_and_not_written() -> None:
    true = bench("ur5", ("gains",), "tool0", "base", error=1e-3)
    found = true.calibrate(fit=["gains"])
    np.testing.assert_allclose(found.changes, true.truth, atol=1e-14)
    assert found.updated_urdf.text == true.robot.urdf.encode()
    words = "these gains are not written, because neither a URDF nor a table can store them: "
    assert any(line.startswith(words) for line in list_warnings(found))


@pytest.mark.parametrize("convention", list(DHConvention))
def test_the_cells_of_a_table_are_identified_with_beta_for_parallel_axes(convention: DHConvention) -> None:
    drawn = table(convention)
    model = make_table_model(drawn, ("origins",))
    truth = model.chain.initial_values + 2e-3 * np.random.default_rng(4).standard_normal(
        len(model.chain.initial_values)
    )
    q = np.random.default_rng(5).uniform(-1.5, 1.5, (40, 4))
    found = calibrate(drawn, q, model.chain.poses(q, truth))
    assert found.table is not None
    assert present(found.full_fit).rms()[0] < 1e-14
    np.testing.assert_allclose(found.table.placement(q), model.chain.poses(q, truth), atol=1e-13)
    assert found.table.convention is convention
    assert max(abs(row.d) for row in found.table.rows) < 0.5


def whitened(true: Bench, found: Calibration) -> float:
    """Return chi^2, of 6 numbers, of the tip's pose error at a configuration that was not measured."""
    fitted, q = present(found.full_fit), true.robot.sample(1, 99)
    T, columns = found.model.chain.poses_and_jacobian(true.values(q), fitted.parameter_values)
    J = columns[0][:, list(found.identification.free_parameters)]
    S = true.poses(q)
    error = np.hstack([S[0, :3, 3] - T[0, :3, 3], log_rotation(S[0, :3, :3] @ T[0, :3, :3].T)])
    return float(error @ np.linalg.solve(J @ fitted.covariance @ J.T, error))


@pytest.mark.slow
def test_the_stated_covariance_and_noise_agree_with_repeated_calibrations() -> None:
    true = bench("ur5", ("origins",), "tool0", "base", poses=40)
    metres, radians = 2e-4, 5e-4
    every = [true.calibrate(true.noisy(metres, radians, seed)) for seed in range(20)]
    # chi^2 of 120 has the standard deviation 15.5; that of estimated noise is a little wider.
    assert 75.0 < sum(whitened(true, found) for found in every) < 180.0
    noise = np.array([(f.full_fit.noise.metres, f.full_fit.noise.radians) for f in every if f.full_fit])
    np.testing.assert_allclose(np.sqrt((noise**2).mean(axis=0)), [metres, radians], rtol=0.05)
    # An outlier is reported wrongly in one of a hundred data sets.
    assert sum(bool(found.outliers) for found in every) <= 2
    T = true.noisy(1e-4, 1e-4, 0)
    stated = true.calibrate(T, noise=(1e-4, 1e-4))
    fitted = present(stated.full_fit)
    assert abs(fitted.noise_ratio - 1.0) < 4.0 * fitted.noise_ratio_deviation
    assert not list_warnings(stated)
    wrong = true.calibrate(T, noise=(4e-5, 4e-5))
    assert re.match(r"the residuals are 2\.[3-7]\d* times the stated noise", list_warnings(wrong)[0])


@pytest.mark.slow
def test_outliers_are_reported_and_excluded_only_on_request() -> None:
    true = bench("ur5", ("origins",), "tool0", "base", poses=60)
    T = true.noisy(1e-4, 2e-4, 7)
    T[17, :3, 3] += [5e-3, 0.0, 0.0]
    T[40, 0, 3] -= 4e-3
    found = true.calibrate(T)
    assert found.outliers == (17, 40)
    assert "poses 17, 40 are outliers: the rms error is " in list_warnings(found)[0]
    clean = true.calibrate(T, drop_outliers=True)
    fits = present(found.full_fit), present(clean.full_fit)
    assert [len(fit.residuals) for fit in fits] == [60, 58]
    assert fits[1].noise.metres < 1.2e-4 < fits[0].noise.metres
    assert list_warnings(clean) == ["poses 17, 40 are excluded as outliers"]


@pytest.mark.slow
@pytest.mark.parametrize("seed", [9, 16])
def test_a_large_outlier_does_not_turn_good_poses_into_outliers(seed: int) -> None:
    # The target is on the last axis. The outlier makes parameters of this axis seem identifiable.
    robot, generator = load("ur5"), np.random.default_rng(seed)
    q = robot.sample(30, seed=seed)
    p = robot.placement(q, "tool0")[:, :3, 3] + 1e-4 * generator.normal(size=(30, 3))
    p[7, 0] += 0.01
    found = calibrate(robot, q, p, tip="tool0", fit=["origins"], noise=(1e-4, 3e-4), force=True)
    assert found.outliers == (7,)


@pytest.mark.slow
def test_excluding_an_outlier_gives_the_same_fit_as_data_without_this_pose() -> None:
    robot = load("ur5")
    q = robot.sample(30, seed=15)
    p = robot.placement(q, "tool0")[:, :3, 3] + 1e-4 * np.random.default_rng(5).standard_normal((30, 3))
    p[7, 0] += 0.01
    options: dict[str, Any] = {"tip": "tool0", "noise": (1e-4, 1e-4), "write_all": True}
    found = calibrate(robot, q, p, drop_outliers=True, **options)
    assert found.outliers == (7,)
    others = np.arange(30) != 7
    expected = calibrate(robot, q[others], p[others], **options)
    # With the outlier, 27 parameters seem identifiable.
    assert found.identification.rank == expected.identification.rank == 25
    np.testing.assert_array_equal(found.changes, expected.changes)


def test_a_path_without_parameters_is_refused() -> None:
    robot = load("ur5")
    base = robot.base_frame
    with pytest.raises(InputError, match="base_link to base_link: the path has no parameters to fit"):
        calibrate(robot, fit=["offsets"], tip=base, base=base)


def test_a_fit_without_redundant_measurements_is_refused() -> None:
    true = bench("ur5", ("origins",), "tool0", "base", poses=5)
    T = true.noisy(1e-4, 1e-4, 0)
    with pytest.raises(InputError, match="the fit cannot be checked") as caught:
        true.calibrate(T)
    assert "likeliest reason: too few different configurations; measure poses at" in str(caught.value)
    found = true.calibrate(T, force=True)
    assert found.identification.rank == 30
    assert found.written_parameters == ()
    out = io.StringIO()
    print_document(Console(file=out, width=200), document(found))
    assert "noise: unknown, because there are no redundant measurements" in out.getvalue()
    assert not np.isfinite(found.standard_deviations[list(found.identification.free_parameters)]).any()
    assert any("the fit cannot be checked" in line for line in list_warnings(found))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"poses": np.zeros((3, 2))}, "(n, 3) for positions"),
        ({"poses": np.zeros((2, 4, 4))}, "a pose must be a rotation"),
        ({"poses": np.zeros((2, 3))}, "the number of poses and the number of configurations differ"),
        ({"q": np.zeros((0, 6)), "poses": np.zeros((0, 3))}, "no poses"),
        ({"poses": None}, "`q` and `poses` must be given together"),
        ({"q": np.eye(3, 6), "poses": 1e3 * np.eye(3)}, "add --unit mm"),
        ({"noise": (0.0, 1.0)}, "`noise` must be positive"),
        ({"noise": 1.0}, "`noise` must be two numbers"),
        ({"fit": []}, "no parameters to fit"),
        ({"fit": "origins"}, "must be a list of names"),
        ({"tip": 5}, "tip must be a name"),
    ],
)
def test_invalid_calibration_input_is_reported(change: dict[str, object], words: str) -> None:
    arguments = {"q": np.zeros((3, 6)), "poses": np.eye(3), "tip": "tool0"} | change
    with pytest.raises(InputError) as error:
        calibrate(load("ur5", verify=False), **arguments)  # type: ignore[arg-type]
    assert words in str(error.value)


def test_a_target_beside_the_axis_of_a_turntable_is_not_taken_for_millimetres() -> None:
    axis = urdfs.joint("turn", "continuous", "a", "table", 'xyz="0.1 0.2 0.3" rpy="0.3 0.2 0.1"', "0 0 1")
    robot = load(urdfs.robot(axis), verify=False)
    q = np.linspace(-3.0, 3.0, 20)[:, np.newaxis]
    poses = robot.placement(q, "table") @ pose(2, 0.3)
    found = calibrate(robot, q, poses, tip="table", fit=["tool", "origins"])
    assert present(found.full_fit).rms()[0] < 1e-14
    millimetres = poses.copy()
    millimetres[:, :3, 3] *= 1e3
    with pytest.raises(InputError, match="add --unit mm"):
        calibrate(robot, q, millimetres, tip="table", fit=["tool", "origins"])


def test_configurations_of_a_robot_or_a_table_can_be_given_by_name() -> None:
    class Table:
        """A table with columns in another order than the robot's coordinates."""

        def __init__(self, columns: dict[str, FloatArray]) -> None:
            self.columns, self._by_name = list(columns), columns

        def __getitem__(self, name: str) -> FloatArray:
            return self._by_name[name]

        def __array__(self, dtype: object = None, copy: object = None) -> FloatArray:
            return np.stack(list(self._by_name.values()), axis=-1)

    robot, dh = load("ur5", verify=False), table(DHConvention.STANDARD)
    q = robot.sample(20, seed=1)
    for source, names in ((robot, robot.coordinate_names), (dh, dh.joint_names)):
        values = q[:, : len(names)]
        poses = robot.placement(q, "tool0") if source is robot else dh.placement(values)
        named = dict(zip(names, values.T, strict=True))
        right = calibrate(source, values, poses, fit=["offsets"])
        for given in (named, Table(dict(reversed(named.items())))):
            found = calibrate(source, given, poses, fit=["offsets"])  # type: ignore[arg-type]
            assert (found.changes == right.changes).all()


def test_a_joint_value_of_a_table_must_be_finite() -> None:
    dh = table(DHConvention.STANDARD)
    q = np.random.default_rng(0).uniform(-1.0, 1.0, (20, len(dh.joint_names)))
    poses = dh.placement(q)
    q[3, 1] = np.nan
    with pytest.raises(InputError, match="q must be finite: found nan"):
        calibrate(dh, q, poses, fit=["offsets"])


def test_an_unknown_set_of_parameters_lists_similar_names() -> None:
    with pytest.raises(UnknownNameError, match="offsets"):
        calibrate("ur5", fit=["offset"])


# -- identifiable parameters ----------------------------------------------------------------------


ARMS = {"ur5": ("tool0", "base"), "panda": ("panda_hand", "panda_link0"), BRANCHED: ("hand", "b")}


@pytest.mark.slow
@pytest.mark.parametrize("full_poses", [True, False])
@pytest.mark.parametrize("arm", ARMS, ids=["ur5", "panda", "branched, up and down"])
def test_a_revolute_joint_has_four_identifiable_parameters_and_a_prismatic_one_two(
    arm: str, full_poses: bool
) -> None:
    tip, base = ARMS[arm]
    robot = load(arm, verify=False)
    found = calibrate(robot, tip=tip, base=base, fit=["base", "tool", "origins"], full_poses=full_poses)
    kinds = [joint.kind.turns for joint in robot.chain(tip, base).joints]
    law = sum(4 if turns else 2 for turns in kinds) + 6 - (0 if full_poses else 3)
    assert found.identification.rank == law
    assert len(found.identification.fixed_parameters) == len(found.parameters) - law
    gains = calibrate(
        robot, tip=tip, base=base, fit=["base", "tool", "origins", "gains"], full_poses=full_poses
    )
    assert gains.identification.rank == law + len(kinds)


def test_no_fitted_parameter_must_be_large_to_replace_a_fixed_parameter() -> None:
    # With nearly parallel axes, four parameters could become hundreds of metres long.
    arm = bench("ur5", ("origins",), "tool0", "base", poses=40, error=1e-3)
    true = arm.calibrate()
    told = calibrate(true.updated_urdf.text, tip="tool0", base="base")
    J = stack_jacobian(told.model, arm.values(arm.q), full_poses=True)
    kept, still = list(told.identification.free_parameters), list(told.identification.fixed_parameters)
    shares = np.linalg.lstsq(J[:, kept], J[:, still], rcond=None)
    assert np.abs(J[:, kept] @ shares[0] - J[:, still]).max() < 1e-11
    assert np.abs(shares[0]).max() < 4.0


def test_each_fixed_parameter_states_the_parameter_with_the_same_effect() -> None:
    found = calibrate("ur5", tip="tool0", base="base", fit=["base", "origins"], full_poses=False)
    reasons = {str(found.parameters[k]): why for k, why in found.identification.fixed_parameters.items()}
    assert reasons["shoulder_pan_joint rz"] == "same effect as base rz"
    assert reasons["elbow_joint z"] == "same effect as shoulder_lift_joint z"
    assert reasons["wrist_3_link-tool0_fixed_joint rx"] == "no effect on the measured numbers"


@pytest.mark.slow
def test_random_poses_with_a_target_on_the_last_axis_do_not_lack_variety() -> None:
    robot = load("ur5")
    q = robot.sample(60, seed=0)
    p = robot.placement(q, "tool0")[:, :3, 3] + 1e-4 * np.random.default_rng(0).standard_normal((60, 3))
    found = calibrate(robot, q, p, tip="tool0")
    assert found.identification.rank == found.general_identification.rank == 25
    assert list_warnings(found) == []


def test_a_joint_without_motion_in_the_poses_is_reported() -> None:
    arm = bench("ur5", ("origins",), "tool0", "base", poses=40)
    q = arm.q.copy()
    q[:, 2] = 0.4
    found = arm.calibrate(arm.poses(q), q)
    assert found.identification.rank == 26
    words = (
        "26 parameters are identifiable from these poses; 4 more would be identifiable from more varied poses"
    )
    assert any(words in line for line in list_warnings(found))


@pytest.mark.slow
def test_poorly_observable_parameters_are_reported() -> None:
    arm = bench("ur5", ("origins",), "tool0", "base", poses=40)
    q = arm.q.copy()
    q[:, 2] = 0.4 + 1e-3 * q[:, 2]
    found = arm.calibrate(arm.poses(q), q)
    assert found.identification.rank == 30
    (line,) = list_warnings(found)
    assert line.startswith("poorly observable: elbow_joint")
    assert not list_warnings(arm.calibrate())
