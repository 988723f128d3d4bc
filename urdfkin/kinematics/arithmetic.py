"""The equations bound to another kind of vector, or to another kind of function.

`urdfkin.kinematics.equations` computes with triples of numbers. Where a vector is something else, an array, a
length, a piece of LaTeX, the same functions run with other ones in the place of `plus`, `cross` and the like.
"""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType, SimpleNamespace
from typing import Any

from urdfkin.kinematics import equations

#: The functions on vectors, which all others are made of.
VECTORS = ("plus", "minus", "times", "dot", "cross", "rotate", "transposed", "product")


def bound(
    *, made: Callable[[Callable[..., Any]], Any] = lambda function: function, **vectors: Any
) -> SimpleNamespace:
    """Every function of `equations`, under its name, computing with what is given here.

    Args:
        made: What becomes of each function, a compiler's decorator for instance.
        vectors: Functions to use instead of those of `equations`.

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
