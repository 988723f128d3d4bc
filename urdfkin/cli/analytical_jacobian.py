"""`urdfkin analytical-jacobian`: derivatives of a frame's position and orientation angles."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import click

from urdfkin.cli.options import NumberFrom
from urdfkin.cli.output import compiling
from urdfkin.cli.quantity import Computing, computing_options
from urdfkin.verify.quantities import ANALYTICAL_JACOBIAN

#: A copy of `urdfkin.kinematics.rotation.SEQUENCES`: importing it would slow --help down.
_TRIPLES = [a + b + c for a in "xyz" for b in "xyz" for c in "xyz" if a != b != c]
REPRESENTATIONS = ("rpy", "quaternion", *(triple.upper() for triple in _TRIPLES), *_TRIPLES)


@click.command(epilog="Example: urdfkin analytical-jacobian ur5 --q random --representation rpy")
@computing_options(
    ANALYTICAL_JACOBIAN.inputs,
    click.option(
        "--representation",
        type=click.Choice(REPRESENTATIONS),
        metavar="NAME",
        default="ZYZ",
        show_default=True,
        help="rpy (roll, pitch, yaw as in a URDF), quaternion, or Euler angles by their axes: capitals are"
        " moving axes (ZYZ), small letters fixed axes (xyz is rpy).",
    ),
    click.option(
        "--nearest",
        type=NumberFrom(min=0.0),
        metavar="RAD",
        help="Smallest allowed distance to the representational singularity; nearer is an error.",
    ),
)
def command(context: click.Context, representation: str, nearest: float | None, **_: Any) -> None:
    """Compute a frame's analytical Jacobian J = C^-1 J_v (eq. 7.118, 7.122).

    The table has one row for each joint velocity. A row lists the derivatives of the frame's position and
    orientation (Euler angles or a quaternion). `urdfkin jacobian` has angular velocities instead.
    """
    from urdfkin.kinematics.rotation.euler import NEAREST  # noqa: PLC0415  keeps --help fast

    run = Computing(context)
    x, nearest = run.inputs(), NEAREST if nearest is None else nearest
    with compiling():
        J = run.robot.analytical_jacobian(x.q, x.frame, representation, nearest=nearest, base=x.base)
    row = replace(ANALYTICAL_JACOBIAN, labels=("x", "y", "z", *labels(representation)))
    run.answer(x.saying(representation=representation), row, J)


def labels(representation: str) -> tuple[str, ...]:
    """Return the names of an orientation's numbers.

    >>> labels("xyz"), labels("ZYZ")
    (('roll', 'pitch', 'yaw'), ('Z1', 'Y2', 'Z3'))
    """
    angles = ("roll", "pitch", "yaw")
    known = {"rpy": angles, "xyz": angles, "quaternion": ("qx", "qy", "qz", "qw")}
    return known.get(representation) or tuple(f"{axis}{k}" for k, axis in enumerate(representation, 1))
