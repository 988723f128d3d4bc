"""`urdfkin view`: show a robot in a browser tab. `urdfkin plot`: plot a frame's motion along a trajectory."""

from __future__ import annotations

import sys
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

import click

from urdfkin.cli.options import (
    FILE,
    FiniteNumber,
    WholeNumber,
    convention_of_input_option,
    find_conversion,
    frame_option,
    load_robot,
    q_option,
    read_inputs,
    read_motion,
    reference_option,
    reject_unused_options,
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


@click.command(epilog="Example: urdfkin view panda --q 0,-0.8,0,-2.4,0,1.6,0.8,0.04")
@robot_argument
@click.option(
    "--host",
    default="127.0.0.1",
    help="Address to listen on (127.0.0.1: this machine; 0.0.0.0: the whole network).",
)
@q_option
@seed_option
@click.option(
    "--browser/--no-browser",
    default=None,
    help="Open the address in the browser.",
    show_default="browser, if there is a screen and the output is a terminal",
)
@trajectory_option("Play the samples of this file.")
@convention_of_input_option
@click.option("--port", type=WholeNumber(1, 65535), default=8080, help="Port to listen on.")
@click.pass_context
def view_command(
    context: click.Context,
    /,
    robot: str,
    q: str,
    seed: int,
    host: str,
    port: int,
    trajectory: Path | None,
    convention: str | None,
    browser: bool | None,
) -> None:
    """Show a robot in a browser tab, with sliders, shapes, frames, DH frames and arrows.

    The viewer starts at --q. Without --q, the viewer starts in the configuration nearest to zero that is
    within the joint limits. The viewer shows the position, velocity and other numbers of the frame that you
    choose. Pinocchio checks these numbers again after each motion of the robot. The viewer needs the package
    viser. Ctrl-C stops the viewer.

    With --trajectory, the viewer plays the samples of a CSV or .npz file. With --convention, the input field
    of q accepts and shows values in that convention.

    The printed address ends with a secret key. Open the whole address, including the key. Show the address
    only to people who may see and move the robot. Without the key, other web pages and other users of the
    machine cannot use the viewer.
    """
    from urdfkin.view.server import has_screen, new_server, open_page
    from urdfkin.view.viewer import Viewer

    if q == "neutral":
        reject_unused_options(context, ("seed",), "without a random --q")
    loaded = load_robot(robot)
    conversion = find_conversion(loaded, convention)
    start = None if q == "neutral" else read_inputs(loaded, None, seed, q, conversion=conversion).q
    if start is not None and len(start) != 1:
        raise InputError(
            "the viewer needs exactly one start configuration", where="--q", found=str(len(start))
        )
    motion = None
    if trajectory is not None:
        if start is not None:
            raise click.UsageError(
                "--q and --trajectory cannot be used together: the viewer starts at the first sample"
            )
        motion = read_motion(loaded, trajectory, convention)
        if motion.base is not None:
            raise InputError(
                "the viewer does not move the root link",
                where=str(trajectory),
                found="base_placement",
                remedy="use --root-joint floating, and write the pose of the root link into q",
            )
    server = new_server(host, port)
    with report_compilation():
        Viewer(server, loaded, None if start is None else start[0], motion, conversion)
    try:
        say(f"{loaded.name}: {server.address}")
        # If standard output is a pipe, its reader gets the address only after a flush.
        sys.stdout.flush()
        opens = sys.stdout.isatty() and has_screen() if browser is None else browser
        with open_page(server.address) if opens else nullcontext():
            server.sleep_forever()
    except KeyboardInterrupt:
        server.stop()


#: Copy of the names in `urdfkin.view.plot`, because an import of that module would slow `--help` down.
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
    help="With --to: first configuration of the motion, in the format of --q of other commands.",
)
@click.option(
    "--to",
    "end",
    metavar="VALUES",
    help="Plot a straight line in joint space that ends at VALUES. The format is the same as for --q.",
)
@click.option(
    "--duration",
    type=FiniteNumber(),
    default=1.0,
    help="With --to: duration of the motion in seconds.",
)
@samples_option(201, "With --to: number of samples along the line.", minimum=3, maximum=10_000_000)
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
def plot_command(
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
    check.

    The option --trajectory reads a CSV or .npz file. With --to, the robot moves along a straight line in
    joint space, and is at rest at both ends. A floating base moves along a screw.

    With --convention, the file and the values of --from and --to are in that convention. The panels always
    show the joint values of the URDF, in rad and m.

    Exit 0: verified. 1: a disagreement. 2: bad input. 3: not checked.
    """
    if (trajectory is None) == (end is None):
        raise click.UsageError("give either --trajectory FILE.csv, or --to VALUES for a line in joint space")
    if trajectory is not None:
        reject_unused_options(context, ("start", "duration", "samples", "seed"), "with --trajectory")
    elif not any(text.startswith("random") for text in (start, end or "")):
        reject_unused_options(context, ("seed",), "without a random --from or --to")
    from urdfkin.robot.frame_motion import frame_motion
    from urdfkin.view.figure import figure_bytes
    from urdfkin.view.plot import check_summary, plot_motion

    check_writable(output)
    loaded = load_robot(robot)
    if trajectory is not None:
        trajectory_ = read_motion(loaded, trajectory, convention)
    else:
        trajectory_ = _make_line(loaded, start, end or "", duration, samples, seed, convention)
    with report_compilation():
        frame = loaded.tip_frame if frame is None else frame
        motion = frame_motion(loaded, trajectory_, frame, reference)
    write_file(output, figure_bytes(plot_motion(loaded, motion, trajectory_, panels), output))
    say(f"{loaded.name}: {motion.frame}: {check_summary(motion, trajectory_)}")
    context.exit(3 if motion.unverified_reason is not None else 0 if motion.agrees else 1)


def _make_line(
    robot: Robot, start: str, end: str, duration: float, samples: int, seed: int, convention: str | None
) -> Trajectory:
    from urdfkin.robot.trajectory import make_line_trajectory

    conversion = find_conversion(robot, convention)
    # With equal seeds, a random start and a random end would be the same configuration.
    other_seed = seed + 1 if start.startswith("random") else seed
    first, last = (
        read_inputs(robot, None, own_seed, text, option=option, conversion=conversion).q
        for option, text, own_seed in (("--from", start, seed), ("--to", end, other_seed))
    )
    if len(first) != 1 or len(last) != 1:
        raise InputError("--from and --to need one configuration each", found=f"{len(first)} and {len(last)}")
    return make_line_trajectory(robot, first[0], last[0], duration, samples)
