"""Measure the processor time until a first result, and write this time into docs/performance.md.

    python scripts/measure_start.py            # measure, write the table; exit 1 if a time is too long
    python scripts/measure_start.py --rounds 3

Each row is a new process, whose time is compared with the time of `import numpy, pinocchio` in the same
round. The ratio is the quotient of the two medians over all rounds. Other load of the machine slows the two
processes equally, so it hardly changes the ratio. The bytecode of all modules already exists, as after an
installation. A fresh cache is an empty folder for compiled kernels.
"""

from __future__ import annotations

import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))  # import from this checkout without an installation

from scripts.pages import DOCS, insert
from scripts.pages import table as markdown

ROOT = Path(__file__).parents[1]
PAGE = DOCS / "performance.md"
_COMMAND = "import sys; sys.argv[0] = 'urdfkin'; from urdfkin.cli import main; main()"
_NOTEBOOK = "import sys, urdfkin; r = urdfkin.load(sys.argv[1]); r.jacobian(r.neutral(), r.tip_frame)"
BASE = ("-c", "import numpy, pinocchio")


@dataclass(frozen=True)
class Row:
    what: str  # name of the process on the page
    #: Arguments of the interpreter; ROBOT stands for a URDF that is not in the catalogue.
    words: tuple[str, ...]
    #: Limit of the time, in multiples of the time of `import numpy, pinocchio`. None: the time has no limit.
    most: float | None = None
    fresh: bool = False  # whether the process starts with an empty kernel cache
    seconds: list[float] = field(default_factory=list, compare=False)

    @property
    def median(self) -> float:
        return statistics.median(self.seconds)


def rows() -> list[Row]:
    """Return the rows of the page; the first row is the denominator of all ratios."""
    jacobian = ("-c", _COMMAND, "jacobian", "ROBOT", "--q", "random")
    return [
        Row("`import numpy, pinocchio`", BASE),
        Row("`urdfkin --help`", ("-c", _COMMAND, "--help")),
        Row("`urdfkin info MY.urdf`", ("-c", _COMMAND, "info", "ROBOT"), 1.3),
        Row("`urdfkin jacobian MY.urdf --q random`", jacobian, 2.0),
        Row("the same with a fresh cache", jacobian, 2.5, fresh=True),
        Row("`urdfkin same panda panda`", ("-c", _COMMAND, "same", "panda", "panda"), 2.5),
        Row("`import urdfkin`, `load`, `jacobian` in Python", ("-c", _NOTEBOOK, "ROBOT"), 2.0),
        Row("the same with a fresh cache", ("-c", _NOTEBOOK, "ROBOT"), 2.5, fresh=True),
    ]


def seconds(words: Sequence[str], cache: str | None) -> float:
    """Return the processor time of a process and its children; `cache` is a folder for kernels."""
    environ = {name: x for name, x in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    environ["PYTHONPATH"] = str(ROOT)
    if cache is not None:
        environ |= {"XDG_CACHE_HOME": cache, "NUMBA_CACHE_DIR": ""}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, *words], env=environ, check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def measured(rounds: int, folder: Path) -> list[Row]:
    """Return the rows with their times; an additional first round writes the bytecode and does not count."""
    found, robot = rows(), folder / "MY.urdf"
    robot.write_bytes((ROOT / "robots" / "elbow.urdf").read_bytes())
    for k in range(rounds + 1):
        for i, row in enumerate(found):
            words = [str(robot) if word == "ROBOT" else word for word in row.words]
            taken = seconds(words, str(folder / f"{k}-{i}") if row.fresh else None)
            if k:
                row.seconds.append(taken)
    return found


def table(found: Sequence[Row]) -> str:
    base = found[0].median
    rows = [
        (row.what, f"{row.median:.2f}", f"{row.median / base:.2f}", f"{row.most:.1f}" if row.most else "")
        for row in found
    ]
    return markdown(("", "processor time, s", "times `import numpy, pinocchio`", "at most"), rows, left=1)


def missed(found: Sequence[Row]) -> list[str]:
    base = found[0].median
    return [row.what for row in found if row.most is not None and row.median > row.most * base]


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--rounds", type=int, default=11, help="number of processes for each row")
    given = parser.parse_args(words)
    with tempfile.TemporaryDirectory() as folder:
        found = measured(given.rounds, Path(folder))
    figures = table(found)
    print(figures)
    insert(PAGE, start=figures)
    for what in missed(found):
        print(f"too slow: {what}", file=sys.stderr)
    return int(bool(missed(found)))


if __name__ == "__main__":
    sys.exit(main())
