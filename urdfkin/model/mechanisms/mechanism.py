"""Rigid motions along and between screws: what a joint does, and what makes one axis another.

A planar or floating joint counted from another place: the same motion in other coordinates.

Such a joint's coordinates are a pose P. Where B's joint stands in another frame, or what hangs on it is seen
from another one, it moves alike at

    P_b = M P_a N,      or at      M P_a^-1 N where one model's joint runs back.

For a floating joint any rigid M and N will do. A planar joint's poses are those of a plane, and M P N must be
one for every P: M and N lift the plane by as much as they lower it, and turn it over both or neither.


A robot as what its motion is fixed by: rigid bodies, and between them joints with their screws at home.

By the product of exponentials a link's pose is exp(S_1 t_1) ... exp(S_n t_n) H, with the unit screws S_i and
the pose H as they are where every joint's value is zero, all seen from one place. No link between the joints
enters it, so that fixed links may be merged or split; and nothing in it says which body is the root: seen
from another body, what lies on the way is passed backwards, with its screw reversed.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from urdfkin.kinematics.rotation.axis_angle import exp_rotation, rotation_about
from urdfkin.kinematics.rotation.matrix import axis_aligning
from urdfkin.kinematics.rotation.quaternion import quaternion_of, rotation_of
from urdfkin.kinematics.roundings import EPS, of_two_texts
from urdfkin.model.chain import LEAST_SIZE
from urdfkin.model.pose import pose
from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree

#: What lies across an axis by less, a unit vector or metres, lies along it, and has no direction there.
ALONG = 1e-12


def along(screw: Screw, value: float, *, turns: bool) -> FloatArray:
    """(4, 4) exp(S t): a turn about a screw by radians, or a slide along it by metres."""
    if not turns:
        return pose(p=screw.direction * value)
    R = rotation_about(screw.direction, value)
    return pose(R, screw.point - R @ screw.point)


def between(start: Screw, end: Screw, *, turns: bool) -> tuple[FloatArray, float, float]:
    """The least motion that makes one joint's axis another's, its tilt (rad) and its way (m).

    The axis is tilted about the first joint's origin and moved across itself: what is left, a turn about the
    axis and a way along it, is a joint's zero or nobody's business. A slide's axis has no place.
    """
    R, tilt = shortest_turn(start.direction, end.direction)
    across = np.zeros(3)
    if turns:
        way = end.point - start.point
        across = way - end.direction * (end.direction @ way)
    return pose(R, start.point - R @ start.point + across), tilt, float(np.linalg.norm(across))


def shortest_turn(u: FloatArray, v: FloatArray) -> tuple[FloatArray, float]:
    """The rotation by the least angle that turns one unit vector to another, and the angle."""
    cross = np.cross(u, v)
    sine, cosine = float(np.linalg.norm(cross)), float(u @ v)
    angle = math.atan2(sine, cosine)
    if sine == 0.0:  # opposite: about any axis across
        axis = np.zeros(3) if cosine > 0.0 else axis_aligning(u)[:, 0] * math.pi
        return exp_rotation(axis), angle
    return exp_rotation(cross * (angle / sine)), angle


def apart(T: FloatArray, other: FloatArray) -> tuple[float, float]:
    """By what angle (rad) and way (m) two poses differ."""
    R = (other[:3, :3] @ T[:3, :3].T).tolist()  # a walk asks this thousands of times: plain numbers
    sine = math.hypot(R[2][1] - R[1][2], R[0][2] - R[2][0], R[1][0] - R[0][1])
    angle = math.atan2(sine, R[0][0] + R[1][1] + R[2][2] - 1.0)
    return angle, math.dist(other[:3, 3].tolist(), T[:3, 3].tolist())


def turn_about(u: FloatArray, R: FloatArray) -> float:
    """The angle about an axis that comes nearest to a rotation."""
    vector = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    return math.atan2(float(u @ vector), float(np.trace(R) - u @ R @ u))


def angle_from_to(u: FloatArray, x: FloatArray, y: FloatArray) -> float | None:
    """The angle about u from x to y, seen along u; None where one of them is along u."""
    x, y = x - u * (u @ x), y - u * (u @ y)
    if min(np.linalg.norm(x), np.linalg.norm(y)) < ALONG:
        return None
    return math.atan2(float(u @ np.cross(x, y)), float(x @ y))


#: What the entries of a pose that was computed may be off by, as a share of their size.
NEARLY = 1e-9
#: A place in the plane that is none of the special ones: moved along both axes, and turned.
_AWAY = np.array([1.0, 2.0, 3.0])
_Z = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True, eq=False)
class JointTransform:
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


@dataclass(frozen=True, slots=True, eq=False)
class Screw:
    """A joint's axis as a line that points: a unit direction through a point."""

    direction: FloatArray
    point: FloatArray

    def moved(self, T: FloatArray) -> Screw:
        """The screw after a rigid motion."""
        return Screw(T[:3, :3] @ self.direction, T[:3, :3] @ self.point + T[:3, 3])

    def reversed(self) -> Screw:
        """The same line, pointing the other way."""
        return Screw(-self.direction, self.point)


@dataclass(frozen=True, slots=True)
class Edge:
    """A joint between two bodies.

    Attributes:
        joint: Its index in the tree.
        inner: The body that carries it.
        outer: The body that it moves.
    """

    joint: int
    inner: int
    outer: int

    def beyond(self, body: int) -> int:
        """The body at the other end."""
        return self.outer if body == self.inner else self.inner


class Mechanism:
    """Bodies and joints of a tree at home, where every joint's value is zero.

    Args:
        tree: The robot.
        parting: Fixed joints (indices) that count as joints all the same, since another model's move there.
    """

    def __init__(self, tree: KinematicTree, parting: Collection[int] = ()) -> None:
        self.tree = tree
        homes, body, edges, bodies = [np.eye(4)], [0], list[Edge](), [[0]]
        lengths, depths = [0.0], [0]
        for i, joint in enumerate(tree.joints):
            homes.append(homes[joint.parent] @ joint.T_parent_joint)
            lengths.append(lengths[joint.parent] + math.hypot(*joint.T_parent_joint[:3, 3].tolist()))
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
        #: Joints that are taken in another order than the tree's, run by run.
        self.orders: tuple[tuple[str, ...], ...] = ()
        #: How far (m) the way from the root to each link is, and how many joints it passes, fixed ones too.
        self.lengths, self.depths = lengths, depths
        self._screws: dict[int, Screw] = {}

    def joint(self, edge: Edge) -> Joint:
        """What the tree says of it."""
        return self.tree.joints[edge.joint]

    def screw(self, edge: Edge) -> Screw:
        """Of a joint that turns or slides, at home, seen from the root."""
        if (known := self._screws.get(edge.joint)) is None:
            T = self.homes[edge.joint + 1]
            known = self._screws[edge.joint] = Screw(T[:3, :3] @ self.joint(edge).axis, T[:3, 3])
        return known

    def in_order(self, names: Sequence[str]) -> Mechanism:
        """The same motion with joints one behind the other taken in another order, which their axes allow.

        Links between them that other joints then carry are on no body any more.

        Args:
            names: Joints of a run, from the inner body outwards.
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
        """Whether joints are such a run, and axes allow that order: any two that change places commute."""
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
        """For each run of joints, nothing else on the bodies between, its orders that move alike."""
        run: list[Edge] = []
        for edge in self.edges:  # depth first: what follows is next where the body between has no other
            if run and edge.inner == run[-1].outer and len(self.edges_of[edge.inner]) == 2:
                run.append(edge)
                continue
            yield self._orders(run, tolerance)
            run = [edge]
        yield self._orders(run, tolerance)

    def _orders(self, run: Sequence[Edge], tolerance: Tolerance) -> Iterator[list[str]]:
        """All that exchanging neighbours leads to, the run's own first."""
        if not run:
            yield []
        for k, edge in enumerate(run):
            if all(self._commute(one, edge, tolerance) for one in run[:k]):
                for others in self._orders([*run[:k], *run[k + 1 :]], tolerance):
                    yield [self.joint(edge).name, *others]

    def _commute(self, one: Edge, other: Edge, tolerance: Tolerance) -> bool:
        """Two slides, a slide along a turn's axis, two turns about one line."""
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
        """Metres: the longest way from the root to a link, the scale of its lengths."""
        return max(self.lengths)

    @cached_property
    def rounding(self) -> float:
        """By how much (rad, and as a share of `size`) what is read from a text may be off, for all links.

        Pinocchio turns about some axes that are tilted by as little (URDF514).
        """
        return EPS * of_two_texts(max(self.depths)) + 2.0 * sum(joint.tilt for joint in self.tree.joints)


@dataclass(frozen=True, slots=True)
class Tolerance:
    """What of an angle (rad) and of a way (m) is rounding."""

    angle: float
    way: float

    def holds(self, angle: float, way: float) -> bool:
        """Whether both are."""
        return angle <= self.angle and way <= self.way


def tolerance_of(a: Mechanism, b: Mechanism) -> Tolerance:
    """What two texts of one robot may differ by."""
    k = a.rounding + b.rounding
    return Tolerance(k, k * size_of(a, b))


def size_of(a: Mechanism, b: Mechanism) -> float:
    """Metres: what angles are counted with where both are compared."""
    return max(a.size, b.size, LEAST_SIZE)


def between_lines(s: Screw, t: Screw, *, placed: bool) -> tuple[float, float]:
    """By what angle (rad), and if they have a place by what way (m), two axes differ as lines."""
    ux, uy, uz = s.direction.tolist()  # a walk asks this thousands of times: plain numbers
    vx, vy, vz = t.direction.tolist()
    sine = math.hypot(uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx)
    angle = math.atan2(sine, abs(ux * vx + uy * vy + uz * vz))
    if not placed:
        return angle, 0.0
    x, y, z = (s.point - t.point).tolist()
    along = vx * x + vy * y + vz * z
    return angle, math.hypot(x - along * vx, y - along * vy, z - along * vz)
