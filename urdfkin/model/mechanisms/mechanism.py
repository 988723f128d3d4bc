"""Describe robots by rigid bodies and joint screws in the zero configuration, and align two such robots.

By the product of exponentials, the pose of a link is:

`exp(S_1 t_1) ... exp(S_n t_n) H`

The unit screws S_i describe the joint axes, and H is the link's pose. Both apply to the zero configuration,
and use one common frame. The constant poses between the joints are not factors of this product. Therefore,
the product does not change if links that are fixed to each other are merged. Any body may be the root. If a
path from the root leads from the child link of a joint to the parent link, the joint's screw is reversed.

**Planar and floating joints.** The coordinates of such a joint describe a pose P. A and B may define
different frames for the joint. The constant rigid motion M describes this difference. A and B may also define
different frames for the body after the joint. The constant rigid motion N describes this second difference. A
and B move in the same way if:

`P_b = M P_a N`

If the joint is reversed in one model, P_a^-1 replaces P_a.

For a floating joint, M and N may be any rigid motions. A planar joint reaches only planar poses, which are
translations and rotations in the joint's plane. Therefore, M P N must be a planar pose for every planar pose
P. If M raises the plane by some distance, N must lower the plane by the same distance. If M turns the plane
over, N must also turn the plane over.

**Alignment.** The matcher starts at a body of A and the corresponding body of B, both in the zero
configuration. The rigid motion G moves A's body to B's body. A joint of A with the screw S and the value t
moves the later bodies by exp(S t). The matched joint of B moves the corresponding bodies by exp(S' t'). S'
and t' use the positive direction and the zero of A's joint. The displaced parts of B determine the effect:

| displaced parts of B | effect |
|---|---|
| none | the later bodies have the same G |
| the axis and all later bodies, together | G changes by a constant rigid motion L |
| only the axis | S' differs from S |

The link poses of A and B are:

`T_A = exp(S_1 t_1) ... exp(S_n t_n) H`
`T_B = L_1 exp(S'_1 t'_1) ... L_n exp(S'_n t'_n) L H`

Each L is expressed in A's root frame, with A in the zero configuration. If A and B agree at joint i, then
S'_i = S_i, t'_i = t_i, and L_i is the identity. If A and B agree at all joints and links, the two models have
the same motion. If A and B differ at a joint or link, the motions of the two models usually differ. There are
exceptions. For example, two consecutive revolute joints may rotate about the same line. The later links then
depend only on the sum of the two angles.

**Variables.** Each joint value of A or B is a function `slope * variable + constant`. Each coordinate of A is
a variable. Most coordinates of B are functions of these variables; the sign and the zero offset of the joint
determine the slope and the constant. The remaining coordinates of B are additional variables. For example, if
A's joint is fixed and B's joint moves, the coordinate of B's joint is an additional variable.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations, pairwise

import numpy as np

from urdfkin.kinematics.rotation import (
    exp_rotation,
    quaternion_of,
    rotation_about,
    rotation_from_quaternion,
    rotation_with_z_axis,
)
from urdfkin.kinematics.roundings import AXIS_ROUNDINGS, CONSTANT_POSE_ROUNDINGS, EPS, FILE_ANGLE_ROUNDINGS
from urdfkin.model.chain import MIN_ROBOT_SIZE
from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree, inverse, is_rigid, pose

#: A vector counts as parallel to an axis if its perpendicular component is shorter than this value. The
#: vector is a unit vector, or a distance vector in m.
PARALLEL_TOLERANCE = 1e-12


def screw_motion(screw: Screw, value: float, *, turns: bool) -> FloatArray:
    """Return the motion exp(S t) (4, 4) for a value t (rad or m)."""
    if not turns:
        return pose(p=screw.direction * value)
    R = rotation_about(screw.direction, value)
    return pose(R, screw.point - R @ screw.point)


def smallest_motion(start: Screw, end: Screw, *, turns: bool) -> tuple[FloatArray, float, float]:
    """Return the smallest motion from one joint axis to another.

    The motion does not rotate about the axis or shift along the axis.

    Returns:
        (4, 4) motion, tilt (rad) and shift (m). The shift is 0 for prismatic joints.
    """
    R, tilt = smallest_rotation(start.direction, end.direction)
    across = np.zeros(3)
    if turns:
        offset = end.point - start.point
        across = offset - end.direction * (end.direction @ offset)
    return pose(R, start.point - R @ start.point + across), tilt, float(np.linalg.norm(across))


def smallest_rotation(u: FloatArray, v: FloatArray) -> tuple[FloatArray, float]:
    """Return the smallest rotation from the unit vector u to the unit vector v, and its angle (rad)."""
    cross = np.cross(u, v)
    sine, cosine = float(np.linalg.norm(cross)), float(u @ v)
    angle = math.atan2(sine, cosine)
    if sine == 0.0:  # for opposite vectors, any perpendicular axis is correct
        axis = np.zeros(3) if cosine > 0.0 else rotation_with_z_axis(u)[:, 0] * math.pi
        return exp_rotation(axis), angle
    return exp_rotation(cross * (angle / sine)), angle


def pose_difference(T: FloatArray, other: FloatArray) -> tuple[float, float]:
    """Return the angle (rad) and the distance (m) between two poses."""
    R = (other[:3, :3] @ T[:3, :3].T).tolist()  # Python floats are faster than small NumPy arrays
    sine = math.hypot(R[2][1] - R[1][2], R[0][2] - R[2][0], R[1][0] - R[0][1])
    angle = math.atan2(sine, R[0][0] + R[1][1] + R[2][2] - 1.0)
    return angle, math.dist(other[:3, 3].tolist(), T[:3, 3].tolist())


def angle_about(u: FloatArray, R: FloatArray) -> float:
    """Return the angle (rad) of the rotation about u that is nearest to R."""
    vector = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    return math.atan2(float(u @ vector), float(np.trace(R) - u @ R @ u))


def angle_from_to(u: FloatArray, x: FloatArray, y: FloatArray) -> float | None:
    """Return the angle (rad) about u from x to y; None if x or y is parallel to u."""
    x, y = x - u * (u @ x), y - u * (u @ y)
    if min(np.linalg.norm(x), np.linalg.norm(y)) < PARALLEL_TOLERANCE:
        return None
    return math.atan2(float(u @ np.cross(x, y)), float(x @ y))


#: Relative tolerance for the entries of a computed pose.
_POSE_TOLERANCE = 1e-9
#: Nonzero test coordinates of a planar joint (m, m, rad).
_TEST_COORDINATES = np.array([1.0, 2.0, 3.0])
_Z = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True, eq=False)
class FreeJointConversion:
    """Conversion of a planar or floating joint.

    The module docstring defines M and N under *Planar and floating joints*.

    Attributes:
        before: Rigid motion M (4, 4).
        behind: Rigid motion N (4, 4).
        back: Whether P_a^-1 replaces P_a, because one model reverses the joint.
    """

    before: FloatArray
    behind: FloatArray
    back: bool = False

    def __call__(self, kind: JointKind, coordinates: FloatArray) -> FloatArray:
        """Convert coordinates of A's joint to coordinates of B's joint."""
        P = pose_of(kind, coordinates)
        return coordinates_of(kind, self.before @ (np.linalg.inv(P) if self.back else P) @ self.behind)

    def holds_for(self, kind: JointKind) -> bool:
        """Return whether M and N are rigid motions, and the joint can reach M P N for two poses P."""
        if not all(is_joint_pose(JointKind.FLOATING, T) for T in (self.before, self.behind)):
            return False
        away = pose_of(JointKind.PLANAR, _TEST_COORDINATES)
        return all(is_joint_pose(kind, self.before @ P @ self.behind) for P in (np.eye(4), away))


def pose_of(kind: JointKind, coordinates: FloatArray) -> FloatArray:
    """Return the poses of a joint.

    Args:
        kind: Planar or floating.
        coordinates: (..., 3) x, y, angle, or (..., 7) x, y, z, qx, qy, qz, qw.

    Returns:
        (..., 4, 4) poses.
    """
    P = np.zeros((*coordinates.shape[:-1], 4, 4))
    P[..., 3, 3] = 1.0
    if kind is JointKind.PLANAR:
        P[..., :2, 3], P[..., :3, :3] = coordinates[..., :2], rotation_about(_Z, coordinates[..., 2])
    elif kind is not JointKind.FLOATING:
        raise NotImplementedError(f"the pose of a {kind} joint")
    else:
        P[..., :3, 3], P[..., :3, :3] = coordinates[..., :3], rotation_from_quaternion(coordinates[..., 3:])
    return P


def coordinates_of(kind: JointKind, P: FloatArray) -> FloatArray:
    if kind is JointKind.PLANAR:
        return np.concatenate((P[..., :2, 3], planar_angle(P)[..., np.newaxis]), axis=-1)
    if kind is not JointKind.FLOATING:
        raise NotImplementedError(f"the coordinates of a {kind} joint")
    return np.concatenate((P[..., :3, 3], quaternion_of(P[..., :3, :3])), axis=-1)


def is_joint_pose(kind: JointKind, T: FloatArray) -> bool:
    if not is_rigid(T, _POSE_TOLERANCE):
        return False
    tolerance = _POSE_TOLERANCE * (1.0 + np.abs(T).max())
    return kind is JointKind.FLOATING or bool(np.abs(nearest_planar_pose(T) - T).max() <= tolerance)


def planar_angle(P: FloatArray) -> FloatArray:
    """Return the angle (rad) of the rotation about z that is nearest to the rotation of the pose P."""
    return np.arctan2(P[..., 1, 0] - P[..., 0, 1], P[..., 0, 0] + P[..., 1, 1])


def nearest_planar_pose(P: FloatArray) -> FloatArray:
    return pose_of(JointKind.PLANAR, coordinates_of(JointKind.PLANAR, P))


def out_of_plane_compensation(M: FloatArray) -> FloatArray:
    """Return a motion N for which M P N is planar for every planar pose P.

    The rotation of M must map the plane's normal z to z or -z.

    | M maps z to | M | N |
    |---|---|---|
    | z | `E T` | `T^-1` |
    | -z | `E T F` | `F T^-1` |

    E is a motion in the plane, T is a translation along the normal, and F is half a turn about x.
    """
    over = np.diag([1.0, -1.0, -1.0, 1.0]) if M[2, 2] < 0.0 else np.eye(4)
    return over @ pose(p=(0.0, 0.0, -M[2, 3]))


@dataclass(frozen=True, slots=True, eq=False)
class Screw:
    """A joint's axis as a directed line; `direction` is a unit vector."""

    direction: FloatArray
    point: FloatArray

    def transform(self, T: FloatArray) -> Screw:
        return Screw(T[:3, :3] @ self.direction, T[:3, :3] @ self.point + T[:3, 3])

    def reverse(self) -> Screw:
        return Screw(-self.direction, self.point)


@dataclass(frozen=True, slots=True)
class Edge:
    """A joint between the bodies `inner` (parent) and `outer` (child)."""

    #: Index of the joint in the tree.
    joint: int
    inner: int
    outer: int

    def other_body(self, body: int) -> int:
        return self.outer if body == self.inner else self.inner


class Mechanism:
    """Bodies and joints in the zero configuration.

    Args:
        tree: The robot.
        separating_joints: Indices in `tree.joints` of fixed joints that are moving joints in the other model.
        labels: Label of each link, by default its name. Links with equal labels are paired.
        free_frames: Whether a convention chooses the links' frames, as in a Denavit-Hartenberg table.

    Attributes:
        zero_poses: (4, 4) pose of each link in the root frame.
        lengths: Length (m) of the path from the root to each link.
        orders: Joint names in the new order, for each call of `reorder`.
    """

    def __init__(
        self,
        tree: KinematicTree,
        separating_joints: Collection[int] = (),
        labels: Sequence[str] | None = None,
        *,
        free_frames: bool = False,
    ) -> None:
        self.tree, self.free_frames = tree, free_frames
        self.labels = tree.links if labels is None else tuple(labels)
        self.zero_poses, self.body_of, self.bodies, self.edges = [np.eye(4)], [0], [[0]], list[Edge]()
        self.lengths, self.depths = [0.0], [0]
        self.orders: tuple[tuple[str, ...], ...] = ()
        self._screws: dict[int, Screw] = {}
        for i, joint in enumerate(tree.joints):
            self.zero_poses.append(self.zero_poses[joint.parent] @ joint.T_parent_joint)
            self.lengths.append(self.lengths[joint.parent] + joint.length)
            self.depths.append(self.depths[joint.parent] + 1)
            body = self.body_of[joint.parent]
            if joint.kind.nv or i in separating_joints:
                self.edges.append(Edge(i, body, len(self.bodies)))
                body = len(self.bodies)
                self.bodies.append([])
            self.body_of.append(body)
            self.bodies[body].append(i + 1)

    def joint(self, edge: Edge) -> Joint:
        return self.tree.joints[edge.joint]

    def screw(self, edge: Edge) -> Screw:
        """Return the joint's axis; for a planar joint, the normal of its plane."""
        if (known := self._screws.get(edge.joint)) is None:
            T, joint = self.zero_poses[edge.joint + 1], self.joint(edge)
            axis = _Z if joint.kind is JointKind.PLANAR else joint.axis
            known = self._screws[edge.joint] = Screw(T[:3, :3] @ axis, T[:3, 3])
        return known

    def reorder(self, names: Sequence[str]) -> Mechanism:
        """Return a copy in which the joints have the order `names`.

        `allows_order(names)` must be true. A link between two joints that change places is omitted.
        """
        joints = [self.tree.joint_index(name) for name in names]
        run = [edge for edge in self.edges if edge.joint in joints]
        other = copy(self)
        vars(other).pop("edges_by_body", None)
        new = dict(zip(run, joints, strict=True))
        other.edges = [replace(edge, joint=new[edge]) if edge in new else edge for edge in self.edges]
        other.bodies = list(self.bodies)
        for k, edge in enumerate(run[:-1]):
            if {one.joint for one in run[: k + 1]} != set(joints[: k + 1]):
                other.bodies[edge.outer] = []
        other.orders = (*self.orders, tuple(names))
        return other

    def merge(self, joints: Collection[int | None]) -> Mechanism:
        """Return a mechanism in which the fixed joints with the indices `joints` do not separate bodies."""
        fixed = {edge.joint for edge in self.edges if not self.joint(edge).kind.nv}
        if fixed.isdisjoint(joints):
            return self
        return Mechanism(self.tree, fixed - set(joints), self.labels, free_frames=self.free_frames)

    def allows_order(self, names: Sequence[str], tolerance: Tolerance) -> bool:
        """Return whether the robot moves in the same way with its joints in the order `names`.

        The result is false if the joints are not consecutive.
        """
        joints = [self.tree.joint_index(name) for name in names]
        run = [edge for edge in self.edges if edge.joint in joints]
        consecutive = all(self._are_consecutive(inner, outer) for inner, outer in pairwise(run))
        exchanged = (
            (one, other)
            for one, other in combinations(run, 2)
            if joints.index(one.joint) > joints.index(other.joint)
        )
        return (
            len(run) == len(names)
            and consecutive
            and all(self._commute(*pair, tolerance) for pair in exchanged)
        )

    def _are_consecutive(self, inner: Edge, outer: Edge) -> bool:
        return inner.outer == outer.inner and len(self.edges_by_body[outer.inner]) == 2

    def orders_of_runs(self, tolerance: Tolerance) -> Iterator[Iterator[list[str]]]:
        """Yield joint orders for each run of consecutive joints.

        An order is a list of joint names. All orders of a run give the same motion. The current order comes
        first.
        """
        run: list[Edge] = []
        for edge in self.edges:
            if run and self._are_consecutive(run[-1], edge):
                run.append(edge)
                continue
            yield self._orders(run, tolerance)
            run = [edge]
        yield self._orders(run, tolerance)

    def _orders(self, run: Sequence[Edge], tolerance: Tolerance) -> Iterator[list[str]]:
        if not run:
            yield []
        for k, edge in enumerate(run):
            if all(self._commute(one, edge, tolerance) for one in run[:k]):
                for others in self._orders([*run[:k], *run[k + 1 :]], tolerance):
                    yield [self.joint(edge).name, *others]

    def _commute(self, one: Edge, other: Edge, tolerance: Tolerance) -> bool:
        """Return whether two joints can be exchanged without a change of the motion.

        | kinds | commute |
        |---|---|
        | two prismatic joints | always |
        | two revolute joints | if their axes are the same line |
        | a revolute and a prismatic joint | if their axes are parallel |
        | all others | never |
        """
        kinds = [self.joint(edge).kind for edge in (one, other)]
        if not all(kind.has_axis and kind.nv for kind in kinds):
            return False
        if not any(kind.turns for kind in kinds):
            return True
        both_turn = all(kind.turns for kind in kinds)
        return tolerance.holds(*line_difference(self.screw(one), self.screw(other), with_distance=both_turn))

    @cached_property
    def edges_by_body(self) -> list[list[Edge]]:
        edges: list[list[Edge]] = [[] for _ in self.bodies]
        for edge in self.edges:
            edges[edge.inner].append(edge)
            edges[edge.outer].append(edge)
        return edges

    @property
    def table_tip(self) -> int | None:
        """The child link of a table's only fixed joint, which leads to the tip; None without a table."""
        if not self.free_frames:
            return None
        return next(i + 1 for i, joint in enumerate(self.tree.joints) if joint.original.kind.nv == 0)

    @cached_property
    def size(self) -> float:
        """Length (m) of the longest path from the root."""
        return max(self.lengths)

    @cached_property
    def rotation_rounding(self) -> float:
        """Rounding error (rad) of the links' rotations.

        The positions of the links have the rounding error `rotation_rounding * size` (m).
        The program that wrote the file rounded each joint's constant transform and axis.
        The parser rounds these numbers again. A program that merges fixed joints rounds less often.
        The error includes the angles between Pinocchio's and the URDF's axes.
        """
        joints = max(self.depths) + 1
        return EPS * ((CONSTANT_POSE_ROUNDINGS + FILE_ANGLE_ROUNDINGS + AXIS_ROUNDINGS) * joints) + 2.0 * sum(
            j.pinocchio_tilt for j in self.tree.joints
        )


@dataclass(frozen=True, slots=True)
class Tolerance:
    """Limits for an angle (rad) and a distance (m)."""

    angle: float
    distance: float

    def holds(self, angle: float, distance: float) -> bool:
        return angle <= self.angle and distance <= self.distance


def tolerance_of(a: Mechanism, b: Mechanism) -> Tolerance:
    """Return the tolerance for rounding errors."""
    k = a.rotation_rounding + b.rotation_rounding
    return Tolerance(k, k * size_of(a, b))


def size_of(a: Mechanism, b: Mechanism) -> float:
    """Return the length (m) that converts angles to distances."""
    return max(a.size, b.size, MIN_ROBOT_SIZE)


def line_difference(s: Screw, t: Screw, *, with_distance: bool) -> tuple[float, float]:
    """Return the angle (rad) between two axes, and the distance (m) of `s.point` from the line t.

    Opposite directions count as parallel. Without `with_distance`, the distance is 0.
    """
    ux, uy, uz = s.direction.tolist()  # Python floats are faster than small NumPy arrays
    vx, vy, vz = t.direction.tolist()
    sine = math.hypot(uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx)
    angle = math.atan2(sine, abs(ux * vx + uy * vy + uz * vz))
    if not with_distance:
        return angle, 0.0
    x, y, z = (s.point - t.point).tolist()
    along = vx * x + vy * y + vz * z
    return angle, math.hypot(x - along * vx, y - along * vy, z - along * vz)


IDENTITY = np.eye(4)
IDENTITY.setflags(write=False)


@dataclass(frozen=True, slots=True, eq=False)
class MatchedJoints:
    """Two matched joints.

    The joint values satisfy `value_b = sense * value_a + offset`.
    The module docstring defines L, S and S'.

    Attributes:
        a: Index of A's joint.
        b: Index of B's joint.
        kind: "turns" (revolute), "prismatic", "planar" or "floating".
        previous: Index of the previous joint pair on the path from the base, or -1.
        sense: Sign, 1 or -1.
        offset: Zero offset, rad or m.
        constant_motion: Rigid motion L (4, 4). B's joint moves the later bodies by L exp(S' t').
        axis_a: Screw S. A's joint moves the later bodies by exp(S t).
            If A's joint is fixed, `axis_a` is the screw of B's joint.
        axis_b: B's screw S' in A's root frame. If S' = S, `axis_b` is the same object as `axis_a`.
        tilt: Angle (rad); 0 if the angle is within the tolerance.
        shift: Distance (m); 0 if the distance is within the tolerance.

            joints                              tilt                        shift
            revolute                            between the axes            between the axes
            prismatic                           between the axes            0
            planar                              between the normals         0
            floating                            0                           0
            planar or floating,                 between the joint frames    between their origins
            `choices` without a conversion
            one fixed joint, different kinds    0                           0

        kind_difference:
            "a":     only A's joint is fixed
            "b":     only B's joint is fixed
            "kind":  both joints move, and their kinds differ
            "kind":  one model reverses a planar or floating joint, and `conversion` is None
            "":      all other joints
        conversion: Conversion of a planar or floating joint with different coordinates. None for all other
            joints.
    """

    a: int
    b: int
    kind: str
    previous: int
    sense: int
    offset: float
    constant_motion: FloatArray
    axis_a: Screw
    axis_b: Screw
    tilt: float
    shift: float
    kind_difference: str = ""
    conversion: FreeJointConversion | None = None

    @property
    def differs(self) -> bool:
        return self.tilt > 0.0 or self.shift > 0.0


@dataclass(frozen=True, slots=True, eq=False)
class FramePair:
    """Two matched links.

    Attributes:
        a: Index of A's link.
        b: Index of B's link.
        previous: Index of the last joint pair on the path to the links, or -1.
        zero_pose: (4, 4) pose of A's link in the zero configuration.
        constant_motion: Rigid motion L (4, 4) after the last joint; the module docstring defines L.
        tilt: Angle between the frames, rad.
        shift: Distance between the origins, m.
        tool: (4, 4) pose of B's link in the frame of A's link, if the links are different end-effector
            frames. Otherwise, the identity.
    """

    a: int
    b: int
    previous: int
    zero_pose: FloatArray
    constant_motion: FloatArray
    tilt: float
    shift: float
    tool: FloatArray = field(default_factory=lambda: IDENTITY)

    def move_difference_to_tool(self) -> FramePair:
        """Return a copy in which `tool` contains the difference between A's frame and B's frame."""
        tool = inverse(self.zero_pose) @ self.constant_motion @ self.zero_pose
        return replace(self, constant_motion=IDENTITY, tilt=0.0, shift=0.0, tool=tool)

    @property
    def differs(self) -> bool:
        return self.tilt > 0.0 or self.shift > 0.0


@dataclass(slots=True)
class Alignment:
    """The result of aligning two mechanisms.

    Attributes:
        base: Indices of the links of A and B where the search started.
        X: (4, 4) pose of B's root in A's root frame.
        steps: Joint pairs, outwards from the base.
        bodies: Body of B by matched body of A.
        match_count: Number of joint pairs and link pairs that agree.
        max_difference: Largest difference (m) of a joint pair or link pair.
            The difference is `tilt * size_of(a, b) + shift`.
    """

    a: Mechanism
    b: Mechanism
    base: tuple[int, int]
    X: FloatArray
    steps: list[MatchedJoints] = field(default_factory=list)
    frames: list[FramePair] = field(default_factory=list)
    only_a: list[int] = field(default_factory=list)
    only_b: list[int] = field(default_factory=list)
    bodies: dict[int, int] = field(default_factory=dict)
    match_count: int = 0
    max_difference: float = 0.0

    @property
    def is_complete(self) -> bool:
        """Whether all joints are matched, and all matched joints and links agree."""
        alike = not any(step.kind_difference for step in self.steps)
        return alike and not (self.max_difference or self.only_a or self.only_b)

    @property
    def has_separated_names(self) -> bool:
        """Whether two links with equal labels are on matched bodies, but not on the same pair of bodies."""
        links_b = {label: link for link, label in enumerate(self.b.labels)}
        bodies = (
            (self.a.body_of[link], self.b.body_of[links_b[label]])
            for link, label in enumerate(self.a.labels)
            if label in links_b
        )
        matched = set(self.bodies.values())
        return any(a in self.bodies and b in matched and self.bodies[a] != b for a, b in bodies)

    @property
    def matches_all_common_links(self) -> bool:
        matched, labels_b = {frame.a for frame in self.frames}, set(self.b.labels)
        return all(link in matched for link, label in enumerate(self.a.labels) if label in labels_b)

    @property
    def has_free_frames(self) -> bool:
        """Whether the frames of A or B follow from a convention, as in a Denavit-Hartenberg table."""
        return self.a.free_frames or self.b.free_frames

    @property
    def all_joints_agree(self) -> bool:
        """Whether all joints are matched, and all matched joints agree."""
        return not (
            self.only_a or self.only_b or any(step.differs or step.kind_difference for step in self.steps)
        )

    @property
    def difference_count(self) -> int:
        return sum(step.differs or bool(step.kind_difference) for step in self.steps) + sum(
            frame.differs for frame in self.frames
        )

    @property
    def score(self) -> tuple[int, float]:
        return self.match_count, self.max_difference

    @property
    def inner_difference_range(self) -> tuple[float, float]:
        """Smallest and largest difference (m) of the joint pairs and link pairs that differ.

        A link pair is ignored if neither link has a child joint.
        """
        carry = [{joint.parent for joint in m.tree.joints} for m in (self.a, self.b)]
        frames = [frame for frame in self.frames if frame.a in carry[0] or frame.b in carry[1]]
        size = size_of(self.a, self.b)
        both: list[MatchedJoints | FramePair] = [*self.steps, *frames]
        sizes = [one.tilt * size + one.shift for one in both if one.differs]
        return min(sizes, default=0.0), max(sizes, default=0.0)

    @property
    def names(self) -> dict[str, str]:
        joints = self.a.tree.joints, self.b.tree.joints
        return {joints[0][step.a].name: joints[1][step.b].name for step in self.steps}

    @property
    def choices(self) -> AlignmentChoices:
        joints = self.a.tree.joints
        return AlignmentChoices(
            (self.a.tree.links[self.base[0]], self.b.tree.links[self.base[1]]),
            self.X,
            {joints[step.a].name: (step.sense, step.offset) for step in self.steps},
            {joints[step.a].name: step.conversion for step in self.steps if step.conversion is not None},
        )

    def exchangeable_pairs(self, name_map: Mapping[str, str]) -> Iterator[frozenset[tuple[int, int]]]:
        """Yield sets of two joint pairs that can exchange their partners.

        Both pairs have the same kind and the same previous pair.
        Each pair is on the path from the base to a joint pair or link pair that differs.
        In both pairs, the name of A's joint is neither a joint name of B nor a key of `name_map`.
        """
        known_names = {joint.name for joint in self.b.tree.joints} | set(name_map)
        ends = [i for i, step in enumerate(self.steps) if step.differs]
        ends += [frame.previous for frame in self.frames if frame.differs]
        steps = [self.steps[i] for i in sorted({i for end in ends for i in self.indices(end)})]
        unnamed = [step for step in steps if self.a.tree.joints[step.a].name not in known_names]
        for one, other in combinations(unnamed, 2):
            if other.previous == one.previous and other.kind == one.kind:
                yield frozenset(((one.a, one.b), (other.a, other.b)))

    def frames_of(self, pairs: Sequence[tuple[int, int]]) -> list[FramePair]:
        """Return a `FramePair` for each pair of link indices.

        A pair is omitted if no link of A's body is matched with a link of B's body.
        """
        matched_on = {(self.a.body_of[frame.a], self.b.body_of[frame.b]): frame for frame in self.frames}
        rounding = tolerance_of(self.a, self.b)
        frames = []
        for a, b in pairs:
            if (known := matched_on.get((self.a.body_of[a], self.b.body_of[b]))) is None:
                continue
            # The transform from B's body to A's body follows from two matched links on these bodies.
            T_a_b = known.constant_motion @ known.zero_pose @ known.tool @ inverse(self.b.zero_poses[known.b])
            zero_pose, end = self.a.zero_poses[a], IDENTITY
            tilt, shift = pose_difference(zero_pose, T_a_b @ self.b.zero_poses[b])
            if rounding.holds(tilt, shift):
                tilt = shift = 0.0
            else:
                end = T_a_b @ self.b.zero_poses[b] @ inverse(zero_pose)
            frames.append(FramePair(a, b, known.previous, zero_pose, end, tilt, shift))
        return frames

    def indices(self, last: int) -> list[int]:
        path = []
        while last >= 0:
            path.append(last)
            last = self.steps[last].previous
        return path[::-1]

    def path(self, last: int) -> list[MatchedJoints]:
        return [self.steps[i] for i in self.indices(last)]

    @property
    def depth(self) -> int:
        """Number of joint pairs on the longest path from the base, plus 1."""
        return 1 + max((len(self.indices(i)) for i in range(len(self.steps))), default=0)


@dataclass(frozen=True, slots=True, eq=False)
class AlignmentChoices:
    """Prescribed values for an alignment.

    Attributes:
        base: Names of the links of A and B where the search starts. None: the search chooses the links.
        X: (4, 4) pose of B's root in A's root frame.
        zeros: Sign and zero offset (rad or m), by A's joint name. The default is (1, 0).
        conversions: Conversions of planar and floating joints, by A's joint name.
        orders: Each entry lists consecutive joints of B in their new order.
        alone: Joints of A at which only the axis may differ, without a displacement of the later bodies.
            None: the search decides.
    """

    base: tuple[str, str] | None = None
    X: FloatArray = field(default_factory=lambda: IDENTITY)
    zeros: Mapping[str, tuple[int, float]] = field(default_factory=dict)
    conversions: Mapping[str, FreeJointConversion] = field(default_factory=dict)
    orders: tuple[tuple[str, ...], ...] = ()
    alone: Collection[str] | None = None


#: `AS_WRITTEN` prescribes equal root poses and equal joint coordinates for A and B.
AS_WRITTEN = AlignmentChoices()


@dataclass(frozen=True, slots=True)
class LinearFunction:
    """The function constant + slope * variable.

    If the slope is 0, `variable` is unused.
    """

    variable: str
    slope: float
    constant: float

    def compose(self, slope: float, constant: float) -> LinearFunction:
        return LinearFunction(self.variable, slope * self.slope, slope * self.constant + constant)

    def evaluate(self, values: Mapping[str, float | FloatArray]) -> float | FloatArray:
        """Return the function's value; a variable that is not in `values` is 0."""
        return self.constant + (self.slope * values.get(self.variable, 0.0) if self.slope else 0.0)


@dataclass(frozen=True, slots=True)
class MatchedValues:
    """The values of two matched joints.

    The functions `a` and `b` use the positive direction and the zero of A's joint.
    """

    a: LinearFunction
    b: LinearFunction
    #: The value `sense * b + offset`, which uses the positive direction and the zero of B's joint.
    b_unconverted: LinearFunction
    #: Rounding error that was removed when `b` was set equal to `a`: max(0, D - E), rad or m. D is the
    #: difference of the computed constants, and E is the rounding error of one joint.
    rounding: float = 0.0

    @property
    def variable(self) -> str | None:
        """The variable that moves the joints; None if different variables move the two joints."""
        if self.a.slope and self.b.slope and self.a.variable != self.b.variable:
            return None
        return self.a.variable if self.a.slope else self.b.variable


@dataclass(frozen=True, slots=True, eq=False)
class Variables:
    """The values of all matched joints.

    Attributes:
        pairs: The values of each joint pair. None for planar and floating joints, and for moving
            joints of different kinds.
        ranges: Range of each variable, rad or m; infinite without limits.
        rule_differences: Indices of the joint pairs with different mimic rules.
        coordinates_b: Functions that compute B's coordinates from the variables, by joint name.
    """

    pairs: tuple[MatchedValues | None, ...]
    ranges: dict[str, tuple[float, float]]
    rule_differences: tuple[int, ...]
    coordinates_b: dict[str, LinearFunction]

    def range(self, line: LinearFunction) -> tuple[float, float]:
        if not line.slope:
            return line.constant, line.constant
        ends = sorted(line.slope * end + line.constant for end in self.ranges[line.variable])
        return ends[0], ends[1]

    def value_difference(self, pair: MatchedValues) -> float:
        """Return the largest difference (rad or m) of the joint's values in A and B."""
        if (variable := pair.variable) is not None:
            low, high = self.range(
                LinearFunction(variable, pair.b.slope - pair.a.slope, pair.b.constant - pair.a.constant)
            )
        else:
            (a_low, a_high), (b_low, b_high) = self.range(pair.a), self.range(pair.b)
            low, high = b_low - a_high, b_high - a_low
        return max(abs(low), abs(high))


def variables_of(alignment: Alignment, tolerance: Tolerance) -> Variables:
    return _VariablesBuilder(alignment, tolerance).variables()


class _VariablesBuilder:
    def __init__(self, alignment: Alignment, tolerance: Tolerance) -> None:
        self.alignment, self.tolerance = alignment, tolerance
        self.trees = alignment.a.tree, alignment.b.tree
        self.step_of_b = {step.b: step for step in alignment.steps}
        self.coordinates_b = self._find_coordinates_b()
        self.depth = alignment.depth

    def _find_coordinates_b(self) -> dict[str, LinearFunction]:
        tree, used, lines = self.trees[1], set[str](), dict[str, LinearFunction]()
        own = [i for i, joint in enumerate(tree.joints) if joint.kind.nq == 1 and joint.mimic is None]
        mimic_joints_last = sorted(own, key=self._is_mimic_in_a)
        for i in mimic_joints_last:
            name = tree.joints[i].name
            lines[name] = LinearFunction(f"b:{name}", 1.0, 0.0)
            step = self.step_of_b.get(i)
            if step is None or step.kind_difference:
                continue
            value = self._value_a(step)
            if value.slope and value.variable not in used:
                used.add(value.variable)
                lines[name] = value.compose(step.sense, step.offset)
        return lines

    def _is_mimic_in_a(self, joint_b: int) -> bool:
        step = self.step_of_b.get(joint_b)
        return step is not None and self.trees[0].joints[step.a].mimic is not None

    def _value_a(self, step: MatchedJoints) -> LinearFunction:
        joint = self.trees[0].joints[step.a]
        if joint.kind is JointKind.FIXED:
            return LinearFunction("", 0.0, 0.0)
        if joint.mimic is None:
            return LinearFunction(f"a:{joint.name}", 1.0, 0.0)
        return LinearFunction(f"a:{joint.mimic.mimicked_joint}", joint.mimic.multiplier, joint.mimic.offset)

    def _value_b(self, step: MatchedJoints) -> LinearFunction:
        joint = self.trees[1].joints[step.b]
        if joint.kind is JointKind.FIXED:
            return LinearFunction("", 0.0, 0.0)
        if joint.mimic is None:
            return self.coordinates_b[joint.name]
        return self.coordinates_b[joint.mimic.mimicked_joint].compose(
            joint.mimic.multiplier, joint.mimic.offset
        )

    def variables(self) -> Variables:
        pairs, rule_differences = list[MatchedValues | None](), list[int]()
        for i, step in enumerate(self.alignment.steps):
            if step.kind in ("planar", "floating") or step.kind_difference == "kind":
                pairs.append(None)
                continue
            a, b_unconverted = self._value_a(step), self._value_b(step)
            b = b_unconverted.compose(step.sense, -step.sense * step.offset)
            rounding = 0.0
            if self._are_equal(a, b):
                rounding = max(0.0, abs(a.constant - b.constant) - self._joint_rounding(a))
                b = a
            elif not step.kind_difference:
                rule_differences.append(i)
            pairs.append(MatchedValues(a, b, b_unconverted, rounding))
        return Variables(tuple(pairs), self._ranges(pairs), tuple(rule_differences), self.coordinates_b)

    def _are_equal(self, a: LinearFunction, b: LinearFunction) -> bool:
        """Return whether two functions differ by rounding only.

        Let e be the rounding error of one joint. The slopes may differ by e. The constants may differ by
        `depth * e`, because the poses of several joints determine a zero offset.
        """
        same = a.variable == b.variable or not (a.slope or b.slope)
        one = self._joint_rounding(a)
        return same and abs(a.slope - b.slope) <= one and abs(a.constant - b.constant) <= self.depth * one

    def _joint_rounding(self, line: LinearFunction) -> float:
        return self.tolerance.angle * max(1.0, abs(line.slope), abs(line.constant))

    def _ranges(self, pairs: list[MatchedValues | None]) -> dict[str, tuple[float, float]]:
        """Intersect the limits of all joints that a variable moves.

        If the intersection is empty or a single value, the range is the limits in A.
        If the variable moves no joint of A, the range is then the limits in B.
        The limits of mimic joints are ignored, because mimic joints follow their rules beyond these limits.
        """
        first: dict[str, tuple[float, float]] = {}
        own: dict[str, tuple[float, float]] = {}
        mimic = set[str]()

        def restrict(k: int, name: str, ends: tuple[float, float]) -> None:
            low, high = own.get(name, (-math.inf, math.inf))
            own[name] = max(low, ends[0]), min(high, ends[1])
            if k == 0 or name not in first:
                first[name] = ends

        for step, pair in zip(self.alignment.steps, pairs, strict=True):
            for k, j in enumerate((step.a, step.b)):
                joint = self.trees[k].joints[j]
                if pair is None:  # joints of different kinds do not share a variable
                    if step.kind_difference and joint.nq == 1:
                        own[f"{'ab'[k]}:{joint.name}"] = joint_limits(joint)
                    continue
                if not (line := (pair.a, pair.b_unconverted)[k]).slope:
                    continue
                if joint.mimic is None:
                    low, high = sorted((end - line.constant) / line.slope for end in joint_limits(joint))
                    restrict(k, line.variable, (low, high))
                else:
                    mimic.add(line.variable)
        # A matched joint can mimic an unmatched joint.
        for k, unpaired in enumerate((self.alignment.only_a, self.alignment.only_b)):
            for joint in (self.trees[k].joints[j] for j in unpaired):
                if joint.nq == 1 and (name := f"{'ab'[k]}:{joint.name}") in mimic:
                    restrict(k, name, joint_limits(joint))
        ranges = {name: own.get(name, (-math.inf, math.inf)) for name in [*own, *sorted(mimic - set(own))]}
        return {name: ends if ends[0] < ends[1] else first.get(name, ends) for name, ends in ranges.items()}


def joint_limits(joint: Joint) -> tuple[float, float]:
    if joint.kind is JointKind.CONTINUOUS or joint.limit is None:
        return -math.inf, math.inf
    low, high = sorted((joint.limit.lower, joint.limit.upper))
    return low, high
