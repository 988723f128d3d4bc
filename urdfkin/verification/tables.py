"""A Denavit-Hartenberg table held against Pinocchio: placement, Jacobian and acceleration of its tip.

Pinocchio knows frames in the world; a table's numbers are relative to its base, which may itself be moving
(left foot to right hand). With R, w, v, alpha, a of base b and tip t in the world and r = p_t - p_b:

    w    = R_b^T (w_t - w_b)
    vel  = R_b^T (v_t - v_b - w_b x r)
    alpha= R_b^T (alpha_t - alpha_b - w_b x (w_t - w_b))
    acc  = R_b^T (a_t - a_b - alpha_b x r - w_b x (w_b x r) - 2 w_b x (v_t - v_b - w_b x r))

which are 7.124 and 7.125 solved for the motion seen from the moving frame. The bound is what rounding can do
to either side, plus what a snapped table declares.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdfkin.dh.snapping import rotation_angle
from urdfkin.dh.table import DHTable
from urdfkin.errors import UrdfkinError
from urdfkin.oracle import Oracle
from urdfkin.reference import Reference
from urdfkin.tree import FloatArray, KinematicTree
from urdfkin.verification.sampling import Samples

_EPS = float(np.finfo(np.float64).eps)
_ALIGNED = [Reference.LOCAL_WORLD_ALIGNED]


class TableError(UrdfkinError):
    """A table and Pinocchio disagree by more than rounding and snapping can explain."""

    is_disagreement = True


@dataclass(frozen=True, slots=True)
class TableCheck:
    """What a table's check found; every figure is the worst of all samples.

    Attributes:
        samples: How many configurations were compared.
        metres: Between the two tips.
        radians: Between their orientations.
        units: Of "placement", "jacobian" and "acceleration": the disagreement in eps * scale.
        shares: Likewise: the disagreement over the bound; 1 is as much as the bound allows.
        snapped: Whether the bound includes what snapping declares.
    """

    samples: int
    metres: float
    radians: float
    units: dict[str, float]
    shares: dict[str, float]
    snapped: bool

    @property
    def agrees(self) -> bool:
        """Whether every sample is within its bound."""
        return all(share <= 1.0 for share in self.shares.values())

    def __str__(self) -> str:
        bound = "rounding and what was snapped" if self.snapped else "rounding"
        figures = self.shares if self.snapped else self.units
        unit = "of the bound" if self.snapped else "in eps*scale"
        worst = ", ".join(f"{name} {_figure(value, self.snapped)}" for name, value in figures.items())
        verdict = f"agrees within {bound}" if self.agrees else f"DISAGREES by more than {bound}"
        return (
            f"{verdict} on {self.samples} samples: tip within {self.metres:.2e} m and {self.radians:.2e} rad;"
            f" {unit}: {worst}"
        )


def _figure(value: float, share: bool) -> str:
    return f"{value:.0%}" if share else f"{value:.2g}"


def check_table(oracle: Oracle, tree: KinematicTree, table: DHTable, samples: Samples) -> TableCheck:
    """Compare a table of `tree` with Pinocchio.

    Args:
        oracle: Pinocchio's model of the same robot.
        tree: The robot.
        table: A table whose base and tip are frames of the robot.
        samples: Configurations and rates of the whole robot.
    """
    own_q = table.coupling.select(tree, samples.q)
    columns = list(table.coupling.v_index(tree))
    own_v, own_a = samples.v[:, columns], samples.a[:, columns]
    motion = relative_motion(oracle, tree, table, samples)
    size = _sizes(tree, table, samples)
    metres, radians = table.tolerance(own_q)
    T = table.placement(own_q)
    off = np.linalg.norm(T[:, :3, 3] - motion.placement[:, :3, 3], axis=-1)
    turn = rotation_angle(T[:, :3, :3], motion.placement[:, :3, :3])
    J = _split(np.abs(table.jacobian(own_q) - motion.jacobian[..., columns]).max(axis=-1, initial=0.0))
    acc = _split(np.abs(table.acceleration(own_q, own_v, own_a) - motion.acceleration))
    slack = _Slack(table, metres, size)
    rates = size.rates**2 + size.accelerations
    one = np.ones_like(off)
    pairs: dict[str, tuple[tuple[FloatArray, FloatArray, FloatArray], ...]] = {
        "placement": ((off, size.reach, metres), (turn, one, radians)),
        "jacobian": ((J[0], size.reach + size.slides, slack.jacobian), (J[1], one, slack.turn * one)),
        "acceleration": (
            (acc[0], (size.reach + size.slides) * rates, slack.acceleration * rates),
            (acc[1], rates, 4.0 * slack.turn * rates),
        ),
    }
    units, shares = dict[str, float](), dict[str, float]()
    for name, halves in pairs.items():
        units[name] = max(_worst(x, scale * _EPS) for x, scale, _ in halves)
        shares[name] = max(_worst(x, scale * size.rounding + allowed) for x, scale, allowed in halves)
    worst = (float(off.max(initial=0.0)), float(turn.max(initial=0.0)))
    return TableCheck(len(own_q), *worst, units, shares, bool(table.snap and table.snap.changes))


def _worst(found: FloatArray, unit: FloatArray | float) -> float:
    """The largest ratio; nothing over nothing is zero."""
    return float((found / np.maximum(unit, 1e-300)).max(initial=0.0))


@dataclass(frozen=True, slots=True)
class RelativeMotion:
    """Pinocchio's placement (n, 4, 4), Jacobian (n, 6, nv) and acceleration (n, 6) of a tip in a base."""

    placement: FloatArray
    jacobian: FloatArray
    acceleration: FloatArray


def relative_motion(oracle: Oracle, tree: KinematicTree, table: DHTable, samples: Samples) -> RelativeMotion:
    """The tip's motion as seen from the table's base, from Pinocchio's of both in the world."""
    frames = [table.base_frame, table.tip_frame]
    T = oracle.placements(samples.q, frames)
    R = T[:, 0, :3, :3]
    r = T[:, 1, :3, 3] - T[:, 0, :3, 3]
    J = oracle.jacobians(samples.q, frames, _ALIGNED)[:, :, 0]
    vel = oracle.velocities(samples.q, samples.v, frames, _ALIGNED)[:, :, 0]
    acc = oracle.accelerations(samples.q, samples.v, samples.a, frames, _ALIGNED)[:, :, 0]
    J_base, J_tip = J[:, 0], J[:, 1]
    J_linear = J_tip[:, :3] - J_base[:, :3] - np.cross(J_base[:, 3:], r[..., None], axis=1)
    J_angular = J_tip[:, 3:] - J_base[:, 3:]
    w = vel[:, 0, 3:]
    v_seen = vel[:, 1, :3] - vel[:, 0, :3] - np.cross(w, r)
    alpha = acc[:, 1, 3:] - acc[:, 0, 3:] - np.cross(w, vel[:, 1, 3:] - w)
    linear = acc[:, 1, :3] - acc[:, 0, :3] - np.cross(acc[:, 0, 3:], r)
    linear -= np.cross(w, np.cross(w, r)) + 2.0 * np.cross(w, v_seen)
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
class _Sizes:
    """What rounding is measured by: (n,) metres, sums of rates, and the count of roundings times eps.

    `slides` is 1 where a joint slides: its column z is of size one, however short the robot is.
    """

    reach: FloatArray
    slides: float
    rates: FloatArray
    accelerations: FloatArray
    rounding: float


def _sizes(tree: KinematicTree, table: DHTable, samples: Samples) -> _Sizes:
    """Everything from the root to either end counts: Pinocchio goes there and back."""
    n = len(samples.q)
    reach, rates, accelerations, joints = np.zeros(n), np.zeros(n), np.zeros(n), 0
    slides = tilt = 0.0
    for link in {tree.frame_link(table.base_frame), tree.frame_link(table.tip_frame)}:
        for i in tree.path(link):
            joint = tree.joints[i]
            joints += 1
            tilt += joint.tilt
            reach += float(np.linalg.norm(joint.T_parent_joint[:3, 3]))
            factor = abs(joint.mimic.multiplier) if joint.mimic else 1.0
            v_at, q_at = tree.v_index[i], tree.q_index[i]
            rates += factor * np.abs(samples.v[:, v_at : v_at + joint.kind.nv]).sum(axis=-1)
            accelerations += factor * np.abs(samples.a[:, v_at : v_at + joint.kind.nv]).sum(axis=-1)
            if joint.kind.has_axis and not joint.kind.turns:
                slides = 1.0
            if not joint.kind.turns:
                offset = abs(joint.mimic.offset) if joint.mimic else 0.0
                reach += offset + factor * np.abs(samples.q[:, q_at : q_at + joint.kind.nq]).sum(axis=-1)
    # A table in strict rows may be far longer than the robot, and rounds accordingly.
    reach = np.maximum(reach, table.span + float(np.linalg.norm(table.base[:3, 3])))
    # An axis that Pinocchio takes for another turns each factor by twice the tilt (`verification.bounds`), of
    # which the acceleration seen from the base has four.
    rounding = _EPS * (8.0 + 8.0 * (joints + len(table.rows))) + 8.0 * tilt
    return _Sizes(reach, slides, rates, accelerations, rounding)


class _Slack:
    """What a snapped table may differ by, beyond rounding.

    No axis turns by more than `turn`, no joint origin and no tip is displaced by more than the declared
    metres; z x d so changes by turn times reach plus twice the metres, and a product of two such factors
    by twice that. Angular terms z x z change by twice the turn.
    """

    def __init__(self, table: DHTable, metres: FloatArray, size: _Sizes) -> None:
        snapped = table.snap is not None
        self.turn = table.snap.radians if table.snap is not None else 0.0
        shift = metres if snapped else np.zeros_like(metres)
        self.jacobian = self.turn * (size.reach + 1.0) + 2.0 * shift
        self.acceleration = 2.0 * self.turn * (size.reach + 2.0) + 4.0 * shift


def _split(six: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The largest linear and angular component of (n, 6)."""
    return six[:, :3].max(axis=-1), six[:, 3:].max(axis=-1)
