"""What one joint does: to the link it moves, and to a point further out.

Sections 7.4.1, 7.4.2 and 7.4.4, equations 7.62 to 7.67, 7.72 to 7.74, 7.80 and a column of 7.85. `z` is the
joint's axis z_{i-1} in frame 0; `turns` says whether the joint is rotary or prismatic.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.kinematics.arrays import chapter as eq
from urdfkin.kinematics.inputs import FloatArray, scalars, unit_vectors, vectors


def interorigin_vector(d: ArrayLike, z: ArrayLike, a: ArrayLike, x: ArrayLike) -> FloatArray:
    """d_{i-1,i} = d_i z_{i-1} + a_i x_i (7.64).

    Args:
        d: (...) offset d_i along the joint's axis, metres.
        z: (..., 3) unit axis z_{i-1}.
        a: (...) length a_i of the common normal, metres.
        x: (..., 3) unit vector x_i along the common normal.

    Returns:
        (..., 3) metres, in the frame of `z` and `x`.

    Raises:
        InputError: a shape, or a vector that is not of unit length.

    Example:
        >>> interorigin_vector(0.3, [0.0, 0.0, 1.0], 0.5, [1.0, 0.0, 0.0])
        array([0.5, 0. , 0.3])
    """
    vector: FloatArray = eq.interorigin_vector(
        scalars(d, "d"), unit_vectors(z, "z"), scalars(a, "a"), unit_vectors(x, "x")
    )
    return vector


def joint_angular_velocity(z: ArrayLike, rate: ArrayLike, turns: bool) -> FloatArray:
    """w_{i-1,i}: theta-dot z for a rotary joint (7.62), nothing for a prismatic one (7.63).

    Args:
        z: (..., 3) unit axis z_{i-1} in frame 0.
        rate: (...) the joint's rate, rad/s or m/s.
        turns: Whether the joint is rotary.

    Returns:
        (..., 3) rad/s, in frame 0.

    Raises:
        InputError: a shape, or an axis that is not of unit length.
    """
    w: FloatArray = scalars(rate, "rate")[..., np.newaxis] * unit_vectors(z, "z")
    return w if turns else np.zeros_like(w)


def interorigin_velocity(
    w_0_i: ArrayLike, d_vector: ArrayLike, z: ArrayLike, rate: ArrayLike, turns: bool
) -> FloatArray:
    """d-dot_{i-1,i} = w_0i x d_{i-1,i}, and d-dot_i z more for a prismatic joint (7.73, 7.74).

    With only joint i moving, w_0i is w_{i-1,i} and these are 7.66 and 7.67.

    Args:
        w_0_i: (..., 3) angular velocity of link i, rad/s, in frame 0.
        d_vector: (..., 3) interorigin vector d_{i-1,i}, metres, in frame 0.
        z: (..., 3) unit axis z_{i-1} in frame 0.
        rate: (...) the joint's rate, rad/s or m/s.
        turns: Whether the joint is rotary.

    Returns:
        (..., 3) m/s, in frame 0: the rate of the vector as frame 0 sees it.

    Raises:
        InputError: a shape, or an axis that is not of unit length.
    """
    carried: FloatArray = eq.tangential(vectors(w_0_i, "w_0_i"), vectors(d_vector, "d_vector"))
    slid: FloatArray = scalars(rate, "rate")[..., np.newaxis] * unit_vectors(z, "z")
    return carried if turns else carried + slid


def jacobian_column(z: ArrayLike, arm: ArrayLike, turns: bool) -> FloatArray:
    """What a joint's unit rate does to an endpoint: [z x d_{i-1,n}; z] or [z; 0] (7.80, 7.85).

    Args:
        z: (..., 3) unit axis z_{i-1} in frame 0.
        arm: (..., 3) moment arm d_{i-1,n} from the joint's origin to the endpoint, metres, in frame 0.
        turns: Whether the joint is rotary.

    Returns:
        (..., 6) [linear; angular], in frame 0.

    Raises:
        InputError: a shape, or an axis that is not of unit length.
    """
    z, arm = np.broadcast_arrays(unit_vectors(z, "z"), vectors(arm, "arm"))
    linear, angular = eq.turning_column(z, arm) if turns else (z, np.zeros_like(z))
    return np.concatenate((linear, angular), axis=-1)
