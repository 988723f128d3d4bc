"""`urdfkin chain`: the joints between two frames as axes, where they stand and how they point."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from urdfkin.cli.arguments import (
    forms,
    load_robot,
    path_options,
    q_option,
    read_inputs,
    robot_argument,
    seed_option,
    verify_option,
)
from urdfkin.cli.door import say
from urdfkin.cli.endings import form_of
from urdfkin.cli.output import console, end_of_path, hand_out, output_option
from urdfkin.errors import InputError
from urdfkin.errors.printable import csv_cell, csv_text, json_text
from urdfkin.errors.showing import six_digits

if TYPE_CHECKING:
    from urdfkin.model.chain import FrameChain
    from urdfkin.model.tree import FloatArray
    from urdfkin.robot import Robot

_ENDINGS = {".json": ("json",), ".csv": ("csv",)}


@click.command(epilog="Example: urdfkin chain panda --base panda_link0 --tip panda_hand")
@robot_argument
@path_options
@q_option
@seed_option
@forms("table", "json", "csv")
@verify_option
@output_option
@click.pass_context
def command(
    context: click.Context,
    robot: str,
    base: str | None,
    tip: str | None,
    q: str,
    seed: int,
    format_: str,
    verify: bool,
    output: Path | None,
) -> None:
    """The joints between two frames (section 7.5), in one configuration, as they are seen from the base.

    For each its axis z, its origin O and the interorigin vector d to the next origin, the last to the tip;
    metres. The path may run up the tree: a joint that is passed backwards has its axis reversed, so that its
    coordinate counts as the URDF's. Fixed joints are folded in. --q is the whole robot's.

    Exit 0: verified. 1: a disagreement. 2: bad input. 3: not checked.
    """
    from urdfkin.verify.chains import check_chain  # noqa: PLC0415  keeps --help fast

    format_ = form_of(context, output, _ENDINGS, "csv")
    loaded = load_robot(robot, verify=verify)
    path = loaded.chain(tip, base)
    at = read_inputs(loaded, path.tip, seed, q).q
    if len(at) != 1:
        raise InputError("a chain is shown in one configuration", where="--q", found=str(len(at)))
    said = check_chain(loaded.verifier, path, at) if verify else None
    line, code = end_of_path(said)
    if format_ == "table" and output is None:
        _print(path, path.coupling.select(loaded.tree, at)[0])
        say(line)
    else:
        form = _as_json if format_ == "json" else _as_csv
        hand_out(form(loaded, path, at[0], line if said else None).encode(), output)
        say(line, err=True)
    context.exit(code)


def _print(path: FrameChain, q: FloatArray) -> None:
    from urdfkin.report.listing import print_named  # noqa: PLC0415  keeps --help fast

    out = console()
    names = ", ".join(path.joint_names) or "none: nothing moves"
    out.print(f"{path.robot}: {path.base} to {path.tip}, coordinates {names}", style="bold")
    axes, origins, ways = path.axes(q), path.origins(q), path.interorigin(q)
    rows = [
        (joint.name, _kind(joint), _vector(axes[i]), _vector(origins[i]), _vector(ways[i]))
        for i, joint in enumerate(path.joints)
    ]
    rows.append((path.tip, "tip", "", _vector(origins[-1]), ""))
    print_named(out, ("joint", "kind", "axis z", "origin O [m]", "to the next d [m]"), rows, left=range(5))


def _kind(joint: Any) -> str:
    follows = f", follows {joint.mimic.leader}" if joint.mimic else ""
    return f"{joint.kind.value}{', backwards' if joint.backwards else ''}{follows}"


def _vector(numbers: FloatArray) -> str:
    """Six digits, and what is rounding of a metre as 0."""
    return " ".join(six_digits(x) for x in numbers.tolist())


def _as_json(robot: Robot, path: FrameChain, q: FloatArray, line: str | None) -> str:
    own = path.coupling.select(robot.tree, q)
    axes, origins, ways = (x(own).tolist() for x in (path.axes, path.origins, path.interorigin))
    document = {
        "robot": robot.name,
        "source": robot.source,
        "base": path.base,
        "tip": path.tip,
        "q": q.tolist(),
        "coordinates": list(path.joint_names),
        "path_q": own.tolist(),
        "joints": [
            {
                "name": joint.name,
                "kind": joint.kind.value,
                "backwards": joint.backwards,
                "follows": joint.mimic.leader if joint.mimic else None,
                "axis": axes[i],
                "origin": origins[i],
                "interorigin": ways[i],
            }
            for i, joint in enumerate(path.joints)
        ],
        "placement": path.placement(own).tolist(),
        "verified": line is not None,
        "check": line,
    }
    return json_text(document) + "\n"


def _as_csv(robot: Robot, path: FrameChain, q: FloatArray, _line: str | None) -> str:
    own = path.coupling.select(robot.tree, q)
    vectors = [f"{name}{axis}" for name in ("z", "O", "d") for axis in "xyz"]
    rows: list[list[object]] = [["i", "joint", "kind", "backwards", *vectors]]
    joints = zip(path.joints, path.axes(own), path.origins(own), path.interorigin(own), strict=False)
    for i, (joint, *three) in enumerate(joints, 1):
        numbers = [repr(x) for vector in three for x in vector.tolist()]
        rows.append([i, csv_cell(joint.name), joint.kind.value, int(joint.backwards), *numbers])
    return csv_text(rows)
