"""Test with random hostile files that urdfkin never crashes, hangs or returns an unreported wrong number.

    python scripts/fuzz.py --mutants 20000 --robots 10000 --seed 0 --jobs 2
    python scripts/fuzz.py --family names --family followers --robots 5000

There are several families of files:

| family | content |
|---|---|
| mutants | mutants of the shipped robots |
| names, prefixes, versions, ..., everything | random robots with one kind of unusual content, or all kinds |
| MJCF | free bodies, equalities and default classes; MuJoCo checks them independently |

Each robot passes through `check` and `load`. Every quantity is computed in every reference frame, for bases
near to and far from the origin, and compared with Pinocchio. The tests run in a worker process, which is
restarted after a crash or a timeout. File i of a family depends only on the seed, the family and i, so
`--family names --only i` tests this file again. A file that causes a failure is stored, with a note about the
failure. Exit 0: no failures.
"""

from __future__ import annotations

import argparse
import collections
import contextlib
import json
import select
import subprocess
import sys
import time
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))  # import from this checkout without an installation

from scripts.fuzzing import GOOD, Case, mjcf, robots
from scripts.fuzzing.mutations import LARGEST, mutant
from urdfkin.urdf.catalogue import catalogue

READY, FIRST_WAIT = "ready", 300.0

MUTANTS = "mutants"
FAMILIES = (MUTANTS, *robots.FAMILIES, *mjcf.FAMILIES)


@cache
def files() -> list[Path]:
    paths = (entry.path for entry in catalogue().values())
    return [path for path in paths if path.stat().st_size <= LARGEST]


def case(seed: int, family: str, number: int) -> Case:
    if family in mjcf.FAMILIES:
        return mjcf.robot(seed, family, number)
    return mutant(seed, number, files()) if family == MUTANTS else robots.robot(seed, family, number)


class Worker:
    """A process that tests one document after another, and may crash."""

    def __init__(self, command: list[str], timeout: float) -> None:
        self.command, self.timeout = command, timeout
        self.process: subprocess.Popen[str] | None = None

    def judge(self, family: str, number: int) -> tuple[str, str]:
        """Test a document; return the outcome and its details; a crash and a hang are possible outcomes."""
        process = self.process or self.start()
        assert process.stdin is not None
        with contextlib.suppress(BrokenPipeError):  # the process has ended, which the next line detects
            print(family, number, file=process.stdin, flush=True)
        try:
            line = _line(process, self.timeout)
        except TimeoutError:
            self.stop()
            return "hangs", f"no answer in {self.timeout:g} s"
        if not line:
            return "kills the process", f"exit status {self.stop()}"
        word, details = json.loads(line)
        return str(word), str(details)

    def start(self) -> subprocess.Popen[str]:
        pipes: dict[str, Any] = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
        self.process = subprocess.Popen(self.command, **pipes, stderr=subprocess.DEVNULL, text=True)
        if _line(self.process, FIRST_WAIT).strip() != READY:
            raise RuntimeError("the worker process does not start")
        return self.process

    def stop(self) -> int | None:
        if self.process is None:
            return None
        process, self.process = self.process, None
        if process.poll() is None:
            process.kill()
        with contextlib.suppress(BrokenPipeError), process:  # closes the pipes and waits
            pass
        return process.returncode


def _line(process: subprocess.Popen[str], seconds: float) -> str:
    """Return the next line of a process, "" if it has ended; raise TimeoutError if there is none in time."""
    assert process.stdout is not None
    if not select.select([process.stdout], [], [], seconds)[0]:
        raise TimeoutError
    return process.stdout.readline()


def work(seed: int) -> None:
    """Run as the worker process: read a family and a number, write the outcome, and repeat."""
    from scripts.fuzzing.judge import judge  # noqa: PLC0415  only the worker needs the compiler

    answers = sys.stdout
    sys.stdout = sys.stderr
    judge(Case("as it is", files()[0].read_bytes()))
    print(READY, file=answers, flush=True)
    for line in sys.stdin:
        family, number = line.split()
        outcome = judge(case(seed, family, int(number)))
        print(json.dumps([outcome.word, outcome.details]), file=answers, flush=True)


def fuzz(
    asked: Iterable[tuple[str, int]], seed: int, jobs: int, timeout: float, keep: Path
) -> collections.Counter[str]:
    waiting = iter(list(asked))
    counts: collections.Counter[str] = collections.Counter()

    def run(_: int) -> None:
        worker = Worker([sys.executable, __file__, "--worker", "--seed", str(seed)], timeout)
        for family, number in waiting:  # all threads take from the same iterator
            word, details = worker.judge(family, number)
            counts[word] += 1
            if word not in GOOD:
                made = case(seed, family, number)
                keep.mkdir(parents=True, exist_ok=True)
                name = f"{family}-{seed}-{number}"
                suffix = ".xml" if family in mjcf.FAMILIES else ".urdf"
                (keep / f"{name}{suffix}").write_bytes(made.data)
                (keep / f"{name}.txt").write_text(f"{made.words}\n{word}\n{details}\n", "utf-8")
                print(f"{family} {number} ({made.what}): {word}", flush=True)

        worker.stop()

    with ThreadPoolExecutor(jobs) as pool:
        list(pool.map(run, range(jobs)))
    return counts


def shares(families: Sequence[str], mutants: int, whole: int) -> list[tuple[str, int]]:
    """Return (family, number) of all mutants and of all random robots, which alternate between families."""
    chosen = [family for family in families if family != MUTANTS]
    asked = [(MUTANTS, number) for number in range(mutants) if MUTANTS in families]
    return asked + [(chosen[i % len(chosen)], i // len(chosen)) for i in range(whole) if chosen]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    option = parser.add_argument
    option("--mutants", type=int, default=2000, help="number of mutated files to test")
    option("--robots", type=int, default=2000, help="number of random robots, over all families")
    option("--family", action="append", choices=FAMILIES, help="repeatable (default: all families)")
    option("--seed", type=int, default=0)
    option("--jobs", type=int, default=1)
    option("--timeout", type=float, default=30.0, help="time limit of one robot in seconds")
    option("--only", type=int, help="test only the robot with this number in its family")
    option("--keep", type=Path, default=Path("artefacts/fuzz"), help="folder for files that cause a failure")
    option("--worker", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.worker:
        work(options.seed)
        return 0
    families = options.family or FAMILIES
    asked = shares(families, options.mutants, options.robots)
    if options.only is not None:
        if len(families) != 1:
            parser.error("--only needs exactly one --family")
        asked = [(families[0], options.only)]
    start = time.perf_counter()
    counts = fuzz(asked, options.seed, options.jobs, options.timeout, options.keep)
    seconds, total = time.perf_counter() - start, sum(counts.values())
    print(f"{total} robots of {len(families)} families, seed {options.seed}, {seconds:.0f} s")
    for word, count in counts.most_common():
        print(f"{count:8d}  {word}")
    bad = total - sum(counts[word] for word in GOOD)
    print(f"{bad} robots caused a failure" + (f": see {options.keep}" if bad else ""))
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
