"""Decide which tilts and offsets of a chain are rounding noise, and reject lengths that are too large.

Two correct programs read the same URDF and compute slightly different constant poses between two joint axes.
The program that wrote the file may also have rounded each angle to fifteen digits.
`urdfkin.kinematics.roundings` counts both effects. Angles of fourteen or fifteen digits are therefore treated
as round: 1.5707963267949 and 3.14159265358979 differ by 15 eps from a multiple of a right angle. An angle of
twelve digits differs by 900 eps or more and is not treated as round. `snap` makes it round and states the
effect.

A tilt below the noise is zero in a table. The axes then count as parallel, and no distant foot arises.
`left_out` adds up these tilts; a table may differ from the URDF by their sum.
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

#: Largest length (metres). The squares of sums of longer ones overflow in common normals and bounds.
LONGEST = 1e150


def demand_squares(joints: Iterable[Joint]) -> None:
    """Check that the square of each joint's offset is a finite double.

    Raises:
        RangeError: an offset is longer than `LONGEST`.
    """
    for joint in joints:
        _check_length(f"joint {joint.name}", float(np.abs(joint.T_parent_joint[:3, 3]).max()))


def demand_squares_of(chain: FrameChain, table: DHTable) -> None:
    """Check that the square of each length of a path and of a table is a finite double.

    Raises:
        RangeError: a length is larger than `LONGEST`.
    """
    for i, row in enumerate(table.rows):
        for name, length in (("a", row.a), ("d", row.d)):
            _check_length(f"the table, row {i + 1}, {name}", abs(length))
    for name, T in (("base", table.base), ("tool", table.tool)):
        _check_length(f"the table, {name}", float(np.abs(T[:3, 3]).max()))
    for A in chain.constants:
        _check_length(f"{chain.robot}, {chain.base} to {chain.tip}", float(np.abs(A[:3, 3]).max()))


def _check_length(where: str, length: float) -> None:
    if length > LONGEST:
        raise RangeError(
            "the square of this length is outside the range of double precision",
            where=where,
            found=f"{length:.3g} m",
            remedy="give smaller numbers",
        )


@dataclass(frozen=True, slots=True)
class Noise:
    """Largest angle (radians) and length (metres) of a constant pose that count as rounding."""

    radians: float
    metres: float


def noise_of(joints: int, length: float, reach: float) -> Noise:
    """Return the noise of a constant pose.

    Args:
        joints: Number of URDF joints with constants in the pose.
        length: Sum of their offsets (metres).
        reach: Length of the whole path (metres).

    Example:
        >>> round(noise_of(1, 0.1, 1.0).radians / EPS, 1), round(noise_of(1, 0.1, 1.0).metres / EPS, 1)
        (63.7, 4.0)
    """
    computed = (AXES + CONSTANT * joints) * EPS
    return Noise(computed + WRITTEN * joints * EPS, max(SUMMED * EPS * reach, computed * length))


def noises(chain: FrameChain, reach: float) -> list[Noise]:
    """Return the noise of each constant of a chain."""
    return [
        noise_of(joints, float(length), reach)
        for joints, length in zip(chain.folded, chain.lengths, strict=True)
    ]


def left_out(chain: FrameChain) -> float:
    """Return the sum of all tilts of a chain that count as rounding (rad).

    It includes the tilts between consecutive axes, and tilts of x axes such as the tip's.
    """
    found = 0.0
    for A, noise in zip(chain.constants, noises(chain, 0.0), strict=True):
        found += sum(tilt for tilt in (tilt_of(A), abs(float(A[2, 0]))) if tilt <= noise.radians)
    return found


def tilt_of(A: FloatArray) -> float:
    """Return the sine of the angle between the two z axes of a pose."""
    return math.hypot(A[0, 2], A[1, 2])
