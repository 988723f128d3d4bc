"""Commands that compute a quantity of a frame, such as `urdfkin jacobian`: one for each row of the table."""

from __future__ import annotations

from typing import Any

import click

from urdfkin.cli.arguments import reference_option
from urdfkin.cli.breakdown import emit_breakdown
from urdfkin.cli.computing import Computing, computing_options
from urdfkin.cli.output import compiling
from urdfkin.verify.quantities import ACCELERATION_BREAKDOWN, Quantity

_ROBOT = (
    "ROBOT is a path (a table, .toml, .json or .csv, is made a robot), a name that `urdfkin robots` lists, or"
    " - for standard input."
)
_explain = click.option(
    "--explain", is_flag=True, help="Break it down by joint and kind; the parts sum to it."
)


def command_of(quantity: Quantity) -> click.Command:
    """The command that computes a quantity."""
    explained = ACCELERATION_BREAKDOWN.command == f"{quantity.command} --explain"

    own = [reference_option] if quantity.referred else []

    @computing_options(quantity.inputs, *own, last=(_explain,) if explained else ())
    def compute(
        context: click.Context, /, reference: str = "local_world_aligned", explain: bool = False, **_: Any
    ) -> None:
        run = Computing(context)
        x = run.inputs()
        with compiling():
            if explain:
                parts = run.robot.acceleration_breakdown(x.q, x.v, x.a, x.frame, reference, base=x.base)
            else:
                inputs = [getattr(x, letter) for letter in quantity.inputs]
                result = run.robot.compute(quantity.name, inputs, x.frame, reference, base=x.base)
        if explain:
            emit_breakdown(x, reference, parts, run.format_, run.output)
            run.end()
        run.answer(x, quantity, result, reference if quantity.referred else None)

    summary = f"{quantity.summary[0].upper()}{quantity.summary[1:]} (eq. {', '.join(quantity.equations)})."
    compute.__doc__ = f"{summary}\n\n{quantity.page}\n\n{_ROBOT}"
    return click.command(quantity.command, epilog=f"Example: {quantity.example}")(compute)
