"""Bound the rounding errors of an exported function in single precision, for each number of its result.

Each operation and each constant of the code has a rounding error, which `urdfkin.kinematics.roundings`
derives. To first order in eps, the error of a result is a sum of products. Each product is a rounding error,
times the derivative of the result with respect to the operation or constant. The bound is the sum of the
absolute values of these products. One backward pass over the operations computes the derivatives of all
results.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from urdfkin.export.expression import Node, Number
from urdfkin.export.function import INPUTS, Function
from urdfkin.kinematics.roundings import (
    SINGLE_EPS,
    SINGLE_LARGEST,
    SINGLE_OPERATION,
    SINGLE_POLYNOMIAL,
    SINGLE_SMALLEST,
)
from urdfkin.model.tree import FloatArray

#: Maximum number of results in one backward pass, to limit the memory.
_MOST_RESULTS = 512
#: Derivatives of an operation's value with respect to its operands.
_SLOPES: dict[str, Callable[..., tuple[FloatArray | float, ...]]] = {
    "+": lambda value, x, y: (1.0, 1.0),
    "-": lambda value, x, y: (1.0, -1.0),
    "*": lambda value, x, y: (y, x),
    "/": lambda value, x, y: (1.0 / y, -value / y),
    "neg": lambda value, x: (-1.0,),
    "sin": lambda value, x: (np.cos(x),),
    "cos": lambda value, x: (-np.sin(x),),
    "sqrt": lambda value, x: (0.5 / value,),
}


@np.errstate(all="ignore")
def single_bounds(function: Function, inputs: Sequence[FloatArray]) -> FloatArray:
    """Return the bounds (n, results) on the errors in single precision, in eps = 2^-23.

    The inputs q (n, nq), v and a (n, nv) are single-precision numbers. The bounds do not include the rounding
    errors of the code's constants in double precision. A bound is inf if the code computes a number beyond
    the range of single precision.
    """
    value = function.values(inputs)
    bounds = np.zeros((len(inputs[0]), len(function.results)))
    for first in range(0, bounds.shape[1], _MOST_RESULTS):
        part = slice(first, first + _MOST_RESULTS)
        bounds[:, part] = _bounds(function, value, function.results[part], len(bounds))
    return bounds


def _bounds(
    function: Function, value: dict[Node, FloatArray], results: Sequence[Number], n: int
) -> FloatArray:
    bound, slopes = np.zeros((n, len(results))), dict[Node, FloatArray]()

    def propagate(x: Number, slope: FloatArray, columns: slice | int) -> None:
        """Add `slope` to the derivatives of the results with respect to the expression x.

        If x is a constant, add the error that its rounding causes to the bounds.
        """
        if not isinstance(x, Node):
            bound[:, columns] += np.abs(slope) * _constant(x)
        elif x in slopes:
            slopes[x][:, columns] += slope
        else:
            slopes[x] = np.zeros_like(bound)
            slopes[x][:, columns] = slope

    for k, x in enumerate(results):
        propagate(x, np.ones(n), k)
    for node in reversed(function.nodes):
        if (slope := slopes.pop(node, None)) is None:
            continue
        bound += np.abs(slope) * _operation(node, value[node])[:, np.newaxis]
        if node.op not in INPUTS:
            of = [value[x] if isinstance(x, Node) else x for x in node.of]
            for x, factor in zip(node.of, _SLOPES[node.op](value[node], *of), strict=True):
                propagate(x, slope * np.reshape(factor, (-1, 1)), slice(None))
    return np.where(np.isnan(bound), np.inf, bound)


def _operation(node: Node, x: FloatArray) -> FloatArray:
    """Return the rounding error (n,) of an operation with results x (n,), in eps."""
    size = np.abs(x)
    if node.op in INPUTS:
        error = np.zeros_like(size)
    elif node.op in ("sin", "cos"):
        error = np.maximum(SINGLE_OPERATION[node.op] * size, SINGLE_POLYNOMIAL)
    else:
        error = SINGLE_OPERATION[node.op] * size
    return _in_range(error, size)


def _constant(x: float) -> float:
    """Return the error of a constant that is rounded to single precision, in eps."""
    size = np.abs(x)
    return float(_in_range(np.abs(float(np.float32(x)) - x) / SINGLE_EPS, size))


def _in_range(error: FloatArray, size: FloatArray) -> FloatArray:
    """Add the error of each number that underflows; return inf for each number that overflows."""
    small = np.where((size > 0.0) & (size < 2.0 * SINGLE_SMALLEST), SINGLE_SMALLEST / SINGLE_EPS, 0.0)
    return np.where(size <= SINGLE_LARGEST, error + small, np.inf)
