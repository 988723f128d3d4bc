"""Property tests have the same examples in every run, independent of the imported modules."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]

DRAWS = r"""
import sys
import tests.conftest
from hypothesis import given, strategies as st
for name in sys.argv[1:]:
    __import__(name)
drawn = []
@given(st.floats(-1e9, 1e9), st.integers(), st.text(max_size=9), st.binary(max_size=9))
def draw(number, integer, text, data):
    drawn.append(repr([number, integer, text, data]))
draw()
print(*drawn, sep="\n")
"""


def draws(folder: Path, *imported: str) -> str:
    script = folder / "draws.py"
    script.write_text(DRAWS, encoding="utf-8")
    (folder / "ours.py").write_text(
        f"FLOATS = {[k / 3.7e-3 for k in range(1, 300)]}\nINTEGERS = {list(range(1000, 1300))}\n"
        f"TEXTS = {[f'text {k}' for k in range(99)]}\nBYTES = {[b'%d' % k for k in range(100, 200)]}\n",
        encoding="utf-8",
    )
    path = os.pathsep.join([str(folder), str(ROOT)])
    how: dict[str, Any] = {"cwd": ROOT, "env": {**os.environ, "PYTHONPATH": path}, "text": True}
    return str(subprocess.check_output([sys.executable, str(script), *imported], **how))


@pytest.mark.slow
def test_examples_do_not_depend_on_the_modules_that_are_imported(tmp_path: Path) -> None:
    alone = draws(tmp_path)
    assert len(alone.splitlines()) == 100
    assert draws(tmp_path, "ours", "urdfkin.kinematics.inputs", "urdfkin.cli") == alone
