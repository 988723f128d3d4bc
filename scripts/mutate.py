"""Make small mistakes (mutants) in the package, one at a time, and check that a test detects each.

    python scripts/mutate.py --sample 40 --seed 1          forty random mutants of the whole package
    python scripts/mutate.py validation dh/snapping        all mutants of two parts
    python scripts/mutate.py --only urdfkin.validation.error_stats:17
    python scripts/mutate.py --named                       the mutants of tests/attacks/named_slips.toml

The script runs the quick tests near the mutated file. With --slow it then runs the slow tests near this file,
and with --whole the whole test suite. The script prints every undetected mutant. Mutants that
docs/mutation.md lists as harmless are skipped. In the past, no test detected the named mutants. A named
mutant replaces a text of a file, and one given test must now fail. Exit 0: all mutants are detected or
harmless. 1: some mutants are not detected, or there is no mutant. 2: a part does not exist.
"""

from __future__ import annotations

import argparse
import ast
import json
import multiprocessing
import os
import random
import re
import runpy
import sys
import tempfile
import tomllib
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))  # import from this checkout without an installation

from scripts.mutating.operators import function_at, slips

ROOT = Path(__file__).resolve().parents[1]
PACKAGE, TESTS = ROOT / "urdfkin", ROOT / "tests"
_NO_TESTS = 5  # pytest's exit code if no test was collected
_QUICK, _SLOW = "not slow and not browser", "slow and not browser"


#: Numba compiles the source of these files, so a mutant made on import has no effect.
#: tests/laws/test_mutation.py mutates them without the compiler.
COMPILED = {
    "compiled/machine/kernels.py", "compiled/machine/memory.py", "compiled/machine/numbers.py",
    "compiled/machine/sine.py", "compiled/machine/single.py", "compiled/outputs.py", "compiled/recursion.py",
    "kinematics/equations.py", "verify/kernels.py",
}  # fmt: skip


_OF_SLIPS = ("test_mutate", "test_named_slips")
_OF_ROBOTS = ("test_robot.py", "verify", "laws")


def files(parts: list[str]) -> list[Path]:
    """Return the package's files below one of the parts; raise ValueError if a part has no file."""
    found = sorted(path for path in PACKAGE.rglob("*.py") if _below(path) not in COMPILED)
    for part in parts:
        if not any(_below(path).startswith(part) for path in found):
            raise ValueError(f"{part}: no file below {PACKAGE.name}/ that can be mutated begins so")
    return [path for path in found if not parts or _below(path).startswith(tuple(parts))]


def module_of(path: Path) -> str:
    """Return the module of a file, such as `urdfkin.dh.parse_table`."""
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def _below(path: Path) -> str:
    return str(path.relative_to(PACKAGE))


def near_tests(path: Path) -> list[str]:
    """Return the tests that mention a module, then the tests of its package or of the whole robot."""
    package, _, name = module_of(path).rpartition(".")
    named = re.compile(
        rf"\b{re.escape(package)}\.{name}\b(?!\.)|from {re.escape(package)} import .*\b{name}\b"
    )
    part = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
    near = {
        test
        for test, text in _texts().items()
        if test.stem == f"test_{path.stem}" or (name in text and named.search(text))
    }
    own = _tests_of(part, f"test_{part}.py") or _tests_of(*_OF_ROBOTS)
    order = sorted(near | own, key=lambda test: (path.stem not in test.stem, test not in near, str(test)))
    return [str(test.relative_to(ROOT)) for test in order]


def _tests_of(*parts: str) -> set[Path]:
    return {test for test in _texts() if test.relative_to(TESTS).parts[0] in parts}


@cache
def _texts() -> dict[Path, str]:
    tests = (path for path in TESTS.rglob("test_*.py") if path.stem not in _OF_SLIPS)
    return {path: path.read_text(encoding="utf-8") for path in tests}


@dataclass(frozen=True)
class Named:
    claim: str  # the mistake that must be detected
    module: str  # the module, such as `urdfkin.validation.error_stats`
    before: str  # a text that occurs exactly once in the module
    after: str  # the text that replaces `before`
    test: str  # the test that fails with the mutant and passes without it

    @property
    def file(self) -> Path:
        path = ROOT / self.module.replace(".", "/")
        return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


def named_slips() -> list[Named]:
    text = (TESTS / "attacks" / "named_slips.toml").read_text(encoding="utf-8")
    return [Named(**slip) for slip in tomllib.loads(text)["slip"]]


#: Pattern of a line such as "- `urdfkin.model.tree.build_tree`: `1  ->  2`: the reason."
_ARGUMENT = re.compile(r"^- `(?P<place>[\w.]+)`: `(?P<what>[^`]+)`: (?P<why>\S.+)$", re.MULTILINE)


@cache
def argued() -> dict[tuple[str, str], str]:
    """Return the reason of each harmless mutant, by its function and its text."""
    page = (ROOT / "docs" / "mutation.md").read_text(encoding="utf-8")
    return {(found["place"], found["what"]): found["why"] for found in _ARGUMENT.finditer(page)}


@dataclass(frozen=True)
class Mutant:
    """A change of a file that introduces a mistake, which a test should detect."""

    name: str  # name for --only
    file: str  # the file
    line: int  # the line
    what: str  # the text before and after
    place: str  # the function of the mutant; it identifies the mutant even after other changes of the file


@dataclass(frozen=True)
class Outcome:
    """The result of a mutant: `noticed` by a test, `survived`, `too slow`, or `argued` (harmless)."""

    mutant: Mutant
    word: str
    by: str


def mutants(parts: list[str]) -> list[Mutant]:
    return [mutant for path in files(parts) for mutant in mutants_of(path)]


def mutants_of(path: Path) -> list[Mutant]:
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
    near = near_tests(ROOT / mutant.file)
    rounds = [(near, _QUICK), *([(near, _SLOW)] if slow else []), *([(["tests"], _QUICK)] if whole else [])]
    for tests, marks in rounds:
        word, by = _run({"URDFKIN_MUTANT": mutant.name}, [*tests, "-m", marks], timeout)
        if word != "survived":
            break
    return Outcome(mutant, word, by)


def judge_named(slip: Named, *, timeout: float) -> Outcome:
    """Run the test that must fail for this mutant."""
    texts = json.dumps([slip.before, slip.after])
    word, by = _run({"URDFKIN_MUTANT": slip.module, "URDFKIN_MUTANT_TEXTS": texts}, [slip.test], timeout)
    if word == "noticed" and not by.startswith(f"FAILED {slip.test}"):
        word = "not run"  # the test failed for another reason than the mutant
    file = slip.file.relative_to(ROOT).as_posix()
    mutant = Mutant(slip.claim, file, 0, f"{slip.before}  ->  {slip.after}", slip.module)
    return Outcome(mutant, word, by)


#: This server imports the foreign libraries once, which takes longer than most tests.
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
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    option = parser.add_argument
    option("parts", nargs="*", help="prefixes of paths below urdfkin/, such as dh/ (default: all files)")
    option("--sample", type=int, help="number of randomly chosen mutants (default: all mutants)")
    option("--seed", type=int, default=0)
    option("--jobs", type=int, default=1)
    option("--timeout", type=float, default=300.0, help="time limit of one mutant's tests in seconds")
    option("--slow", action="store_true", help="also run the slow tests near the mutated file")
    option("--whole", action="store_true", help="also run all tests that are not slow")
    option("--only", help="run only the mutant with this name")
    option("--named", action="store_true", help="run only the named mutants, each with its own test")
    option("--count", action="store_true", help="print the number of mutants and exit")
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
    counts = Counter[str]()
    with ThreadPoolExecutor(options.jobs) as pool:
        for outcome in pool.map(lambda ask: ask(), asks):
            counts[outcome.word] += 1
            if outcome.word != "noticed":
                mutant = outcome.mutant
                where = f"{mutant.place}:{mutant.line}: {mutant.what}  [{mutant.name}]"
                print(f"{outcome.word}: {where}", flush=True)
    print(f"{len(asks)} mutants: " + ", ".join(f"{n} {word}" for word, n in counts.most_common()))
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
        return Outcome(mutant, "argued", "docs/mutation.md")
    return judge(mutant, **how)


if __name__ == "__main__":
    sys.exit(main())
