"""`urdfkin velocity`: velocity of a frame, [linear; angular] (eq. 7.127, 7.128)."""

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

EXAMPLE = "urdfkin velocity ur5 --q random --v 1,0,0,0,0,0 --frame tool0"


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
    """Velocity of a frame, [linear; angular] (eq. 7.127, 7.128).

    Of the frame's origin in m/s and about it in rad/s, for joint rates --v.
    ROBOT is a path, a name that `urdfkin robots` lists, or - for standard input.
    """
    loaded = load_robot(robot, mimic, root_joint, verify=verify)
    x = read_inputs(loaded, frame, seed, q, v)
    with compiling():
        result = loaded.velocity(x.q, x.v, x.frame, reference)
    emit(x, "velocity", reference, result, format_, output)
    context.exit(exit_code(loaded.certificate()))
