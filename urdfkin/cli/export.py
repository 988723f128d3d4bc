"""Write files for other programs.

`urdfkin export` writes a frame's kinematics as code, with test vectors. `urdfkin vectors` writes test vectors
alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from urdfkin.cli.options import (
    FILE,
    FILE_OR_FOLDER,
    format_from_suffix,
    frame_option,
    load_robot,
    reference_option,
    reject_unused_options,
    robot_options,
    samples_option,
    schema_option,
    verify_option,
)
from urdfkin.cli.output import (
    Answer,
    answer_command,
    certificate_exit_code,
    check_writable,
    format_check_line,
    output_option,
    write_output,
)
from urdfkin.cli.shell import complete_robot
from urdfkin.cli.streams import say
from urdfkin.errors import InputError, SourceError
from urdfkin.errors.display import Table, TextDocument, format_count
from urdfkin.errors.escape import csv_number_or_text
from urdfkin.export import DEFAULT_QUANTITIES, FORMS, LANGUAGES

if TYPE_CHECKING:
    from urdfkin.validation.vectors import VectorFiles

#: The languages that a file with each suffix can contain. Without `--to`, the first of these languages is
#: chosen.
_LANGUAGES_OF_SUFFIXES = {
    **dict.fromkeys((".c", ".h"), ("c",)),
    **dict.fromkeys((".hpp", ".hh", ".hxx", ".cpp", ".cc", ".cxx"), ("cpp",)),
    **dict.fromkeys((".cuh", ".cu"), ("cuda",)),
    ".py": tuple(language for language, (_, suffix) in LANGUAGES.items() if suffix.endswith(".py")),
    ".m": ("matlab",),
    ".tex": ("latex",),
}
#: Common names of languages and libraries. If the user gives such a name, the error message suggests the name
#: that `--to` accepts.
_LANGUAGE_SYNONYMS = {
    "c++": "cpp", "python": "numpy", "pytorch": "torch", "octave": "matlab", "tex": "latex", "cu": "cuda",
}  # fmt: skip


class _Language(click.Choice):  # type: ignore[type-arg]  # generic only since click 8.2
    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if (name := _LANGUAGE_SYNONYMS.get(str(value).lower())) is not None:
            self.fail(f"{value!r} is not the name of a language; did you mean {name}?", param, ctx)
        return super().convert(value, param, ctx)


@click.command(epilog="Example: urdfkin export panda --frame panda_hand --to c -o panda_hand.c")
@click.argument("robot", metavar="[ROBOT]", required=False, shell_complete=complete_robot)
@robot_options
@frame_option
@click.option(
    "--quantity",
    "quantities",
    multiple=True,
    metavar="NAMES",
    help="Quantities to export, separated by commas; repeatable: placement, velocity, jacobian,"
    " jacobian_rate, hessian, acceleration.",
    show_default=",".join(DEFAULT_QUANTITIES),
)
@reference_option
@click.option(
    "--to",
    type=_Language(tuple(LANGUAGES)),
    help="Language of the code.",
    show_default="from the suffix of --output, such as numpy for .py; otherwise c",
)
@click.option(
    "--form",
    type=click.Choice(tuple(FORMS)),
    default="tree",
    help="Source of the code. tree: the joints of the URDF. dh: a Denavit-Hartenberg table. screws: the"
    " joints' screws.",
)
@click.option(
    "--name",
    metavar="WORD",
    help="Prefix of the function names.",
    show_default="the names of the robot and of the frame",
)
@click.option("--check", "file", type=FILE, help="Run the test vectors of this exported file.")
@verify_option
@output_option("Write the code to this file.")
@click.pass_context
def export_command(
    context: click.Context,
    /,
    robot: str | None,
    frame: str | None,
    quantities: tuple[str, ...],
    reference: str,
    to: str | None,
    form: str,
    name: str | None,
    file: Path | None,
    verify: bool,
    output: Path | None,
) -> None:
    """Write a frame's kinematics as code without loops, with test vectors.

    The code contains the robot's constants, and each joint's sine and cosine are computed once. Before the
    command writes the file, Pinocchio checks the expressions. The file states the largest disagreement of
    each quantity.

    The file also contains test vectors with true values at fifty digits. The option --check compiles or
    imports a file and runs its test vectors. You can also run the test vectors without urdfkin.

    ROBOT is a path, a name that `urdfkin robots` lists, or - for standard input.

    Exit 0: verified. 1: Pinocchio or a test vector disagrees. 2: bad input, or the file does not run here.
    3: not verified, or changed after it was written.
    """
    if (robot is None) == (file is None):
        raise InputError("give either a ROBOT to export, or --check FILE")
    if file is not None:
        reject_unused_options(
            context, [p.name or "" for p in context.command.params if p.name != "file"], "with --check"
        )
        context.exit(_check_exported_file(file))
    from urdfkin.export import code_for_language, write
    from urdfkin.export.forms import make_robot_code

    assert robot is not None
    to = format_from_suffix(context, output, _LANGUAGES_OF_SUFFIXES, "c", "to")
    check_writable(output)
    loaded = load_robot(robot, verify=verify)
    names = [word.strip() for words in quantities for word in words.split(",")] or list(DEFAULT_QUANTITIES)
    frame = loaded.tip_frame if frame is None else frame
    code = code_for_language(
        make_robot_code(loaded, frame, names, reference, form, name=name, verify=verify), to
    )
    write_output(write(code, to, None if output is None else output.name), output)
    proof = code.proof
    say(format_check_line(proof.certificate), err=True)
    if proof.constants_text and proof.certificate.verified:
        say(f"The expressions were evaluated {proof.precision_text}. {proof.constants_text}", err=True)
    context.exit(certificate_exit_code(proof.certificate))


def _check_exported_file(file: Path) -> int:
    from urdfkin.export.check import check

    found = check(file)
    for line in found.lines:
        say(line)
    if not found.passed:
        return 1
    for reason in found.warnings:
        say(f"UNVERIFIED: {reason}", err=True)
    return 0 if found.verified else 3


_EXAMPLE = "urdfkin vectors write vectors ur5 panda"


@click.group("vectors", no_args_is_help=False, epilog=f"Example: {_EXAMPLE}")
def vectors_command() -> None:
    """Write test vectors for other programs.

    A library in any language can compare its results with these test vectors. The page docs/vectors.md
    explains the comparison.
    """


@vectors_command.command(
    "write", short_help="Write test vectors into a folder.", epilog=f"Example: {_EXAMPLE}"
)
@click.argument("folder", metavar="DIR", type=FILE_OR_FOLDER, required=False)
@click.argument("robots", metavar="[ROBOT]...", nargs=-1, shell_complete=complete_robot)
@click.option(
    "--catalogue/--no-catalogue",
    default=True,
    help="Without ROBOT: also write test vectors of the catalogue. These test vectors refer to files of"
    " example-robot-data.",
)
@samples_option(
    3,
    "Number of configurations of each robot. In the first configuration, joints are at 0, or at the nearest"
    " limit.",
    minimum=1,
    maximum=1000,
)
@schema_option("urdfkin.validation.vectors:VECTORS", "the files")
@answer_command()
def write_vectors(folder: Path | None, robots: tuple[str, ...], catalogue: bool, samples: int) -> Answer:
    """Write test vectors into the folder DIR: inputs and results, with a tolerance for every result.

    The results are computed at 50 digits, and written with 17 digits.

    If you name robots, the command writes only the test vectors of these robots. If you name no robot, the
    command writes test vectors of the catalogue and of some 70 small robots. Each small robot tests one
    feature of URDF. Each robot has a JSON file, and a text file with the same numbers, separated by tabs. The
    file SHA256SUMS has the digests of all files.

    The results are the placement, velocity, Jacobian, Jacobian rate, Hessian, classical acceleration and
    spatial acceleration. The files contain the placement once, and each other quantity in the reference
    frames LOCAL, WORLD and LOCAL_WORLD_ALIGNED. The files depend only on the robots and on --samples.
    """
    from urdfkin.validation import vectors

    if folder is None:
        raise click.UsageError("name the folder for the files: urdfkin vectors write DIR")
    if robots:
        reject_unused_options(click.get_current_context(), ("catalogue",), "with a ROBOT")
    loaded = [load_robot(robot, verify=False) for robot in robots]
    names = [vectors.name_of(robot) for robot in loaded]
    if len({vectors.file_stem(name).casefold() for name in names}) < len(names):
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

    def csv_rows() -> Iterator[tuple[object, ...]]:
        yield "robot", "file", "numbers"
        for one in written:
            yield csv_number_or_text(one.robot), csv_number_or_text(one.files[0].name), one.numbers

    data = {
        "folder": str(folder),
        "robots": [
            {"robot": one.robot, "files": [path.name for path in one.files], "numbers": one.numbers}
            for one in written
        ],
    }
    return Answer(lambda: _document(folder, written), {"json": lambda: data, "csv": csv_rows})


def _document(folder: Path, written: Sequence[VectorFiles]) -> TextDocument:
    rows = [(one.robot, one.files[0].name, f"{one.numbers:,}") for one in written]
    robots = format_count(len(written), "robot")
    total = f"{sum(one.numbers for one in written):,} numbers of {robots} in {folder}"
    return TextDocument("", [Table(("robot", "file", "numbers"), rows, left=2, names=(0, 1)), total])
