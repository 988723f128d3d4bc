"""The README is true: its example runs, its commands exist, its transcripts are the real output."""

import re
from pathlib import Path
from typing import Any

import pytest

from tests.cli.running import urdfkin
from urdfkin.cli import commands

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")


def block(language: str, page: str = README) -> str:
    """The first fenced block of a language."""
    blocks: list[str] = re.findall(rf"```{language}\n(.*?)```", page, re.DOTALL)
    return blocks[0]


def transcripts() -> list[tuple[list[str], list[str]]]:
    """Each command of the console blocks, as words, and the lines it prints."""
    found: list[tuple[list[str], list[str]]] = []
    for text in re.findall(r"```console\n(.*?)```", README, re.DOTALL):
        for line in text.splitlines():
            if line.startswith("$ urdfkin "):
                found.append((line.split()[2:], []))
            else:
                found[-1][1].append(line)
    return found


def masked(text: str) -> str:
    """A text without the disagreements, which differ between machines."""
    return re.sub(
        r"worst (error |disagreement )?\S+|\S+% of|Pinocchio \S+|\d\S* of the bound", "", text
    ).strip()


def test_the_smallest_example_runs_and_is_verified() -> None:
    names: dict[str, Any] = {}
    exec(compile(block("python"), "README.md", "exec"), names)
    assert names["J"].shape == (1000, 6, 8)
    assert names["robot"].certificate().verified
    assert masked(str(names["robot"].certificate())) == masked(block("text"))


def test_the_page_of_conventions_has_fast_calls_that_run() -> None:
    page = (ROOT / "docs" / "conventions-used.md").read_text(encoding="utf-8")
    names: dict[str, Any] = {}
    exec(compile(block("python", page), "docs/conventions-used.md", "exec"), names)
    (line,) = names["robot"].certificate().lines
    assert (line.quantity, line.checked, line.unchecked) == ("jacobian", 203, 1901)


def test_every_command_has_a_row_on_the_page_of_commands() -> None:
    page = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `([a-z-]+)", page, re.MULTILINE)
    assert list(dict.fromkeys(rows)) == list(commands())


def test_the_front_page_names_a_command_for_each_of_its_four_people() -> None:
    shown = [words[0] for words, _ in transcripts()]
    assert shown == ["dh", "acceleration", "check", "export", "export"]


@pytest.mark.slow
def test_each_transcript_is_the_real_output(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    for words, expected in transcripts():
        for option in ("-o", "--check"):
            if option in words:
                words[words.index(option) + 1] = str(tmp_path / words[words.index(option) + 1])
        run = urdfkin(*words)
        printed = [masked(line) for line in (run.text + run.err).splitlines()]
        wanted = [masked(line) for line in expected if line != "..."]
        assert printed[: len(wanted)] == wanted, words
        assert len(printed) == len(wanted) or expected[-1] == "...", words
