"""The benchmark runs, compares results first, and writes its figures."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent


@pytest.mark.slow
def test_the_quick_benchmark_finds_equal_results_and_writes_every_row(tmp_path: Path) -> None:
    file = tmp_path / "figures.json"
    command = [sys.executable, str(ROOT / "scripts/benchmark.py"), "--quick", "--json", str(file)]
    subprocess.run(command, check=True, cwd=ROOT, env=_environment(), capture_output=True)
    rows = json.loads(file.read_text())["rows"]
    assert {(row["robot"], row["quantity"]) for row in rows} == {
        (robot, quantity) for robot in ("panda", "talos") for quantity in ("jacobian", "acceleration")
    }
    assert all(row["median_ns"] > 0 for row in rows)


def _environment() -> dict[str, str]:
    import os  # noqa: PLC0415  only here

    return {**os.environ, "PYTHONPATH": str(ROOT)}
