"""One link in the plane: where its endpoint is and how fast it goes.

Section 7.1, equations 7.1 to 7.7 (page 2 of the text, with 7.6 and 7.8 to 7.10, is lost).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.kinematics.inputs import FloatArray, scalars


def planar_rotation(theta: ArrayLike) -> FloatArray:
    """R(theta) of the plane (7.5).

    Args:
        theta: (...) radians.

    Returns:
        (..., 2, 2) rotation; its columns are the axes x1 and y1 in frame 0.

    Raises:
        InputError: an angle that is not a finite number.
    """
    theta = scalars(theta, "theta")
    c, s = np.cos(theta), np.sin(theta)
    return np.stack((np.stack((c, -s), axis=-1), np.stack((s, c), axis=-1)), axis=-2)


def planar_rotation_derivative(theta: ArrayLike) -> FloatArray:
    """dR/dtheta: the same axes a right angle on, y1 and -x1 (used in 7.4; drawn in figure 7.2).

    Args:
        theta: (...) radians.

    Returns:
        (..., 2, 2), per radian.

    Raises:
        InputError: an angle that is not a finite number.
    """
    R = planar_rotation(theta)
    return np.stack((R[..., 1], -R[..., 0]), axis=-1)


def link_endpoint(theta: ArrayLike, length: ArrayLike) -> FloatArray:
    """d_01 = a x1 = R a (1, 0): the endpoint of a link that turns about O_0 (7.1, 7.3).

    Args:
        theta: (...) joint angle, radians.
        length: (...) the link's length a, metres.

    Returns:
        (..., 2) metres, in frame 0.

    Raises:
        InputError: a value that is not a finite number.

    Example:
        >>> link_endpoint(np.pi / 2, 2.0).round(12)
        array([0., 2.])
    """
    endpoint: FloatArray = scalars(length, "length")[..., np.newaxis] * planar_rotation(theta)[..., 0]
    return endpoint


def link_endpoint_velocity(theta: ArrayLike, rate: ArrayLike, length: ArrayLike) -> FloatArray:
    """d-dot_01 = a theta-dot y1: along the tangent, v = r w (7.2, 7.4, 7.7).

    Args:
        theta: (...) joint angle, radians.
        rate: (...) its rate, rad/s.
        length: (...) the link's length a, metres.

    Returns:
        (..., 2) m/s, in frame 0.

    Raises:
        InputError: a value that is not a finite number.

    Example:
        >>> link_endpoint_velocity(0.0, 3.0, 2.0) + 0.0
        array([0., 6.])
    """
    speed = scalars(length, "length") * scalars(rate, "rate")
    velocity: FloatArray = speed[..., np.newaxis] * planar_rotation_derivative(theta)[..., 0]
    return velocity
