"""Measured poses from CSV and .npz files, and what is wrong with them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.calibration.arms import pose
from tests.cli.running import urdfkin
from urdfkin.calibration.calibrate import read_poses
from urdfkin.errors import InputError
from urdfkin.kinematics.rotation import quaternion_of
from urdfkin.model.tree import FloatArray

NAMES = ("a", "b")
Q = np.array([[0.1, 0.2], [0.3, 0.4], [-0.5, 0.6]])
T = np.stack([pose(k, 1.0) for k in range(3)])


def csv(path: Path, header: str, rows: FloatArray) -> Path:
    np.savetxt(path, rows, delimiter=",", header=header, comments="", fmt="%.17g")
    return path


def test_every_form_reads_the_same(tmp_path: Path) -> None:
    quat, p = quaternion_of(T[:, :3, :3]), T[:, :3, 3]
    columns = "qw,qx,qy,qz,x,y,z,b,a"
    rows = np.hstack([np.roll(quat, 1, axis=1), p, Q[:, ::-1]])
    matrices = ",".join(f"T{i}{j}" for i in range(4) for j in range(4))
    np.savez(tmp_path / "T.npz", q=Q, T=T)
    np.savez(tmp_path / "p.npz", q=Q, p=1e3 * p, quat=quat)
    for path, unit in (
        (csv(tmp_path / "quat.csv", columns, rows), "m"),
        (csv(tmp_path / "T.csv", f"a,b,{matrices}", np.hstack([Q, T.reshape(3, 16)])), "m"),
        (tmp_path / "T.npz", "m"),
        (tmp_path / "p.npz", "mm"),
    ):
        q, found = read_poses(path, NAMES, NAMES, unit)
        assert (q == Q).all()
        np.testing.assert_allclose(found, T, atol=1e-15)


def test_a_quaternion_with_few_digits_is_brought_to_length_one(tmp_path: Path) -> None:
    quat = quaternion_of(T[:, :3, :3])
    rows = np.hstack([quat * 1.0009, T[:, :3, 3], Q])
    found = read_poses(csv(tmp_path / "long.csv", "qx,qy,qz,qw,x,y,z,a,b", rows), NAMES, NAMES)[1]
    np.testing.assert_allclose(found, T, atol=1e-15)


def test_positions_alone_are_positions_alone(tmp_path: Path) -> None:
    path = csv(tmp_path / "p.csv", "a,x,y,z", np.hstack([Q[:, :1], 1e3 * T[:, :3, 3]]))
    q, p = read_poses(path, NAMES, ("a",), "mm")
    assert (q == Q * [1.0, 0.0]).all()
    np.testing.assert_allclose(p, T[:, :3, 3], atol=1e-15)
    np.savez(tmp_path / "p.npz", q=Q, p=T[:, :3, 3])
    assert (read_poses(tmp_path / "p.npz", NAMES, NAMES)[1] == T[:, :3, 3]).all()


@pytest.mark.parametrize(
    ("header", "words"),
    [
        ("a,b,x,y", "missing: z"),
        ("a,x,y,z", "missing: b"),
        ("a,b,x,y,z,qw", "no qx, qy, qz"),
        ("a,b,x,y,z,roll", "unknown: roll"),
        ("a,b,x,y,z,qx,qy,qz,qw", "length 2"),
        ("a,b,T00,T01,T02,T03,T10,T11,T12,T13,T20,T21,T22,T23", "a pose must be a rotation"),
    ],
)
def test_what_is_wrong_with_columns_is_told(header: str, words: str, tmp_path: Path) -> None:
    path = csv(tmp_path / "x.csv", header, np.ones((2, header.count(",") + 1)))
    with pytest.raises(InputError) as error:
        read_poses(path, NAMES, NAMES)
    assert words in str(error.value)


def test_what_is_wrong_with_arrays_is_told(tmp_path: Path) -> None:
    np.savez(tmp_path / "x.npz", q=Q, T=T, p=T[:, :3, 3])
    with pytest.raises(InputError, match="`q` and `T`, `q` and `p`, or `q`, `p` and `quat`: found q, T, p"):
        read_poses(tmp_path / "x.npz", NAMES, NAMES)


def test_what_placement_writes_is_read(tmp_path: Path) -> None:
    q = np.random.default_rng(0).uniform(-1.0, 1.0, (3, 2))
    (tmp_path / "q.csv").write_text("\n".join(f"{a!r},{b!r}" for a, b in q.tolist()))
    done = urdfkin("placement", "planar_two_link", "--q", f"@{tmp_path}/q.csv", "--format", "csv")
    lines = done.text.splitlines()
    names = ("joint_1", "joint_2")
    rows = [",".join([line, *map(repr, row)]) for line, row in zip(lines[1:], q.tolist(), strict=True)]
    (tmp_path / "poses.csv").write_text("\n".join([f"{lines[0]},{','.join(names)}", *rows]))
    assert (read_poses(tmp_path / "poses.csv", names, names)[0] == q).all()
