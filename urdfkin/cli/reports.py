"""The forms a report can take, as options: the same for `validate`, which makes one, and `report`."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import click

from urdfkin.cli.arguments import together
from urdfkin.cli.output import write_file
from urdfkin.errors import SourceError

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
        if path is None:
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
) -> None:
    """Write the forms that were asked for."""
    if json_ is not None:
        write_file(json_, (json.dumps(document, allow_nan=False) + "\n").encode())
    if html is not None:
        from urdfkin.report.html import as_html  # noqa: PLC0415  draws plots

        write_file(html, as_html(document).encode())
    if junit is not None:
        from urdfkin.report.junit import as_junit  # noqa: PLC0415

        write_file(junit, as_junit(document))
    if markdown is not None:
        from urdfkin.report.markdown import as_markdown  # noqa: PLC0415

        write_file(markdown, as_markdown(document).encode())
