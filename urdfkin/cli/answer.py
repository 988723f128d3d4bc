"""Commands about a path between two frames: print or write the result, then exit with its code."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import click

from urdfkin.cli.arguments import forms, load_robot, path_options, robot_argument, together, verify_option
from urdfkin.cli.options import format_from_suffix
from urdfkin.cli.output import end_of_path, hand_out, output_option
from urdfkin.cli.streams import say, say_file

if TYPE_CHECKING:
    pass


@dataclass(frozen=True)
class Answer:
    """The result of a command about a path.

    Attributes:
        show: Prints the result.
        writers: For each format, the function that returns the result as text. Its argument is the line of
            the check, or None.
        check: The result of the check; None where nothing was checked.
    """

    show: Callable[[], None]
    writers: Mapping[str, Callable[[str | None], str]]
    check: str | None


def path_command(
    name: str,
    example: str,
    names: tuple[str, ...],
    *options: Any,
    endings: Mapping[str, tuple[str, ...]] | None = None,
) -> Callable[[Callable[..., Answer]], click.Command]:
    """Make a command from a function that receives the robot and the options and returns an `Answer`."""

    def decorate(function: Callable[..., Answer]) -> click.Command:
        @robot_argument
        @together(path_options, *options, forms(*names), verify_option, output_option, click.pass_context)
        def command(
            context: click.Context, robot: str, format_: str, verify: bool, output: Any, **values: Any
        ) -> None:
            form = format_ if endings is None else format_from_suffix(context, output, endings, "csv")
            found = function(load_robot(robot, verify=verify), verify=verify, **values)
            line, code = end_of_path(found.check)
            if form == names[0] and output is None:
                found.show()
                say(line)
            else:
                text = found.writers[form if form in found.writers else "csv"](line if found.check else None)
                hand_out(text.encode(), output) if output is not None else say_file(text)
                say(line, err=True)
            context.exit(code)

        command.__doc__ = function.__doc__
        return click.command(name, epilog=f"Example: {example}")(command)

    return decorate
