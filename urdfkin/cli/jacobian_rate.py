"""`urdfkin jacobian-rate`: time derivative of a frame's velocity Jacobian (eq. 7.126)."""

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
    v_option,
    verify_option,
)
from urdfkin.cli.output import compiling, emit, exit_code, format_option, output_option

EXAMPLE = "urdfkin jacobian-rate panda --q random --v random --frame panda_hand"


@click.command(epilog=f"Example: {EXAMPLE}")
@robot_argument
@frame_option
@reference_option
@q_option
@v_option
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
    v: str,
    seed: int,
    verify: bool,
    format_: str,
    output: Path | None,
) -> None:
    """Time derivative of a frame's velocity Jacobian (eq. 7.126), for rates --v.

    A row of the table for each rate. In local_world_aligned, J a + J' v is the acceleration that
    `urdfkin acceleration` gives; in local and world it is the spatial acceleration.
    ROBOT is a path, a name that `urdfkin robots` lists, or - for standard input.
    """
    loaded = load_robot(robot, mimic, root_joint, verify=verify)
    x = read_inputs(loaded, frame, seed, q, v)
    with compiling():
        result = loaded.jacobian_rate(x.q, x.v, x.frame, reference)
    emit(x, "jacobian rate", reference, result, format_, output)
    context.exit(exit_code(loaded.certificate()))
