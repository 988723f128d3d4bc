"""Options for the formats of a report, shared by `validate` and `report`."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click

from urdfkin.cli.arguments import together
from urdfkin.cli.exit import crash, refuse
from urdfkin.cli.output import write_file
from urdfkin.cli.streams import say
from urdfkin.errors import SourceError, UrdfkinError

if TYPE_CHECKING:
    from urdfkin.validation.document import Document


#: The files of a format, each with its path: one file, or a page with a folder of files.
Files = Iterator[tuple[Path, bytes]]

_PATH = click.Path(path_type=Path, dir_okay=False)

#: Parameter names of the options for a report's files.
FILES = ("json_", "html", "junit", "markdown")
report_options = together(
    click.option("--html", type=_PATH, help="Write the report as an offline HTML page."),
    click.option(
        "--junit", type=_PATH, help="Write JUnit XML, with a test case for each robot and quantity."
    ),
    click.option("--markdown", type=_PATH, help="Write Markdown for a pull request comment."),
    click.option(
        "--cases/--no-cases", default=False, help="Show the command that computes each worst case again."
    ),
)


def check_writable(*paths: Path | None) -> None:
    """Raise SourceError before the work if a file cannot be written.

    Raises:
        SourceError: Missing permission, or no such folder.
    """
    for path in paths:
        if path is None:
            continue
        try:
            if path.exists() and not path.is_file():  # a device or a pipe is written directly
                continue
            with tempfile.NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}."):
                pass
        except OSError as error:
            found = error.strerror or str(error)
            raise SourceError("cannot be written", where=str(path), found=found) from error


def write_reports(document: Document, files: Mapping[str, Path | None]) -> int:
    """Write the requested formats. A failure of one does not affect the others.

    Returns:
        0, or the exit code of the first format that could not be written. Its error has been printed.
    """
    forms = {"json_": _json, "html": _html, "junit": _junit, "markdown": _markdown}
    codes = (_write(path, forms[name], document) for name in FILES if (path := files[name]) is not None)
    return next(filter(None, list(codes)), 0)


def say_written(files: Mapping[str, Path | None]) -> None:
    """Print the names of the written files, if any."""
    if named := [str(files[name]) for name in FILES if files[name]]:
        say(f"wrote {', '.join(named)}")


def _write(path: Path, form: Callable[[Document, Path], Files], document: Document) -> int:
    try:
        for place, data in form(document, path):
            if place.parent != path.parent:
                place.parent.mkdir(exist_ok=True)
            write_file(place, data)
    except UrdfkinError as error:
        return refuse(error)
    except OSError as error:
        return refuse(SourceError("cannot be written", where=str(path), found=error.strerror or str(error)))
    except Exception as error:
        return crash(error)
    return 0


def _json(document: Document, path: Path) -> Files:
    yield path, (json.dumps(document, allow_nan=False) + "\n").encode()


def _html(document: Document, path: Path) -> Files:
    from urdfkin.report.html import as_files  # noqa: PLC0415  draws plots

    return ((path.parent / place, text.encode()) for place, text in as_files(document, path.name))


def _junit(document: Document, path: Path) -> Files:
    from urdfkin.report.junit import as_junit  # noqa: PLC0415

    yield path, as_junit(document)


def _markdown(document: Document, path: Path) -> Files:
    from urdfkin.report.markdown import as_markdown  # noqa: PLC0415

    yield path, as_markdown(document).encode()
