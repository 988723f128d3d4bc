"""Compute Khalil and Kleinfinger's parameters: one table for a whole tree.

W. Khalil and J.-F. Kleinfinger, "A new geometric notation for open and closed-loop robots", ICRA 1986. Each
link j has one frame. The axis z_j of the frame is the axis of joint j, which moves link j. The antecedent of
link j is the nearest moving link towards the root. The antecedent has the index i = a(j). Frame j has this
pose in frame i:

`T(i, j) = Rz(gamma) Tz(b) Tx(d) Rx(alpha) Ry(beta) Rz(theta) Tz(r)`

The axis x_i is along the common normal of two axes: the axis of link i, and the axis of its first moving
child. Therefore, gamma and b of the first moving child are zero.

For a chain without branches, the table has the form of the modified Denavit-Hartenberg table. The modified
table writes a(i-1) instead of d, and d(i) instead of r. Frame 0, the last row and parallel axes are
exceptions.

The original notation has no angle beta. In this table, beta is zero unless two axes are nearly parallel.
Without beta, nearly parallel axes may need offsets of kilometres (Hayati).
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.compiled.plan import axis_pose
from urdfkin.dh.common_normals import (
    AxisTransform,
    PoseTolerance,
    check_lengths,
    clean_length,
    find_axis_transform,
    pose_tolerance,
    tilt_sine,
)
from urdfkin.dh.derive import RIGHT_ANGLE_TOLERANCE
from urdfkin.dh.export.text import PrintedPrecision, format_sum
from urdfkin.dh.table import clean_angle, joint_transform, link_transform
from urdfkin.dh.units import Units
from urdfkin.errors import InputError
from urdfkin.errors.display import CodeLine, Table, TextDocument
from urdfkin.errors.escape import csv_cell, csv_text
from urdfkin.kinematics.inputs import as_finite, check_range
from urdfkin.kinematics.roundings import EPS, table_roundings
from urdfkin.model.path import elementary_pose
from urdfkin.model.tree import FloatArray, JointKind, KinematicTree, freeze

_SIGMA = {JointKind.REVOLUTE: 0, JointKind.CONTINUOUS: 0, JointKind.PRISMATIC: 1, JointKind.FIXED: 2}


@dataclass(frozen=True, slots=True)
class TreeRow:
    """The row of one joint.

    The joint's value is added to theta (sigma 0) or r (sigma 1).

    Attributes:
        antecedent: Row index of the antecedent, from 0, or -1 for the root.
        sigma: 0 for a revolute, 1 for a prismatic and 2 for a fixed joint.
        mimicked_joint: The mimicked joint, or the joint itself without a mimic rule.
        multiplier: Multiplier of the mimic rule.
    """

    joint: str
    link: str
    antecedent: int
    sigma: int
    gamma: float
    b: float
    alpha: float
    d: float
    beta: float
    theta: float
    r: float
    mimicked_joint: str
    multiplier: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, eq=False)
class TreeParameters:
    """The table of a whole robot.

    Attributes:
        path_lengths: (joints,) path lengths (m) from the root to the joint origins in the URDF.
        T_frame_link: (joints, 4, 4) poses of the URDF link frames in the rows' frames.
        zeroed_tilt: Largest sum (rad) of the zeroed tilts along a path from the root.
    """

    robot: str
    root: str
    rows: tuple[TreeRow, ...]
    path_lengths: FloatArray
    T_frame_link: FloatArray
    zeroed_tilt: float = 0.0

    @cached_property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the columns of `q`."""
        return tuple(row.joint for row in self.rows if row.sigma < 2 and row.mimicked_joint == row.joint)

    @property
    def roundings(self) -> float:
        """Estimated rounding error of a pose, as a multiple of eps * reach.

        The estimate is not a proven bound, and does not include Pinocchio's rounding errors.
        """
        longest = max((len(self._path(j)) for j in range(len(self.rows))), default=0)
        return table_roundings(1 + longest) + self.zeroed_tilt / EPS

    def reach(self, q: ArrayLike) -> FloatArray:
        """Return the path lengths from the root to the links at `q`.

        Returns:
            (..., joints) lengths (m). Each entry is the larger of the URDF's length and the table's length.
        """
        q = self._parse(q)
        values = np.abs(self._values(q))
        travel = np.where([row.sigma == 1 for row in self.rows], values, 0.0)
        lengths = np.array([abs(row.b) + abs(row.d) + abs(row.r) for row in self.rows])
        lengths = lengths + travel + np.linalg.norm(self.T_frame_link[:, :3, 3], axis=-1)
        reach = np.zeros((*q.shape[:-1], len(self.rows)))
        for j in range(len(self.rows)):
            path = self._path(j)
            in_urdf = self.path_lengths[j] + travel[..., path].sum(axis=-1)
            reach[..., j] = np.maximum(lengths[..., path].sum(axis=-1), in_urdf)
        return reach

    def _path(self, j: int) -> list[int]:
        path = []
        while j >= 0:
            path.append(j)
            j = self.rows[j].antecedent
        return path

    def _parse(self, q: ArrayLike) -> FloatArray:
        array = as_finite(q, "q")
        if array.shape[-1:] != (len(self.coordinates),):
            raise InputError(f"q needs {len(self.coordinates)} numbers", found=f"shape {array.shape}")
        return array

    def _values(self, q: FloatArray) -> FloatArray:
        column = {name: i for i, name in enumerate(self.coordinates)}
        values = np.zeros((*q.shape[:-1], len(self.rows)))
        for j, row in enumerate(self.rows):
            if row.sigma < 2:
                values[..., j] = row.multiplier * q[..., column[row.mimicked_joint]] + row.offset
        return values

    def placements(self, q: ArrayLike) -> FloatArray:
        """Return the poses of all links; the numbers in `q` have the order of `coordinates`.

        Returns:
            (..., joints, 4, 4) poses of the URDF link frames in the root frame.

        Raises:
            InputError: `q` has the wrong length, or a number that is not finite.
            RangeError: a result leaves the range of double precision.
        """
        q = self._parse(q)
        with np.errstate(over="ignore", invalid="ignore"):  # RangeError replaces these warnings.
            return check_range(self._compute_placements(q))

    def _compute_placements(self, q: FloatArray) -> FloatArray:
        values = self._values(q)
        frames = np.empty((*q.shape[:-1], len(self.rows), 4, 4))
        for j, row in enumerate(self.rows):
            T = np.eye(4) if row.antecedent < 0 else frames[..., row.antecedent, :, :]
            constant = joint_transform(row.gamma, row.b) @ link_transform(row.d, row.alpha, row.beta)
            T = T @ constant @ joint_transform(row.theta, row.r)
            if row.sigma < 2:
                T = T @ elementary_pose(2, row.sigma == 0, values[..., j])
            frames[..., j, :, :] = T
        return np.asarray(frames @ self.T_frame_link)


def make_tree_parameters(tree: KinematicTree) -> TreeParameters:
    """Return Khalil and Kleinfinger's parameters, exact up to rounding.

    Raises:
        InputError: the robot has a planar or floating joint.
        RangeError: a coordinate of a joint's origin is above 1e150 m.
    """
    check_lengths(tree.joints)
    for joint in tree.joints:
        if joint.kind not in _SIGMA:
            raise InputError(
                f"a {joint.kind.value} joint has several axes, but a row of the table has one axis",
                where=f"joint {joint.name}",
                remedy="load the robot without root_joint, or make a table of a path without this joint",
            )
    lengths = _path_lengths(tree)
    links = _find_link_axes(tree, lengths)
    steps, offsets = _find_transforms(tree, links, lengths)
    rows = tuple(
        _make_row(tree, j, links[j].antecedent, steps[j], offsets, lengths[j])
        for j in range(len(tree.joints))
    )
    poses = [
        np.linalg.inv(joint_transform(*offsets.get(j, (0.0, 0.0)))) @ link.T_link_axis.T
        for j, link in enumerate(links)
    ]
    T_frame_link = freeze(np.reshape(poses, (-1, 4, 4)))
    zeroed_tilt = max((link.zeroed_tilt for link in links), default=0.0)
    return TreeParameters(tree.name, tree.links[0], rows, freeze(lengths), T_frame_link, zeroed_tilt)


@dataclass(frozen=True, slots=True)
class _LinkAxis:
    """The axis frame of a link.

    `zeroed_tilt` is the sum (rad) of the zeroed tilts along the path from the root.
    """

    antecedent: int
    T_antecedent_axis: FloatArray
    T_link_axis: FloatArray
    noise: PoseTolerance
    zeroed_tilt: float


def _find_link_axes(tree: KinematicTree, lengths: list[float]) -> list[_LinkAxis]:
    """Return the axis frame of each link, or the link's URDF frame if the link's joint is fixed."""
    links = list[_LinkAxis]()
    # Each entry is an index i, the pose T_i_link, and the number of fixed joints from link i to the link. For
    # a moving link, i is the link's own index. For all other links, i is the antecedent's index.
    carriers = [(-1, np.eye(4), 0)]
    for j, (joint, length) in enumerate(zip(tree.joints, lengths, strict=True)):
        antecedent, T, folded = carriers[joint.parent]
        align = axis_pose(joint)
        T_axis = T @ joint.T_parent_joint @ align
        noise, tilt = pose_tolerance(folded + 1, 0.0, length), tilt_sine(T_axis)
        zeroed_tilt = links[antecedent].zeroed_tilt if antecedent >= 0 else 0.0
        zeroed_tilt += tilt if tilt <= noise.radians else 0.0
        links.append(_LinkAxis(antecedent, T_axis, align, noise, zeroed_tilt))
        carriers.append((j, align.T, 0) if joint.kind.has_axis else (antecedent, T_axis, folded + 1))
    return links


def _find_transforms(
    tree: KinematicTree, links: list[_LinkAxis], lengths: list[float]
) -> tuple[list[AxisTransform], dict[int, tuple[float, float]]]:
    """Return the transforms between consecutive axes, and (phi, delta) by link.

    A row's frame has the pose Rz(phi) Tz(delta) in the link's axis frame.
    """
    steps, offsets = list[AxisTransform](), {-1: (0.0, 0.0)}
    for link, joint, length in zip(links, tree.joints, lengths, strict=True):
        i = link.antecedent
        # The first moving link with antecedent i defines x_i.
        defines_x = joint.kind.has_axis and i not in offsets
        phi_next = steps[i].phi_next if i >= 0 else 0.0
        phi, _ = offsets.get(i, (-phi_next, 0.0))
        step = find_axis_transform(link.T_antecedent_axis, length, phi, hayati=True, noise=link.noise)
        if abs(clean_angle(step.phi - phi)) > np.pi / 2.0 + RIGHT_ANGLE_TOLERANCE:
            step = step.with_reversed_x()
        if defines_x:
            offsets[i] = (step.phi, step.delta)
        steps.append(step)
    # If no moving link follows a link, the direction of x is free. This choice of x makes theta 0.
    for j, joint in enumerate(tree.joints):
        if joint.kind.has_axis and j not in offsets:
            offsets[j] = (-steps[j].phi_next, 0.0)
    return steps, offsets


def _make_row(
    tree: KinematicTree,
    j: int,
    i: int,
    step: AxisTransform,
    offsets: dict[int, tuple[float, float]],
    length: float,
) -> TreeRow:
    joint = tree.joints[j]
    phi, delta = offsets.get(i, (0.0, 0.0))
    own_phi, own_delta = offsets.get(j, (0.0, 0.0))
    rule = joint.mimic
    return TreeRow(
        joint=joint.name,
        link=tree.links[j + 1],
        antecedent=i,
        sigma=_SIGMA[joint.kind],
        gamma=clean_angle(step.phi - phi),
        b=clean_length(step.delta - delta, length),
        alpha=step.alpha + 0.0,
        d=step.a + 0.0,
        beta=step.beta + 0.0,
        theta=clean_angle(step.phi_next + own_phi),
        r=clean_length(step.delta_next + own_delta, length),
        mimicked_joint=rule.mimicked_joint if rule else joint.name,
        multiplier=rule.multiplier if rule else 1.0,
        offset=rule.offset if rule else 0.0,
    )


def _path_lengths(tree: KinematicTree) -> list[float]:
    lengths = [0.0]
    for joint in tree.joints:
        lengths.append(lengths[joint.parent] + joint.length)
    return lengths[1:]


_FORMULA = "T(i, j) = Rz(gamma) Tz(b) Tx(d) Rx(alpha) Ry(beta) Rz(theta) Tz(r), i = a(j)"


def as_mapping(table: TreeParameters) -> dict[str, Any]:
    """Return plain data (m, rad); row numbers begin at 1, and 0 is the root."""
    return {
        "notation": "Khalil-Kleinfinger",
        "robot": table.robot,
        "root": table.root,
        "rows": [{**asdict(row), "antecedent": row.antecedent + 1} for row in table.rows],
        "T_frame_link": table.T_frame_link.tolist(),
    }


def tree_document(table: TreeParameters, units: Units) -> TextDocument:
    angle, length = units.angle_name, units.length_name
    heads = ["j", "joint", "a(j)", "sigma", f"gamma [{angle}]", f"b [{length}]", f"alpha [{angle}]"]
    heads += [f"d [{length}]", f"theta [{angle}]", f"r [{length}]", f"beta [{angle}]"]
    rows = [_cells(row, j, units) for j, row in enumerate(table.rows, 1)]
    if not any(row.beta for row in table.rows):
        heads, rows = heads[:-1], [cells[:-1] for cells in rows]
    title = f"{table.robot}: Khalil-Kleinfinger parameters, {table.root} is frame 0"
    return TextDocument(title, [CodeLine(_FORMULA), "", Table(heads, rows, (1,), names=(1,))])


def _cells(row: TreeRow, j: int, units: Units) -> list[str]:
    theta, r = units.format_angle(row.theta), units.format_length(row.r)
    # The constant in a mimic joint's cell is the sum of the row's constant and the mimic rule's offset.
    variable = (
        f"q({row.mimicked_joint})"
        if row.mimicked_joint == row.joint
        else f"{row.multiplier:.10g} q({row.mimicked_joint})"
    )
    if row.sigma == 0:
        theta = format_sum(variable, units.format_angle(row.theta + row.offset))
    elif row.sigma == 1:
        r = format_sum(variable, units.format_length(row.r + row.offset))
    cells = [str(j), row.joint, str(row.antecedent + 1), str(row.sigma), units.format_angle(row.gamma)]
    cells += [units.format_length(row.b), units.format_angle(row.alpha), units.format_length(row.d), theta, r]
    return [*cells, units.format_angle(row.beta)]


def as_csv(table: TreeParameters) -> str:
    entries = [f"T{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3, 4)]
    lines: list[list[object]] = [[*(field.name for field in fields(TreeRow)), *entries]]
    for row, T in zip(as_mapping(table)["rows"], table.T_frame_link[:, :3], strict=True):
        cells = [csv_cell(value) if isinstance(value, str) else value for value in row.values()]
        lines.append([*cells, *T.ravel().tolist()])
    return csv_text(lines)


def measure_printed_tree(table: TreeParameters, units: Units, q: FloatArray) -> PrintedPrecision:
    again = replace(table, rows=tuple(_round_tree_row(row, units) for row in table.rows))
    distances = np.linalg.norm((again.placements(q) - table.placements(q))[..., :3, 3], axis=-1)
    return PrintedPrecision(units.digits, float(distances.max(initial=0.0)), None, len(q))


def _round_tree_row(row: TreeRow, units: Units) -> TreeRow:
    theta_offset, r_offset = (row.offset if row.sigma == kind else 0.0 for kind in (0, 1))
    return replace(
        row,
        gamma=units.round_angle(row.gamma),
        b=units.round_length(row.b),
        alpha=units.round_angle(row.alpha),
        d=units.round_length(row.d),
        beta=units.round_angle(row.beta),
        theta=units.round_angle(row.theta + theta_offset) - theta_offset,
        r=units.round_length(row.r + r_offset) - r_offset,
        multiplier=float(f"{row.multiplier:.10g}"),
    )
