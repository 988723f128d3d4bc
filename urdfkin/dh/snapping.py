"""Snap angles to multiples of 15 degrees, and bound the effect on the tip.

An angle is replaced by the nearest multiple of 15 degrees if the change is at most the tolerance. Three kinds
of angles are snapped:

1. Roll, pitch and yaw of each joint's origin in the URDF.
2. The tilt between consecutive axes, and the rotations about these axes.
3. The theta of each row of the derived table.

A changed angle rotates the rest of the chain about a joint's origin. Therefore, the tip's displacement is at
most this angle times the distance from the joint's origin to the tip.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from urdfkin.dh.table import (
    DHConvention,
    DHRow,
    DHTable,
    SnapChange,
    SnapReport,
    angle_difference,
    is_identity,
    nearest_twelfth,
    wrap_angle,
)
from urdfkin.errors import InputError
from urdfkin.errors.validators import as_finite_float
from urdfkin.kinematics.rotation import coordinate_rotation
from urdfkin.kinematics.roundings import ANGLE_ROUNDINGS, EPS, ROTATION_ROUNDINGS
from urdfkin.model.chain import FrameChain, joints_between, make_chain
from urdfkin.model.configuration import TRAVEL_CONDITION, joint_value_range, largest_value, sample_uniform
from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree, freeze

#: Largest permitted tolerance, rad. With a tolerance below 7.5 degrees, at most one multiple of 15 degrees is
#: near enough to an angle.
MAX_SNAP_TOLERANCE = math.pi / 36.0
SNAP_SAMPLES = 500
#: Samples of a mimicked joint that is not on the path are in this range (rad or metres).
_UNKNOWN_RANGE = (-1.0, 1.0)
#: A deviation of a cell up to this number counts as noise (rad, or m per m of the table's span).
_MAX_NOISE = 1e-4
_HINT_TOLERANCES = (1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4)


def check_snap_tolerance(snap: float) -> float:
    tolerance = as_finite_float(snap, "snap")
    if not 0.0 <= tolerance <= MAX_SNAP_TOLERANCE:
        raise InputError(
            "`snap` must be an angle in radians between 0 and 0.087 (5 degrees)", found=repr(snap)
        )
    return tolerance


def snap_chain(
    tree: KinematicTree, tip: str, base: str | None, tolerance: float
) -> tuple[FrameChain, list[tuple[int, SnapChange]]]:
    """Return the snapped chain, and a pair (k, change) for each changed pose A_k."""
    exact = make_chain(tree, tip, base)
    snapped_tree, rotations = _snap_origins(tree, tolerance)
    path = make_chain(snapped_tree, tip, base)
    changes = _changes_of_origins(joints_between(tree, tip, exact.base), rotations)
    constants = list(path.constants)
    names = [*(joint.name for joint in path.joints), path.tip]
    for k, A in enumerate(constants):
        constants[k], angle = _snap_pose(A, tolerance)
        if angle:
            changes.append((k, _make_change(exact, k + 1, f"direction of {names[k]}", angle)))
    joints = [
        replace(joint, T_previous_joint=freeze(A))
        for joint, A in zip(path.joints, constants[:-1], strict=True)
    ]
    return replace(path, joints=tuple(joints), T_last_tip=freeze(constants[-1])), changes


def snap_thetas(table: DHTable, exact: FrameChain, tolerance: float) -> tuple[DHTable, list[SnapChange]]:
    rows, changes = list(table.rows), list[SnapChange]()
    for i, row in enumerate(rows):
        theta = wrap_angle(nearest_twelfth(row.theta)) + 0.0
        angle = abs(angle_difference(row.theta, theta))
        if 0.0 < angle <= tolerance:
            rows[i] = replace(row, theta=theta)
            # The axis of a prismatic joint may have been shifted to the previous joint's origin. This origin
            # is therefore the pivot.
            pivot = i + 1 if row.kind.turns else i
            what = f"theta of {row.joint}: {row.theta:.9g} to {theta:.9g}"
            changes.append(replace(_make_change(exact, pivot, what, angle), row=i))
    return replace(table, rows=tuple(rows)), changes


def snap_report(
    exact: FrameChain, table: DHTable, changes: Sequence[SnapChange], tolerance: float
) -> SnapReport:
    per_metre = dict[str, float]()
    for change in changes:
        for name in change.prismatic_joints:
            per_metre[name] = per_metre.get(name, 0.0) + change.angle
    travels = {row.joint: largest_travel(table, row) for row in table.rows}
    metres = sum((change.tip_displacement for change in changes), 0.0)
    metres += sum(rate * travels[name] for name, rate in per_metre.items())
    q = sample_within_limits(table)
    T_exact, T_table = exact.placement(q), table.placement(q)
    distances = np.linalg.norm(T_exact[:, :3, 3] - T_table[:, :3, 3], axis=-1)
    angles = rotation_angle(T_exact[:, :3, :3], T_table[:, :3, :3])
    return SnapReport(
        tolerance,
        tuple(sorted(changes, key=lambda change: change.row)),
        metres,
        radians=sum((change.angle for change in changes), 0.0),
        per_metre=per_metre,
        measured_metres=float(distances.max(initial=0.0)),
        measured_radians=float(angles.max(initial=0.0)),
        samples=SNAP_SAMPLES,
    )


def sample_within_limits(table: DHTable) -> FloatArray:
    ranges = _coordinate_ranges(table)
    return sample_uniform([ranges.get(name, _UNKNOWN_RANGE) for name in table.joint_names], SNAP_SAMPLES)


def _coordinate_ranges(table: DHTable) -> dict[str, tuple[float, float]]:
    return {row.joint: joint_value_range(row.kind, row.limit) for row in table.rows if row.mimic is None}


def largest_travel(table: DHTable, row: DHRow) -> float:
    """Return the largest absolute value (m) of a prismatic joint.

    A mimic joint can leave its own limits while the mimicked joint is within its limits.
    """
    largest = largest_value(row.limit)
    if (rule := row.mimic) is None:
        return largest
    ends = _coordinate_ranges(table).get(rule.mimicked_joint, _UNKNOWN_RANGE)
    return max(largest, *(abs(rule.multiplier * end + rule.offset) for end in ends))


def rotation_angle(R: FloatArray, S: FloatArray) -> FloatArray:
    """Return the angles (rad) between rotations (..., 3, 3).

    The angle satisfies `|R - S| = 2 sqrt2 sin(angle / 2)` in the Frobenius norm.
    """
    chord = np.linalg.norm(R - S, axis=(-2, -1)) / (2.0 * math.sqrt(2.0))
    return np.asarray(2.0 * np.arcsin(np.minimum(chord, 1.0)))


# -- the three kinds of angles ---------------------------------------------------------------------------


def _snap_origins(tree: KinematicTree, tolerance: float) -> tuple[KinematicTree, dict[str, float]]:
    joints, rotations = list(tree.joints), dict[str, float]()
    for i, joint in enumerate(joints):
        T = np.array(joint.T_parent_joint)
        T[:3, :3] = _round_rotation(T[:3, :3], tolerance)
        angle = float(rotation_angle(T[:3, :3], joint.T_parent_joint[:3, :3]))
        if angle > 0.0:
            joints[i] = replace(joint, T_parent_joint=T)
        if angle > ROTATION_ROUNDINGS * EPS:
            rotations[joint.name] = angle
    return replace(tree, joints=tuple(joints)), rotations


def _round_rotation(R: FloatArray, tolerance: float) -> FloatArray:
    """Snap roll, pitch and yaw of R = Rz(yaw) Ry(pitch) Rx(roll)."""
    level = math.hypot(R[0, 0], R[1, 0])
    pitch = math.atan2(-R[2, 0], level)
    # In gimbal lock, only roll + yaw or roll - yaw is defined, so roll is set to 0.
    if level <= tolerance:
        roll, yaw = 0.0, math.atan2(-R[0, 1], R[1, 1])
    else:
        roll, yaw = math.atan2(R[2, 1], R[2, 2]), math.atan2(R[1, 0], R[0, 0])
    return _multiply_rotations(((2, yaw), (1, pitch), (0, roll)), tolerance)


def _snap_pose(A: FloatArray, tolerance: float) -> tuple[FloatArray, float]:
    """Snap the angles of Rz(phi) Rx(tilt) Rz(psi); return the new pose and the change (rad)."""
    R = A[:3, :3]
    sine = math.hypot(R[0, 2], R[1, 2])
    tilt = math.atan2(sine, R[2, 2])
    if sine <= max(math.sin(tolerance), ROTATION_ROUNDINGS * EPS):
        phi = 0.0
        psi = math.atan2(R[1, 0] - R[0, 1], R[0, 0] + R[1, 1])
        if R[2, 2] < 0.0:
            psi = -math.atan2(R[1, 0] + R[0, 1], R[0, 0] - R[1, 1])
    else:
        phi, psi = math.atan2(R[0, 2], -R[1, 2]), math.atan2(R[2, 0], R[2, 1])
    pose = np.array(A)
    pose[:3, :3] = _multiply_rotations(((2, phi), (0, tilt), (2, psi)), tolerance)
    angle = float(rotation_angle(pose[:3, :3], R))
    return pose, (angle if angle > ROTATION_ROUNDINGS * EPS else 0.0)


def _multiply_rotations(turns: Sequence[tuple[int, float]], tolerance: float) -> FloatArray:
    """Return the product of elementary rotations (axis, angle) with snapped angles."""
    R = np.eye(3)
    for axis, angle in turns:
        twelfth = nearest_twelfth(angle)
        is_round = abs(angle - twelfth) <= max(tolerance, ROTATION_ROUNDINGS * EPS)
        turn = coordinate_rotation(axis, np.asarray(twelfth if is_round else angle))
        if is_round:
            turn[np.abs(turn) < EPS] = 0.0  # In doubles, cos(pi/2) is not 0.
        R = R @ turn
    return R


# -- bounds -----------------------------------------------------------------------------------------


def _changes_of_origins(
    steps: Sequence[tuple[Joint, bool]], rotations: Mapping[str, float]
) -> list[tuple[int, SnapChange]]:
    changes, lever, prismatic_joints = list[tuple[int, SnapChange]](), 0.0, list[str]()
    moving = sum(joint.kind.has_axis for joint, _ in steps)
    for joint, backwards in reversed(steps):
        offset = math.hypot(*joint.T_parent_joint[:3, 3])
        slides = joint.kind is JointKind.PRISMATIC
        lever += offset if backwards else 0.0
        prismatic_joints += [joint.name] if slides and not backwards else []
        if angle := rotations.get(joint.name, 0.0):
            before = moving - (joint.kind.has_axis and not backwards)
            change = SnapChange(0, f"origin of {joint.name}", angle, lever, tuple(reversed(prismatic_joints)))
            changes.append((before, change))
        prismatic_joints += [joint.name] if slides and backwards else []
        lever += 0.0 if backwards else offset
        moving -= joint.kind.has_axis
    return changes[::-1]


def _make_change(exact: FrameChain, k: int, what: str, angle: float) -> SnapChange:
    """Describe a rotation of the rest of the chain about the origin of joint k (the base has k = 0)."""
    prismatic_joints = tuple(joint.name for joint in exact.joints[max(k - 1, 0) :] if not joint.kind.turns)
    return SnapChange(0, what, angle, float(exact.lengths[k:].sum()), prismatic_joints)


def row_of_constant(table: DHTable, k: int) -> int:
    """Return the index of the row that contains A_k: -1 for the base, n for the tool."""
    n = len(table.rows)
    if k == 0:
        return -1
    if k == n:
        return n - 1 if is_identity(table.tool) else n
    return k - 1 if table.convention is DHConvention.STANDARD else k


def find_noisy_cells(table: DHTable) -> list[tuple[str, str, float]]:
    """Return (joint, cell, deviation) of each noisy cell.

    A noisy angle is near a multiple of 15 degrees, but not equal to it. A noisy length is near 0, but not 0.
    """
    noisy = []
    for row in table.rows:
        for name, angle in (("alpha", row.alpha), ("theta", row.theta), ("beta", row.beta)):
            deviation = abs(angle - nearest_twelfth(angle))
            if ANGLE_ROUNDINGS * EPS < deviation <= _MAX_NOISE:
                noisy.append((row.joint, name, deviation))
        for name, length in (("a", row.a), ("d", row.d)):
            if 0.0 < abs(length) <= _MAX_NOISE * table.span:
                noisy.append((row.joint, name, abs(length)))
    return sorted(noisy, key=lambda cell: cell[2])


def travel_condition(table: DHTable) -> str:
    """Return the condition of a bound on the tip's displacement, or "" without a condition."""
    condition = "prismatic joints are within their limits"
    if all(row.kind.turns for row in table.rows):
        return ""
    return f"{condition} and {TRAVEL_CONDITION}" if table.unlimited else condition


def snap_hint(table: DHTable, make_snapped_table: Callable[[float], DHTable]) -> str | None:
    """Recommend the tolerance that leaves the fewest noisy cells."""
    noisy = find_noisy_cells(table) if table.snap is None else []
    if not noisy:
        return None
    counts = {
        tolerance: len(find_noisy_cells(make_snapped_table(tolerance))) for tolerance in _HINT_TOLERANCES
    }
    best = min(counts, key=lambda tolerance: counts[tolerance])
    if counts[best] >= len(noisy):
        return None
    joint, cell, size = noisy[0]
    unit = "m" if cell in ("a", "d") else "rad"
    subject = f"{len(noisy)} cells look" if len(noisy) > 1 else "a cell looks"
    return (
        f"{subject} like the effect of rounded angles in the file ({cell} of {joint}: {size:.2g} {unit}):"
        f" --snap {best:.0e} reduces their number to {counts[best] or 'zero'} and shows the effect on the tip"
    )
