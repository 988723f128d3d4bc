"""`urdfkin acceleration --breakdown`: print or write the acceleration split by joint and term."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from urdfkin.cli.arguments import Inputs
from urdfkin.cli.output import check_line, console, hand_out, npy
from urdfkin.cli.streams import say
from urdfkin.errors.display import NOISE, six_digits
from urdfkin.errors.escape import csv_cell, csv_text, json_text
from urdfkin.report.listing import print_named
from urdfkin.verify.quantities import SIX

if TYPE_CHECKING:
    from urdfkin.compiled.breakdown import AccelerationBreakdown
    from urdfkin.model.tree import FloatArray

_COLUMNS = ("joint", "kind", "lin x", "lin y", "lin z", "ang x", "ang y", "ang z")
#: Number of samples of a batch that the table shows.
_SHOWN = 2


def emit_breakdown(
    inputs: Inputs, reference: str, parts: AccelerationBreakdown, format_: str, output: Path | None
) -> None:
    """Print or write the (n, ...) parts with the certificate of their sum."""
    certificate = inputs.robot.certificate()
    if format_ == "table" and output is None:
        _print(inputs, reference, parts)
        say(check_line(certificate))
        return
    writer = {"table": _as_csv, "csv": _as_csv, "json": _as_json, "npy": _as_npy}[format_]
    hand_out(writer(inputs, reference, parts), output)
    if format_ != "json":
        say(check_line(certificate), err=True)


def _print(inputs: Inputs, reference: str, parts: AccelerationBreakdown) -> None:
    out = console()
    out.print(f"{inputs.robot.name}: acceleration of {inputs.frame}, {reference}, by joint", style="bold")
    out.print("m/s^2 and rad/s^2; transverse a z x d, centripetal, Coriolis 2 w x u, sliding a z (7.125)")
    for k in range(min(len(parts.base), _SHOWN)):
        if len(parts.base) > 1:
            out.print(f"sample {k}")
        noise = NOISE * float(abs(parts.terms[k]).max(initial=0.0))
        rows = [*parts.contributions((k,)), ("sum", "", parts.total[k])]
        cells = ((joint, kind, *_cells(six, noise)) for joint, kind, six in rows)
        print_named(out, _COLUMNS, cells, left=range(2))
    if len(parts.base) > _SHOWN:
        more = len(parts.base) - _SHOWN
        out.print(f"... and {more} more samples: --format csv, json or npy writes all")


def _cells(six: FloatArray, noise: float) -> list[str]:
    """Return the numbers with four digits, so that a row fits on the terminal."""
    return [six_digits(x, noise, digits=4) for x in six.tolist()]


def _as_json(inputs: Inputs, reference: str, parts: AccelerationBreakdown) -> bytes:
    from urdfkin.compiled.breakdown import KINDS  # noqa: PLC0415

    certificate = inputs.robot.certificate()
    document = {
        "robot": inputs.robot.name,
        "source": inputs.robot.source,
        "quantity": "acceleration breakdown",
        "frame": inputs.frame,
        "reference": reference,
        "rows": list(SIX),
        "joints": list(parts.joints),
        "kinds": list(KINDS),
        "q": inputs.q.tolist(),
        "v": inputs.v.tolist(),
        "a": inputs.a.tolist(),
        "base": parts.base.tolist(),
        "terms": parts.terms.tolist(),
        "total": parts.total.tolist(),
        "verified": certificate.verified,
        "check": check_line(certificate),
    }
    return (json_text(document) + "\n").encode()


def _as_csv(inputs: Inputs, reference: str, parts: AccelerationBreakdown) -> bytes:
    rows: list[list[object]] = [["sample", "joint", "kind", *SIX]]
    for sample in range(len(parts.base)):
        for joint, kind, six in parts.contributions((sample,)):
            rows.append([sample, csv_cell(joint), kind, *map(repr, six.tolist())])
        rows.append([sample, "sum", "", *map(repr, parts.total[sample].tolist())])
    return csv_text(rows).encode()


def _as_npy(inputs: Inputs, reference: str, parts: AccelerationBreakdown) -> bytes:
    return npy(parts.terms)
