"""The pages about reports say what is so: the layout is the schema's, and every command of theirs is one."""

from __future__ import annotations

import importlib.util
import re
import shlex
from pathlib import Path
from types import ModuleType

import pytest

from urdfkin.cli import cli

ROOT = Path(__file__).parents[1]
PAGES = (
    "docs/check.md",
    *("docs/reports.md", "docs/ci.md", "docs/campaigns.md", "docs/dh-at-work.md", "docs/accelerations.md"),
    *("docs/examples/robots.yml", "README.md"),
)


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
                (page, words) for words in re.findall(r"(?:\$ |run: |^\s*)(urdfkin [^#\n]*)", joined, re.M)
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
    assert {page for page, _ in commands()} == set(PAGES)
    assert len(commands()) >= 12


@pytest.mark.parametrize(
    "page", ["docs/check.md", "docs/reports.md", "docs/ci.md", "docs/campaigns.md", "docs/performance.md"]
)
def test_links_lead_to_files_and_headings(page: str) -> None:
    text = (ROOT / page).read_text("utf-8")
    for target in re.findall(r"\]\(([^)]+)\)", text):
        if target.startswith("https://"):
            continue
        file, _, anchor = target.partition("#")
        there = (ROOT / page).parent / file if file else ROOT / page
        assert there.is_file(), target
        heads = [
            re.sub(r"[^a-z0-9 -]", "", head.lower()).replace(" ", "-")
            for head in re.findall(r"^#+ (.*)", there.read_text(), re.M)
        ]
        assert not anchor or anchor in heads, target
