"""Check vectors, matrices and rotations, and convert them to float64 arrays."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import wraps
from typing import ParamSpec, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from urdfkin.errors import InputError, RangeError
from urdfkin.errors.validators import is_real, safe_repr
from urdfkin.system.lazy_import import is_instance

FloatArray = NDArray[np.float64]

#: Largest accepted deviation of a unit vector's norm from 1. A vector that is normalised in double precision
#: deviates by at most 4e-16. For a vector with only six digits, the rotation formulas give a matrix that is
#: not a rotation.
UNIT_TOLERANCE = 1e-12
#: Largest accepted absolute entry of R R^T - I for a rotation matrix R. If R is rounded to nine decimals,
#: every entry of R has an error of at most 5e-10. An entry of R R^T is the dot product of two rows of R. The
#: absolute values of the entries in a row of R sum to at most sqrt(3). Therefore, an entry of R R^T - I is at
#: most 2 * 5e-10 * sqrt(3), about 1.73e-9.
ROTATION_TOLERANCE = 2e-9
#: Values of NumPy's `dtype.kind` for data that are not real numbers. The letters mean complex (c), bytes (S),
#: text (U), timedelta (m), datetime (M) and void (V). For example, NumPy converts dates and the text "1.5" to
#: floats without reporting an error.
_NOT_NUMBERS = "cSUmMV"
_DOUBLE = np.dtype(np.float64)


def as_floats(value: ArrayLike, name: str) -> FloatArray:
    if type(value) is np.ndarray and value.dtype is _DOUBLE:
        return value
    if _is_masked(value):
        raise InputError(f"{name} must be real numbers", found="a masked value")
    try:
        array = np.asarray(value)
        if array.dtype.kind in _NOT_NUMBERS:
            raise TypeError(array.dtype)
        # Without this check, NumPy would convert text in an object array to numbers, and None to NaN.
        if array.dtype.kind == "O" and not all(map(is_real, array.flat)):
            raise TypeError(array.dtype)
        return np.asarray(array, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"{name} must be real numbers", found=safe_repr(value)) from error
    except RuntimeError as error:  # PyTorch raises this error for a tensor that requires a gradient.
        raise InputError(
            f"{name} cannot be converted to a NumPy array",
            found=safe_repr(value),
            remedy=str(error).partition("\n")[0],
        ) from error


def _is_masked(value: object) -> bool:
    """Return whether any element is masked. NumPy's `asarray` ignores masks."""
    if is_instance(value, "numpy.ma:MaskedArray"):
        return bool(np.ma.is_masked(value))
    return isinstance(value, list | tuple) and any(map(_is_masked, value))


def check_range(result: FloatArray) -> FloatArray:
    """Return the result of a computation; raise RangeError if one of its numbers is not finite."""
    if not np.isfinite(result).all():
        raise RangeError("a result leaves the range of double precision", remedy="give smaller numbers")
    return result


_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result", bound=FloatArray | tuple[FloatArray, ...])


def range_checked(function: Callable[_Arguments, _Result]) -> Callable[_Arguments, _Result]:
    """Make a function raise RangeError if a result is not finite, without NumPy's warnings."""

    @wraps(function)
    def checked(*args: _Arguments.args, **kwargs: _Arguments.kwargs) -> _Result:
        with np.errstate(over="ignore", invalid="ignore"):
            result = function(*args, **kwargs)
        for array in result if isinstance(result, tuple) else (result,):
            check_range(array)
        return result

    return checked


def common_batch_shape(shapes: Iterable[tuple[int, ...]], what: str = "the arguments") -> tuple[int, ...]:
    """Return the shape to which batch shapes broadcast. `what` names the arrays in the error."""
    shapes = list(shapes)
    try:
        return np.broadcast_shapes(*shapes)
    except ValueError:
        found = ", ".join(map(str, shapes))
        raise InputError(f"the batch shapes of {what} do not broadcast", found=found) from None


def as_sample_index(sample: object, batch_shape: tuple[int, ...]) -> tuple[int, ...]:
    """Return the indices of a sample in a batch.

    >>> as_sample_index([1], (3,))
    (1,)
    """
    if isinstance(sample, tuple | list) and len(sample) == len(batch_shape):
        are_integers = all(isinstance(i, int | np.integer) and not isinstance(i, bool) for i in sample)
        if are_integers and all(-n <= i < n for i, n in zip(sample, batch_shape, strict=True)):
            return tuple(map(int, sample))
    raise InputError(
        "no such configuration", found=safe_repr(sample), where=f"a batch of shape {batch_shape}"
    )


def as_rows(rows: object) -> slice:
    """Return `rows` if it is a slice of whole numbers."""
    try:
        if isinstance(rows, slice) and rows.indices(6):
            return rows
    except (TypeError, ValueError):
        pass
    raise InputError("rows must be a slice", found=safe_repr(rows), remedy="write slice(0, 3)")


def as_finite(value: ArrayLike, name: str) -> FloatArray:
    array = as_floats(value, name)
    if not np.isfinite(array).all():
        raise InputError(f"{name} must be finite", found=str(array[~np.isfinite(array)][0]))
    return array


def as_vectors(value: ArrayLike, name: str, size: int = 3) -> FloatArray:
    array = as_finite(value, name)
    if array.ndim < 1 or array.shape[-1] != size:
        raise InputError(f"{name} must have the shape (..., {size})", found=str(array.shape))
    return array


def as_matrices(value: ArrayLike, name: str, rows: int = 3, columns: int = 3) -> FloatArray:
    array = as_finite(value, name)
    if array.ndim < 2 or array.shape[-2:] != (rows, columns):
        raise InputError(f"{name} must have the shape (..., {rows}, {columns})", found=str(array.shape))
    return array


@np.errstate(over="ignore")  # After an overflow, the norm is inf.
def as_unit_vectors(value: ArrayLike, name: str) -> FloatArray:
    array = as_vectors(value, name)
    norms = np.sqrt((array * array).sum(axis=-1))
    if (np.abs(norms - 1.0) > UNIT_TOLERANCE).any():
        worst = norms.flat[np.abs(norms - 1.0).argmax()]
        raise InputError(
            f"{name} must be a unit vector", found=f"norm {worst:.17g}", remedy="divide it by its norm"
        )
    return array


@np.errstate(over="ignore", invalid="ignore")  # If the determinant overflows, R is not a rotation.
def as_rotations(value: ArrayLike, name: str) -> FloatArray:
    array = as_matrices(value, name)
    defect = rotation_defect(array).max(initial=0.0)
    if defect > ROTATION_TOLERANCE:
        found = f"R R^T differs from the identity by {defect:.3g}"
        if np.isinf(defect) and (determinant(array) < 0.0).any():
            found = "a reflection, determinant -1"
        raise InputError(f"{name} must be a rotation", found=found)
    return array


def rotation_defect(R: FloatArray) -> FloatArray:
    """Return the largest absolute entry of R R^T - I.

    Return inf if the determinant is not positive or R R^T overflows.
    """
    with np.errstate(over="ignore", invalid="ignore"):  # If R R^T overflows, R is not a rotation.
        defect = np.abs(R @ R.swapaxes(-1, -2) - np.eye(3)).max(axis=(-2, -1))
        return np.where((defect >= 0.0) & (determinant(R) > 0.0), defect, np.inf)


def determinant(matrix: FloatArray) -> FloatArray:
    (a, b, c), (d, e, f), (g, h, i) = np.moveaxis(matrix, (-2, -1), (0, 1))
    triple: FloatArray = (b * f - c * e) * g + (c * d - a * f) * h + (a * e - b * d) * i
    return triple
