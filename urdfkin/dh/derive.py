"""Derive a Denavit-Hartenberg table from a chain of axes, in one pass from base to tip.

The derivation makes these choices; docs/dh.md gives the reasons:

- The origin of frame 0 is the point of the first axis that is closest to the base's origin. x_0 is the
  projection of the base's x axis.
- x_i is along the common normal. The direction of x_i is reversed if theta would exceed a right angle.
- Between parallel axes d = 0. The row of the last parallel axis contains the whole offset along these axes.
- The last row reaches the tip if four parameters suffice.
- A prismatic axis is on the line through the joint's origin in the URDF, except for the first and the last
  joint.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeVar

import numpy as np

from urdfkin.dh.common_normals import (
    NEARLY_PARALLEL,
    AxisTransform,
    NearParallel,
    PairLike,
    PoseTolerance,
    cleaned_angle,
    cleaned_length,
    lifted,
    near,
    noises,
    step_between,
    steps_like,
    tilt_of,
)
from urdfkin.dh.table import DHConvention, DHRow, DHTable, along_axis, as_step, between_axes
from urdfkin.errors import InputError
from urdfkin.kinematics.roundings import ANGLE, ENTRY, EPS
from urdfkin.model.chain import ChainJoint, FrameChain
from urdfkin.model.tree import FloatArray

#: x is reversed if |theta| exceeds a right angle by more than this (rad).
#: The angles 1.5708 and 1.571 do not exceed this limit.
RIGHT_ANGLE_SLACK = 1e-3


class Last(StrEnum):
    """Whether the last row ends at the tip (if four parameters suffice) or at the flange."""

    TIP = "tip"
    FLANGE = "flange"


class First(StrEnum):
    """Where the transform from the base to the first joint is: in the cells d_1 and theta_1, or in `base`."""

    BASE = "base"
    JOINT = "joint"


class Sign(StrEnum):
    """Cell that determines the direction of x.

    With THETA, |theta| is at most a right angle. With A, the cell a is not negative. With ALPHA, the cell
    alpha is not negative.
    """

    THETA = "theta"
    A = "a"
    ALPHA = "alpha"


class Slide(StrEnum):
    """Position of a prismatic axis: at the joint's origin, or at the origin of a neighbouring joint."""

    DRAWN = "drawn"
    MINIMAL = "minimal"


class ParallelOffset(StrEnum):
    """For consecutive parallel axes: the row that contains the offset along these axes."""

    LAST = "last"
    FIRST = "first"
    EACH = "each"


@dataclass(frozen=True, slots=True)
class Choices:
    convention: DHConvention = DHConvention.STANDARD
    near_parallel: NearParallel = NearParallel.HAYATI
    last: Last = Last.TIP
    parallel_offset: ParallelOffset = ParallelOffset.LAST
    flip: tuple[str, ...] = ()
    first: First = First.BASE
    sign: Sign = Sign.THETA
    slide: Slide = Slide.DRAWN


_Choice = TypeVar("_Choice", bound=StrEnum)


def choice(kind: type[_Choice], name: str, value: str) -> _Choice:
    try:
        return kind(value)
    except ValueError:
        known = " or ".join(repr(member.value) for member in kind)
        raise InputError(f"unknown value of `{name}`", found=repr(value), remedy=f"write {known}") from None


def derive(chain: FrameChain, choices: Choices, like: DHTable | None = None) -> DHTable:
    """Return the table of a chain.

    The product base . rows . tool equals the pose of the chain's tip for every q, except for rounding. `like`
    is a standard table of the same joints. The result has the same directions of x, the same offsets along
    parallel axes, and the same zero positions of the first and the last joint. If `like` and `choices`
    contradict each other, `like` is used.
    """
    constants = _reversed_axes(chain, choices.flip)
    reach = chain.reach + float(np.linalg.norm(constants[0][:3, 3]))
    if not chain.joints:
        return _table(chain, choices, [], [], (constants[0], np.eye(4)))
    first, *between, end = noises(chain, reach)
    _use_freedom_of_prismatic_axes(chain, constants, choices, reach)
    base, phi_in, carry = _frame_zero(constants[0], reach, first)
    if like is None:
        steps, thetas = _steps(constants[1:-1], phi_in, carry, reach, choices, between)
    else:
        pairs = [
            PairLike(A, row, reach, noise, choices.near_parallel)
            for A, row, noise in zip(constants[1:-1], like.rows[:-1], between, strict=True)
        ]
        tip = _offset_for_last_row(like, constants[-1], choices, end)
        steps, thetas = steps_like(pairs, phi_in, carry, tip)
    if steps:
        phi_in, carry = steps[-1].phi_next, steps[-1].delta_next
    rows = [(theta, step.delta) for theta, step in zip(thetas, steps, strict=True)]
    theta, d, last, tool = _last(lifted(constants[-1], carry), phi_in, carry, reach, choices, end)
    if like is not None:
        theta, d, last, tool = _last_like(like, theta, d, last, tool)
    rows.append((theta, d))
    if like is not None:
        base, rows[0] = _first_like(like.rows[0], base, rows[0])
    if choices.parallel_offset is ParallelOffset.FIRST:
        rows = _offsets_first(rows, steps)
    if choices.first is First.JOINT:
        base, rows[0] = base @ along_axis(*rows[0]), (0.0, 0.0)
        _clean_rotation(base)
    return _table(chain, choices, rows, [*steps, last], (base, tool))


def _table(
    chain: FrameChain,
    choices: Choices,
    turns: list[tuple[float, float]],
    steps: list[AxisTransform],
    ends: tuple[FloatArray, FloatArray],
) -> DHTable:
    if choices.convention is DHConvention.MODIFIED and turns:
        first = as_step(ends[0])
        a, alpha = first or (0.0, 0.0)
        ends = (np.eye(4) if first else ends[0], ends[1])
        steps = [AxisTransform(0.0, 0.0, a, alpha, 0.0, 0.0, 0.0), *steps[:-1]]
    rows = [
        _row(joint, turn, step, -1 if joint.name in choices.flip else 1)
        for joint, turn, step in zip(chain.joints, turns, steps, strict=True)
    ]
    return DHTable(choices.convention, tuple(rows), *ends, chain.robot, chain.base, chain.tip)


def _row(joint: ChainJoint, turn: tuple[float, float], step: AxisTransform, sense: int) -> DHRow:
    theta, d = turn
    # The sum with 0.0 makes a negative zero positive.
    a, alpha, d, theta, beta = (x + 0.0 for x in (step.a, step.alpha, d, theta, step.beta))
    return DHRow(a, alpha, d, theta, joint.kind, joint.name, sense, beta, joint.mimic, joint.limit)


# -- before the pass -----------------------------------------------------------------------------------


def _reversed_axes(chain: FrameChain, flip: Collection[str]) -> list[FloatArray]:
    """Return the chain's constant poses, with the z axes of some joints reversed by a half turn about x."""
    constants = [np.array(A) for A in chain.constants]
    half = np.diag([1.0, -1.0, -1.0, 1.0])
    for i, joint in enumerate(chain.joints):
        if joint.name in flip:
            constants[i] = constants[i] @ half
            constants[i + 1] = half @ constants[i + 1]
    return constants


def _use_freedom_of_prismatic_axes(
    chain: FrameChain, constants: list[FloatArray], choices: Choices, reach: float
) -> None:
    """Choose the axis lines of prismatic joints; a prismatic joint defines only the direction of its axis.

    A prismatic motion commutes with every translation. Therefore, the axis line of a prismatic joint can be
    shifted without a change of the tip's poses. If the first joint is prismatic, its axis line passes through
    the base's origin, so that the base can be the identity. If the last joint is prismatic, its axis line
    passes through the tip, unless the table needs a tool anyway. In a table without Hayati rows, a prismatic
    axis that is nearly parallel to a neighbouring axis is shifted to the origin of the neighbouring joint.
    Otherwise, the common normal would be far from the robot.
    """
    slides = [not joint.kind.turns for joint in chain.joints]
    noise = noises(chain, reach)
    n = len(slides)
    minimal = choices.slide is Slide.MINIMAL
    moved = [slides[k] and minimal and _onto_neighbour(constants, k, slides) for k in range(n)]
    strict = choices.near_parallel is NearParallel.STRICT
    moved = [moved[k] or (slides[k] and strict and _meets_neighbour(constants, k, noise)) for k in range(n)]
    if slides[0] and not moved[0]:
        _shift_after(constants, 0, constants[0][:3, :3].T @ constants[0][:3, 3])
        moved[0] = True
    if slides[-1] and not moved[-1] and choices.last is Last.TIP:
        tip = constants[-1]
        if not _representable(tip, choices, noise[-1]) and abs(tip[2, 0]) <= noise[-1].radians:
            _shift_before(constants, n - 1, np.array([tip[0, 3], tip[1, 3], 0.0]))


def _onto_neighbour(constants: list[FloatArray], k: int, slides: list[bool]) -> bool:
    """Shift joint k's line so that it contains the origin of a neighbouring revolute joint; then a = 0.

    If both neighbouring joints are revolute, the line passes through the origin of the next joint.
    """
    if k + 1 < len(slides) and not slides[k + 1]:
        _shift_before(constants, k, constants[k + 1][:3, 3].copy())
        return True
    if k > 0 and not slides[k - 1]:
        _shift_after(constants, k, constants[k][:3, :3].T @ constants[k][:3, 3])
        return True
    return False


def _meets_neighbour(constants: list[FloatArray], k: int, noise: list[PoseTolerance]) -> bool:
    """Move joint k's line to the origin of a neighbouring joint if the two axes are nearly parallel."""
    before, after = constants[k], constants[k + 1]
    if k > 0 and noise[k].radians < tilt_of(before) < NEARLY_PARALLEL:
        _shift_after(constants, k, before[:3, :3].T @ before[:3, 3])
        return True
    if k + 2 < len(noise) and noise[k + 1].radians < tilt_of(after) < NEARLY_PARALLEL:
        _shift_before(constants, k, after[:3, 3].copy())
        return True
    return False


def _shift_after(constants: list[FloatArray], k: int, offset: FloatArray) -> None:
    """Shift the frame of joint k to the origin of the previous frame.

    `offset` is the vector from the new origin to the old origin, with components in the frame of joint k.
    """
    constants[k][:3, 3] = 0.0
    constants[k + 1][:3, 3] += offset


def _shift_before(constants: list[FloatArray], k: int, offset: FloatArray) -> None:
    """Shift the frame of joint k by `offset`, a vector with components in this frame."""
    constants[k][:3, 3] += constants[k][:3, :3] @ offset
    constants[k + 1][:3, 3] -= offset


# -- the pass ------------------------------------------------------------------------------------------


def _frame_zero(A: FloatArray, reach: float, noise: PoseTolerance) -> tuple[FloatArray, float, float]:
    """Return T_base_0; also the angle about z_0, and the offset along z_0, from frame 0 to joint 1."""
    z, p = A[:3, 2], A[:3, 3]
    offset = cleaned_length(float(z @ p), reach, noise.metres)
    base = np.eye(4)
    base[:3, 3] = [cleaned_length(component, reach, noise.metres) for component in p - offset * z]
    if tilt_of(A) <= noise.radians:  # z_0 is parallel or opposite to the base's z axis
        z = np.array([0.0, 0.0, math.copysign(1.0, z[2])])
    # This formula for x - (x . z) z with unit vectors avoids cancellation for z close to x.
    x = np.array([z[1] ** 2 + z[2] ** 2, -z[0] * z[1], -z[0] * z[2]])
    if np.linalg.norm(x) < NEARLY_PARALLEL:  # z_0 is along the base's x axis.
        x = np.array([0.0, 1.0, 0.0]) - z[1] * z
    x /= np.linalg.norm(x)
    base[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    _clean_rotation(base)
    turn = math.atan2(A[:3, 0] @ base[:3, 1], A[:3, 0] @ base[:3, 0])
    return base, cleaned_angle(turn), offset


def _clean_rotation(T: FloatArray) -> None:
    R = T[:3, :3]
    R[np.abs(R) <= ENTRY * EPS] = 0.0


def _steps(
    constants: Sequence[FloatArray],
    phi_in: float,
    carry: float,
    reach: float,
    choices: Choices,
    noise: Sequence[PoseTolerance],
) -> tuple[list[AxisTransform], list[float]]:
    """Return the transforms between consecutive axes, and theta of each row."""
    each = choices.parallel_offset is not ParallelOffset.LAST
    steps, thetas = list[AxisTransform](), list[float]()
    for A, rounding in zip(constants, noise, strict=True):
        step = step_between(lifted(A, carry), reach, choices.near_parallel, -phi_in, each, rounding)
        theta = cleaned_angle(phi_in + step.phi)
        if _needs_reversal(step, theta, choices.sign):
            step = step.turned()
            theta = cleaned_angle(phi_in + step.phi)
        steps.append(step)
        thetas.append(theta)
        phi_in, carry = step.phi_next, step.delta_next
    return steps, thetas


def _offset_for_last_row(
    like: DHTable, A: FloatArray, choices: Choices, noise: PoseTolerance
) -> float | None:
    """Return the offset (metres) before the last row with which d of this row is equal in the two tables.

    The result is None if d cannot be equal, for example because the other table has a tool.
    """
    row = like.rows[-1]
    if not row.kind.turns or not _has_no_tool(like) or not _representable(A, choices, noise):
        return None
    return float(row.d - A[2, 3])


def _has_no_tool(table: DHTable) -> bool:
    return bool(np.abs(table.tool - np.eye(4)).max() < 1e-6)


def _first_like(
    row: DHRow, base: FloatArray, first: tuple[float, float]
) -> tuple[FloatArray, tuple[float, float]]:
    """Copy theta of the first row from the other table; if d is 0 in the other table, copy d too.

    The remaining rotation and the remaining offset become part of the base.
    """
    theta, d = first
    rest = (math.remainder(theta - row.theta, 2.0 * math.pi), 0.0 if row.d else d)
    if abs(rest[0]) > ANGLE * EPS or rest[1]:
        base = base @ along_axis(*rest)
        _clean_rotation(base)
    return base, (row.theta, d - rest[1])


def _last_like(
    like: DHTable, theta: float, d: float, last: AxisTransform, tool: FloatArray
) -> tuple[float, float, AxisTransform, FloatArray]:
    """Return the numbers of the last row, and the tool.

    If theta of the last row is equal in the two tables, and neither table has a tool, the numbers are
    unchanged. Otherwise, the function copies theta, a and alpha from the other table, and the tool contains
    the difference.
    """
    row = like.rows[-1]
    as_there = _has_no_tool(like) and np.array_equal(tool, np.eye(4))
    if as_there and abs(math.remainder(theta - row.theta, 2.0 * math.pi)) < RIGHT_ANGLE_SLACK:
        return near(theta, row.theta), d, last, tool
    height = d if row.d else 0.0
    rest = along_axis(theta, d) @ between_axes(last.a, last.alpha) @ tool
    tool = np.linalg.inv(along_axis(row.theta, height) @ between_axes(row.a, row.alpha)) @ rest
    _clean_rotation(tool)
    tool[:3, 3] = [cleaned_length(float(x), like.span or 1.0) for x in tool[:3, 3]]
    if np.abs(tool - np.eye(4)).max() <= ANGLE * EPS:
        tool = np.eye(4)
    return row.theta, height, AxisTransform(0.0, 0.0, row.a, row.alpha, 0.0, 0.0, 0.0), tool


def _needs_reversal(step: AxisTransform, theta: float, sign: Sign) -> bool:
    """Whether the rule `sign` requires the opposite direction of x.

    With the rule "a", the cell a must be 0 or positive; if a is 0, then alpha must be 0 or positive. With the
    rule "alpha", the cell alpha must be 0 or positive; if alpha is 0 or pi, then a must be 0 or positive.
    """
    by_alpha = 0.0 if step.alpha == math.pi else step.alpha
    if sign is Sign.THETA or (not step.a and not by_alpha):
        return abs(theta) > math.pi / 2.0 + RIGHT_ANGLE_SLACK
    return (step.a or by_alpha) < 0.0 if sign is Sign.A else (by_alpha or step.a) < 0.0


def _representable(A: FloatArray, choices: Choices, noise: PoseTolerance) -> bool:
    """Whether A is a product Rz Tz Tx Rx (standard) or Rz Tz (modified), so that no tool is needed."""
    if choices.last is Last.FLANGE:
        return False
    x_along_z, lateral = abs(A[2, 0]), abs(A[0, 0] * A[1, 3] - A[1, 0] * A[0, 3])
    if choices.convention is DHConvention.MODIFIED:
        aside = math.hypot(A[0, 3], A[1, 3])
        return tilt_of(A) <= noise.radians and A[2, 2] > 0.0 and aside <= 2.0 * noise.metres
    return bool(x_along_z <= noise.radians and lateral <= 2.0 * noise.metres)


def _last(
    A: FloatArray, phi_in: float, carry: float, reach: float, choices: Choices, noise: PoseTolerance
) -> tuple[float, float, AxisTransform, FloatArray]:
    """Return theta and d of the last row, the `AxisTransform` with its other cells, and the tool.

    `A` is the tip's pose in the last joint's frame, shifted along z to the origin O_{n-1}.
    """
    if _representable(A, choices, noise):
        phi = math.atan2(A[1, 0], A[0, 0])
        a = cleaned_length(A[0, 0] * A[0, 3] + A[1, 0] * A[1, 3], reach, noise.metres)
        alpha = cleaned_angle(math.atan2(A[2, 1], A[2, 2]))
        step = AxisTransform(phi, 0.0, a, alpha, 0.0, 0.0, 0.0)
        return cleaned_angle(phi_in + phi), cleaned_length(A[2, 3], reach, noise.metres), step, np.eye(4)
    d = cleaned_length(carry if choices.last is Last.FLANGE else A[2, 3], reach, noise.metres)
    tool = A.copy()
    tool[2, 3] -= d
    if phi_in:
        turn = between_axes(0.0, 0.0)
        turn[:2, :2] = [[math.cos(phi_in), -math.sin(phi_in)], [math.sin(phi_in), math.cos(phi_in)]]
        tool = turn @ tool
    _clean_rotation(tool)
    tool[:3, 3] = [cleaned_length(component, reach, noise.metres) for component in tool[:3, 3]]
    return 0.0, d, AxisTransform(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), tool


def _offsets_first(rows: list[tuple[float, float]], steps: list[AxisTransform]) -> list[tuple[float, float]]:
    """Add the offsets along consecutive parallel axes, and write the sum into the first row of these axes.

    The offset along the second of two axes is added if alpha = 0, and subtracted if alpha = pi.
    """
    moved = list(rows)
    for i in range(len(steps) - 1, -1, -1):
        if steps[i].beta == 0.0 and steps[i].alpha in (0.0, math.pi):
            sign = 1.0 if steps[i].alpha == 0.0 else -1.0
            moved[i] = (moved[i][0], moved[i][1] + sign * moved[i + 1][1])
            moved[i + 1] = (moved[i + 1][0], 0.0)
    return moved
