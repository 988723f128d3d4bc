"""Every example of docs/dh-at-work.md is run, and prints what the page shows."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from urdfkin.errors import UrdfkinError

PAGE = Path(__file__).parents[2] / "docs" / "dh-at-work.md"
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```$", PAGE.read_text("utf-8"), re.DOTALL | re.MULTILINE)
#: The first line of a file that the page shows has its name, as a comment of whatever kind.
NAMED = re.compile(r"\A(?:#|%|<!--)\s*(\S+\.\w+)")


def pattern(shown: str) -> re.Pattern[str]:
    """Output as the page shows it: `...` stands for anything."""
    return re.compile(".*?".join(map(re.escape, shown.strip("\n").split("..."))), re.DOTALL)


@pytest.mark.long
def test_every_example_prints_what_the_page_shows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from tests.cli.test_dh import run_any  # noqa: PLC0415  the page is read before the command line is

    monkeypatch.chdir(tmp_path)
    commands = 0
    for kind, text in BLOCKS:
        if kind == "console":
            for example in re.split(r"^\$ ", text, flags=re.MULTILINE)[1:]:
                command, _, shown = example.partition("\n")
                words, _, file = command.partition(" > ")
                try:
                    result = run_any(*shlex.split(words)[1:])
                    output = result.output
                except UrdfkinError as error:
                    output = f"urdfkin: error: {error}"
                if file:
                    Path(file).write_text(result.stdout, "utf-8")
                else:
                    assert pattern(shown).search(output), f"{command}\n{output}"
                commands += 1
        elif name := NAMED.match(text):
            Path(name[1]).write_text(text, "utf-8")
        elif kind == "python":
            done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=False)
            assert done.returncode == 0, done.stderr
            commands += 1
    assert commands >= 1


def test_all_blocks_of_the_page_are_run() -> None:
    assert all(kind in ("console", "python") or NAMED.match(text) for kind, text in BLOCKS)
