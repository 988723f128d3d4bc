"""`urdfkin placement --as`, `analytical-jacobian`, `acceleration --breakdown`, and a moving base."""

import csv
import io
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import urdfkin as library
from tests.cli.running import good, numbers, refused, urdfkin
from urdfkin.cli import quantity
from urdfkin.cli.quantity import REPRESENTATIONS
from urdfkin.kinematics import rotation
from urdfkin.kinematics.rotation import EULER_SEQUENCES
from urdfkin.model.base_motion import BaseMotion
from urdfkin.model.tree import FloatArray

#: A pose 1 m above the origin, rotated by 30 degrees about z
MOVED = "0,0,1,0,0,0.5235987755982988"


@pytest.mark.slow
@pytest.mark.parametrize("written", ["rpy", "quaternion"])
@pytest.mark.parametrize("relative_to", ["", "forearm_link"])
def test_rpy_and_quaternion_output_give_the_same_pose_as_the_matrix(written: str, relative_to: str) -> None:
    line = "placement ur5 --q random:3" + f" --relative-to {relative_to}" * bool(relative_to)
    T = np.array(urdfkin(f"{line} --format json").data["result"])
    done = urdfkin(f"{line} --format json --as {written}")
    found = np.array(done.data["result"])
    assert done.data["verified"] is True
    assert done.data.get("relative_to", "") == relative_to
    np.testing.assert_array_equal(found[:, :3], T[:, :3, 3])
    turn = Rotation.from_euler("xyz", found[:, 3:]) if written == "rpy" else Rotation.from_quat(found[:, 3:])
    np.testing.assert_allclose(turn.as_matrix(), T[:, :3, :3], atol=1e-15)
    rows = urdfkin(f"{line} --format csv --as {written}").rows
    assert rows[0] == ["sample", *done.data["rows"]]
    np.testing.assert_array_equal(np.array(rows[1:], dtype=float)[:, 1:], found)


def test_the_table_states_origin_and_units_and_a_base_with_relative_to_is_refused() -> None:
    text = urdfkin("placement ur5 --relative-to forearm_link").text
    assert "ur5: placement of tool0, relative to forearm_link" in text
    assert "axis of forearm_link" in text
    assert "roll, pitch, yaw [rad]" in urdfkin("placement ur5 --as rpy").text
    assert "qw" in urdfkin("placement ur5 --as quaternion").text
    err = refused("placement ur5 --relative-to base_link --base-placement", MOVED)
    assert "--base-placement does nothing with --relative-to" in err


def test_a_wrong_conversion_to_rpy_is_a_disagreement(monkeypatch: pytest.MonkeyPatch) -> None:
    right = rotation.rpy_of
    monkeypatch.setattr(rotation, "rpy_of", lambda R: right(R)[..., ::-1])
    done = urdfkin("placement ur5 --q random --as rpy")
    assert (done.code, done.out) == (1, b"")
    assert "the orientation of tool0 (rpy) disagrees with Pinocchio's" in done.err
    (again,) = re.findall("reproduce the difference with: urdfkin (.*)", done.err)
    monkeypatch.undo()
    assert urdfkin(again).code == 0


def test_rpy_output_is_correct_in_gimbal_lock() -> None:
    angles = [0.3, 1.5707963267948966, 0.2]
    pose = numbers([0, 0, 0, *angles])
    done = good(f"placement ur5 --base-placement {pose} --frame base_link --as rpy --format json")
    turn, expected = (Rotation.from_euler("xyz", x) for x in (done.data["result"][0][3:], angles))
    np.testing.assert_allclose(turn.as_matrix(), expected.as_matrix(), atol=1e-15)


# -- the analytical Jacobian ---------------------------------------------------------------------------


@pytest.mark.parametrize("representation", ["ZYZ", "xyz", "quaternion"])
def test_the_analytical_jacobian_equals_the_librarys_and_has_named_rows(representation: str) -> None:
    words = ["analytical-jacobian", "ur5", "--q", "random:2", "--representation", representation]
    done = urdfkin(*words, "--format", "json")
    assert (done.code, done.data["representation"]) == (0, representation)
    J = library.load("ur5").analytical_jacobian(done.data["q"], "tool0", representation)
    assert done.data["result"] == J.tolist()
    assert len(done.data["rows"]) == J.shape[-2]
    assert done.data["rows"][3] == {"ZYZ": "Z1", "xyz": "roll", "quaternion": "qx"}[representation]
    assert done.data["rows"][3] in urdfkin(*words).text


def test_all_representations_are_known_and_a_singularity_is_reported_with_a_remedy() -> None:
    assert set(REPRESENTATIONS) == {"rpy", "quaternion", *EULER_SEQUENCES}
    err = refused("analytical-jacobian planar_two_link --q 0.3,0.4")
    assert "representational singularity" in err
    assert "another sequence or by a quaternion" in err
    labels = [row.labels for row in quantity._POSE_FORMS.values()]
    assert sorted(map(len, labels)) == [6, 7, 7]
    assert len(set(labels)) == len(labels)


# -- a base that moves ---------------------------------------------------------------------------------


def base() -> BaseMotion:
    T = np.eye(4)
    T[:3, :3], T[2, 3] = Rotation.from_euler("z", 30, degrees=True).as_matrix(), 1.0
    return BaseMotion(T, np.array([0.1, 0.2, 0.3, 0.0, 0.0, 1.0]), np.array([0.0, 0.0, 9.81, 0.5, 0.0, 0.0]))


RATES = ["--base-velocity", "0.1,0.2,0.3,0,0,1"]
SECOND = ["--base-acceleration", "0,0,9.81,0.5,0,0"]
TAKES: dict[str, list[str]] = {
    "placement": [], "jacobian": [], "hessian": [], "analytical-jacobian": [], "velocity": RATES,
    "jacobian-rate": RATES, "acceleration": [*RATES, *SECOND], "imu": [*RATES, *SECOND],
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("command", TAKES)
def test_every_command_accepts_the_necessary_parts_of_the_base_motion(command: str) -> None:
    turns = ["--representation", "xyz"] if command.startswith("analytical") else []
    rates = ["--v", "random", "--a", "random"][: len(TAKES[command])]
    words = [command, "ur5", "--q", "random", *rates, *turns, "--format", "json"]
    data = good(*words, "--base-placement", MOVED, *TAKES[command]).data
    inputs: list[Any] = [np.array(data[x]) for x in "qva" if x in data]
    method = getattr(library.load("ur5"), command.replace("-", "_"))
    how: dict[str, Any] = {"representation": "xyz"} if turns else {}
    np.testing.assert_allclose(data["result"], method(*inputs, "tool0", base=base(), **how), atol=1e-13)
    assert np.shape(data["base_placement"]) == (1, 4, 4)
    assert np.abs(np.array(urdfkin(*words).data["result"]) - data["result"]).max() > 1e-3


def test_an_acceleration_breakdown_contains_the_part_of_the_base() -> None:
    done = good("acceleration ur5 --breakdown --base-acceleration 0,0,9.81,0,0,0")
    assert [line.split()[-4] for line in done.text.splitlines() if line.startswith("base ")] == ["9.81"]


def test_the_columns_of_a_base_acceleration_have_the_names_of_the_help(tmp_path: Path) -> None:
    path = tmp_path / "base.csv"
    path.write_text("alphax,ax,ay,az,alphay,alphaz\n4,1,2,3,5,6\n")
    data = good("acceleration ur5 --format json --base-acceleration", f"@{path}").data
    assert data["base_acceleration"] == [[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]]


def test_a_batch_of_bases_is_combined_with_one_or_as_many_configurations(tmp_path: Path) -> None:
    rows = np.random.default_rng(1).standard_normal((4, 7))
    rows[:, 3:] /= np.linalg.norm(rows[:, 3:], axis=1, keepdims=True)
    path = tmp_path / "base.csv"
    names = ["x", "y", "z", "qx", "qy", "qz", "qw"]
    path.write_text("\n".join([",".join(names), *map(numbers, rows)]))
    T = np.tile(np.eye(4), (4, 1, 1))
    T[:, :3, :3], T[:, :3, 3] = Rotation.from_quat(rows[:, 3:]).as_matrix(), rows[:, :3]
    robot = library.load("ur5")
    for q in ("neutral", "random:4"):
        done = good("placement ur5 --q", q, "--base-placement", f"@{path}", "--format", "json")
        expected: FloatArray = robot.placement(done.data["q"], "tool0", base=BaseMotion(T))
        np.testing.assert_allclose(done.data["result"], expected, atol=1e-14)
    err = refused("placement ur5 --q random:3 --base-placement", f"@{path}")
    assert "batches of q, v, a and the base motion have different lengths: found 3, 3, 3, 4, 1, 1" in err


def test_a_table_displays_a_rotation_beside_a_very_large_position() -> None:
    lines = good("placement ur5 --base-placement 1e15,0,0,0,0,0.5").text.splitlines()
    (row,) = (line.split() for line in lines if line.startswith("x "))
    assert row == ["x", "-0.877583", "0", "-0.479426", "1e+15"]


# -- the parts of an acceleration ---------------------------------------------------------------------

POLAR = "acceleration polar --q 0.3,0.7 --v 1,2 --a 0.5,-1 --breakdown"
KINDS = ["transverse", "centripetal", "coriolis", "sliding"]


@pytest.mark.slow
def test_the_parts_of_the_polar_robots_acceleration_are_shown_with_their_sum() -> None:
    result = good(POLAR)
    rows = [line.split() for line in result.text.splitlines() if line.strip().startswith(("joint_", "sum"))]
    kinds = ["joint_1 transverse", "joint_1 centripetal", "joint_2 coriolis", "joint_2 sliding"]
    assert [" ".join(row[:2]) for row in rows[:-1]] == kinds
    sums = np.array([[float(x) for x in row[2:]] for row in rows[:-1]]).sum(axis=0)
    assert np.abs(sums - [float(x) for x in rows[-1][1:]]).max() < 2e-3
    assert "verified by Pinocchio" in result.text


@pytest.mark.slow
def test_the_parts_of_an_acceleration_in_json_and_csv_sum_to_the_acceleration() -> None:
    data = good(f"{POLAR} --format json").data
    terms = np.array(data["terms"])
    assert terms.shape == (1, 2, 4, 6)
    assert (data["kinds"], data["verified"]) == (KINDS, True)
    assert np.array_equal(np.array(data["base"]) + terms.sum(axis=2).sum(axis=1), data["total"])
    expected = library.load("polar").acceleration([0.3, 0.7], [1.0, 2.0], [0.5, -1.0], "slider")
    assert np.abs(data["total"][0] - expected).max() <= 1e-14
    rows = list(csv.DictReader(io.StringIO(urdfkin(f"{POLAR} --format csv").text)))
    assert [row["kind"] for row in rows] == [*KINDS, ""]
    assert float(rows[-1]["vx"]) == pytest.approx(sum(float(row["vx"]) for row in rows[:-1]), abs=1e-14)
