"""`urdfkin view`: show a robot in a browser tab."""

from __future__ import annotations

import sys
from contextlib import nullcontext
from pathlib import Path

import click

from urdfkin.cli.options import (
    Whole,
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
from urdfkin.cli.output import compiling
from urdfkin.cli.streams import say
from urdfkin.errors import InputError


@click.command(epilog="Example: urdfkin view panda --q 0,-0.8,0,-2.4,0,1.6,0.8,0.04")
@robot_argument
@click.option(
    "--host",
    default="127.0.0.1",
    show_default=True,
    help="Address to listen on (127.0.0.1: this machine; 0.0.0.0: the whole network).",
)
@q_option
@seed_option
@click.option(
    "--browser/--no-browser", default=None, help="Open the browser.  [default: if there is a screen]"
)
@trajectory_option("Samples to play.")
@convention_of_input_option
@click.option("--port", type=Whole(1, 65535), default=8080, show_default=True, help="Port to listen on.")
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

    The viewer starts at --q. Without --q, the viewer starts in the configuration nearest to zero that is
    within the joint limits. The viewer shows the position, velocity and other numbers of the frame that you
    choose. Pinocchio checks these numbers again after each motion of the robot. The viewer needs the package
    viser. Ctrl-C stops it.

    With --trajectory, a CSV or .npz file as in `urdfkin plot`, the viewer plays the samples of the file. With
    --convention, the input field of q also accepts and shows values in that convention.

    The printed address ends with a secret key. Open the address with its key, and show it only to people who
    may see and move the robot. Other web pages and other users of this machine have no access.
    """
    from urdfkin.view.server import has_screen, new_server, opened_page
    from urdfkin.view.viewer import Viewer

    loaded = load_robot(robot)
    conversion = conversion_of(loaded, convention)
    begin = None if q == "neutral" else read_inputs(loaded, None, seed, q, conversion=conversion).q
    if begin is not None and len(begin) != 1:
        raise InputError(
            "the viewer needs exactly one start configuration", where="--q", found=str(len(begin))
        )
    played = None
    if trajectory is not None:
        if begin is not None:
            raise click.UsageError(
                "--q and --trajectory cannot be used together: a trajectory begins at its first sample"
            )
        played = read_motion(loaded, trajectory, convention)
        if played.base is not None:
            raise InputError(
                "the viewer does not move the root link",
                where=str(trajectory),
                found="base_placement",
                remedy="use --root-joint floating, and write the pose of the root link into q",
            )
    server = new_server(host, port)
    with compiling():
        Viewer(server, loaded, None if begin is None else begin[0], played, conversion)
    try:
        say(f"{loaded.name}: {server.address}")
        sys.stdout.flush()  # A pipe would get the address too late.
        wanted = sys.stdout.isatty() and has_screen() if browser is None else browser
        with opened_page(server.address) if wanted else nullcontext():
            server.sleep_forever()
    except KeyboardInterrupt:
        server.stop()
