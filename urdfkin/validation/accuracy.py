"""Accuracy study: errors of urdfkin and of Pinocchio relative to values with at least fifty digits.

Each value with fifty digits is an interval that contains the true value, so that no error is underestimated.
Errors are given in multiples of eps * scale, as in a validation report.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from urdfkin.errors import InputError
from urdfkin.kinematics.bodies import QUATERNION, analytical_jacobian
from urdfkin.kinematics.rotation import (
    EULER_SEQUENCES,
    MIN_SINGULARITY_DISTANCE,
    euler_of,
    quaternion_of,
    singularity_distance,
)
from urdfkin.kinematics.roundings import EPS, SMALLEST_SUBNORMAL
from urdfkin.model.base_motion import BaseMotion
from urdfkin.model.configuration import Samples, draw_samples
from urdfkin.model.recursion import Number
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.verify.analytical_reference import euler_jacobian, quaternion_jacobian
from urdfkin.verify.bounds import (
    broadcast_k,
    compute_magnitudes,
    euler_jacobian_bound,
    quaternion_jacobian_bound,
    singularity_margin,
)
from urdfkin.verify.call import Call
from urdfkin.verify.exact.numbers import (
    REFERENCE_DIGITS,
    as_interval,
    enough_digits,
    precision,
    read_exact_joints,
)
from urdfkin.verify.exact.recursion import compute_motion, make_base_state
from urdfkin.verify.oracle import BaseRows, davenport_matrix
from urdfkin.verify.quantities import ANALYTICAL_JACOBIAN, JACOBIAN, PLACEMENT, Quantity, validated_quantities
from urdfkin.verify.verifier import compute_bound, compute_oracle_results, compute_own_results

_ALIGNED = Reference.LOCAL_WORLD_ALIGNED
_as_intervals = np.vectorize(as_interval, otypes=[object])
#: Representations of the orientation, by the attribute `reference` of an `AccuracyLine`. Angles about fixed
#: axes are omitted, because they are Euler angles in the reverse order.
_ORIENTATION_REPRESENTATIONS = {
    "euler angles": tuple(name for name in EULER_SEQUENCES if name.isupper()),
    QUATERNION: (QUATERNION,),
}


@dataclass(frozen=True, slots=True)
class Errors:
    """Largest error and root mean square, in eps * scale."""

    worst: float
    typical: float


@dataclass(frozen=True, slots=True)
class AccuracyLine:
    """Errors of urdfkin and of Pinocchio for one quantity.

    Attributes:
        reference: Reference frame; for analytical Jacobians, the representation of the orientation.
        numbers: Number of compared values.
    """

    quantity: str
    reference: str | None
    numbers: int
    urdfkin: Errors
    pinocchio: Errors


@dataclass(frozen=True, slots=True)
class AccuracyStudy:
    """Result of the accuracy study of one robot."""

    robot: str
    samples: int
    seed: int
    lines: tuple[AccuracyLine, ...]
    moving_base: bool = False


def accuracy_study(
    robot: Robot, *, samples: int = 5, seed: int = 0, base: BaseMotion | None = None
) -> AccuracyStudy:
    """Compute the errors of urdfkin and of Pinocchio relative to values with fifty digits.

    `base` contains one motion of the root link for all samples, or one motion for each sample. Without
    `base`, the root link is fixed.

    Pinocchio computes no analytical Jacobians. Therefore, the study computes two analytical Jacobians with
    eq. 7.122: one from urdfkin's rotation matrix and Jacobian, and one from Pinocchio's.

    Raises:
        InputError: The number of motions in `base` is wrong.
    """
    x = draw_samples(robot.tree, samples, np.random.default_rng(seed), with_zero_and_limits=False)
    longest_path = max(len(robot.tree.path(link)) for link in range(len(robot.tree.links)))
    with precision(max(REFERENCE_DIGITS, enough_digits(longest_path))):
        lines = tuple(_AccuracyBatch(robot, x, base).lines())
        return AccuracyStudy(robot.name, samples, seed, lines, base is not None)


class _AccuracySamples(NamedTuple):
    urdfkin: FloatArray
    pinocchio: FloatArray
    true: NDArray[np.object_]
    scale: FloatArray


class _AccuracyBatch:
    def __init__(self, robot: Robot, x: Samples, base: BaseMotion | None) -> None:
        if base is not None and base.batch_shape not in ((), (len(x.q),)):
            raise InputError(
                f"base: wrong batch shape; give one motion, or {len(x.q)} (one for each sample)",
                found=f"{base.batch_shape}",
            )
        self.oracle = robot.verifier.oracle(base)
        self.part = Call(robot.tree, robot.plan, robot.link_frames, _ALIGNED, base, (x.q, x.v, x.a)).select(
            slice(0, len(x.q))
        )
        self.links = range(len(robot.tree.links))
        joints, base_motions = read_exact_joints(robot.urdf, robot.tree), self.part.query.base
        bases = [
            None
            if base_motions is None
            else make_base_state(
                BaseRows(base_motions.placement[k], base_motions.velocity[k], base_motions.acceleration[k])
            )
            for k in range(len(x.q))
        ]
        rows = zip(*self.part.query.inputs, bases, strict=True)
        self.motions = [
            compute_motion(robot.tree, joints, q, v, a, base=base_state) for q, v, a, base_state in rows
        ]

    def lines(self) -> Iterator[AccuracyLine]:
        for reference in (None, *Reference):
            for row in validated_quantities():
                if row.compute_intervals is not None and reference in row.references:
                    name = None if reference is None else reference.name.lower()
                    yield _make_line(row.name, name, [self._compute_samples(row, reference)])
        for name, representations in _ORIENTATION_REPRESENTATIONS.items():
            yield _make_line(
                ANALYTICAL_JACOBIAN.name, name, list(self._compute_analytical_samples(representations))
            )

    def _compute_samples(self, row: Quantity, reference: Reference | None) -> _AccuracySamples:
        reference = _ALIGNED if reference is None else reference
        query = self.part.query._replace(reference=reference)
        part = self.part._replace(reference=reference, query=query)
        urdfkin_results, pinocchio_results = (
            compute_own_results(row, part),
            compute_oracle_results(row, self.oracle, query),
        )
        scale = np.broadcast_to(compute_bound(row, part).scale, urdfkin_results.shape)
        return _AccuracySamples(
            urdfkin_results,
            pinocchio_results,
            self._enclose_true_values(row, reference).reshape(urdfkin_results.shape),
            scale,
        )

    def _enclose_true_values(self, row: Quantity, reference: Reference) -> NDArray[np.object_]:
        return np.array(
            [[row.enclose(motion, link, reference) for link in self.links] for motion in self.motions],
            dtype=object,
        )

    def _compute_analytical_samples(self, representations: Sequence[str]) -> Iterator[_AccuracySamples]:
        """Yield samples without Euler angles near a singularity and quaternions with an uncertain sign."""
        poses, J_v = self._compute_samples(PLACEMENT, None), self._compute_samples(JACOBIAN, _ALIGNED)
        plan, part = self.part.plan, self.part
        magnitudes, min_distance = (
            compute_magnitudes(plan, part.q, None, None, part.state),
            max(MIN_SINGULARITY_DISTANCE, singularity_margin(plan)),
        )
        jacobian = JACOBIAN.bound(plan, magnitudes, _ALIGNED)
        R, R_pinocchio = poses.urdfkin[..., :3, :3], poses.pinocchio[..., :3, :3]
        nonzero = _find_nonzero_columns(J_v.scale)
        R_true, J_true = map(_as_intervals, (poses.true[..., :3, :3], _take_columns(J_v.true, nonzero)))
        for name in representations:
            if name == QUATERNION:
                bound, quaternions = quaternion_jacobian_bound(jacobian), quaternion_of(R)
                is_regular = np.abs(quaternions[..., 3]) > EPS * broadcast_k(bound, quaternions.shape[:-1])
                true = quaternion_jacobian(
                    exact_quaternion(R_true[is_regular], quaternions[is_regular]), J_true[is_regular]
                )
            else:
                is_regular = singularity_distance(name, euler_of(name, R)) > min_distance
                true, distances = euler_jacobian(name, R_true[is_regular], J_true[is_regular])
                all_distances = np.ones(is_regular.shape)
                all_distances[is_regular] = distances
                bound = euler_jacobian_bound(jacobian, magnitudes, all_distances)
            urdfkin_results = analytical_jacobian(name, R[is_regular], J_v.urdfkin[is_regular], 0.0)
            pinocchio_results = analytical_jacobian(
                name, R_pinocchio[is_regular], J_v.pinocchio[is_regular], 0.0
            )
            urdfkin_results, pinocchio_results, scale = (
                _take_columns(J, nonzero[is_regular])
                for J in (urdfkin_results, pinocchio_results, bound.scale[is_regular])
            )
            yield _AccuracySamples(urdfkin_results, pinocchio_results, true, scale)


def _find_nonzero_columns(scale: FloatArray) -> NDArray[np.intp]:
    """Return the indices (n, links, m) of the nonzero columns for each sample and link.

    m is the largest number of nonzero columns. Indices of zero columns fill shorter rows.
    """
    is_zero = ~(scale > 0.0).any(axis=-2)
    width = int((~is_zero).sum(axis=-1).max(initial=0))
    return np.argsort(is_zero, axis=-1, kind="stable")[..., :width]


def _take_columns(J: NDArray[Any], indices: NDArray[np.intp]) -> NDArray[Any]:
    return np.take_along_axis(J, indices[..., np.newaxis, :], axis=-1)


def exact_quaternion(R: NDArray[np.object_], near: FloatArray) -> NDArray[np.object_]:
    """Return the unit quaternions (m, 4) of rotations.

    Args:
        R: (m, 3, 3) rotations.
        near: (m, 4) quaternions. They determine the signs of the returned quaternions q: q . near > 0.
    """
    K = davenport_matrix(R)
    q = (K @ near[..., np.newaxis])[..., 0] + near  # K + I = 4 q q^T, so this sum is parallel to q
    unit: NDArray[np.object_] = q / np.sqrt((q * q).sum(axis=-1, keepdims=True))
    return unit


def _make_line(quantity: str, reference: str | None, sample_sets: Sequence[_AccuracySamples]) -> AccuracyLine:
    errors_of_libraries: tuple[list[FloatArray], list[FloatArray]] = [], []
    for urdfkin_results, pinocchio_results, true, scale in sample_sets:
        nonzero = scale > 0.0
        units = np.maximum(EPS * scale[nonzero], SMALLEST_SUBNORMAL)
        for errors, results in zip(errors_of_libraries, (urdfkin_results, pinocchio_results), strict=True):
            errors.append(_error_bound(results[nonzero], true[nonzero]) / units)
    urdfkin_errors, pinocchio_errors = map(np.concatenate, errors_of_libraries)
    return AccuracyLine(
        quantity,
        reference,
        len(urdfkin_errors),
        _summarize_errors(urdfkin_errors),
        _summarize_errors(pinocchio_errors),
    )


@partial(np.vectorize, otypes=[float])
def _error_bound(x: float, true: Number) -> float:
    """Return an upper bound on the error of `x`; the interval `true` contains the true value."""
    return float(abs(as_interval(true) - x).upper())


def _summarize_errors(units: FloatArray) -> Errors:
    if not units.size:
        return Errors(0.0, 0.0)
    return Errors(float(units.max()), float(np.sqrt((units * units).mean())))
