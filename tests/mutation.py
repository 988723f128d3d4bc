"""Make a function slightly wrong for a test, in every module that has imported it.

The code of the function object is replaced, so every reference to the function calls the wrong code.
"""

import inspect
import types
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

#: Size of the change of a result: far larger than rounding errors, far smaller than a visible error.
SIZE = 1e-10

_originals: dict[str, Callable[..., Any]] = {}
_generator = np.random.default_rng(0)


@contextmanager
def slightly_wrong(function: Any) -> Iterator[None]:
    """Add random errors of about `SIZE` to the results of each call while the context is open."""
    function = inspect.unwrap(function)  # A decorator such as `range_checked` calls the wrong code, too.
    key = f"{function.__module__}.{function.__qualname__}"
    code = function.__code__
    original = types.FunctionType(
        code, function.__globals__, function.__name__, function.__defaults__, function.__closure__
    )
    original.__kwdefaults__ = function.__kwdefaults__
    _originals[key] = original
    namespace: dict[str, Any] = {}
    exec(
        f"def stand_in(*args, **kwargs):\n    import tests.mutation\n"
        f"    return tests.mutation.call_wrong({key!r}, args, kwargs)",
        namespace,
    )
    function.__code__ = namespace["stand_in"].__code__
    try:
        yield
    finally:
        function.__code__ = code
        del _originals[key]


def call_wrong(key: str, args: tuple[Any, ...], kwargs: dict[str, Any]) -> Any:
    """Call the original function, and change its result."""
    return _spoiled(_originals[key](*args, **kwargs))


def _spoiled(value: Any) -> Any:
    if isinstance(value, np.ndarray | float):
        array = np.asarray(value, dtype=np.float64)
        return array + SIZE * (1.0 + np.abs(array)) * _generator.uniform(0.5, 1.5, array.shape)
    if isinstance(value, tuple):
        return tuple(_spoiled(item) for item in value)
    if is_dataclass(value) and not isinstance(value, type):
        return type(value)(*(_spoiled(getattr(value, field.name)) for field in fields(value)))
    return value
