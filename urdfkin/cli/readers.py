"""`urdfkin readers`: compare how other libraries read a robot file."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import click

from urdfkin.cli.options import load_robot, robot_argument, samples_option, seed_option
from urdfkin.cli.output import Answer, writes_answer
from urdfkin.errors.display import Table, TextDocument
from urdfkin.errors.escape import csv_value

if TYPE_CHECKING:
    from urdfkin.comparison.readers import LibraryReading


@click.command("readers", epilog="Example: urdfkin readers ur5 --with mujoco,yourdfpy")
@robot_argument
@click.option(
    "--with",
    "libraries",
    metavar="NAMES",
    help="Libraries to compare, separated by commas.",
    show_default="all installed libraries",
)
@samples_option(5, "Number of random configurations, in addition to q = 0.")
@seed_option
@writes_answer()
def command(robot: str, libraries: str | None, samples: int, seed: int) -> Answer:
    """Compare how other libraries read ROBOT: joints, their order, and the poses of all links.

    The libraries for URDF are Pinocchio, MuJoCo, Drake, iDynTree, yourdfpy, urchin, kinpy, ikpy, the Robotics
    Toolbox and scikit-robot. Pinocchio and MuJoCo also read MJCF files, and Newton reads USD files. Each
    library reads the file in its own process. The command compares the poses of all links with urdfkin's
    poses. If a library reads a joint differently, the command names the element of the file that causes the
    difference, for example the joint's `axis`.

    Exit 0: all libraries agree. 1: a library differs or refuses the file. 2: bad input.
    """
    from urdfkin.comparison.readers import compare_readers

    loaded = load_robot(robot, verify=False)
    names = None if libraries is None else [name.strip() for name in libraries.split(",")]
    found = compare_readers(loaded, names, samples=samples, seed=seed)

    def lines() -> Iterator[list[object]]:
        yield ["library", "version", "joint", "element", "difference", "size"]
        for reading in found:
            if reading.refused is not None:
                yield [reading.library, reading.version, "", "", csv_value(reading.refused), ""]
            for difference in reading.differences:
                words = map(csv_value, (difference.joint, difference.element, difference.words))
                yield [reading.library, reading.version, *words, repr(difference.size)]

    data = {"robot": loaded.name, "readers": [reading.as_dict() for reading in found]}
    code = int(not all(reading.agrees for reading in found))
    return Answer(lambda: _document(loaded.name, found), {"json": lambda: data, "csv": lines}, code=code)


def _document(name: str, found: tuple[LibraryReading, ...]) -> TextDocument:
    rows = [(f"{reading.library} {reading.version}", *_cells(reading)) for reading in found]
    parts: list[Table | str] = [Table(("library", "poses", "joints"), rows, left=3)]
    differences = [
        (one.joint, one.element, one.words, f"{one.size:.2g}")
        for reading in found
        for one in reading.differences
    ]
    if differences:
        parts.append(Table(("joint", "element", "difference", "size"), differences, left=3, names=(0,)))
    parts += [f"{x.library} refuses the file: {x.refused}" for x in found if x.refused is not None]
    parts += [f"{x.library} merges links: {', '.join(x.missing)}" for x in found if x.missing]
    return TextDocument(f"{name}: how other libraries read the file", parts)


def _cells(reading: LibraryReading) -> tuple[str, str]:
    if reading.refused is not None:
        return "refused", "-"
    poses = "the same" if reading.agrees else f"off by {reading.worst:.2g}"
    return poses, f"{len(reading.joints)}, in {'the same' if reading.same_order else 'another'} order"
