"""`urdfkin calibrate` writes the calibrated robot, and refuses an implausible calibration."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests import urdfs
from tests.calibration.arms import BRANCHED, bench
from tests.calibration.test_parameters import table
from tests.cli.running import Done, good, refused, urdfkin
from urdfkin.calibration.parameters import make_table_model
from urdfkin.dh.export import export
from urdfkin.dh.parse_table import read_table
from urdfkin.dh.table import DHConvention
from urdfkin.robot.loading import load


def words_of(folder: Path, shift: int = 0) -> tuple[list[str], Any]:
    """Return a command line for measured poses, whose q are shifted by some rows, and the measurement."""
    true = bench(BRANCHED, ("origins",), "hand", "trunk")
    (folder / "arm.urdf").write_text(BRANCHED)
    np.savez(folder / "poses.npz", q=np.roll(true.q, shift, axis=0), T=true.T)
    return ["calibrate", f"{folder}/arm.urdf", "--tip", "hand", "--poses", f"{folder}/poses.npz"], true


def test_calibrate_writes_a_urdf_and_prints_data(tmp_path: Path) -> None:
    (words, true), out = words_of(tmp_path), tmp_path / "new.urdf"
    assert "--output writes a URDF; use" in refused(*words, "-o", f"{tmp_path}/new.toml")
    done = good(*words, "--format", "json", "-o", str(out))
    assert done.data["rank"] == 14
    assert sum(one["fitted"] for one in done.data["parameters"]) == 14
    assert done.data["rms"]["after"]["metres"] < 1e-14
    assert np.abs(load(out).placement(true.q, "hand") - true.T).max() < 1e-13
    assert "measured on the bench" in out.read_text()
    shown = urdfkin(*words)
    assert "14 of 18 parameters identifiable, 4 fixed" in shown.text
    assert "verified by Pinocchio" in shown.text


@pytest.mark.slow
def test_an_implausible_calibration_is_written_only_with_force(tmp_path: Path) -> None:
    (words, _), out = words_of(tmp_path, shift=1), tmp_path / "new.urdf"
    done = urdfkin(*words, "-o", str(out))
    assert done.code == 3
    assert "likeliest reason: q is shifted by one row relative to the poses" in done.err
    assert "verified" not in done.text
    assert not out.exists()
    data = urdfkin(*words, "--format", "json").data
    assert data["likeliest_reason"].startswith("q is shifted by one row")
    assert "of the reach" in data["objections"][0]
    warning = good(*words, "--force", "-o", str(out)).err
    assert "urdfkin: warning: " in warning
    assert "refused" not in warning
    assert "--force" not in warning
    assert out.exists()


def test_the_calibration_of_a_table_file_writes_a_table(tmp_path: Path) -> None:
    drawn = table(DHConvention.STANDARD)
    model = make_table_model(drawn, ("origins",))
    truth = model.chain.initial_values + 1e-3
    q = np.random.default_rng(0).uniform(-1.0, 1.0, (20, 4))
    (tmp_path / "arm.toml").write_text(export(drawn, "toml"))
    np.savez(tmp_path / "poses.npz", q=q, T=model.chain.poses(q, truth))
    out = tmp_path / "new.toml"
    words = "calibrate", f"{tmp_path}/arm.toml", "--poses", f"{tmp_path}/poses.npz"
    assert "--output writes a table as TOML; use" in refused(*words, "-o", f"{tmp_path}/new.csv")
    good(*words, "-o", str(out))
    assert np.abs(read_table(out).placement(q) - model.chain.poses(q, truth)).max() < 1e-13


@pytest.mark.parametrize(
    "option",
    ["--lock joint_2=0.3", "--joints joint_2", "--no-mimic", "--root-joint floating", "--convention drake"],
)
def test_options_of_a_robot_are_refused_for_a_table(option: str, tmp_path: Path) -> None:
    drawn = table(DHConvention.STANDARD)
    (tmp_path / "arm.toml").write_text(export(drawn, "toml"))
    np.savez(tmp_path / "poses.npz", q=np.zeros((2, 4)), p=np.zeros((2, 3)))
    option = option.replace("joint_2", drawn.joint_names[1])
    words = refused("calibrate", f"{tmp_path}/arm.toml", *option.split(), "--poses", f"{tmp_path}/poses.npz")
    assert "does nothing for a table" in words


_COUPLED = urdfs.robot(
    urdfs.joint("one", "revolute", "a", "b", 'xyz="0.1 0.2 0.3"', "0 1 0", urdfs.limit()),
    urdfs.joint("two", "revolute", "b", "tip", 'xyz="0.3 0 0.1"', "1 0 0", urdfs.limit()),
    urdfs.joint("three", "revolute", "tip", "d", more=urdfs.mimic("two", -0.5, 0.2) + urdfs.limit()),
)


@pytest.mark.parametrize("convention", [None, "mujoco"])
def test_a_csv_of_poses_may_omit_a_floating_base_but_no_value_of_a_joint_that_mimics_the_path(
    convention: str | None, tmp_path: Path
) -> None:
    (tmp_path / "arm.urdf").write_text(_COUPLED)
    robot = load(_COUPLED, verify=False, root_joint="floating")
    q = robot.sample(20, seed=1)
    T = np.linalg.solve(robot.placement(q, "a"), robot.placement(q, "tip"))
    columns = dict(zip(robot.coordinate_names[-2:], q[:, -2:].T, strict=True)) | {
        "three": 0.2 - 0.5 * q[:, -1]
    }
    matrices = [f"T{i}{j}" for i in range(3) for j in range(4)]

    def calibrated(*joints: str) -> Done:
        rows = np.hstack([np.stack([columns[name] for name in joints], axis=-1), T[:, :3].reshape(20, 12)])
        path = tmp_path / "poses.csv"
        np.savetxt(path, rows, "%.17g", ",", header=",".join([*joints, *matrices]), comments="")
        words = "--tip", "tip", "--base", "a", "--root-joint", "floating", "--poses", str(path)
        how = () if convention is None else ("--convention", convention)
        return urdfkin("calibrate", f"{tmp_path}/arm.urdf", *words, *how)

    short = calibrated("two", "one")
    if convention is None:
        assert short.code == 0, short.err
    else:
        assert "missing: three" in short.err
        whole = calibrated("one", "three", "two")
        assert whole.code == 0, whole.err
