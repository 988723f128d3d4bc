"""What newcomers are told exists: files of the worked examples, targets of make, commands of hooks."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import urdfkin

ROOT = Path(__file__).parents[1]
GUIDE = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
HOOKS = (ROOT / ".pre-commit-config.yaml").read_text("utf-8")
TARGETS = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE))


def test_every_file_that_the_guide_names_is_there() -> None:
    named = re.findall(r"(?:urdfkin|tests|scripts|docs)/[\w/.-]*[\w/]", GUIDE)
    assert len(named) > 30
    assert [path for path in named if not (ROOT / path).exists()] == []


def test_every_target_that_the_guide_names_is_one() -> None:
    lines = re.findall(
        r"`?make ((?:[a-z]+ ?)+)", "\n".join(re.findall(r"^make .*|`make .*?`", GUIDE, re.MULTILINE))
    )
    named = {word for line in lines for word in line.split()}
    assert {"setup", "fast", "test"} <= named <= TARGETS


@pytest.mark.skipif(shutil.which("make") is None, reason="make is a convenience")
def test_make_understands_its_file() -> None:
    for target in sorted(TARGETS):
        subprocess.run(["make", "--dry-run", target], cwd=ROOT, check=True, capture_output=True)


def test_every_hook_runs_a_command_of_the_environment_and_needs_no_network() -> None:
    commands = re.findall(r"entry: \.venv/bin/(\S+)", HOOKS)
    assert {"ruff", "mypy", "urdfkin"} == set(commands)
    assert [name for name in commands if not (Path(sys.executable).parent / name).exists()] == []
    assert re.findall(r"repo: (\S+)", HOOKS) == ["local"]
    assert HOOKS.count("language: system") == HOOKS.count("- id: ")


@pytest.mark.parametrize("path", sorted((ROOT / "robots").glob("*.urdf")), ids=lambda path: path.stem)
def test_nothing_can_be_said_against_our_own_robots(path: Path) -> None:
    assert urdfkin.check(path) == []
