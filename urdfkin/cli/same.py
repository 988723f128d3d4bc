"""`urdfkin same`: compare two robot models."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from urdfkin.cli.arguments import forms, load_two, xacro_option
from urdfkin.cli.completion_items import complete_robot
from urdfkin.cli.options import NumberFrom, Whole
from urdfkin.cli.output import compiling, console, write_file
from urdfkin.cli.report_options import check_writable
from urdfkin.cli.streams import say, say_file
from urdfkin.errors.escape import json_text

if TYPE_CHECKING:
    from urdfkin.comparison.result import Question, Sameness
    from urdfkin.robot import Robot

EXAMPLE = "urdfkin same ur5 ur5_limited --certificate same.json"
_PATH = click.Path(path_type=Path, dir_okay=False)


@click.command(epilog=f"Example: {EXAMPLE}")
@click.argument("a", metavar="A", required=False, shell_complete=complete_robot)
@click.argument("b", metavar="B", required=False, shell_complete=complete_robot)
@click.option(
    "--map",
    "pairs",
    multiple=True,
    metavar="JOINT_OF_A=JOINT_OF_B",
    help="Match two joints; may be repeated.",
)
@click.option(
    "--strict",
    is_flag=True,
    help="Also exit 1 if the models are only equivalent, or if limits differ.",
)
@click.option(
    "--within",
    type=NumberFrom(0.0),
    help="Exit 0 only if all frames provably stay within this distance (m and rad) as written.",
)
@click.option(
    "--boxes",
    type=Whole(0),
    help="Number of boxes for bounds (default 131072). More: sharper but slower; 0: none.",
)
@click.option("--all", "all_", is_flag=True, help="Show every line.")
@forms("table", "json")
@click.option("--certificate", type=_PATH, help="Write the result as JSON that --recheck verifies.")
@click.option("--recheck", type=_PATH, help="Verify a certificate for both models, without a search.")
@click.option("--markdown", type=_PATH, help="Write Markdown for a pull request's comment.")
@click.option(
    "--html", type=_PATH, help="Write an HTML page with a picture of both at the worst configuration."
)
@click.option("--schema", is_flag=True, help="Print the JSON Schema of a certificate instead.")
@xacro_option
@click.pass_context
def command(
    context: click.Context,
    /,
    a: str | None,
    b: str | None,
    pairs: tuple[str, ...],
    strict: bool,
    within: float | None,
    boxes: int | None,
    all_: bool,
    format_: str,
    recheck: Path | None,
    schema: bool,
    **paths: Path | None,
) -> None:
    """Prove whether A and B are the same robot in every configuration.

    A and B are robots as in other commands, or Denavit-Hartenberg tables. They are the same if the screws of
    all joints and the zero-configuration poses of all links agree. A different base pose, joint zeros and
    senses, fixed links, names and order are allowed. If they differ, the command prints an interval for the
    largest distance of each frame over all configurations within limits. Its lower bound is attained at a
    printed configuration; its upper bound is proven.

    Exit 0: same, or equivalent up to the printed changes. 1: different; with --strict also if only
    equivalent. With --within: 0 if all frames stay within the distance as written, else 1. 2: bad input.
    """
    if schema:
        from urdfkin.comparison.certificate import SAME  # noqa: PLC0415  keeps --help fast

        click.echo(SAME.schema_text(), nl=False)
        return
    if a is None or b is None:
        raise click.UsageError("two models are needed: urdfkin same A B")
    check_writable(*paths.values())
    robots = load_two(a, b)
    with compiling():
        if recheck is not None:
            from urdfkin.comparison.certificate import SAME, words_of  # noqa: PLC0415
            from urdfkin.comparison.certificate import recheck as errors_of  # noqa: PLC0415

            document = SAME.read(recheck)
            errors = errors_of(document, *robots)
            for line in errors:
                say(line, err=True)
            first = [f"; first difference: {words_of(one)}" for one in document["differences"][:1]]
            holds = f"the certificate holds: {document['verdict']}{''.join(first)}"
            say("the certificate does not hold" if errors else holds)
            context.exit(1 if errors or document["verdict"] == "differs" else 0)
        from urdfkin.comparison.bounds import MOST  # noqa: PLC0415
        from urdfkin.comparison.result import Question  # noqa: PLC0415
        from urdfkin.comparison.verdict import parse_map, same  # noqa: PLC0415

        how_many = MOST if boxes is None else boxes
        found = same(*robots, map=parse_map(pairs), boxes=how_many, within=within)
    question = Question(within, strict)
    words = [word for pair in pairs for word in ("--map", pair)]
    words += ["--boxes", str(boxes)] if boxes is not None else []
    _write(found, robots, question, format_, paths, words, all_=all_)
    context.exit(int(not found.holds(question)))


def _write(
    found: Sameness,
    robots: tuple[Robot, Robot],
    question: Question,
    format_: str,
    paths: dict[str, Path | None],
    words: list[str],
    *,
    all_: bool,
) -> None:
    """Write the result in every requested form; `words` are the command's other options."""
    from urdfkin.comparison.certificate import certificate  # noqa: PLC0415
    from urdfkin.report.same import command_of, markdown_of, print_sameness  # noqa: PLC0415

    data = json_text(certificate(found, command_of(robots, question, words))) + "\n"
    if (path := paths["certificate"]) is not None:
        write_file(path, data.encode())
    if (path := paths["markdown"]) is not None:
        write_file(path, markdown_of(found, question).encode())
    if (path := paths["html"]) is not None:
        from urdfkin.report.same import as_html  # noqa: PLC0415

        write_file(path, as_html(found, robots, question, words).encode())
    if format_ == "json":
        say_file(data)
    else:
        print_sameness(found, console(), question, all_=all_)
