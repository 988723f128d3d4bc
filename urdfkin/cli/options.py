"""Numbers on the command line: decimal digits in ASCII, by the parser of every other number a user writes.

Click's own types take `1_000`, Arabic digits, `nan` and `inf`.


Which form a file gets: its ending says so, or --format, and never the two against each other.

An option that does nothing where it stands is an error: whoever gave it believes that it did something.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import click

from urdfkin.errors import InputError
from urdfkin.errors.numbers import parse_float, parse_int, remedy
from urdfkin.system.files import shortened


class Whole(click.IntRange):
    """A whole number in a range."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """What was typed, as an int."""
        if isinstance(value, str) and parse_int(value) is None:
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
    if isinstance(value, str) and parse_float(value) is None:
        hint = remedy(value)
        kind.fail(f"{value!r} is not a finite number{f': {hint}' if hint else ''}.", param, ctx)
    return value


def format_from_suffix(
    context: click.Context, output: Path | None, endings: Mapping[str, Sequence[str]], plain: str
) -> str:
    """The form in which the running command writes.

    Args:
        context: The command's, with a parameter `format_`.
        output: The file, or None for standard output.
        endings: The forms that go with each ending, the usual one first.
        plain: What a file without an ending gets.

    Raises:
        InputError: --format contradicts the ending, or no form has it.
    """
    asked: str = context.params["format_"]
    if output is None:
        return asked
    chosen = context.get_parameter_source("format_") is click.core.ParameterSource.COMMANDLINE
    ending = output.suffix.lower()
    if ending not in endings:
        if not chosen and ending:
            raise InputError(
                "no form has that ending",
                where=shortened(output),
                remedy=f"there are {', '.join(endings)}; or say --format",
            )
        return asked if chosen else plain
    if not chosen:
        return endings[ending][0]
    if asked not in endings[ending]:
        raise InputError(
            f"--format {asked} contradicts the ending",
            where=str(output),
            remedy="leave out --format, or give the file another name",
        )
    return asked


def typed(context: click.Context, name: str) -> bool:
    """Whether a parameter of the running command was given on the command line."""
    return context.get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE


def reject_unused_options(context: click.Context, idle: Collection[str], because: str) -> None:
    """Refuse options of the running command that were typed and have no effect.

    Args:
        context: The command's.
        idle: Names of its parameters, as its function calls them.
        because: Where they have no effect, to follow "does nothing".

    Raises:
        InputError: one of them was given on the command line.
    """
    for parameter in context.command.params:
        if parameter.name in idle and typed(context, parameter.name):
            name = "/".join([*parameter.opts[:1], *parameter.secondary_opts[:1]])
            raise InputError(f"{name} does nothing {because}", remedy="leave it out")
