"""Read measured poses from a CSV file with named columns, or from the arrays of an .npz file.

A CSV file has a column for each coordinate, named like it. The columns x, y, z are the position. The columns
qx, qy, qz, qw are the orientation, which is optional. Instead of both, the columns T00 to T23, or to T33, are
the matrix, as `urdfkin placement --format csv` writes it. An .npz file has q (n, nq) and either T (n, 4, 4)
or p (n, 3) and optionally quat (n, 4), scalar last.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.errors import InputError
from urdfkin.kinematics.inputs import rotation_defect, scalars
from urdfkin.kinematics.rotation import rotation_of
from urdfkin.model.tree import FloatArray
from urdfkin.motion.columns import read_columns
from urdfkin.motion.trajectory import read_arrays
from urdfkin.system.files import MOST_DATA, read_text

#: Largest deviation of a matrix from a rotation, or of a quaternion's length from 1, by rounded digits.
_WRITTEN = 1e-3
_POSITION, _QUATERNION = ("x", "y", "z"), ("qx", "qy", "qz", "qw")
_MATRIX = tuple(f"T{i}{j}" for i in range(3) for j in range(4))
_LAST_ROW = tuple(f"T3{j}" for j in range(4))
#: Units of positions, metres.
UNITS = {"m": 1.0, "mm": 1e-3}


def read_poses(
    path: Path, coordinates: tuple[str, ...], needed: tuple[str, ...], unit: str = "m"
) -> tuple[FloatArray, FloatArray]:
    """Read configurations (s, nq), and poses (s, 4, 4) or positions (s, 3), metres.

    Args:
        path: The file; .npz by its suffix, else CSV.
        coordinates: Names of the coordinates of q.
        needed: Names of the required columns; the other coordinates are neutral if they are missing.
        unit: Unit of the positions: "m" or "mm".

    Raises:
        SourceError: the file cannot be read.
        InputError: a column or array is missing or unknown, a number is invalid, or an orientation is wrong.
    """
    found = (
        _archive(path, len(coordinates))
        if path.suffix.lower() == ".npz"
        else _table(path, coordinates, needed)
    )
    q, T = found
    T = T.copy()
    positions = T if T.ndim == 2 else T[:, :3, 3]
    positions *= UNITS[unit]
    return q, T


def _table(
    path: Path, coordinates: tuple[str, ...], needed: tuple[str, ...]
) -> tuple[FloatArray, FloatArray]:
    text, where = read_text(path, MOST_DATA, pipes=True), str(path)
    first = next((line for line in text.splitlines() if line.strip() and not line.startswith("#")), "")
    names = {cell.strip() for cell in first.split(",")}
    kind = _MATRIX if "T00" in names else _POSITION
    others = [name for name in coordinates if name not in needed]
    optional = [*others, "sample", "t", *(_QUATERNION if kind is _POSITION else _LAST_ROW)]
    data = read_columns(text, where, "measured poses", [*needed, *kind], optional, named=True)
    s = len(data[kind[0]])
    q = (
        np.stack([data.get(name, np.zeros(s)) for name in coordinates], axis=-1)
        if coordinates
        else np.empty((s, 0))
    )
    part = [name for name in _QUATERNION if name in data]
    if 0 < len(part) < len(_QUATERNION):
        missing = ", ".join(name for name in _QUATERNION if name not in part)
        raise InputError("a quaternion needs four columns", where=where, found=f"no {missing}")
    if kind is _MATRIX:
        rows = np.stack([data[name] for name in _MATRIX], axis=-1).reshape(s, 3, 4)
        T = np.concatenate([rows, np.broadcast_to([[0.0, 0.0, 0.0, 1.0]], (s, 1, 4))], axis=1)
        return q, _with_exact_rotations(T, where)
    p = np.stack([data[name] for name in _POSITION], axis=-1)
    return q, p if not part else _with_quaternions(
        p, np.stack([data[n] for n in _QUATERNION], axis=-1), where
    )


def _archive(path: Path, nq: int) -> tuple[FloatArray, FloatArray]:
    data = read_arrays(path, {"q": (nq,), "T": (4, 4), "p": (3,), "quat": (4,)}, ["q"])
    if ("T" in data) == ("p" in data) or ("quat" in data and "p" not in data):
        found = ", ".join(data)
        raise InputError(
            "measured poses must be q with T, q with p, or q with p and quat", where=str(path), found=found
        )
    if "T" in data:
        return data["q"], _with_exact_rotations(data["T"], str(path))
    return data["q"], data["p"] if "quat" not in data else _with_quaternions(
        data["p"], data["quat"], str(path)
    )


def _with_quaternions(p: FloatArray, quat: FloatArray, where: str) -> FloatArray:
    lengths = np.linalg.norm(quat, axis=-1, keepdims=True)
    off = np.abs(lengths - 1.0)
    if off.size and off.max() > _WRITTEN:
        raise InputError(
            "an orientation must be a quaternion of length 1, scalar last",
            where=f"{where}, pose {int(off.argmax())}",
            found=f"length {float(lengths[off.argmax(), 0]):.6g}",
        )
    T = np.broadcast_to(np.eye(4), (len(p), 4, 4)).copy()
    T[:, :3, :3], T[:, :3, 3] = rotation_of(quat / lengths), p
    return T


def _with_exact_rotations(T: FloatArray, where: str) -> FloatArray:
    """Return the poses with exact rotations; their digits may be rounded."""
    R = T[:, :3, :3]
    bad = rotation_defect(R) > _WRITTEN
    if bad.any():
        raise InputError(
            "a pose must be a rotation and a translation",
            where=f"{where}, pose {int(bad.argmax())}",
            found=str(T[bad.argmax()].tolist()),
        )
    U, _, Vt = np.linalg.svd(R)
    good = T.copy()
    good[:, :3, :3] = U @ Vt
    return good


def checked_poses(poses: ArrayLike) -> FloatArray:
    """Return poses (s, 4, 4) or positions (s, 3) as an array; raise InputError for another shape."""
    array = scalars(poses, "poses")
    if array.ndim == 2 and array.shape[1] == 3:
        return array
    if array.ndim == 3 and array.shape[1:] == (4, 4):
        return _with_exact_rotations(array, "poses")
    raise InputError("poses must be (n, 4, 4), or positions (n, 3)", found=f"shape {array.shape}")
