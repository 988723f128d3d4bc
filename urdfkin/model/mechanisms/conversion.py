"""A planar or floating joint counted from another place: the same motion in other coordinates.

Such a joint's coordinates are a pose P. Where B's joint stands in another frame, or what hangs on it is seen
from another one, it moves alike at

    P_b = M P_a N,      or at      M P_a^-1 N where one model's joint runs back.

For a floating joint any rigid M and N will do. A planar joint's poses are those of a plane, and M P N must be
one for every P: M and N lift the plane by as much as they lower it, and turn it over both or neither.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdfkin.kinematics.rotation.axis_angle import rotation_about
from urdfkin.kinematics.rotation.quaternion import quaternion_of, rotation_of
from urdfkin.model.pose import pose
from urdfkin.model.tree import FloatArray, JointKind

#: What the entries of a pose that was computed may be off by, as a share of their size.
NEARLY = 1e-9
#: A place in the plane that is none of the special ones: moved along both axes, and turned.
_AWAY = np.array([1.0, 2.0, 3.0])
_Z = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True, eq=False)
class Conversion:
    """P_b = before P_a behind; with P_a^-1 where `back`.

    Attributes:
        before: (4, 4) M.
        behind: (4, 4) N.
        back: Whether one model's joint runs back.
    """

    before: FloatArray
    behind: FloatArray
    back: bool = False

    def __call__(self, kind: JointKind, own: FloatArray) -> FloatArray:
        """(..., 3 or 7) B's coordinates for A's, of a planar or a floating joint."""
        P = pose_of(kind, own)
        return coordinates_of(kind, self.before @ (np.linalg.inv(P) if self.back else P) @ self.behind)

    def holds_for(self, kind: JointKind) -> bool:
        """Whether M and N are rigid, and M P N one of the joint's poses at home and turned and moved away."""
        if not all(is_pose(JointKind.FLOATING, T) for T in (self.before, self.behind)):
            return False
        away = pose_of(JointKind.PLANAR, _AWAY)
        return all(is_pose(kind, self.before @ P @ self.behind) for P in (np.eye(4), away))


def pose_of(kind: JointKind, own: FloatArray) -> FloatArray:
    """(..., 4, 4) P at a joint's coordinates: (x, y, angle), or (x, y, z, qx, qy, qz, qw)."""
    P = np.zeros((*own.shape[:-1], 4, 4))
    P[..., 3, 3] = 1.0
    if kind is JointKind.PLANAR:
        P[..., :2, 3], P[..., :3, :3] = own[..., :2], rotation_about(_Z, own[..., 2])
    else:
        P[..., :3, 3], P[..., :3, :3] = own[..., :3], rotation_of(own[..., 3:])
    return P


def coordinates_of(kind: JointKind, P: FloatArray) -> FloatArray:
    """The coordinates of a pose."""
    if kind is JointKind.PLANAR:
        return np.concatenate((P[..., :2, 3], turn_in_plane(P)[..., np.newaxis]), axis=-1)
    return np.concatenate((P[..., :3, 3], quaternion_of(P[..., :3, :3])), axis=-1)


def is_pose(kind: JointKind, T: FloatArray) -> bool:
    """Whether a matrix is one that a planar or floating joint reaches; a floating one reaches every pose."""
    R = T[:3, :3]
    near = NEARLY * (1.0 + np.abs(T).max())
    if np.abs(R @ R.T - np.eye(3)).max() > near or np.linalg.det(R) < 0.0 or T[3].tolist() != [0, 0, 0, 1]:
        return False
    return kind is JointKind.FLOATING or bool(np.abs(onto_plane(T) - T).max() <= near)


def turn_in_plane(P: FloatArray) -> FloatArray:
    """The angle about z that comes nearest to a pose's rotation."""
    return np.arctan2(P[..., 1, 0] - P[..., 0, 1], P[..., 0, 0] + P[..., 1, 1])


def onto_plane(P: FloatArray) -> FloatArray:
    """(4, 4) the pose in the plane that is nearest to another."""
    return pose_of(JointKind.PLANAR, coordinates_of(JointKind.PLANAR, P))


def undoing(M: FloatArray) -> FloatArray:
    """(4, 4) N with which M P N is in the plane for every P that is, where M leaves its normal the plane's.

    M is a lift by h, a motion in the plane, and perhaps half a turn about x: N undoes the lift and the turn.
    """
    over = np.diag([1.0, -1.0, -1.0, 1.0]) if M[2, 2] < 0.0 else np.eye(4)
    return over @ pose(p=(0.0, 0.0, -M[2, 3]))
