"""The options --base-placement, --base-velocity and --base-acceleration: the motion of the root link."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from urdfkin.cli.arguments import Inputs, read_batch, together
from urdfkin.errors import InputError

if TYPE_CHECKING:
    from urdfkin.model.tree import FloatArray

_F = TypeVar("_F", bound=Callable[..., Any])

_POSITION = ("x", "y", "z")
_RPY = (*_POSITION, "roll", "pitch", "yaw")
_QUATERNION = (*_POSITION, "qx", "qy", "qz", "qw")
_RATES = ("vx", "vy", "vz", "wx", "wy", "wz")

_OPTIONS = {
    "q": click.option(
        "--base-placement",
        metavar="VALUES",
        help="Pose of the root link in the world: x,y,z,roll,pitch,yaw (m, rad), x,y,z,qx,qy,qz,qw, or"
        " @FILE.csv.",
    ),
    "v": click.option(
        "--base-velocity",
        metavar="VALUES",
        help="Velocity of the root link: vx,vy,vz,wx,wy,wz in the world's axes, m/s and rad/s, or @FILE.csv.",
    ),
    "a": click.option(
        "--base-acceleration",
        metavar="VALUES",
        help="Classical acceleration of the root link's origin, in the same form, m/s^2 and rad/s^2.",
    ),
}


def base_options(inputs: str) -> Callable[[_F], _F]:
    """Make the options of the base for a quantity of q, v and a; `with_base` reads them."""
    return together(*(_OPTIONS[letter] for letter in inputs))


def with_base(
    x: Inputs, placement: str | None = None, velocity: str | None = None, acceleration: str | None = None
) -> Inputs:
    """Return the inputs with the motion of the base, if any was given; a single row applies to a whole batch.

    Raises:
        InputError: an invalid number, a wrong count, a quaternion that is not of length 1, or batches of
            different lengths.
        SourceError: a file that cannot be read.
    """
    import numpy as np  # noqa: PLC0415  keeps --help fast

    from urdfkin.model.base_motion import BaseMotion  # noqa: PLC0415

    if placement is None and velocity is None and acceleration is None:
        return x
    still = "0,0,0,0,0,0"
    T = _placements(*_rows(placement or still, "--base-placement", (_RPY, _QUATERNION)))
    v, _ = _rows(velocity or still, "--base-velocity", (_RATES,))
    a, _ = _rows(acceleration or still, "--base-acceleration", (_RATES,))
    parts = [x.q, x.v, x.a, T, v, a]
    n = max(map(len, parts))
    if any(len(part) not in (1, n) for part in parts):
        raise InputError(
            "the batches of q, v, a and of the base have different lengths",
            found=", ".join(str(len(part)) for part in parts),
        )
    q, v_, a_, *base = (np.ascontiguousarray(np.broadcast_to(part, (n, *part.shape[1:]))) for part in parts)
    inputs = replace(x, q=q, v=v_, a=a_, base=BaseMotion(*base))
    names = "base_placement", "base_velocity", "base_acceleration"
    return inputs.saying(**{name: part.tolist() for name, part in zip(names, base, strict=True)})


def _rows(text: str, option: str, layouts: Sequence[Sequence[str]]) -> tuple[FloatArray, Sequence[str]]:
    """Return the (n, width) numbers, and the layout that has as many columns."""
    import numpy as np  # noqa: PLC0415

    from urdfkin.motion.trajectory import numbers  # noqa: PLC0415

    if text.startswith("@"):
        return read_batch(Path(text[1:]), option, layouts)
    cells = text.split(",")
    names = next((names for names in layouts if len(names) == len(cells)), layouts[0])
    return np.array([numbers(cells, option, names)]), names


def _placements(rows: FloatArray, names: Sequence[str]) -> FloatArray:
    import numpy as np  # noqa: PLC0415

    from urdfkin.kinematics.rotation import rotation_from_rpy, rotation_of  # noqa: PLC0415

    T: FloatArray = np.tile(np.eye(4), (len(rows), 1, 1))
    turn = rotation_of if names is _QUATERNION else rotation_from_rpy
    T[:, :3, :3], T[:, :3, 3] = turn(rows[:, 3:]), rows[:, :3]
    return T
