r"""Hooks of mkdocs that generate and convert pages of the documentation site; mkdocs.yml refers to them.

The pages of commands and of the library are generated from the program, so they are always current. A formula
between $` and `$ becomes MathML. A lesson is also available as a notebook.
"""

from __future__ import annotations

import html
import json
import re
from pathlib import Path
from typing import Any

import click

import urdfkin
from urdfkin.cli import cli

LESSONS = "lessons/"
_FORMULA = re.compile(r"(?:<p>)?\$<code>(.*?)</code>\$(?:</p>)?", re.DOTALL)
_DISPLAYED = re.compile(r"^```math\n(.*?)\n```$", re.DOTALL | re.MULTILINE)
#: A LaTeX command before an argument without braces.
_NAME_OF_FUNCTION = re.compile(r"(<mi>(?:cos|sin)</mi>)(?=<m(?:i|sub)>)")
_FENCE = re.compile(r"^```(\w+)\n(.*?)^```\n?", re.DOTALL | re.MULTILINE)


def on_config(config: Any) -> Any:
    """Add the pages that mkdocs.yml does not name to the end of the menu."""
    named = set(re.findall(r"[\w/-]+\.md", json.dumps(config.nav)))
    docs = Path(config.docs_dir)
    pages = sorted(str(path.relative_to(docs)) for path in docs.rglob("*.md"))
    if more := [page for page in pages if page not in named]:
        config.nav.append({"More": more})
    return config


def on_files(files: Any, config: Any) -> Any:
    """Add the pages generated from the program, and a notebook for each lesson."""
    from mkdocs.structure.files import File  # noqa: PLC0415  of the extra `docs`

    made = {"cli.md": commands_page(), "api.md": library_page()}
    for file in files.documentation_pages():
        if file.src_uri.startswith(LESSONS):
            made[str(Path(file.src_uri).with_suffix(".ipynb"))] = json.dumps(
                notebook(file.content_string), indent=1
            )
    for name, content in made.items():
        files.append(File.generated(config, name, content=content))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Put displayed formulas on separate lines, and add the link to a lesson's notebook."""
    markdown = _DISPLAYED.sub(r"\n$`\1`$\n", markdown)
    if not page.file.src_uri.startswith(LESSONS):
        return markdown
    name = Path(page.file.src_uri).with_suffix(".ipynb").name
    return f"{markdown}\n\n[This lesson as a notebook]({name})\n"


def on_page_content(content: str, **_: Any) -> str:
    """Convert formulas to MathML."""
    from latex2mathml.converter import convert  # noqa: PLC0415  of the extra `docs`

    def mathml(found: re.Match[str]) -> str:
        alone = found[0].startswith("<p>") and found[0].endswith("</p>")
        text = str(convert(html.unescape(found[1]), display="block" if alone else "inline"))
        text = _NAME_OF_FUNCTION.sub(
            r'\1<mspace width="0.17em"/>', text.replace("<mover>", '<mover accent="true">')
        )
        return (
            f'<div class="formula">{text}</div>'
            if alone
            else found[0].replace(f"$<code>{found[1]}</code>$", text)
        )

    return _FORMULA.sub(mathml, content)


def notebook(page: str) -> dict[str, Any]:
    """Convert a page to a notebook with text, code, and the output on the page, which a test compares."""
    cells: list[dict[str, Any]] = []
    at = 0
    for block in _FENCE.finditer(page):
        kind, text = block.groups()
        if kind == "python" or (kind == "text" and cells and cells[-1]["cell_type"] == "code"):
            _tell(cells, page[at : block.start()])
            at = block.end()
        if kind == "python":
            cells.append(_cell("code", text, execution_count=None, outputs=[]))
        elif kind == "text" and at == block.end():
            cells[-1]["outputs"].append({"output_type": "stream", "name": "stdout", "text": text})
    _tell(cells, page[at:])
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    return {"cells": cells, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 4}


def _tell(cells: list[dict[str, Any]], text: str) -> None:
    """Add a text cell with formulas in notebook syntax, without pictures and links."""
    text = re.sub(r"\$`(.*?)`\$", r"$\1$", _DISPLAYED.sub(r"$$\1$$", text), flags=re.DOTALL)
    if text := text.strip():
        cells.append(_cell("markdown", text))


def _cell(kind: str, source: str, **more: Any) -> dict[str, Any]:
    return {"cell_type": kind, "metadata": {}, "source": source.rstrip(), **more}


def library_page() -> str:
    """Return the page of all public names with their docstrings."""
    names = [f"::: {urdfkin._HOMES[name]}.{name}" for name in urdfkin.__all__]
    return "\n\n".join(["# Library", "`import urdfkin` offers these names.", *names]) + "\n"


def commands_page() -> str:
    """Return the page of all commands with the text of `--help`."""
    parent = click.Context(cli, info_name="urdfkin", terminal_width=80, **cli.context_settings)
    parts = ["# Commands", "`urdfkin COMMAND --help` prints each of these.", *_help(cli, parent, "##")]
    return "\n\n".join(parts) + "\n"


def _help(command: click.Command, context: click.Context, heading: str) -> list[str]:
    parts = [f"{heading} {context.command_path}", f"```text\n{command.get_help(context)}\n```"]
    if isinstance(command, click.Group):
        for name in command.list_commands(context):
            found = command.get_command(context, name)
            if found is None:
                raise LookupError(name)
            parts += _help(found, click.Context(found, parent=context, info_name=name), heading)
    return parts
