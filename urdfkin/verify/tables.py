"""Compare a Denavit-Hartenberg table with Pinocchio: placement, Jacobian and acceleration of the tip.

A table computes the tip t relative to the table's base b. Pinocchio computes t and b in the world. The base
may move too, for example in a chain from the left foot to the right hand. Let R, w, v, alpha and a be the
motion of b and of t in the world, and r = p_t - p_b:

    w    = R_b^T (w_t - w_b)
    vel  = R_b^T (v_t - v_b - w_b x r)
    alpha= R_b^T (alpha_t - alpha_b - w_b x (w_t - w_b))
    acc  = R_b^T (a_t - a_b - alpha_b x r - w_b x (w_b x r) - 2 w_b x (v_t - v_b - w_b x r))

These equations are eq. 7.124 and 7.125, solved for the motion relative to the moving frame. This module
implements the equations again, because the table's results come from `urdfkin.kinematics.equations`.

*Bound.* The bound is the sum of the rounding errors of urdfkin and of Pinocchio. If snapping has rounded
angles of the table to multiples of 15 degrees, the bound includes this change. The bound on linear rows grows
with a length L:

    reach = (path length from the root to the base) + (path length from the root to the tip)
    prismatic displacements: included in both path lengths
    S = sum of all lengths in the table
    S <= reach:  L = reach
    S > reach:  L = min(S, MAX_LENGTH_RATIO * reach)
    Hayati rows: no length in the table exceeds MAX_LENGTH_RATIO * reach (docs/dh.md)

*Mimic joints.* A coordinate and its mimic joints move together. The bound on a Jacobian column is therefore
proportional to the sum of the absolute multipliers of these joints.

*Loss.* Without a Hayati row, nearly parallel axes can require lengths of kilometres in the table. If two of
these lengths cancel, the tip has an error of eps times the lengths. urdfkin accepts this error, and
`TableCheck.loss` states it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from urdfkin.dh.common_normals import sum_zeroed_tilts
from urdfkin.dh.motion import acceleration, jacobian
from urdfkin.dh.snapping import MAX_SNAP_TOLERANCE, rotation_angle
from urdfkin.dh.table import DHTable
from urdfkin.errors import RangeError, UrdfkinError
from urdfkin.kinematics.roundings import EPS, MIN_DIVISOR, joint_roundings, table_roundings
from urdfkin.model.chain import make_chain
from urdfkin.model.configuration import Samples
from urdfkin.model.tree import FloatArray, KinematicTree
from urdfkin.verify.oracle import Oracle, QueryBatch

#: Largest ratio of the length L to the reach (see the module).
MAX_LENGTH_RATIO = 10.0
#: Largest rounding error (rad) of a joint's angle without a warning.
_MAX_ANGLE_ROUNDING = 1e-5


class TableError(UrdfkinError):
    """The difference between a table and Pinocchio exceeds the bound.

    The bound covers rounding errors and the effect of the option `--snap`.

    >>> import urdfkin
    >>> issubclass(urdfkin.TableError, urdfkin.UrdfkinError)
    True
    """

    is_disagreement = True


@dataclass(frozen=True, slots=True)
class TableCheck:
    """Result of a table's check.

    Each number is the largest value over all samples.
    The keys of both dictionaries are "placement", "jacobian" and "acceleration".

    Attributes:
        metres: Distance between the tips, m.
        radians: Angle between the orientations, rad.
        units: Differences in multiples of eps * scale. The scale of the angle between orientations is 1.
        bound_ratios: Ratios of difference to bound.
        has_snapping: Whether the bound includes snapping.
        loss: Sentence about a very large length that causes a difference, or None.
    """

    samples: int
    metres: float
    radians: float
    units: dict[str, float]
    bound_ratios: dict[str, float]
    has_snapping: bool
    loss: str | None = None

    @property
    def is_within_bounds(self) -> bool:
        return all(ratio <= 1.0 for ratio in self.bound_ratios.values())

    @property
    def agrees(self) -> bool:
        return self.is_within_bounds or self.loss is not None

    def __str__(self) -> str:
        if self.loss is not None:
            return (
                f"the table LOSES {self.metres * 1e3:.2g} mm and {self.radians:.2g} rad to rounding on"
                f" {self.samples} samples: {self.loss}"
            )
        bound = "rounding and snapping" if self.has_snapping else "rounding"
        figures = self.bound_ratios if self.has_snapping else self.units
        unit, form = ("of the bound", ".0%") if self.has_snapping else ("in eps*scale", ".2g")
        worst = ", ".join(f"{name} {value:{form}}" for name, value in figures.items())
        verdict = f"agrees within {bound}" if self.agrees else f"DISAGREES by more than {bound}"
        return (
            f"{verdict} on {self.samples} samples: tip within {self.metres:.2e} m and {self.radians:.2e} rad;"
            f" {unit}: {worst}"
        )


@np.errstate(over="ignore", invalid="ignore")  # RangeError replaces these warnings.
def check_table(oracle: Oracle, tree: KinematicTree, table: DHTable, samples: Samples) -> TableCheck:
    own_q = table.coupling.select(tree, samples.q)
    columns = list(table.coupling.v_index(tree))
    own_v, own_a = samples.v[:, columns], samples.a[:, columns]
    motion = compute_relative_motion(oracle, tree, table, samples)
    T = table.placement(own_q)
    differences = {
        "placement": (
            np.hypot.reduce(T[:, :3, 3] - motion.placement[:, :3, 3], axis=-1),
            rotation_angle(T[:, :3, :3], motion.placement[:, :3, :3]),
        ),
        "jacobian": _find_linear_angular_maxima(jacobian(table, own_q) - motion.jacobian[..., columns]),
        "acceleration": _find_linear_angular_maxima(
            acceleration(table, own_q, own_v, own_a) - motion.acceleration
        ),
    }
    error_scales = compute_error_scales(tree, table, samples)
    snap_effect = _SnapEffect(table, own_q, error_scales)
    units, bound_ratios = _compare_with_bounds(differences, error_scales, snap_effect)
    loss = None
    table_length = sum_table_lengths(table)
    if table.rows and max(bound_ratios.values()) > 1.0 and (table_length > error_scales.reach).any():
        _, relaxed_ratios = _compare_with_bounds(
            differences, error_scales.with_min_reach(table_length), snap_effect
        )
        loss = _describe_accuracy_loss(table) if max(relaxed_ratios.values()) <= 1.0 else None
    elif max(bound_ratios.values()) <= 1.0:
        loss = _describe_large_angle(table, own_q)
    metres, radians = (float(x.max(initial=0.0)) for x in differences["placement"])
    has_snapping = bool(table.snap and table.snap.changes)
    return TableCheck(len(own_q), metres, radians, units, bound_ratios, has_snapping, loss)


def sum_table_lengths(table: DHTable) -> float:
    """Return the sum (m) of all lengths in a table, including its base and tool."""
    return table.span + math.hypot(*table.base[:3, 3])


def _describe_accuracy_loss(table: DHTable) -> str:
    length, cell, joint = max(
        (abs(value), name, row.joint) for row in table.rows for name, value in (("a", row.a), ("d", row.d))
    )
    tilts = [abs(math.sin(row.alpha)) for row in table.rows if row.alpha not in (0.0, math.pi)]
    tilt = math.asin(min(tilts, default=1.0))
    snap = f"use --snap {10.0 ** math.ceil(math.log10(tilt)):.0e}, or " if tilt <= MAX_SNAP_TOLERANCE else ""
    return (
        f"{cell} of {joint} is {length:.3g} m, which rounds by {EPS * length * 1e3:.2g} mm;"
        f" {snap}use Hayati rows"
    )


def _describe_large_angle(table: DHTable, own_q: FloatArray) -> str | None:
    """Return a sentence about a joint with a very large angle, or None."""
    largest = np.abs(table.coupling.values(own_q)).max(axis=0, initial=0.0).tolist()
    angles = [(x, row.joint) for x, row in zip(largest, table.rows, strict=True) if row.kind.turns]
    angle, joint = max(angles, default=(0.0, ""))
    if EPS * angle <= _MAX_ANGLE_ROUNDING:
        return None
    return (
        f"{joint} turns by up to {angle:.3g} rad, which rounds by {EPS * angle:.2g} rad;"
        " correct its limits or its mimic rule"
    )


#: Linear and angular differences of each quantity.
_Differences = dict[str, tuple[FloatArray, FloatArray]]


def _compare_with_bounds(
    differences: _Differences, error_scales: ErrorScales, snap_effect: _SnapEffect
) -> tuple[dict[str, float], dict[str, float]]:
    rates = error_scales.rates**2 + error_scales.accelerations
    ones = np.ones_like(error_scales.reach)
    columns = error_scales.turning + error_scales.sliding
    reach, slides = error_scales.reach[:, None], 1.0 if error_scales.sliding.any() else 0.0
    #: Each quantity has a pair (scale, snapping) for linear differences, and a pair for angular differences.
    #: The bound on a difference is the scale times the relative rounding error, plus the effect of snapping.
    limits: dict[str, tuple[tuple[FloatArray, FloatArray | float], tuple[FloatArray, FloatArray | float]]] = {
        "placement": ((error_scales.reach, snap_effect.metres), (ones, snap_effect.turn)),
        "jacobian": (
            (error_scales.turning * reach + error_scales.sliding, snap_effect.jacobian[:, None] * columns),
            (error_scales.turning * ones[:, None], snap_effect.turn * columns),
        ),
        "acceleration": (
            ((error_scales.reach + slides) * rates, snap_effect.acceleration * rates),
            (rates, 4.0 * snap_effect.turn * rates),
        ),
    }
    if not all(np.isfinite(x).all() for halves in limits.values() for pair in halves for x in pair):
        raise RangeError(
            "the bound on a table's rounding errors exceeds the range of double precision",
            remedy="give smaller numbers",
        )
    units, bound_ratios = dict[str, float](), dict[str, float]()
    for name, halves in differences.items():
        pairs = list(zip(halves, limits[name], strict=True))
        units[name] = max(_max_ratio(x, scale * EPS) for x, (scale, _) in pairs)
        bound_ratios[name] = max(
            _max_ratio(x, (scale.T * error_scales.rounding).T + snap) for x, (scale, snap) in pairs
        )
    return units, bound_ratios


def _max_ratio(found: FloatArray, unit: FloatArray | float) -> float:
    return float((found / np.maximum(unit, MIN_DIVISOR)).max(initial=0.0))


@dataclass(frozen=True, slots=True)
class RelativeMotion:
    placement: FloatArray  # (n, 4, 4)
    jacobian: FloatArray  # (n, 6, nv)
    acceleration: FloatArray  # (n, 6)


def compute_relative_motion(
    oracle: Oracle, tree: KinematicTree, table: DHTable, samples: Samples
) -> RelativeMotion:
    x = QueryBatch([table.base_frame, table.tip_frame], (samples.q, samples.v, samples.a))
    T = oracle.placements(x)
    R = T[:, 0, :3, :3]
    r = T[:, 1, :3, 3] - T[:, 0, :3, 3]
    J, vel, acc = oracle.jacobians(x), oracle.velocities(x), oracle.accelerations(x)
    J_base, J_tip = J[:, 0], J[:, 1]
    J_linear = J_tip[:, :3] - J_base[:, :3] - np.cross(J_base[:, 3:], r[..., None], axis=1)
    J_angular = J_tip[:, 3:] - J_base[:, 3:]
    w = vel[:, 0, 3:]
    v_relative = vel[:, 1, :3] - vel[:, 0, :3] - np.cross(w, r)
    alpha = acc[:, 1, 3:] - acc[:, 0, 3:] - np.cross(w, vel[:, 1, 3:] - w)
    linear = acc[:, 1, :3] - acc[:, 0, :3] - np.cross(acc[:, 0, 3:], r)
    linear -= np.cross(w, np.cross(w, r)) + 2.0 * np.cross(w, v_relative)
    placement = np.broadcast_to(np.eye(4), (len(r), 4, 4)).copy()
    Rt = np.swapaxes(R, -1, -2)
    placement[:, :3, :3] = Rt @ T[:, 1, :3, :3]
    placement[:, :3, 3] = (Rt @ r[..., None])[..., 0]
    return RelativeMotion(
        placement,
        np.concatenate([Rt @ J_linear, Rt @ J_angular], axis=1),
        np.concatenate([(Rt @ linear[..., None])[..., 0], (Rt @ alpha[..., None])[..., 0]], axis=1),
    )


@dataclass(frozen=True, slots=True)
class ErrorScales:
    """Lengths, sums of |v| and |a|, and relative errors, for the bounds on rounding errors.

    All sums are over the joints on the paths from the root to the table's base and tip.

    Attributes:
        reach: (n,) length L of the module's docstring, m.
        turning: (columns,) sum of |multiplier| over the revolute joints.
        sliding: (columns,) sum of |multiplier| over the prismatic joints.
        rates: (n,) sum of |multiplier * v| over all joints.
        accelerations: (n,) sum of |multiplier * a| over all joints.
        rounding: (n,) relative error. The bound includes angles between axes that the table treats as
            parallel.
    """

    reach: FloatArray
    turning: FloatArray
    sliding: FloatArray
    rates: FloatArray
    accelerations: FloatArray
    rounding: FloatArray

    def with_min_reach(self, metres: float) -> ErrorScales:
        return replace(self, reach=np.maximum(self.reach, metres))


def compute_error_scales(tree: KinematicTree, table: DHTable, samples: Samples) -> ErrorScales:
    n = len(samples.q)
    reach, rates, accelerations, angles = np.zeros((4, n))
    names, joints, tilt = table.joint_names, 0, 0.0
    weights = {True: np.zeros(len(names)), False: np.zeros(len(names))}
    for link in {tree.frame_link(table.base_frame), tree.frame_link(table.tip_frame)}:
        for i in tree.path(link):
            joint = tree.joints[i]
            joints += 1
            tilt += joint.pinocchio_tilt
            reach += joint.length
            factor, offset, mimicked_joint = 1.0, 0.0, joint.name
            if (rule := joint.mimic) is not None:
                factor, offset, mimicked_joint = abs(rule.multiplier), abs(rule.offset), rule.mimicked_joint
            v_at, q_at = tree.v_index[i], tree.q_index[i]
            rates += factor * np.abs(samples.v[:, v_at : v_at + joint.kind.nv]).sum(axis=-1)
            accelerations += factor * np.abs(samples.a[:, v_at : v_at + joint.kind.nv]).sum(axis=-1)
            value = offset + factor * np.abs(samples.q[:, q_at : q_at + joint.kind.nq]).sum(axis=-1)
            if joint.kind.turns:
                angles += value
            elif joint.kind.nq:
                reach += value
            if mimicked_joint in names:
                weights[joint.kind.turns][names.index(mimicked_joint)] += factor
    table_length = sum_table_lengths(table)
    reach = np.maximum(reach, np.minimum(table_length, MAX_LENGTH_RATIO * reach))
    # `Joint.pinocchio_tilt` is the angle between a joint's axis in urdfkin and the same axis in Pinocchio. A
    # term of the relative acceleration has up to four rotated vectors, so the factor is 4.
    roundings = table_roundings(len(table.rows)) + joint_roundings(joints, 4.0 * tilt) + angles
    rounding = EPS * roundings + sum_zeroed_tilts(make_chain(tree, table.tip_frame, table.base_frame))
    return ErrorScales(reach, weights[True], weights[False], rates, accelerations, rounding)


class _SnapEffect:
    """Bounds on the effect of snapping.

    `turn` is the largest rotation of an axis (rad). `metres` is the largest displacement of a joint origin or
    the tip.

    | Vector | Change at most |
    |---|---|
    | z x d | turn * reach + 2 * metres |
    | z x (z x d) | twice the change of z x d |
    | cross product of two axes | 2 * turn |
    """

    def __init__(self, table: DHTable, own_q: FloatArray, error_scales: ErrorScales) -> None:
        self.turn, self.metres = 0.0, np.zeros(len(own_q))
        if table.snap is not None:
            values = table.coupling.values(own_q)
            by_name = {row.joint: values[:, i] for i, row in enumerate(table.rows)}
            self.turn, self.metres = table.snap.radians, self.metres + table.snap.bound(by_name)
        self.jacobian = self.turn * (error_scales.reach + 1.0) + 2.0 * self.metres
        self.acceleration = 2.0 * self.turn * (error_scales.reach + 2.0) + 4.0 * self.metres


def _find_linear_angular_maxima(six: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the largest absolute values of linear and of angular rows."""
    return np.abs(six[:, :3]).max(axis=1), np.abs(six[:, 3:]).max(axis=1)
