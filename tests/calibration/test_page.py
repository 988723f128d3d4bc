"""Every example of docs/calibration.md is run, and prints what the page shows."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.running import urdfkin
from tests.dh.test_at_work_page import NAMED, pattern

PAGE = Path(__file__).parents[2] / "docs" / "calibration.md"
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```$", PAGE.read_text("utf-8"), re.DOTALL | re.MULTILINE)


def loose(text: str) -> str:
    """Without the blanks at the ends of lines."""
    return re.sub(r"[ \t]+$", "", text, flags=re.MULTILINE)


@pytest.mark.slow
def test_every_example_prints_what_the_page_shows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "160")
    commands = 0
    for kind, text in BLOCKS:
        if name := NAMED.match(text):
            Path(name[1]).write_text(text, "utf-8")
        if kind == "console":
            for example in re.split(r"^\$ ", text, flags=re.MULTILINE)[1:]:
                command, _, shown = example.partition("\n")
                done = urdfkin(*shlex.split(command)[1:])
                is_refused = shown.startswith("urdfkin: error")
                assert done.code == (3 if is_refused else 0), (command, done.err)
                printed = done.err if is_refused else done.text
                assert pattern(loose(shown)).search(loose(printed)), f"{command}\n{printed}"
                commands += 1
        elif kind == "python":
            env = {**os.environ, "PYTHONPATH": str(PAGE.parents[1])}
            done_here = subprocess.run(
                [sys.executable, "-W", "error", "-c", text],
                capture_output=True,
                text=True,
                check=False,
                env=env,
            )
            assert done_here.returncode == 0, done_here.stderr
    assert commands >= 6
    assert not Path("no.urdf").exists()


def test_all_blocks_of_the_page_are_run() -> None:
    assert all(kind in ("console", "python") or NAMED.match(text) for kind, text in BLOCKS)
