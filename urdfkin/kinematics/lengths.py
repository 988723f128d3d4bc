"""Compute upper bounds on the lengths of a link's position, velocities and accelerations.

Each function computes the bounds of a link from the bounds of the parent link. A bound is at least the sum of
the norms of all terms:

| Symbol | Vector or number |
|---|---|
| p | position |
| w, vel | angular and linear velocity |
| alpha, acc | angular and linear acceleration |
| d | offset of the joint, with the displacement of the joint |
| o, u | angular and linear joint velocity |
| o_rate, u_rate | angular and linear joint acceleration |

NumPy arrays, Python numbers and the compiled copies (`urdfkin.verify.kernels`) give the same bits.
"""

from urdfkin.kinematics.number_kinds import Length
from urdfkin.kinematics.number_kinds import length_equations as eq

#: Bounds of a link's position p, angular velocity w, velocity vel, and accelerations alpha and acc.
LinkBounds = tuple[Length, ...]
_Z = 1.0  #: Length of a joint's axis.


def translate_point(state: LinkBounds, d: Length) -> LinkBounds:
    """7.58, 7.128, 7.130: point at the distance d."""
    p, w, vel, alpha, acc = state
    p, vel = eq.point_position(p, None, d), eq.point_velocity(vel, w, d)
    return p, w, vel, alpha, eq.point_acceleration(acc, alpha, w, d)


def after_revolute(state: LinkBounds, d: Length, o: Length, o_rate: Length) -> LinkBounds:
    """7.127, 7.129: revolute joint."""
    p, w, vel, alpha, acc = translate_point(state, d)
    w = eq.angular_velocity(w, _Z, o)
    return p, w, vel, eq.angular_acceleration(alpha, w, _Z, o, o_rate), acc


def after_prismatic(state: LinkBounds, d: Length, u: Length, u_rate: Length) -> LinkBounds:
    """7.128, 7.130: prismatic joint."""
    p, w, vel, alpha, acc = translate_point(state, d)
    return p, w, eq.sliding_velocity(vel, _Z, u), alpha, eq.sliding_acceleration(acc, w, _Z, u, u_rate)


def after_free_joint(
    state: LinkBounds, d: Length, o: Length, u: Length, o_rate: Length, u_rate: Length
) -> LinkBounds:
    """7.129, 7.130: planar or floating joint."""
    p, w, vel, alpha, acc = translate_point(state, d)
    alpha = eq.free_angular_acceleration(alpha, eq.plus(w, o), o, o_rate)
    acc = eq.free_acceleration(acc, w, o, u, u_rate)
    return p, eq.plus(w, o), eq.plus(vel, u), alpha, acc
