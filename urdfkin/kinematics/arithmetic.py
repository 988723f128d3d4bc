"""Copies of the equations with other basic operations, for compilers, NumPy arrays, lengths or LaTeX.

The functions of `urdfkin.kinematics.equations` compute with triples of numbers. `bound` copies these
functions and replaces their basic operations, such as `plus` and `cross`. This module needs no NumPy.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import FunctionType, ModuleType, SimpleNamespace
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
    return SimpleNamespace(**rebound(equations, made=made, others=vectors))


def rebound(
    *modules: ModuleType, made: Callable[[Callable[..., Any]], Any], others: Mapping[str, Any]
) -> dict[str, Any]:
    """Return a copy of each function of some modules, by name; the copies use other functions and each other.

    Args:
        modules: The modules; each may use functions of those before it.
        made: A decorator for each copied function, for example a compiler's.
        others: Functions and modules to use instead of those that a module imports or defines.
    """
    copies: dict[str, Any] = {}
    for module in modules:
        names = dict(vars(module))
        names |= {name: x for name, x in {**others, **copies}.items() if name in names}
        for name, function in vars(module).items():
            if isinstance(function, FunctionType) and function.__module__ == module.__name__:
                copy = FunctionType(function.__code__, names, name, function.__defaults__)
                copy.__doc__, copy.__module__ = function.__doc__, function.__module__
                names[name] = copies[name] = others.get(name) or made(copy)
    return copies
