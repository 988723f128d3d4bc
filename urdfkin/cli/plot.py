"""`urdfkin plot`: plot a frame's motion along a trajectory."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from urdfkin.cli.options import (
    FiniteNumber,
    Whole,
    convention_of_input_option,
    conversion_of,
    frame_option,
    load_robot,
    read_motion,
    reference_option,
    robot_argument,
    seed_option,
    trajectory_option,
)
from urdfkin.cli.output import check_writable, compiling, write_file
from urdfkin.cli.streams import say
from urdfkin.errors import InputError

if TYPE_CHECKING:
    from urdfkin.robot import Robot
    from urdfkin.robot.trajectory import Trajectory

#: The names are copied from `urdfkin.view.plot`, whose import would slow --help down.
PANELS = (
    *("q", "v", "a", "position", "orientation", "velocity", "angular-velocity", "acceleration"),
    *("angular-acceleration", "parts", "singular-values", "angular-singular-values", "manipulability"),
    *("angular-manipulability", "disagreement"),
)


@click.command(epilog="Example: urdfkin plot ur5 --to 1,-1,1.2,0.3,0.5,0 --duration 2 --output ur5.svg")
@robot_argument
@frame_option
@reference_option
@trajectory_option("Samples to plot.")
@convention_of_input_option
@click.option(
    "--from",
    "start",
    default="neutral",
    show_default=True,
    help="With --to: configuration at which the line in joint space begins, written like --q.",
)
@click.option(
    "--to",
    "end",
    help="Configuration at which a line in joint space ends, written like --q in other commands.",
)
@click.option(
    "--duration",
    type=FiniteNumber(),
    default=1.0,
    show_default=True,
    help="With --to: duration of the motion in seconds.",
)
@click.option(
    "--samples",
    type=Whole(3),
    default=201,
    show_default=True,
    help="With --to: number of samples of the line.",
)
@seed_option
@click.option(
    "--panel",
    "panels",
    multiple=True,
    type=click.Choice(PANELS),
    help="Panel of the plot to draw; repeatable. Default: all panels.",
)
@click.option(
    "--output",
    "-o",
    type=click.Path(path_type=Path),
    required=True,
    help="File for the plot, with the suffix .svg, .png or .pdf.",
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
    check. Each axis has one unit. --trajectory reads a CSV or .npz file. --to makes a line in joint space
    that begins and ends at rest. A floating base moves along a screw. With --convention, the file and the
    values of --from and --to are in that convention. The panels show the joint values of the URDF, in rad and
    m, also with --convention.

    Exit 0: verified. 1: a disagreement. 3: Pinocchio could not check it.
    """
    if (trajectory is None) == (end is None):
        raise click.UsageError("give either --trajectory FILE.csv, or --to VALUES for a line in joint space")
    from urdfkin.robot.frame_motion import frame_motion
    from urdfkin.view.figure import save
    from urdfkin.view.plot import foot, sheet

    check_writable(output)
    loaded = load_robot(robot)
    if trajectory is not None:
        motion = read_motion(loaded, trajectory, convention)
    else:
        motion = _line(loaded, start, end or "", duration, samples, seed, convention)
    with compiling():
        found = frame_motion(loaded, motion, frame or loaded.tip_frame, reference)
    write_file(output, save(sheet(loaded, found, motion, panels), output))
    say(f"{loaded.name}: {found.frame}: {foot(found, motion)}")
    context.exit(3 if found.not_verified is not None else 0 if found.agrees else 1)


def _line(
    robot: Robot, start: str, end: str, duration: float, samples: int, seed: int, convention: str | None
) -> Trajectory:
    from urdfkin.cli.options import read_inputs
    from urdfkin.robot.trajectory import line

    given = (("--from", start), ("--to", end))
    how = conversion_of(robot, convention)
    ends = [read_inputs(robot, None, seed, text, option=option, conversion=how).q for option, text in given]
    if any(len(q) != 1 for q in ends):
        raise InputError(
            "--from and --to need one configuration each", found=f"{len(ends[0])} and {len(ends[1])}"
        )
    return line(robot, ends[0][0], ends[1][0], duration, samples)
