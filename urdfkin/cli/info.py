"""`urdfkin info`: what a robot is made of."""

from __future__ import annotations

import json
import math
import sys
from typing import TYPE_CHECKING

import click

from urdfkin.cli.arguments import load_robot, robot_argument

if TYPE_CHECKING:
    from urdfkin.model.tree import Joint
    from urdfkin.robot import Robot

EXAMPLE = "urdfkin info panda"

_COLUMNS = ("joint", "kind", "q", "parent", "child", "lower", "upper")


@click.command(epilog=f"Example: {EXAMPLE}")
@robot_argument
@click.option("--format", "format_", type=click.Choice(["table", "json"]), default="table", show_default=True)
def command(robot: str, mimic: bool | None, root_joint: str | None, format_: str) -> None:
    """Joints, limits, frames and coordinates of a robot.

    Joints stand in the order of q, v and of a Jacobian's columns, which is Pinocchio's and not the file's.
    """
    loaded = load_robot(robot, mimic, root_joint)
    if format_ == "json":
        from urdfkin.validation.description import describe  # noqa: PLC0415  keeps --help fast

        json.dump(describe(loaded), sys.stdout, indent=2, allow_nan=False)
        click.echo()
        return
    _print(loaded)


def _print(robot: Robot) -> None:
    from urdfkin.cli.output import console  # noqa: PLC0415  json needs no tables
    from urdfkin.report.listing import fits, make_table, print_named  # noqa: PLC0415

    tree, out = robot.tree, console()
    out.print(
        f"{robot.name}: nq {robot.nq}, nv {robot.nv}, {len(tree.links)} links, {len(tree.joints)} joints"
    )
    out.print(f"root {tree.links[0]}, default base {robot.base_frame}, default tip {robot.tip_frame}")
    moving = [(i, joint) for i, joint in enumerate(tree.joints) if joint.kind.nv]
    rows = [
        (
            joint.name,
            joint.kind.value,
            _coordinates(robot, i),
            tree.links[joint.parent],
            tree.links[i + 1],
            *_limits(joint),
        )
        for i, joint in moving
    ]
    if fits(out, _COLUMNS, rows):
        out.print(make_table(_COLUMNS, rows, left=range(5)))
    else:
        short = [
            (f"{joint}: {parent} -> {child}", kind, q, *limits)
            for joint, kind, q, parent, child, *limits in rows
        ]
        print_named(out, ["joint: parent -> child", "kind", "q", "lower", "upper"], short, left=range(3))
    fixed = [joint.name for joint in tree.joints if not joint.kind.nv]
    if fixed:
        out.print(f"fixed joints ({len(fixed)}): {', '.join(fixed)}")
    out.print(f"frames: {len(robot.frame_names)}, every link and joint")


def _coordinates(robot: Robot, i: int) -> str:
    joint, at = robot.tree.joints[i], robot.tree.q_index[i]
    if joint.mimic:
        return f"{joint.mimic.multiplier:g} q[{at}] {joint.mimic.offset:+g}"
    return f"q[{at}]" if joint.nq == 1 else f"q[{at}:{at + joint.nq}]"


def _limits(joint: Joint) -> tuple[str, str]:
    limit = joint.limit
    return ("", "") if limit is None else (_bound(limit.lower), _bound(limit.upper))


def _bound(value: float) -> str:
    return "" if math.isinf(value) else f"{value:.6g}"
