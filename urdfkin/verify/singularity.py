"""Explain a singular Jacobian: its rank, the lost directions, and the joints that cause the loss of rank.

| Term | Meaning |
|---|---|
| lost direction | left null vector u of J; the frame cannot move along u, because u^T J v = 0 for every v |
| null motion | right null vector of J, that is, joint velocities that do not move the frame |
| minimal dependent set | linearly dependent columns that are independent if any column is removed |

The joints of a minimal dependent set cause the loss of rank. A set that is dependent in every configuration
is not a cause. The module states a geometric reason, such as parallel axes, only if the columns satisfy the
condition within the error bound of J:

    column of a revolute joint: [a x z; z]
    z: direction of the axis
    a: vector from the frame's origin to a point of the axis
    collinear axes: equal columns up to sign
    axis through the frame's origin: a x z = 0
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from urdfkin.errors.display import Displayable, TextDocument, format_number
from urdfkin.kinematics.number_kinds import norm
from urdfkin.kinematics.roundings import EPS
from urdfkin.model.tree import FloatArray, KinematicTree

#: Maximum number of columns in a minimal dependent set that the search finds.
_MAX_SET_SIZE = 4
#: Maximum number of columns for the search. If a Jacobian has more columns, the search is skipped.
_MAX_COLUMNS = 16
#: Factor in the bound on the error of a singular value. The bound is
#: _ROUNDINGS * (rows + columns) * eps * (Frobenius norm).
_ROUNDINGS = 16.0
#: At random configurations, singular values count as 0 if they are below this fraction of the norm. Unit
#: vectors count as parallel if all singular values except the largest are below this number.
_RANK_TOLERANCE = 1e-9


@dataclass(frozen=True, eq=False)
class FrameJacobian:
    """A robot's Jacobian with names.

    Attributes:
        J: (..., 6, nv) Jacobian at the frame's origin, in world axes.
        error: (..., 6, nv) bounds on the errors of J.
        is_revolute: (nv,) True for the column of a revolute or continuous joint, False for a prismatic joint.
            None for the columns of a planar or floating joint, and of a joint that another joint mimics.
        active_entries: (6, nv) False for entries of J that are always 0.
        sample_jacobians: Function that returns Jacobians (n, 6, nv) at random configurations, with a fixed
            base.
        moving_base: Whether a base motion is given. A base motion can change the directions without motion.
    """

    J: FloatArray
    error: FloatArray
    frame: str
    joints: tuple[str, ...]
    is_revolute: tuple[bool | None, ...]
    active_entries: NDArray[np.bool_]
    sample_jacobians: Callable[[], FloatArray]
    moving_base: bool


def find_revolute_columns(tree: KinematicTree) -> tuple[bool | None, ...]:
    is_revolute: list[bool | None] = [None] * tree.nv
    moving_joints = [(i, joint) for i, joint in enumerate(tree.joints) if joint.kind.nv]
    for i, joint in moving_joints:
        column = tree.v_index[i]
        if joint.kind.nv == 1 and sum(tree.v_index[k] == column for k, _ in moving_joints) == 1:
            is_revolute[column] = joint.kind.turns
    return tuple(is_revolute)


@dataclass(frozen=True, eq=False)
class Singularity(Displayable):
    """Rank of a Jacobian, and reasons for a loss of rank.

    Attributes:
        rank: Number of singular values with a lower bound above 0.
        full_rank: Largest possible rank, min(rows, columns).
        smallest_value_bound: Upper bound on the smallest singular value.
        lost_directions: (d, 6) lost directions [linear; angular] in world axes, at the frame's origin.
            The array omits directions in which the frame never moves. If these directions depend on q or on a
            moving base, the array is empty.
        null_motions: (e, nv) independent joint velocities that do not move the frame.
        reasons: Sentences about the lost directions and the reasons.

    >>> import urdfkin
    >>> arm = urdfkin.load("planar_two_link")
    >>> found = arm.singular_values([0.0, 0.0], "tip", "linear").singularity()
    >>> found.rank, found.full_rank, found.lost_directions.tolist()
    (1, 2, [[1.0, 0.0, 0.0, 0.0, 0.0, 0.0]])
    """

    rank: int
    full_rank: int
    smallest_value_bound: float
    lost_directions: FloatArray
    null_motions: FloatArray
    reasons: tuple[str, ...]

    def __bool__(self) -> bool:
        """Whether the Jacobian is singular within rounding."""
        return self.rank < self.full_rank

    def __repr__(self) -> str:
        return f"<Singularity: rank {self.rank} of {self.full_rank}>"

    def _text_document(self) -> TextDocument:
        title = f"rank {self.rank} of {self.full_rank}"
        if not self:
            return TextDocument(f"Not singular: {title}.")
        where = f"sigma_{self.full_rank} is at most {self.smallest_value_bound:.2g}"
        return TextDocument(f"Singular within rounding: {title}; {where}.", self.reasons)


def explain_singularity(
    frame_jacobian: FrameJacobian, sample: tuple[int, ...], rows: slice, lower: FloatArray, upper: FloatArray
) -> Singularity:
    """Explain a loss of rank. `lower` and `upper` (k,) bound the singular values."""
    rank, full_rank = int((lower > 0.0).sum()), len(lower)
    if rank == full_rank:
        smallest_value_bound = float(upper[-1]) if full_rank else 0.0
        return Singularity(
            rank,
            full_rank,
            smallest_value_bound,
            np.zeros((0, 6)),
            np.zeros((0, frame_jacobian.J.shape[-1])),
            (),
        )
    return _SingularityExplainer(frame_jacobian, sample, rows, rank).explain(full_rank, float(upper[-1]))


class _SingularityExplainer:
    def __init__(
        self, frame_jacobian: FrameJacobian, sample: tuple[int, ...], rows: slice, rank: int
    ) -> None:
        J, error = frame_jacobian.J[sample], frame_jacobian.error[sample]
        chosen = np.zeros(6, dtype=bool)
        chosen[rows] = True
        self._linear_only, self._angular_only = not chosen[3:].any(), not chosen[:3].any()
        active = frame_jacobian.active_entries & chosen[:, None]
        self._rows, self._moving = np.flatnonzero(active.any(axis=1)), np.flatnonzero(active.any(axis=0))
        self._J, self._error, self._frame_jacobian, self._rank = J, error, frame_jacobian, rank
        self._A = J[np.ix_(self._rows, self._moving)]
        self._A_error = error[np.ix_(self._rows, self._moving)]
        self._names = [frame_jacobian.joints[i] for i in self._moving]

    def explain(self, full_rank: int, smallest_value_bound: float) -> Singularity:
        U, s, Vt = np.linalg.svd(self._A)
        self._noise = 8.0 * self._bound_matrix_error() / (s[self._rank - 1] if self._rank else 1.0)
        motions = np.zeros((len(Vt) - self._rank, self._J.shape[1]))
        motions[:, self._moving] = _make_sparse_basis(Vt[self._rank :])
        generic_rank, fixed_directions = self._compare_samples()
        directions = U[:, self._rank :].T
        directions = _make_orthonormal_basis(directions - directions @ fixed_directions @ fixed_directions.T)
        # If the Jacobian has more rows than columns, the frame never moves in some directions. If these
        # directions depend on q, they look like directions that are lost only at this q.
        is_known = len(directions) == generic_rank - self._rank and not (
            self._frame_jacobian.moving_base and fixed_directions.size
        )
        lost = np.zeros((len(directions) if is_known else 0, 6))
        if is_known:
            lost[:, self._rows] = _make_sparse_basis(directions)
            lost /= np.linalg.norm(lost, axis=1, keepdims=True)
            largest = np.abs(lost).argmax(axis=1)[:, None]
            lost = lost * np.sign(np.take_along_axis(lost, largest, axis=1)) + 0.0
        if self._rank == generic_rank:
            reasons = [
                "The Jacobian has the same rank at random configurations."
                " The arm causes the loss of rank, not this configuration."
            ]
        else:
            reasons = [*self._describe_directions(lost), *self._describe_causes(lost, motions)]
        return Singularity(self._rank, full_rank, smallest_value_bound, lost, motions, tuple(reasons))

    def _compare_samples(self) -> tuple[int, FloatArray]:
        """Return the largest rank of the sampled Jacobians, and orthonormal columns.

        The columns span the directions in which the frame moves in no sample.
        """
        samples = self._frame_jacobian.sample_jacobians()[:, self._rows[:, None], self._moving]
        # An axis may pass through the frame's origin for every q. In this case, the samples consist of
        # rounding errors. `_bound_matrix_error` includes the base's distance from the world origin, but the
        # samples have no base, so `_RANK_TOLERANCE` limits the noise.
        noise = min(self._bound_matrix_error(), _RANK_TOLERANCE)
        tolerances = np.maximum(noise, _RANK_TOLERANCE * norm(samples.reshape(len(samples), -1)))
        self._samples, self._sample_tolerances = samples, tolerances
        generic_rank = int(np.linalg.matrix_rank(samples, tol=tolerances).max())
        U, s, _ = np.linalg.svd(np.concatenate(list(samples), axis=1))
        return generic_rank, U[:, int((s > max(noise, _RANK_TOLERANCE * s[0])).sum()) :]

    def _remove_noise(self, rows: FloatArray) -> FloatArray:
        return np.where(np.abs(rows) <= self._noise, 0.0, rows)

    def _describe_directions(self, lost: FloatArray) -> Iterator[str]:
        frame = self._frame_jacobian.frame
        for u in self._remove_noise(lost):
            linear, angular = _format_vector(u[:3]), _format_vector(u[3:])
            if not u[3:].any():
                yield f"Lost direction: translation of the origin of {frame} along {linear}, in world axes."
            elif not u[:3].any():
                yield f"Lost direction: rotation of {frame} about {angular}, in world axes."
            else:
                at = f"at the origin of {frame} in world axes"
                yield f"Lost direction: linear {linear}, angular {angular}, {at}."

    def _describe_causes(self, lost: FloatArray, motions: FloatArray) -> Iterator[str]:
        if sets := list(self._find_dependent_sets()):
            yield from map(self._describe_dependence, self._merge_overlapping_pairs(sets))
            return
        if len(lost) == 1 and (line := self._describe_common_line(self._remove_noise(lost)[0])) is not None:
            yield line
        if len(motions) == 1:
            yield self._describe_null_motion(motions[0, self._moving])
        else:
            moving = np.flatnonzero(self._remove_noise(motions)[:, self._moving].any(axis=0))
            # The noise can exceed all numbers of the motions. In this case, the text names all joints.
            joints = _join_names([self._names[i] for i in moving] or self._names)
            frame = self._frame_jacobian.frame
            yield f"{len(motions)} independent joint motions of {joints} do not move {frame}."

    def _find_dependent_sets(self) -> Iterator[tuple[int, ...]]:
        if self._A.shape[1] > _MAX_COLUMNS:
            return
        found: list[set[int]] = []
        for size in range(1, min(_MAX_SET_SIZE, *self._A.shape) + 1):
            for columns in combinations(range(self._A.shape[1]), size):
                if any(smaller <= set(columns) for smaller in found):
                    continue
                A, A_error = self._A[:, columns], self._A_error[:, columns]
                smallest_value = np.linalg.svd(A, compute_uv=False)[-1]
                if smallest_value <= norm(A_error.ravel()) + self._bound_rounding_error(A):
                    found.append(set(columns))
                    if not self._is_always_dependent(columns):
                        yield columns

    def _is_always_dependent(self, columns: tuple[int, ...]) -> bool:
        ranks = np.linalg.matrix_rank(self._samples[:, :, columns], tol=self._sample_tolerances)
        return int(ranks.max()) < len(columns)

    def _merge_overlapping_pairs(self, sets: list[tuple[int, ...]]) -> list[tuple[int, ...]]:
        joined: list[set[int]] = []
        # `_describe_linear_rows` expects three columns that span a plane.
        # Three columns from merged pairs would span a line.
        # Therefore, pairs of linear rows are not merged.
        if self._linear_only:
            return sets
        for pair in (set(columns) for columns in sets if len(columns) == 2):
            overlapping = [columns for columns in joined if columns & pair]
            joined = [columns for columns in joined if not columns & pair] + [pair.union(*overlapping)]
        return [
            *(tuple(sorted(columns)) for columns in joined),
            *(columns for columns in sets if len(columns) != 2),
        ]

    def _describe_dependence(self, columns: tuple[int, ...]) -> str:
        indices = self._moving[list(columns)]
        is_revolute = [self._frame_jacobian.is_revolute[i] for i in indices]
        reason = None
        if None not in is_revolute:
            if self._angular_only:
                are_parallel = np.linalg.matrix_rank(self._A[:, columns], tol=_RANK_TOLERANCE) == 1
                plane = "" if are_parallel else " to one plane"
                reason = f"The axes of {self._name_joints(columns)} are parallel{plane}."
            elif self._linear_only:
                reason = self._describe_linear_rows(columns, is_revolute)
            elif all(is_revolute):
                reason = self._describe_revolute_axes(columns)
            elif (
                not any(is_revolute) and np.linalg.matrix_rank(self._A[:, columns], tol=_RANK_TOLERANCE) == 1
            ):
                reason = f"The {self._name_joints(columns)} slide along parallel axes."
        if reason is not None:
            return reason
        _, _, Vt = np.linalg.svd(self._A[:, columns])
        motion = np.zeros(len(self._names))
        motion[list(columns)] = Vt[-1]
        return self._describe_null_motion(motion)

    def _describe_linear_rows(self, columns: tuple[int, ...], is_revolute: list[bool | None]) -> str | None:
        frame = self._frame_jacobian.frame
        if len(columns) == 1 and is_revolute[0]:
            return f"The axis of {self._name_joints(columns)} passes through the origin of {frame}."
        if len(columns) == 2 and all(is_revolute):
            return f"The axes of {self._name_joints(columns)} lie in one plane with the origin of {frame}."
        if len(columns) == 3:
            return f"The {self._name_joints(columns)} move the origin of {frame} in one plane only."
        return None

    def _describe_revolute_axes(self, columns: tuple[int, ...]) -> str | None:
        indices = self._moving[list(columns)]
        z, v = self._J[3:, indices].T, self._J[:3, indices].T
        error = self._bound_column_error(indices, slice(0, 6))
        axis_error = self._bound_column_error(indices, slice(3, 6))
        are_parallel = bool((np.linalg.norm(np.cross(z[:1], z), axis=1) <= axis_error).all())
        axes = f"The axes of {self._name_joints(columns)}"
        signs = np.sign(z @ z[0])[:, None]
        if are_parallel and np.abs(v - signs * v[0]).max() <= error:
            return f"{axes} are collinear."
        # Three dependent lines that are parallel or concurrent are always coplanar, but four need not be
        # coplanar.
        if are_parallel:
            return f"{axes} are parallel{' and lie in one plane' if len(columns) == 3 else ''}."
        # If all axes pass through a point a, each column [v; z] satisfies v = a x z.
        crosses = np.concatenate([np.cross(np.eye(3), -axis) for axis in z])
        a, *_ = np.linalg.lstsq(crosses, v.ravel(), rcond=None)
        tolerance = error * (1.0 + float(np.abs(v).max()))
        if np.abs(crosses @ a - v.ravel()).max() > tolerance * float(np.linalg.cond(crosses)):
            return None
        return f"{axes} intersect in one point{' and lie in one plane' if len(columns) == 3 else ''}."

    def _describe_common_line(self, lost_direction: FloatArray) -> str | None:
        f, m = lost_direction[:3], lost_direction[3:]
        if self._linear_only or self._angular_only or not f.any():
            return None
        if not all(self._frame_jacobian.is_revolute[i] for i in self._moving):
            return None
        tolerance = 4.0 * self._bound_matrix_error() * (1.0 + np.abs(self._A).max())
        if abs(f @ m) > tolerance * float(f @ f):
            return None
        point = np.cross(f, m) / (f @ f)
        return (
            f"Each axis intersects the line along {_format_vector(f / np.linalg.norm(f))} through the point"
            f" at {_format_vector(point)} m from the origin of {self._frame_jacobian.frame}, in world axes,"
            " or is parallel to this line."
        )

    def _describe_null_motion(self, motion: FloatArray) -> str:
        motion = motion / motion[np.argmax(np.abs(motion))]
        parts = [
            f"{name} {format_number(float(x))}"
            for name, x in zip(self._names, motion, strict=True)
            if abs(x) > np.sqrt(EPS)
        ]
        return f"These joint velocities do not move {self._frame_jacobian.frame}: {', '.join(parts)}."

    def _name_joints(self, columns: Sequence[int]) -> str:
        names = _join_names([self._names[i] for i in columns])
        return f"{'joint' if len(columns) == 1 else 'joints'} {names}"

    def _bound_column_error(self, indices: NDArray[np.intp], rows: slice) -> float:
        """Bound the error of a difference of two columns."""
        error = 2.0 * float(norm(self._error[rows, indices].ravel()))
        return error + self._bound_rounding_error(self._J[rows, indices])

    def _bound_matrix_error(self) -> float:
        return float(norm(self._A_error.ravel())) + self._bound_rounding_error(self._A)

    @staticmethod
    def _bound_rounding_error(A: FloatArray) -> float:
        return float(_ROUNDINGS * sum(A.shape) * EPS * norm(A.ravel()))


def _make_sparse_basis(rows: FloatArray) -> FloatArray:
    """Apply Gauss-Jordan elimination. A single row stays unchanged."""
    basis, n = rows.copy(), len(rows)
    free = list(range(basis.shape[1])) if n > 1 else []
    for i in range(n if n > 1 else 0):
        k = max(free, key=lambda column: abs(basis[i, column]))
        free.remove(k)
        basis[i] /= basis[i, k]
        for other in range(n):
            if other != i:
                basis[other] -= basis[other, k] * basis[i]
    return basis


def _make_orthonormal_basis(rows: FloatArray) -> FloatArray:
    _, s, Vt = np.linalg.svd(rows, full_matrices=False)
    # Each singular value is 1 or 0, except for rounding.
    return Vt[: int((s > 0.5).sum())]


def _format_vector(x: FloatArray) -> str:
    return f"({', '.join(format_number(value, 1e-12, 4) for value in x.tolist())})"


def _join_names(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
