"""Check roll-pitch-yaw angles and quaternions by converting them back to rotation matrices with Pinocchio.

The comparison uses the matrices and not the angles or quaternions. Two correct programs may return different
angles for the same rotation at gimbal lock. Two correct programs may also return quaternions of opposite
signs.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from urdfkin.kinematics.roundings import EPS
from urdfkin.model.tree import FloatArray
from urdfkin.verify.certificate import VerificationError
from urdfkin.verify.pinocchio import pinocchio

#: Upper bound on the sum of the rounding errors of urdfkin and of Pinocchio, in eps.
#: Each of the two errors is less than 8 eps, counted as in `urdfkin.kinematics.roundings`.
#: For angles, the operations are arctan2, sines, cosines and products of three numbers.
#: For quaternions, the operations are a square root, a quotient and products of two numbers.
_ROUNDINGS = 16.0


def check_orientations(numbers: FloatArray, R: FloatArray, frame: str, again: Callable[[int], str]) -> None:
    """Compare rotations that Pinocchio computes from angles or quaternions with the original rotations.

    Rounding makes `R` differ from an exact rotation matrix. Angles and quaternions can represent only exact
    rotations, so Pinocchio's rotation must differ from `R` as well. Therefore, the bound includes the
    distance between `R` and the nearest rotation matrix.

    Args:
        numbers: (n, 3) roll, pitch, yaw in rad, or (n, 4) quaternions, scalar last.
        R: (n, 3, 3) rotations from which the angles or quaternions were computed. The caller has already
            checked these rotations.
        frame: Name of the frame, for the message.
        again: Function that returns a shell command, or lines of Python, to compute a sample again.

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
