"""`urdfkin vectors`: write test vectors for other programs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from urdfkin.cli.completion import complete_robot
from urdfkin.cli.options import load_robot, samples_option, schema_option
from urdfkin.cli.output import Answer, counted, writes_answer
from urdfkin.errors import InputError, SourceError
from urdfkin.errors.display import Table, TextDocument
from urdfkin.errors.escape import csv_value

if TYPE_CHECKING:
    from urdfkin.validation.vectors import Written

EXAMPLE = "urdfkin vectors write vectors ur5 panda"


@click.group("vectors", no_args_is_help=False, epilog=f"Example: {EXAMPLE}")
def vectors_command() -> None:
    """Write test vectors for other programs.

    A library in any language compares its results with these test vectors; docs/vectors.md explains how.
    """


@vectors_command.command(
    "write", short_help="Write test vectors into a folder.", epilog=f"Example: {EXAMPLE}"
)
@click.argument("folder", metavar="DIR", type=click.Path(path_type=Path), required=False)
@click.argument("robots", metavar="[ROBOT]...", nargs=-1, shell_complete=complete_robot)
@click.option(
    "--catalogue/--no-catalogue",
    default=True,
    help="Without ROBOT: also write test vectors for the robots of the catalogue. These test vectors refer to"
    " files of example-robot-data.",
)
@samples_option(3, "Number of configurations of each robot; the first one is zero.", least=1, most=1000)
@schema_option("urdfkin.validation.vectors:VECTORS", "the files")
@writes_answer()
def write_command(folder: Path | None, robots: tuple[str, ...], catalogue: bool, samples: int) -> Answer:
    """Write test vectors into the folder DIR: results at 50 digits, with a tolerance for every number.

    With ROBOT, the command writes the test vectors of these robots only. Without ROBOT, it writes test
    vectors of the robots of the catalogue and of some 70 small robots. Each small robot tests one feature of
    URDF. Each robot has a JSON file, and a text file with the same numbers, separated by tabs. The file
    SHA256SUMS has the digests of all files.

    The results are the placement, velocity, Jacobian, Jacobian rate, Hessian, classical acceleration and
    spatial acceleration. The files contain the placement once, and each other quantity in the reference
    frames LOCAL, WORLD and LOCAL_WORLD_ALIGNED. The files depend only on the robots and on --samples.
    """
    from urdfkin.validation import vectors

    if folder is None:
        raise click.UsageError("name the folder for the files: urdfkin vectors write DIR")
    loaded = [load_robot(robot, verify=False) for robot in robots]
    names = [vectors.name_of(robot) for robot in loaded]
    if len({vectors.stem(name).casefold() for name in names}) < len(names):
        raise InputError(
            "two robots have the same name, so their files would have the same name",
            found=", ".join(names),
            remedy="write them into two folders",
        )
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        found = error.strerror or str(error)
        raise SourceError("cannot be written", where=str(folder), found=found) from error
    written = [vectors.write_robot(folder, robot, samples) for robot in loaded]
    if not robots:
        written = list(vectors.write_features(folder, samples))
        written += vectors.write_catalogue(folder, samples) if catalogue else []
    vectors.write_sums(folder, written)

    def rows() -> Iterator[tuple[object, ...]]:
        yield "robot", "file", "numbers"
        for one in written:
            yield csv_value(one.robot), csv_value(one.files[0].name), one.numbers

    data = {
        "folder": str(folder),
        "robots": [
            {"robot": one.robot, "files": [path.name for path in one.files], "numbers": one.numbers}
            for one in written
        ],
    }
    return Answer(lambda: _document(folder, written), {"json": lambda: data, "csv": rows})


def _document(folder: Path, written: Sequence[Written]) -> TextDocument:
    rows = [(one.robot, one.files[0].name, f"{one.numbers:,}") for one in written]
    robots = counted(len(written), "robot")
    total = f"{sum(one.numbers for one in written):,} numbers of {robots} in {folder}"
    return TextDocument("", [Table(("robot", "file", "numbers"), rows, left=2, names=(0, 1)), total])
