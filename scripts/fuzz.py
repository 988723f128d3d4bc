"""Test urdfkin with random hostile files: no crash, no hang, and no wrong number without an error.

    python scripts/fuzz.py --mutants 20000 --robots 10000 --seed 0 --jobs 2
    python scripts/fuzz.py --family names --family mimic --robots 5000

There are several families of files:

| family | content |
|---|---|
| mutants | mutants of the shipped robots |
| names, prefixes, versions, ..., everything | random robots with one or several kinds of unusual content |
| MJCF | free bodies, equality constraints and default classes; MuJoCo checks them independently |

Each robot passes through `check` and `load`. Every quantity is computed in every reference frame, for bases
near to and far from the origin, and compared with Pinocchio. The tests run in a worker process, which is
restarted after a crash or a timeout. File i of a family depends only on the seed, the family and i, so
`--family names --only i` tests this file again. A file that causes a failure is stored, with a note about the
failure. Exit 0: no failures.
"""

import argparse
import collections
import multiprocessing
import os
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache, partial
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))  # import from this checkout without an installation

from scripts.fuzzing import PASSED, Case, mjcf, robots
from scripts.fuzzing.mutations import LARGEST, make_mutant
from urdfkin.urdf.catalogue import catalogue

READY, FIRST_WAIT = "ready", 300.0
_SPAWN = multiprocessing.get_context("spawn")

MUTANTS = "mutants"
FAMILIES = (MUTANTS, *robots.FAMILIES, *mjcf.FAMILIES)


@cache
def find_small_files() -> list[Path]:
    paths = (entry.path for entry in catalogue().values())
    return [path for path in paths if path.stat().st_size <= LARGEST]


def make_case(seed: int, family: str, number: int) -> Case:
    if family in mjcf.FAMILIES:
        return mjcf.make_model(seed, family, number)
    return (
        make_mutant(seed, number, find_small_files())
        if family == MUTANTS
        else robots.make_robot(seed, family, number)
    )


class Worker:
    def __init__(self, work: Callable[[Connection], None], timeout: float) -> None:
        self.work, self.timeout = work, timeout
        self.process: BaseProcess | None = None

    def evaluate(self, family: str, number: int) -> tuple[str, str]:
        """Test a case; a crash or timeout of the process is a result too."""
        if self.process is None:
            self.start()
        try:
            self.pipe.send((family, number))
            if not self.pipe.poll(self.timeout):
                self.stop(0.0)
                return "hangs", f"no answer in {self.timeout:g} s"
            word, details = self.pipe.recv()
        except (EOFError, OSError):  # The process has ended.
            return "kills the process", f"exit status {self.stop(5.0)}"
        return word, details

    def start(self) -> None:
        self.pipe, theirs = _SPAWN.Pipe()
        self.process = _SPAWN.Process(target=self.work, args=(theirs,), daemon=True)
        self.process.start()
        theirs.close()
        if not self.pipe.poll(FIRST_WAIT) or self.pipe.recv() != READY:
            raise RuntimeError("the worker process does not start")

    def stop(self, seconds: float) -> int | None:
        if (process := self.process) is None:
            return None
        self.pipe.close()
        process.join(seconds)
        process.kill()
        process.join()
        self.process = None
        return process.exitcode


def run_worker(seed: int, pipe: Connection) -> None:
    from scripts.fuzzing.evaluate import evaluate

    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 1)
    os.dup2(nothing, 2)
    evaluate(Case("as it is", find_small_files()[0].read_bytes()))
    pipe.send(READY)
    while True:
        outcome = evaluate(make_case(seed, *pipe.recv()))
        pipe.send((outcome.result, outcome.details))


def fuzz(
    cases: Iterable[tuple[str, int]], seed: int, jobs: int, timeout: float, keep: Path
) -> collections.Counter[str]:
    waiting = iter(list(cases))
    counts: collections.Counter[str] = collections.Counter()

    def run(_: int) -> None:
        worker = Worker(partial(run_worker, seed), timeout)
        for family, number in waiting:
            word, details = worker.evaluate(family, number)
            counts[word] += 1
            if word not in PASSED:
                case = make_case(seed, family, number)
                keep.mkdir(parents=True, exist_ok=True)
                suffix = ".xml" if family in mjcf.FAMILIES else ".urdf"
                (keep / f"{family}-{seed}-{number}{suffix}").write_bytes(case.data)
                note = f"{case.description}\n{word}\n{details}\n"
                (keep / f"{family}-{seed}-{number}.txt").write_text(note, "utf-8")
                print(f"{family} {number} ({case.name}): {word}", flush=True)
        worker.stop(0.0)

    with ThreadPoolExecutor(jobs) as pool:
        list(pool.map(run, range(jobs)))
    return counts


def list_cases(families: Sequence[str], mutants: int, whole: int) -> list[tuple[str, int]]:
    chosen = [family for family in families if family != MUTANTS]
    mutant_cases = [(MUTANTS, number) for number in range(mutants) if MUTANTS in families]
    return mutant_cases + [(chosen[i % len(chosen)], i // len(chosen)) for i in range(whole) if chosen]


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
    options = parser.parse_args()
    families = options.family or FAMILIES
    cases = list_cases(families, options.mutants, options.robots)
    if options.only is not None:
        if len(families) != 1:
            parser.error("--only needs exactly one --family")
        cases = [(families[0], options.only)]
    start = time.perf_counter()
    counts = fuzz(cases, options.seed, options.jobs, options.timeout, options.keep)
    seconds, total = time.perf_counter() - start, sum(counts.values())
    print(f"{total} robots of {len(families)} families, seed {options.seed}, {seconds:.0f} s")
    for word, count in counts.most_common():
        print(f"{count:8d}  {word}")
    bad = total - sum(counts[word] for word in PASSED)
    print(f"{bad} robots caused a failure" + (f": see {options.keep}" if bad else ""))
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
