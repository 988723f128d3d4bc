"""Compute singular values of Jacobians, condition numbers and manipulabilities, with guaranteed bounds.

*Error of J and residual.* Weyl's inequality limits the change of a singular value s_k:

    |s_k(J + E) - s_k(J)| <= spectral norm of E <= Frobenius norm of E
    E = error of J (`urdfkin.verify.bounds`) + residual J - U S V^T of the decomposition

*Orthogonality.* The computed U and V are not exactly orthogonal. Ostrowski's theorem limits the effect:

    |U^T U - I| <= a,  |V^T V - I| <= b
    s_k(U S V^T) = factor * s_k(S)
    (1 - a)^(1/2) (1 - b)^(1/2) <= factor <= (1 + a)^(1/2) (1 + b)^(1/2)

*Rounding.* The computed residuals have rounding errors too:

    error of a sum of m products <= m eps * (sum of the absolute values of the products)

*Range.* Intermediate norms and products stay within the range of doubles. Before a norm is computed, all
numbers are divided by the largest number. Products are computed from mantissas and exponents. If the residual
overflows, the lower bound is 0 and the upper bound is inf.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from urdfkin.errors import InputError, RangeError
from urdfkin.errors.display import Displayable, Table, TextDocument
from urdfkin.kinematics.inputs import as_finite, as_sample_index
from urdfkin.kinematics.roundings import EPS, SMALLEST_NORMAL
from urdfkin.model.tree import FloatArray
from urdfkin.verify.singularity import FrameJacobian, Singularity, explain_singularity

#: Bound on the relative rounding error of a few dozen sums and products of positive numbers.
_RELATIVE_ROUNDING_ERROR = 256.0 * EPS
_MAX_PRINTED_SAMPLES = 10


class BoundedArray(NamedTuple):
    """A computed value, with bounds on the true value."""

    value: FloatArray
    lower: FloatArray
    upper: FloatArray


@dataclass(frozen=True, eq=False)
class SingularValues(Displayable):
    """Singular values of some rows of a Jacobian.

    The decomposition omits columns that are 0 in every configuration; docs/hessian.md lists two
    exceptions. `print` and notebooks display a table. For a single configuration, the text of `singularity()`
    follows the table.

    Attributes:
        rows: The chosen rows of the Jacobian, as a slice.
        values: (..., k) singular values, largest first; k = min(rows, columns).
        U: (..., rows, k) left singular vectors, directions of the frame's velocity.
        V: (..., nv, k) right singular vectors, directions of v. The rows of omitted columns are 0.
        frame_jacobian: The Jacobian with names, or None for another matrix.

    >>> import urdfkin
    >>> arm = urdfkin.load("planar_two_link")
    >>> found = arm.singular_values([0.3, 1.0], "tip", "linear")
    >>> found.values.value.round(4).tolist()
    [0.865, 0.1946]
    """

    rows: slice
    values: BoundedArray
    U: FloatArray
    V: FloatArray
    frame_jacobian: FrameJacobian | None = None

    def __repr__(self) -> str:
        batch = f", {self.values.value.shape[:-1]}" if self.values.value.ndim > 1 else ""
        return f"<SingularValues{self._title()}{batch}>"

    def _title(self) -> str:
        rows = {3: "angular"}.get(self.rows.start, "linear" if self.rows.stop == len("xyz") else "all")
        return "" if self.frame_jacobian is None else f" of {self.frame_jacobian.frame}, {rows} rows"

    def _text_document(self) -> TextDocument:
        title = f"Singular values{self._title()}"
        k, shape = self.values.value.shape[-1], self.values.value.shape[:-1]
        names = [f"sigma_{i + 1}" for i in range(k)]
        if shape:
            n, sigma = math.prod(shape), self.values.value
            flat = [x.reshape(n, *x.shape[len(shape) :]) for x in (sigma, self.condition.value)]
            manipulability = self.manipulability.value.ravel()
            ranks = (self.values.lower > 0.0).sum(axis=-1).ravel()
            rows: list[list[str | float]] = [
                [str(list(index)).strip("[]"), *values.tolist(), condition, w, f"{rank} of {k}"]
                for index, values, condition, w, rank in zip(
                    np.ndindex(*shape), flat[0], flat[1].tolist(), manipulability.tolist(), ranks, strict=True
                )
            ]
            headers = ["sample", *names, "condition", "manipulability", "rank"]
            remaining = len(rows) - _MAX_PRINTED_SAMPLES
            more = [f"... and {remaining} more samples"] if remaining > 0 else []
            return TextDocument(title, [Table(headers, rows[:_MAX_PRINTED_SAMPLES]), *more])
        lines = [[name, *(f"{number[i]:.15g}" for number in self.values)] for i, name in enumerate(names)]
        for name, bounded in (("condition", self.condition), ("manipulability", self.manipulability)):
            lines.append([name, *(f"{number:.15g}" for number in bounded)])
        table = Table(["", "value", "lower bound", "upper bound"], lines)
        singularity = self.singularity() if self.frame_jacobian is not None else None
        return TextDocument(title, [table, *(str(singularity).splitlines() if singularity else [])])

    def singularity(self, *sample: int) -> Singularity:
        """Explain a loss of rank in one configuration.

        Args:
            sample: Indices of the configuration in the batch. Give no indices for a single configuration.

        Raises:
            InputError: the wrong number of indices, or an index that does not exist.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link")
        >>> print(arm.singular_values([0.0, 0.0], "tip", "linear").singularity())
        Singular within rounding: rank 1 of 2; sigma_2 is at most 9.5e-14.
        Lost direction: translation of the origin of tip along (1, 0, 0), in world axes.
        The axes of joints joint_1 and joint_2 lie in one plane with the origin of tip.
        """
        shape = self.values.value.shape[:-1]
        index = as_sample_index(sample, shape)
        if self.frame_jacobian is None:
            raise InputError("no such configuration", found=str(sample), where=f"a batch of shape {shape}")
        bounds = self.values.lower[index], self.values.upper[index]
        return explain_singularity(self.frame_jacobian, index, self.rows, *bounds)

    @cached_property
    def manipulability(self) -> BoundedArray:
        """Product of the singular values, (...): Yoshikawa's manipulability sqrt(det J J^T).

        If J has more rows than columns, the manipulability is sqrt(det J^T J). Without columns, it is 0.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link")
        >>> found = arm.singular_values([0.3, 1.0], "tip", "linear")
        >>> found.manipulability.value.round(4).item()  # 0.5 * 0.4 * sin(1)
        0.1683
        """
        if not self.values.value.shape[-1]:
            zero = np.zeros(self.values.value.shape[:-1])
            return BoundedArray(zero, zero, zero)
        value, lower, upper = map(multiply_values, self.values)
        return BoundedArray(value, np.maximum(_bound_below(lower), 0.0), _bound_above(upper))

    @cached_property
    def condition(self) -> BoundedArray:
        """Condition number (...): the largest singular value divided by the smallest.

        The upper bound is inf if the smallest singular value may be 0. Without columns, all numbers are NaN.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link")
        >>> found = arm.singular_values([0.3, 1.0], "tip", "linear")
        >>> found.condition.value.round(2).item()
        4.45
        """
        value, lower, upper = self.values
        if not value.shape[-1]:
            nan = np.full(value.shape[:-1], np.nan)
            return BoundedArray(nan, nan, nan)
        with np.errstate(divide="ignore", over="ignore", under="ignore", invalid="ignore"):
            least, value_ratio, most = (
                np.where(small > 0.0, large / small, np.inf)
                for large, small in (
                    (lower[..., 0], upper[..., -1]),
                    (value[..., 0], value[..., -1]),
                    (upper[..., 0], lower[..., -1]),
                )
            )
        return BoundedArray(value_ratio, np.maximum(_bound_below(least), 1.0), _bound_above(most))

    def manipulability_gradient(self, H: ArrayLike) -> FloatArray:
        """Return the gradient (..., nv) of the manipulability with respect to q.

        The derivative of a singular value is u^T J' v. The vectors u and v are the left and the right
        singular vector, and J' is the derivative of J. If the smallest singular value may be 0, the gradient
        may not exist, and the result is NaN.

        Args:
            H: (..., 6, nv, nv) Hessian of the frame in LOCAL_WORLD_ALIGNED, from `Robot.hessian` with the
                same q and base.

        Raises:
            InputError: H has another shape or contains a number that is not finite.
            RangeError: the gradient leaves the range of double precision.

        >>> import urdfkin
        >>> arm, q = urdfkin.load("planar_two_link"), [0.3, 1.0]
        >>> found = arm.singular_values(q, "tip", "linear")  # manipulability 0.5 * 0.4 * |sin q2|
        >>> found.manipulability_gradient(arm.hessian(q, "tip")).round(4).tolist()  # 0.2 cos q2
        [0.0, 0.1081]
        """
        value = self.values.value
        count, nv = value.shape[-1], self.V.shape[-2]
        derivatives = as_finite(H, "H")
        if derivatives.shape != (expected := (*value.shape[:-1], 6, nv, nv)):
            raise InputError(
                f"H must be the Hessian of the same configurations, {expected}",
                found=f"shape {derivatives.shape}",
            )
        other_products = np.ones_like(value)
        for k in range(count):
            other_products[..., k] = multiply_values(np.delete(value, k, axis=-1))
        with np.errstate(over="ignore", under="ignore", invalid="ignore"):
            weights = (self.U * other_products[..., np.newaxis, :]) @ np.swapaxes(self.V, -1, -2)
            batch, rows = weights.shape[:-2], weights.shape[-2]
            derivatives = derivatives[..., self.rows, :, :].reshape(*batch, rows * nv, nv)
            gradient: FloatArray = (weights.reshape(*batch, 1, rows * nv) @ derivatives)[..., 0, :]
        if count:
            exists = self.values.lower[..., -1] > 0.0
            if not np.isfinite(gradient[exists]).all():
                raise RangeError(
                    "the gradient leaves the range of double precision", remedy="give smaller numbers"
                )
            gradient[~exists] = np.nan
        return gradient


def singular_values(
    J: FloatArray,
    error: FloatArray,
    is_active: NDArray[np.bool_],
    rows: slice = slice(None),
    frame_jacobian: FrameJacobian | None = None,
) -> SingularValues:
    """Return singular values with guaranteed bounds.

    `error` bounds the error of each number of J. `is_active` (nv,) is False for omitted columns.

    >>> found = singular_values(np.array([[3.0, 0.0], [0.0, 4.0]]), np.zeros((2, 2)), np.array([True, True]))
    >>> found.values.value.tolist(), bool(found.values.upper[0] - found.values.lower[0] < 1e-12)
    ([4.0, 3.0], True)
    """
    A, A_error = (x[..., rows, :][..., is_active] for x in (J, error))
    U, s, Vt = np.linalg.svd(A, full_matrices=False)
    if not np.isfinite(s).all():
        raise RangeError(
            "a singular value leaves the range of double precision", remedy="give smaller numbers"
        )
    V = np.zeros((*J.shape[:-2], J.shape[-1], s.shape[-1]))
    V[..., is_active, :] = Vt.swapaxes(-1, -2)
    terms = s.shape[-1] + 4
    with np.errstate(over="ignore", invalid="ignore"):
        difference = np.abs(A - (U * s[..., np.newaxis, :]) @ Vt)
        sizes = np.abs(A) + (np.abs(U) * s[..., np.newaxis, :]) @ np.abs(Vt)
        residual = _bound_norm(difference + terms * (EPS * sizes + SMALLEST_NORMAL) + A_error)
        defect = _bound_orthogonality_error(U) + _bound_orthogonality_error(Vt.swapaxes(-1, -2))
        lower = s * _bound_below(1.0 - defect)[..., np.newaxis] - residual[..., np.newaxis]
        upper = s * _bound_above(1.0 + defect)[..., np.newaxis] + residual[..., np.newaxis]
    # NaN becomes 0 as a lower bound, and inf as an upper bound.
    lower, upper = (
        np.nan_to_num(_bound_below(lower), nan=0.0),
        np.nan_to_num(_bound_above(upper), nan=np.inf, posinf=np.inf),
    )
    return SingularValues(rows, BoundedArray(s, np.maximum(lower, 0.0), upper), U, V, frame_jacobian)


def _bound_orthogonality_error(U: FloatArray) -> FloatArray:
    """Bound the Frobenius norm |U^T U - I|."""
    Ut = U.swapaxes(-1, -2)
    rounding = (U.shape[-2] + 2) * EPS * (np.abs(Ut) @ np.abs(U))
    return _bound_norm(np.abs(Ut @ U - np.eye(U.shape[-1])) + rounding)


def _bound_norm(E: FloatArray) -> FloatArray:
    """Return an upper bound on the Frobenius norm of each matrix. All numbers of E are >= 0."""
    largest = E.max(axis=(-2, -1), initial=0.0)
    # A matrix that contains inf is not scaled, and the norm of this matrix is inf.
    unit = np.where((largest > 0.0) & np.isfinite(largest), largest, 1.0)
    with np.errstate(over="ignore", under="ignore"):
        norm: FloatArray = unit * np.linalg.norm(E / unit[..., np.newaxis, np.newaxis], axis=(-2, -1))
        # `_RELATIVE_ROUNDING_ERROR` does not cover sums of many squares.
        norm *= 1.0 + E.shape[-2] * E.shape[-1] * EPS
    return _bound_above(norm)


def multiply_values(x: FloatArray) -> FloatArray:
    """Multiply the numbers of the last axis without intermediate overflow or underflow."""
    mantissas, exponents = np.frexp(x)
    with np.errstate(over="ignore", under="ignore"):
        product: FloatArray = np.ldexp(mantissas.prod(axis=-1), exponents.sum(axis=-1))
    return product


def _bound_above(x: FloatArray) -> FloatArray:
    """Return an upper bound on the exact number that was computed as x."""
    with np.errstate(over="ignore", under="ignore"):
        return np.nextafter(x + np.abs(x) * _RELATIVE_ROUNDING_ERROR, np.inf)


def _bound_below(x: FloatArray) -> FloatArray:
    """Return a lower bound on the exact number that was computed as x.

    If x is inf, the bound is the largest double.
    """
    with np.errstate(under="ignore", invalid="ignore"):
        bound = np.nextafter(x - np.abs(x) * _RELATIVE_ROUNDING_ERROR, -np.inf)
    return np.where(np.isposinf(x), np.finfo(np.float64).max, bound)
