"""`urdfkin plot`: plot a frame's motion along a trajectory."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from urdfkin.cli.options import (
    FILE,
    FiniteNumber,
    convention_of_input_option,
    conversion_of,
    frame_option,
    load_robot,
    read_inputs,
    read_motion,
    reference_option,
    robot_argument,
    samples_option,
    seed_option,
    trajectory_option,
)
from urdfkin.cli.output import check_writable, report_compilation
from urdfkin.cli.streams import say
from urdfkin.errors import InputError
from urdfkin.system.files import write_file

if TYPE_CHECKING:
    from urdfkin.robot import Robot
    from urdfkin.robot.trajectory import Trajectory

#: Copy of the names in `urdfkin.view.plot`; the import of that module would slow --help down
PANELS = (
    *("q", "v", "a", "position", "orientation", "velocity", "angular-velocity", "acceleration"),
    *("angular-acceleration", "parts", "singular-values", "angular-singular-values", "manipulability"),
    *("angular-manipulability", "disagreement"),
)


@click.command(epilog="Example: urdfkin plot ur5 --to 1,-1,1.2,0.3,0.5,0 --duration 2 --output ur5.svg")
@robot_argument
@frame_option
@reference_option
@trajectory_option("Plot the samples of this file.")
@convention_of_input_option
@click.option(
    "--from",
    "start",
    default="neutral",
    metavar="VALUES",
    help="With --to: configuration at the start of the line, in the format of --q of other commands.",
)
@click.option(
    "--to",
    "end",
    metavar="VALUES",
    help="Plot a straight line in joint space that ends at this configuration, in the format of --q of other"
    " commands.",
)
@click.option(
    "--duration",
    type=FiniteNumber(),
    default=1.0,
    help="With --to: duration of the motion in seconds.",
)
@samples_option(201, "With --to: number of samples along the line.", least=3)
@seed_option
@click.option(
    "--panel",
    "panels",
    multiple=True,
    type=click.Choice(PANELS),
    help="Panel of the plot to draw; repeatable.",
    show_default="all panels",
)
@click.option(
    "--output",
    "-o",
    type=FILE,
    required=True,
    help="Write the plot to this file, with the suffix .svg, .png or .pdf.",
)
@click.pass_context
def command(
    context: click.Context,
    robot: str,
    frame: str | None,
    reference: str,
    trajectory: Path | None,
    convention: str | None,
    start: str,
    end: str | None,
    duration: float,
    samples: int,
    seed: int,
    panels: tuple[str, ...],
    output: Path,
) -> None:
    """Plot a frame's motion along a trajectory.

    The plot has panels for q, v and a with their limits, and for the frame's position, velocity and
    acceleration. Other panels show the parts of the acceleration, the singular values, and the result of the
    check. --trajectory reads a CSV or .npz file. --to makes a straight line in joint space that begins and
    ends at rest; a floating base moves along a screw. With --convention, the file and the values of --from
    and --to are in that convention. The panels always show the joint values of the URDF, in rad and m.

    Exit 0: verified. 1: a disagreement. 2: bad input. 3: not checked.
    """
    if (trajectory is None) == (end is None):
        raise click.UsageError("give either --trajectory FILE.csv, or --to VALUES for a line in joint space")
    from urdfkin.robot.frame_motion import frame_motion
    from urdfkin.view.figure import save
    from urdfkin.view.plot import foot, sheet

    check_writable(output)
    loaded = load_robot(robot)
    if trajectory is not None:
        trajectory_ = read_motion(loaded, trajectory, convention)
    else:
        trajectory_ = _line(loaded, start, end or "", duration, samples, seed, convention)
    with report_compilation():
        motion = frame_motion(loaded, trajectory_, frame or loaded.tip_frame, reference)
    write_file(output, save(sheet(loaded, motion, trajectory_, panels), output))
    say(f"{loaded.name}: {motion.frame}: {foot(motion, trajectory_)}")
    context.exit(3 if motion.unverified_reason is not None else 0 if motion.agrees else 1)


def _line(
    robot: Robot, start: str, end: str, duration: float, samples: int, seed: int, convention: str | None
) -> Trajectory:
    from urdfkin.robot.trajectory import make_line_trajectory

    conversion = conversion_of(robot, convention)
    first, last = (
        read_inputs(robot, None, seed, text, option=option, conversion=conversion).q
        for option, text in (("--from", start), ("--to", end))
    )
    if len(first) != 1 or len(last) != 1:
        raise InputError("--from and --to need one configuration each", found=f"{len(first)} and {len(last)}")
    return make_line_trajectory(robot, first[0], last[0], duration, samples)
