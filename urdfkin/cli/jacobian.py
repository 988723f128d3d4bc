"""`urdfkin jacobian`: velocity Jacobian of a frame (eq. 7.85)."""

from __future__ import annotations

from pathlib import Path

import click

from urdfkin.cli.arguments import (
    frame_option,
    load_robot,
    q_option,
    read_inputs,
    reference_option,
    robot_argument,
    seed_option,
    verify_option,
)
from urdfkin.cli.output import compiling, emit, exit_code, format_option, output_option

EXAMPLE = "urdfkin jacobian panda --q random --seed 1 --frame panda_hand"


@click.command(epilog=f"Example: {EXAMPLE}")
@robot_argument
@frame_option
@reference_option
@q_option
@seed_option
@verify_option
@format_option
@output_option
@click.pass_context
def command(
    context: click.Context,
    robot: str,
    mimic: bool | None,
    root_joint: str | None,
    frame: str | None,
    reference: str,
    q: str,
    seed: int,
    verify: bool,
    format_: str,
    output: Path | None,
) -> None:
    """Velocity Jacobian of a frame (eq. 7.85).

    A row of the table for each rate: the velocity it alone causes.
    ROBOT is a path, a name that `urdfkin robots` lists, or - for standard input.
    """
    loaded = load_robot(robot, mimic, root_joint, verify=verify)
    x = read_inputs(loaded, frame, seed, q)
    with compiling():
        result = loaded.jacobian(x.q, x.frame, reference)
    emit(x, "jacobian", reference, result, format_, output)
    context.exit(exit_code(loaded.certificate()))
