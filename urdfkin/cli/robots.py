"""`urdfkin robots`: list the robots of the catalogue. `urdfkin info`: show one robot."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import click

from urdfkin.cli.options import load_robot, robot_argument
from urdfkin.cli.output import Answer, writes_answer
from urdfkin.errors.display import Table, TextDocument
from urdfkin.errors.escape import csv_cell, csv_value
from urdfkin.system.lazy_import import lazy_import
from urdfkin.urdf.catalogue import Entry, catalogue

if TYPE_CHECKING:
    from rich.console import Console

_FAMILIES = sorted({entry.family for entry in catalogue().values()})


@click.command("robots", epilog="Example: urdfkin robots --family arm")
@click.option("--family", metavar="NAME", help=f"Show only the robots of one family: {', '.join(_FAMILIES)}.")
@writes_answer()
def robots_command(family: str | None) -> Answer:
    """List the robots of the catalogue, which every command loads by name.

    The catalogue contains the URDF files of the package example-robot-data and of urdfkin. The base and the
    tip in this list are the defaults of the options --base, --tip and --frame.
    """
    entries = [entry for entry in catalogue().values() if family in (None, entry.family)]
    if not entries:
        raise click.UsageError(f"no robots of family {family!r}; the families are: {', '.join(_FAMILIES)}")
    heads = ("name", "family", "base", "tip")
    rows = [(entry.name, entry.family, entry.base or "", entry.tip or "") for entry in entries]
    without_mimic = [
        f"{entry.name}: mimic joints are loaded as free joints: {entry.reason}"
        for entry in entries
        if entry.reason
    ]
    table = Table(heads, rows, left=4, names=(0, 2, 3))
    data = {
        "json": lambda: json.dumps(list(map(_as_dict, entries)), indent=2) + "\n",
        "csv": lambda: [heads, *rows],
    }
    return Answer(lambda: TextDocument("", [table, f"{len(entries)} robots", *without_mimic]), data)


def _as_dict(entry: Entry) -> dict[str, object]:
    return {
        "name": entry.name,
        "family": entry.family,
        "path": str(entry.path),
        "limbs": {limb: list(ends) for limb, ends in entry.limbs.items()},
        "mimic": entry.mimic,
        "reason": entry.reason,
        "own": entry.own,
    }


#: The import of this function is slow, and only JSON output needs the function.
_describe = lazy_import("urdfkin.validation.robot_summary:describe")


@click.command("info", epilog="Example: urdfkin info panda")
@robot_argument
@writes_answer()
def info_command(robot: str) -> Answer:
    """Show a robot's links, joints, axes, limits, indices in q and v, and mimic rules.

    The joints have the same order as in q, in v and in the columns of a Jacobian. This is Pinocchio's order;
    the last line states whether the file has another order. Limits are in rad and rad/s, for prismatic joints
    in m and m/s. A link that is not indented is a child of the link above it. If a link has several children,
    lines before their names mark the children.
    """
    loaded = load_robot(robot)
    data = {
        "json": lambda: _describe(loaded),
        "csv": lambda: _rows(loaded._text_document(), loaded.tree.links),
    }
    return Answer(loaded._text_document, data, fitted=lambda out: _fitted(out, loaded._text_document()))


def _fitted(out: Console, document: TextDocument) -> TextDocument:
    """Merge the columns of links and joints if a table is wider than the terminal."""
    from urdfkin.report.listing import fits

    parts = list(document.parts)
    for k, part in enumerate(parts):
        if isinstance(part, Table) and not fits(out, part):
            rows = [(f"{link} by {joint}" if joint else link, *cells) for link, joint, *cells in part.rows]
            left = [i - 1 for i in range(1, len(part.heads)) if part.is_left(i)]
            parts[k] = Table(("link by joint", *part.heads[2:]), rows, left)
    return replace(document, parts=parts)


def _rows(document: TextDocument, links: Sequence[str]) -> Iterator[list[str]]:
    for part in document.parts:
        if isinstance(part, Table):
            yield list(part.heads)
            for link, (_, *cells) in zip(links, part.rows, strict=True):
                yield [csv_cell(link), *(csv_value(str(cell)) for cell in cells)]
