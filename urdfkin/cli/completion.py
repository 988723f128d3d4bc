"""Shell completion of commands, options, robots, files, frames, tables, codes and equations.

Completion runs at each press of the Tab key, so it imports nothing heavy and reads only the names in a file.
Completion does not offer names with characters that a shell interprets, such as `$(...)`. Such a name in a
malicious file could make the shell run a command.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click
from click.shell_completion import CompletionItem, get_completion_class

from urdfkin.cli.streams import say_file
from urdfkin.errors import UrdfkinError
from urdfkin.urdf.catalogue import catalogue

if TYPE_CHECKING:
    Items = list[CompletionItem[str]]

#: Completion offers a name without quotes, blanks, and characters that a shell expands.
#: A name with a colon does not match, because bash separates words at colons.
_HARMLESS = re.compile(r"(?=\w)[\w./+-]+")
#: A larger file (bytes) is not read for its names.
_MOST = 10_000_000
#: The `name` of these XML elements is a frame.
#: They are children of the root element in a URDF, and at any depth in an MJCF file.
_URDF, _MJCF = ("link", "joint"), ("body", "site", "joint")


def complete_robot(_context: click.Context, _parameter: click.Parameter, incomplete: str) -> Items:
    return [CompletionItem(incomplete, type="file"), *_offered(catalogue(), incomplete)]


def complete_file(_context: click.Context, _parameter: click.Parameter, incomplete: str) -> Items:
    return [CompletionItem(incomplete, type="file")]


def complete_frame(context: click.Context, _parameter: click.Parameter, incomplete: str) -> Items:
    """Return the names of the links and joints of the robot that the user has typed as ROBOT."""
    # While the user types the value of an option, click does not yet know the command's arguments.
    robot = context.params.get("robot") or next(iter(context.args), "")
    return _offered(_frames(robot), incomplete)


def complete_table(_context: click.Context, _parameter: click.Parameter, incomplete: str) -> Items:
    from urdfkin.system.resources import robots_dir

    shipped = sorted(path.stem for path in (robots_dir() / "dh").glob("*.toml"))
    return [CompletionItem(incomplete, type="file"), *_offered(shipped, incomplete)]


def complete_code(_context: click.Context, _parameter: click.Parameter, incomplete: str) -> Items:
    from urdfkin.urdf.lint.pages import RULES

    return _offered((name for rule in RULES.values() for name in (rule.id, rule.slug)), incomplete)


def complete_topic(context: click.Context, parameter: click.Parameter, incomplete: str) -> Items:
    from urdfkin.kinematics.registry import equations

    return [*complete_code(context, parameter, incomplete), *_offered(equations(), incomplete)]


def _offered(names: Iterable[str], incomplete: str) -> Items:
    return [
        CompletionItem(name)
        for name in names
        if name.startswith(incomplete) and _HARMLESS.fullmatch(name) is not None
    ]


def _frames(word: str) -> Iterator[str]:
    """Yield the frame names in a robot's file, without expanding or computing anything."""
    from urdfkin.urdf.findings import Reporter
    from urdfkin.urdf.parser import read_document
    from urdfkin.urdf.sources import is_xacro, read_source

    if is_xacro(word) or not (word in catalogue() or Path(word).expanduser().is_file()):
        return
    try:
        text = read_source(word, _MOST)
        root = read_document(Reporter(text.label, text.data))
    except (UrdfkinError, OSError):
        return
    if root is None:
        return
    elements, kinds = (root.walk(), _MJCF) if root.tag == "mujoco" else (root.children, _URDF)
    names = (element.attributes.get("name", "") for element in elements if element.tag in kinds)
    yield from dict.fromkeys(names)


SHELLS = ("bash", "zsh", "fish")
#: If the completion script sets this environment variable, click prints completions.
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
