"""Validators of arguments. A validator returns the value in the proper type, or raises InputError."""

from __future__ import annotations

import math
import os
from decimal import Decimal
from numbers import Real
from operator import index
from pathlib import Path
from typing import Any, TypeGuard, TypeVar

from urdfkin.errors import InputError

_T = TypeVar("_T")


def as_int(value: object, name: str, minimum: int, maximum: float = math.inf) -> int:
    """Return `value` as an int from `minimum` to `maximum`.

    >>> as_int(True, "threads", 1)
    Traceback (most recent call last):
    urdfkin.errors.InputError: threads must be a whole number, at least 1: found True
    """
    try:
        number = index(None if isinstance(value, bool) else value)  # type: ignore[arg-type]
    except TypeError:
        raise InputError(
            f"{name} must be a whole number, at least {minimum}", found=safe_repr(value)
        ) from None
    if not minimum <= number <= maximum:
        beyond = (
            f"{name} must be at most {maximum}" if number > maximum else f"{name} must be at least {minimum}"
        )
        raise InputError(beyond, found=safe_repr(value))
    return number


def as_finite_float(value: object, name: str) -> float:
    """Return `value` as a finite float.

    >>> as_finite_float(1, "snap")
    1.0
    """
    if not is_real(value) or not math.isfinite(number := float_or_infinity(value)):
        raise InputError(f"{name} must be a finite number", found=safe_repr(value))
    return number


def is_real(value: object) -> TypeGuard[Real]:
    return isinstance(value, Real | Decimal) and not isinstance(value, bool)


def float_or_infinity(value: Any) -> float:
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf
    except ValueError:  # A signalling NaN of `Decimal`.
        return math.nan


def as_str(value: object, name: str) -> str:
    if not isinstance(value, str):
        raise InputError(f"{name} must be a name", found=safe_repr(value))
    return value


def as_choice(value: str | None, default: str, name: str) -> str:
    return default if value is None else as_str(value, name)


def as_names(value: Any, name: str) -> tuple[str, ...]:
    """Return a list of names as a tuple.

    The caller must check that each name exists.
    """
    if isinstance(value, str):
        raise InputError(
            f"{name} must be a list of names", found=safe_repr(value), remedy=f"write [{safe_repr(value)}]"
        )
    try:
        return tuple(value)
    except TypeError:
        raise InputError(f"{name} must be a list of names", found=safe_repr(value)) from None


def reject_set(value: object, name: str) -> None:
    """Raise InputError for a set, because the order of a set is random."""
    if isinstance(value, set | frozenset):
        raise InputError(
            f"{name} must have an order, and a set has none",
            found=safe_repr(value),
            remedy="give a list or a tuple",
        )


def as_bool(value: object, name: str) -> bool:
    if value is True or value is False:
        return value
    raise InputError(f"{name} must be True or False", found=safe_repr(value))


def as_path(value: object, name: str) -> Path:
    """Return `value` as a path.

    >>> as_path(None, "path")
    Traceback (most recent call last):
    urdfkin.errors.InputError: path must be the path of a file or folder: found None
    """
    try:
        text = os.fsencode(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        text = b""
    if not text or b"\0" in text:
        raise InputError(f"{name} must be the path of a file or folder", found=safe_repr(value))
    return Path(os.fsdecode(text))


def as_instance(value: object, kind: type[_T], name: str, remedy: str | None = None) -> _T:
    """Return `value` if its type is `kind`."""
    if not isinstance(value, kind):
        raise InputError(f"{name} must be a {kind.__name__}", found=safe_repr(value), remedy=remedy)
    return value


def safe_repr(value: object) -> str:
    try:
        text = repr(value)
        return text if len(text) <= 60 else f"{text[:57]}..."
    except Exception:
        # The repr of an int with 5,000 digits raises ValueError.
        return f"an object of type {type(value).__name__}"
