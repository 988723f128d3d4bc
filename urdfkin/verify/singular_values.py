"""Singular values that are guaranteed to lie between two doubles, and what is made of them.

A singular value moves by no more than the matrix does (Weyl): |s_k(J + E) - s_k(J)| <= |E|, in any norm that
is no less than the spectral one; Frobenius' is taken. What E is made of is known: what J may be off by (its
bound, `urdfkin.verify.bounds`), and what the decomposition leaves, J - U S V^T. LAPACK is not believed that U
and V are orthogonal either: with |U^T U - I| <= a and |V^T V - I| <= b the singular values of U S V^T lie
within (1 - a)^(1/2) (1 - b)^(1/2) and (1 + a)^(1/2) (1 + b)^(1/2) of those in S (Ostrowski).

The rounding of these residuals themselves is bounded as that of any sum of products: m terms are off by m eps
of the sum of their sizes. A norm is taken of the matrix divided by its largest number, and a product of
mantissas and exponents apart: no square and no partial product leaves the range of doubles.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from urdfkin.kinematics.roundings import EPS, SMALLEST
from urdfkin.model.tree import FloatArray

#: What sums and products of positive numbers round by, here, together: they are a few dozen.
_OUTWARD = 256.0 * EPS


class Between(NamedTuple):
    """A value and two doubles that it lies between, arrays of one shape.

    Attributes:
        value: As it is computed.
        lower: No larger than the true one.
        upper: No smaller.
    """

    value: FloatArray
    lower: FloatArray
    upper: FloatArray


@dataclass(frozen=True, eq=False)
class SingularValues:
    """The singular values of some rows of a Jacobian, without the columns that cannot move them.

    Attributes:
        rows: Which of the Jacobian's.
        values: (..., k), largest first; k is the number of rows or of columns, whichever is less.
        U: (..., rows, k) the directions of the frame's motion that belong to them.
        V: (..., nv, k) the directions of the rates; 0 for rates that do not move the frame.
    """

    rows: slice
    values: Between
    U: FloatArray
    V: FloatArray

    @cached_property
    def manipulability(self) -> Between:
        """(...) their product, which is sqrt(det J J^T) (Yoshikawa), or sqrt(det J^T J) of few columns."""
        if not self.values.value.shape[-1]:
            nothing = np.zeros(self.values.value.shape[:-1])
            return Between(nothing, nothing, nothing)
        value, lower, upper = map(_product, self.values)
        return Between(value, np.maximum(_down(lower), 0.0), _up(upper))

    @cached_property
    def condition(self) -> Between:
        """(...) the largest by the smallest; inf where the smallest cannot be told from 0."""
        value, lower, upper = self.values
        if not value.shape[-1]:
            nothing = np.full(value.shape[:-1], np.nan)
            return Between(nothing, nothing, nothing)
        with np.errstate(divide="ignore", over="ignore", under="ignore", invalid="ignore"):
            least, middle, most = (
                np.where(small > 0.0, large / small, np.inf)
                for large, small in (
                    (lower[..., 0], upper[..., -1]),
                    (value[..., 0], value[..., -1]),
                    (upper[..., 0], lower[..., -1]),
                )
            )
        return Between(middle, np.maximum(_down(least), 1.0), _up(most))

    def manipulability_gradient(self, H: FloatArray) -> FloatArray:
        """(..., nv) its derivatives by the rates, from the frame's Hessian H (..., 6, nv, nv).

        The derivative of a singular value is u^T J' v, that of a product the sum over its factors, each by
        the product of the others: nothing is divided by. Where the smallest cannot be told from 0 the
        product has a kink, or may have, and the derivatives are nan.
        """
        value = self.values.value
        count = value.shape[-1]
        others = np.ones_like(value)
        for k in range(count):
            others[..., k] = _product(np.delete(value, k, axis=-1))
        slopes: FloatArray = np.einsum(
            "...k,...rk,...rij,...ik->...j", others, self.U, H[..., self.rows, :, :], self.V, optimize=True
        )
        if count:
            slopes[self.values.lower[..., -1] <= 0.0] = np.nan
        return slopes


def singular_values(
    J: FloatArray, error: FloatArray, moving: NDArray[np.bool_], rows: slice = slice(None)
) -> SingularValues:
    """Of some rows of matrices J (..., m, nv), each number of which is off by `error` at most.

    Args:
        J: Finite.
        error: (..., m, nv).
        moving: (nv,) bool: which columns may be anything but 0.
        rows: Which rows.

    >>> found = singular_values(np.array([[3.0, 0.0], [0.0, 4.0]]), np.zeros((2, 2)), np.array([True, True]))
    >>> found.values.value.tolist(), bool(found.values.upper[0] - found.values.lower[0] < 1e-12)
    ([4.0, 3.0], True)
    """
    A, off = (x[..., rows, :][..., moving] for x in (J, error))
    U, s, Vt = np.linalg.svd(A, full_matrices=False)
    V = np.zeros((*J.shape[:-2], J.shape[-1], s.shape[-1]))
    V[..., moving, :] = Vt.swapaxes(-1, -2)
    terms = s.shape[-1] + 4
    with np.errstate(over="ignore", invalid="ignore"):
        left = np.abs(A - (U * s[..., np.newaxis, :]) @ Vt)
        sizes = np.abs(A) + (np.abs(U) * s[..., np.newaxis, :]) @ np.abs(Vt)
        residual = _norm(left + terms * (EPS * sizes + SMALLEST) + off)
        skew = _skew(U) + _skew(Vt.swapaxes(-1, -2))
        lower = s * _down(1.0 - skew)[..., np.newaxis] - residual[..., np.newaxis]
        upper = s * _up(1.0 + skew)[..., np.newaxis] + residual[..., np.newaxis]
    # What is beyond all numbers, or no number, bounds nothing.
    lower, upper = np.nan_to_num(_down(lower), nan=0.0), np.nan_to_num(_up(upper), nan=np.inf, posinf=np.inf)
    return SingularValues(rows, Between(s, np.maximum(lower, 0.0), upper), U, V)


def _skew(U: FloatArray) -> FloatArray:
    """(...) no less than |U^T U - I| for (..., m, k)."""
    back = U.swapaxes(-1, -2)
    rounding = (U.shape[-2] + 2) * EPS * (np.abs(back) @ np.abs(U))
    return _norm(np.abs(back @ U - np.eye(U.shape[-1])) + rounding)


def _norm(E: FloatArray) -> FloatArray:
    """(...) no less than the Frobenius norm of (..., m, n), none of whose numbers is negative."""
    largest = E.max(axis=(-2, -1), initial=0.0)
    unit = np.where((largest > 0.0) & np.isfinite(largest), largest, 1.0)  # the norm of inf is inf
    with np.errstate(over="ignore", under="ignore"):
        norm: FloatArray = unit * np.linalg.norm(E / unit[..., np.newaxis, np.newaxis], axis=(-2, -1))
    return _up(norm)


def _product(x: FloatArray) -> FloatArray:
    """(...) the product of (..., k), which alone can leave the range of doubles: no part of it does."""
    mantissas, exponents = np.frexp(x)
    with np.errstate(over="ignore", under="ignore"):
        product: FloatArray = np.ldexp(mantissas.prod(axis=-1), exponents.sum(axis=-1))
    return product


def _up(x: FloatArray) -> FloatArray:
    """No less than `x` was before it was rounded; the next number where it is too small for a share of it."""
    with np.errstate(over="ignore", under="ignore"):
        return np.nextafter(x + np.abs(x) * _OUTWARD, np.inf)


def _down(x: FloatArray) -> FloatArray:
    """No more, likewise; the largest double where it was beyond all."""
    with np.errstate(under="ignore", invalid="ignore"):
        inside = np.nextafter(x - np.abs(x) * _OUTWARD, -np.inf)
    return np.where(np.isposinf(x), np.finfo(np.float64).max, inside)
