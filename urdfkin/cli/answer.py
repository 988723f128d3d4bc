"""What a command about a path or a frame answers, and the one way in which it is shown, written and ended."""

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
    """What was found.

    Attributes:
        show: Prints it.
        written: By the name of a form, what writes it.
        said: What the check said; None where nothing was checked.
    """

    show: Callable[[], None]
    written: Mapping[str, Callable[[str | None], str]]
    said: str | None


def path_command(
    name: str,
    example: str,
    names: tuple[str, ...],
    *options: Any,
    endings: Mapping[str, tuple[str, ...]] | None = None,
) -> Callable[[Callable[..., Answer]], click.Command]:
    """A command about a path: its function gets the robot and its options, and gives an answer."""

    def decorate(function: Callable[..., Answer]) -> click.Command:
        @robot_argument
        @together(path_options, *options, forms(*names), verify_option, output_option, click.pass_context)
        def command(
            context: click.Context, robot: str, format_: str, verify: bool, output: Any, **asked: Any
        ) -> None:
            form = format_ if endings is None else format_from_suffix(context, output, endings, "csv")
            found = function(load_robot(robot, verify=verify), verify=verify, **asked)
            line, code = end_of_path(found.said)
            if form == names[0] and output is None:
                found.show()
                say(line)
            else:
                text = found.written[form if form in found.written else "csv"](line if found.said else None)
                hand_out(text.encode(), output) if output is not None else say_file(text)
                say(line, err=True)
            context.exit(code)

        command.__doc__ = function.__doc__
        return click.command(name, epilog=f"Example: {example}")(command)

    return decorate
