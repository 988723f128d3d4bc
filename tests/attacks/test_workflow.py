"""The example workflow does in CI what its page says, and what it names exists."""

import os
import re
import subprocess
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
yaml = pytest.importorskip("yaml")


def steps() -> list[dict[str, Any]]:
    workflow = yaml.safe_load((ROOT / "docs/examples/robots.yml").read_text("utf-8"))
    found: list[dict[str, Any]] = workflow["jobs"]["robots"]["steps"]
    return found


def index(words: str) -> int:
    (found,) = (i for i, step in enumerate(steps()) if words in str(step.get("run", step.get("uses"))))
    return found


def test_what_follows_the_first_check_runs_although_it_or_validation_failed() -> None:
    later = steps()[index("urdfkin check --strict") + 1 :]
    assert len(later) >= 9
    for step in later:
        assert re.search(r"!cancelled\(\)|always\(\)", step["if"]), step


def test_the_comparison_needs_nothing_but_the_two_files_it_compares() -> None:
    condition = steps()[index("urdfkin compare")]["if"]
    assert "hashFiles('main.json')" in condition
    assert "hashFiles('results.json')" in condition


def test_the_key_of_the_kernels_names_all_that_they_depend_on() -> None:
    cache = steps()[index("actions/cache@")]
    assert "steps.kernels.outputs.key" in cache["with"]["key"]
    told = steps()[index("pip freeze")]
    assert told["id"] == "kernels"
    assert "/proc/cpuinfo" in told["run"]
    assert index("pip install") < index("pip freeze") < index("actions/cache@") < index("urdfkin validate")


@pytest.mark.slow
def test_the_command_that_makes_the_key_makes_one(tmp_path: Path) -> None:
    command = steps()[index("pip freeze")]["run"]
    output = tmp_path / "output"
    environ = {**os.environ, "GITHUB_OUTPUT": str(output)}
    subprocess.run(["bash", "-euo", "pipefail", "-c", command], env=environ, check=True)
    assert re.fullmatch(r"key=[0-9a-f]{16}\n", output.read_text())


def test_no_page_names_a_tag_that_may_not_exist() -> None:
    for page in ("docs/ci.md", ".pre-commit-hooks.yaml", "README.md"):
        assert not re.search(r"rev: v?\d", (ROOT / page).read_text("utf-8")), page
