"""`urdfkin view`: show a robot in a browser tab."""

from __future__ import annotations

import sys
from contextlib import nullcontext
from pathlib import Path

import click

from urdfkin.cli.options import (
    WholeNumber,
    convention_of_input_option,
    conversion_of,
    load_robot,
    q_option,
    read_inputs,
    read_motion,
    robot_argument,
    seed_option,
    trajectory_option,
)
from urdfkin.cli.output import report_compilation
from urdfkin.cli.streams import say
from urdfkin.errors import InputError


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
    show_default="browser, if there is a screen",
)
@trajectory_option("Play the samples of this file.")
@convention_of_input_option
@click.option("--port", type=WholeNumber(1, 65535), default=8080, help="Port to listen on.")
def command(
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

    The viewer starts at --q. Without --q, it starts in the configuration nearest to zero that is within the
    joint limits. The viewer shows the position, velocity and other numbers of the frame that you choose.
    Pinocchio checks these numbers again after each motion of the robot. The viewer needs the package viser.
    Ctrl-C stops it.

    With --trajectory, the viewer plays the samples of a CSV or .npz file. With --convention, the input field
    of q accepts and shows values in that convention.

    The printed address ends with a secret key. Open the whole address, including the key. Show the address
    only to people who may see and move the robot. Other web pages and other users of this machine
    have no access.
    """
    from urdfkin.view.server import has_screen, new_server, opened_page
    from urdfkin.view.viewer import Viewer

    loaded = load_robot(robot)
    conversion = conversion_of(loaded, convention)
    start = None if q == "neutral" else read_inputs(loaded, None, seed, q, conversion=conversion).q
    if start is not None and len(start) != 1:
        raise InputError(
            "the viewer needs exactly one start configuration", where="--q", found=str(len(start))
        )
    motion = None
    if trajectory is not None:
        if start is not None:
            raise click.UsageError(
                "--q and --trajectory cannot be used together: a trajectory begins at its first sample"
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
        # Python buffers output to a pipe, so without a flush the reader gets the address late.
        sys.stdout.flush()
        opens = sys.stdout.isatty() and has_screen() if browser is None else browser
        with opened_page(server.address) if opens else nullcontext():
            server.sleep_forever()
    except KeyboardInterrupt:
        server.stop()
