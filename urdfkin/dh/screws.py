"""Compute a path's product of exponentials, in the form of Lynch and Park.

    T(q) = exp([S_1] q_1) ... exp([S_n] q_n) M = M exp([B_1] q_1) ... exp([B_n] q_n)    (Modern Robotics, 4.1)

M is the tip's pose in the zero configuration. Each joint has a screw (w, v), with the **angular part first**,
as in the book Modern Robotics and its code. For a revolute joint through p, w is the unit axis and v = p x w.
For a prismatic joint, w = 0 and v is the unit direction. Space screws S are in the base frame. Body screws
B = Ad(M^-1) S are in the tip frame.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.dh.convert import DEFAULT_PRISMATIC_LIMIT, make_link_names, make_serial_tree, make_unique
from urdfkin.dh.export.text import pose_matrix
from urdfkin.dh.rows import check_keys, parse_name
from urdfkin.errors import InputError
from urdfkin.errors.display import CodeLine, Displayable, Matrix, Table, TextDocument, format_number
from urdfkin.errors.escape import log_line
from urdfkin.errors.validators import as_str, safe_repr
from urdfkin.kinematics.inputs import as_floats, check_range, rotation_defect
from urdfkin.kinematics.number_kinds import norm
from urdfkin.kinematics.rotation import UNCHANGED_MATRIX_TOLERANCE, polar_factor, rotation_with_z_axis
from urdfkin.kinematics.roundings import EPS, table_roundings
from urdfkin.model.chain import FrameChain
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
    pose,
)

#: Tolerance of handwritten numbers: the length of an axis, a pitch (m/rad), and the entries of R R^T - I.
_HANDWRITTEN_TOLERANCE = 1e-4
_FORMULA = "T(q) = exp([S1] q1) ... exp([Sn] qn) M = M exp([B1] q1) ... exp([Bn] qn), screws (w, v)"


@dataclass(frozen=True, slots=True)
class ScrewJoint:
    name: str
    kind: JointKind
    mimic: Mimic | None = None
    limit: Limit | None = None


@dataclass(frozen=True, eq=False, repr=False)
class ProductOfExponentials(Displayable):
    """A path as a product of exponentials, printed as tables.

    Attributes:
        joints: The joints, base to tip.
        M: (4, 4) pose of the tip in the base frame, in the zero configuration (metres).
        space: (n, 6) screws (w, v) in the base frame. The units for a revolute joint are rad/rad and m/rad.
            For a prismatic joint, w is 0 and v is in m/m.
        robot: The robot's name.
        base_frame: Name of the base frame.
        tip_frame: Name of the tip frame.

    Example:
        >>> M = [[1, 0, 0, 2], [0, 1, 0, 0], [0, 0, 1, 0]]
        >>> arm = screws_from_rows([[0, 0, 1, 0, 0, 0], [0, 0, 1, 0, -1, 0]], M)
        >>> arm.placement([0.0, np.pi / 2])[:3, 3].round(12).tolist()
        [1.0, 1.0, 0.0]
    """

    joints: tuple[ScrewJoint, ...]
    M: FloatArray
    space: FloatArray
    robot: str = "robot"
    base_frame: str = "base"
    tip_frame: str = "tip"

    def __repr__(self) -> str:
        path = f"{self.robot}: {self.base_frame} to {self.tip_frame}"
        return log_line(f"<ProductOfExponentials {path}, {len(self.joints)} joints>")

    def _text_document(self) -> TextDocument:
        return screws_document(self, digits=6)

    @cached_property
    def body(self) -> FloatArray:
        """(n, 6) screws B = Ad(M^-1) S in the tip frame.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").screws("tip", "base").body[1].tolist()
        [0.0, 0.0, 1.0, 0.0, 0.4, 0.0]
        """
        R, p = self.M[:3, :3], self.M[:3, 3]
        w, v = self.space[:, :3], self.space[:, 3:]
        return freeze(np.hstack([w @ R, (v - np.cross(p, w)) @ R]))

    @cached_property
    def coupling(self) -> Coupling:
        """The map from coordinates to joint values.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").screws("tip", "base").coupling.names
        ('joint_1', 'joint_2')
        """
        return make_coupling([(joint.name, joint.mimic, joint.kind) for joint in self.joints])

    @property
    def points(self) -> FloatArray:
        """(n, 3) points: the point of each revolute axis that is nearest to the base's origin.

        A prismatic joint has the point of the previous joint.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").screws("tip", "base").points.tolist()
        [[0.0, 0.0, 0.0], [0.5, 0.0, -0.0]]
        """
        here, found = np.zeros(3), []
        for joint, screw in zip(self.joints, self.space, strict=True):
            here = np.cross(screw[:3], screw[3:]) if joint.kind.turns else here
            found.append(here)
        return np.array(found).reshape(-1, 3)

    @np.errstate(over="ignore", invalid="ignore")  # RangeError replaces these warnings.
    def placement(self, q: ConfigurationLike) -> FloatArray:
        """Return the (..., 4, 4) pose of the tip in the base frame.

        Args:
            q: (..., coordinates) in the order of `coupling.names`.

        Raises:
            InputError: `q` has the wrong length, or a number is not finite.
            RangeError: a result leaves the range of double precision.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").screws("tip", "base").placement([0.0, 0.0])[:3, 3].tolist()
        [0.9, 0.0, 0.0]
        """
        return check_range(self.path.poses(self.coupling.values(q)))

    @cached_property
    def path(self) -> Path:
        """The product as rotations about z axes and translations along z axes.

        For a revolute joint, exp([S] q) is A Rz(q) A^-1. For a prismatic joint, exp([S] q) is A Tz(q) A^-1.
        The z axis of A is along the joint's axis. The constant poses are A_i^-1 A_{i+1}. The last constant
        pose is A_n^-1 M.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").screws("tip", "base").path.poses(np.zeros(2))[:3, 3].tolist()
        [0.9, 0.0, 0.0]
        """
        steps, R, p = list[FloatArray | ElementaryMotion](), np.eye(3), np.zeros(3)
        for joint, screw, point in zip(self.joints, self.space, self.points, strict=True):
            along = rotation_with_z_axis(screw[:3] if joint.kind.turns else screw[3:])
            steps += [pose(R.T @ along, R.T @ (point - p)), ElementaryMotion(2, joint.kind.turns)]
            R, p = along, point
        return Path((*steps, pose(R.T @ self.M[:3, :3], R.T @ (self.M[:3, 3] - p))))

    @property
    def roundings(self) -> float:
        """Bound of the rotation's rounding error in `placement`, in units of eps.

        The bound is twice the bound for a Denavit-Hartenberg table of the path. The bound does not include
        the rounding of q.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").screws("tip", "base").roundings < 1000
        True
        """
        return 2.0 * table_roundings(len(self.joints))

    @np.errstate(over="ignore")  # After an overflow, the bound is inf.
    def rounding(self, q: ConfigurationLike) -> FloatArray:
        """Return a bound (...,) of the rounding error of the position (metres).

        >>> import urdfkin
        >>> bool(urdfkin.load("planar_two_link").screws("tip", "base").rounding([0.0, 0.0]) < 1e-13)
        True
        """
        values = np.abs(self.coupling.values(q))
        turns = np.array([joint.kind.turns for joint in self.joints], dtype=bool)
        points = np.vstack([np.zeros(3), self.points, self.M[:3, 3]])
        length = 2.0 * float(norm(np.diff(points, axis=0)).sum())
        lever = length + values[..., ~turns].sum(axis=-1)
        return np.asarray(EPS * (self.roundings + values[..., turns].sum(axis=-1)) * lever)

    def to_tree(self) -> KinematicTree:
        """Return the path as a kinematic tree.

        For example, link `joint_1_link` has its frame's origin on the axis of `joint_1`.
        In the zero configuration, all link frames are parallel to the base frame.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").screws("tip", "base").to_tree().links
        ('base', 'joint_1_link', 'joint_2_link', 'tip')
        """
        names = [joint.name for joint in self.joints]
        links = make_link_names(self.base_frame, names, self.tip_frame)
        joints, origin = list[Joint](), np.zeros(3)
        for joint, screw, point in zip(self.joints, self.space, self.points, strict=True):
            limit = joint.limit if joint.kind.turns else joint.limit or DEFAULT_PRISMATIC_LIMIT
            axis = screw[:3] if joint.kind.turns else screw[3:]
            T = pose(p=point - origin)
            joints.append(Joint(joint.name, joint.kind, 0, T, axis, limit, joint.mimic))
            origin = point
        T_tip, axis = pose(p=-origin) @ self.M, np.array([1.0, 0.0, 0.0])
        fixed = make_unique(f"{self.tip_frame}_fixed", names)
        joints.append(Joint(fixed, JointKind.FIXED, 0, T_tip, axis))
        return make_serial_tree(self.robot, links, joints)

    def as_mapping(self) -> dict[str, Any]:
        """Return plain data for `screws_from_mapping`, without mimic rules and limits.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").screws("tip", "base").as_mapping()["joints"]
        ['joint_1', 'joint_2']
        """
        return {
            "robot": self.robot,
            "base_frame": self.base_frame,
            "tip_frame": self.tip_frame,
            "joints": [joint.name for joint in self.joints],
            "M": self.M.tolist(),
            "space": self.space.tolist(),
            "body": self.body.tolist(),
        }


def screws_document(screws: ProductOfExponentials, digits: int = 10) -> TextDocument:
    parts: list[str | Table | Matrix] = [CodeLine(_FORMULA)]
    heads = ("i", "joint", "w_x", "w_y", "w_z", "v_x", "v_y", "v_z")
    for title, rows in (("space screws S", screws.space), ("body screws B", screws.body)):
        cells = [
            (str(i), joint.name, *(format_number(x, digits=digits) for x in row))
            for i, (joint, row) in enumerate(zip(screws.joints, rows, strict=True), 1)
        ]
        parts += ["", title, Table(heads, cells, left=(1,), names=(1,))]
    parts += ["", "M, the tip in the zero configuration (metres):", pose_matrix(screws.M, digits), ""]
    path = f"{screws.robot}: {screws.base_frame} to {screws.tip_frame}"
    return TextDocument(f"{path}, product of exponentials (metres, angular first)", parts)


def make_screws(path: FrameChain) -> ProductOfExponentials:
    frames, rows = path.path.frames(np.zeros(len(path.joints)))[::2], list[FloatArray]()
    for joint, T in zip(path.joints, frames, strict=False):
        z, p = T[:3, 2], T[:3, 3]
        rows.append(np.concatenate([z, np.cross(p, z)] if joint.kind.turns else [np.zeros(3), z]) + 0.0)
    joints = tuple(ScrewJoint(one.name, one.kind, one.mimic, one.limit) for one in path.joints)
    ends = path.robot, path.base, path.tip
    return ProductOfExponentials(joints, freeze(frames[-1]), freeze(np.array(rows).reshape(-1, 6)), *ends)


def _nearest_rigid(M: FloatArray) -> FloatArray:
    """Return the rigid transform nearest to M. An exact M is returned unchanged."""
    T = np.eye(4)
    T[:3] = M[:3]
    R = T[:3, :3]
    if rotation_defect(R) > _HANDWRITTEN_TOLERANCE:
        raise InputError("M must be a rotation and a translation", where="M", found=str(R.tolist()))
    nearest = polar_factor(R)
    if np.abs(nearest - R).max() > UNCHANGED_MATRIX_TOLERANCE:
        T[:3, :3] = nearest
    return T


def screws_from_rows(
    screws: ArrayLike,
    M: ArrayLike,
    *,
    frame: str = "space",
    joints: Sequence[str] = (),
    robot: str = "robot",
    base_frame: str = "base",
    tip_frame: str = "tip",
) -> ProductOfExponentials:
    """Make a product of exponentials from handwritten screws.

    A joint is revolute if w is not 0, otherwise prismatic.
    URDF has no joint with a pitch, so w . v must be 0.

    Args:
        screws: (n, 6) rows (w, v). The shape (6, n) is also allowed, unless n is 6.
        M: (4, 4) or (3, 4) pose of the tip in the zero configuration, with the translation in m.
        frame: Frame of the screws: "space" (base) or "body" (tip).
        joints: Joint names.
        robot: The robot's name.
        base_frame: The base frame's name.
        tip_frame: The tip frame's name.

    Raises:
        InputError: a shape, a screw, a name, M or `frame` is invalid, or the number of names is wrong.
    """
    as_str(frame, "frame")
    S = as_floats(screws, "screws").copy()
    S = S.T if S.ndim == 2 and S.shape[0] == 6 != S.shape[1] else S
    T = as_floats(M, "M")
    if S.ndim != 2 or S.shape[1] != 6 or T.shape not in ((4, 4), (3, 4)) or frame not in ("space", "body"):
        raise InputError(
            "screws must have the shape (n, 6), M the shape (4, 4), and `frame` must be `space` or `body`",
            found=f"{S.shape}, {T.shape}, {frame!r}",
        )
    if not (np.isfinite(S).all() and np.isfinite(T).all()):
        raise InputError("screws and M must be finite numbers", found="nan or inf")
    T = _nearest_rigid(T)
    if frame == "body":
        w = S[:, :3] @ T[:3, :3].T
        S = np.hstack([w, S[:, 3:] @ T[:3, :3].T + np.cross(T[:3, 3], w)])
    names = _parse_joint_names(joints) or tuple(f"joint_{i + 1}" for i in range(len(S)))
    if len(names) != len(S):
        raise InputError(
            "the number of names and the number of screws differ",
            found=f"{len(names)} names, {len(S)} screws",
        )
    named = []
    for i, name in enumerate(names):
        turns = bool(S[i, :3].any())
        size = float(np.linalg.norm(S[i, :3] if turns else S[i, 3:]))
        if abs(size - 1.0) > _HANDWRITTEN_TOLERANCE:
            raise InputError(
                f"the axis {'w' if turns else 'v'} of a screw must have length 1",
                where=f"screw {i + 1}",
                found=f"{size:.6g}",
                remedy="write a screw as (w, v), angular part first",
            )
        S[i] /= size
        pitch = float(S[i, :3] @ S[i, 3:])
        if abs(pitch) > _HANDWRITTEN_TOLERANCE:
            raise InputError(
                "the screw of a joint must be a pure rotation or a pure translation",
                where=f"screw {i + 1}",
                found=f"a pitch of {pitch:.3g} m/rad",
                remedy="make w . v = 0 for a revolute joint",
            )
        S[i, 3:] -= pitch * S[i, :3]
        named.append(ScrewJoint(name, JointKind.CONTINUOUS if turns else JointKind.PRISMATIC))
    texts = {"robot": robot, "base_frame": base_frame, "tip_frame": tip_frame}
    ends = [parse_name(text, where) for where, text in texts.items()]
    return ProductOfExponentials(tuple(named), freeze(T), freeze(S), *ends)


def _parse_joint_names(joints: Any) -> tuple[str, ...]:
    if not isinstance(joints, Sequence) or isinstance(joints, str):
        raise InputError("`joints` must be a list of names", where="joints", found=safe_repr(joints))
    names = tuple(parse_name(name, "joints") for name in joints)
    if double := next((name for name in names if names.count(name) > 1), None):
        raise InputError("two screws name the same joint", where="joints", found=repr(double))
    return names


def screws_from_mapping(data: Mapping[str, Any]) -> ProductOfExponentials:
    """Make screws from plain data."""
    known = ("robot", "base_frame", "tip_frame", "joints", "M", "space", "body")
    check_keys([key for key in data if key != "lock"], known, "the table of screws")
    frame = next((key for key in ("space", "body") if key in data), None)
    if frame is None:
        raise InputError(
            "no screws", where="space", remedy="write space = [[w, v], ...], or body = [[w, v], ...]"
        )
    named = {key: data[key] for key in known[:4] if key in data}
    try:
        return screws_from_rows(data[frame], data["M"], frame=frame, **named)
    except (TypeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            "screws and M must be lists of numbers", where=frame, found=str(error)[:100]
        ) from None
