"""A command is one thread: what is parallel in it is asked for."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

#: The command, then how many threads there are.
COUNTED = """
import os, sys
from urdfkin.cli import main
sys.argv = ["urdfkin", "structure", "planar_two_link"]
try:
    main()
finally:
    print(len(os.listdir("/proc/self/task")))
"""


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="no /proc")
@pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="one processor")
def test_numpys_linear_algebra_starts_no_threads_in_a_command() -> None:
    plain = {name: value for name, value in os.environ.items() if name != "OPENBLAS_NUM_THREADS"}
    done = subprocess.run(
        [sys.executable, "-c", COUNTED], capture_output=True, text=True, check=True, env=plain
    )
    assert done.stdout.splitlines()[-1] == "1"
