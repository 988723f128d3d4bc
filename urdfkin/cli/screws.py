"""`urdfkin screws`: the product of exponentials of a path, checked, as text and code."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import click

from urdfkin.cli.answer import Answer, path_command
from urdfkin.cli.options import Whole

if TYPE_CHECKING:
    from urdfkin.robot import Robot

FORMS = ("terminal", "latex", "toml", "json", "numpy", "matlab")
_digits = click.option("--digits", type=Whole(3, 17), default=10, show_default=True, help="Significant.")


@path_command("screws", "urdfkin screws ur5 --tip tool0", FORMS, _digits)
def command(robot: Robot, base: str | None, tip: str | None, digits: int, verify: bool) -> Answer:
    """Home pose M and a screw for each joint, in space and body, as Lynch and Park have them.

    Screws are (w, v), angular first; code has them as columns, Slist and Blist. A file that is written as
    toml or json is a robot for every command, and so is one with M and space, or body, written by hand.

    Exit 0: verified. 1: a disagreement. 2: bad input. 3: not checked.
    """
    from urdfkin.cli.streams import say  # noqa: PLC0415  keeps --help fast
    from urdfkin.dh.export.screws import write_screws  # noqa: PLC0415
    from urdfkin.verify.chain_checks import check_screws  # noqa: PLC0415

    screws = robot.screws(tip, base, verify=False)

    def written(form: str, line: str | None) -> str:
        text = write_screws(screws, form, digits)
        return f"{text}\n{line}\n" if form == "terminal" else text

    def show() -> None:
        for one in written("terminal", "").splitlines()[:-1]:
            say(one)

    said = check_screws(robot.verifier, screws) if verify else None
    return Answer(show, {form: partial(written, form) for form in FORMS}, said)
