"""Print the result of a command as a table, or write it in another format.

A file is written completely or not at all.
"""

from __future__ import annotations

import io
import os
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import update_wrapper
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from urdfkin.cli.options import format_from_suffix, together
from urdfkin.cli.streams import say, say_file
from urdfkin.errors import SourceError
from urdfkin.errors.display import TextDocument
from urdfkin.errors.escape import csv_text, json_text
from urdfkin.errors.numbers import parse_int
from urdfkin.system.files import write_file

__all__ = ["write_file"]

if TYPE_CHECKING:
    from rich.console import Console

    from urdfkin.verify.certificate import Certificate

#: Formats of a printed table
TEXTS = ("table", "markdown", "html", "latex")
#: Suffix of each format
_SUFFIXES = {
    "json": ".json", "csv": ".csv", "npy": ".npy", "table": ".txt", "markdown": ".md", "html": ".html",
    "latex": ".tex",
}  # fmt: skip
#: A table has at most this number of characters in a line.
#: All cells of a column have the same width, so one very long name could fill the memory.
_WIDEST = 10_000

output_option = click.option(
    "--output",
    "-o",
    type=click.Path(path_type=Path),
    callback=lambda _context, _parameter, path: None if path == Path("-") else path,
    help="File for the output instead of standard output; its suffix selects the format.",
)


@dataclass(frozen=True)
class Answer:
    """The result of a command; its methods write it as a table, JSON, CSV or another format.

    Attributes:
        document: Function that returns the result as text and tables, for the formats in `TEXTS`.
        data: Functions that return the result for other formats, by name of the format. The function returns
            a mapping for JSON, rows for CSV, an array for npy, and text for any other format. If `data` has a
            function for a format in `TEXTS`, `document` is not used for it.
        check: The last line of the output, for example "verified by Pinocchio: ...". The line is empty if the
            command checks nothing.
        code: The exit code of the command.
        fitted: Function that returns text and tables that fit the width of a terminal. None: use `document`.
    """

    document: Callable[[], TextDocument]
    data: Mapping[str, Callable[[], Any]] = field(default_factory=dict)
    check: str = ""
    code: int = 0
    fitted: Callable[[Console], TextDocument] | None = None

    def show(self, out: Console) -> None:
        from urdfkin.report.listing import print_document

        print_document(out, self.document() if self.fitted is None else self.fitted(out))
        if self.check:
            out.print(self.check, style="bold yellow" if self.code else "green")

    def write(self, form: str) -> tuple[bytes | str, bool]:
        """Return the result in a format, and whether the text contains the line `check`."""
        if form in self.data:
            found = self.data[form]()
            stated = form == "json" and isinstance(found, Mapping)
            if stated and self.check:
                found = {**found, "verified": self.code == 0, "check": self.check}
            return found if isinstance(found, str) else _WRITERS[form](found), stated
        document = self.document()
        if self.check:
            document = replace(document, parts=[*document.parts, self.check])
        return document.written(form), True

    def put(self, form: str, forms: Sequence[str], output: Path | None = None) -> None:
        """Print the result with colours if `form` is the command's default format, `forms[0]`.

        For another format or an output file, write the result without colours.
        """
        if form == forms[0] and output is None and form not in self.data:
            self.show(console())
            return
        written, stated = self.write(form)
        hand_out(written, output)
        if self.check and not stated:
            say(self.check, err=True)


def _npy(array: Any) -> bytes:
    import numpy as np

    stream = io.BytesIO()
    np.save(stream, array)
    return stream.getvalue()


_WRITERS: dict[str, Callable[[Any], bytes | str]] = {
    "json": lambda data: json_text(data) + "\n", "csv": csv_text, "npy": _npy,
}  # fmt: skip


def answering(*names: str, suffixes: Mapping[str, tuple[str, ...]] | None = None) -> Callable[[Any], Any]:
    """Return a decorator for a function that returns an `Answer`.

    The decorated function has the options --format and --output. It writes the answer, and ends the command
    with the answer's exit code. `names` are the output formats of the command; by default the formats in
    `TEXTS`, JSON and CSV. `suffixes` are the formats of each suffix; by default those of `_SUFFIXES`.
    """
    forms = names or (*TEXTS, "json", "csv")
    endings = suffixes or {_SUFFIXES[form]: (form,) for form in forms}
    plain = "csv" if "csv" in forms and "table" in forms else forms[0]

    def decorate(function: Callable[..., Answer]) -> Any:
        def command(context: click.Context, /, format_: str, output: Path | None, **values: Any) -> None:
            context.params["format_"] = form = format_from_suffix(context, output, endings, plain)
            check_writable(output)
            answer = function(**values)
            answer.put(form, forms, output)
            context.exit(answer.code)

        wrapped = click.pass_context(update_wrapper(command, function))
        return together(format_option(*forms), output_option)(wrapped)

    return decorate


def format_option(
    *names: str, help_: str = "Output format; the suffix of --output also selects it."
) -> Callable[[Any], Any]:
    """Make the option --format; the first format is the default."""
    return click.option(
        "--format", "format_", type=click.Choice(names), default=names[0], show_default=True, help=help_
    )


@contextmanager
def compiling() -> Iterator[None]:
    """Print a line when a kernel is compiled, and then the time; each kernel is compiled only once."""
    from urdfkin.compiled.kernel_cache import listen_to_compile_events

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
    """Return a console with the width of the terminal.

    If the output goes to a pipe, the variable COLUMNS sets the width. Without COLUMNS, no line is wrapped.
    """
    from urdfkin.cli.terminal import Terminal

    stream = sys.stderr if err else sys.stdout
    return Terminal(stream, width=None if stream.isatty() else _columns())


def _columns() -> int:
    wanted = parse_int(os.environ.get("COLUMNS", "")) or 0
    return min(wanted, _WIDEST) if wanted > 0 else _WIDEST


def hand_out(data: bytes | str, output: Path | None) -> None:
    """Write data to a file, or unchanged to standard output."""
    if output is not None:
        write_file(output, data.encode() if isinstance(data, str) else data)
    elif isinstance(data, str):
        say_file(data)
    else:
        sys.stdout.buffer.write(data)
        sys.stdout.buffer.flush()


def check_writable(*paths: Path | None) -> None:
    """Raise SourceError if a file cannot be written; call this before the computation begins.

    The permission may be missing, or the folder may not exist.
    """
    for path in paths:
        if path is None:
            continue
        try:
            if path.exists() and not path.is_file():  # A device needs no temporary file.
                continue
            with tempfile.NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}."):
                pass
        except OSError as error:
            found = error.strerror or str(error)
            raise SourceError("cannot be written", where=str(path), found=found) from error


def check_line(certificate: Certificate) -> str:
    """Return a line with the checked results and the worst disagreement, or with "NOT VERIFIED"."""
    by = certificate.oracle
    if certificate.not_verified:
        return f"NOT VERIFIED by {by}: {'; '.join(certificate.not_verified)}"
    parts = [
        f"{line.checked} {line.quantity} result{'s' if line.checked != 1 else ''}, "
        f"worst disagreement {line.worst:.2g} eps*scale ({line.share:.1%} of the bound)"
        for line in certificate.lines
    ]
    return f"verified by {by}: {'; '.join(parts)}"


def exit_code(certificate: Certificate) -> int:
    return 0 if certificate.verified else 3


def check_of_path(check: object | None) -> tuple[str, int]:
    """Return the last line and the exit code of `urdfkin chain`, `screws`, `structure` or `dh`.

    `check` is the result of Pinocchio's check, for example a `TableCheck`; None if nothing was checked.
    """
    from urdfkin.verify.pinocchio import version

    by = f"Pinocchio {version()}"
    return (f"NOT VERIFIED by {by}", 3) if check is None else (f"{by}: {check}", 0)
