"""Which files can be mutated, and which tests are the first to ask about each."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGE, TESTS = ROOT / "urdfkin", ROOT / "tests"

#: Compiled by Numba from their files, which a slip made while they are read does not reach: their terms are
#: changed by tests/laws/test_mutation.py, run without the compiler.
_COMPILED = {
    "numbers", "registers", "sine", "memory", "walk", "outputs", "cores", "single", "equations", "worst",
}  # fmt: skip


#: They make slips of their own, in processes of their own.
_OF_SLIPS = ("test_mutate", "test_named_slips")
_OF_ROBOTS = ("test_robot.py", "verify", "laws")


def files(parts: list[str]) -> list[Path]:
    """The package's files, or those whose path below the package begins with one of the words.

    Raises:
        ValueError: no file's path begins with one of the words.
    """
    found = sorted(path for path in PACKAGE.rglob("*.py") if path.stem not in _COMPILED)
    for part in parts:
        if not any(_below(path).startswith(part) for path in found):
            raise ValueError(f"{part}: no file below {PACKAGE.name}/ that can be mutated begins so")
    return [path for path in found if not parts or _below(path).startswith(tuple(parts))]


def module_of(path: Path) -> str:
    """`urdfkin.dh.parse_table` for its file."""
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def _below(path: Path) -> str:
    return str(path.relative_to(PACKAGE))


def near_tests(path: Path) -> list[str]:
    """Test files that name the module or are called after it, and those of its part; the nearest come first.

    A part without tests of its own serves all the others, by way of a robot.
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
