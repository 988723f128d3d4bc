"""Make small mistakes (mutants) in the package, one at a time, and check that a test detects each.

    python scripts/mutate.py --sample 40 --seed 1          forty random mutants of the whole package
    python scripts/mutate.py validation dh/snapping        all mutants of two parts
    python scripts/mutate.py --only urdfkin.validation.error_stats:17
    python scripts/mutate.py --named                       the mutants of tests/attacks/named_mutants.toml

The script first runs the quick tests in the files that mention the mutated module, and in the files for the
module's package. If no quick test fails, --slow runs the slow tests in these files. If no slow test fails,
--whole runs the quick tests in all files. The script prints every undetected mutant. The script skips the
mutants that docs/mutation.md lists as harmless.

A named mutant is a mistake that no test detected in the past. A named mutant replaces code of one function.
Each entry of tests/attacks/named_mutants.toml names the test that must fail for the mutant.

Exit 0: all mutants are detected or harmless.
Exit 1: some mutants are not detected, or there is no mutant.
Exit 2: the given part of the package does not exist, or none of its files can have mutants.
"""

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

sys.path.insert(0, str(Path(__file__).parents[1]))  # import from this checkout without an installation

from scripts.mutating.operators import function_at, list_changes

ROOT = Path(__file__).resolve().parents[1]
PACKAGE, TESTS = ROOT / "urdfkin", ROOT / "tests"
_NO_TESTS = 5  # Pytest's exit code if no test was collected.
_QUICK, _SLOW = "not slow and not browser", "slow and not browser"
#: Files that Numba compiles. The script skips these files, because the script changes syntax trees, but Numba
#: reads the source text. tests/laws/test_mutation.py tests mutants of these files without Numba.
COMPILED = {
    "compiled/machine/kernels.py", "compiled/machine/memory.py", "compiled/machine/numbers.py",
    "compiled/machine/sine.py", "compiled/machine/single.py", "compiled/outputs.py", "compiled/recursion.py",
    "kinematics/equations.py", "verify/kernels.py",
}  # fmt: skip


def find_files(parts: list[str]) -> list[Path]:
    below = {path.relative_to(PACKAGE).as_posix(): path for path in sorted(PACKAGE.rglob("*.py"))}
    found = {name: path for name, path in below.items() if name not in COMPILED}
    for part in parts:
        if not any(name.startswith(part) for name in found):
            raise ValueError(
                f"{part}: no file below {PACKAGE.name}/ that can have mutants has a path that begins with"
                " this text"
            )
    return [path for name, path in found.items() if not parts or name.startswith(tuple(parts))]


def module_name(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


@cache
def _read_tests() -> dict[Path, str]:
    own = ("test_mutate", "test_named_mutants")  # These tests make their own mutants.
    tests = (path for path in TESTS.rglob("test_*.py") if path.stem not in own)
    return {path: path.read_text(encoding="utf-8") for path in tests}


def find_near_tests(path: Path) -> list[str]:
    """Return the test files that mention a module or belong to the module's package.

    If the package has no test files, test_robot.py and the files in tests/verify and tests/laws replace them.
    """
    package, _, name = module_name(path).rpartition(".")
    pattern = re.compile(
        rf"\b{re.escape(package)}\.{name}\b(?!\.)|from {re.escape(package)} import .*\b{name}\b"
    )
    mentioning_tests = {
        test
        for test, text in _read_tests().items()
        if test.stem == f"test_{path.stem}" or (name in text and pattern.search(text))
    }
    part = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
    for parts in ((part, f"test_{part}.py"), ("test_robot.py", "verify", "laws")):
        if package_tests := {test for test in _read_tests() if test.relative_to(TESTS).parts[0] in parts}:
            break
    order = sorted(
        mentioning_tests | package_tests,
        key=lambda test: (path.stem not in test.stem, test not in mentioning_tests, str(test)),
    )
    return [str(test.relative_to(ROOT)) for test in order]


@dataclass(frozen=True)
class NamedMutant:
    claim: str  # the mistake that must be detected
    #: Full name of the function, for example `urdfkin.dh.snapping.snap_report`. For code outside functions,
    #: this is the full name of the module.
    function: str
    before: str  # code that occurs exactly once in the function
    after: str  # the code that replaces `before`
    test: str  # the test that fails only with the mutant

    @property
    def file(self) -> Path:
        path = ROOT
        for name in self.function.split("."):
            if not (path / name).is_dir():
                module = path / f"{name}.py"
                return module if module.is_file() else path / "__init__.py"
            path /= name
        return path / "__init__.py"

    @property
    def change(self) -> tuple[str, str, str]:
        """The last three arguments of `replace_code`."""
        return self.function[len(module_name(self.file)) + 1 :], self.before, self.after


def named_mutants() -> list[NamedMutant]:
    text = (TESTS / "attacks" / "named_mutants.toml").read_text(encoding="utf-8")
    return [NamedMutant(**mutant) for mutant in tomllib.loads(text)["mutant"]]


@cache
def harmless_mutants() -> dict[tuple[str, str], str]:
    """Read the reasons for harmless mutants, by function and change, from docs/mutation.md."""
    page = (ROOT / "docs" / "mutation.md").read_text(encoding="utf-8")
    # A line is "- `urdfkin.model.tree.build_tree`: `1  ->  2`: the reason."
    lines = re.findall(r"^- `([\w.]+)`: `([^`]+)`: (\S.+)$", page, re.MULTILINE)
    return {(place, what): why for place, what, why in lines}


@dataclass(frozen=True)
class Mutant:
    name: str  # name for --only
    file: str
    line: int
    change: str  # the text before and after
    function: str


@dataclass(frozen=True)
class Outcome:
    """A mutant's result: `detected`, `survived`, `too slow` or `harmless`."""

    mutant: Mutant
    result: str
    detail: str


def list_mutants(parts: list[str]) -> list[Mutant]:
    mutants = []
    for path in find_files(parts):
        tree, module, file = (
            ast.parse(path.read_text(encoding="utf-8")),
            module_name(path),
            path.relative_to(ROOT),
        )
        for number, change in enumerate(list_changes(tree)):
            function = ".".join(filter(None, (module, function_at(tree, change.line))))
            mutants.append(Mutant(f"{module}:{number}", str(file), change.line, change.text, function))
    return mutants


def evaluate(mutant: Mutant, *, timeout: float, slow: bool = False, whole: bool = False) -> Outcome:
    if (mutant.function, mutant.change) in harmless_mutants():
        return Outcome(mutant, "harmless", "docs/mutation.md")
    near = find_near_tests(ROOT / mutant.file)
    rounds = [(near, _QUICK), *([(near, _SLOW)] if slow else []), *([(["tests"], _QUICK)] if whole else [])]
    for tests, marks in rounds:
        result, detail = _run_in_process({"URDFKIN_MUTANT": mutant.name}, [*tests, "-m", marks], timeout)
        if result != "survived":
            break
    return Outcome(mutant, result, detail)


def evaluate_named(named: NamedMutant, *, timeout: float) -> Outcome:
    change = {"URDFKIN_MUTANT": module_name(named.file), "URDFKIN_MUTANT_CODE": json.dumps(named.change)}
    result, detail = _run_in_process(change, [named.test], timeout)
    if result == "detected" and not detail.startswith(f"FAILED {named.test}"):
        # `named.test` did not fail. Another problem occurred, for example an import error.
        result = "not run"
    file = named.file.relative_to(ROOT).as_posix()
    mutant = Mutant(named.claim, file, 0, f"{named.before}  ->  {named.after}", named.function)
    return Outcome(mutant, result, detail)


#: The fork server imports foreign libraries once, to save time.
_FORK_SERVER = multiprocessing.get_context("forkserver")
_FORK_SERVER.set_forkserver_preload(["numba", "pinocchio", "pytest"])


def _run_in_process(change: dict[str, str], tests: list[str], timeout: float) -> tuple[str, str]:
    with tempfile.NamedTemporaryFile("r") as output:
        process = _FORK_SERVER.Process(target=_run_tests, args=(change, tests, output.name))
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
    return "detected", next(failed, lines[-1] if lines else "")[:300]


def _run_tests(change: dict[str, str], tests: list[str], output: str) -> None:
    import pytest

    hook = ROOT / "scripts" / "mutating" / "hook"
    paths = [str(hook), str(ROOT), os.environ.get("PYTHONPATH", "")]
    os.chdir(ROOT)
    os.environ |= change | {
        "PYTHONPATH": os.pathsep.join(filter(None, paths)),
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    sys.dont_write_bytecode = True
    with open(output, "w") as to, open(os.devnull) as nothing:  # noqa: PTH123  the next lines need descriptors
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
    option("--slow", action="store_true", help="also run the slow tests of the mutated module")
    option("--whole", action="store_true", help="also run all quick tests")
    option("--only", help="run only the mutant with this name")
    option("--named", action="store_true", help="run only the named mutants, each with its own test")
    option("--count", action="store_true", help="print the number of mutants and exit")
    options = parser.parse_args()
    try:
        modules = {module_name(path) for path in find_files(options.parts)}
    except ValueError as error:
        parser.error(str(error))
    runs: list[Callable[[], Outcome]]
    if options.named:
        selected_mutants = [
            named_mutant
            for named_mutant in named_mutants()
            if not options.parts or module_name(named_mutant.file) in modules
        ]
        runs = [
            partial(evaluate_named, named_mutant, timeout=options.timeout)
            for named_mutant in selected_mutants
        ]
    else:
        chosen = [mutant for mutant in list_mutants(options.parts) if options.only in (None, mutant.name)]
        if options.sample is not None and options.sample < len(chosen):
            chosen = random.Random(options.seed).sample(chosen, options.sample)
        settings = {"timeout": options.timeout, "slow": options.slow, "whole": options.whole}
        runs = [partial(evaluate, mutant, **settings) for mutant in chosen]
    if not runs:
        print("no mutant was selected; --count prints the number of mutants", file=sys.stderr)
        return 1
    if options.count:
        print(len(runs))
        return 0
    counts = Counter[str]()
    with ThreadPoolExecutor(options.jobs) as pool:
        for outcome in pool.map(lambda run: run(), runs):
            counts[outcome.result] += 1
            if outcome.result != "detected":
                mutant = outcome.mutant
                location = f"{mutant.function}:{mutant.line}: {mutant.change}  [{mutant.name}]"
                print(f"{outcome.result}: {location}", flush=True)
    print(f"{len(runs)} mutants: " + ", ".join(f"{n} {result}" for result, n in counts.most_common()))
    return 0 if counts.keys() <= {"detected", "harmless"} else 1


if __name__ == "__main__":
    sys.exit(main())
