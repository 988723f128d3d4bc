"""The operations that the page on speed speaks of are those that the recursion does."""

import json
import os
import subprocess
import sys
from pathlib import Path

import urdfkin
from scripts.benchmarking.operations import operations
from tests.counting import SUBJECTS

ROOT = Path(__file__).parents[1]


def test_multiplications_and_additions_are_as_many_as_the_recursion_does() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "tests.counting"],
        cwd=ROOT,
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    for (name, frame), counted in zip(SUBJECTS, json.loads(done.stdout), strict=True):
        robot = urdfkin.load(name, mimic=False)
        plan = robot.plan([robot.tree.frame_link(frame)])
        assert {quantity: operations(plan, quantity) for quantity in counted} == counted, name
