"""Hostile URDFs, and nothing hurts: no crash, no hang, no traceback, no wrong number in silence.

    python scripts/fuzz.py --mutants 20000 --robots 10000 --seed 0 --jobs 2
    python scripts/fuzz.py --family names --family followers --robots 5000

Mutants of the shipped robots are one family; the others are random whole robots, each odd in its own way:
names that look like ours, prefixes, versions, followers, lengths, angles, axes, limits, roots, or everything;
MJCF files with free bodies, equalities and default classes, which MuJoCo checks on its own; and the family
"tables", Denavit-Hartenberg tables with damaged headers: each is refused or compared.
The family "calibrations" has measured poses: good ones are calibrated; joint angles in degrees and shifted
rows of q are refused.

Each goes through `check` and `load`, and every quantity of it is computed in every reference, on bases near
and far, and held against Pinocchio, in a worker process that is restarted when it dies or takes too long.
Number i of a family depends on the seed, the family and i alone, so `--family names --only i` replays it.
What went wrong is kept as a file with the robot's bytes, beside a note that says what happened.
Exit 0: nothing did.
"""

from __future__ import annotations

import argparse
import collections
import contextlib
import json
import queue
import subprocess
import sys
import threading
import time
from collections.abc import Iterable, Sequence
from functools import cache
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))  # run from a checkout that is not installed

from scripts.fuzzing import GOOD, Case, calibrations, mjcf, robots, tables
from scripts.fuzzing.mutations import LARGEST, mutant
from urdfkin.urdf.catalogue import catalogue

#: What a worker answers when it is ready; the first use compiles, which may take a while.
READY, FIRST_WAIT = "ready", 300.0

MUTANTS = "mutants"
FAMILIES = (MUTANTS, *robots.FAMILIES, *mjcf.FAMILIES, tables.FAMILY, calibrations.FAMILY)


@cache
def files() -> list[Path]:
    """The robots that are mutated."""
    paths = (entry.path for entry in catalogue().values())
    return [path for path in paths if path.stat().st_size <= LARGEST]


def case(seed: int, family: str, number: int) -> Case:
    """One document of a family."""
    if family in mjcf.FAMILIES:
        return mjcf.robot(seed, family, number)
    if family == tables.FAMILY:
        return tables.sheet(seed, number)
    if family == calibrations.FAMILY:
        return calibrations.calibration(seed, number)
    return mutant(seed, number, files()) if family == MUTANTS else robots.robot(seed, family, number)


class Worker:
    """A process that judges one document after another; it may die."""

    def __init__(self, command: list[str], timeout: float) -> None:
        self.command, self.timeout = command, timeout
        self.process: subprocess.Popen[str] | None = None
        self.listener: threading.Thread | None = None
        self.lines: queue.Queue[str | None] = queue.Queue()

    def judge(self, family: str, number: int) -> tuple[str, str]:
        """The outcome's word and details; a death and a hang are outcomes, too."""
        if self.process is None:
            self.start()
        assert self.process is not None
        assert self.process.stdin is not None
        with contextlib.suppress(BrokenPipeError):  # dead already: the next line says so
            self.process.stdin.write(f"{family} {number}\n")
            self.process.stdin.flush()
        try:
            line = self.lines.get(timeout=self.timeout)
        except queue.Empty:
            self.stop()
            return "hangs", f"no answer in {self.timeout:g} s"
        if line is None:
            return "kills the process", f"exit status {self.stop()}"
        word, details = json.loads(line)
        return str(word), str(details)

    def start(self) -> None:
        """Start the process and wait until it has compiled what it needs."""
        self.process = subprocess.Popen(
            self.command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        )
        self.lines = queue.Queue()
        self.listener = threading.Thread(target=self._listen, args=(self.process, self.lines), daemon=True)
        self.listener.start()
        if self.lines.get(timeout=FIRST_WAIT) != READY:
            raise RuntimeError("the worker does not start")

    @staticmethod
    def _listen(process: subprocess.Popen[str], lines: queue.Queue[str | None]) -> None:
        assert process.stdout is not None
        for line in process.stdout:
            lines.put(line.strip())
        lines.put(None)

    def stop(self) -> int | None:
        """End the process, if it has not ended by itself; its exit status."""
        if self.process is None:
            return None
        process, self.process = self.process, None
        if process.poll() is None:
            process.kill()
        status = process.wait()
        if self.listener is not None:
            self.listener.join()
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                with contextlib.suppress(BrokenPipeError):
                    pipe.close()
        return status


def work(seed: int) -> None:
    """The worker's side: a family and a number in, an outcome out."""
    from scripts.fuzzing.judge import judge  # noqa: PLC0415  only the worker needs the compiler

    answers = sys.stdout
    sys.stdout = sys.stderr
    judges = {tables.FAMILY: tables.judge, calibrations.FAMILY: calibrations.judge}
    judge(Case("as it is", files()[0].read_bytes()))
    print(READY, file=answers, flush=True)
    for line in sys.stdin:
        family, number = line.split()
        outcome = judges.get(family, judge)(case(seed, family, int(number)))
        print(json.dumps([outcome.word, outcome.details]), file=answers, flush=True)


def fuzz(
    asked: Iterable[tuple[str, int]], seed: int, jobs: int, timeout: float, keep: Path
) -> collections.Counter[str]:
    """Judge documents by family and number; keep what went wrong; count the outcomes."""
    waiting: queue.SimpleQueue[tuple[str, int]] = queue.SimpleQueue()
    for each in asked:
        waiting.put(each)
    counts: collections.Counter[str] = collections.Counter()

    def run() -> None:
        worker = Worker([sys.executable, __file__, "--worker", "--seed", str(seed)], timeout)
        while True:
            try:
                family, number = waiting.get_nowait()
            except queue.Empty:
                worker.stop()
                return
            word, details = worker.judge(family, number)
            counts[word] += 1
            if word not in GOOD:
                made = case(seed, family, number)
                keep.mkdir(parents=True, exist_ok=True)
                name = f"{family}-{seed}-{number}"
                suffix = ".xml" if family in mjcf.FAMILIES else made.suffix
                (keep / f"{name}{suffix}").write_bytes(made.data)
                (keep / f"{name}.txt").write_text(f"{made.words}\n{word}\n{details}\n", "utf-8")
                print(f"{family} {number} ({made.what}): {word}", flush=True)

    threads = [threading.Thread(target=run) for _ in range(jobs)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return counts


def shares(families: Sequence[str], mutants: int, whole: int) -> list[tuple[str, int]]:
    """Family and number of so many mutants, and of so many whole robots in all, from each family in turn."""
    chosen = [family for family in families if family != MUTANTS]
    asked = [(MUTANTS, number) for number in range(mutants) if MUTANTS in families]
    return asked + [(chosen[i % len(chosen)], i // len(chosen)) for i in range(whole) if chosen]


def main() -> int:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--mutants", type=int, default=2000, help="how many mutants")
    parser.add_argument("--robots", type=int, default=2000, help="how many whole robots, of all families")
    parser.add_argument(
        "--family", action="append", choices=FAMILIES, help="only this one; may be repeated; all if left out"
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--timeout", type=float, default=30.0, help="seconds for one robot")
    parser.add_argument("--only", type=int, help="judge this number of the family alone")
    parser.add_argument(
        "--keep", type=Path, default=Path("artefacts/fuzz"), help="folder for what goes wrong"
    )
    parser.add_argument("--worker", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.worker:
        work(options.seed)
        return 0
    families = options.family or FAMILIES
    asked = shares(families, options.mutants, options.robots)
    if options.only is not None:
        if len(families) != 1:
            parser.error("--only needs one --family")
        asked = [(families[0], options.only)]
    start = time.perf_counter()
    counts = fuzz(asked, options.seed, options.jobs, options.timeout, options.keep)
    seconds, total = time.perf_counter() - start, sum(counts.values())
    print(f"{total} robots of {len(families)} families, seed {options.seed}, {seconds:.0f} s")
    for word, count in counts.most_common():
        print(f"{count:8d}  {word}")
    bad = total - sum(counts[word] for word in GOOD)
    print(f"{bad} went wrong" + (f": see {options.keep}" if bad else ""))
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
