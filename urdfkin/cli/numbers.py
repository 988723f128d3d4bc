"""Numbers on the command line: decimal digits in ASCII, by the parser of every other number a user writes.

Click's own types take `1_000`, Arabic digits, `nan` and `inf`.
"""

from __future__ import annotations

from typing import Any

import click

from urdfkin.errors.numerals import decimal, remedy, whole


class Whole(click.IntRange):
    """A whole number in a range."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """What was typed, as an int."""
        if isinstance(value, str) and whole(value) is None:
            self.fail(f"{value!r} is not a whole number.", param, ctx)
        return super().convert(value, param, ctx)


class Number(click.types.FloatParamType):
    """A finite number."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """What was typed, as a float."""
        return super().convert(_finite(self, value, param, ctx), param, ctx)


class NumberFrom(click.FloatRange):
    """A finite number in a range."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """What was typed, as a float."""
        return super().convert(_finite(self, value, param, ctx), param, ctx)


def _finite(kind: Any, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
    if isinstance(value, str) and decimal(value) is None:
        hint = remedy(value)
        kind.fail(f"{value!r} is not a finite number{f': {hint}' if hint else ''}.", param, ctx)
    return value
