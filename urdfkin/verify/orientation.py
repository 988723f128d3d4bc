"""Whether the numbers that write a rotation down mean that rotation: Pinocchio makes a matrix of them again.

Numbers are not compared with numbers: where roll and yaw turn about one axis, or a quaternion may have either
sign, two correct programs write the same rotation differently.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from urdfkin.kinematics.roundings import EPS
from urdfkin.model.tree import FloatArray
from urdfkin.verify.certificate import VerificationError
from urdfkin.verify.pinocchio_module import pinocchio

#: On either side: angles by arctan2, their sines and cosines, products of three of them; or a square root, a
#: quotient, products of two of four numbers. Less than 8 eps each, as of a joint's constant (`roundings`).
_ROUNDINGS = 16.0


def check_orientations(numbers: FloatArray, R: FloatArray, frame: str, again: Callable[[int], str]) -> None:
    """Hold Pinocchio's rotations of the numbers against those that they are of.

    A matrix that is rotated by d from the nearest rotation has no numbers that mean it to less than d.

    Args:
        numbers: (n, 3) roll, pitch, yaw, or (n, 4) quaternions, scalar last.
        R: (n, 3, 3) checked rotations.
        frame: Whose they are, for the message.
        again: The line that computes one of them again.

    Raises:
        VerificationError: Pinocchio's are others.
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
