"""`urdfkin info`: what a robot is made of."""

from __future__ import annotations

import json
import math
import sys
from typing import TYPE_CHECKING

import click

from urdfkin.cli.arguments import load_robot, robot_argument

if TYPE_CHECKING:
    from urdfkin.robot import Robot
    from urdfkin.tree import Joint

EXAMPLE = "urdfkin info panda"


@click.command(epilog=f"Example: {EXAMPLE}")
@robot_argument
@click.option("--format", "format_", type=click.Choice(["table", "json"]), default="table", show_default=True)
def command(robot: str, mimic: bool | None, root_joint: str | None, format_: str) -> None:
    """Joints, limits, frames and coordinates of a robot.

    Joints stand in the order of q, v and of a Jacobian's columns, which is Pinocchio's and not the file's.
    """
    loaded = load_robot(robot, mimic, root_joint)
    if format_ == "json":
        json.dump(_as_dict(loaded), sys.stdout, indent=2, allow_nan=False)
        click.echo()
        return
    _print(loaded)


def _print(robot: Robot) -> None:
    from urdfkin.cli.output import console, make_table  # noqa: PLC0415  json needs no tables

    tree, out = robot.tree, console()
    out.print(
        f"{robot.name}: nq {robot.nq}, nv {robot.nv}, {len(tree.links)} links, {len(tree.joints)} joints"
    )
    out.print(f"root {tree.links[0]}, default base {robot.base_frame}, default tip {robot.tip_frame}")
    rows = (
        (
            joint.name,
            joint.kind.value,
            _coordinates(robot, i),
            tree.links[joint.parent],
            tree.links[i + 1],
            *_limits(joint),
        )
        for i, joint in enumerate(tree.joints)
        if joint.kind.nv
    )
    out.print(make_table(["joint", "kind", "q", "parent", "child", "lower", "upper"], rows, words=5))
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


def _as_dict(robot: Robot) -> dict[str, object]:
    tree = robot.tree
    return {
        "name": robot.name,
        "source": robot.source,
        "nq": robot.nq,
        "nv": robot.nv,
        "base": robot.base_frame,
        "tip": robot.tip_frame,
        "coordinates": list(robot.coordinate_names),
        "rates": list(robot.rate_names),
        "frames": list(robot.frame_names),
        "joints": [_joint(robot, i) for i in range(len(tree.joints))],
    }


def _joint(robot: Robot, i: int) -> dict[str, object]:
    tree = robot.tree
    joint = tree.joints[i]
    limit = joint.limit
    return {
        "name": joint.name,
        "kind": joint.kind.value,
        "parent": tree.links[joint.parent],
        "child": tree.links[i + 1],
        "placement": joint.T_parent_joint.tolist(),
        "axis": joint.axis.tolist() if joint.kind.has_axis else None,
        "q": tree.q_index[i] if joint.kind.nq else None,
        "v": tree.v_index[i] if joint.kind.nv else None,
        "limit": None
        if limit is None
        else {
            name: value if math.isfinite(value) else None
            for name, value in (
                ("lower", limit.lower),
                ("upper", limit.upper),
                ("velocity", limit.velocity),
                ("effort", limit.effort),
            )
        },
        "mimic": None
        if joint.mimic is None
        else {
            "leader": joint.mimic.leader,
            "multiplier": joint.mimic.multiplier,
            "offset": joint.mimic.offset,
        },
    }
