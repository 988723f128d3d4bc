"""The front page is true: its example runs, its commands exist, its transcript is what one sees."""

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from urdfkin.cli import commands

README = (Path(__file__).parent.parent / "README.md").read_text(encoding="utf-8")


def block(language: str, place: int = 0) -> str:
    """A fenced block of a language, the first unless told."""
    blocks: list[str] = re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)
    return blocks[place]


def masked(text: str) -> str:
    """Without the disagreements, which differ between machines."""
    return re.sub(r"worst \S+|\S+% of|Pinocchio \S+", "", text).strip()


def test_the_smallest_example_runs_and_is_verified() -> None:
    names: dict[str, Any] = {}
    exec(compile(block("python"), "README.md", "exec"), names)
    assert names["J"].shape == (1000, 6, 8)
    assert names["robot"].certificate().verified
    assert masked(str(names["robot"].certificate())) == masked(block("text"))
    exec(compile(block("python", 1), "README.md", "exec"), names)
    lines = {line.quantity: line for line in names["robot"].certificate().lines}
    assert (lines["jacobian"].checked, lines["jacobian"].unchecked) == (1203, 1901)


def test_every_command_stands_on_the_front_page() -> None:
    assert [name for name in commands() if f"`{name}" not in README and f"urdfkin {name}" not in README] == []


@pytest.mark.slow
def test_the_transcript_is_what_one_sees() -> None:
    command, *expected = block("console").splitlines()
    words = command.removeprefix("$ urdfkin ").split()
    run = subprocess.run(
        [sys.executable, "-m", "urdfkin", *words], capture_output=True, text=True, check=True
    )
    # The table is the same on every machine; the disagreement in the last line is not.
    assert [line.rstrip() for line in run.stdout.splitlines()[:5]] == expected[:5]
    assert run.stdout.splitlines()[5].startswith("verified by Pinocchio")
