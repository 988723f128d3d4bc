"""Lengths with which a table can be computed and checked: their squares are still doubles.

What of a chain's constants is rounding: a tilt or an offset below this is none.

Two correct programs that read one URDF do not get the same constant pose between two joint axes, and what
wrote the file was a program as well, which may have kept fifteen digits of each angle.
`urdfkin.kinematics.roundings` counts both. So angles of fourteen or fifteen digits (1.5707963267949 is 15 eps
off a right angle, 3.14159265358979 as much) are round. One of twelve digits, 900 eps off and more, is not:
what makes that one round is `snap`, which says what it moves.

A tilt below this is zero in a table: no row is spent on it, and no foot stands at its inverse. It is counted
by `left_out`, by which a table may then differ.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from urdfkin.dh.table import DHTable
from urdfkin.errors import RangeError
from urdfkin.kinematics.roundings import AXES, CONSTANT, EPS, SUMMED, WRITTEN
from urdfkin.model.chain import FrameChain
from urdfkin.model.tree import FloatArray, Joint

#: Metres: beyond it squares of sums, of which common normals and the bounds of the check are made, overflow.
LONGEST = 1e150


def demand_squares(joints: Iterable[Joint]) -> None:
    """Every joint's offset can be squared.

    Raises:
        RangeError: one of them cannot.
    """
    for joint in joints:
        _demand(f"joint {joint.name}", float(np.abs(joint.T_parent_joint[:3, 3]).max()))


def demand_squares_of(chain: FrameChain, table: DHTable) -> None:
    """Every length of a path and of a table can be squared.

    Raises:
        RangeError: one of them cannot.
    """
    for i, row in enumerate(table.rows):
        for name, length in (("a", row.a), ("d", row.d)):
            _demand(f"the table, row {i + 1}, {name}", abs(length))
    for name, T in (("base", table.base), ("tool", table.tool)):
        _demand(f"the table, {name}", float(np.abs(T[:3, 3]).max()))
    for A in chain.constants:
        _demand(f"{chain.robot}, {chain.base} to {chain.tip}", float(np.abs(A[:3, 3]).max()))


def _demand(where: str, length: float) -> None:
    if length > LONGEST:
        raise RangeError(
            "a table needs the squares of lengths, and they leave the range of double precision",
            where=where,
            found=f"{length:.3g} m",
            remedy="give smaller numbers",
        )


@dataclass(frozen=True, slots=True)
class Noise:
    """Below what an angle (radians) and a length (metres) of one constant pose are rounding."""

    radians: float
    metres: float


def noise_of(joints: int, length: float, reach: float) -> Noise:
    """The noise of a constant pose.

    Args:
        joints: How many URDF joints' constants are multiplied into it.
        length: Metres: their offsets added up.
        reach: Metres: the whole way, from which the pose is measured.

    Example:
        >>> round(noise_of(1, 0.1, 1.0).radians / EPS, 1), round(noise_of(1, 0.1, 1.0).metres / EPS, 1)
        (63.7, 4.0)
    """
    computed = (AXES + CONSTANT * joints) * EPS
    return Noise(computed + WRITTEN * joints * EPS, max(SUMMED * EPS * reach, computed * length))


def noises(chain: FrameChain, reach: float) -> list[Noise]:
    """The noise of each of a chain's constants."""
    return [
        noise_of(joints, float(length), reach)
        for joints, length in zip(chain.folded, chain.lengths, strict=True)
    ]


def left_out(chain: FrameChain) -> float:
    """Radians: all tilts of a chain that are taken for rounding, added up.

    Between axes it is the second axis that leans against the first; at the tip its x may lean, too.
    """
    found = 0.0
    for A, noise in zip(chain.constants, noises(chain, 0.0), strict=True):
        found += sum(tilt for tilt in (tilt_of(A), abs(float(A[2, 0]))) if tilt <= noise.radians)
    return found


def tilt_of(A: FloatArray) -> float:
    """The sine of the angle between the two z axes of a pose."""
    return math.hypot(A[0, 2], A[1, 2])
