"""An option that does nothing where it stands is an error: whoever gave it believes that it did something."""

from __future__ import annotations

from collections.abc import Collection

import click

from urdfkin.errors import InputError


def typed(context: click.Context, name: str) -> bool:
    """Whether a parameter of the running command was given on the command line."""
    return context.get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE


def refuse_idle(context: click.Context, idle: Collection[str], because: str) -> None:
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
