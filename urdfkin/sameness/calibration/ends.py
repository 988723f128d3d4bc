"""Where the instrument stands and where its target is, from poses alone, before anything is fitted.

With T_i the robot's poses, M_i the measured ones, B the base and X the tool: M_i = B T_i X. The rotations are
linear in the two unknown ones together, R_B^T R_Mi = R_i R_X, and found as the null vector of all of these
(Shah, 2013); the positions are linear in the rest, p_Mi = R_B (R_i x + p_i) + b. Of positions alone base and
target are found in turns: each is a linear problem when the other is known.
"""

from __future__ import annotations

import numpy as np

from urdfkin.errors import InputError
from urdfkin.kinematics.rotation import euler_of
from urdfkin.model.tree import FloatArray
from urdfkin.sameness.calibration.fit import Measured
from urdfkin.sameness.calibration.models import Model

#: Turns that base and target take at most, and by what share of its way the target may still move.
_TURNS, _STAYS = 200, 1e-9
#: How many times as far as the robot's tip goes measured positions may be spread: millimetres are a thousand.
_FARTHER = 100.0


def starting(model: Model, measured: Measured) -> FloatArray:
    """(p,) parameters of the model as it is, with base and tool as the poses have them."""
    at = model.way.start.copy()
    places = {parameter.where for parameter in model.way.parameters if parameter.end}
    if not places:
        return at
    T = model.way.poses(measured.values)
    free = "base" in places, "tool" in places
    B, X = (
        _complete(T, measured.p, measured.R, *free) if measured.R is not None else _seen(T, measured.p, *free)
    )
    for which, end in (("base", B), ("tool", X)):
        six = [*end[:3, 3], *euler_of("XYZ", end[:3, :3])]
        for k, parameter in enumerate(model.way.parameters):
            if parameter.end and parameter.where == which:
                at[k] = six[("x", "y", "z", "rx", "ry", "rz").index(parameter.what)]
    return at


def _complete(
    T: FloatArray, p: FloatArray, R: FloatArray, base: bool, tool: bool
) -> tuple[FloatArray, FloatArray]:
    B, X = np.eye(4), np.eye(4)
    if base and tool:
        B[:3, :3], X[:3, :3] = _rotations(T[:, :3, :3], R)
    elif base:
        B[:3, :3] = _rotation(np.einsum("sij,skj->ik", R, T[:, :3, :3]))
    else:
        X[:3, :3] = _rotation(np.einsum("sji,sjk->ik", T[:, :3, :3], R))
    B[:3, 3], X[:3, 3] = _shifts(T, p, B[:3, :3], base, tool)
    return B, X


def _seen(T: FloatArray, p: FloatArray, base: bool, tool: bool) -> tuple[FloatArray, FloatArray]:
    """Base and target from positions alone."""
    B, X = np.eye(4), np.eye(4)
    for _ in range(_TURNS if base and tool else 1):
        if base:
            points = T[:, :3, :3] @ X[:3, 3] + T[:, :3, 3]
            B[:3, :3] = _rotation((p - p.mean(axis=0)).T @ (points - points.mean(axis=0)))
        before = X[:3, 3].copy()
        B[:3, 3], X[:3, 3] = _shifts(T, p, B[:3, :3], base, tool)
        if np.linalg.norm(X[:3, 3] - before) <= _STAYS * np.linalg.norm(X[:3, 3]):
            break
    return B, X


def _rotations(R: FloatArray, M: FloatArray) -> tuple[FloatArray, FloatArray]:
    """R_B and R_X of R_B^T M_i = R_i R_X: M_i^T R_B - R_X^T R_i^T = 0, vectors by rows."""
    unit = np.eye(3)
    left = np.einsum("sab,cd->sacbd", M.swapaxes(-1, -2), unit).reshape(-1, 9)
    right = np.einsum("ab,scd->sacbd", unit, R).reshape(-1, 9)
    null = np.linalg.svd(np.hstack([left, -right]), full_matrices=False)[2][-1]
    B, X_back = null[:9].reshape(3, 3), null[9:].reshape(3, 3)
    sign = np.sign(np.linalg.det(B)) or 1.0
    return _rotation(sign * B), _rotation(sign * X_back).T


def _rotation(M: FloatArray) -> FloatArray:
    """The rotation nearest to any matrix."""
    U, _, Vt = np.linalg.svd(M)
    if np.linalg.det(U @ Vt) < 0.0:
        U[:, 2] *= -1.0
    return np.asarray(U @ Vt)


def _shifts(
    T: FloatArray, p: FloatArray, R_B: FloatArray, base: bool, tool: bool
) -> tuple[FloatArray, FloatArray]:
    """The vectors b and x of p_Mi = R_B R_i x + R_B p_i + b."""
    rest = (p - T[:, :3, 3] @ R_B.T).ravel()
    parts = []
    if base:
        parts.append(np.tile(np.eye(3), (len(p), 1)))
    if tool:
        parts.append((R_B @ T[:, :3, :3]).reshape(-1, 3))
    found = np.asarray(np.linalg.lstsq(np.hstack(parts), rest, rcond=None)[0], np.float64)
    nothing = np.zeros(3)
    return found[:3] if base else nothing, found[-3:] if tool else nothing


def demand_plausible(model: Model, measured: Measured) -> None:
    """Raise InputError where positions can be no metres: they spread much farther than the robot's.

    Raises:
        InputError: as said.
    """
    T = model.way.poses(measured.values)
    ours, theirs = (
        float(np.linalg.norm(x - x.mean(axis=0), axis=1).max()) for x in (T[:, :3, 3], measured.p)
    )
    if ours > 0.0 and theirs > _FARTHER * ours:
        raise InputError(
            "measured positions spread farther than the robot's",
            found=f"{theirs:.4g} m, where the robot's tip goes {ours:.4g} m",
            remedy="say --unit mm, unit='mm', if that is what they are in",
        )
