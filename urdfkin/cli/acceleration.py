"""`urdfkin acceleration`: classical acceleration of a frame (eq. 7.129, 7.130)."""

from __future__ import annotations

from pathlib import Path

import click

from urdfkin.cli.arguments import (
    a_option,
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
from urdfkin.cli.breakdown import emit_breakdown
from urdfkin.cli.output import compiling, emit, exit_code, format_option, output_option

EXAMPLE = "urdfkin acceleration panda --q random --v random --a random --explain"


@click.command(epilog=f"Example: {EXAMPLE}")
@robot_argument
@frame_option
@reference_option
@q_option
@v_option
@a_option
@seed_option
@verify_option
@click.option("--explain", is_flag=True, help="Break it down by joint and kind; the parts sum to it.")
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
    a: str,
    seed: int,
    verify: bool,
    explain: bool,
    format_: str,
    output: Path | None,
) -> None:
    """Classical acceleration of a frame (eq. 7.129, 7.130).

    The second derivative of the origin's position in m/s^2 and the angular acceleration in
    rad/s^2, for rates --v and their rates --a. Gravity is not in it. With --explain, what each joint
    contributes: transverse, centripetal, Coriolis and sliding parts (eq. 7.125, joint by joint).
    ROBOT is a path, a name that `urdfkin robots` lists, or - for standard input.
    """
    loaded = load_robot(robot, mimic, root_joint, verify=verify)
    x = read_inputs(loaded, frame, seed, q, v, a)
    if explain:
        with compiling():
            parts = loaded.acceleration_breakdown(x.q, x.v, x.a, x.frame, reference)
        emit_breakdown(x, reference, parts, format_, output)
        context.exit(exit_code(loaded.certificate()))
    with compiling():
        result = loaded.acceleration(x.q, x.v, x.a, x.frame, reference)
    emit(x, "acceleration", reference, result, format_, output)
    context.exit(exit_code(loaded.certificate()))
