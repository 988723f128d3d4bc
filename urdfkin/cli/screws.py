"""`urdfkin screws`: a path's product of exponentials, checked, as text and code."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import click

from urdfkin.cli.answer import Answer, path_command
from urdfkin.cli.options import Whole

if TYPE_CHECKING:
    from urdfkin.robot import Robot

FORMS = ("terminal", "latex", "toml", "json", "numpy", "matlab")
_digits = click.option(
    "--digits", type=Whole(3, 17), default=10, show_default=True, help="Number of significant digits."
)


@path_command("screws", "urdfkin screws ur5 --tip tool0", FORMS, _digits)
def command(robot: Robot, base: str | None, tip: str | None, digits: int, verify: bool) -> Answer:
    """Derive the product of exponentials of a path in the notation of Lynch and Park.

    The result is the pose M in the zero configuration, and each joint's screw in space and body axes. A
    screw is (w, v), angular part first; generated code has the screws as columns of Slist and Blist. Every
    command accepts the toml or json output as a robot. A handwritten file needs M, and space or body.

    Exit 0: verified. 1: a disagreement. 2: bad input. 3: not checked.
    """
    from urdfkin.cli.streams import say  # noqa: PLC0415  keeps --help fast
    from urdfkin.dh.export.toolboxes import write_screws  # noqa: PLC0415
    from urdfkin.verify.chain_checks import check_screws  # noqa: PLC0415

    screws = robot.screws(tip, base, verify=False)

    def write(form: str, line: str | None) -> str:
        text = write_screws(screws, form, digits)
        return f"{text}\n{line}\n" if form == "terminal" else text

    def show() -> None:
        for one in write("terminal", "").splitlines()[:-1]:
            say(one)

    check = check_screws(robot.verifier, screws) if verify else None
    return Answer(show, {form: partial(write, form) for form in FORMS}, check)
