"""Checked input: what the text calls a vector or a matrix, as float64 arrays with leading batch axes.

Every function of this part takes any leading batch shape, and every pair of arguments broadcasts.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from urdfkin.errors import InputError
from urdfkin.errors.validators import is_real, safe_repr

FloatArray = NDArray[np.float64]

#: A direction counts as a unit vector when its norm is one to this. Normalised doubles are within 4e-16;
#: six typed digits are not, and would give a matrix that is no rotation.
UNIT_TOLERANCE = 1e-12
#: A matrix is a rotation when R R^T is the identity to this: nine decimals, each off by 5e-10, leave it off
#: by 1e-9 times the sum of the absolute values of a row, which is sqrt(3) at most.
ROTATION_TOLERANCE = 2e-9
#: NumPy's kinds that would turn into floats without a word: complex, bytes, text, spans and dates.
_NOT_NUMBERS = "cSUmMV"


def floats(value: ArrayLike, name: str) -> FloatArray:
    """`value` as float64 of any shape, nan and inf too; raises InputError where it is no real numbers."""
    if _is_masked(value):
        raise InputError(f"{name} must be real numbers", found="a masked value, which is none")
    try:
        array = np.asarray(value)
        if array.dtype.kind in _NOT_NUMBERS:
            raise TypeError(array.dtype)
        # In an array of objects, text and None would become numbers, or nan, without a word.
        if array.dtype.kind == "O" and not all(map(is_real, array.flat)):
            raise TypeError(array.dtype)
        return np.asarray(array, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"{name} must be real numbers", found=safe_repr(value)) from error


def _is_masked(value: object) -> bool:
    """Whether a number is masked, which NumPy would unmask without a word."""
    if isinstance(value, np.ma.MaskedArray):
        return bool(np.ma.is_masked(value))
    return isinstance(value, list | tuple) and any(map(_is_masked, value))


def scalars(value: ArrayLike, name: str) -> FloatArray:
    """`value` as finite float64 of any shape; raises InputError naming the argument otherwise."""
    array = floats(value, name)
    if not np.isfinite(array).all():
        raise InputError(f"{name} must be finite", found=str(array[~np.isfinite(array)][0]))
    return array


def vectors(value: ArrayLike, name: str, size: int = 3) -> FloatArray:
    """`value` as finite (..., size) float64; raises InputError naming the argument otherwise."""
    array = scalars(value, name)
    if array.ndim < 1 or array.shape[-1] != size:
        raise InputError(f"{name} must have the shape (..., {size})", found=str(array.shape))
    return array


def matrices(value: ArrayLike, name: str, rows: int = 3, columns: int = 3) -> FloatArray:
    """`value` as finite (..., rows, columns) float64; raises InputError naming the argument otherwise."""
    array = scalars(value, name)
    if array.ndim < 2 or array.shape[-2:] != (rows, columns):
        raise InputError(f"{name} must have the shape (..., {rows}, {columns})", found=str(array.shape))
    return array


def unit_vectors(value: ArrayLike, name: str) -> FloatArray:
    """`value` as (..., 3) unit vectors; raises InputError naming the argument otherwise.

    They are used as they are: normalising in silence would hide a mistake in the caller's axis.
    """
    array = vectors(value, name)
    norms = np.sqrt((array * array).sum(axis=-1))
    if (np.abs(norms - 1.0) > UNIT_TOLERANCE).any():
        worst = norms.flat[np.abs(norms - 1.0).argmax()]
        raise InputError(
            f"{name} must be a unit vector", found=f"norm {worst:.17g}", remedy="divide it by its norm"
        )
    return array


def rotations(value: ArrayLike, name: str) -> FloatArray:
    """`value` as (..., 3, 3) rotation matrices; raises InputError naming the argument otherwise."""
    array = matrices(value, name)
    residual = np.abs(array @ array.swapaxes(-1, -2) - np.eye(3)).max(initial=0.0)
    if residual > ROTATION_TOLERANCE:
        raise InputError(f"{name} must be a rotation", found=f"R R^T off the identity by {residual:.3g}")
    if (determinant(array) < 0.0).any():
        raise InputError(f"{name} must be a rotation", found="a reflection, determinant -1")
    return array


def determinant(matrix: FloatArray) -> FloatArray:
    """Determinant of (..., 3, 3) as the triple product of the rows."""
    triple: FloatArray = (np.cross(matrix[..., 0, :], matrix[..., 1, :]) * matrix[..., 2, :]).sum(axis=-1)
    return triple
