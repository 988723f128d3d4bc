"""Copies of the equations that use different basic operations, for example for NumPy arrays or LaTeX.

The functions of `urdfkin.kinematics.equations` compute with triples of numbers. Copies of these functions
compute with NumPy arrays, write LaTeX, or compute bounds. This module does not import NumPy.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import FunctionType, ModuleType, SimpleNamespace
from typing import Any

from urdfkin.kinematics import equations

#: Basic operations on vectors, of which all equations are composed.
VECTORS = ("plus", "minus", "times", "dot", "cross", "rotate", "transposed", "product")


def bound(
    *, decorate: Callable[[Callable[..., Any]], Any] = lambda function: function, **vectors: Any
) -> SimpleNamespace:
    """Return a namespace with copies of all functions of `equations`; the copies use other basic operations.

    The function `decorate` is applied to each copy. `vectors` are the basic operations by name.

    >>> lengths = bound(plus=lambda x, y: x + y, cross=lambda x, y: x * y)
    >>> lengths.point_velocity(1.0, 2.0, 3.0)
    7.0
    """
    return SimpleNamespace(**rebound(equations, decorate=decorate, others=vectors))


def rebound(
    *modules: ModuleType, decorate: Callable[[Callable[..., Any]], Any], others: Mapping[str, Any]
) -> dict[str, Any]:
    """Return copies of the functions of some modules, by name.

    A copy calls other copies instead of the original functions. If a function or module has the same name as
    an entry of `others`, the entry replaces it. The function `decorate`, for example a compiler, is applied
    to each copy. A module may use functions of the modules that are listed before it.
    """
    copies: dict[str, Any] = {}
    for module in modules:
        names = dict(vars(module))
        names |= {name: x for name, x in {**others, **copies}.items() if name in names}
        for name, function in vars(module).items():
            if isinstance(function, FunctionType) and function.__module__ == module.__name__:
                copy = FunctionType(function.__code__, names, name, function.__defaults__)
                copy.__doc__, copy.__module__ = function.__doc__, function.__module__
                names[name] = copies[name] = others.get(name) or decorate(copy)
    return copies
