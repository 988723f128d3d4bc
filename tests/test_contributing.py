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


def test_ci_runs_two_commands_that_pass_every_test_between_them() -> None:
    scripts = re.findall(r"^\./(scripts/\S+)$", (ROOT / ".ci/run").read_text("utf-8"), re.MULTILINE)
    assert scripts == ["scripts/test.sh", "scripts/test_long.sh"]
    chosen = [
        re.findall(r'pytest .*-m ("[^"]+"|\w+) "\$@"', (ROOT / name).read_text("utf-8")) for name in scripts
    ]
    assert chosen == [['"not long"'], ["long"]]


@pytest.mark.parametrize("broken", ["", "ruff", "python", "urdfkin", "mypy", "pytest"])
def test_the_command_of_the_tests_fails_if_one_of_its_parts_does(broken: str, tmp_path: Path) -> None:
    shutil.copy(ROOT / "scripts/test.sh", tmp_path)
    (tmp_path / "environment.sh").write_text("make_environment() { :; }\n")
    for name in ("ruff", "python", "urdfkin", "mypy", "pytest"):
        program = tmp_path / name
        program.write_text(f"#!/bin/sh\necho {name} was run\nexit {int(name == broken)}\n")
        program.chmod(0o755)
    path = {"PATH": f"{tmp_path}:/usr/bin:/bin"}
    done = subprocess.run([tmp_path / "test.sh"], env=path, capture_output=True, text=True, check=False)
    assert done.returncode == int(bool(broken)), done.stderr
    assert f"{broken or 'mypy'} was run" in done.stdout


def test_every_hook_runs_a_command_of_the_environment_and_needs_no_network() -> None:
    commands = re.findall(r"entry: \.venv/bin/(\S+)", HOOKS)
    assert {"ruff", "mypy", "urdfkin"} == set(commands)
    assert [name for name in commands if not (Path(sys.executable).parent / name).exists()] == []
    assert re.findall(r"repo: (\S+)", HOOKS) == ["local"]
    assert HOOKS.count("language: system") == HOOKS.count("- id: ")


@pytest.mark.parametrize("path", sorted((ROOT / "robots").glob("*.urdf")), ids=lambda path: path.stem)
def test_nothing_can_be_said_against_our_own_robots(path: Path) -> None:
    assert urdfkin.check(path) == []
