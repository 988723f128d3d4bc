"""Make small mistakes (mutants) in the package, one at a time, and check that a test detects each.

    python scripts/mutate.py --sample 40 --seed 1          forty random mutants of the whole package
    python scripts/mutate.py validation dh/snapping        all mutants of two parts
    python scripts/mutate.py --only urdfkin.validation.error_stats:17
    python scripts/mutate.py --named                       the mutants of tests/attacks/named_slips.toml

The script runs the quick tests near the mutated file. With --slow it then runs the slow tests near this file,
and with --whole the whole test suite. The script prints every undetected mutant, and writes all results to
--json. Mutants that docs/mutation.md lists as harmless are skipped. Exit 0: all mutants are detected or
harmless. 1: some mutants are not detected, or there is no mutant. 2: a part does not exist.
"""

from __future__ import annotations

import argparse
import ast
import json
import multiprocessing
import os
import random
import runpy
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))  # import from this checkout without an installation

from scripts.mutating.operators import function_at, slips
from scripts.mutating.selection import ROOT, Named, argued, files, module_of, named_slips, near_tests

_NO_TESTS = 5  # pytest's exit code if no test was collected
_QUICK, _SLOW = "not slow and not browser", "slow and not browser"


@dataclass(frozen=True)
class Mutant:
    """A change of a file that introduces a mistake, which a test should detect.

    Attributes:
        name: Name for --only.
        file: The file.
        line: The line.
        what: The text before and after.
        place: The function of the mutant; it identifies the mutant even after other changes of the file.
    """

    name: str
    file: str
    line: int
    what: str
    place: str


@dataclass(frozen=True)
class Outcome:
    """The result of a mutant: `noticed` by a test, `survived`, `too slow`, or `argued` (harmless)."""

    mutant: Mutant
    word: str
    by: str
    seconds: float


def mutants(parts: list[str]) -> list[Mutant]:
    """Return all mutants of some parts of the package, or of the whole package."""
    return [mutant for path in files(parts) for mutant in mutants_of(path)]


def mutants_of(path: Path) -> list[Mutant]:
    """Return all mutants of a file."""
    tree, module = ast.parse(path.read_text(encoding="utf-8")), module_of(path)
    return [
        Mutant(
            f"{module}:{number}",
            str(path.relative_to(ROOT)),
            slip.line,
            slip.what,
            ".".join(filter(None, (module, function_at(tree, slip.line)))),
        )
        for number, slip in enumerate(slips(tree))
    ]


def judge(mutant: Mutant, *, timeout: float, slow: bool = False, whole: bool = False) -> Outcome:
    """Run the tests on a mutant until one fails."""
    begin = time.perf_counter()
    near = near_tests(ROOT / mutant.file)
    rounds = [(near, _QUICK), *([(near, _SLOW)] if slow else []), *([(["tests"], _QUICK)] if whole else [])]
    for tests, marks in rounds:
        word, by = _run({"URDFKIN_MUTANT": mutant.name}, [*tests, "-m", marks], timeout)
        if word != "survived":
            break
    return Outcome(mutant, word, by, round(time.perf_counter() - begin, 1))


def judge_named(slip: Named, *, timeout: float) -> Outcome:
    """Run the test that must fail for this mutant."""
    begin = time.perf_counter()
    texts = json.dumps([slip.before, slip.after])
    word, by = _run({"URDFKIN_MUTANT": slip.module, "URDFKIN_MUTANT_TEXTS": texts}, [slip.test], timeout)
    if word == "noticed" and not by.startswith(f"FAILED {slip.test}"):
        word = "not run"  # the test failed for another reason than the mutant
    file = slip.file.relative_to(ROOT).as_posix()
    mutant = Mutant(slip.claim, file, 0, f"{slip.before}  ->  {slip.after}", slip.module)
    return Outcome(mutant, word, by, round(time.perf_counter() - begin, 1))


#: A server that forks a process for each run of tests.
#: The server has already imported the foreign libraries, which takes longer than most tests.
_READY = multiprocessing.get_context("forkserver")
_READY.set_forkserver_preload(["numba", "pinocchio", "pytest"])


def _run(slip: dict[str, str], tests: list[str], timeout: float) -> tuple[str, str]:
    with tempfile.NamedTemporaryFile("r") as output:
        process = _READY.Process(target=_ask, args=(slip, tests, output.name))
        process.start()
        process.join(timeout)
        if process.exitcode is None:
            process.kill()
            process.join()
            return "too slow", ""
        lines = output.read().splitlines()
    if process.exitcode in (0, _NO_TESTS):
        return "survived", ""
    failed = (line for line in lines if line.startswith(("FAILED", "ERROR")))
    return "noticed", next(failed, lines[-1] if lines else "")[:300]


def _ask(slip: dict[str, str], tests: list[str], output: str) -> None:
    """Inject a mutant into this new process and its children, run the tests, and exit with pytest's code."""
    import pytest  # noqa: PLC0415  only in child processes

    hook = ROOT / "scripts" / "mutating" / "hook"
    paths = [str(hook), str(ROOT), os.environ.get("PYTHONPATH", "")]
    os.chdir(ROOT)
    os.environ |= slip | {
        "PYTHONPATH": os.pathsep.join(filter(None, paths)),
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    sys.dont_write_bytecode = True
    with open(output, "w") as to, open(os.devnull) as nothing:  # noqa: PTH123  as descriptors
        os.dup2(nothing.fileno(), 0)
        os.dup2(to.fileno(), 1)
        os.dup2(to.fileno(), 2)
    runpy.run_path(str(hook / "sitecustomize.py"))
    sys.exit(pytest.main(["-x", "-q", "--no-header", "-p", "no:cacheprovider", "--tb=no", *tests]))


def main() -> int:
    """Run the mutation tests from the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "parts", nargs="*", help="prefixes of paths below urdfkin/, such as dh/ (default: all files)"
    )
    parser.add_argument("--sample", type=int, help="number of randomly chosen mutants (default: all mutants)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument(
        "--timeout", type=float, default=300.0, help="time limit of one mutant's tests in seconds"
    )
    parser.add_argument(
        "--slow",
        action="store_true",
        help="also run the slow tests that mention the mutated module or belong to its package",
    )
    parser.add_argument("--whole", action="store_true", help="also run all tests that are not slow")
    parser.add_argument("--only", help="run only the mutant with this name")
    parser.add_argument(
        "--named", action="store_true", help="run only the mutants listed by name, each with its own test"
    )
    parser.add_argument("--count", action="store_true", help="print the number of mutants and exit")
    parser.add_argument("--json", type=Path, help="file for the results of all mutants")
    options = parser.parse_args()
    try:
        asks = _asks(options)
    except ValueError as error:
        parser.error(str(error))
    if not asks:
        print("no mutant was selected; --count prints the number of mutants", file=sys.stderr)
        return 1
    if options.count:
        print(len(asks))
        return 0
    outcomes = []
    with ThreadPoolExecutor(options.jobs) as pool:
        for outcome in pool.map(lambda ask: ask(), asks):
            outcomes.append(outcome)
            if outcome.word != "noticed":
                mutant = outcome.mutant
                print(
                    f"{outcome.word}: {mutant.place}:{mutant.line}: {mutant.what}  [{mutant.name}]",
                    flush=True,
                )
            if options.json is not None:
                options.json.write_text(json.dumps([asdict(o) for o in outcomes], indent=1), "utf-8")
    counts = Counter(outcome.word for outcome in outcomes)
    print(f"{len(outcomes)} mutants: " + ", ".join(f"{n} {word}" for word, n in counts.most_common()))
    return 0 if counts.keys() <= {"noticed", "argued"} else 1


def _asks(options: argparse.Namespace) -> list[Callable[[], Outcome]]:
    if options.named:
        modules = {module_of(path) for path in files(options.parts)}
        named = [slip for slip in named_slips() if not options.parts or slip.module in modules]
        return [partial(judge_named, slip, timeout=options.timeout) for slip in named]
    how = {"timeout": options.timeout, "slow": options.slow, "whole": options.whole}
    return [partial(_unless_argued, mutant, **how) for mutant in _chosen(options)]


def _chosen(options: argparse.Namespace) -> list[Mutant]:
    chosen = mutants(options.parts)
    if options.only is not None:
        return [mutant for mutant in chosen if mutant.name == options.only]
    if options.sample is not None and options.sample < len(chosen):
        return random.Random(options.seed).sample(chosen, options.sample)
    return chosen


def _unless_argued(mutant: Mutant, **how: Any) -> Outcome:
    if (mutant.place, mutant.what) in argued():
        return Outcome(mutant, "argued", "docs/mutation.md", 0.0)
    return judge(mutant, **how)


if __name__ == "__main__":
    sys.exit(main())
