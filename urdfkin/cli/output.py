"""Print results as tables or write them as JSON, CSV and npy.

A file is written completely or not at all.
"""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from urdfkin.cli.arguments import Inputs
from urdfkin.cli.streams import say
from urdfkin.errors.display import NOISE
from urdfkin.errors.escape import csv_cell, csv_text, json_text
from urdfkin.errors.numbers import parse_int
from urdfkin.report.listing import make_table, print_named
from urdfkin.system.files import write_file

__all__ = ["write_file"]

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from urdfkin.model.tree import FloatArray
    from urdfkin.verify.certificate import Certificate
    from urdfkin.verify.quantities import Quantity

FORMATS = ("table", "json", "csv", "npy")
ENDINGS = {".json": ("json",), ".csv": ("csv",), ".npy": ("npy",)}
#: Largest width of a table in columns: padding takes memory.
_WIDEST = 10_000
#: Number of samples of a batch that a table shows.
_SHOWN = 5

format_option = click.option(
    "--format",
    "format_",
    type=click.Choice(FORMATS),
    default="table",
    show_default=True,
    help="Output format; the suffix of --output also selects it.",
)
output_option = click.option(
    "--output",
    "-o",
    type=click.Path(path_type=Path),
    callback=lambda _context, _parameter, path: None if path == Path("-") else path,
    help="Write to a file instead of standard output, in the format of its suffix.",
)


@contextmanager
def compiling() -> Iterator[None]:
    """Print a line when a kernel is compiled, which happens once on a machine, and the time it took."""
    from urdfkin.compiled.compiling import listen_to_compile_events  # noqa: PLC0415  keeps --help fast

    hints = [", once; 'urdfkin warm' compiles all kernels"]

    def tell(name: str, seconds: float | None) -> None:
        if seconds is None:
            hint = hints.pop() if hints else ""
            say(f"urdfkin: compiling {name} for this machine{hint} ...", err=True)
        else:
            say(f"urdfkin: compiled {name} in {seconds:.1f} s", err=True)

    with listen_to_compile_events(tell):
        yield


def console(*, err: bool = False) -> Console:
    """Return the console: as wide as the terminal; for a pipe, as wide as COLUMNS or without wrapping."""
    from urdfkin.cli.terminal import Terminal  # noqa: PLC0415  keeps --help fast

    stream = sys.stderr if err else sys.stdout
    return Terminal(stream, width=None if stream.isatty() else _columns())


def _columns() -> int:
    """Return the width of a pipe from COLUMNS; if it is empty or 0, the largest width."""
    wanted = parse_int(os.environ.get("COLUMNS", "")) or 0
    return min(wanted, _WIDEST) if wanted > 0 else _WIDEST


def emit(
    inputs: Inputs,
    quantity: Quantity,
    reference: str | None,
    result: FloatArray,
    format_: str,
    output: Path | None,
) -> None:
    """Print or write (n, ...) results with their certificate."""
    certificate = inputs.robot.certificate()
    if format_ == "table" and output is None:
        _print_table(inputs, quantity, reference, result, certificate)
        return
    data = {
        "table": _as_csv, "csv": _as_csv, "json": _as_json, "npy": _as_npy,
    }[format_](inputs, quantity, reference, result, certificate)  # fmt: skip
    hand_out(data, output)
    if format_ != "json":
        say(check_line(certificate), err=True)


def hand_out(data: bytes, output: Path | None) -> None:
    """Write bytes to a file or, unchanged, to standard output."""
    if output is not None:
        write_file(output, data)
    else:
        sys.stdout.buffer.write(data)
        sys.stdout.buffer.flush()


def npy(array: FloatArray) -> bytes:
    """Return an array in NumPy's .npy format."""
    import numpy as np  # noqa: PLC0415  keeps --help fast

    stream = io.BytesIO()
    np.save(stream, array)
    return stream.getvalue()


def check_line(certificate: Certificate) -> str:
    """Return one line: number of checked results and worst disagreement, or the reason for no check."""
    by = certificate.oracle
    if certificate.not_verified:
        return f"NOT VERIFIED by {by}: {'; '.join(certificate.not_verified)}"
    parts = [
        f"{line.checked} {line.quantity} result{'s' if line.checked != 1 else ''}, "
        f"worst disagreement {line.worst:.2g} eps*scale ({line.share:.1%} of the bound)"
        for line in certificate.lines
    ]
    return f"verified by {by}: {'; '.join(parts)}"


def end_of_path(said: str | None) -> tuple[str, int]:
    """Return the last line and the exit code of a command about a path.

    Args:
        said: The result of the check, or None if nothing was checked.
    """
    from urdfkin.verify.pinocchio import version  # noqa: PLC0415  keeps --help fast

    by = f"Pinocchio {version()}"
    return (f"{by}: {said}", 0) if said else (f"NOT VERIFIED by {by}", 3)


def exit_code(certificate: Certificate) -> int:
    """Return 0 for verified results, 3 for results without a check."""
    return 0 if certificate.verified else 3


# -- machine formats ---------------------------------------------------------------------------------


def _as_json(
    inputs: Inputs, quantity: Quantity, reference: str | None, result: FloatArray, certificate: Certificate
) -> bytes:
    document: dict[str, Any] = {
        "robot": inputs.robot.name,
        "source": inputs.robot.source,
        "path": inputs.robot.path,
        "sha256": inputs.robot.sha256,
        "urdfkin": certificate.urdfkin,
        "quantity": quantity.name,
        "frame": inputs.frame,
        "reference": reference,
        "rows": list(quantity.labels) or None,
        "coordinates": list(inputs.coordinate_names),
        "rates": list(inputs.rate_names),
    }
    if inputs.t is not None:
        document["t"] = inputs.t.tolist()
    document |= {letter: getattr(inputs, letter).tolist() for letter in quantity.inputs}
    document |= inputs.said
    document["result"] = result.tolist()
    document["verified"] = certificate.verified
    document["check"] = check_line(certificate)
    return (json_text(document) + "\n").encode()


def _as_csv(
    inputs: Inputs, quantity: Quantity, reference: str | None, result: FloatArray, certificate: Certificate
) -> bytes:
    rows: list[list[object]]
    if quantity.columns:
        rates = [csv_cell(name) for name in inputs.rate_names]
        # A Hessian's line is for one column of the Jacobian; its columns are for the joint velocities.
        keys = [[row] for row in quantity.labels]
        for _ in range(2, quantity.axes):
            keys = [[*key, rate] for key in keys for rate in rates]
        rows = [["sample", "row", *["column"] * (quantity.axes - 2), *rates]]
        for k, J in enumerate(result.reshape(len(result), len(keys), len(rates)).tolist()):
            rows += ([k, *key, *map(repr, row)] for key, row in zip(keys, J, strict=True))
    else:
        names = quantity.labels or [f"T{i}{j}" for i in range(4) for j in range(4)]
        times = range(len(result)) if inputs.t is None else map(repr, inputs.t.tolist())
        rows = [["sample" if inputs.t is None else "t", *names]]
        samples = zip(times, result.reshape(len(result), -1).tolist(), strict=True)
        rows += ([t, *map(repr, row)] for t, row in samples)
    return csv_text(rows).encode()


def _as_npy(
    inputs: Inputs, quantity: Quantity, reference: str | None, result: FloatArray, certificate: Certificate
) -> bytes:
    return npy(result)


# -- tables ------------------------------------------------------------------------------------------


def _print_table(
    inputs: Inputs, quantity: Quantity, reference: str | None, result: FloatArray, certificate: Certificate
) -> None:
    out = console()
    how = [f"{name.replace('_', ' ')} {word}" for name, word in inputs.said.items() if isinstance(word, str)]
    where = "".join(f", {said}" for said in ([reference] if reference else []) + how)
    where += ", moving base" if inputs.base is not None else ""
    out.print(f"{inputs.robot.name}: {quantity.name} of {inputs.frame}{where}", style="bold")
    for k, value in enumerate(result[:_SHOWN]):
        if len(result) > 1:
            out.print(f"sample {k}" if inputs.t is None else f"t = {inputs.t[k]:.6g} s")
        if quantity.columns:
            _print_columns(out, quantity, inputs.rate_names, value)
        else:
            out.print(_table(inputs, quantity, value))
    if len(result) > _SHOWN:
        out.print(f"... and {len(result) - _SHOWN} more samples: --format csv, json or npy writes all")
    out.print(check_line(certificate), style="green" if certificate.verified else "bold yellow")


def _print_columns(out: Console, quantity: Quantity, rates: Sequence[str], value: FloatArray) -> None:
    """Print a line for each joint velocity; for a Hessian, one for each non-zero pair of them."""
    import numpy as np  # noqa: PLC0415

    if quantity.axes == len(("row", "rate")):
        print_named(out, ["joint", *quantity.labels], zip(rates, *value.tolist(), strict=True))
        return
    seen = np.abs(value).max(axis=0, initial=0.0) > NOISE * np.abs(value).max(initial=0.0)
    rows = [(rates[i], rates[j], *value[:, i, j].tolist()) for i, j in zip(*np.nonzero(seen), strict=True)]
    print_named(out, ["column", "changed by", *quantity.labels], rows, left=(0, 1))


def _table(inputs: Inputs, quantity: Quantity, value: FloatArray) -> Table:
    if not quantity.units:
        return make_table(
            [
                f"axis of {inputs.said.get('relative_to', 'the world')}",
                "x of frame",
                "y of frame",
                "z of frame",
                "position [m]",
            ],
            ((axis, *row) for axis, row in zip("xyz", value[:3].tolist(), strict=True)),
        )
    if len(value) != 3 * len(quantity.units):  # a quaternion
        return make_table(quantity.labels, [value.tolist()], left=())
    names = [f"{name} [{unit}]" for name, unit in quantity.units.items()]
    rows = zip(names, value.reshape(-1, 3).tolist(), strict=True)
    return make_table(["", "x", "y", "z"], ((name, *row) for name, row in rows))
