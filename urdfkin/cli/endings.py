"""Which form a file gets: its ending says so, or --format, and never the two against each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import click

from urdfkin.errors import InputError
from urdfkin.system.files import shortened


def form_of(
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
