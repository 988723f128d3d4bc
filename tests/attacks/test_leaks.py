"""Robots that are loaded, computed with and let go leave nothing behind: no memory, no file, no object."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from scripts.leaks import PARTS

ROBOTS = 300


@pytest.mark.long
def test_three_hundred_robots_leave_no_object_no_descriptor_and_no_memory() -> None:
    """In a process of its own; `python -m scripts.leaks 10000` is the same for longer."""
    done = subprocess.run(
        [sys.executable, "-m", "scripts.leaks", str(ROBOTS)],
        capture_output=True,
        text=True,
        check=True,
        cwd=Path(__file__).parents[2],
    )
    parts = json.loads(done.stdout)
    assert len(parts) == PARTS
    # The first parts fill caches, which have ends. Then one object a robot would be 180 more.
    second, last = parts[1], parts[-1]
    assert last["descriptors"] == second["descriptors"]
    assert last["objects"] - second["objects"] < 60
    assert last["MiB"] - second["MiB"] < 8.0
