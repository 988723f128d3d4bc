"""Commands that compute a quantity of a frame, such as `urdfkin jacobian`: one for each row of the table."""

from __future__ import annotations

from pathlib import Path

import click

from urdfkin.cli.arguments import (
    a_option,
    frame_option,
    load_robot,
    oracle_option,
    q_option,
    read_inputs,
    reference_option,
    robot_argument,
    seed_option,
    together,
    v_option,
    verify_option,
)
from urdfkin.cli.base import base_options, with_base
from urdfkin.cli.breakdown import emit_breakdown
from urdfkin.cli.endings import form_of
from urdfkin.cli.output import ENDINGS, compiling, emit, exit_code, format_option, output_option
from urdfkin.cli.reports import check_writable
from urdfkin.verify.quantities import ACCELERATION_BREAKDOWN, Quantity
from urdfkin.verify.witnesses import WitnessName

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

    @click.pass_context
    def compute(
        context: click.Context,
        /,
        robot: str,
        frame: str | None,
        seed: int,
        verify: bool,
        oracle: WitnessName,
        format_: str,
        output: Path | None,
        q: str,
        v: str = "neutral",
        a: str = "neutral",
        base_placement: str | None = None,
        base_velocity: str | None = None,
        base_acceleration: str | None = None,
        reference: str = "local_world_aligned",
        explain: bool = False,
    ) -> None:
        format_ = form_of(context, output, ENDINGS, "csv")
        check_writable(output)
        loaded = load_robot(robot, verify=verify, oracle=oracle)
        x = read_inputs(loaded, frame, seed, q, v, a)
        x = with_base(x, base_placement, base_velocity, base_acceleration)
        if explain:
            with compiling():
                parts = loaded.acceleration_breakdown(x.q, x.v, x.a, x.frame, reference, base=x.base)
            emit_breakdown(x, reference, parts, format_, output)
        else:
            inputs = [getattr(x, letter) for letter in quantity.inputs]
            with compiling():
                result = loaded.compute(quantity.name, inputs, x.frame, reference, base=x.base)
            emit(x, quantity, reference if quantity.referred else None, result, format_, output)
        context.exit(exit_code(loaded.certificate()))

    rates = [option for letter, option in (("v", v_option), ("a", a_option)) if letter in quantity.inputs]
    options = together(
        *(robot_argument, frame_option, *([reference_option] if quantity.referred else []), q_option, *rates),
        base_options(quantity.inputs),
        *(
            seed_option,
            verify_option,
            oracle_option,
            *([_explain] if explained else []),
            format_option,
            output_option,
        ),
    )
    summary = f"{quantity.summary[0].upper()}{quantity.summary[1:]} (eq. {', '.join(quantity.equations)})."
    compute.__doc__ = f"{summary}\n\n{quantity.page}\n\n{_ROBOT}"
    return click.command(quantity.command, epilog=f"Example: {quantity.example}")(options(compute))
