"""What of a chain's constants is rounding: a tilt or an offset below this is none.

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
from dataclasses import dataclass

from urdfkin.kinematics.roundings import AXES, CONSTANT, EPS, SUMMED, WRITTEN
from urdfkin.model.chain import FrameChain
from urdfkin.model.tree import FloatArray


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
