"""`urdfkin info`: what a robot is made of, as one table that is also its tree."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING

import click

from urdfkin.cli.arguments import load_robot, robot_argument

if TYPE_CHECKING:
    from urdfkin.model.tree import KinematicTree
    from urdfkin.robot import Robot

EXAMPLE = "urdfkin info panda"

#: How a link hangs from one with several children: (guide of itself, guide of what is below) while more of
#: them come, then of the last. A terminal that knows no lines gets the second pair of pairs.
_GUIDES = {False: (("├ ", "│ "), ("└ ", "  ")), True: (("+ ", "| "), ("` ", "  "))}


@click.command(epilog=f"Example: {EXAMPLE}")
@robot_argument
@click.option("--format", "format_", type=click.Choice(["table", "json"]), default="table", show_default=True)
def command(robot: str, mimic: bool | None, root_joint: str | None, format_: str) -> None:
    """A robot's tree: links, joints, axes, limits, places in q and v, and who follows whom.

    Joints stand in the order of q, v and of a Jacobian's columns, which is Pinocchio's; where the file has
    another, a line says so. Limits are in rad and rad/s, of prismatic joints in m and m/s. A link that is not
    indented hangs from the one above it; where several hang from one link, lines lead to them.
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
    from urdfkin.model.described import COLUMNS, cells_of  # noqa: PLC0415
    from urdfkin.report.listing import fits, make_table, print_named  # noqa: PLC0415

    tree, out = robot.tree, console()
    out.print(
        f"{robot.name}: nq {robot.nq}, nv {robot.nv}, {len(tree.links)} links, {len(tree.joints)} joints"
    )
    out.print(f"root {tree.links[0]}, default base {robot.base_frame}, default tip {robot.tip_frame}")
    hung = [
        guide + link for guide, link in zip(guides(tree, out.options.ascii_only), tree.links, strict=True)
    ]
    details = [cells_of(tree, i) for i in range(len(tree.joints))]
    columns = COLUMNS if any(joint.mimic for joint in tree.joints) else COLUMNS[:-1]
    empty = ("",) * len(columns)
    rows = [(hung[0], "", *empty)]
    for joint, link, cells in zip(tree.joints, hung[1:], details, strict=True):
        rows.append((link, joint.name, *cells[: len(columns)]))
    if fits(out, ("link", "joint", *columns), rows):
        out.print(make_table(("link", "joint", *columns), rows, left=(0, 1, 2, 3, 4, 5, 9)))
    else:
        short = [(f"{link} by {joint}" if joint else link, *cells) for link, joint, *cells in rows]
        print_named(out, ("link by joint", *columns), short, left=(0, 1, 2, 3, 4, 8))
    tips = ", ".join(tree.links[leaf] for leaf in tree.leaves())
    out.print(f"frames: {len(robot.frame_names)}, every link and joint by its name; tips: {tips}")
    out.print(_order(robot))


def guides(tree: KinematicTree, ascii_only: bool = False) -> Iterator[str]:
    """What stands before each link, root first, so that the list is a tree: nothing before an only child."""
    children = [0] * len(tree.links)
    for joint in tree.joints:
        children[joint.parent] += 1
    left, below = list(children), [""]
    more, last = _GUIDES[ascii_only]
    yield ""
    for joint in tree.joints:
        left[joint.parent] -= 1
        own, behind = ("", "") if children[joint.parent] == 1 else more if left[joint.parent] else last
        yield below[joint.parent] + own
        below.append(below[joint.parent] + behind)


def _order(robot: Robot) -> str:
    """Whether the file has its moving joints in another order, and from where on."""
    from urdfkin.urdf.plain_xml import plain_xml  # noqa: PLC0415

    known = set(robot.joint_names)
    written = [
        e.get("name", "") for e in plain_xml(robot.urdf) if e.tag == "joint" and e.get("name") in known
    ]
    ours = [name for name in robot.joint_names if name in set(written)]
    says = "order of joints: Pinocchio's (depth first, siblings by name), for q, v and columns"
    first = next((k for k, pair in enumerate(zip(written, ours, strict=False)) if pair[0] != pair[1]), None)
    if first is None:
        return f"{says}; the file has the same"
    return f"{says}; the file's differs: {written[first]} is number {first + 1} there, {ours[first]} here"
