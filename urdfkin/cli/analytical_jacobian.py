"""`urdfkin analytical-jacobian`: derivatives of position and orientation angles by the coordinates."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from urdfkin.cli.arguments import (
    frame_option,
    load_robot,
    oracle_option,
    q_option,
    read_inputs,
    robot_argument,
    seed_option,
    verify_option,
)
from urdfkin.cli.base import base_options, with_base
from urdfkin.cli.endings import form_of
from urdfkin.cli.numbers import NumberFrom
from urdfkin.cli.output import ENDINGS, compiling, emit, exit_code, format_option, output_option
from urdfkin.cli.reports import check_writable
from urdfkin.verify.quantities import ANALYTICAL_JACOBIAN
from urdfkin.verify.witnesses import WitnessName

#: They repeat `urdfkin.kinematics.rotation.SEQUENCES`, whose import --help does not need.
_TRIPLES = [a + b + c for a in "xyz" for b in "xyz" for c in "xyz" if a != b != c]
REPRESENTATIONS = ("quaternion", *(triple.upper() for triple in _TRIPLES), *_TRIPLES)


@click.command(epilog="Example: urdfkin analytical-jacobian ur5 --q random --representation xyz")
@robot_argument
@frame_option
@click.option(
    "--representation",
    type=click.Choice(REPRESENTATIONS),
    metavar="NAME",
    default="ZYZ",
    show_default=True,
    help="Three letters, capitals turning (ZYZ is the text's), small ones fixed (xyz is rpy); or quaternion.",
)
@click.option(
    "--nearest",
    type=NumberFrom(min=0.0),
    metavar="RAD",
    help="How near the representational singularity may be; nearer is an error.",
)
@q_option
@base_options(ANALYTICAL_JACOBIAN.inputs)
@seed_option
@verify_option
@oracle_option
@format_option
@output_option
@click.pass_context
def command(
    context: click.Context,
    robot: str,
    frame: str | None,
    representation: str,
    nearest: float | None,
    q: str,
    base_placement: str | None,
    seed: int,
    verify: bool,
    oracle: WitnessName,
    format_: str,
    output: Path | None,
) -> None:
    """The manipulator Jacobian J = C^-1 J_v (eq. 7.118, 7.122) of a frame.

    A row of the table for each rate: how fast it alone changes the frame's position and the numbers of its
    orientation, Euler angles or a quaternion. `urdfkin jacobian` has angular velocities in their place.
    """
    from urdfkin.kinematics.rotation.euler_rates import NEAREST  # noqa: PLC0415  keeps --help fast

    format_ = form_of(context, output, ENDINGS, "csv")
    check_writable(output)
    loaded = load_robot(robot, verify=verify, oracle=oracle)
    x = with_base(read_inputs(loaded, frame, seed, q), base_placement)
    nearest = NEAREST if nearest is None else nearest
    with compiling():
        J = loaded.analytical_jacobian(x.q, x.frame, representation, nearest=nearest, base=x.base)
    row = replace(ANALYTICAL_JACOBIAN, labels=("x", "y", "z", *labels(representation)))
    emit(x.saying(representation=representation), row, None, J, format_, output)
    context.exit(exit_code(loaded.certificate()))


def labels(representation: str) -> tuple[str, ...]:
    """What the numbers of an orientation are called.

    >>> labels("xyz"), labels("ZYZ")
    (('roll', 'pitch', 'yaw'), ('Z1', 'Y2', 'Z3'))
    """
    known = {"xyz": ("roll", "pitch", "yaw"), "quaternion": ("qx", "qy", "qz", "qw")}
    return known.get(representation) or tuple(f"{axis}{k}" for k, axis in enumerate(representation, 1))
