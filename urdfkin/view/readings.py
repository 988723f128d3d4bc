"""The numbers beside the picture, as Markdown, with what Pinocchio says of them."""

from __future__ import annotations

import numpy as np

from urdfkin.errors.printable import markdown_text
from urdfkin.model.tree import FloatArray
from urdfkin.motion.frame_motion import FrameMotion
from urdfkin.verify.pinocchio_module import version
from urdfkin.view.overlays import PART_COLOURS


def numbers(x: FrameMotion) -> str:
    """Position, velocity, acceleration, singular values, and the check, of a motion of one sample."""
    rows = [
        ("position", "m", x.placement[0, :3, 3]),
        ("velocity", "m/s", x.velocity[0, :3]),
        ("ang. velocity", "rad/s", x.velocity[0, 3:]),
        ("acceleration", "m/s²", x.acceleration[0, :3]),
        ("ang. acceleration", "rad/s²", x.acceleration[0, 3:]),
    ]
    lines = [
        f"**{markdown_text(x.frame)}**, {x.reference.name}",
        "",
        "| | x | y | z |",
        "| --- | ---: | ---: | ---: |",
    ]
    lines += [f"| {name} [{unit}] | {' | '.join(map(_number, vector))} |" for name, unit, vector in rows]
    lines += [
        "",
        f"singular values of J: {', '.join(map(_number, x.singular_values[0]))}",
        "",
        f"manipulability: {_number(x.manipulability()[0])},"
        f" linear {_number(x.manipulability(slice(0, 3))[0])}",
        "",
        check_line(x),
    ]
    return "\n".join(lines)


def check_line(x: FrameMotion) -> str:
    """What Pinocchio says of the numbers shown."""
    if x.not_verified is not None:
        return f"**! not verified** by Pinocchio {version()}: {markdown_text(x.not_verified)}"
    figures = ", ".join(f"{quantity} {check.units[0]:.2g}" for quantity, check in x.checks.items())
    mark = "**✓ verified** by" if x.agrees else "**✗ disagrees** with"
    return f"{mark} Pinocchio {version()}, eps·scale: {figures}"


def legend() -> str:
    """Which colour each part of the acceleration has."""
    return " ".join(
        f'<span style="color: rgb{colour}">■</span> {name}' for name, colour in PART_COLOURS.items()
    )


def _number(value: float | FloatArray) -> str:
    rounded = float(np.round(value, 12))
    return f"{rounded:.4g}" if rounded else "0"
