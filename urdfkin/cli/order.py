"""`urdfkin order`: the joints of a robot in the order of each tool, and code that converts one to another."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING, Any

import click

from urdfkin.cli.options import load_robot, robot_argument
from urdfkin.cli.output import format_option
from urdfkin.cli.streams import say

if TYPE_CHECKING:
    from urdfkin.conventions import Conversion
    from urdfkin.robot import Robot

EXAMPLE = "urdfkin order a1 --from isaaclab --to mujoco"


@click.command("order", epilog=f"Example: {EXAMPLE}")
@robot_argument
@click.option("--from", "start", metavar="NAME|FILE", help="Convention to convert from. Default: urdfkin.")
@click.option("--to", "end", metavar="NAME|FILE", help="Convention to convert to. Default: urdfkin.")
@format_option("table", "json", "csv", help_="Output format.")
def command(robot: str, start: str | None, end: str | None, format_: str) -> None:
    """Show the order of the joints in Pinocchio, MuJoCo, Drake, Isaac Lab and other tools.

    A cell is the joint's index in q; if the index in v differs, both, as q/v. Tools with the same indices
    share a column. With --from or --to, the command prints the permutation as lines of NumPy. NAME is a tool
    from the table; FILE is a TOML file with your own order, signs, units and motor zeros
    (docs/conventions.md).
    """
    loaded = load_robot(robot, verify=False)
    if start is None and end is None:
        _show_table(loaded, format_)
    else:
        _show_code(loaded.convention(start or "urdfkin"), loaded.convention(end or "urdfkin"), format_)


def _show_table(robot: Robot, format_: str) -> None:
    from urdfkin.conventions import BUILT_IN, find_convention  # noqa: PLC0415  keeps --help fast
    from urdfkin.errors.escape import csv_cell, csv_text, json_text  # noqa: PLC0415

    found = {name: robot.convention(name) for name in BUILT_IN if find_convention(name).order != "given"}
    if format_ == "json":
        document = {name: _as_json(conversion) for name, conversion in found.items()}
        click.echo(json_text({"robot": robot.name, "conventions": document}))
        return
    groups: dict[tuple[str, ...], list[str]] = {}
    for name, conversion in found.items():
        groups.setdefault(_cells(robot, conversion), []).append(name)
    if format_ == "csv":
        rows: list[list[object]] = [["joint", *found]]
        cells = [_cells(robot, conversion) for conversion in found.values()]
        rows += ([csv_cell(name), *row] for name, *row in zip(robot.joint_names, *cells, strict=True))
        sys.stdout.write(csv_text(rows))
        return
    from urdfkin.cli.output import console  # noqa: PLC0415
    from urdfkin.report.listing import print_named  # noqa: PLC0415

    out = console()
    out.print(f"{robot.name}: index of each joint in q, or in q/v where they differ", style="bold")
    print_named(
        out, ["joint", *(names[0] for names in groups.values())], zip(robot.joint_names, *groups, strict=True)
    )
    for first, *others in groups.values():
        if others:
            say(f"{first}: also {', '.join(others)}")
    say("idyntree: its order comes from a hash table; pass it as robot.convention('idyntree', joints=[...])")


def _cells(robot: Robot, conversion: Conversion) -> tuple[str, ...]:
    """Return the cell of each moving joint: its index in q, or in q/v; "-" without a column."""
    indices = conversion.q_and_v_indices

    def span(at: list[int]) -> str:
        return str(at[0]) if len(at) == 1 else f"{at[0]}-{at[-1]}"

    def cell(name: str) -> str:
        if name not in indices:
            return "-"
        q, v = map(span, indices[name])
        return q if q == v else f"{q}/{v}"

    return tuple(map(cell, robot.joint_names))


def _as_json(conversion: Conversion) -> dict[str, Any]:
    how = conversion.convention
    return {
        "title": how.title,
        "joints": list(conversion.joint_names),
        "q": list(conversion.coordinate_names),
        "v": list(conversion.rate_names),
        "quaternion": how.quaternion,
        "six_vectors": how.six,
        "evidence": how.evidence,
        "sources": list(how.sources),
        "note": how.note,
    }


def _show_code(start: Conversion, end: Conversion, format_: str) -> None:
    from urdfkin.conventions import reordering  # noqa: PLC0415
    from urdfkin.errors.escape import csv_cell, csv_text, json_text  # noqa: PLC0415

    a, b = start.convention.name, end.convention.name
    found = {what: reordering(what, start, end) for what in "qv"}
    names = {"q": end.coordinate_names, "v": end.rate_names}
    if format_ == "json":
        document: dict[str, Any] = {"from": a, "to": b, "joints": list(end.joint_names)}
        for what, one in found.items():
            entry = None if one is None else {"index": one.index, "factor": one.factor, "zero": one.zero}
            document[what] = {"names": names[what], "reordering": entry}
        click.echo(json_text(json.loads(json.dumps(document))))
        return
    if format_ == "csv":
        rows: list[list[object]] = [["what", "name", "index", "factor", "zero"]]
        for what, one in found.items():
            if one is not None:
                cells = zip(names[what], one.index, map(repr, one.factor), map(repr, one.zero), strict=True)
                rows += ([what, csv_cell(name), *more] for name, *more in cells)
        sys.stdout.write(csv_text(rows))
        return
    for what, one in found.items():
        if one is not None:
            say(one.code(f"{what}_to", f"{what}_from"))
        else:
            say(f"# {what}: more than a permutation; use urdfkin:")
            given = "q_from" if what == "q" else "q_from, v_from"
            made = "q_to" if what == "q" else "q_to, v_to"
            inner = f"robot.convention({a!r}).from_({given})"
            say(f"{made} = robot.convention({b!r}).to({'' if what == 'q' else '*'}{inner})")
    if start.angular_first != end.angular_first:
        say("six_to = six_from[..., [3, 4, 5, 0, 1, 2]]")
    if say_again := end.convention.note:
        say(f"# {b}: {say_again}")
