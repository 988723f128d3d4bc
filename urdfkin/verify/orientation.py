"""Check roll-pitch-yaw angles and quaternions: Pinocchio converts them back to rotation matrices.

The matrices are compared, not the numbers. Two correct programs may return different numbers for the same
rotation: at gimbal lock, or if their quaternions have opposite signs.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from urdfkin.kinematics.roundings import EPS
from urdfkin.model.tree import FloatArray
from urdfkin.verify.certificate import VerificationError
from urdfkin.verify.pinocchio_module import pinocchio

#: Rounding error of both sides in eps, less than 8 eps each, counted as for a joint in `roundings`. For
#: angles, the operations are arctan2, sines, cosines and products of three numbers. For quaternions, they are
#: a square root, a quotient and products of two numbers.
_ROUNDINGS = 16.0


def check_orientations(numbers: FloatArray, R: FloatArray, frame: str, again: Callable[[int], str]) -> None:
    """Compare Pinocchio's rotations of some numbers with the rotations they were computed from.

    The bound includes the distance of `R` from the nearest rotation matrix. Angles and quaternions can only
    represent exact rotations, so they cannot be closer to `R` than that.

    Args:
        numbers: (n, 3) roll, pitch, yaw in rad, or (n, 4) quaternions, scalar last.
        R: (n, 3, 3) checked rotations.
        frame: Name of the frame, for the message.
        again: Function that returns the line that reproduces a sample.

    Raises:
        VerificationError: a rotation differs by more than the bound.
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
