"""Check roll-pitch-yaw angles and quaternions by converting them back to rotation matrices with Pinocchio.

Only the matrices can be compared. At gimbal lock, two correct programs may return different angles for a
rotation. Two correct quaternions may have opposite signs.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from urdfkin.kinematics.roundings import EPS
from urdfkin.model.tree import FloatArray
from urdfkin.verify.certificate import VerificationError
from urdfkin.verify.pinocchio import pinocchio

#: Upper bound, in eps, on the sum of the rounding errors of urdfkin and of Pinocchio.
#: The error of each program is less than 8 eps.
#: Angles need arctan2, sines, cosines and products of three numbers (`urdfkin.kinematics.roundings`).
#: Quaternions need a square root, a quotient and products of two numbers.
_ROUNDINGS = 16.0


def check_orientations(numbers: FloatArray, R: FloatArray, frame: str, again: Callable[[int], str]) -> None:
    """Compare rotations that Pinocchio computes from angles or quaternions with the verified rotations `R`.

    `numbers` contains roll, pitch, yaw (n, 3) in rad or quaternions (n, 4), scalar last. `again(k)` returns a
    command that computes sample k again. The bound includes the distance between `R` and the nearest rotation
    matrix, because `R` has rounding errors. Raises VerificationError if a rotation differs by more than the
    bound.
    """
    pin = pinocchio()
    if numbers.shape[-1] == 3:
        theirs = np.array([pin.rpy.rpyToMatrix(*row) for row in numbers.tolist()])
    else:
        theirs = np.array([pin.Quaternion(row).toRotationMatrix() for row in numbers])
    theirs = theirs.reshape(-1, 3, 3)
    defect = np.abs(R.swapaxes(-1, -2) @ R - np.eye(3)).sum(axis=(-1, -2))
    bound = _ROUNDINGS * EPS + 2.0 * defect
    off = np.abs(theirs - R).max(axis=(-1, -2))
    if (off <= bound).all():
        return
    k = int(np.argmax(off / bound))
    raise VerificationError(
        "orientation",
        frame,
        "rpy" if numbers.shape[-1] == 3 else "quaternion",
        index=(k,),
        ours=R[k],
        theirs=theirs[k],
        bound=np.full((3, 3), bound[k]),
        units=float(off[k] / EPS),
        reproduce=again(k),
    )
