"""`urdfkin same`, `diff`: compare robot models. `readers`: compare how libraries read a file."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from urdfkin.cli.options import (
    FILE,
    NumberInRange,
    WholeNumber,
    load_robot,
    load_robots,
    markdown_option,
    reject_unused_options,
    robot_argument,
    samples_option,
    schema_option,
    seed_option,
    source_options,
)
from urdfkin.cli.output import TEXT_FORMATS, Answer, answer_command, check_writable, report_compilation
from urdfkin.cli.shell import complete_robot
from urdfkin.cli.streams import say
from urdfkin.errors import InputError
from urdfkin.errors.display import Table, TextDocument
from urdfkin.errors.escape import csv_number_or_text, json_text
from urdfkin.system.files import may_exist, write_file

if TYPE_CHECKING:
    from urdfkin.comparison.readers import LibraryReading
    from urdfkin.comparison.result import SameQuestion
    from urdfkin.robot import Robot

#: Options of `urdfkin same` that need exactly two robots.
_TWO_ROBOT_OPTIONS = ("pairs", "certificate", "write_map", "recheck", "markdown", "html", "all_")
#: The option `--recheck`, and all options that cannot be combined with it.
_COMPARING_OPTIONS = (*_TWO_ROBOT_OPTIONS, "strict", "within", "boxes")
#: A text that looks like a git revision, such as HEAD~1, main^ or HEAD:arm.urdf. `urdfkin diff` rejects such
#: a text, unless a file has this name.
_GIT_VERSION = re.compile(r"HEAD|[\w./-]+[~^]\d*|[\w./~^-]+:[\w./-]+\.\w+")


@click.command("same", epilog="Example: urdfkin same ur5 ur5_limited --certificate same.json")
@click.argument("a", metavar="A", required=False, shell_complete=complete_robot)
@click.argument("b", metavar="B", required=False, shell_complete=complete_robot)
@click.argument("more", metavar="[C]...", nargs=-1, shell_complete=complete_robot)
@click.option(
    "--map",
    "pairs",
    multiple=True,
    metavar="JOINT_OF_A=JOINT_OF_B",
    help="Match a joint of A with a joint of B; repeatable.",
)
@click.option(
    "--strict",
    is_flag=True,
    help="Exit with 1 if the models are equivalent only after changes of B. Also exit with 1 if the command"
    " lists any other difference, for example of limits, joint types or links.",
)
@click.option(
    "--within",
    type=NumberInRange(0.0),
    help="Largest allowed distance (m) and angle (rad) between a frame of A and the same frame of B. The exit"
    " code is 0 only if urdfkin proves that no distance or angle exceeds this number.",
)
@click.option(
    "--boxes",
    type=WholeNumber(0),
    help="Maximum number of boxes (parts of the joint space) in memory. More boxes give sharper upper"
    " bounds. 0: the joint space is not divided into boxes.",
    show_default="131072",
)
@click.option("--all", "all_", is_flag=True, help="Show all differences and frames, not only the first ones.")
@click.option(
    "--certificate",
    type=FILE,
    help="Also write a JSON certificate to this file. The option --recheck verifies a certificate.",
)
@click.option(
    "--write-map",
    type=FILE,
    help="Also write the names, order, signs and zeros of B's joints to this TOML file. The option"
    " --convention of other commands reads the file.",
)
@click.option(
    "--recheck", type=FILE, help="Verify this certificate for A and B instead of comparing them again."
)
@markdown_option
@click.option(
    "--html",
    type=FILE,
    help="Also write an HTML page to this file. The page shows A and B at the worst configuration.",
)
@schema_option("urdfkin.comparison.certificate:SAME", "a certificate")
@source_options
@answer_command(*TEXT_FORMATS, "json")
def same_command(
    a: str | None,
    b: str | None,
    more: tuple[str, ...],
    pairs: tuple[str, ...],
    strict: bool,
    within: float | None,
    boxes: int | None,
    all_: bool,
    recheck: Path | None,
    **paths: Path | None,
) -> Answer:
    """Prove whether A and B are the same robot in every configuration.

    If you name more than two robots, the command compares each pair. A and B are paths, names that `urdfkin
    robots` lists, or Denavit-Hartenberg tables.

    A and B are the same robot if the screws of all joints and the zero-configuration poses of all links
    agree. Fixed links, names and the order of joints may differ. Masses and shapes are not compared;
    `urdfkin diff` lists their changes. A and B are equivalent if some changes of B make B the same robot as
    A. For example, B may need another base pose, or another zero position of a joint.

    If A and B differ, the command compares each frame of B with the same frame of A. For the largest distance
    between the two frames, the command prints a lower and an upper bound. The command also prints a
    configuration in which the distance is at least the lower bound. The upper bound is proven for all
    configurations within the joint limits.

    The numbers of a USD file are rounded to single precision. If these rounding errors explain the difference
    of every joint, A and B are the same up to single precision.

    Exit 0: the models are the same, the same up to single precision, or equivalent after the printed changes.
    1: the models are different. 2: bad input.

    With --strict, the exit code is also 1 for models that are equivalent only after changes of B. The exit
    code is also 1 for differences that have no effect on motion. Examples are other limits, the type revolute
    instead of continuous, or an additional fixed link.

    With --within, the command does not change B before the comparison. Exit 0: every frame is proven to be
    within the given distance. 1: the proof fails for at least one frame.
    """
    from urdfkin.comparison.bounds import MAX_BOXES
    from urdfkin.comparison.certificate import certificate
    from urdfkin.comparison.result import SameQuestion
    from urdfkin.comparison.verdict import parse_joint_pairs, same
    from urdfkin.model.conventions import as_toml
    from urdfkin.report.same import as_html, command_of, document, markdown_of

    if a is None or b is None:
        raise click.UsageError("name two robots to compare: urdfkin same A B")
    context = click.get_current_context()
    if recheck is not None:
        unused = [name for name in _COMPARING_OPTIONS if name != "recheck"]
        reject_unused_options(context, unused, "with --recheck")
    check_writable(*paths.values())
    question, most_boxes = SameQuestion(within, strict), MAX_BOXES if boxes is None else boxes
    if more:
        reject_unused_options(context, _TWO_ROBOT_OPTIONS, "with more than two robots")
        return _all_pairs((a, b, *more), question, most_boxes)
    first, second = load_robots(a, b)
    robots = first, second
    with report_compilation():
        if recheck is not None:
            return _recheck_certificate(robots, recheck)
        found = same(*robots, map=parse_joint_pairs(pairs), boxes=most_boxes, within=within)
    words = [word for pair in pairs for word in ("--map", pair)]
    words += ["--boxes", str(boxes)] if boxes is not None else []
    forms: dict[str, Callable[[], str]] = {
        "certificate": lambda: json_text(certificate(found, command_of(robots, question, words))) + "\n",
        "markdown": lambda: markdown_of(found, question),
        "html": lambda: as_html(found, robots, question, words),
        "write_map": lambda: as_toml(found.convention()),
    }
    for name, form in forms.items():
        if (path := paths[name]) is not None:
            write_file(path, form().encode())
    data = {"json": forms["certificate"], "markdown": forms["markdown"], "html": forms["html"]}
    code = int(not found.holds(question))
    return Answer(lambda: document(found, question, all_=all_), data, code=code)


def _all_pairs(sources: tuple[str, ...], question: SameQuestion, boxes: int) -> Answer:
    from urdfkin.comparison.certificate import certificate
    from urdfkin.comparison.verdict import same
    from urdfkin.report.same import command_of, pairs_document, pairs_markdown

    robots = load_robots(*sources)
    pairs = list(combinations(robots, 2))
    with report_compilation():
        found = [same(*pair, boxes=boxes, within=question.within) for pair in pairs]
    holds = all(result.holds(question) for result in found)

    def as_json() -> dict[str, Any]:
        certificates = [
            certificate(result, command_of(pair, question, []))
            for result, pair in zip(found, pairs, strict=True)
        ]
        return {"holds": holds, "pairs": certificates}

    data = {"json": as_json, "markdown": lambda: pairs_markdown(found, question)}
    return Answer(lambda: pairs_document(found, question), data, code=int(not holds))


def _recheck_certificate(robots: tuple[Robot, Robot], path: Path) -> Answer:
    from urdfkin.comparison.certificate import SAME, difference_text, recheck

    certificate = SAME.read(path)
    errors = recheck(certificate, *robots)
    for line in errors:
        say(line, err=True)
    first = [
        f"; first difference: {difference_text(difference)}" for difference in certificate["differences"][:1]
    ]
    holds = f"the certificate holds: {certificate['verdict']}{''.join(first)}"
    words = "the certificate does not hold" if errors else holds
    code = int(bool(errors) or certificate["verdict"] == "differs")
    data = {"holds": not errors, "verdict": certificate["verdict"], "errors": errors}
    return Answer(lambda: TextDocument("", [words]), {"json": lambda: data}, code=code)


@click.command("diff", epilog="Example: urdfkin diff arm.urdf my.urdf --markdown comment.md")
@click.argument("a", metavar="OLD", shell_complete=complete_robot)
@click.argument("b", metavar="NEW", shell_complete=complete_robot)
@click.argument("more", metavar="[C]...", nargs=-1, shell_complete=complete_robot)
@click.option("--effects/--no-effects", default=True, help="Compute how far each change can move the frames.")
@markdown_option
@source_options
@answer_command()
def diff_command(a: str, b: str, more: tuple[str, ...], effects: bool, markdown: Path | None) -> Answer:
    """List the changes of each attribute from OLD to NEW, and how far the changes move the robot's frames.

    For each changed joint, the command prints the frame that the joint's changes displace most. The printed
    displacement is the largest in all configurations within the joint limits. If the changes only rotate
    frames, the command prints the largest rotation. OLD and NEW are compared at equal joint coordinates. The
    last line of the output is the largest displacement by all changes together.

    If OLD and NEW have different formats (URDF, MJCF or USD), the command prints the differences that
    `urdfkin same` finds. If you name more than two robots, the command compares each pair.

    Exit 0: no changes. 1: changes. 2: bad input.
    """
    from urdfkin.comparison.diff import diff
    from urdfkin.report.diff import (
        HEADS,
        as_data,
        document,
        lines_of,
        markdown_of,
        pairs_document,
        pairs_markdown,
        rows_of,
    )

    check_writable(markdown)
    for source in (a, b, *more):
        if _GIT_VERSION.fullmatch(source) and not may_exist(Path(source)):
            remedy = "write `git show VERSION:FILE | urdfkin diff - FILE`"
            raise InputError("this is a version in git, not a file", found=source, remedy=remedy)
    robots = load_robots(a, b, *more)
    with report_compilation():
        found = [diff(*pair, effects=effects) for pair in combinations(robots, 2)]

    def as_markdown() -> str:
        return pairs_markdown(found) if more else markdown_of(found[0])

    if markdown is not None:
        write_file(markdown, as_markdown().encode())
    heads = ("A", "B", *HEADS) if more else HEADS
    rows = [(*result.sources, *row) if more else row for result in found for row in rows_of(result)]
    data = {
        "json": lambda: {"pairs": list(map(as_data, found))} if more else as_data(found[0]),
        "csv": lambda: [heads, *(map(csv_number_or_text, row) for row in rows)],
        "markdown": as_markdown,
    }
    code = int(any(found))
    if more:
        return Answer(lambda: pairs_document(found), data, code=code)
    lines = TextDocument("", lines_of(found[0]))
    return Answer(lambda: document(found[0]), data, code=code, fit_document=lambda _: lines)


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
@answer_command()
def readers_command(robot: str, libraries: str | None, samples: int, seed: int) -> Answer:
    """Compare how other libraries read ROBOT: the joints, the joint order, and the poses of all links.

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

    def csv_rows() -> Iterator[list[object]]:
        yield ["library", "version", "joint", "element", "difference", "size"]
        for reading in found:
            if reading.refused is not None:
                yield [reading.library, reading.version, "", "", csv_number_or_text(reading.refused), ""]
            for difference in reading.differences:
                words = map(csv_number_or_text, (difference.joint, difference.element, difference.words))
                yield [reading.library, reading.version, *words, repr(difference.size)]

    data = {"robot": loaded.name, "readers": [reading.as_dict() for reading in found]}
    code = int(not all(reading.agrees for reading in found))
    return Answer(
        lambda: _readings_document(loaded.name, found), {"json": lambda: data, "csv": csv_rows}, code=code
    )


def _readings_document(name: str, found: tuple[LibraryReading, ...]) -> TextDocument:
    rows = [(f"{reading.library} {reading.version}", *_reading_cells(reading)) for reading in found]
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


def _reading_cells(reading: LibraryReading) -> tuple[str, str]:
    if reading.refused is not None:
        return "refused", "-"
    poses = "the same" if reading.agrees else f"off by {reading.worst:.2g}"
    return poses, f"{len(reading.joints)}, in {'the same' if reading.same_order else 'another'} order"
