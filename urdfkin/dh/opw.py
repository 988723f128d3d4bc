"""The seven numbers of an ortho-parallel arm with a spherical wrist (Brandstoetter et al., 2014).

An OPW arm is the standard table

    a1 -90 c1 q1    c2 0 0 q2-90    a2 90 b q3+90    0 -90 c3 q4    0 90 0 q5    0 0 c4 q6

(a, alpha, d, theta), so its numbers are those of the URDF in this table's frames (`urdfkin.dh.like`), with
the zeros and the ways its joints count. What the kind has no number for, a tilt of calibration, is left out,
and `placement` is the solver's own forward kinematics, so that what this costs can be measured.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from urdfkin.dh.derive import Choices, Last, derive
from urdfkin.dh.like import derive_like, reversed_like
from urdfkin.dh.row import Convention, DHRow
from urdfkin.dh.table import DHTable
from urdfkin.errors import InputError
from urdfkin.model.chain import FrameChain, motion_about_z
from urdfkin.model.tree import FloatArray, JointKind

#: Metres and radians that what a solver needs may be off by; configurations on which that is measured.
TOLERANCE, SAMPLES = 1e-6, 200
_H = math.pi / 2.0
_ALPHA, _THETA = (-_H, 0.0, _H, -_H, _H, 0.0), (0.0, -_H, _H, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Opw:
    """An arm's parameters as the solver takes them: q_opw = sign * q - offset.

    Attributes:
        joints: Names, base to tip.
        lengths: a1, a2, b, c1, c2, c3, c4 in metres.
        offsets: Radians, of each joint.
        signs: +1 or -1, of each joint.
        base: (4, 4) the solver's base in the URDF's.
        tool: (4, 4) the URDF's tip in the solver's flange.
    """

    joints: tuple[str, ...]
    lengths: dict[str, float]
    offsets: tuple[float, ...]
    signs: tuple[int, ...]
    base: FloatArray
    tool: FloatArray

    def placement(self, q: FloatArray) -> FloatArray:
        """(..., 4, 4) base . F(sign * q - offset) . tool, F as the solver's library computes it."""
        t = np.moveaxis(np.asarray(q) * self.signs - np.array(self.offsets), -1, 0)
        a1, a2, b, c1, c2, c3, c4 = self.lengths.values()
        x = c2 * np.sin(t[1]) + a2 * np.cos(t[1] + t[2]) + c3 * np.sin(t[1] + t[2]) + a1
        z = c2 * np.cos(t[1]) - a2 * np.sin(t[1] + t[2]) + c3 * np.cos(t[1] + t[2]) + c1
        T = _turn(t[0], 2) @ _turn(t[1] + t[2], 1) @ _turn(t[3], 2) @ _turn(t[4], 1) @ _turn(t[5], 2)
        T[..., :3, 3] = np.stack(
            [x * np.cos(t[0]) - b * np.sin(t[0]), x * np.sin(t[0]) + b * np.cos(t[0]), z], -1
        )
        T[..., :3, 3] += c4 * T[..., :3, 2]
        return np.asarray(self.base @ T @ self.tool)

    def as_mapping(self) -> dict[str, Any]:
        """Plain data, with the keys of the solver's own configuration files; metres and radians."""
        return {
            "opw_kinematics_geometric_parameters": self.lengths,
            "opw_kinematics_joint_offsets": list(self.offsets),
            "opw_kinematics_joint_sign_corrections": list(self.signs),
            "joints": list(self.joints),
            "T_base_opw": self.base.tolist(),
            "T_flange_tip": self.tool.tolist(),
        }


def opw_of(path: FrameChain, tolerance: float = TOLERANCE) -> Opw:
    """The OPW parameters of a path of six turning joints.

    Args:
        path: The path, base to tip.
        tolerance: Metres, and radians, that the tip may be off by, at worst of `SAMPLES`.

    Raises:
        InputError: other joints, or an arm that is not of the kind, with how far its tip would be off.
    """
    where = f"{path.robot}, {path.base} to {path.tip}"
    if [joint.kind.turns for joint in path.joints] != [True] * 6:
        raise InputError("an OPW arm has six turning joints", where=where, found=str(len(path.joints)))
    free = replace(path, joints=tuple(replace(joint, mimic=None) for joint in path.joints))
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (SAMPLES, len(path.joints)))
    wanted, best, refused = free.placement(q), None, ""
    for guide in _guides(path):
        try:
            choices = Choices(flip=reversed_like(path, Choices(), guide))
        except InputError as error:
            refused = refused or error.found or ""
            continue
        found = _read(derive_like(path, choices, guide))
        off = np.abs(found.placement(q) - wanted)
        size = float(off[..., :3, 3].max()), float(off[..., :3, :3].max())
        below = sum(found.lengths[name] < 0.0 for name in ("c1", "c2", "c3", "c4"))
        rank = (max(size) > tolerance, below if max(size) <= tolerance else max(size), len(choices.flip))
        if best is None or rank < best[0]:
            best = rank, size, found
    if best is None or best[0][0]:
        if best is not None:
            refused = f"a tip that would be off by {best[1][0] * 1e3:.3g} mm and {best[1][1]:.3g} rad"
        raise InputError(
            "the arm is no ortho-parallel one with a spherical wrist",
            where=where,
            found=refused,
            remedy="`urdfkin structure` says what it is and how nearly; a larger tolerance takes it for one",
        )
    return best[2]


def _guides(path: FrameChain) -> Iterator[DHTable]:
    """OPW tables with about the arm's lengths, in every combination of the signs of a1, a2 and b."""
    rows = derive(path, Choices(last=Last.FLANGE)).rows
    tip = float(np.linalg.norm(path.T_last_tip[:3, 3])) or 1.0
    a1, c2, a2 = (abs(row.a) for row in rows[:3])
    b = abs(rows[1].d) + abs(rows[2].d)
    for one, two, three in product((1.0, -1.0), repeat=3):
        a = (one * a1, c2, two * a2, 0.0, 0.0, 0.0)
        d = (abs(rows[0].d) or 1.0, 0.0, three * b, abs(rows[3].d), 0.0, tip)
        made = [
            DHRow(a[i], _ALPHA[i], d[i], _THETA[i], JointKind.REVOLUTE, joint.name)
            for i, joint in enumerate(path.joints)
        ]
        yield DHTable(Convention.STANDARD, tuple(made))


def _read(table: DHTable) -> Opw:
    """The parameters that a table in an OPW table's frames has; whatever else it has is left out."""
    rows = table.rows
    lengths = {"a1": rows[0].a, "a2": rows[2].a, "b": rows[1].d + rows[2].d}
    lengths |= {"c1": rows[0].d, "c2": rows[1].a, "c3": rows[3].d, "c4": rows[5].d}
    offsets = (
        math.remainder(zero - row.theta, 2.0 * math.pi) + 0.0 for zero, row in zip(_THETA, rows, strict=True)
    )
    names, signs = tuple(row.joint for row in rows), tuple(row.sense for row in rows)
    return Opw(names, lengths, tuple(offsets), signs, table.base, table.tool)


def _turn(angle: FloatArray, axis: int) -> FloatArray:
    """(..., 4, 4) a turn about y (1) or z (2)."""
    T = motion_about_z(np.asarray(angle), turns=True)
    order = [1, 2, 0, 3] if axis == 1 else [0, 1, 2, 3]  # where x, y, z of a turn about z go
    return np.asarray(T[..., order, :][..., :, order])
