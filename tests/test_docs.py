"""The pages say what is so: every command is one, every link and name leads somewhere."""

from __future__ import annotations

import importlib.util
import pkgutil
import re
import shlex
from pathlib import Path
from types import ModuleType

import pytest

from tests.pages import pages
from urdfkin.cli import cli

ROOT = Path(__file__).parents[1]
DOCS = [f"docs/{page}" for page in pages()]
PAGES = [*DOCS, "docs/examples/robots.yml", "README.md"]


def script(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, ROOT / "scripts" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_layout_on_the_page_is_the_schemas() -> None:
    maker = script("make_reports")
    assert maker.PAGE.read_text("utf-8") == maker.page(), "run python scripts/make_reports.py"


def commands() -> list[tuple[str, str]]:
    """Every line that calls urdfkin, in blocks of shell and in the workflow's steps."""
    found = []
    for page in PAGES:
        text = (ROOT / page).read_text("utf-8")
        blocks = (
            re.findall(r"```(?:sh|console)\n(.*?)```", text, re.DOTALL) if page.endswith(".md") else [text]
        )
        for block in blocks:
            joined = re.sub(r">\n\s+(urdfkin [^\n]*)\n\s+--", r"\1 --", block)
            found += [
                (page, words) for words in re.findall(r"(?:\$ |run: |^\s*)(urdfkin \w[^#\n]*)", joined, re.M)
            ]
    return found


@pytest.mark.parametrize(("page", "line"), commands())
def test_every_command_on_the_pages_is_understood(page: str, line: str) -> None:
    words = shlex.split(line.split(" || ", maxsplit=1)[0].split(" > ", maxsplit=1)[0])[1:]
    group = cli.make_context("urdfkin", ["--help"], resilient_parsing=True)
    command = cli.get_command(group, words[0])
    assert command is not None, (page, line)
    command.make_context(words[0], words[1:], parent=group)  # raises what the command line would say


def test_the_pages_have_commands_to_understand() -> None:
    assert len({page for page, _ in commands()}) >= 12
    assert len(commands()) >= 40


@pytest.mark.parametrize("page", [*DOCS, "README.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md"])
def test_links_lead_to_files_and_headings(page: str) -> None:
    text = (ROOT / page).read_text("utf-8")
    for target in re.findall(r"\]\(([^)]+)\)", text) + re.findall(r'src="([^"]+)"', text):
        if target.startswith("https://"):
            continue
        file, _, anchor = target.partition("#")
        there = (ROOT / page).parent / file if file else ROOT / page
        assert there.exists(), target
        heads = [
            re.sub(r"[^a-z0-9 -]", "", head.lower()).replace(" ", "-")
            for head in (re.findall(r"^#+ (.*)", there.read_text(), re.M) if there.suffix == ".md" else ())
        ]
        assert not anchor or anchor in heads, target


def leads_somewhere(name: str) -> bool:
    """Whether a dotted name is a module, or something in one."""
    try:
        pkgutil.resolve_name(name)
    except (ImportError, AttributeError):
        return False
    return True


@pytest.mark.parametrize("page", [*DOCS, "README.md", "CONTRIBUTING.md"])
def test_every_name_and_file_of_ours_is_there(page: str) -> None:
    text = (ROOT / page).read_text("utf-8")
    names = set(re.findall(r"`(urdfkin(?:\.\w+)+)", text))
    assert {name for name in names if not leads_somewhere(name)} == set()
    files = set(re.findall(r"`((?:urdfkin|tests|scripts|docs)/[\w./-]*\w)", text)) - {"urdfkin/robots/dh"}
    assert {file for file in files if not (ROOT / file).exists()} == set()


def test_every_file_of_ours_in_the_changelog_is_there() -> None:
    files = set(
        re.findall(r"`((?:urdfkin|tests|scripts|docs)/[\w./-]*\w)", (ROOT / "CHANGELOG.md").read_text())
    )
    assert len(files) > 5
    assert {file for file in files if not (ROOT / file).exists()} == set()
