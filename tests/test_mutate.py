"""The script that makes mutants makes the same mutants in each run, in code that runs."""

import ast
import hashlib
import os
import re
import sys
from itertools import takewhile
from pathlib import Path
from typing import Any

import pytest

from scripts.mutate import (
    COMPILED,
    PACKAGE,
    ROOT,
    Mutant,
    evaluate,
    find_files,
    find_near_tests,
    harmless_mutants,
    list_mutants,
    main,
    module_name,
)
from scripts.mutating.operators import apply_change, function_at, list_changes

SOURCE = '''
"""A text is left alone: 1 < 2."""
def f(x: "1 < 2", limit=3):
    if x < limit and not x:
        raise ValueError("x < 3")
    for y in range(-2):
        if done(x):
            continue
        log(y)
    return min(x, 1.5) if ready else True
'''

WHAT = {
    "x < limit  ->  x <= limit", "x < limit and (not x)  ->  x < limit or not x", "not x  ->  not not x",
    "3  ->  4", "raise ValueError('x < 3')  ->  pass", "-2  ->  +2", "2  ->  3",
    "if done(x)  ->  if not done(x)", "continue  ->  break", "log(y)  ->  None", "min  ->  max",
    "1.5  ->  2.25", "True  ->  False",
    "min(x, 1.5) if ready else True  ->  min(x, 1.5) if not ready else True",
}  # fmt: skip


def test_every_kind_of_mutant_is_made_once_and_only_in_executed_code() -> None:
    found = [change.text for change in list_changes(ast.parse(SOURCE))]
    assert sorted(found) == sorted(WHAT)


def test_each_mutant_changes_one_line_and_no_two_are_equal() -> None:
    original = ast.unparse(ast.parse(SOURCE))
    changed = {ast.unparse(apply_change(SOURCE, number)) for number in range(len(WHAT))}
    assert len(changed) == len(WHAT)
    for text in changed:
        pairs = zip(original.splitlines(), text.splitlines(), strict=True)
        assert sum(old != new for old, new in pairs) == 1, text


@pytest.mark.long
def test_the_files_that_numba_compiles_exist_and_no_other_file_is_left_out() -> None:
    left_out = {path.relative_to(PACKAGE).as_posix() for path in {*PACKAGE.rglob("*.py")} - {*find_files([])}}
    assert left_out == COMPILED


@pytest.mark.slow
def test_every_mutant_of_the_package_compiles_and_has_a_test() -> None:
    for path in find_files([]):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        for statement in tree.body:
            for change in list_changes(ast.Module([statement], []))[::20]:
                with change.applied():
                    compile(ast.fix_missing_locations(ast.Module([statement], [])), str(path), "exec")
        if path.stem not in ("__init__", "__main__"):
            assert find_near_tests(path), path


@pytest.mark.long
@pytest.mark.parametrize(
    ("what", "word"),
    [("self.bound_ratio <= 1.0  ->  self.bound_ratio < 1.0", "survived"), ("1.0  ->  1.5", "detected")],
)
def test_a_mutant_without_a_test_survives_and_one_with_a_test_is_detected(
    what: str, word: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    places = [m for m in list_mutants(["verify/comparison"]) if m.function.endswith("Comparison.agrees")]
    (mutant,) = [m for m in places if m.change == what]
    test = tmp_path / "test_one.py"
    test.write_text(
        "from urdfkin.verify.comparison import BatchComparison\n"
        "def test_a_share_above_one_disagrees():\n    assert not BatchComparison(1, 9.0, 1.4, ()).agrees\n",
        encoding="utf-8",
    )
    monkeypatch.setattr("scripts.mutate.find_near_tests", lambda path: [str(test)])
    assert evaluate(mutant, timeout=100.0).result == word


#: Names of former parts of the package.
GONE = ("verification", "judge", "keeping")

#: Parts of the package whose mutants are tested quickly, and on which all reports depend.
PARTS = [
    "validation/document",
    "validation/error_stats",
    "verify/certificate",
    "verify/comparison",
    "dh/table",
]
SEED = int(os.environ.get("URDFKIN_MUTATION_SEED", "1"))


def drawn(count: int) -> list[Mutant]:
    """Return the mutants with the smallest hashes: a change elsewhere in a file draws no others."""
    named = {f"{SEED} {mutant.function} {mutant.change}".encode(): mutant for mutant in list_mutants(PARTS)}
    return [named[name] for name in sorted(named, key=lambda name: hashlib.sha256(name).hexdigest())[:count]]


@pytest.mark.long
@pytest.mark.timeout(700)  # `evaluate` runs the tests in two rounds of at most 300 s
@pytest.mark.parametrize("mutant", drawn(6), ids=lambda mutant: str(mutant.name))
def test_a_random_mutant_is_detected_or_documented_as_harmless(mutant: Mutant) -> None:
    if (mutant.function, mutant.change) not in harmless_mutants():
        outcome = evaluate(mutant, timeout=300.0, slow=True)
        assert outcome.result != "survived", f"{mutant.function}: {mutant.change}"


@pytest.mark.long
def test_each_documented_harmless_mutant_exists_and_is_listed_once() -> None:
    page = (ROOT / "docs" / "mutation.md").read_text(encoding="utf-8")
    lines = [line for line in page.splitlines() if line.startswith("- `urdfkin.")]
    assert len(lines) == len(harmless_mutants()) > 0
    modules = {module_name(path): path for path in find_files([])}
    named = {place: [name for name in modules if place.startswith(name)] for place, _ in harmless_mutants()}
    parts = {str(modules[max(names, key=len)].relative_to(PACKAGE)) for names in named.values()}
    assert harmless_mutants().keys() <= {
        (mutant.function, mutant.change) for mutant in list_mutants(sorted(parts))
    }


def test_a_harmless_mutant_is_one_line_of_the_page() -> None:
    assert not [what for _, what in harmless_mutants() if "\n" in what]
    assert all(why[-1] == "." for why in harmless_mutants().values())


@pytest.mark.parametrize(
    "words", [["verification"], ["validation", "judge", "--count"], ["keeping", "--named"]]
)
def test_an_unknown_part_of_the_package_is_a_named_error(
    words: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["mutate.py", *words])
    with pytest.raises(SystemExit, match="2"):
        main()
    gone = next(word for word in words if word in GONE)
    assert f"{gone}: no file below urdfkin/" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    ["--only urdfkin.validation.error_stats:99999", "cli/__init__ --named", "cli/view --sample 0"],
)
def test_a_selection_without_mutants_is_a_failure(
    words: str, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.setattr(sys, "argv", ["mutate.py", *words.split()])
    assert main() == 1
    assert "no mutant was selected" in capsys.readouterr().err


def test_every_part_of_the_package_on_the_page_exists() -> None:
    page = (ROOT / "docs" / "mutation.md").read_text(encoding="utf-8")
    measured = re.findall(r"^\| `([\w/]+)` \|", page, re.M)
    commands = [line.split() for line in re.findall(r"scripts/mutate\.py (.*?)  ", page)]
    named = [word for words in commands for word in takewhile(lambda word: word[0] != "-", words)]
    assert len(measured) > 9
    assert len(named) > 2
    assert find_files(measured + named)


@pytest.mark.parametrize(("line", "place"), [(3, "C"), (5, "C.f"), (7, "C.f.g"), (9, "h"), (1, "")])
def test_a_mutant_is_identified_by_its_function(line: int, place: str) -> None:
    source = (
        "x = 1\nclass C:\n  y = 2\n  def f(self):\n    z = 3\n    def g():\n      return 4\n    return g\n"
        "def h(): return 5\n"
    )
    assert function_at(ast.parse(source), line) == place
