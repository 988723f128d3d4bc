"""Measure the processor time until a first result, and write this time into docs/performance.md.

    python scripts/measure_start.py            # measure, write the table; exit 1 if a time is too long
    python scripts/measure_start.py --rounds 3

Each row of the table is a command that runs in a new process. In each round, every command runs once. The
ratio of a row is the command's median time, divided by the median time of `import numpy, pinocchio`. Other
load of the machine increases both times, but hardly changes the ratio. The bytecode of all modules already
exists, as after an installation. A fresh cache is an empty folder for compiled kernels.
"""

import argparse
import math
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from scripts.pages import DOCS, table, update_page

ROOT = Path(__file__).parents[1]
PAGE = DOCS / "performance.md"
_COMMAND = "import sys; sys.argv[0] = 'urdfkin'; from urdfkin.cli import main; main()"
_NOTEBOOK = "import sys, urdfkin; r = urdfkin.load(sys.argv[1]); r.jacobian(r.neutral(), r.tip_frame)"


@dataclass(frozen=True)
class Row:
    name: str  # label of the row on the page
    arguments: tuple[str, ...]  # arguments of `python`; the path of a URDF file replaces ROBOT
    max_ratio: float = math.inf  # time limit, divided by the time of `import numpy, pinocchio`
    empty_cache: bool = False  # Whether the process starts without compiled kernels on disk.


_JACOBIAN = ("-c", _COMMAND, "jacobian", "ROBOT", "--q", "random")
#: All ratios refer to the time of the first row.
ROWS = (
    Row("`import numpy, pinocchio`", ("-c", "import numpy, pinocchio")),
    Row("`urdfkin --help`", ("-c", _COMMAND, "--help")),
    Row("`urdfkin info MY.urdf`", ("-c", _COMMAND, "info", "ROBOT"), 1.3),
    Row("`urdfkin jacobian MY.urdf --q random`", _JACOBIAN, 2.0),
    Row("`urdfkin jacobian MY.urdf --q random`, empty kernel cache", _JACOBIAN, 2.5, empty_cache=True),
    Row("`urdfkin same panda panda`", ("-c", _COMMAND, "same", "panda", "panda"), 2.5),
    Row("`import urdfkin`, `load`, `jacobian` in Python", ("-c", _NOTEBOOK, "ROBOT"), 2.0),
    Row(
        "`import urdfkin`, `load`, `jacobian` in Python, empty kernel cache",
        ("-c", _NOTEBOOK, "ROBOT"),
        2.5,
        empty_cache=True,
    ),
)


def measure_seconds(words: Sequence[str], cache: Path | None) -> float:
    environ = {name: x for name, x in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    environ["PYTHONPATH"] = str(ROOT)
    if cache is not None:
        environ |= {"XDG_CACHE_HOME": str(cache), "NUMBA_CACHE_DIR": ""}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, *words], env=environ, check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def measure_medians(rounds: int, folder: Path) -> list[float]:
    """Return each row's median processor time (s).

    The first round does not count, because Python compiles the modules to bytecode.
    """
    robot = folder / "MY.urdf"
    robot.write_bytes((ROOT / "robots" / "elbow.urdf").read_bytes())
    seconds: list[list[float]] = [[] for _ in ROWS]
    for k in range(rounds + 1):
        for i, row in enumerate(ROWS):
            words = [str(robot) if word == "ROBOT" else word for word in row.arguments]
            seconds[i].append(measure_seconds(words, folder / f"{k}-{i}" if row.empty_cache else None))
    return [statistics.median(times[1:]) for times in seconds]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--rounds", type=int, default=11, help="number of processes for each row")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        medians = measure_medians(options.rounds, Path(folder))
    rows = [
        (
            row.name,
            f"{x:.2f}",
            f"{x / medians[0]:.2f}",
            f"{row.max_ratio:.1f}" if math.isfinite(row.max_ratio) else "",
        )
        for row, x in zip(ROWS, medians, strict=True)
    ]
    heads = ("", "processor time, s", "ratio to the first row", "allowed ratio")
    figures = table(heads, rows, left=1)
    print(figures)
    update_page(PAGE, start=figures)
    slow = [row.name for row, x in zip(ROWS, medians, strict=True) if x > row.max_ratio * medians[0]]
    print(*(f"too slow: {name}" for name in slow), sep="\n", file=sys.stderr)
    return int(bool(slow))


if __name__ == "__main__":
    sys.exit(main())
