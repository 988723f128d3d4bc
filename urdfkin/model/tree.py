"""The robot model: a tree of links and joints, with limits and mimic rules.

`KinematicTree` depends neither on XML nor on Pinocchio. Its links and joints are in Pinocchio's order, which
is depth first, with sibling joints sorted by name. Therefore, `q` and `v` have the same order in urdfkin and
in Pinocchio. A frame has the name of its link or joint. A link and a joint can have the same name.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from enum import Enum
from functools import cached_property
from typing import Any, ClassVar, Self, TypeGuard

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.errors import InputError, QuestionsSection, UnknownNameError
from urdfkin.errors.validators import safe_repr
from urdfkin.kinematics import inputs
from urdfkin.kinematics.rotation import coordinate_rotation, rotation_about

FloatArray = inputs.FloatArray


class FrameName(str):
    """A frame's name with a prefix.

    `LinkFrame` always selects a link, and `JointFrame` a joint.

    >>> LinkFrame.of("hand"), LinkFrame.of("hand").bare_name
    ('link:hand', 'hand')
    """

    __slots__ = ()
    prefix: ClassVar[str]

    @classmethod
    def of(cls, name: str) -> Self:
        return cls(f"{cls.prefix}{name}")

    @property
    def bare_name(self) -> str:
        return self[len(self.prefix) :]


class LinkFrame(FrameName):
    __slots__ = ()
    prefix = "link:"


class JointFrame(FrameName):
    """The prefix "joint:" and a joint's name, for the frame of the joint's child link."""

    __slots__ = ()
    prefix = "joint:"


def freeze(array: ArrayLike) -> FloatArray:
    """Return a read-only, C-contiguous float64 copy."""
    numeric = type(array) is np.ndarray and array.dtype == np.float64
    copy = np.array(array if numeric else inputs.as_floats(array, "an array"), dtype=np.float64, order="C")
    copy.setflags(write=False)
    return copy


class JointKind(Enum):
    """The joint types of a URDF."""

    nq: int
    nv: int
    nq_pinocchio: int  #: Number of coordinates in Pinocchio, for example 2 for (cos, sin).
    has_axis: bool  #: Whether the joint rotates about, or translates along, one axis.
    turns: bool
    has_limits: bool  #: Whether joints of this kind have position limits.

    def __new__(cls, word: object, *properties: Any) -> JointKind:
        member = object.__new__(cls)
        member._value_ = word
        member.nq, member.nv, member.nq_pinocchio, member.has_axis, member.turns, member.has_limits = (
            properties
        )
        return member

    REVOLUTE = "revolute", 1, 1, 1, True, True, True
    CONTINUOUS = "continuous", 1, 1, 2, True, True, False
    PRISMATIC = "prismatic", 1, 1, 1, True, False, True
    FIXED = "fixed", 0, 0, 0, False, False, False
    PLANAR = "planar", 3, 3, 4, False, False, False
    FLOATING = "floating", 7, 6, 7, False, False, False


@dataclass(frozen=True, slots=True)
class Limit:
    """The limits of a joint, in rad or m.

    Attributes:
        velocity: Largest speed, rad/s or m/s.
        effort: Largest effort, N m or N.
    """

    lower: float
    upper: float
    velocity: float
    effort: float


#: Largest plausible |joint angle| (rad).
#: Some industrial wrists turn 400 degrees in each direction.
MAX_PLAUSIBLE_ANGLE = 2.5 * math.pi
#: A joint value is far outside the limits if it exceeds a limit by more than the larger of two margins. The
#: margins are `_MARGIN` (rad or m) and `_MARGIN_FRACTION` times the joint's range. For a joint with only one
#: limit, the margin is 0.
_MARGIN, _MARGIN_FRACTION = 0.5, 0.25


def limits_with_margin(lower: float, upper: float) -> tuple[float, float]:
    """Widen the limits by a large margin.

    >>> limits_with_margin(-2.0, 2.0), limits_with_margin(-float("inf"), 2.0)
    ((-3.0, 3.0), (-inf, 2.0))
    """
    margin = max(_MARGIN, _MARGIN_FRACTION * (upper - lower)) if math.isfinite(upper - lower) else 0.0
    return lower - margin, upper + margin


def is_bounded(limit: Limit | None) -> TypeGuard[Limit]:
    return limit is not None and math.isfinite(limit.lower) and math.isfinite(limit.upper)


@dataclass(frozen=True, slots=True)
class Mimic:
    """The rule `multiplier * q_mimicked + offset`; the mimicked joint is not a mimic joint."""

    mimicked_joint: str
    multiplier: float
    offset: float

    def __str__(self) -> str:
        factor = {1.0: "", -1.0: "-"}.get(self.multiplier, f"{self.multiplier:g} ")
        return f"{factor}{self.mimicked_joint}" + (f" {self.offset:+g}" if self.offset else "")


@dataclass(frozen=True, slots=True, eq=False)
class Joint:
    """One joint of a robot.

    Attributes:
        parent: Index of the parent link.
        T_parent_joint: (4, 4) pose of the joint frame in the parent link's frame at q = 0, m.
            For a locked joint, the pose of the child link's frame in the parent link's frame.
        axis: (3,) unit axis in the joint frame. A planar, floating or fixed joint has (1, 0, 0).
            A locked joint keeps its axis.
        pinocchio_tilt: Angle between `axis` and Pinocchio's axis, rad.
            urdfkin's kinematics do not use this angle.
        lock: The original joint and its value, if the user fixed the joint.
    """

    name: str
    kind: JointKind
    parent: int
    T_parent_joint: FloatArray
    axis: FloatArray
    limit: Limit | None = None
    mimic: Mimic | None = None
    pinocchio_tilt: float = 0.0
    lock: Lock | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "T_parent_joint", freeze(self.T_parent_joint))
        object.__setattr__(self, "axis", freeze(self.axis))
        if self.T_parent_joint.shape != (4, 4) or self.axis.shape != (3,):
            raise InputError(
                "a joint needs a (4, 4) pose and a (3,) axis",
                where=f"joint {self.name}",
                found=f"{self.T_parent_joint.shape} and {self.axis.shape}",
            )

    def __reduce__(self) -> tuple[type[Joint], tuple[Any, ...]]:
        # Unpickling calls the constructor, which makes arrays read-only.
        return type(self), tuple(getattr(self, field.name) for field in fields(self))

    @property
    def nq(self) -> int:
        return 0 if self.mimic else self.kind.nq

    @property
    def nv(self) -> int:
        return 0 if self.mimic else self.kind.nv

    @property
    def original(self) -> Joint:
        return self.lock.joint if self.lock else self

    @property
    def length(self) -> float:
        """Length of the offset from the parent link, m.

        For a locked prismatic joint, |displacement| is added.
        """
        # hypot avoids squares, which overflow for 1e200 and underflow for 1e-200.
        length = math.hypot(*self.original.T_parent_joint[:3, 3].tolist())
        if self.lock and self.lock.joint.kind is JointKind.PRISMATIC:
            length += abs(self.lock.value)
        return length


@dataclass(frozen=True, slots=True, eq=False)
class Lock:
    """A joint that the user fixed.

    Attributes:
        q: Coordinate of `joint`, or of the joint that `joint` mimics, rad or m.
    """

    joint: Joint
    q: float

    @property
    def value(self) -> float:
        rule = self.joint.mimic
        return self.q if rule is None else rule.multiplier * self.q + rule.offset

    @property
    def motion(self) -> FloatArray:
        """Pose of the child link in the joint frame."""
        T, axis, value = np.eye(4), self.joint.axis, self.value
        if not self.joint.kind.turns:
            T[:3, 3] = value * axis
        elif np.count_nonzero(axis) == 1:  # Rotations about coordinate axes have exact zeros and ones.
            k = int(np.flatnonzero(axis)[0])
            T[:3, :3] = coordinate_rotation(k, np.array(axis[k] * value))
        else:
            T[:3, :3] = rotation_about(axis, value)
        return T

    def make_fixed_joint(self) -> Joint:
        joint = self.joint
        T = joint.T_parent_joint @ self.motion
        return replace(joint, kind=JointKind.FIXED, T_parent_joint=T, limit=None, mimic=None, lock=self)


@dataclass(frozen=True)
class KinematicTree:
    """A robot's links and joints.

    Attributes:
        links: The link `links[i + 1]` is the child of `joints[i]`.
        joints: All joints in Pinocchio's order, with `joints[i].parent` <= i.
        poses: Named poses. A pose may contain only some of the joints.
    """

    name: str
    links: tuple[str, ...]
    joints: tuple[Joint, ...]
    poses: Mapping[str, Mapping[str, float]] = field(default_factory=dict, compare=False)

    def __post_init__(self) -> None:
        if len(self.links) != len(self.joints) + 1:
            raise InputError(
                "the number of links must be the number of joints plus 1",
                found=f"{len(self.links)} links and {len(self.joints)} joints",
            )
        for what, names in (("link", self.links), ("joint", [joint.name for joint in self.joints])):
            if len(set(names)) != len(names):
                double = next(name for i, name in enumerate(names) if name in names[:i])
                raise InputError(f"two {what}s have the same name", found=repr(double))
        for i, joint in enumerate(self.joints):
            if not 0 <= joint.parent <= i:
                raise InputError(
                    "the parent link of a joint must precede the child link",
                    where=f"joint {joint.name}",
                    found=str(joint.parent),
                )
            if joint.mimic is not None:
                self._check_mimic(joint, joint.mimic)

    def _check_mimic(self, joint: Joint, mimic: Mimic) -> None:
        mimicked_joint = self.joints[self.joint_index(mimic.mimicked_joint)]
        if mimicked_joint.mimic is not None or mimicked_joint.kind.nq != 1 or joint.kind.nq != 1:
            raise InputError(
                "a joint with one coordinate can mimic only an independent joint with one coordinate",
                where=f"joint {joint.name}",
                found=f"{joint.kind.value} mimicking {mimicked_joint.kind.value} {mimicked_joint.name}",
            )

    # -- coordinates ---------------------------------------------------------------------------------

    @cached_property
    def floating_joints(self) -> tuple[int, ...]:
        return tuple(i for i, joint in enumerate(self.joints) if joint.kind is JointKind.FLOATING)

    @cached_property
    def nq(self) -> int:
        return sum(joint.nq for joint in self.joints)

    @cached_property
    def nv(self) -> int:
        return sum(joint.nv for joint in self.joints)

    @cached_property
    def q_index(self) -> tuple[int, ...]:
        """First index of each joint in `q`.

        A mimic joint has the mimicked joint's index.
        """
        return self._offsets([joint.nq for joint in self.joints])

    @cached_property
    def v_index(self) -> tuple[int, ...]:
        return self._offsets([joint.nv for joint in self.joints])

    def _offsets(self, sizes: Sequence[int]) -> tuple[int, ...]:
        own = np.concatenate(([0], np.cumsum(sizes, dtype=int)))
        independent_joints = (
            self.joint_index(joint.mimic.mimicked_joint) if joint.mimic else i
            for i, joint in enumerate(self.joints)
        )
        return tuple(int(own[i]) for i in independent_joints)

    @cached_property
    def plausible_angle_ranges(self) -> FloatArray:
        """Smallest and largest plausible angles (2, nq), rad.

        The range is infinite for lengths, quaternions and angles without limits.
        """
        ends = np.tile([[-np.inf], [np.inf]], self.nq)
        for joint, at in zip(self.joints, self.q_index, strict=True):
            if joint.nq == 1 and joint.kind.turns and is_bounded(joint.limit):
                lower, upper = limits_with_margin(joint.limit.lower, joint.limit.upper)
                ends[:, at] = min(lower, -MAX_PLAUSIBLE_ANGLE), max(upper, MAX_PLAUSIBLE_ANGLE)
        return freeze(ends)

    @cached_property
    def min_implausible_angle(self) -> float:
        """Smallest absolute value in `plausible_angle_ranges`."""
        return float(np.abs(self.plausible_angle_ranges).min(initial=np.inf))

    # -- names ---------------------------------------------------------------------------------------

    @cached_property
    def _joint_index(self) -> dict[str, int]:
        return {joint.name: i for i, joint in enumerate(self.joints)}

    @cached_property
    def _link_index(self) -> dict[str, int]:
        return {name: i for i, name in enumerate(self.links)}

    def joint_index(self, name: str) -> int:
        if (index := self._joint_index.get(name)) is None:
            raise UnknownNameError("joint", name, self._joint_index, where=self.name)
        return index

    def link_index(self, name: str) -> int:
        if (index := self._link_index.get(name)) is None:
            raise UnknownNameError("link", name, self._link_index, where=self.name)
        return index

    @cached_property
    def frame_names(self) -> tuple[str, ...]:
        """Unique frame names, root first."""
        names = [self.links[0]]
        for joint, child in zip(self.joints, self.links[1:], strict=True):
            names += [joint.name, child]
        return tuple(dict.fromkeys(names))

    @cached_property
    def link_frames(self) -> tuple[LinkFrame, ...]:
        return tuple(LinkFrame.of(name) for name in self.links)

    @cached_property
    def joint_frames(self) -> tuple[JointFrame, ...]:
        return tuple(JointFrame.of(joint.name) for joint in self.joints)

    def frame_link(self, name: str) -> int:
        """Return the index of the frame's link.

        | `name` | frame |
        |---|---|
        | "link:hand" | the link or joint "link:hand" if there is one, otherwise the link "hand" |
        | LinkFrame.of("hand") | the link "hand" |
        """
        if not isinstance(name, str):
            raise InputError(
                "a frame must be a name of a link or joint", where=self.name, found=safe_repr(name)
            )
        if isinstance(name, FrameName):
            return self._frame_index(name)
        link, joint = self._link_index.get(name), self._joint_index.get(name)
        if link is None and joint is None:
            if (prefixed := self._with_prefix(name)) is not None:
                return self._frame_index(prefixed)
            raise UnknownNameError(
                "frame", name, self.frame_names, where=self.name, question=QuestionsSection.UNKNOWN_FRAMES
            )
        if link is not None and joint is not None and link != joint + 1:
            links, joints = self.link_frames, self.joint_frames
            names = [
                *self._first_unambiguous_name(links[link], *joints[link - 1 : link]),
                *self._first_unambiguous_name(joints[joint], links[joint + 1]),
            ]
            raise InputError(
                f"a link and a joint at different places have the name {name!r}",
                where=self.name,
                remedy=f"write {' or '.join(map(repr, names))}" if names else "rename the link or the joint",
            )
        return link if link is not None else self._joint_index[name] + 1

    def _frame_index(self, frame: FrameName) -> int:
        return (
            self.link_index(frame.bare_name)
            if isinstance(frame, LinkFrame)
            else self.joint_index(frame.bare_name) + 1
        )

    def _with_prefix(self, name: str) -> FrameName | None:
        kinds: tuple[tuple[type[FrameName], dict[str, int]], ...] = (
            (LinkFrame, self._link_index),
            (JointFrame, self._joint_index),
        )
        for kind, known in kinds:
            if name.startswith(kind.prefix) and name.removeprefix(kind.prefix) in known:
                return kind(name)
        return None

    def _first_unambiguous_name(self, *names: FrameName) -> list[str]:
        known = self._link_index.keys() | self._joint_index.keys()
        return [str(name) for name in names if name not in known][:1]

    def frame_name(self, link: int) -> str:
        name = self.links[link]
        joint = self._joint_index.get(name)
        return name if joint is None or joint + 1 == link else self.link_frames[link]

    # -- paths ---------------------------------------------------------------------------------------

    def path(self, link: int) -> tuple[int, ...]:
        """Return the joint indices, root first."""
        joints = []
        while link > 0:
            joints.append(link - 1)
            link = self.joints[link - 1].parent
        return tuple(reversed(joints))

    def leaves(self) -> Iterator[int]:
        parents = {joint.parent for joint in self.joints}
        return (link for link in range(len(self.links)) if link not in parents)


def with_root_joint(tree: KinematicTree, kind: JointKind) -> KinematicTree:
    for known, name in ((tree.links, "universe"), ([joint.name for joint in tree.joints], "root_joint")):
        if name in known:
            raise InputError(
                f"the robot uses the name {name!r}, which a root joint needs",
                where=tree.name,
                remedy="rename the link or joint in the URDF, or load the robot without root_joint",
            )
    root = Joint("root_joint", kind, 0, np.eye(4), np.array([1.0, 0.0, 0.0]))
    others = [replace(joint, parent=joint.parent + 1) for joint in tree.joints]
    return KinematicTree(tree.name, ("universe", *tree.links), (root, *others))


def with_pinocchio_tilts(tree: KinematicTree, tilts: Mapping[str, float]) -> KinematicTree:
    joints = (replace(joint, pinocchio_tilt=tilts.get(joint.name, 0.0)) for joint in tree.joints)
    return KinematicTree(tree.name, tree.links, tuple(joints))


def with_named_poses(tree: KinematicTree, poses: Mapping[str, Mapping[str, float]]) -> KinematicTree:
    """Replace the named poses, and drop values of mimic joints and of joints with several coordinates."""
    single = {joint.name for joint in tree.joints if joint.nq == 1}
    stored = {
        pose: {name: x for name, x in values.items() if name in single} for pose, values in poses.items()
    }
    return replace(tree, poses=stored)


def with_locks(tree: KinematicTree, values: Mapping[str, float]) -> KinematicTree:
    """Lock joints, and the joints that mimic them, at values in rad or m."""
    independent_joints = [joint.mimic.mimicked_joint if joint.mimic else joint.name for joint in tree.joints]
    joints = [
        Lock(joint, values[mimicked_joint]).make_fixed_joint() if mimicked_joint in values else joint
        for joint, mimicked_joint in zip(tree.joints, independent_joints, strict=True)
    ]
    return with_named_poses(KinematicTree(tree.name, tree.links, tuple(joints)), tree.poses)


def without_mimic_rules(tree: KinematicTree) -> KinematicTree:
    return KinematicTree(tree.name, tree.links, tuple(replace(joint, mimic=None) for joint in tree.joints))


def build_tree(name: str, root: str, joints: Sequence[tuple[Joint, str, str]]) -> KinematicTree:
    """Sort triples (joint, parent link, child link) into Pinocchio's order."""
    below: dict[str, list[tuple[Joint, str]]] = {}
    for joint, parent, child in joints:
        below.setdefault(parent, []).append((joint, child))
    links, ordered = [root], list[Joint]()
    # Recursion would fail for a chain of 50,000 links.
    stack = [(0, joint, child) for joint, child in _sort_names_descending(below.get(root, []))]
    while stack:
        parent_index, joint, child = stack.pop()
        ordered.append(replace(joint, parent=parent_index))
        links.append(child)
        stack += [(len(links) - 1, *pair) for pair in _sort_names_descending(below.get(child, []))]
        if len(ordered) > len(joints):
            raise InputError("the joints close a loop", where=name, found=f"joint {joint.name} reached twice")
    if len(ordered) != len(joints):
        missing = sorted({joint.name for joint, _, _ in joints} - {joint.name for joint in ordered})
        raise InputError(f"joints cannot be reached from {root!r}", where=name, found=", ".join(missing))
    return KinematicTree(name, tuple(links), tuple(ordered))


def _sort_names_descending(joints: list[tuple[Joint, str]]) -> list[tuple[Joint, str]]:
    return sorted(joints, key=lambda pair: pair[0].name, reverse=True)


def pose(R: ArrayLike | None = None, p: ArrayLike | None = None) -> FloatArray:
    T = np.eye(4)
    if R is not None:
        T[:3, :3] = R
    if p is not None:
        T[:3, 3] = p
    return T


def is_rigid(T: FloatArray, tolerance: float) -> bool:
    return bool(inputs.rotation_defect(T[:3, :3]) <= tolerance) and T[3].tolist() == [0.0, 0.0, 0.0, 1.0]


def inverse(T: FloatArray) -> FloatArray:
    back = T[:3, :3].T
    return pose(back, -back @ T[:3, 3])
