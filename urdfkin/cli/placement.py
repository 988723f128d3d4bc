"""`urdfkin placement`: pose of a frame: T_world_frame (eq. 7.77)."""

from __future__ import annotations

from pathlib import Path

import click

from urdfkin.cli.arguments import (
    frame_option,
    load_robot,
    q_option,
    read_inputs,
    robot_argument,
    seed_option,
    verify_option,
)
from urdfkin.cli.output import compiling, emit, exit_code, format_option, output_option

EXAMPLE = "urdfkin placement panda --q 0,-0.5,0,-2,0,1.5,0.8,0.02"


@click.command(epilog=f"Example: {EXAMPLE}")
@robot_argument
@frame_option
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
    q: str,
    seed: int,
    verify: bool,
    format_: str,
    output: Path | None,
) -> None:
    """Pose of a frame: T_world_frame (eq. 7.77).

    Prints the frame's axes and its origin in the world, in metres.
    ROBOT is a path, a name that `urdfkin robots` lists, or - for standard input.
    """
    loaded = load_robot(robot, mimic, root_joint, verify=verify)
    x = read_inputs(loaded, frame, seed, q)
    with compiling():
        result = loaded.placement(x.q, x.frame)
    emit(x, "placement", None, result, format_, output)
    context.exit(exit_code(loaded.certificate()))
