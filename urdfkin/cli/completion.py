"""`urdfkin completion`: what makes a shell complete commands, options, robots, frames, tables and codes."""

from __future__ import annotations

from typing import Literal

import click
from click.shell_completion import get_completion_class

from urdfkin.cli.streams import say_file

SHELLS = ("bash", "zsh", "fish")
#: What a shell's script asks by; click looks for it under this name.
VARIABLE = "_URDFKIN_COMPLETE"


@click.command()
@click.argument("shell", type=click.Choice(SHELLS))
@click.pass_context
def command(context: click.Context, shell: Literal["bash", "zsh", "fish"]) -> None:
    """Print the script that makes a shell complete what is typed after urdfkin.

    Commands, options and their choices, robots and files, frames of the robot that was typed, shipped tables,
    codes and equations. Frames are read from a URDF's text; a .xacro file is not expanded for it. Put the
    line for your shell where it is read at the start:

    \b
    bash  ~/.bashrc   eval "$(urdfkin completion bash)"
    zsh   ~/.zshrc    eval "$(urdfkin completion zsh)"     after compinit
    fish              urdfkin completion fish > ~/.config/fish/completions/urdfkin.fish

    \b
    Example:
      urdfkin completion bash
    """  # noqa: D301 - click's mark for a paragraph to leave alone is a backspace
    script = get_completion_class(shell)
    say_file(script(context.find_root().command, {}, "urdfkin", VARIABLE).source())
