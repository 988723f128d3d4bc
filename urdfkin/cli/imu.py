"""`urdfkin imu`: readings of an accelerometer and a gyroscope on a frame."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from urdfkin.cli.arguments import TRAJECTORY_HELP, Inputs
from urdfkin.cli.options import reject_unused_options
from urdfkin.cli.output import compiling
from urdfkin.cli.quantity import Computing, computing_options
from urdfkin.cli.streams import say
from urdfkin.verify.quantities import IMU

if TYPE_CHECKING:
    from urdfkin.robot import Robot

_TRAJECTORY = f"{TRAJECTORY_HELP[:-1]}, base_placement, base_velocity, base_acceleration."


@click.command(epilog="Example: urdfkin imu panda --frame panda_hand --trajectory log.csv --format csv")
@computing_options(
    IMU.inputs,
    click.option(
        "--gravity",
        metavar="X,Y,Z",
        default="0,0,-9.81",
        show_default=True,
        help="Gravity in the world's axes, m/s^2.",
    ),
    click.option("--trajectory", type=click.Path(path_type=Path), help=_TRAJECTORY),
)
def command(
    context: click.Context, frame: str | None, gravity: str, trajectory: Path | None, **_: Any
) -> None:
    """Compute the readings of an accelerometer and a gyroscope on a frame, in the frame's own axes.

    The accelerometer reads the proper acceleration in m/s^2: the second derivative of the frame's position
    minus gravity. A sensor at rest reads 9.81 upwards. The gyroscope reads the angular velocity in rad/s.

    The input is a configuration --q with joint velocities --v and joint accelerations --a, a batch of them,
    or a --trajectory. For a moving base, use --base-velocity and the other --base options, or arrays in the
    .npz file. With --root-joint floating, the pose of the base is part of --q. For details, run `urdfkin
    explain gravity-in-an-acceleration`.
    """
    from urdfkin.motion.trajectory import numbers  # noqa: PLC0415  keeps --help fast

    run = Computing(context)
    if trajectory is None:
        x = run.inputs()
    else:
        base = ("base_placement", "base_velocity", "base_acceleration")
        reject_unused_options(context, ("q", "v", "a", *base, "seed"), "along a --trajectory")
        x = _along(run.robot, frame, trajectory)
    g = numbers(gravity.split(","), "--gravity", ("x", "y", "z"))
    with compiling():
        result = run.robot.imu(x.q, x.v, x.a, x.frame, gravity=g, base=x.base)
    run.answer(x, IMU, result)


def _along(robot: Robot, frame: str | None, path: Path) -> Inputs:
    from urdfkin.motion.trajectory import read_trajectory  # noqa: PLC0415

    motion = read_trajectory(robot, path, with_base=True)
    for note in (*motion.notes, *robot.limit_violations(motion.q)):
        say(f"warning: {note}", err=True)
    if motion.rates != "as given":
        say(f"rates {motion.rates}", err=True)
    return Inputs(robot, frame or robot.tip_frame, motion.q, motion.v, motion.a, motion.t, motion.base)
