"""Shared rules for options: number types, the output format, and options without effect.

- Numbers are decimal digits in ASCII. Click's own types also accept `1_000`, Arabic digits, `nan` and `inf`.
- The suffix of a file or --format selects the output format. A contradiction between them is an error.
- An option that has no effect in a command line is an error.
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
    """The type of a whole number in a range."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the text as an int."""
        if isinstance(value, str) and parse_int(value) is None:
            self.fail(f"{value!r} is not a whole number.", param, ctx)
        return super().convert(value, param, ctx)


class Number(click.types.FloatParamType):
    """The type of a finite number."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the text as a float."""
        return super().convert(_finite(self, value, param, ctx), param, ctx)


class NumberFrom(click.FloatRange):
    """The type of a finite number in a range."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the text as a float."""
        return super().convert(_finite(self, value, param, ctx), param, ctx)


def _finite(kind: Any, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
    if isinstance(value, str) and parse_float(value) is None:
        hint = remedy(value)
        kind.fail(f"{value!r} is not a finite number{f': {hint}' if hint else ''}.", param, ctx)
    return value


def format_from_suffix(
    context: click.Context, output: Path | None, endings: Mapping[str, Sequence[str]], plain: str
) -> str:
    """Return the output format of the running command.

    Args:
        context: Context of the command, which has a parameter `format_`.
        output: The file, or None for standard output.
        endings: For each suffix, its formats; the first one is the default.
        plain: Format of a file without a suffix.

    Raises:
        InputError: --format contradicts the suffix, or the suffix has no format.
    """
    format_: str = context.params["format_"]
    if output is None:
        return format_
    chosen = context.get_parameter_source("format_") is click.core.ParameterSource.COMMANDLINE
    ending = output.suffix.lower()
    if ending not in endings:
        if not chosen and ending:
            raise InputError(
                "no output format has this suffix",
                where=shortened(output),
                remedy=f"use {', '.join(endings)}, or add --format",
            )
        return format_ if chosen else plain
    if not chosen:
        return endings[ending][0]
    if format_ not in endings[ending]:
        raise InputError(
            f"--format {format_} contradicts the file's suffix",
            where=str(output),
            remedy="leave out --format, or give the file another name",
        )
    return format_


def typed(context: click.Context, name: str) -> bool:
    """Return whether a parameter of the running command was given on the command line."""
    return context.get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE


def reject_unused_options(context: click.Context, idle: Collection[str], because: str) -> None:
    """Reject options that were given on the command line but have no effect.

    Args:
        context: Context of the command.
        idle: Names of the parameters without effect.
        because: The condition under which they have no effect; it follows "does nothing" in the message.

    Raises:
        InputError: one of them was given on the command line.
    """
    for parameter in context.command.params:
        if parameter.name in idle and typed(context, parameter.name):
            name = "/".join([*parameter.opts[:1], *parameter.secondary_opts[:1]])
            raise InputError(f"{name} does nothing {because}", remedy="leave it out")
