"""`urdfkin view`: a robot in a browser tab."""

from __future__ import annotations

import sys
from contextlib import nullcontext

import click

from urdfkin.cli.arguments import load_robot, q_option, read_inputs, robot_argument, seed_option
from urdfkin.cli.options import Whole
from urdfkin.cli.output import compiling
from urdfkin.cli.streams import say
from urdfkin.errors import InputError

EXAMPLE = "urdfkin view panda --q 0,-0.8,0,-2.4,0,1.6,0.8,0.04"


@click.command(epilog=f"Example: {EXAMPLE}")
@robot_argument
@click.option(
    "--host",
    default="127.0.0.1",
    show_default=True,
    help="Whom to listen to: this machine alone, or 0.0.0.0 for the whole network.",
)
@q_option
@seed_option
@click.option("--browser/--no-browser", default=None, help="Whether to open it.  [default: on a screen]")
@click.option("--port", type=Whole(1, 65535), default=8080, show_default=True)
def command(robot: str, q: str, seed: int, host: str, port: int, browser: bool | None) -> None:
    """Show a robot in a browser tab: sliders, shapes, frames, DH frames, velocity and acceleration arrows.

    It begins at --q, or in the neutral configuration, moved to within the limits. The numbers of the chosen
    frame are checked by Pinocchio as the robot moves. Needs the extra `urdfkin[view]`. Ctrl-C ends it.

    The address that is printed holds a key: open it as it stands, and show it to nobody who should not see
    or move the robot. Other pages and other users of this machine are refused.
    """
    from urdfkin.view.server import (  # noqa: PLC0415
        has_screen,
        new_server,
        opened_page,
    )
    from urdfkin.view.viewer import Viewer  # noqa: PLC0415

    loaded = load_robot(robot)
    begin = None if q == "neutral" else read_inputs(loaded, None, seed, q).q
    if begin is not None and len(begin) != 1:
        raise InputError("the viewer begins at one configuration", where="--q", found=str(len(begin)))
    server = new_server(host, port)
    with compiling():
        Viewer(server, loaded, None if begin is None else begin[0])
    try:
        say(f"{loaded.name}: {server.address}")
        sys.stdout.flush()  # whoever reads a pipe wants the address now
        wanted = sys.stdout.isatty() and has_screen() if browser is None else browser
        with opened_page(server.address) if wanted else nullcontext():
            server.sleep_forever()
    except KeyboardInterrupt:
        server.stop()
