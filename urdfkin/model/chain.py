"""A path between two frames as a row of joint axes: what a Denavit-Hartenberg table is made from.

Section 7.5 of the text: joint i turns about (or slides along) z_{i-1} at O_{i-1}, and d_{i-1,i} leads from
O_{i-1} to O_i. The path may run down the tree, up, or through a common ancestor (left foot to right hand).
Fixed joints are folded in. A joint that is passed backwards, from its child to its parent, has its axis
reversed, so that its coordinate keeps the sign of the URDF:  (Rz(q))^-1 about z is Rz(q) about -z.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from urdfkin.errors import InputError
from urdfkin.errors.display import Displayable, Table, TextDocument
from urdfkin.errors.escape import log_line
from urdfkin.kinematics.rotation import axis_aligning
from urdfkin.model.configuration_like import Given
from urdfkin.model.mimic import Coupling, coupling_of
from urdfkin.model.pose import inverse, pose
from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree, Limit, Mimic, frozen

#: Metres that a robot counts as large at least: what stands on one spot has a size to divide by, too.
LEAST_SIZE = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class ChainJoint:
    """One moving joint on a path.

    Attributes:
        name: As in the URDF.
        kind: Revolute, continuous or prismatic.
        backwards: Whether the path passes it from its child link to its parent link.
        T_previous_joint: (4, 4) pose of the joint's frame, whose z is its (reversed, if backwards) axis, in
            the frame of the joint before it on the path, after that one's motion; in the base for the first.
        limit: Its bounds, None where there are none.
        mimic: Whom it follows, None if it has a coordinate of its own.
    """

    name: str
    kind: JointKind
    backwards: bool
    T_previous_joint: FloatArray
    limit: Limit | None = None
    mimic: Mimic | None = None


@dataclass(frozen=True, repr=False)
class FrameChain(Displayable):
    """The joints between two frames, base to tip.

    Placement:  T_base_tip(q) = A_0 M_1(q_1) A_1 M_2(q_2) ... M_n(q_n) A_n, with the constants A_{i-1} =
    `joints[i-1].T_previous_joint` and A_n = `T_last_tip`, and M_i a turn about z or a slide along it.

    Attributes:
        robot: The robot's name.
        base: Name of the frame in which everything is measured.
        tip: Name of the frame at the other end.
        joints: The moving joints in path order.
        T_last_tip: (4, 4) pose of the tip in the last joint's frame (in the base when nothing moves).
        lengths: (n + 1,) how long the way is between joint origins, summed over the folded fixed joints: the
            k-th entry bounds the distance from joint k's origin to the next one's, whatever the rotations.
        folded: How many joints of the URDF, fixed ones too, each of the n + 1 constants is a product of.
    """

    robot: str
    base: str
    tip: str
    joints: tuple[ChainJoint, ...]
    T_last_tip: FloatArray
    lengths: FloatArray
    folded: tuple[int, ...]

    def __repr__(self) -> str:
        return log_line(f"<FrameChain {self.robot}: {self.base} to {self.tip}, {len(self.joints)} joints>")

    def _sheet(self) -> TextDocument:
        heads = ("joint", "kind", "lower", "upper", "x", "y", "z", "axis x", "axis y", "axis z")
        stand = zip(self.joints, self.origins().tolist(), self.axes().tolist(), strict=False)
        rows = [
            (
                joint.name,
                " ".join([joint.kind.value, *["backwards"] * joint.backwards, *_follows(joint)]),
                *("" if joint.limit is None else f"{x:.6g}" for x in _bounds(joint.limit)),
                *origin,
                *axis,
            )
            for joint, origin, axis in stand
        ]
        x, y, z = (self.origins()[-1].round(12) + 0.0).tolist()
        return TextDocument(
            f"{self.robot}: {self.base} to {self.tip}, {len(self.joints)} joints",
            (
                f"With every coordinate at 0, in {self.base} (m); the tip is at ({x:.6g}, {y:.6g}, {z:.6g}).",
                Table(heads, rows, left=2),
            ),
        )

    @cached_property
    def coupling(self) -> Coupling:
        """How the path's coordinates move its joints."""
        return coupling_of([(joint.name, joint.mimic, joint.kind) for joint in self.joints])

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the path's own coordinates, in the order that `placement` expects."""
        return self.coupling.names

    @property
    def constants(self) -> tuple[FloatArray, ...]:
        """The n + 1 constant poses A_0 ... A_n."""
        return (*(joint.T_previous_joint for joint in self.joints), self.T_last_tip)

    @cached_property
    def reach(self) -> float:
        """Metres: the sum of the constant offsets between joints, tip included, base offset not."""
        return float(self.lengths[1:].sum())

    def frames(self, q: Given | None = None) -> FloatArray:
        """(..., n + 1, 4, 4) poses in the base: each joint's frame before its own motion, then the tip.

        Args:
            q: (..., coordinates) in the order of `joint_names`; None is every coordinate at zero.

        Raises:
            InputError: `q` has the wrong length.
        """
        values = self.coupling.values(np.zeros(len(self.joint_names)) if q is None else q)
        poses = np.empty((*values.shape[:-1], len(self.joints) + 1, 4, 4))
        T_base_here: FloatArray = np.broadcast_to(np.eye(4), (*values.shape[:-1], 4, 4))
        for i, joint in enumerate(self.joints):
            poses[..., i, :, :] = T_base_here @ joint.T_previous_joint
            T_base_here = poses[..., i, :, :] @ motion_about_z(values[..., i], joint.kind.turns)
        poses[..., -1, :, :] = T_base_here @ self.T_last_tip
        return poses

    def placement(self, q: Given) -> FloatArray:
        """(..., 4, 4) T_base_tip for `q` (..., coordinates); raises InputError for a wrong length."""
        return np.ascontiguousarray(self.frames(q)[..., -1, :, :])

    def axes(self, q: Given | None = None) -> FloatArray:
        """(..., n, 3) unit axes z_{i-1} in the base; at zero coordinates when `q` is None."""
        return np.ascontiguousarray(self.frames(q)[..., :-1, :3, 2])

    def origins(self, q: Given | None = None) -> FloatArray:
        """(..., n + 1, 3) joint origins O_{i-1} in the base, metres; the last is the tip's."""
        return np.ascontiguousarray(self.frames(q)[..., :3, 3])

    def interorigin(self, q: Given | None = None) -> FloatArray:
        """(..., n, 3) interorigin vectors d_{i-1,i} in the base, metres; the last leads to the tip."""
        return np.ascontiguousarray(np.diff(self.origins(q), axis=-2))


def _follows(joint: ChainJoint) -> list[str]:
    """Whom a joint follows, in words."""
    return [f"= {joint.mimic}"] if joint.mimic else []


def _bounds(limit: Limit | None) -> tuple[float, float]:
    return (-math.inf, math.inf) if limit is None else (limit.lower, limit.upper)


def chain(tree: KinematicTree, tip: str, base: str | None = None) -> FrameChain:
    """The path from `base` (the root when None) to `tip`.

    Args:
        tree: The robot.
        tip: Name of a link or joint frame.
        base: Likewise.

    Raises:
        UnknownNameError: there is no such frame; the nearest names are offered.
        InputError: a planar or floating joint lies on the way.
    """
    base_name = tree.links[0] if base is None else base
    joints, A, length = list[ChainJoint](), np.eye(4), 0.0
    lengths, folded, count = list[float](), list[int](), 0
    for joint, backwards in steps_between(tree, tip, base_name):
        _refuse_many_coordinates(tree, joint, base_name, tip)
        to_joint, from_joint = _around(joint, backwards)
        A = A @ to_joint
        length += 0.0 if backwards else _norm(joint)
        count += 1
        if joint.kind.has_axis:
            joints.append(ChainJoint(joint.name, joint.kind, backwards, frozen(A), joint.limit, joint.mimic))
            lengths.append(length)
            folded.append(count)
            # A joint passed backwards has its constant after its motion, one passed forwards before it.
            A, length, count = np.eye(4), 0.0, int(backwards)
        A = A @ from_joint
        length += _norm(joint) if backwards else 0.0
    ends = frozen(A), frozen([*lengths, length]), (*folded, count)
    return FrameChain(tree.name, base_name, tip, tuple(joints), *ends)


def steps_between(tree: KinematicTree, tip: str, base: str) -> list[tuple[Joint, bool]]:
    """The joints from `base` to `tip`, fixed ones too, each with whether it is passed backwards.

    Raises:
        UnknownNameError: there is no such frame.
    """
    up, down = tree.path(tree.frame_link(base)), tree.path(tree.frame_link(tip))
    common = 0
    while common < min(len(up), len(down)) and up[common] == down[common]:
        common += 1
    backwards = [(tree.joints[i], True) for i in reversed(up[common:])]
    return backwards + [(tree.joints[i], False) for i in down[common:]]


def motion_about_z(values: FloatArray, turns: bool) -> FloatArray:
    """(..., 4, 4) Rz(values) or Tz(values)."""
    T = np.zeros((*values.shape, 4, 4))
    T[..., 2, 2] = T[..., 3, 3] = 1.0
    if turns:
        T[..., 0, 0] = T[..., 1, 1] = np.cos(values)
        T[..., 1, 0] = np.sin(values)
        T[..., 0, 1] = -T[..., 1, 0]
    else:
        T[..., 0, 0] = T[..., 1, 1] = 1.0
        T[..., 2, 3] = values
    return T


def _around(joint: Joint, backwards: bool) -> tuple[FloatArray, FloatArray]:
    """The constants before and after a joint's motion about its own z, in the path's direction."""
    if not joint.kind.has_axis:
        return (inverse(joint.T_parent_joint) if backwards else joint.T_parent_joint), np.eye(4)
    align = pose(axis_aligning(-joint.axis if backwards else joint.axis))
    if backwards:
        return align, align.T @ inverse(joint.T_parent_joint)
    return joint.T_parent_joint @ align, align.T


def _norm(joint: Joint) -> float:
    return math.hypot(*joint.T_parent_joint[:3, 3])


def _refuse_many_coordinates(tree: KinematicTree, joint: Joint, base: str, tip: str) -> None:
    if joint.kind not in (JointKind.PLANAR, JointKind.FLOATING):
        return
    child = tree.links[tree.joint_index(joint.name) + 1]
    raise InputError(
        f"a {joint.kind.value} joint has no single axis and cannot stand on a path of axes",
        where=f"joint {joint.name}",
        found=f"it lies between {base} and {tip}",
        remedy=f"take both ends on one side of it: from {child!r} outwards, or within the links before it",
    )
