"""`urdfkin imu`: what an accelerometer and a gyroscope in a frame read."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from urdfkin.cli.arguments import (
    TRAJECTORY_HELP,
    Inputs,
    a_option,
    frame_option,
    load_robot,
    oracle_option,
    q_option,
    read_inputs,
    robot_argument,
    seed_option,
    v_option,
    verify_option,
)
from urdfkin.cli.base import base_options, with_base
from urdfkin.cli.door import say
from urdfkin.cli.endings import form_of
from urdfkin.cli.idle import refuse_idle
from urdfkin.cli.output import ENDINGS, compiling, emit, exit_code, format_option, output_option
from urdfkin.verify.quantities import IMU
from urdfkin.verify.witnesses import WitnessName

if TYPE_CHECKING:
    from urdfkin.robot import Robot

_TRAJECTORY = f"{TRAJECTORY_HELP[:-1]}, base_placement, base_velocity, base_acceleration."


@click.command(epilog="Example: urdfkin imu panda --frame panda_hand --trajectory log.csv --format csv")
@robot_argument
@frame_option
@click.option(
    "--gravity", metavar="X,Y,Z", default="0,0,-9.81", show_default=True, help="In the world's axes, m/s^2."
)
@click.option("--trajectory", type=click.Path(path_type=Path), help=_TRAJECTORY)
@q_option
@v_option
@a_option
@base_options(IMU.inputs)
@seed_option
@verify_option
@oracle_option
@format_option
@output_option
@click.pass_context
def command(
    context: click.Context,
    robot: str,
    frame: str | None,
    gravity: str,
    trajectory: Path | None,
    q: str,
    v: str,
    a: str,
    base_placement: str | None,
    base_velocity: str | None,
    base_acceleration: str | None,
    seed: int,
    verify: bool,
    oracle: WitnessName,
    format_: str,
    output: Path | None,
) -> None:
    """What an accelerometer and a gyroscope in a frame read, in the frame's own axes.

    The proper acceleration, m/s^2: the second derivative of the frame's position less gravity, so that a
    sensor at rest reads 9.81 upwards; and the angular velocity, rad/s. For one configuration --q with its
    rates --v and their rates --a, for batches of them, or along a --trajectory. A base that moves is said by
    --base-velocity and the like, stands in the .npz file, or is --root-joint floating, whose pose is then
    among the coordinates. `urdfkin explain gravity-in-an-acceleration` says more.
    """
    from urdfkin.motion.columns import numbers  # noqa: PLC0415  keeps --help fast

    format_ = form_of(context, output, ENDINGS, "csv")
    loaded = load_robot(robot, verify=verify, oracle=oracle)
    if trajectory is None:
        x = read_inputs(loaded, frame, seed, q, v, a)
        x = with_base(x, base_placement, base_velocity, base_acceleration)
    else:
        moved = ("base_placement", "base_velocity", "base_acceleration")
        refuse_idle(context, ("q", "v", "a", *moved, "seed"), "along a --trajectory")
        x = _along(loaded, frame, trajectory)
    g = numbers(gravity.split(","), "--gravity", ("x", "y", "z"))
    with compiling():
        result = loaded.imu(x.q, x.v, x.a, x.frame, gravity=g, base=x.base)
    emit(x, IMU, None, result, format_, output)
    context.exit(exit_code(loaded.certificate()))


def _along(robot: Robot, frame: str | None, path: Path) -> Inputs:
    from urdfkin.motion.trajectory import read_trajectory  # noqa: PLC0415

    motion = read_trajectory(robot, path, with_base=True)
    for note in (*motion.notes, *robot.limit_violations(motion.q)):
        say(f"warning: {note}", err=True)
    if motion.rates != "as given":
        say(f"rates {motion.rates}", err=True)
    return Inputs(robot, frame or robot.tip_frame, motion.q, motion.v, motion.a, motion.t, motion.base)
