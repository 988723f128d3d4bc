"""Print the result of a command as a table, or write it in another format.

A file is written completely or not at all.
"""

from __future__ import annotations

import io
import os
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import update_wrapper
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from urdfkin.cli.options import FILE, combine, format_from_suffix
from urdfkin.cli.streams import say, say_file_content
from urdfkin.errors import SourceError
from urdfkin.errors.display import TextDocument, format_count
from urdfkin.errors.escape import csv_text, json_text
from urdfkin.errors.numbers import parse_int
from urdfkin.system.files import refuse_read_only, write_file

if TYPE_CHECKING:
    from rich.console import Console

    from urdfkin.verify.certificate import Certificate

TEXT_FORMATS = ("table", "markdown", "html", "latex")
_SUFFIXES = {
    "json": ".json", "csv": ".csv", "npy": ".npy", "table": ".txt", "markdown": ".md", "html": ".html",
    "latex": ".tex",
}  # fmt: skip
_F = TypeVar("_F", bound=Callable[..., Any])
#: Maximum number of characters in a line of a table. Cells are padded to the widest cell of their column, so
#: one very long name could fill the memory.
_MAX_WIDTH = 10_000


def output_option(
    help_: str = "Write the output to this file; its suffix selects the format.",
) -> Callable[[_F], _F]:
    return click.option(
        "--output",
        "-o",
        type=FILE,
        callback=lambda _context, _parameter, path: None if path == Path("-") else path,
        help=help_,
        show_default="standard output",
    )


@dataclass(frozen=True)
class Answer:
    """The result of a command.

    Attributes:
        document: Function that returns the texts and tables for the formats in `TEXT_FORMATS`.
        data: A function for each other format. The function returns a mapping for JSON, rows for CSV, an
            array for npy, or the output as text. A function for a format in `TEXT_FORMATS` replaces
            `document` in this format.
        check: Last line of the output, for example "verified by Pinocchio: ..."; "" if nothing is checked.
        fit_document: Function that returns a document for the width of a terminal; None to use `document`.
    """

    document: Callable[[], TextDocument]
    data: Mapping[str, Callable[[], Any]] = field(default_factory=dict)
    check: str = ""
    code: int = 0
    fit_document: Callable[[Console], TextDocument] | None = None

    def show(self, out: Console) -> None:
        from urdfkin.report.listing import print_document

        print_document(out, self.document() if self.fit_document is None else self.fit_document(out))
        if self.check:
            out.print(self.check, style="bold yellow" if self.code else "green")

    def convert(self, form: str) -> tuple[bytes | str, bool]:
        """Return the output in the format `form`, and whether the output already contains `check`."""
        if form in self.data:
            data = self.data[form]()
            has_check = form == "json" and isinstance(data, Mapping)
            if has_check and self.check:
                data = {**data, "verified": self.code == 0, "check": self.check}
            return data if isinstance(data, str) else _CONVERTERS[form](data), has_check
        document = self.document()
        if self.check:
            document = replace(document, parts=[*document.parts, self.check])
        return document.render(form), True

    def write(self, form: str, forms: Sequence[str], output: Path | None = None) -> None:
        if form == forms[0] and output is None and form not in self.data:
            self.show(make_console())
            return
        text, has_check = self.convert(form)
        write_output(text, output)
        if self.check and not has_check:
            say(self.check, err=True)


def _npy_bytes(array: Any) -> bytes:
    import numpy as np

    stream = io.BytesIO()
    np.save(stream, array)
    return stream.getvalue()


_CONVERTERS: dict[str, Callable[[Any], bytes | str]] = {
    "json": lambda data: json_text(data) + "\n", "csv": csv_text, "npy": _npy_bytes,
}  # fmt: skip


def answer_command(
    *names: str, suffixes: Mapping[str, tuple[str, ...]] | None = None
) -> Callable[[Any], Any]:
    """Make a command with --format and --output from a function that returns an `Answer`."""
    forms = names or (*TEXT_FORMATS, "json", "csv")
    formats = suffixes or {_SUFFIXES[form]: (form,) for form in forms}
    default_format = "csv" if "csv" in forms and "table" in forms else forms[0]

    def decorate(function: Callable[..., Answer]) -> Any:
        def command(context: click.Context, /, format_: str, output: Path | None, **values: Any) -> None:
            context.params["format_"] = form = format_from_suffix(context, output, formats, default_format)
            check_writable(output)
            answer = function(**values)
            answer.write(form, forms, output)
            context.exit(answer.code)

        wrapped = click.pass_context(update_wrapper(command, function))
        return combine(format_option(*forms), output_option())(wrapped)

    return decorate


def format_option(
    *names: str, help_: str = "Output format; the suffix of --output also selects it."
) -> Callable[[Any], Any]:
    return click.option("--format", "format_", type=click.Choice(names), default=names[0], help=help_)


@contextmanager
def report_compilation() -> Iterator[None]:
    from urdfkin.compiled.kernel_cache import listen_to_compile_events

    hints = [", once; 'urdfkin warm' compiles all kernels"]

    def print_compile_event(name: str, seconds: float | None) -> None:
        if seconds is None:
            hint = hints.pop() if hints else ""
            say(f"urdfkin: compiling {name} for this machine{hint} ...", err=True)
        else:
            say(f"urdfkin: compiled {name} in {seconds:.1f} s", err=True)

    with listen_to_compile_events(print_compile_event):
        yield


def make_console(*, err: bool = False) -> Console:
    """Return a console.

    If the stream is no terminal, the environment variable COLUMNS sets the width in characters.
    """
    from urdfkin.cli.terminal import Terminal

    stream = sys.stderr if err else sys.stdout
    columns = parse_int(os.environ.get("COLUMNS", "")) or 0
    width = min(columns, _MAX_WIDTH) if columns > 0 else _MAX_WIDTH
    return Terminal(stream, width=None if stream.isatty() else width)


def write_output(data: bytes | str, output: Path | None) -> None:
    if output is not None:
        write_file(output, data.encode() if isinstance(data, str) else data)
    elif isinstance(data, str):
        say_file_content(data)
    else:
        sys.stdout.buffer.write(data)
        sys.stdout.buffer.flush()


def check_writable(*paths: Path | None, more_inputs: Iterable[str] = ()) -> None:
    """Raise SourceError before a long computation if `write_file` cannot write an output file.

    Raise UsageError if two options of a command name the same file, or if an option names an input file. The
    input files are `more_inputs` and the command's arguments. This check does not detect a full disk;
    `write_file` does.
    """
    context = click.get_current_context(silent=True)
    targets: set[Path] = set() if context is None else context.meta.setdefault("output files", set())
    arguments = [] if context is None else _argument_values(context)
    outputs = [path for path in paths if path is not None]
    inputs = (*arguments, *more_inputs) if outputs else ()
    # Unlike `Path.is_file`, `os.path.isfile` accepts any text, for example a very long one.
    protected = {Path(word).resolve() for word in inputs if os.path.isfile(word)}  # noqa: PTH113
    for path in outputs:
        try:
            # `write_file` writes to a device or a pipe directly, without a temporary file.
            if path.exists() and not path.is_file():
                continue
            target = path.resolve()
            if target in targets:
                raise click.UsageError(f"two options write the same file, {str(path)!r}; name two files")
            if target in protected:
                raise click.UsageError(f"the output would replace the input {str(path)!r}; name another file")
            targets.add(target)
            refuse_read_only(target)
            with tempfile.NamedTemporaryFile(dir=target.parent, prefix=f".{target.name}."):
                pass
        except OSError as error:
            found = error.strerror or str(error)
            raise SourceError("cannot be written", where=str(path), found=found) from error


def _argument_values(context: click.Context) -> Iterator[str | Path]:
    for parameter in context.command.params:
        if isinstance(parameter, click.Argument):
            value = context.params.get(parameter.name or "")
            for word in value if isinstance(value, tuple) else (value,):
                if isinstance(word, str | Path):
                    yield word


def format_check_line(certificate: Certificate) -> str:
    oracle = certificate.oracle
    if certificate.not_verified:
        return f"NOT VERIFIED by {oracle}: {'; '.join(certificate.not_verified)}"
    parts = [
        f"{format_count(line.checked, f'{line.quantity} result')}, worst disagreement"
        f" {line.worst:.2g} eps*scale ({line.bound_ratio:.1%} of the bound)"
        for line in certificate.lines
    ]
    return f"verified by {oracle}: {'; '.join(parts)}"


def certificate_exit_code(certificate: Certificate) -> int:
    return 0 if certificate.verified else 3


def format_pinocchio_check(check: object | None) -> tuple[str, int]:
    """Return a line with the result of Pinocchio's check, and the command's exit code.

    `check` is the result of the check, or None if nothing was checked.
    """
    from urdfkin.verify.pinocchio import version

    oracle = f"Pinocchio {version()}"
    return (f"NOT VERIFIED by {oracle}", 3) if check is None else (f"{oracle}: {check}", 0)
