"""`urdfkin completion`: shell completion of commands, options, robots, frames, tables and codes."""

from __future__ import annotations

from typing import Literal

import click
from click.shell_completion import get_completion_class

from urdfkin.cli.streams import say_file

SHELLS = ("bash", "zsh", "fish")
#: Environment variable with which a shell's script asks click for completions.
VARIABLE = "_URDFKIN_COMPLETE"


@click.command()
@click.argument("shell", type=click.Choice(SHELLS))
@click.pass_context
def command(context: click.Context, shell: Literal["bash", "zsh", "fish"]) -> None:
    """Print the completion script for a shell.

    The script completes commands, options and their choices, robots and files, the frames of the given robot,
    shipped tables, codes and equations. Frames are read from a URDF file; a .xacro file is not expanded. Add
    the line for your shell to its startup file:

    \b
    bash  ~/.bashrc   eval "$(urdfkin completion bash)"
    zsh   ~/.zshrc    eval "$(urdfkin completion zsh)"     after compinit
    fish              urdfkin completion fish > ~/.config/fish/completions/urdfkin.fish

    \b
    Example:
      urdfkin completion bash
    """  # noqa: D301 - a backspace tells click not to wrap the paragraph
    script = get_completion_class(shell)
    say_file(script(context.find_root().command, {}, "urdfkin", VARIABLE).source())
