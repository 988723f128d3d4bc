"""`urdfkin same` and `urdfkin diff`: compare two robot models."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING

import click

from urdfkin.cli.completion import complete_robot
from urdfkin.cli.options import (
    NumberFrom,
    Whole,
    load_several,
    reject_unused_options,
    schema_option,
    source_options,
)
from urdfkin.cli.output import TEXTS, Answer, answering, check_writable, compiling, write_file
from urdfkin.cli.streams import say
from urdfkin.errors.display import TextDocument
from urdfkin.errors.escape import csv_value, json_text

if TYPE_CHECKING:
    from urdfkin.comparison.result import SameQuestion
    from urdfkin.robot import Robot

_PATH = click.Path(path_type=Path, dir_okay=False)
#: These options of `urdfkin same` need exactly two robots.
_OF_TWO = ("pairs", "certificate", "write_map", "recheck", "markdown", "html", "all_")


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
    help="Also exit 1 if the models are equivalent but not the same, or if their joint limits differ.",
)
@click.option(
    "--within",
    type=NumberFrom(0.0),
    help="Exit 0 only if urdfkin proves that no frame of B is farther than this (m and rad) from the same"
    " frame of A.",
)
@click.option(
    "--boxes",
    type=Whole(0),
    help="Largest number of boxes of joint space in memory for bounds (default 131072; 0: no bounds).",
)
@click.option("--all", "all_", is_flag=True, help="Show all differences and frames, not only the first ones.")
@click.option(
    "--certificate", type=_PATH, help="Write the result as a JSON certificate, which --recheck verifies."
)
@click.option(
    "--write-map",
    type=_PATH,
    help="Write the names, order, signs and zero positions of the joints of B as TOML, for --convention.",
)
@click.option(
    "--recheck", type=_PATH, help="Verify this certificate for A and B instead of comparing them again."
)
@click.option("--markdown", type=_PATH, help="Write the result as Markdown for a pull request comment.")
@click.option(
    "--html", type=_PATH, help="Write an HTML page with a picture of both robots at the worst configuration."
)
@schema_option("urdfkin.comparison.certificate:SAME", "a certificate")
@source_options
@answering(*TEXTS, "json")
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
    """Prove whether A and B are the same robot in every configuration; with C, compare each pair.

    A and B are robots as in other commands, or Denavit-Hartenberg tables. A and B are the same robot if the
    screws of all joints and the zero-configuration poses of all links agree. Fixed links, names and the order
    of joints may differ. A and B are equivalent if they agree after a change of B. Examples of such changes
    are another base pose, or another zero position of a joint. If A and B differ, the command prints two
    bounds on the largest distance of each frame of B from the same frame of A. The distance reaches the lower
    bound in a configuration that the command prints. It is proven that no configuration within the joint
    limits exceeds the upper bound. The numbers of a USD file have single precision. Two models are the same
    up to single precision if every joint differs only by the rounding of its own numbers.

    Exit 0: same, same up to single precision, or equivalent up to the printed changes. 1: different; with
    --strict, also if the models are equivalent but not the same. 2: bad input. With --within, A and B are
    compared as written. Exit 0: all frames stay within the given distance. 1: a frame does not.
    """
    from urdfkin.comparison.bounds import MOST_BOXES
    from urdfkin.comparison.certificate import certificate
    from urdfkin.comparison.result import SameQuestion
    from urdfkin.comparison.verdict import parse_map, same
    from urdfkin.model.conventions import as_toml
    from urdfkin.report.same import as_html, command_of, document, markdown_of

    if a is None or b is None:
        raise click.UsageError("name two robots to compare: urdfkin same A B")
    check_writable(*paths.values())
    if more:
        reject_unused_options(click.get_current_context(), _OF_TWO, "with more than two robots")
        return _all_pairs((a, b, *more), SameQuestion(within, strict), MOST_BOXES if boxes is None else boxes)
    first, second = load_several(a, b)
    robots = first, second
    with compiling():
        if recheck is not None:
            return _recheck(robots, recheck)
        how_many = MOST_BOXES if boxes is None else boxes
        found = same(*robots, map=parse_map(pairs), boxes=how_many, within=within)
    question = SameQuestion(within, strict)
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

    robots = load_several(*sources)
    with compiling():
        twos = list(combinations(robots, 2))
        found = [same(*two, boxes=boxes, within=question.within) for two in twos]
    data = {
        "json": lambda: {
            "holds": all(one.holds(question) for one in found),
            "pairs": [
                certificate(one, command_of(two, question, [])) for one, two in zip(found, twos, strict=True)
            ],
        },
        "markdown": lambda: pairs_markdown(found, question),
    }
    code = int(not all(one.holds(question) for one in found))
    return Answer(lambda: pairs_document(found, question), data, code=code)


def _recheck(robots: tuple[Robot, Robot], path: Path) -> Answer:
    from urdfkin.comparison.certificate import SAME, recheck, words_of

    certificate = SAME.read(path)
    errors = recheck(certificate, *robots)
    for line in errors:
        say(line, err=True)
    first = [f"; first difference: {words_of(one)}" for one in certificate["differences"][:1]]
    holds = f"the certificate holds: {certificate['verdict']}{''.join(first)}"
    words = "the certificate does not hold" if errors else holds
    return Answer(
        lambda: TextDocument("", [words]), code=int(bool(errors) or certificate["verdict"] == "differs")
    )


@click.command("diff", epilog="Example: urdfkin diff arm.urdf my.urdf --markdown comment.md")
@click.argument("a", metavar="OLD", shell_complete=complete_robot)
@click.argument("b", metavar="NEW", shell_complete=complete_robot)
@click.argument("more", metavar="[C]...", nargs=-1, shell_complete=complete_robot)
@click.option(
    "--effects/--no-effects", default=True, help="Compute how far each change can move the frames (default)."
)
@click.option("--markdown", type=_PATH, help="Write the result as Markdown for a pull request comment.")
@source_options
@answering()
def diff_command(a: str, b: str, more: tuple[str, ...], effects: bool, markdown: Path | None) -> Answer:
    """List the changes from OLD to NEW, attribute by attribute, and how far they move the robot's frames.

    For each changed joint, the command prints how far the changes of this joint move the frame that moves
    most. This distance is the maximum over all configurations within limits, for equal joint coordinates of
    OLD and NEW. The last line of the output states how far all changes together move the frames. Between
    URDF, MJCF and USD, the changes are the differences that `same` finds. With C, all pairs are compared.

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
    robots = load_several(a, b, *more)
    with compiling():
        found = [diff(*two, effects=effects) for two in combinations(robots, 2)]

    def as_markdown() -> str:
        return pairs_markdown(found) if more else markdown_of(found[0])

    if markdown is not None:
        write_file(markdown, as_markdown().encode())
    heads = ("A", "B", *HEADS) if more else HEADS
    rows = [(*one.sources, *row) if more else row for one in found for row in rows_of(one)]
    data = {
        "json": lambda: {"pairs": [as_data(one) for one in found]} if more else as_data(found[0]),
        "csv": lambda: [heads, *(map(csv_value, row) for row in rows)],
        "markdown": as_markdown,
    }
    code = int(any(found))
    if more:
        return Answer(lambda: pairs_document(found), data, code=code)
    lines = TextDocument("", lines_of(found[0]))
    return Answer(lambda: document(found[0]), data, code=code, fitted=lambda _: lines)
