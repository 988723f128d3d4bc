"""`urdfkin view`: a robot in a browser tab."""

from __future__ import annotations

import sys

import click

from urdfkin.cli.arguments import load_robot, robot_argument
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
    """
    from urdfkin.view.viewer import Viewer, new_server  # noqa: PLC0415  keeps --help fast

    loaded = load_robot(robot, mimic, root_joint)
    server = new_server(host, port)
    with compiling():
        Viewer(server, loaded)
    click.echo(f"{loaded.name}: http://{host}:{server.get_port()}")
    sys.stdout.flush()  # whoever reads a pipe wants the address now
    try:
        server.sleep_forever()
    except KeyboardInterrupt:
        server.stop()
