"""`urdfkin completion`: complete the words of a command in a shell. `urdfkin warm`: compile all kernels.

Completion runs at each press of the Tab key. It must be fast, so this module imports no large package.

A malicious name in a robot file, such as `$(...)`, could make the shell run a command. Completion therefore
offers only names without characters that a shell interprets.
"""

from __future__ import annotations

import re
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click
from click.shell_completion import CompletionItem, get_completion_class

from urdfkin.cli.streams import say, say_file_content
from urdfkin.errors import SourceError, UrdfkinError
from urdfkin.urdf.catalogue import catalogue

if TYPE_CHECKING:
    Items = list[CompletionItem[str]]

#: Completion offers only these names, because they contain no character that a shell interprets. The pattern
#: also excludes colons, because Bash separates words at colons.
_SAFE_NAME = re.compile(r"(?=\w)[\w./+-]+")
#: Maximum size (bytes) of a file from which shell completion reads frame names.
_MAX_BYTES = 10_000_000
#: XML elements that define frames. In a URDF, only elements directly below <robot> define frames.
_URDF, _MJCF = ("link", "joint"), ("body", "site", "joint")


def complete_robot(_context: click.Context, _parameter: click.Parameter, incomplete: str) -> Items:
    return [CompletionItem(incomplete, type="file"), *_items(catalogue(), incomplete)]


def complete_file(_context: click.Context, _parameter: click.Parameter, incomplete: str) -> Items:
    return [CompletionItem(incomplete, type="file")]


def complete_frame(context: click.Context, _parameter: click.Parameter, incomplete: str) -> Items:
    # During completion of an option, click has not parsed ROBOT. Completion therefore uses the first unparsed
    # argument as ROBOT.
    robot = context.params.get("robot") or next(iter(context.args), "")
    return _items(_frames(robot), incomplete)


def complete_table(_context: click.Context, _parameter: click.Parameter, incomplete: str) -> Items:
    from urdfkin.system.resources import robots_dir

    shipped = sorted(path.stem for path in (robots_dir() / "dh").glob("*.toml"))
    return [CompletionItem(incomplete, type="file"), *_items(shipped, incomplete)]


def complete_code(_context: click.Context, _parameter: click.Parameter, incomplete: str) -> Items:
    from urdfkin.urdf.lint.pages import URDF_RULES

    return _items((name for rule in URDF_RULES.values() for name in (rule.id, rule.slug)), incomplete)


def complete_topic(context: click.Context, parameter: click.Parameter, incomplete: str) -> Items:
    from urdfkin.kinematics.registry import equations

    return [*complete_code(context, parameter, incomplete), *_items(equations(), incomplete)]


def _items(names: Iterable[str], incomplete: str) -> Items:
    return [
        CompletionItem(name)
        for name in names
        if name.startswith(incomplete) and _SAFE_NAME.fullmatch(name) is not None
    ]


def _frames(word: str) -> Iterator[str]:
    from urdfkin.urdf.findings import Reporter
    from urdfkin.urdf.parser import read_document
    from urdfkin.urdf.sources import is_xacro, read_source

    if is_xacro(word) or not (word in catalogue() or Path(word).expanduser().is_file()):
        return
    try:
        text = read_source(word, _MAX_BYTES)
        root = read_document(Reporter(text.label, text.data))
    except (UrdfkinError, OSError):
        return
    if root is None:
        return
    elements, kinds = (root.walk(), _MJCF) if root.tag == "mujoco" else (root.children, _URDF)
    names = (element.attributes.get("name", "") for element in elements if element.tag in kinds)
    yield from dict.fromkeys(names)


@click.command()
@click.argument("shell", type=click.Choice(("bash", "zsh", "fish")))
@click.pass_context
def completion_command(context: click.Context, shell: Literal["bash", "zsh", "fish"]) -> None:
    """Print the completion script for a shell.

    The script completes commands, options and the choices of options. It also completes robots, files,
    reference tables, codes of findings, numbers of equations, and the frames of the robot on the command
    line. Frames are read from a URDF or MJCF file, but a .xacro file is not expanded. To activate the script,
    add the line for your shell to its startup file:

    \b
    bash  ~/.bashrc   eval "$(urdfkin completion bash)"
    zsh   ~/.zshrc    eval "$(urdfkin completion zsh)"     after compinit
    fish              urdfkin completion fish > ~/.config/fish/completions/urdfkin.fish

    \b
    Example:
      urdfkin completion bash
    """  # noqa: D301  click needs the character "\b"
    script = get_completion_class(shell)
    # The variable _URDFKIN_COMPLETE makes click print completions.
    say_file_content(script(context.find_root().command, {}, "urdfkin", "_URDFKIN_COMPLETE").source())


@click.command(epilog="Example: urdfkin warm")
def warm_command() -> None:
    """Compile all kernels (machine code) and store them, for container images and CI.

    Without this command, urdfkin computes in plain Python at first. It compiles a kernel when plain Python
    needs more than a second in total, for example for a large batch. Each compilation takes some seconds.
    Kernels are stored below XDG_CACHE_HOME. On another processor, the kernels are compiled again.

    Exit 0: all kernels are stored. 2: the kernels cannot be stored.
    """
    from urdfkin.compiled.kernel_cache import kernel_cache_folder, listen_to_compile_events
    from urdfkin.compiled.machine import kernels
    from urdfkin.compiled.machine.single import one_configuration
    from urdfkin.verify.comparison import load_kernels

    folder = kernel_cache_folder()
    if folder is None:
        raise SourceError(
            "no folder to store compiled kernels in",
            remedy="set XDG_CACHE_HOME to a folder that only you can write to",
        )
    begin, before = time.perf_counter(), set(folder.glob("*.kernel"))

    def print_compile_event(name: str, seconds: float | None) -> None:
        say(f"compiling {name} ..." if seconds is None else f"compiled {name} in {seconds:.1f} s", err=True)

    with listen_to_compile_events(print_compile_event):
        load_kernels()
        for kernel in (kernels.hessians, kernels.imus, one_configuration):
            _ = kernel.compiled_function
    stored = set(folder.glob("*.kernel"))
    if new := stored - before:
        say(f"{len(new)} of {len(stored)} kernels compiled in {time.perf_counter() - begin:.0f} s: {folder}")
    else:
        say(f"all {len(stored)} kernels are compiled: {folder}")
