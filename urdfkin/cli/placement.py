"""`urdfkin placement`: the pose of a frame, as a matrix, as x, y, z, rpy or with a quaternion."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from urdfkin.cli.arguments import Inputs, convention_option, frame_name
from urdfkin.cli.options import reject_unused_options
from urdfkin.cli.output import compiling
from urdfkin.cli.quantity import Computing, computing_options
from urdfkin.verify.quantities import PLACEMENT
from urdfkin.verify.replay import replay_line

if TYPE_CHECKING:
    from urdfkin.model.tree import FloatArray

_POSITION = ("x", "y", "z")
#: Forms of a pose besides the matrix.
_FORMS = {
    "rpy": replace(
        PLACEMENT,
        shape=(6,),
        labels=(*_POSITION, "roll", "pitch", "yaw"),
        units={"x, y, z": "m", "roll, pitch, yaw": "rad"},
    ),
    "quaternion": replace(
        PLACEMENT,
        shape=(7,),
        labels=(*_POSITION, "qx", "qy", "qz", "qw"),
        units={"x, y, z": "m", "qx, qy, qz, qw": "1"},
    ),
    "wxyz": replace(
        PLACEMENT,
        shape=(7,),
        labels=(*_POSITION, "qw", "qx", "qy", "qz"),
        units={"x, y, z": "m", "qw, qx, qy, qz": "1"},
    ),
}


@click.command("placement", epilog=f"Example: {PLACEMENT.example}")
@computing_options(
    PLACEMENT.inputs,
    convention_option,
    frame_name("--relative-to", "Link or joint relative to which the pose is given. Default: the world."),
    click.option(
        "--as",
        "written",
        type=click.Choice(["matrix", *_FORMS]),
        default="matrix",
        show_default=True,
        help="Form of the pose. rpy: x, y, z, roll, pitch, yaw as in a URDF's <origin>."
        " quaternion: x, y, z, qx, qy, qz, qw. wxyz: x, y, z, qw, qx, qy, qz.",
    ),
)
def command(context: click.Context, relative_to: str | None, written: str, verify: bool, **_: Any) -> None:
    """Compute the pose of a frame (eq. 7.77) in the world or in another frame, in metres.

    The pose is a matrix T with the frame's axes and origin, or, with --as, six or seven numbers. Pinocchio
    checks that these numbers give the same rotation.

    ROBOT is a path, a name from `urdfkin robots`, or - for standard input. The path can also be a table of a
    robot: .toml, .json or .csv.
    """
    if relative_to is not None:
        reject_unused_options(context, ("base_placement",), "with --relative-to")
    run = Computing(context)
    x = run.inputs()
    with compiling():
        if relative_to is None:
            T = run.robot.placement(x.q, x.frame, base=x.base)
        else:
            T = run.robot.relative_placement(x.q, x.frame, relative_to)
            x = x.saying(relative_to=relative_to)
    if written == "matrix":
        run.answer(x, PLACEMENT, T)
    x = x.saying(written_as=written)
    run.answer(x, _FORMS[written], _numbers(x, T, written, verify=verify))


def _numbers(x: Inputs, T: FloatArray, written: str, *, verify: bool) -> FloatArray:
    """Return the (n, 6) or (n, 7) position and orientation; Pinocchio checks them if it checked the poses."""
    import numpy as np  # noqa: PLC0415  keeps --help fast

    from urdfkin.kinematics.rotation import quaternion_of, rpy_of  # noqa: PLC0415

    of: Callable[[Any], FloatArray] = rpy_of if written == "rpy" else quaternion_of
    orientation = of(R := T[:, :3, :3])
    if verify and x.robot.certificate().verified:
        from urdfkin.verify.orientation import check_orientations  # noqa: PLC0415

        check_orientations(orientation, R, x.frame, lambda k: _again(x, k, written))
    if written == "wxyz":
        orientation = np.roll(orientation, 1, axis=-1)
    return np.hstack((T[:, :3, 3], orientation))


def _again(x: Inputs, k: int, written: str) -> str:
    """Return the command that computes sample `k` again."""
    line = replay_line(x.robot.origin, "placement", x.frame, None, {"q": x.q[k].tolist()})
    given = click.get_current_context().params
    for name in ("relative_to", "base_placement"):
        if given[name] is not None:
            line += f" --{name.replace('_', '-')} {shlex.quote(given[name])}"
    return f"{line} --as {written}"
