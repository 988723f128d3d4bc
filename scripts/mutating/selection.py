"""Select the files to mutate, and the nearest tests of each; read the named and the harmless mutants.

In the past, no test detected the named mutants. A named mutant replaces a text of a file, and one given test
must now fail. Harmless mutants are listed in docs/mutation.md: no test detects them, and no test is needed.
"""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGE, TESTS = ROOT / "urdfkin", ROOT / "tests"

#: Numba compiles these files from their source, so a mutant made on import has no effect.
#: tests/laws/test_mutation.py mutates them without the compiler.
_COMPILED = {
    "numbers", "registers", "sine", "memory", "walk", "outputs", "cores", "single", "equations", "worst",
}  # fmt: skip


#: Tests that make their own mutants in separate processes.
_OF_SLIPS = ("test_mutate", "test_named_slips")
_OF_ROBOTS = ("test_robot.py", "verify", "laws")


def files(parts: list[str]) -> list[Path]:
    """Return the package's files, or only the files whose path in the package begins with one of the parts.

    Raises:
        ValueError: no path begins with one of the parts.
    """
    found = sorted(path for path in PACKAGE.rglob("*.py") if path.stem not in _COMPILED)
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
    """Return the tests near a module: first the tests that mention the module, then the tests of its package.

    If a part of the package has no tests of its own, the tests of all other parts are returned.
    """
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
    """One named mutant.

    Attributes:
        claim: The mistake that must be detected.
        module: The module, such as `urdfkin.validation.error_stats`.
        before: A text that occurs exactly once in the module.
        after: The text that replaces `before`.
        test: The test that fails with the mutant and passes without it.
    """

    claim: str
    module: str
    before: str
    after: str
    test: str

    @property
    def file(self) -> Path:
        """Path of the module's file."""
        path = ROOT / self.module.replace(".", "/")
        return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


def named_slips() -> list[Named]:
    """Return the mutants of tests/attacks/named_slips.toml."""
    text = (TESTS / "attacks" / "named_slips.toml").read_text(encoding="utf-8")
    return [Named(**slip) for slip in tomllib.loads(text)["slip"]]


#: Pattern of a line such as "- `urdfkin.model.tree.build_tree`: `1  ->  2`: the reason."
_ARGUMENT = re.compile(r"^- `(?P<place>[\w.]+)`: `(?P<what>[^`]+)`: (?P<why>\S.+)$", re.MULTILINE)


@cache
def argued() -> dict[tuple[str, str], str]:
    """Return the reason of each harmless mutant, by its function and its text."""
    page = (ROOT / "docs" / "mutation.md").read_text(encoding="utf-8")
    return {(found["place"], found["what"]): found["why"] for found in _ARGUMENT.finditer(page)}
