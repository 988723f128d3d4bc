"""`urdfkin export`: write a frame's kinematics as code, with test vectors."""

from __future__ import annotations

from pathlib import Path

import click

from urdfkin.cli.completion import complete_robot
from urdfkin.cli.options import (
    FILE,
    frame_option,
    load_robot,
    reference_option,
    reject_unused_options,
    robot_options,
    verify_option,
)
from urdfkin.cli.output import check_line, exit_code, output_option, write_output
from urdfkin.cli.streams import say
from urdfkin.errors import InputError
from urdfkin.export import FORMS, LANGUAGES, QUANTITIES


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
    show_default=",".join(QUANTITIES),
)
@reference_option
@click.option("--to", type=click.Choice(tuple(LANGUAGES)), default="c", help="Language of the code.")
@click.option(
    "--form",
    type=click.Choice(tuple(FORMS)),
    default="tree",
    help="Robot description from which the code is made: the joints of the URDF (tree), a Denavit-Hartenberg"
    " table (dh), or screws.",
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
def command(
    context: click.Context,
    /,
    robot: str | None,
    frame: str | None,
    quantities: tuple[str, ...],
    reference: str,
    to: str,
    form: str,
    name: str | None,
    file: Path | None,
    verify: bool,
    output: Path | None,
) -> None:
    """Write a frame's kinematics as code without loops, for one robot, with test vectors in the file.

    The robot's constants are part of the code, and each joint's sine and cosine are computed once. The
    expressions are compared with Pinocchio before they are written; the file states how closely they agree.
    The file also contains test vectors with true values at fifty digits. --check compiles or imports a file
    and runs its test vectors. You can also run the test vectors without urdfkin. ROBOT is a path, a name that
    `urdfkin robots` lists, or - for standard input.

    Exit 0: verified. 1: Pinocchio or a test vector disagrees. 2: bad input, or the file does not run here.
    3: not verified, or changed after it was written.
    """
    if (robot is None) == (file is None):
        raise InputError("give either a ROBOT to export, or --check FILE")
    if file is not None:
        reject_unused_options(
            context, [p.name or "" for p in context.command.params if p.name != "file"], "with --check"
        )
        context.exit(_check(file))
    from urdfkin.export import code_in, write
    from urdfkin.export.forms import code_of_robot

    assert robot is not None
    loaded = load_robot(robot, verify=verify)
    names = [word.strip() for words in quantities for word in words.split(",")] or list(QUANTITIES)
    frame = frame or loaded.tip_frame
    code = code_in(code_of_robot(loaded, frame, names, reference, form, name=name, verify=verify), to)
    write_output(write(code, to), output)
    proof = code.proof
    say(check_line(proof.certificate), err=True)
    if proof.constants and proof.certificate.verified:
        say(f"The expressions were evaluated {proof.evaluated}. {proof.constants}", err=True)
    context.exit(exit_code(proof.certificate))


def _check(file: Path) -> int:
    from urdfkin.export.check import check

    found = check(file)
    for line in found.lines:
        say(line)
    if not found.good:
        return 1
    for reason in found.doubts:
        say(f"UNVERIFIED: {reason}", err=True)
    return 0 if found.verified else 3
