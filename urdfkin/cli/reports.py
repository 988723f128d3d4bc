"""The forms a report can take, as options: the same for `validate`, which makes one, and `report`."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from urdfkin.cli.arguments import together
from urdfkin.cli.crash import crash, refuse
from urdfkin.cli.door import say
from urdfkin.cli.output import write_file
from urdfkin.errors import SourceError, UrdfkinError

if TYPE_CHECKING:
    from urdfkin.report.document import Document

_PATH = click.Path(path_type=Path, dir_okay=False)

report_options = together(
    click.option("--html", type=_PATH, help="Write the report as one page for a browser, offline."),
    click.option("--junit", type=_PATH, help="Write JUnit XML, a test case for each robot and quantity."),
    click.option("--markdown", type=_PATH, help="Write Markdown that fits a pull request's comment."),
)


def check_writable(*paths: Path | None) -> None:
    """Fail before the work, not after it.

    Raises:
        SourceError: no permission or no such folder.
    """
    for path in paths:
        if path is None or (path.exists() and not path.is_file()):  # a device or a pipe is not replaced
            continue
        try:
            with tempfile.NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}."):
                pass
        except OSError as error:
            found = error.strerror or str(error)
            raise SourceError("cannot be written", where=str(path), found=found) from error


def write_reports(
    document: Document,
    *,
    json_: Path | None = None,
    html: Path | None = None,
    junit: Path | None = None,
    markdown: Path | None = None,
) -> int:
    """Write the forms that were asked for, each whatever becomes of the others.

    Returns:
        0, or the exit code of the first that could not be written; what was wrong has been said.
    """
    forms = ((json_, _json), (html, _html), (junit, _junit), (markdown, _markdown))
    codes = (_written(path, form, document) for path, form in forms if path is not None)
    return next(filter(None, list(codes)), 0)


def say_written(*paths: Path | None) -> None:
    """Name the files that were written, if any."""
    if named := [str(path) for path in paths if path]:
        say(f"wrote {', '.join(named)}")


def _written(path: Path, form: Callable[[Document], bytes], document: Document) -> int:
    try:
        write_file(path, form(document))
    except UrdfkinError as error:
        return refuse(error)
    except Exception as error:
        return crash(error)
    return 0


def _json(document: Document) -> bytes:
    return (json.dumps(document, allow_nan=False) + "\n").encode()


def _html(document: Document) -> bytes:
    from urdfkin.report.html import as_html  # noqa: PLC0415  draws plots

    return as_html(document).encode()


def _junit(document: Document) -> bytes:
    from urdfkin.report.junit import as_junit  # noqa: PLC0415

    return as_junit(document)


def _markdown(document: Document) -> bytes:
    from urdfkin.report.markdown import as_markdown  # noqa: PLC0415

    return as_markdown(document).encode()
