"""A path between two frames as a sequence of joint axes.

The symbols are from section 7.5 of the textbook. The axis of joint i is z_{i-1} at O_{i-1}. A revolute joint
rotates about z_{i-1}, and a prismatic joint translates along z_{i-1}. The vector d_{i-1,i} leads from O_{i-1}
to O_i. The path may lead from parent to child, from child to parent, or through a common ancestor. An example
is the path from the left foot to the right hand. Fixed joints are merged into the constant poses. If the path
passes a joint from child to parent, the joint's axis is reversed. The coordinate q then keeps the sign of the
URDF, because the inverse of a rotation by q about z rotates by q about -z.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from urdfkin.errors import InputError
from urdfkin.errors.display import Displayable, Table, TextDocument
from urdfkin.errors.escape import log_line
from urdfkin.kinematics.rotation import rotation_with_z_axis
from urdfkin.model.configuration_like import ConfigurationLike
from urdfkin.model.mimic import Coupling, make_coupling
from urdfkin.model.path import ElementaryMotion, Path
from urdfkin.model.tree import (
    FloatArray,
    Joint,
    JointKind,
    KinematicTree,
    Limit,
    Mimic,
    freeze,
    inverse,
    pose,
)

#: Minimum size (m) of a robot in a comparison of mechanisms. The computed size is 0 if all frames have the
#: same origin.
MIN_ROBOT_SIZE = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class ChainJoint:
    """One moving joint on a path.

    Attributes:
        backwards: True if the path leads from child to parent.
        T_previous_joint: (4, 4) constant A_{i-1} of `FrameChain`. The z axis of the pose is the joint's axis,
            or the reversed axis if `backwards` is true.
        mimic: The mimic rule, or None for an independent joint.
    """

    name: str
    kind: JointKind
    backwards: bool
    T_previous_joint: FloatArray
    limit: Limit | None = None
    mimic: Mimic | None = None


@dataclass(frozen=True, repr=False, eq=False)
class FrameChain(Displayable):
    """The moving joints from base to tip, and the constant poses between them.

        T_base_tip(q) = A_0 M_1(q_1) A_1 M_2(q_2) ... M_n(q_n) A_n.

    The constant A_{i-1} is `joints[i-1].T_previous_joint`, and A_n is `T_last_tip`. M_i is a rotation about z
    or a translation along z.

    Attributes:
        robot: The robot's name.
        base: Name of the first frame. Results are expressed in this frame.
        tip: Name of the last frame.
        joints: The moving joints in path order.
        T_last_tip: (4, 4) pose of the tip in the frame after the last motion M_n. If the path has no joints,
            the pose of the tip in the base frame.
        lengths: (n + 1,) path lengths between joint origins, m, including the fixed joints. Entry k is an
            upper bound on the translation in A_k. The bound does not depend on the fixed joints' rotations.
        pose_counts: (n + 1,) upper bound on the number of URDF joint poses in the product A_k.

    >>> import urdfkin
    >>> path = urdfkin.load("planar_two_link").chain("tip", "base")
    >>> print(path)
    planar_two_link: base to tip, 2 joints
    With every coordinate at 0, in base (m); the tip is at (0.9, 0, 0).
    joint    kind      lower  upper    x  y  z  axis x  axis y  axis z
    ------------------------------------------------------------------
    joint_1  revolute     -3      3    0  0  0       0       0       1
    joint_2  revolute     -3      3  0.5  0  0       0       0       1
    """

    robot: str
    base: str
    tip: str
    joints: tuple[ChainJoint, ...]
    T_last_tip: FloatArray
    lengths: FloatArray
    pose_counts: tuple[int, ...]

    def __repr__(self) -> str:
        return log_line(f"<FrameChain {self.robot}: {self.base} to {self.tip}, {len(self.joints)} joints>")

    def _text_document(self) -> TextDocument:
        heads = ("joint", "kind", "lower", "upper", "x", "y", "z", "axis x", "axis y", "axis z")
        geometry = zip(self.joints, self.origins().tolist(), self.axes().tolist(), strict=False)
        rows = [
            (
                joint.name,
                joint.kind.value
                + " backwards" * joint.backwards
                + (f" = {joint.mimic}" if joint.mimic else ""),
                *(("", "") if (x := joint.limit) is None else (f"{x.lower:.6g}", f"{x.upper:.6g}")),
                *origin,
                *axis,
            )
            for joint, origin, axis in geometry
        ]
        x, y, z = (round(number, 12) + 0.0 for number in self.origins()[-1].tolist())
        return TextDocument(
            f"{self.robot}: {self.base} to {self.tip}, {len(self.joints)} joints",
            (
                f"With every coordinate at 0, in {self.base} (m); the tip is at ({x:.6g}, {y:.6g}, {z:.6g}).",
                Table(heads, rows, left=2),
            ),
        )

    @cached_property
    def coupling(self) -> Coupling:
        """The map from the path's coordinates to its joint values.

        >>> import urdfkin
        >>> path = urdfkin.load("planar_two_link").chain("tip", "base")
        >>> path.coupling.names
        ('joint_1', 'joint_2')
        """
        return make_coupling([(joint.name, joint.mimic, joint.kind) for joint in self.joints])

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the path's coordinates, in the order of `q`.

        >>> import urdfkin
        >>> path = urdfkin.load("planar_two_link").chain("tip", "base")
        >>> path.joint_names
        ('joint_1', 'joint_2')
        """
        return self.coupling.names

    @property
    def constants(self) -> tuple[FloatArray, ...]:
        """The n + 1 constant poses, from A_0 to A_n.

        >>> import urdfkin
        >>> path = urdfkin.load("planar_two_link").chain("tip", "base")
        >>> [T[0, 3].item() for T in path.constants]  # m
        [0.0, 0.5, 0.4]
        """
        return (*(joint.T_previous_joint for joint in self.joints), self.T_last_tip)

    @cached_property
    def path(self) -> Path:
        """The product A_0 M_1 A_1 ... M_n A_n as a `Path`.

        The amounts of the `Path` are the joint values.

        >>> import urdfkin
        >>> path = urdfkin.load("planar_two_link").chain("tip", "base")
        >>> path.path.poses(np.zeros(2))[:3, 3].tolist()
        [0.9, 0.0, 0.0]
        """
        moving = ((joint.T_previous_joint, ElementaryMotion(2, joint.kind.turns)) for joint in self.joints)
        return Path((*(step for pair in moving for step in pair), self.T_last_tip))

    @cached_property
    def reach(self) -> float:
        """Sum of the path lengths from the first joint to the tip, m.

        >>> import urdfkin
        >>> path = urdfkin.load("planar_two_link").chain("tip", "base")
        >>> path.reach
        0.9
        """
        return float(self.lengths[1:].sum())

    @np.errstate(over="ignore", invalid="ignore")  # RangeError replaces these warnings.
    def frames(self, q: ConfigurationLike | None = None) -> FloatArray:
        """Return the poses of all joint frames and of the tip.

        Each joint frame is the frame before the joint's motion.

        Args:
            q: (..., coordinates) in the order of `joint_names`, or None for the zero configuration.

        Returns:
            (..., n + 1, 4, 4) poses in the base frame.

        Raises:
            InputError: `q` has the wrong length, or a number is not finite.
            RangeError: a result leaves the range of double precision.

        >>> import urdfkin
        >>> path = urdfkin.load("planar_two_link").chain("tip", "base")
        >>> path.frames([0.0, 0.0])[:, 0, 3].tolist()  # m
        [0.0, 0.5, 0.9]
        """
        values = self.coupling.values(np.zeros(len(self.joint_names)) if q is None else q)
        return self.path.finite_frames(values)[..., ::2, :, :]

    def placement(self, q: ConfigurationLike) -> FloatArray:
        """Return the pose T_base_tip (..., 4, 4) for `q` (..., coordinates).

        A wrong length of `q`, or a number that is not finite, raises InputError.

        >>> import urdfkin
        >>> path = urdfkin.load("planar_two_link").chain("tip", "base")
        >>> path.placement([0.0, 0.0])[:3, 3].tolist()
        [0.9, 0.0, 0.0]
        """
        return np.ascontiguousarray(self.frames(q)[..., -1, :, :])

    def axes(self, q: ConfigurationLike | None = None) -> FloatArray:
        """Return the unit axes z_{i-1} (..., n, 3) in the base frame.

        Without `q`, the configuration is zero.

        >>> import urdfkin
        >>> path = urdfkin.load("planar_two_link").chain("tip", "base")
        >>> path.axes().tolist()
        [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0]]
        """
        return np.ascontiguousarray(self.frames(q)[..., :-1, :3, 2])

    def origins(self, q: ConfigurationLike | None = None) -> FloatArray:
        """Return the origins (..., n + 1, 3) of the n joints and of the tip in the base frame (m).

        Without `q`, the configuration is zero.

        >>> import urdfkin
        >>> path = urdfkin.load("planar_two_link").chain("tip", "base")
        >>> path.origins()[-1].tolist()  # of the tip, m
        [0.9, 0.0, 0.0]
        """
        return np.ascontiguousarray(self.frames(q)[..., :3, 3])

    def interorigin(self, q: ConfigurationLike | None = None) -> FloatArray:
        """Return the interorigin vectors (..., n, 3) in the base frame, m.

        The vector d_{i-1,i} leads from O_{i-1} to O_i. O_n is the origin of the tip. Without `q`, the
        configuration is zero.

        >>> import urdfkin
        >>> path = urdfkin.load("planar_two_link").chain("tip", "base")
        >>> path.interorigin().tolist()
        [[0.5, 0.0, 0.0], [0.4, 0.0, 0.0]]
        """
        return np.ascontiguousarray(np.diff(self.origins(q), axis=-2))


def make_chain(tree: KinematicTree, tip: str, base: str | None = None) -> FrameChain:
    base_name = tree.links[0] if base is None else base
    joints, A, length = list[ChainJoint](), np.eye(4), 0.0
    lengths, pose_counts, count = list[float](), list[int](), 0
    for joint, backwards in joints_between(tree, tip, base_name):
        _check_single_axis(tree, joint, base_name, tip)
        to_joint, from_joint = _poses_around(joint, backwards)
        A = A @ to_joint
        length += 0.0 if backwards else joint.length
        count += 1
        if joint.kind.has_axis:
            joints.append(ChainJoint(joint.name, joint.kind, backwards, freeze(A), joint.limit, joint.mimic))
            lengths.append(length)
            pose_counts.append(count)
            # If the path leads from child to parent, the pose before the joint's motion aligns z with the
            # joint's axis. The joint's constant pose comes after the motion, and counts as one more pose.
            A, length, count = np.eye(4), 0.0, int(backwards)
        A = A @ from_joint
        length += joint.length if backwards else 0.0
    ends = freeze(A), freeze([*lengths, length]), (*pose_counts, count)
    return FrameChain(tree.name, base_name, tip, tuple(joints), *ends)


def joints_between(tree: KinematicTree, tip: str, base: str) -> list[tuple[Joint, bool]]:
    """Return (joint, is_backwards) for the joints from `base` to `tip`."""
    up, down = tree.path(tree.frame_link(base)), tree.path(tree.frame_link(tip))
    common = 0
    while common < min(len(up), len(down)) and up[common] == down[common]:
        common += 1
    backwards = [(tree.joints[i], True) for i in reversed(up[common:])]
    return backwards + [(tree.joints[i], False) for i in down[common:]]


def _poses_around(joint: Joint, backwards: bool) -> tuple[FloatArray, FloatArray]:
    """Return the constant poses before and after the motion."""
    if not joint.kind.has_axis:
        return (inverse(joint.T_parent_joint) if backwards else joint.T_parent_joint), np.eye(4)
    align = pose(rotation_with_z_axis(-joint.axis if backwards else joint.axis))
    if backwards:
        return align, align.T @ inverse(joint.T_parent_joint)
    return joint.T_parent_joint @ align, align.T


def _check_single_axis(tree: KinematicTree, joint: Joint, base: str, tip: str) -> None:
    if joint.kind.has_axis or not joint.kind.nq:
        return
    child = tree.links[tree.joint_index(joint.name) + 1]
    raise InputError(
        f"a {joint.kind.value} joint has no single axis and cannot be on a path of axes",
        where=f"joint {joint.name}",
        found=f"this joint lies between {base} and {tip}",
        remedy=f"choose base and tip on the same side of this joint: both from {child!r} outwards, or"
        " both before this joint",
    )
