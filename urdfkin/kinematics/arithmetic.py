"""Copies of `urdfkin.kinematics.equations` that call other functions.

For example, the copies in `urdfkin.kinematics.number_kinds.array_equations` call `np.add` instead of `plus`.

This module does not import NumPy.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import FunctionType, ModuleType, SimpleNamespace
from typing import Any

from urdfkin.kinematics import equations

VECTOR_OPERATIONS = ("plus", "minus", "times", "dot", "cross", "rotate", "transposed", "product")


def bind_equations(
    *, decorate: Callable[[Callable[..., Any]], Any] = lambda function: function, **vectors: Any
) -> SimpleNamespace:
    """Return copies of the functions in `equations` that call the replacements `vectors`.

    >>> lengths = bind_equations(plus=lambda x, y: x + y, cross=lambda x, y: x * y)
    >>> lengths.point_velocity(1.0, 2.0, 3.0)
    7.0
    """
    return SimpleNamespace(**rebind_functions(equations, decorate=decorate, replacements=vectors))


def rebind_functions(
    *modules: ModuleType, decorate: Callable[[Callable[..., Any]], Any], replacements: Mapping[str, Any]
) -> dict[str, Any]:
    """Return copies of all functions of the modules, by name.

    Each copy calls copied functions and replacements instead of the original functions. A replacement is not
    decorated.

    Args:
        modules: Modules, each after the modules from which it imports.
        decorate: Decorator of each copy.
        replacements: Functions or modules by name.
    """
    copies: dict[str, Any] = {}
    for module in modules:
        names = dict(vars(module))
        names |= {name: x for name, x in {**replacements, **copies}.items() if name in names}
        for name, function in vars(module).items():
            if isinstance(function, FunctionType) and function.__module__ == module.__name__:
                copy = FunctionType(function.__code__, names, name, function.__defaults__)
                copy.__doc__, copy.__module__ = function.__doc__, function.__module__
                names[name] = copies[name] = replacements.get(name) or decorate(copy)
    return copies
