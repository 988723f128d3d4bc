"""`urdfkin robots`: list the robots of the catalogue. `urdfkin info`: show one robot.

`urdfkin order`: print the joint order of each tool, and code that converts one convention to another.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from urdfkin.cli.options import load_robot, robot_argument
from urdfkin.cli.output import Answer, answer_command
from urdfkin.cli.streams import say
from urdfkin.errors import InputError
from urdfkin.errors.display import Table, TextDocument
from urdfkin.errors.escape import csv_cell, csv_number_or_text
from urdfkin.system.lazy_import import lazy_import
from urdfkin.urdf.catalogue import CatalogueEntry, catalogue

if TYPE_CHECKING:
    from rich.console import Console

    from urdfkin.model.conventions import Conversion
    from urdfkin.robot import Robot

_FAMILIES = sorted({entry.family for entry in catalogue().values()})


@click.command("robots", epilog="Example: urdfkin robots --family arm")
@click.option("--family", metavar="NAME", help=f"Show only the robots of one family: {', '.join(_FAMILIES)}.")
@answer_command()
def robots_command(family: str | None) -> Answer:
    """List the robots of the catalogue, which every command loads by name.

    The catalogue contains the URDF files of the package example-robot-data and of urdfkin. The columns base
    and tip show the default frames of the options --base, --tip and --frame.
    """
    entries = [entry for entry in catalogue().values() if family in (None, entry.family)]
    if not entries:
        raise click.UsageError(f"no robots of family {family!r}; the families are: {', '.join(_FAMILIES)}")
    heads = ("name", "family", "base", "tip")
    rows = [(entry.name, entry.family, entry.base_frame or "", entry.tip_frame or "") for entry in entries]
    without_mimic = [
        f"{entry.name}: mimic joints are loaded as free joints: {entry.mimic_problem}"
        for entry in entries
        if entry.mimic_problem
    ]
    table = Table(heads, rows, left=4, names=(0, 2, 3))
    data = {
        "json": lambda: json.dumps(list(map(_as_dict, entries)), indent=2) + "\n",
        "csv": lambda: [heads, *rows],
    }
    return Answer(lambda: TextDocument("", [table, f"{len(entries)} robots", *without_mimic]), data)


def _as_dict(entry: CatalogueEntry) -> dict[str, object]:
    return {
        "name": entry.name,
        "family": entry.family,
        "path": str(entry.path),
        "limbs": {limb: list(ends) for limb, ends in entry.limbs.items()},
        "mimic": entry.mimic,
        "mimic_problem": entry.mimic_problem,
        "is_bundled": entry.is_bundled,
    }


#: Only JSON output needs this slow import.
_describe = lazy_import("urdfkin.validation.robot_summary:describe")


@click.command("info", epilog="Example: urdfkin info panda")
@robot_argument
@answer_command()
def info_command(robot: str) -> Answer:
    """Show a robot's links, joints, axes, limits, mimic rules, and indices in q and v.

    The joints have the same order as in q, in v and in the columns of a Jacobian. Pinocchio uses the same
    order. The last line reports whether the file lists the joints in another order. Limits are in rad and
    rad/s, or in m and m/s for prismatic joints. The first link is the root. If a link has several children, a
    branch of the drawn tree leads to each child. A link without a branch is the only child of the link above
    it.
    """
    loaded = load_robot(robot)
    data = {
        "json": lambda: _describe(loaded),
        "csv": lambda: _link_rows(loaded._text_document(), loaded.tree.links),
    }
    return Answer(
        loaded._text_document, data, fit_document=lambda out: _fit_to_terminal(out, loaded._text_document())
    )


def _fit_to_terminal(out: Console, document: TextDocument) -> TextDocument:
    """Merge the columns of links and joints if a table is wider than the terminal."""
    from urdfkin.report.listing import fits

    parts = list(document.parts)
    for k, part in enumerate(parts):
        if isinstance(part, Table) and not fits(out, part):
            rows = [(f"{link} by {joint}" if joint else link, *cells) for link, joint, *cells in part.rows]
            left = [i - 1 for i in range(1, len(part.heads)) if part.is_left(i)]
            parts[k] = Table(("link by joint", *part.heads[2:]), rows, left)
    return replace(document, parts=parts)


def _link_rows(document: TextDocument, links: Sequence[str]) -> Iterator[list[str]]:
    for part in document.parts:
        if isinstance(part, Table):
            yield list(part.heads)
            for link, (_, *cells) in zip(links, part.rows, strict=True):
                yield [csv_cell(link), *(csv_number_or_text(str(cell)) for cell in cells)]


_UNKNOWN_ORDER_NOTE = (
    "The joint order of idyntree follows no known rule. Give the order:"
    " robot.convention('idyntree', joints=[...]), or `joints` in a TOML file"
)


@click.command("order", epilog="Example: urdfkin order a1 --from isaaclab --to mujoco")
@robot_argument
@click.option(
    "--from", "start", metavar="NAME|FILE", help="Convention to convert from.", show_default="urdfkin"
)
@click.option("--to", "end", metavar="NAME|FILE", help="Convention to convert to.", show_default="urdfkin")
@answer_command()
def order_command(robot: str, start: str | None, end: str | None) -> Answer:
    """Show the order of the joints in Pinocchio, MuJoCo, Drake, Isaac Lab and other tools.

    For each joint and tool, the table contains the joint's index in q. If the joint's index in v differs, the
    table contains both indices: 7/6 means q[7] and v[6]. Tools with the same indices share a column. With
    --from or --to, the command prints Python code that converts q and v. NAME is a tool in the table. FILE
    is a TOML file that defines your own order, signs, units and motor zeros (docs/conventions.md).
    """
    loaded = load_robot(robot, verify=False)
    if start is None and end is None:
        return _orders(loaded)
    names = ("urdfkin" if name is None else name for name in (start, end))
    return _conversion_code(loaded, *names)


def _orders(robot: Robot) -> Answer:
    from urdfkin.model.conventions import BUILT_IN_NAMES, find_convention

    found: dict[str, Conversion] = {}
    for name in BUILT_IN_NAMES:
        if find_convention(name).order != "given":
            try:
                found[name] = robot.convention(name)
            except InputError as error:
                say(f"urdfkin: warning: no column for {error}", err=True)
    cells = {name: _index_cells(robot, conversion) for name, conversion in found.items()}
    groups: dict[tuple[str, ...], list[str]] = {}
    for name, column in cells.items():
        groups.setdefault(column, []).append(name)

    def document() -> TextDocument:
        heads = ("joint", *(first for first, *_ in groups.values()))
        rows = list(zip(robot.joint_names, *groups, strict=True))
        also = [f"{first}: also {', '.join(others)}" for first, *others in groups.values() if others]
        title = f"{robot.name}: index of each joint in q; 7/6 means q[7] and v[6]"
        return TextDocument(title, [Table(heads, rows, names=(0,)), *also, _UNKNOWN_ORDER_NOTE])

    def csv_rows() -> Iterator[list[object]]:
        yield ["joint", *cells]
        for name, *row in zip(robot.joint_names, *cells.values(), strict=True):
            yield [csv_cell(name), *row]

    conventions = {name: _convention_data(conversion) for name, conversion in found.items()}
    return Answer(
        document, {"json": lambda: {"robot": robot.name, "conventions": conventions}, "csv": csv_rows}
    )


def _index_cells(robot: Robot, conversion: Conversion) -> tuple[str, ...]:
    """Return the indices of each joint as text, for example "7", "7-13", or "-" for none.

    "7/6" means index 7 in q and index 6 in v.
    """
    indices = conversion.q_and_v_indices

    def span(found: list[int]) -> str:
        return str(found[0]) if len(found) == 1 else f"{found[0]}-{found[-1]}"

    def index_cell(name: str) -> str:
        if name not in indices:
            return "-"
        q, v = map(span, indices[name])
        return q if q == v else f"{q}/{v}"

    return tuple(map(index_cell, robot.joint_names))


def _convention_data(conversion: Conversion) -> dict[str, Any]:
    convention = conversion.convention
    return {
        "title": convention.title,
        "joints": list(conversion.joint_names),
        "q": list(conversion.coordinate_names),
        "v": list(conversion.velocity_names),
        "quaternion": convention.quaternion,
        "six_vectors": convention.six_vectors,
        "evidence": convention.evidence,
        "sources": list(convention.sources),
        "note": convention.note,
    }


def _conversion_code(robot: Robot, a: str, b: str) -> Answer:
    from urdfkin.model.conventions import find_reordering

    start, end = robot.convention(a), robot.convention(b)
    found = {letter: find_reordering(letter, start, end) for letter in "qv"}
    names = {"q": end.coordinate_names, "v": end.velocity_names}

    def code_lines() -> Iterator[str]:
        for letter, one in found.items():
            if one is not None:
                yield one.code(f"{letter}_to", f"{letter}_from")
                continue
            old, new, star = (
                ("q_from", "q_to", "") if letter == "q" else ("q_from, v_from", "q_to, v_to", "*")
            )
            yield f"# {letter}: indexing, factors and zeros cannot express this conversion. Use urdfkin:"
            yield f"{new} = robot.convention({b!r}).to({star}robot.convention({a!r}).from_({old}))"
        if start.angular_first != end.angular_first:
            yield "six_to = six_from[..., [3, 4, 5, 0, 1, 2]]"
        if note := end.convention.note:
            yield f"# {end.convention.name}: {note}"

    def data() -> dict[str, Any]:
        document: dict[str, Any] = {
            "from": start.convention.name,
            "to": end.convention.name,
            "joints": list(end.joint_names),
        }
        for letter, one in found.items():
            entry = None
            if one is not None:
                entry = {"index": list(one.index), "factor": list(one.factor), "zero": list(one.zero)}
            document[letter] = {"names": list(names[letter]), "reordering": entry}
        return document

    def csv_rows() -> Iterator[list[object]]:
        if missing := [letter for letter, one in found.items() if one is None]:
            message = "indices, factors and zeros cannot express this conversion, so it has no CSV"
            remedy = "use --format table, which prints code"
            raise InputError(message, where=f"{a} to {b}", found=", ".join(missing), remedy=remedy)
        yield ["what", "name", "index", "factor", "zero"]
        for letter, one in found.items():
            if one is not None:
                cells = zip(names[letter], one.index, map(repr, one.factor), map(repr, one.zero), strict=True)
                yield from ([letter, csv_cell(name), *more] for name, *more in cells)

    return Answer(lambda: TextDocument("", list(code_lines())), {"json": data, "csv": csv_rows})
