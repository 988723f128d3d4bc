"""What an argument has to be: a whole number, a number, a word, True or False; or an InputError says so."""

from __future__ import annotations

import math
from decimal import Decimal
from numbers import Real
from typing import Any, TypeGuard

from urdfkin.errors import InputError


def whole_number(value: object, name: str, least: int, most: float = math.inf) -> int:
    """`value` as an int from `least` to `most`.

    >>> whole_number(3, "threads", 1)
    3
    >>> whole_number(True, "threads", 1)
    Traceback (most recent call last):
    urdfkin.errors.InputError: threads is a whole number from 1 on: found True
    """
    if type(value) is int:  # what is nearly always the case
        number = value
    elif isinstance(value, bool) or not hasattr(type(value), "__index__"):
        raise InputError(f"{name} is a whole number from {least} on", found=safe_repr(value))
    else:
        try:
            number = value.__index__()  # type: ignore[attr-defined]
        except TypeError:  # an array has the method, but is no number
            raise InputError(f"{name} is a whole number from {least} on", found=safe_repr(value)) from None
    if not least <= number <= most:
        beyond = f"{name} is at most {most}" if number > most else f"{name} must be at least {least}"
        raise InputError(beyond, found=safe_repr(value))
    return number


def real_number(value: object, name: str) -> float:
    """`value` as a finite float.

    >>> real_number(1, "snap")
    1.0
    """
    if not is_real(value) or not math.isfinite(number := as_float(value)):
        raise InputError(f"{name} is a finite number", found=safe_repr(value))
    return number


def is_real(value: object) -> TypeGuard[Real]:
    """Whether something is one real number: text, truth values and missing numbers are none."""
    return isinstance(value, Real | Decimal) and not isinstance(value, bool)


def as_float(value: Any) -> float:
    """The nearest float; inf beyond their range."""
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def as_str(value: object, name: str) -> str:
    """`value`, which is text."""
    if not isinstance(value, str):
        raise InputError(f"{name} is a name", found=safe_repr(value))
    return value


def as_choice(value: str | None, default: str, name: str) -> str:
    """`value`, which is text, or the default for None."""
    return default if value is None else as_str(value, name)


def as_names(value: Any, name: str) -> tuple[str, ...]:
    """`value` as a tuple of what should be names: whoever looks them up says which is none."""
    if isinstance(value, str):
        raise InputError(
            f"{name} are a list of names", found=safe_repr(value), remedy=f"write [{safe_repr(value)}]"
        )
    try:
        return tuple(value)
    except TypeError:
        raise InputError(f"{name} are a list of names", found=safe_repr(value)) from None


def as_bool(value: object, name: str) -> bool:
    """`value`, which is True or False."""
    if value is True or value is False:
        return value
    raise InputError(f"{name} is True or False", found=safe_repr(value))


def safe_repr(value: object) -> str:
    """What was found, for a message, at a length that a line can hold."""
    try:
        return repr(value)[:60]
    except Exception:  # a repr may fail in any way, that of an int with 5,000 digits does
        return f"an object of type {type(value).__name__}"
