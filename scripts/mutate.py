"""Make small slips in the package, one at a time, and see whether a test fails for each.

    python scripts/mutate.py --sample 40 --seed 1          forty slips, drawn from the whole package
    python scripts/mutate.py verification validation       every slip of two parts
    python scripts/mutate.py --only urdfkin.validation.tally:17

The tests that are near the file are asked first, then, with --whole, the whole suite. Every slip that nobody
noticed is printed, and kept in --json with the others. Exit 0: all were noticed; 1: some were not.
"""

from __future__ import annotations

import argparse
import ast
import json
import os
import random
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))  # run from a checkout that is not installed

from scripts.mutating.operators import slips
from scripts.mutating.selection import ROOT, files, module_of, near_tests

_NO_TESTS = 5  # pytest's exit code where nothing was collected


@dataclass(frozen=True)
class Mutant:
    """A slip in a file; `name` replays it with --only."""

    name: str
    file: str
    line: int
    what: str


@dataclass(frozen=True)
class Outcome:
    """What the tests said: `noticed` with the test that did, `survived`, or `too slow`."""

    mutant: Mutant
    word: str
    by: str
    seconds: float


def mutants(parts: list[str]) -> list[Mutant]:
    """Every mutant of some parts of the package, or of all."""
    return [
        Mutant(f"{module_of(path)}:{number}", str(path.relative_to(ROOT)), slip.line, slip.what)
        for path in files(parts)
        for number, slip in enumerate(slips(ast.parse(path.read_text(encoding="utf-8"))))
    ]


def judge(mutant: Mutant, *, whole: bool, timeout: float) -> Outcome:
    """Run the tests on a mutant until one fails."""
    begin = time.perf_counter()
    near = near_tests(ROOT / mutant.file)
    for tests in [near, *([["tests"]] if whole else [])]:
        word, by = _run(mutant, tests, timeout)
        if word != "survived":
            break
    return Outcome(mutant, word, by, round(time.perf_counter() - begin, 1))


def _run(mutant: Mutant, tests: list[str], timeout: float) -> tuple[str, str]:
    paths = [str(ROOT / "scripts" / "mutating" / "hook"), str(ROOT), os.environ.get("PYTHONPATH", "")]
    command = [sys.executable, "-m", "pytest", "-x", "-q", "--no-header", "-p", "no:cacheprovider"]
    with tempfile.TemporaryFile("w+") as said:
        try:
            done = subprocess.run(
                [*command, "--tb=no", "-m", "not slow and not browser", *tests],
                cwd=ROOT,
                env={
                    **os.environ,
                    "URDFKIN_MUTANT": mutant.name,
                    "PYTHONPATH": os.pathsep.join(filter(None, paths)),
                    "PYTHONDONTWRITEBYTECODE": "1",
                },
                stdin=subprocess.DEVNULL,
                stdout=said,
                stderr=subprocess.STDOUT,
                timeout=timeout,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return "too slow", ""
        said.seek(0)
        lines = said.read().splitlines()
    if done.returncode in (0, _NO_TESTS):
        return "survived", ""
    failed = (line for line in lines if line.startswith(("FAILED", "ERROR")))
    return "noticed", next(failed, lines[-1] if lines else "")[:200]


def main() -> int:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("parts", nargs="*", help="beginnings of paths below urdfkin/; none for all")
    parser.add_argument("--sample", type=int, help="draw so many instead of all")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--timeout", type=float, default=300.0, help="seconds for one mutant's tests")
    parser.add_argument(
        "--whole", action="store_true", help="ask the whole suite where the near tests are silent"
    )
    parser.add_argument("--only", help="this mutant alone")
    parser.add_argument("--count", action="store_true", help="say how many there are, and end")
    parser.add_argument("--json", type=Path, help="keep what happened to each")
    options = parser.parse_args()
    chosen = mutants(options.parts)
    if options.only is not None:
        chosen = [mutant for mutant in chosen if mutant.name == options.only]
    elif options.sample is not None and options.sample < len(chosen):
        chosen = random.Random(options.seed).sample(chosen, options.sample)
    if options.count:
        print(len(chosen))
        return 0
    outcomes = []
    with ThreadPoolExecutor(options.jobs) as pool:
        judged = pool.map(lambda mutant: judge(mutant, whole=options.whole, timeout=options.timeout), chosen)
        for outcome in judged:
            outcomes.append(outcome)
            if outcome.word != "noticed":
                mutant = outcome.mutant
                print(
                    f"{outcome.word}: {mutant.file}:{mutant.line}: {mutant.what}  [{mutant.name}]", flush=True
                )
            if options.json is not None:
                options.json.write_text(json.dumps([asdict(o) for o in outcomes], indent=1), "utf-8")
    missed = sum(outcome.word != "noticed" for outcome in outcomes)
    print(f"{len(outcomes)} mutants, {len(outcomes) - missed} noticed, {missed} not")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
