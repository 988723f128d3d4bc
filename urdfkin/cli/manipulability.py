"""`urdfkin singular-values`: singular values, condition number and manipulability, with guaranteed bounds."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from urdfkin.cli.arguments import (
    Inputs,
    forms,
    frame_option,
    load_robot,
    q_option,
    read_inputs,
    robot_argument,
    seed_option,
    verify_option,
)
from urdfkin.cli.options import format_from_suffix
from urdfkin.cli.output import check_line, compiling, console, exit_code, hand_out, output_option
from urdfkin.cli.streams import say
from urdfkin.errors.escape import csv_cell, csv_text, json_text
from urdfkin.report.listing import print_named

if TYPE_CHECKING:
    from rich.console import Console

    from urdfkin.model.tree import FloatArray
    from urdfkin.verify.singular_values import SingularValues

_ENDINGS = {".json": ("json",), ".csv": ("csv",)}
#: Number of samples of a batch that a table shows.
_SHOWN = 5


@click.command(epilog="Example: urdfkin singular-values panda --q random --frame panda_hand --rows linear")
@robot_argument
@frame_option
@click.option(
    "--rows",
    type=click.Choice(["all", "linear", "angular"]),
    default="all",
    show_default=True,
    help="Rows of the Jacobian; 'all' mixes metres and radians.",
)
@q_option
@seed_option
@verify_option
@forms("table", "json", "csv")
@output_option
@click.pass_context
def command(
    context: click.Context,
    robot: str,
    frame: str | None,
    rows: str,
    q: str,
    seed: int,
    verify: bool,
    format_: str,
    output: Path | None,
) -> None:
    """Compute the singular values, condition number and manipulability of a frame's Jacobian.

    Each value has a guaranteed lower and upper bound. The bounds include the error of the Jacobian and the
    rounding of the decomposition. Manipulability is Yoshikawa's sqrt(det J J^T), the product of the singular
    values. Its derivative for each joint velocity comes from the Hessian.

    At a singularity the command prints the rank, the lost directions and the joints that cause them. There
    the manipulability may have no derivative; it is nan in CSV and null in JSON. See `urdfkin explain
    singularity`.
    """
    format_ = format_from_suffix(context, output, _ENDINGS, "csv")
    loaded = load_robot(robot, verify=verify)
    x = read_inputs(loaded, frame, seed, q)
    with compiling():
        found = loaded.singular_values(x.q, x.frame, rows)
        gradient = found.manipulability_gradient(loaded.hessian(x.q, x.frame))
    check = check_line(certificate := loaded.certificate())
    if format_ == "table" and output is None:
        out = console()
        _print(out, x, rows, found, gradient)
        out.print(check, style="green" if certificate.verified else "bold yellow")
    else:
        form = _as_json if format_ == "json" else _as_csv
        hand_out(form(x, rows, found, gradient, check).encode(), output)
        if format_ != "json":
            say(check, err=True)
    context.exit(exit_code(certificate))


def _names(found: SingularValues) -> list[str]:
    return [f"sigma_{k + 1}" for k in range(found.values.value.shape[-1])]


def _print(out: Console, x: Inputs, rows: str, found: SingularValues, gradient: FloatArray) -> None:
    out.print(f"{x.robot.name}: singular values of {x.frame}, {rows} rows", style="bold")
    for k in range(min(len(gradient), _SHOWN)):
        if len(gradient) > 1:
            out.print(f"sample {k}")
        lines: list[Sequence[str]] = [
            (name, *(f"{side[k, i]:.15g}" for side in found.values)) for i, name in enumerate(_names(found))
        ]
        for name, between in (("condition", found.condition), ("manipulability", found.manipulability)):
            lines.append((name, *(f"{side[k]:.15g}" for side in between)))
        print_named(out, ["", "value", "no less than", "no more than"], lines)
        singularity = found.singularity(k)
        for line in str(singularity).splitlines() if singularity else []:
            out.print(line, soft_wrap=True)
        if singularity:
            continue  # the manipulability has no derivative
        slopes = zip(x.robot.rate_names, gradient[k].tolist(), strict=True)
        print_named(out, ["joint", "manipulability changes by"], slopes)
    if len(gradient) > _SHOWN:
        out.print(f"... and {len(gradient) - _SHOWN} more samples: --format csv or json writes all")


def _as_json(x: Inputs, rows: str, found: SingularValues, gradient: FloatArray, check: str) -> str:
    document = {
        "robot": x.robot.name,
        "source": x.robot.source,
        "frame": x.frame,
        "rows": rows,
        "coordinates": list(x.robot.coordinate_names),
        "rates": list(x.robot.rate_names),
        "q": x.q.tolist(),
    }
    for name in ("values", "condition", "manipulability"):
        sides = getattr(found, name)._asdict()
        # JSON has no infinity and no nan.
        document["singular_values" if name == "values" else name] = {
            side: _finite(numbers.tolist()) for side, numbers in sides.items()
        }
    document["manipulability_gradient"] = _finite(gradient.tolist())
    document["singularities"] = [
        {"rank": one.rank, "full": one.full, "lost": one.lost.tolist(), "reasons": one.reasons}
        if one
        else None
        for one in (found.singularity(k) for k in range(len(gradient)))
    ]
    document["verified"] = x.robot.certificate().verified
    document["check"] = check
    return json_text(document) + "\n"


def _finite(value: object) -> object:
    if isinstance(value, list):
        return [_finite(item) for item in value]
    return value if isinstance(value, float) and abs(value) < float("inf") else None


def _as_csv(x: Inputs, rows: str, found: SingularValues, gradient: FloatArray, check: str) -> str:
    sides = ("", " lower", " upper")
    names = [name + side for name in (*_names(found), "condition", "manipulability") for side in sides]
    rates = (csv_cell(f"by {rate}") for rate in x.robot.rate_names)
    lines: list[list[object]] = [["sample", *names, *rates]]
    for k, slopes in enumerate(gradient.tolist()):
        between = [tuple(side[k].tolist() for side in found.values)]
        numbers = [number for of_one in zip(*between[0], strict=True) for number in of_one]
        for summary in (found.condition, found.manipulability):
            numbers += [float(side[k]) for side in summary]
        lines.append([k, *map(repr, numbers), *map(repr, slopes)])
    return csv_text(lines)
