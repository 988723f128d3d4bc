"""Derive a Denavit-Hartenberg table from a chain of axes.

The derivation is one pass from base to tip. The page docs/dh.md explains the default choices.
`DerivationOptions` or a reference table can specify other choices.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from urdfkin.dh.common_normals import (
    NEARLY_PARALLEL,
    AxisTransform,
    PairWithReference,
    PoseTolerance,
    clean_length,
    find_axis_transform,
    match_axis_transforms,
    pose_tolerances,
    reference_or_clean_theta,
    shift_along_z,
    tilt_sine,
)
from urdfkin.dh.table import (
    DHConvention,
    DHRow,
    DHTable,
    angle_difference,
    as_a_and_alpha,
    clean_angle,
    is_identity,
    joint_transform,
    link_transform,
)
from urdfkin.errors import InputError
from urdfkin.errors.validators import as_str
from urdfkin.kinematics.roundings import ANGLE_ROUNDINGS, ENTRY_ROUNDINGS, EPS
from urdfkin.model.chain import FrameChain
from urdfkin.model.tree import FloatArray

#: Tolerance (rad) of a right angle.
#: The rounded angle 1.571 still counts as a right angle.
RIGHT_ANGLE_TOLERANCE = 1e-3

#: Two tables describe different robots if alpha, a or d differ by more than this number. Angles are in rad,
#: and lengths are relative to the reach. Cells are not compared if a different base, tool or prismatic axis
#: can compensate for their difference.
MAX_CELL_DIFFERENCE = 0.1

_OPTION_VALUES = {
    "near_parallel": ("hayati", "strict"),
    "last": ("tip", "flange"),
    "parallel_offset": ("last", "first", "each"),
    "first": ("base", "joint"),
    "sign": ("theta", "a", "alpha"),
    "slide": ("drawn", "minimal"),
}


@dataclass(frozen=True, slots=True)
class DerivationOptions:
    """Options of `urdfkin.dh.make.make_dh_table`."""

    convention: DHConvention = DHConvention.STANDARD
    near_parallel: str = "hayati"
    last: str = "tip"
    parallel_offset: str = "last"
    flip: tuple[str, ...] = ()
    first: str = "base"
    sign: str = "theta"
    slide: str = "drawn"

    def __post_init__(self) -> None:
        for name, values in _OPTION_VALUES.items():
            if (value := as_str(getattr(self, name), name)) not in values:
                remedy = f"write {' or '.join(map(repr, values))}"
                raise InputError(f"unknown value of `{name}`", found=repr(value), remedy=remedy)

    @property
    def hayati(self) -> bool:
        return self.near_parallel == "hayati"


def derive(chain: FrameChain, options: DerivationOptions, like: DHTable | None = None) -> DHTable:
    """Derive a table from a chain.

    `like` is a standard table of the same joints. With `like`, `options.sign` has no effect, and
    `options.parallel_offset` has an effect only if it is "first".
    """
    constants = _reverse_axes(chain, options.flip)
    reach = chain.reach + float(np.linalg.norm(constants[0][:3, 3]))
    if not chain.joints:
        return _make_table(chain, options, [], [], constants[0], np.eye(4))
    first, *between, end = pose_tolerances(chain, reach)
    _place_prismatic_axes(chain, constants, options, reach)
    base, phi_in, delta_in = _find_frame_zero(constants[0], reach, first)
    if like is None:
        steps, thetas = _find_transforms_and_thetas(
            constants[1:-1], phi_in, delta_in, reach, options, between
        )
    else:
        pairs = [
            PairWithReference(A, row, reach, noise, options.hayati)
            for A, row, noise in zip(constants[1:-1], like.rows[:-1], between, strict=True)
        ]
        tip = _offset_for_last_row(like, constants[-1], options, end)
        steps, thetas = match_axis_transforms(pairs, phi_in, delta_in, tip)
        if not like.rows[0].d and _has_wrong_offset(steps, like, chain.reach):
            # The offset along the first axis is then a part of the base.
            steps, thetas = match_axis_transforms(pairs, phi_in, delta_in, tip, keeps_first_d=False)
    if steps:
        phi_in, delta_in = steps[-1].phi_next, steps[-1].delta_next
    rows = [(theta, step.delta) for theta, step in zip(thetas, steps, strict=True)]
    theta, d, last, tool = _make_last_row(
        shift_along_z(constants[-1], delta_in), phi_in, delta_in, reach, options, end
    )
    if like is not None:
        theta, d, last, tool = _match_last_row(like, theta, d, last, tool)
    rows.append((theta, d))
    if like is not None:
        base, rows[0] = _match_first_row(like.rows[0], base, rows[0])
    if options.parallel_offset == "first":
        rows = _sum_offsets_in_first_row(rows, steps)
    if options.first == "joint":
        base, rows[0] = base @ joint_transform(*rows[0]), (0.0, 0.0)
        _clean_rotation(base)
    return _make_table(chain, options, rows, [*steps, last], base, tool)


def _make_table(
    chain: FrameChain,
    options: DerivationOptions,
    theta_and_d: list[tuple[float, float]],
    steps: list[AxisTransform],
    base: FloatArray,
    tool: FloatArray,
) -> DHTable:
    if options.convention is DHConvention.MODIFIED and steps:
        if first := as_a_and_alpha(base):
            base = np.eye(4)
        a, alpha = first or (0.0, 0.0)
        steps = [AxisTransform(a=a, alpha=alpha), *steps[:-1]]
    rows = []
    for joint, (own_theta, own_d), step in zip(chain.joints, theta_and_d, steps, strict=True):
        # Adding 0.0 converts -0.0 to 0.0.
        a, alpha, d, theta, beta = (x + 0.0 for x in (step.a, step.alpha, own_d, own_theta, step.beta))
        sense = -1 if joint.name in options.flip else 1
        rows.append(DHRow(a, alpha, d, theta, joint.kind, joint.name, sense, beta, joint.mimic, joint.limit))
    return DHTable(options.convention, tuple(rows), base, tool, chain.robot, chain.base, chain.tip)


# -- before the pass -----------------------------------------------------------------------------------


def _reverse_axes(chain: FrameChain, flip: Collection[str]) -> list[FloatArray]:
    constants = [np.array(A) for A in chain.constants]
    half_turn = np.diag([1.0, -1.0, -1.0, 1.0])
    for i, joint in enumerate(chain.joints):
        if joint.name in flip:
            constants[i] = constants[i] @ half_turn
            constants[i + 1] = half_turn @ constants[i + 1]
    return constants


def _place_prismatic_axes(
    chain: FrameChain, constants: list[FloatArray], options: DerivationOptions, reach: float
) -> None:
    """Shift the axes of prismatic joints, because such a joint determines only the direction of its axis."""
    is_prismatic = [not joint.kind.turns for joint in chain.joints]
    prismatic = [k for k, slides in enumerate(is_prismatic) if slides]
    noise = pose_tolerances(chain, reach)
    shifted = set[int]()
    if options.slide == "minimal":
        shifted |= {k for k in prismatic if _shift_to_revolute_joint(constants, k, is_prismatic)}
    if not options.hayati:
        shifted |= {k for k in prismatic if k not in shifted and _shift_to_parallel_axis(constants, k, noise)}
    if 0 in prismatic and 0 not in shifted:
        _shift_to_previous_origin(constants, 0)
        shifted.add(0)
    last, tip = len(is_prismatic) - 1, constants[-1]
    shift_avoids_tool = options.last == "tip" and abs(tip[2, 0]) <= noise[-1].radians
    has_tool = not _fits_last_row(tip, options, noise[-1])
    if last in prismatic and last not in shifted and shift_avoids_tool and has_tool:
        _shift(constants, last, np.array([tip[0, 3], tip[1, 3], 0.0]))


def _shift_to_revolute_joint(constants: list[FloatArray], k: int, is_prismatic: list[bool]) -> bool:
    if k + 1 < len(is_prismatic) and not is_prismatic[k + 1]:
        _shift(constants, k, constants[k + 1][:3, 3].copy())
        return True
    if k > 0 and not is_prismatic[k - 1]:
        _shift_to_previous_origin(constants, k)
        return True
    return False


def _shift_to_parallel_axis(constants: list[FloatArray], k: int, noise: list[PoseTolerance]) -> bool:
    """Shift the axis of the prismatic joint k to the origin of a neighbour with a nearly parallel axis.

    Without the shift, the common normal of the two axes could be far away from the robot.
    """
    if k > 0 and noise[k].radians < tilt_sine(constants[k]) < NEARLY_PARALLEL:
        _shift_to_previous_origin(constants, k)
        return True
    if k + 2 < len(noise) and noise[k + 1].radians < tilt_sine(constants[k + 1]) < NEARLY_PARALLEL:
        _shift(constants, k, constants[k + 1][:3, 3].copy())
        return True
    return False


def _shift_to_previous_origin(constants: list[FloatArray], k: int) -> None:
    constants[k + 1][:3, 3] += constants[k][:3, :3].T @ constants[k][:3, 3]
    constants[k][:3, 3] = 0.0


def _shift(constants: list[FloatArray], k: int, offset: FloatArray) -> None:
    """Shift the frame of joint k by `offset`, a vector (m) in this frame."""
    constants[k][:3, 3] += constants[k][:3, :3] @ offset
    constants[k + 1][:3, 3] -= offset


# -- the pass ------------------------------------------------------------------------------------------


def _find_frame_zero(A: FloatArray, reach: float, noise: PoseTolerance) -> tuple[FloatArray, float, float]:
    """Return T_base_0, phi (rad) and delta (m); Rz(phi) Tz(delta) leads from frame 0 to joint 1."""
    z, p = A[:3, 2], A[:3, 3]
    offset = clean_length(float(z @ p), reach, noise.metres)
    base = np.eye(4)
    base[:3, 3] = p - offset * z
    if tilt_sine(A) <= noise.radians:
        z = np.array([0.0, 0.0, math.copysign(1.0, z[2])])
    # The projection of the base's x axis e onto the plane normal to z is x = e - (e . z) z. The expression
    # below equals x, and has no cancellation if z is close to e.
    x = np.array([z[1] ** 2 + z[2] ** 2, -z[0] * z[1], -z[0] * z[2]])
    # If z is nearly along the base's x axis, x is the projection of the base's y axis.
    if np.linalg.norm(x) < NEARLY_PARALLEL:
        x = np.array([0.0, 1.0, 0.0]) - z[1] * z
    x /= np.linalg.norm(x)
    base[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    _clean_pose(base, reach, noise.metres)
    turn = math.atan2(A[:3, 0] @ base[:3, 1], A[:3, 0] @ base[:3, 0])
    return base, clean_angle(turn), offset


def _clean_rotation(T: FloatArray) -> None:
    R = T[:3, :3]
    R[np.abs(R) <= ENTRY_ROUNDINGS * EPS] = 0.0


def _clean_pose(T: FloatArray, reach: float, noise: float = 0.0) -> None:
    _clean_rotation(T)
    T[:3, 3] = [clean_length(component, reach, noise) for component in T[:3, 3]]


def _find_transforms_and_thetas(
    constants: Sequence[FloatArray],
    phi_in: float,
    delta_in: float,
    reach: float,
    options: DerivationOptions,
    noise: Sequence[PoseTolerance],
) -> tuple[list[AxisTransform], list[float]]:
    # For "first" and "each", row i contains the offset from axis i to a parallel axis i + 1. For "first",
    # `_sum_offsets_in_first_row` later adds up these offsets in one row.
    each = options.parallel_offset != "last"
    steps, thetas = list[AxisTransform](), list[float]()
    for A, rounding in zip(constants, noise, strict=True):
        step = find_axis_transform(
            shift_along_z(A, delta_in),
            reach,
            -phi_in,
            hayati=options.hayati,
            offset_in_delta=each,
            noise=rounding,
        )
        theta = clean_angle(phi_in + step.phi)
        if _needs_reversal(step, theta, options.sign):
            step = step.with_reversed_x()
            theta = clean_angle(phi_in + step.phi)
        steps.append(step)
        thetas.append(theta)
        phi_in, delta_in = step.phi_next, step.delta_next
    return steps, thetas


def _has_wrong_offset(steps: Sequence[AxisTransform], like: DHTable, reach: float) -> bool:
    return any(
        row.kind.turns and abs(step.delta - row.d) > MAX_CELL_DIFFERENCE * reach
        for step, row in zip(steps[1:], like.rows[1:], strict=False)
    )


def _offset_for_last_row(
    like: DHTable, A: FloatArray, options: DerivationOptions, noise: PoseTolerance
) -> float | None:
    """Return the argument `tip_offset` of `match_axis_transforms`."""
    row = like.rows[-1]
    if not row.kind.turns or not _has_no_tool(like) or not _fits_last_row(A, options, noise):
        return None
    return float(row.d - A[2, 3])


def _has_no_tool(table: DHTable) -> bool:
    return bool(np.abs(table.tool - np.eye(4)).max() < 1e-6)


def _match_first_row(
    row: DHRow, base: FloatArray, first: tuple[float, float]
) -> tuple[FloatArray, tuple[float, float]]:
    """Copy theta and a zero d from the reference, and adjust the base."""
    theta, d = first
    angle, offset = angle_difference(theta, row.theta), 0.0 if row.d else d
    if abs(angle) > ANGLE_ROUNDINGS * EPS or offset:
        base = base @ joint_transform(angle, offset)
        _clean_rotation(base)
    return base, (row.theta, d - offset)


def _match_last_row(
    like: DHTable, theta: float, d: float, last: AxisTransform, tool: FloatArray
) -> tuple[float, float, AxisTransform, FloatArray]:
    """Copy theta, a, alpha and a zero d from the reference, and adjust the tool.

    Nothing is copied if both tables have no tool and nearly equal thetas.
    """
    row = like.rows[-1]
    no_tools = _has_no_tool(like) and is_identity(tool)
    if no_tools and abs(angle_difference(theta, row.theta)) < RIGHT_ANGLE_TOLERANCE:
        return reference_or_clean_theta(theta, row.theta), d, last, tool
    offset = d if row.d else 0.0
    T_tip = joint_transform(theta, d) @ link_transform(last.a, last.alpha) @ tool
    tool = np.linalg.inv(joint_transform(row.theta, offset) @ link_transform(row.a, row.alpha)) @ T_tip
    _clean_pose(tool, like.span or 1.0)
    if np.abs(tool - np.eye(4)).max() <= ANGLE_ROUNDINGS * EPS:
        tool = np.eye(4)
    return row.theta, offset, AxisTransform(a=row.a, alpha=row.alpha), tool


def _needs_reversal(step: AxisTransform, theta: float, sign: str) -> bool:
    by_alpha = 0.0 if step.alpha == math.pi else step.alpha
    if sign == "theta" or (not step.a and not by_alpha):
        return abs(theta) > math.pi / 2.0 + RIGHT_ANGLE_TOLERANCE
    return (step.a or by_alpha) < 0.0 if sign == "a" else (by_alpha or step.a) < 0.0


def _fits_last_row(A: FloatArray, options: DerivationOptions, noise: PoseTolerance) -> bool:
    """Return whether the last row can contain A, so that the table needs no tool.

    A must have the form Rz Tz Tx Rx in a standard table, or Rz Tz in a modified table.
    """
    if options.last == "flange":
        return False
    x_along_z, lateral = abs(A[2, 0]), abs(A[0, 0] * A[1, 3] - A[1, 0] * A[0, 3])
    if options.convention is DHConvention.MODIFIED:
        aside = math.hypot(A[0, 3], A[1, 3])
        return tilt_sine(A) <= noise.radians and A[2, 2] > 0.0 and aside <= 2.0 * noise.metres
    return bool(x_along_z <= noise.radians and lateral <= 2.0 * noise.metres)


def _make_last_row(
    A: FloatArray,
    phi_in: float,
    delta_in: float,
    reach: float,
    options: DerivationOptions,
    noise: PoseTolerance,
) -> tuple[float, float, AxisTransform, FloatArray]:
    """Compute theta, d, a and alpha of the last row, and the tool.

    `A` is the tip's pose in a frame at O_{n-1} with the axes of the last joint's frame.
    """
    if _fits_last_row(A, options, noise):
        phi = math.atan2(A[1, 0], A[0, 0])
        a = clean_length(A[0, 0] * A[0, 3] + A[1, 0] * A[1, 3], reach, noise.metres)
        alpha = clean_angle(math.atan2(A[2, 1], A[2, 2]))
        step = AxisTransform(a=a, alpha=alpha)
        return clean_angle(phi_in + phi), clean_length(A[2, 3], reach, noise.metres), step, np.eye(4)
    d = clean_length(delta_in if options.last == "flange" else A[2, 3], reach, noise.metres)
    tool = A.copy()
    tool[2, 3] -= d
    if phi_in:
        Rz = np.eye(4)
        Rz[:2, :2] = [[math.cos(phi_in), -math.sin(phi_in)], [math.sin(phi_in), math.cos(phi_in)]]
        tool = Rz @ tool
    _clean_pose(tool, reach, noise.metres)
    return 0.0, d, AxisTransform(), tool


def _sum_offsets_in_first_row(
    rows: list[tuple[float, float]], steps: list[AxisTransform]
) -> list[tuple[float, float]]:
    rows = list(rows)
    for i in range(len(steps) - 1, -1, -1):
        if steps[i].beta == 0.0 and steps[i].alpha in (0.0, math.pi):
            sign = 1.0 if steps[i].alpha == 0.0 else -1.0
            (theta, d), (next_theta, next_d) = rows[i], rows[i + 1]
            rows[i], rows[i + 1] = (theta, d + sign * next_d), (next_theta, 0.0)
    return rows
