"""Snap angles to multiples of 15 degrees, and state the effect on the tip.

A file may write an angle inexactly (1.5708), or a calibration may have changed it slightly. Three angles are
snapped, from base to tip:

1. the orientation of each joint's origin in the URDF (roll, pitch and yaw);
2. the tilt between consecutive axes, and the rotations before and after it;
3. the angle theta of each row, after the rows are computed.

The positions of joint origins are not changed. Therefore, each change of an angle only rotates the rest of
the chain about a joint's origin. From these rotations, `urdfkin.dh.table` derives a bound of the effect on
the tip.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from urdfkin.dh.table import DHConvention, DHTable, SnapChange, SnapReport, nearest_twelfth, wrapped
from urdfkin.errors import InputError
from urdfkin.errors.validators import real_number
from urdfkin.kinematics.rotation import coordinate_rotation
from urdfkin.kinematics.roundings import ANGLE, EPS, TURN
from urdfkin.model.chain import FrameChain, chain, steps_between
from urdfkin.model.configuration import axis_range, values_within
from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree, Limit, frozen

#: The largest tolerance is 5 degrees (in rad).
#: With more than 7.5 degrees, an angle could be within the tolerance of two multiples of 15 degrees.
LARGEST_TOLERANCE = math.pi / 36.0
#: A snapped table is compared with the exact chain at this number of configurations.
SAMPLES = 500


def checked_tolerance(snap: float) -> float:
    """Return the tolerance (rad) as a float; raise InputError unless it is between 0 and 5 degrees."""
    tolerance = real_number(snap, "snap")
    if not 0.0 <= tolerance <= LARGEST_TOLERANCE:
        raise InputError(
            "`snap` must be an angle in radians between 0 and 0.087 (5 degrees)", found=repr(snap)
        )
    return tolerance


def snap_chain(
    tree: KinematicTree, tip: str, base: str | None, tolerance: float
) -> tuple[FrameChain, list[tuple[int, SnapChange]]]:
    """Return the chain with snapped angles, and the list of changes.

    Each entry of the list contains the index of a constant pose of the chain, and its change.
    """
    exact = chain(tree, tip, base)
    rounder, moved = _snap_origins(tree, tolerance)
    path = chain(rounder, tip, base)
    changes = _changes_of_origins(steps_between(tree, tip, exact.base), moved)
    constants = list(path.constants)
    names = [*(joint.name for joint in path.joints), path.tip]
    for k, A in enumerate(constants):
        constants[k], angle = _snap_pose(A, tolerance)
        if angle:
            changes.append((k, _change(exact, k + 1, f"direction of {names[k]}", angle)))
    joints = [
        replace(joint, T_previous_joint=frozen(A))
        for joint, A in zip(path.joints, constants[:-1], strict=True)
    ]
    return replace(path, joints=tuple(joints), T_last_tip=frozen(constants[-1])), changes


def snap_thetas(table: DHTable, exact: FrameChain, tolerance: float) -> tuple[DHTable, list[SnapChange]]:
    """Snap theta of each row; a change of theta turns the rest of the chain about the row's axis."""
    rows, changes = list(table.rows), list[SnapChange]()
    for i, row in enumerate(rows):
        theta = wrapped(nearest_twelfth(row.theta)) + 0.0
        angle = abs(math.remainder(row.theta - theta, 2.0 * math.pi))
        if 0.0 < angle <= tolerance:
            rows[i] = replace(row, theta=theta)
            # The line of a prismatic axis may have been moved to the joint before it.
            pivot = i + 1 if row.kind.turns else i
            what = f"theta of {row.joint}: {row.theta:.9g} to {theta:.9g}"
            changes.append(replace(_change(exact, pivot, what, angle), row=i))
    return replace(table, rows=tuple(rows)), changes


def statement(
    exact: FrameChain, table: DHTable, changes: Sequence[SnapChange], tolerance: float
) -> SnapReport:
    """Return the sum of the bounds of all changes, and their largest effect in sampled configurations."""
    radians = sum((change.angle for change in changes), 0.0)
    per_metre = dict[str, float]()
    for change in changes:
        for name in change.sliders:
            per_metre[name] = per_metre.get(name, 0.0) + change.angle
    reached = {joint.name: travel(joint.limit) for joint in exact.joints}
    metres = sum((change.tip for change in changes), 0.0)
    metres += sum(rate * reached[name] for name, rate in per_metre.items())
    bounds = {one.name: axis_range(one.kind, one.limit) for one in exact.joints if one.mimic is None}
    q = values_within([bounds.get(name, UNKNOWN) for name in exact.joint_names], SAMPLES)
    T_exact, T_table = exact.placement(q), table.placement(q)
    shift = np.linalg.norm(T_exact[:, :3, 3] - T_table[:, :3, 3], axis=-1)
    turn = rotation_angle(T_exact[:, :3, :3], T_table[:, :3, :3])
    return SnapReport(
        tolerance,
        tuple(sorted(changes, key=lambda change: change.row)),
        metres,
        radians,
        per_metre,
        float(shift.max(initial=0.0)),
        float(turn.max(initial=0.0)),
        SAMPLES,
    )


def rotation_angle(R: FloatArray, S: FloatArray) -> FloatArray:
    """Return the (...,) angles between rotations (..., 3, 3) in radians.

    The formula |R - S| = 2 sqrt2 sin(angle / 2) is also accurate for small angles.
    """
    chord = np.linalg.norm(R - S, axis=(-2, -1)) / (2.0 * math.sqrt(2.0))
    return np.asarray(2.0 * np.arcsin(np.minimum(chord, 1.0)))


# -- the three kinds of angles ---------------------------------------------------------------------------


def _snap_origins(tree: KinematicTree, tolerance: float) -> tuple[KinematicTree, dict[str, float]]:
    """Snap roll, pitch and yaw of all joint origins.

    The second result is the angle (rad) by which the origin of each changed joint rotated.
    """
    joints, moved = list(tree.joints), dict[str, float]()
    for i, joint in enumerate(joints):
        T = np.array(joint.T_parent_joint)
        T[:3, :3] = _round_rotation(T[:3, :3], tolerance)
        angle = float(rotation_angle(T[:3, :3], joint.T_parent_joint[:3, :3]))
        if angle > 0.0:
            joints[i] = replace(joint, T_parent_joint=T)
        if angle > TURN * EPS:
            moved[joint.name] = angle
    return replace(tree, joints=tuple(joints)), moved


def _round_rotation(R: FloatArray, tolerance: float) -> FloatArray:
    """Factor R into Rz(yaw) Ry(pitch) Rx(roll), and snap each angle to a multiple of pi/12."""
    level = math.hypot(R[0, 0], R[1, 0])
    pitch = math.atan2(-R[2, 0], level)
    if level <= tolerance:  # Roll and yaw are about the same axis.
        roll, yaw = 0.0, math.atan2(-R[0, 1], R[1, 1])
    else:
        roll, yaw = math.atan2(R[2, 1], R[2, 2]), math.atan2(R[1, 0], R[0, 0])
    return _product(((2, yaw), (1, pitch), (0, roll)), tolerance)


def _snap_pose(A: FloatArray, tolerance: float) -> tuple[FloatArray, float]:
    """Factor the rotation of a pose into Rz(phi) Rx(tilt) Rz(psi), and snap each of the three angles.

    The position of the pose is unchanged. The result also contains the angle by which the rotation changed.
    """
    R = A[:3, :3]
    sine = math.hypot(R[0, 2], R[1, 2])
    tilt = math.atan2(sine, R[2, 2])
    if sine <= max(math.sin(tolerance), TURN * EPS):
        phi = 0.0
        psi = math.atan2(R[1, 0] - R[0, 1], R[0, 0] + R[1, 1])
        if R[2, 2] < 0.0:
            psi = -math.atan2(R[1, 0] + R[0, 1], R[0, 0] - R[1, 1])
    else:
        phi, psi = math.atan2(R[0, 2], -R[1, 2]), math.atan2(R[2, 0], R[2, 1])
    pose = np.array(A)
    pose[:3, :3] = _product(((2, phi), (0, tilt), (2, psi)), tolerance)
    angle = float(rotation_angle(pose[:3, :3], R))
    return pose, (angle if angle > TURN * EPS else 0.0)


def _product(turns: Sequence[tuple[int, float]], tolerance: float) -> FloatArray:
    """Multiply rotations about coordinate axes, with each angle snapped if it is within the tolerance."""
    R = np.eye(3)
    for axis, angle in turns:
        twelfth = nearest_twelfth(angle)
        is_round = abs(angle - twelfth) <= max(tolerance, TURN * EPS)
        turn = coordinate_rotation(axis, np.asarray(twelfth if is_round else angle))
        if is_round:
            turn[np.abs(turn) < EPS] = 0.0  # The computed cosine of a right angle is not 0.
        R = R @ turn
    return R


# -- bounds -----------------------------------------------------------------------------------------


def _changes_of_origins(
    steps: Sequence[tuple[Joint, bool]], moved: Mapping[str, float]
) -> list[tuple[int, SnapChange]]:
    """Return a change for each snapped origin; `lever` is the path length from it to the tip."""
    changes, lever, sliders = list[tuple[int, SnapChange]](), 0.0, list[str]()
    moving = sum(joint.kind.has_axis for joint, _ in steps)
    for joint, backwards in reversed(steps):
        offset = math.hypot(*joint.T_parent_joint[:3, 3])
        slides = joint.kind is JointKind.PRISMATIC
        lever += offset if backwards else 0.0
        sliders += [joint.name] if slides and not backwards else []
        if angle := moved.get(joint.name, 0.0):
            before = moving - (joint.kind.has_axis and not backwards)
            change = SnapChange(0, f"origin of {joint.name}", angle, lever, tuple(reversed(sliders)))
            changes.append((before, change))
        sliders += [joint.name] if slides and backwards else []
        lever += 0.0 if backwards else offset
        moving -= joint.kind.has_axis
    return changes[::-1]


def _change(exact: FrameChain, k: int, what: str, angle: float) -> SnapChange:
    """Return a change that rotates the rest of the chain about the origin of joint k.

    Joints are counted from 1; n + 1 is the tip. The attribute `lever` of the change is the largest possible
    distance from this origin to the tip.
    """
    sliders = tuple(joint.name for joint in exact.joints[max(k - 1, 0) :] if not joint.kind.turns)
    return SnapChange(0, what, angle, float(exact.lengths[k:].sum()), sliders)


def row_of_constant(table: DHTable, k: int) -> int:
    """Return the index of the row that contains the chain's constant A_k; -1 is the base, n is the tool."""
    n = len(table.rows)
    if k == 0:
        return -1
    if k == n:
        return n - 1 if np.array_equal(table.tool, np.eye(4)) else n
    return k - 1 if table.convention is DHConvention.STANDARD else k


#: A mimicked joint that is not on the path is assumed to be in this range (rad or metres).
UNKNOWN = (-1.0, 1.0)


def travel(limit: Limit | None) -> float:
    """Return the largest distance of a prismatic joint from zero (metres); one metre without limits."""
    return 1.0 if limit is None else max(abs(limit.lower), abs(limit.upper))


#: `noisy_cells` finds angles that differ by at most this number (rad) from a multiple of 15 degrees.
#: It finds lengths of at most this number times the table's span.
LARGEST = 1e-4
#: `snap_hint` tries these tolerances (rad) in ascending order.
TOLERANCES = (1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4)


def noisy_cells(table: DHTable) -> list[tuple[str, str, float]]:
    """Return (joint, cell, difference in rad or m) for each cell that nearly equals a round value.

    The round values are the multiples of 15 degrees for angles, and 0 for lengths. The cell with the smallest
    difference is first.
    """
    found = []
    for row in table.rows:
        for name, angle in (("alpha", row.alpha), ("theta", row.theta), ("beta", row.beta)):
            off = abs(angle - nearest_twelfth(angle))
            if ANGLE * EPS < off <= LARGEST:
                found.append((row.joint, name, off))
        for name, length in (("a", row.a), ("d", row.d)):
            if 0.0 < abs(length) <= LARGEST * table.span:
                found.append((row.joint, name, abs(length)))
    return sorted(found, key=lambda one: one[2])


def snap_hint(table: DHTable, snapped: Callable[[float], DHTable]) -> str | None:
    """Return a hint about cells that nearly equal a multiple of 15 degrees or zero, in one line of text.

    For example, an angle that the file rounds (1.5708) may cause a tilt of 5e-12 rad and offsets of about
    1e-12 m. They are larger than rounding errors of the computation, so the table contains them. The hint
    names one of these cells. It also recommends a tolerance from `TOLERANCES`: the tolerance after which the
    fewest cells nearly equal a round value. The result is None if no cell nearly equals a round value, or if
    no tolerance reduces the number of these cells. `snapped` takes a tolerance (rad), and returns the exact
    `table` with angles rounded to multiples of 15 degrees.
    """
    noisy = noisy_cells(table) if table.snap is None else []
    if not noisy:
        return None
    left = {tolerance: len(noisy_cells(snapped(tolerance))) for tolerance in TOLERANCES}
    best = min(TOLERANCES, key=lambda tolerance: left[tolerance])
    if left[best] >= len(noisy):
        return None
    joint, cell, size = noisy[0]
    unit = "m" if cell in ("a", "d") else "rad"
    many = f"{len(noisy)} cells look" if len(noisy) > 1 else "a cell looks"
    return (
        f"{many} like the effect of rounded angles in the file ({cell} of {joint}: {size:.2g} {unit}):"
        f" --snap {best:.0e} leaves {left[best] or 'none'} of them and reports the effect on the tip"
    )
