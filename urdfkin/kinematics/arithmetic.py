"""Copies of the equations with other basic operations, for compilers, NumPy arrays, lengths or LaTeX.

The functions of `urdfkin.kinematics.equations` compute with triples of numbers. `bound` copies these
functions and replaces their basic operations, such as `plus` and `cross`. This module needs no NumPy.
"""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType, SimpleNamespace
from typing import Any

from urdfkin.kinematics import equations

#: The basic operations on vectors. All other functions are composed of them.
VECTORS = ("plus", "minus", "times", "dot", "cross", "rotate", "transposed", "product")


def bound(
    *, made: Callable[[Callable[..., Any]], Any] = lambda function: function, **vectors: Any
) -> SimpleNamespace:
    """Return a namespace with a copy of every function of `equations` that uses other basic operations.

    Args:
        made: A decorator for each copied function, for example the decorator of a compiler.
        vectors: Basic operations to use instead of those of `equations`.

    >>> lengths = bound(plus=lambda x, y: x + y, cross=lambda x, y: x * y)
    >>> lengths.point_velocity(1.0, 2.0, 3.0)
    7.0
    """
    names: dict[str, Any] = {}
    for name, function in _functions():
        copy = FunctionType(function.__code__, names, name, function.__defaults__)
        copy.__doc__, copy.__module__ = function.__doc__, function.__module__
        names[name] = vectors.get(name) or made(copy)
    return SimpleNamespace(**names)


def _functions() -> list[tuple[str, FunctionType]]:
    return [(name, value) for name, value in vars(equations).items() if isinstance(value, FunctionType)]


#: The equations on NumPy arrays: a number is (...), a vector (..., 3) and a rotation (..., 3, 3).
