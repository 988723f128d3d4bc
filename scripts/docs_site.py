r"""What the documentation site makes of the pages on its way: mkdocs.yml names this file as its hooks.

Commands and the library's names are read from the program, so that their pages cannot be out of date; a
formula between $` and `$, which GitHub shows as it is, becomes MathML; a lesson is a notebook, too.
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
#: What is before an argument without brackets.
_NAME_OF_FUNCTION = re.compile(r"(<mi>(?:cos|sin)</mi>)(?=<m(?:i|sub)>)")
_FENCE = re.compile(r"^```(\w+)\n(.*?)^```\n?", re.DOTALL | re.MULTILINE)


def on_config(config: Any) -> Any:
    """No page is forgotten: those that mkdocs.yml does not name come last in the menu."""
    named = set(re.findall(r"[\w/-]+\.md", json.dumps(config.nav)))
    docs = Path(config.docs_dir)
    pages = sorted(str(path.relative_to(docs)) for path in docs.rglob("*.md"))
    if more := [page for page in pages if page not in named]:
        config.nav.append({"More": more})
    return config


def on_files(files: Any, config: Any) -> Any:
    """Add the pages that are made of the program, and a notebook for each lesson."""
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
    """Displayed formulas on lines of their own; a lesson can be had as a notebook."""
    markdown = _DISPLAYED.sub(r"\n$`\1`$\n", markdown)
    if not page.file.src_uri.startswith(LESSONS):
        return markdown
    name = Path(page.file.src_uri).with_suffix(".ipynb").name
    return f"{markdown}\n\n[This lesson as a notebook]({name})\n"


def on_page_content(content: str, **_: Any) -> str:
    """Formulas as MathML."""
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
    """A page as a notebook: text, code, and what the page shows below it, which a test compares."""
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
    """A cell of text, formulas as notebooks write them; pictures and links stay on the site."""
    text = re.sub(r"\$`(.*?)`\$", r"$\1$", _DISPLAYED.sub(r"$$\1$$", text), flags=re.DOTALL)
    if text := text.strip():
        cells.append(_cell("markdown", text))


def _cell(kind: str, source: str, **more: Any) -> dict[str, Any]:
    return {"cell_type": kind, "metadata": {}, "source": source.rstrip(), **more}


def library_page() -> str:
    """Every public name with its docstring."""
    names = [f"::: {urdfkin._HOMES[name]}.{name}" for name in urdfkin.__all__]
    return "\n\n".join(["# Library", "`import urdfkin` offers these names.", *names]) + "\n"


def commands_page() -> str:
    """Every command as `--help` prints it."""
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
