"""`urdfkin readers`: compare how other libraries read a robot file."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import click

from urdfkin.cli.options import Whole, load_robot, robot_argument
from urdfkin.cli.output import Answer, answering
from urdfkin.errors.display import Table, TextDocument
from urdfkin.errors.escape import csv_value

if TYPE_CHECKING:
    from urdfkin.comparison.readers import LibraryReading


@click.command("readers", epilog="Example: urdfkin readers ur5 --with mujoco,yourdfpy")
@robot_argument
@click.option("--with", "libraries", metavar="NAME,...", help="Libraries. Default: all that are installed.")
@click.option(
    "--samples",
    type=Whole(0),
    default=5,
    show_default=True,
    help="Number of random configurations, in addition to q = 0.",
)
@click.option("--seed", type=Whole(0), default=0, show_default=True, help="Seed of the configurations.")
@answering()
def command(robot: str, libraries: str | None, samples: int, seed: int) -> Answer:
    """Compare how other libraries read ROBOT: joints, their order, and the poses of all links.

    The libraries for URDF are Pinocchio, MuJoCo, Drake, iDynTree, yourdfpy, urchin, kinpy, ikpy, the Robotics
    Toolbox and scikit-robot. Each installed library reads the file in a process of its own. Pinocchio and
    MuJoCo read MJCF files, and Newton reads USD files. The poses of all links are compared with urdfkin's. If
    a library reads a joint differently, the command names the element of the file that causes the difference,
    for example the joint's `axis`.

    Exit 0: all libraries agree. 1: a library differs or refuses the file. 2: bad input.
    """
    from urdfkin.comparison.readers import compare_readers

    loaded = load_robot(robot, verify=False)
    names = None if libraries is None else [name.strip() for name in libraries.split(",")]
    found = compare_readers(loaded, names, samples=samples, seed=seed)

    def lines() -> Iterator[list[object]]:
        yield ["library", "version", "joint", "element", "difference", "size"]
        for one in found:
            if one.refused is not None:
                yield [one.library, one.version, "", "", csv_value(one.refused), ""]
            for each in one.differences:
                words = map(csv_value, (each.joint, each.element, each.words))
                yield [one.library, one.version, *words, repr(each.size)]

    data = {"robot": loaded.name, "readers": [one.as_dict() for one in found]}
    code = int(not all(one.agrees for one in found))
    return Answer(lambda: _document(loaded.name, found), {"json": lambda: data, "csv": lines}, code=code)


def _document(name: str, found: tuple[LibraryReading, ...]) -> TextDocument:
    rows = [(f"{one.library} {one.version}", *_cells(one)) for one in found]
    table = Table(("library", "poses", "joints"), rows, left=3)
    differences = [
        (each.joint, each.element, each.words, f"{each.size:.2g}")
        for one in found
        for each in one.differences
    ]
    heads = ("joint", "element", "difference", "size")
    more = [Table(heads, differences, left=3, names=(0,))] if differences else []
    refused = [f"{one.library} refuses the file: {one.refused}" for one in found if one.refused is not None]
    missing = [f"{one.library} merges links: {', '.join(one.missing)}" for one in found if one.missing]
    return TextDocument(f"{name}: how other libraries read the file", [table, *more, *refused, *missing])


def _cells(one: LibraryReading) -> tuple[str, str]:
    if one.refused is not None:
        return "refused", "-"
    poses = "the same" if one.agrees else f"off by {one.worst:.2g}"
    return poses, f"{len(one.joints)}, {'in the same order' if one.same_order else 'in another order'}"
