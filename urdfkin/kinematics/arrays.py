"""The equations on NumPy arrays whose last axis holds a vector's three numbers: whole batches at once."""

from __future__ import annotations

import numpy as np

from urdfkin.kinematics.arithmetic import bound

#: A number is an array without that axis, a rotation one with two axes of three.
chapter = bound(
    plus=np.add,
    minus=np.subtract,
    times=lambda c, x: np.asarray(c)[..., np.newaxis] * x,
    dot=lambda x, y: (x * y).sum(axis=-1),
    cross=np.cross,
    rotate=lambda R, x: (R @ x[..., np.newaxis])[..., 0],
    transposed=lambda R: R.swapaxes(-1, -2),
    product=np.matmul,
)
