"""A robot as a mechanism: rigid bodies and joint screws in the zero configuration.

By the product of exponentials a link's pose is exp(S_1 t_1) ... exp(S_n t_n) H. The unit screws S_i and the
pose H are those of the zero configuration, in one common frame. The links between the joints do not occur in
this product, so links that are fixed to each other may be merged or split. Any body may serve as the root: a
path from another body passes some joints backwards, with reversed screws.

The coordinates of a planar or floating joint are a pose P. If B's joint is in another frame, or the body
behind it has another frame, the motions are equal for

    P_b = M P_a N,      or      M P_a^-1 N if one model's joint is reversed.

For a floating joint any rigid M and N are valid. For a planar joint, M P N must be in the plane for every P
in the plane. This requires that M raises the plane by as much as N lowers it, and that both or neither turn
it over.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from urdfkin.kinematics.rotation import (
    axis_aligning,
    exp_rotation,
    quaternion_of,
    rotation_about,
    rotation_of,
)
from urdfkin.kinematics.roundings import EPS, of_two_texts
from urdfkin.model.chain import LEAST_SIZE
from urdfkin.model.pose import is_rigid, pose
from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree

#: Below this length across an axis (of a unit vector, or in metres), a vector counts as parallel to it.
ALONG = 1e-12


def along(screw: Screw, value: float, *, turns: bool) -> FloatArray:
    """Return exp(S t) (4, 4): a rotation about a screw in radians, or a translation along it in metres."""
    if not turns:
        return pose(p=screw.direction * value)
    R = rotation_about(screw.direction, value)
    return pose(R, screw.point - R @ screw.point)


def between(start: Screw, end: Screw, *, turns: bool) -> tuple[FloatArray, float, float]:
    """Return the smallest motion from one joint axis to another, its tilt (rad) and its shift (m).

    The motion tilts the axis about the first joint's origin and then shifts it perpendicular to itself. It
    contains no rotation about the axis and no shift along it, because these belong to the joint's zero or
    have no effect. The axis of a prismatic joint has no position, so its shift is 0.
    """
    R, tilt = shortest_turn(start.direction, end.direction)
    across = np.zeros(3)
    if turns:
        way = end.point - start.point
        across = way - end.direction * (end.direction @ way)
    return pose(R, start.point - R @ start.point + across), tilt, float(np.linalg.norm(across))


def shortest_turn(u: FloatArray, v: FloatArray) -> tuple[FloatArray, float]:
    """Return the rotation by the smallest angle from one unit vector to another, and the angle."""
    cross = np.cross(u, v)
    sine, cosine = float(np.linalg.norm(cross)), float(u @ v)
    angle = math.atan2(sine, cosine)
    if sine == 0.0:  # opposite vectors: any perpendicular axis is correct
        axis = np.zeros(3) if cosine > 0.0 else axis_aligning(u)[:, 0] * math.pi
        return exp_rotation(axis), angle
    return exp_rotation(cross * (angle / sine)), angle


def apart(T: FloatArray, other: FloatArray) -> tuple[float, float]:
    """Return the angle (rad) and the distance (m) between two poses."""
    R = (other[:3, :3] @ T[:3, :3].T).tolist()  # called thousands of times; plain floats are faster
    sine = math.hypot(R[2][1] - R[1][2], R[0][2] - R[2][0], R[1][0] - R[0][1])
    angle = math.atan2(sine, R[0][0] + R[1][1] + R[2][2] - 1.0)
    return angle, math.dist(other[:3, 3].tolist(), T[:3, 3].tolist())


def turn_about(u: FloatArray, R: FloatArray) -> float:
    """Return the angle of the rotation about u that is nearest to R."""
    vector = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    return math.atan2(float(u @ vector), float(np.trace(R) - u @ R @ u))


def angle_from_to(u: FloatArray, x: FloatArray, y: FloatArray) -> float | None:
    """Return the angle about u from x to y, projected along u; None if x or y is parallel to u."""
    x, y = x - u * (u @ x), y - u * (u @ y)
    if min(np.linalg.norm(x), np.linalg.norm(y)) < ALONG:
        return None
    return math.atan2(float(u @ np.cross(x, y)), float(x @ y))


#: Relative tolerance for the entries of a computed pose.
NEARLY = 1e-9
#: A generic planar configuration: translated along both axes, and rotated.
_AWAY = np.array([1.0, 2.0, 3.0])
_Z = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True, eq=False)
class JointTransform:
    """The conversion of a planar or floating joint: P_b = before P_a behind; P_a^-1 if `back`.

    Attributes:
        before: (4, 4) M.
        behind: (4, 4) N.
        back: Whether one model's joint is reversed.
    """

    before: FloatArray
    behind: FloatArray
    back: bool = False

    def __call__(self, kind: JointKind, own: FloatArray) -> FloatArray:
        """Convert A's coordinates (..., 3 or 7) of a planar or floating joint to B's."""
        P = pose_of(kind, own)
        return coordinates_of(kind, self.before @ (np.linalg.inv(P) if self.back else P) @ self.behind)

    def holds_for(self, kind: JointKind) -> bool:
        """Return whether M and N are rigid, and M P N is a pose of the joint, at zero and at a generic P."""
        if not all(is_pose(JointKind.FLOATING, T) for T in (self.before, self.behind)):
            return False
        away = pose_of(JointKind.PLANAR, _AWAY)
        return all(is_pose(kind, self.before @ P @ self.behind) for P in (np.eye(4), away))


def pose_of(kind: JointKind, own: FloatArray) -> FloatArray:
    """Return P (..., 4, 4) for a joint's coordinates: (x, y, angle), or (x, y, z, qx, qy, qz, qw)."""
    P = np.zeros((*own.shape[:-1], 4, 4))
    P[..., 3, 3] = 1.0
    if kind is JointKind.PLANAR:
        P[..., :2, 3], P[..., :3, :3] = own[..., :2], rotation_about(_Z, own[..., 2])
    elif kind is not JointKind.FLOATING:
        raise NotImplementedError(f"the pose of a {kind} joint")
    else:
        P[..., :3, 3], P[..., :3, :3] = own[..., :3], rotation_of(own[..., 3:])
    return P


def coordinates_of(kind: JointKind, P: FloatArray) -> FloatArray:
    """Return the coordinates of a pose (..., 4, 4) of a planar or floating joint."""
    if kind is JointKind.PLANAR:
        return np.concatenate((P[..., :2, 3], turn_in_plane(P)[..., np.newaxis]), axis=-1)
    if kind is not JointKind.FLOATING:
        raise NotImplementedError(f"the coordinates of a {kind} joint")
    return np.concatenate((P[..., :3, 3], quaternion_of(P[..., :3, :3])), axis=-1)


def is_pose(kind: JointKind, T: FloatArray) -> bool:
    """Return whether a planar or floating joint can reach a matrix; a floating joint reaches every pose."""
    near = NEARLY * (1.0 + np.abs(T).max())
    if not is_rigid(T, near):
        return False
    return kind is JointKind.FLOATING or bool(np.abs(onto_plane(T) - T).max() <= near)


def turn_in_plane(P: FloatArray) -> FloatArray:
    """Return the angle about z that is nearest to a pose's rotation."""
    return np.arctan2(P[..., 1, 0] - P[..., 0, 1], P[..., 0, 0] + P[..., 1, 1])


def onto_plane(P: FloatArray) -> FloatArray:
    """Return the pose (4, 4) in the plane that is nearest to another pose."""
    return pose_of(JointKind.PLANAR, coordinates_of(JointKind.PLANAR, P))


def undoing(M: FloatArray) -> FloatArray:
    """Return N (4, 4) for which M P N is in the plane for every P in the plane.

    M must keep the direction of the plane's normal or reverse it. M is then composed of a translation by h
    along the normal, a motion in the plane, and possibly half a turn about x. N reverses the translation and
    the half turn.
    """
    over = np.diag([1.0, -1.0, -1.0, 1.0]) if M[2, 2] < 0.0 else np.eye(4)
    return over @ pose(p=(0.0, 0.0, -M[2, 3]))


@dataclass(frozen=True, slots=True, eq=False)
class Screw:
    """A joint's axis as a directed line: a unit direction through a point."""

    direction: FloatArray
    point: FloatArray

    def moved(self, T: FloatArray) -> Screw:
        """Return the screw after a rigid motion."""
        return Screw(T[:3, :3] @ self.direction, T[:3, :3] @ self.point + T[:3, 3])

    def reversed(self) -> Screw:
        """Return the same line with the opposite direction."""
        return Screw(-self.direction, self.point)


@dataclass(frozen=True, slots=True)
class Edge:
    """A joint between two bodies.

    Attributes:
        joint: Index of the joint in the tree.
        inner: The parent body.
        outer: The child body.
    """

    joint: int
    inner: int
    outer: int

    def beyond(self, body: int) -> int:
        """Return the other body of the joint."""
        return self.outer if body == self.inner else self.inner


class Mechanism:
    """Bodies and joints of a tree in the zero configuration.

    Args:
        tree: The robot.
        parting: Indices of fixed joints that separate two bodies, because these joints move in the other
            model.
    """

    def __init__(self, tree: KinematicTree, parting: Collection[int] = ()) -> None:
        self.tree = tree
        homes, body, edges, bodies = [np.eye(4)], [0], list[Edge](), [[0]]
        lengths, depths = [0.0], [0]
        for i, joint in enumerate(tree.joints):
            homes.append(homes[joint.parent] @ joint.T_parent_joint)
            lengths.append(lengths[joint.parent] + joint.length)
            depths.append(depths[joint.parent] + 1)
            if joint.kind.nv or i in parting:
                body.append(len(bodies))
                edges.append(Edge(i, body[joint.parent], len(bodies)))
                bodies.append([i + 1])
            else:
                body.append(body[joint.parent])
                bodies[body[-1]].append(i + 1)
        self.homes, self.body_of, self.edges = homes, body, edges
        self.bodies = bodies
        #: Joint orders that differ from the tree's, one for each reordered run of joints.
        self.orders: tuple[tuple[str, ...], ...] = ()
        #: For each link: length (m) of the path from the root, and number of joints on it, fixed ones too.
        self.lengths, self.depths = lengths, depths
        self._screws: dict[int, Screw] = {}

    def joint(self, edge: Edge) -> Joint:
        """Return the tree's joint of an edge."""
        return self.tree.joints[edge.joint]

    def screw(self, edge: Edge) -> Screw:
        """Return the screw of a revolute or prismatic joint in the zero configuration, in the root frame."""
        if (known := self._screws.get(edge.joint)) is None:
            T = self.homes[edge.joint + 1]
            known = self._screws[edge.joint] = Screw(T[:3, :3] @ self.joint(edge).axis, T[:3, 3])
        return known

    def in_order(self, names: Sequence[str]) -> Mechanism:
        """Return the same mechanism with consecutive joints in another order that their axes allow.

        Links between reordered joints belong to no body in the result.

        Args:
            names: Joints of a run of consecutive joints, from the inner body outwards.
        """
        joints = [self.tree.joint_index(name) for name in names]
        run = [edge for edge in self.edges if edge.joint in joints]
        other = copy(self)
        vars(other).pop("edges_of", None)
        places = dict(zip(run, joints, strict=True))
        other.edges = [replace(edge, joint=places[edge]) if edge in places else edge for edge in self.edges]
        other.bodies = list(self.bodies)
        for k, edge in enumerate(run[:-1]):
            if {one.joint for one in run[: k + 1]} != set(joints[: k + 1]):
                other.bodies[edge.outer] = []
        other.orders = (*self.orders, tuple(names))
        return other

    def may_be_taken(self, names: Sequence[str], tolerance: Tolerance) -> bool:
        """Return whether joints are consecutive, and all pairs that change places commute."""
        joints = [self.tree.joint_index(name) for name in names]
        run = [edge for edge in self.edges if edge.joint in joints]
        one_line = all(
            inner.outer == outer.inner and len(self.edges_of[outer.inner]) == 2
            for inner, outer in pairwise(run)
        )
        changed = (
            (one, other)
            for k, one in enumerate(run)
            for other in run[k + 1 :]
            if joints.index(one.joint) > joints.index(other.joint)
        )
        return len(run) == len(names) and one_line and all(self._commute(*two, tolerance) for two in changed)

    def orders_of_runs(self, tolerance: Tolerance) -> Iterator[Iterator[list[str]]]:
        """For each run of consecutive joints, yield its orders with the same motion."""
        run: list[Edge] = []
        for edge in self.edges:  # depth first: the next edge continues the run if the body has no other
            if run and edge.inner == run[-1].outer and len(self.edges_of[edge.inner]) == 2:
                run.append(edge)
                continue
            yield self._orders(run, tolerance)
            run = [edge]
        yield self._orders(run, tolerance)

    def _orders(self, run: Sequence[Edge], tolerance: Tolerance) -> Iterator[list[str]]:
        """Yield all orders reached by exchanging commuting neighbours, the given order first."""
        if not run:
            yield []
        for k, edge in enumerate(run):
            if all(self._commute(one, edge, tolerance) for one in run[:k]):
                for others in self._orders([*run[:k], *run[k + 1 :]], tolerance):
                    yield [self.joint(edge).name, *others]

    def _commute(self, one: Edge, other: Edge, tolerance: Tolerance) -> bool:
        """Return whether two joints commute.

        These do: two prismatic joints, a prismatic joint along the axis of a revolute one, and two revolute
        joints about one line.
        """
        kinds = [self.joint(edge).kind for edge in (one, other)]
        if not all(kind.has_axis and kind.nv for kind in kinds):
            return False
        if not any(kind.turns for kind in kinds):
            return True
        s, t = self.screw(one), self.screw(other)
        angle, way = between_lines(s, t, placed=all(kind.turns for kind in kinds))
        return tolerance.holds(angle, way)

    @cached_property
    def edges_of(self) -> list[list[Edge]]:
        """The joints at each body."""
        found: list[list[Edge]] = [[] for _ in self.bodies]
        for edge in self.edges:
            found[edge.inner].append(edge)
            found[edge.outer].append(edge)
        return found

    @cached_property
    def size(self) -> float:
        """Length (m) of the longest path from the root to a link, the scale of the mechanism's lengths."""
        return max(self.lengths)

    @cached_property
    def rounding(self) -> float:
        """Rounding error of poses read from a file, summed over all links (rad, and as a fraction of `size`).

        It includes the small tilts of Pinocchio's axes (URDF514).
        """
        return EPS * of_two_texts(max(self.depths)) + 2.0 * sum(joint.tilt for joint in self.tree.joints)


@dataclass(frozen=True, slots=True)
class Tolerance:
    """The largest angle (rad) and distance (m) that count as rounding."""

    angle: float
    way: float

    def holds(self, angle: float, way: float) -> bool:
        """Return whether both are within the tolerance."""
        return angle <= self.angle and way <= self.way


def tolerance_of(a: Mechanism, b: Mechanism) -> Tolerance:
    """Return the largest difference of two files of one robot that rounding can cause."""
    k = a.rounding + b.rounding
    return Tolerance(k, k * size_of(a, b))


def size_of(a: Mechanism, b: Mechanism) -> float:
    """Return the length (m) that converts angles to distances in a comparison."""
    return max(a.size, b.size, LEAST_SIZE)


def between_lines(s: Screw, t: Screw, *, placed: bool) -> tuple[float, float]:
    """Return the angle (rad) and the distance (m) between two axes as lines; distance 0 without `placed`."""
    ux, uy, uz = s.direction.tolist()  # called thousands of times; plain floats are faster
    vx, vy, vz = t.direction.tolist()
    sine = math.hypot(uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx)
    angle = math.atan2(sine, abs(ux * vx + uy * vy + uz * vz))
    if not placed:
        return angle, 0.0
    x, y, z = (s.point - t.point).tolist()
    along = vx * x + vy * y + vz * z
    return angle, math.hypot(x - along * vx, y - along * vy, z - along * vz)
