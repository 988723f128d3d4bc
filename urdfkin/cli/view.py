"""`urdfkin view`: a robot in a browser tab."""

from __future__ import annotations

import sys

import click

from urdfkin.cli.arguments import load_robot, robot_argument
from urdfkin.cli.door import say
from urdfkin.cli.numbers import Whole
from urdfkin.cli.output import compiling

EXAMPLE = "urdfkin view panda"


@click.command(epilog=f"Example: {EXAMPLE}")
@robot_argument
@click.option(
    "--host",
    default="127.0.0.1",
    show_default=True,
    help="Whom to listen to: this machine alone, or 0.0.0.0 for the whole network.",
)
@click.option("--port", type=Whole(1, 65535), default=8080, show_default=True)
def command(robot: str, mimic: bool | None, root_joint: str | None, host: str, port: int) -> None:
    """Show a robot in a browser tab: meshes, sliders, frames, DH frames, velocity and acceleration arrows.

    The numbers of the chosen frame are checked by Pinocchio as the robot moves. Needs the extra
    `urdfkin[view]`. Press Ctrl-C to end it.

    The address that is printed holds a key: open it as it stands, and show it to nobody who should not see
    or move the robot. Other pages and other users of this machine are refused.
    """
    from urdfkin.view.server import new_server  # noqa: PLC0415  keeps --help fast
    from urdfkin.view.viewer import Viewer  # noqa: PLC0415

    loaded = load_robot(robot, mimic, root_joint)
    server = new_server(host, port)
    with compiling():
        Viewer(server, loaded)
    try:
        say(f"{loaded.name}: {server.address}")
        sys.stdout.flush()  # whoever reads a pipe wants the address now
        server.sleep_forever()
    except KeyboardInterrupt:
        server.stop()
