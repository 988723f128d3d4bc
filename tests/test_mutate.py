"""The script that makes slips makes each of them, the same ones each time, where the program really runs."""

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
    argued,
    files,
    judge,
    main,
    module_of,
    mutants,
    near_tests,
)
from scripts.mutating.operators import function_at, mutated, slips

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


def test_every_kind_of_slip_is_made_once_and_nothing_that_does_not_run_is_touched() -> None:
    found = [slip.what for slip in slips(ast.parse(SOURCE))]
    assert sorted(found) == sorted(WHAT)


def test_a_slip_changes_one_place_and_each_changes_another() -> None:
    original = ast.unparse(ast.parse(SOURCE))
    changed = {ast.unparse(mutated(SOURCE, number)) for number in range(len(WHAT))}
    assert len(changed) == len(WHAT)
    for text in changed:
        pairs = zip(original.splitlines(), text.splitlines(), strict=True)
        assert sum(old != new for old, new in pairs) == 1, text


@pytest.mark.long
def test_the_files_that_numba_compiles_exist_and_no_other_file_is_left_out() -> None:
    left_out = {path.relative_to(PACKAGE).as_posix() for path in {*PACKAGE.rglob("*.py")} - {*files([])}}
    assert left_out == COMPILED


def test_every_slip_of_the_package_compiles_and_has_a_test_to_ask() -> None:
    for path in files([]):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        for statement in tree.body:
            for slip in slips(ast.Module([statement], []))[::20]:
                with slip.made():
                    compile(ast.fix_missing_locations(ast.Module([statement], [])), str(path), "exec")
        if path.stem not in ("__init__", "__main__"):
            assert near_tests(path), path


@pytest.mark.long
@pytest.mark.parametrize(
    ("what", "word"), [("self.share <= 1.0  ->  self.share < 1.0", "survived"), ("1.0  ->  1.5", "noticed")]
)
def test_what_no_test_looks_at_survives_and_what_one_does_is_noticed(
    what: str, word: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    places = [m for m in mutants(["verify/certificate"]) if m.place.endswith("Comparison.agrees")]
    (mutant,) = [m for m in places if m.what == what]
    test = tmp_path / "test_one.py"
    test.write_text(
        "from urdfkin.verify.certificate import Comparison\n"
        "def test_a_share_above_one_disagrees():\n    assert not Comparison(1, 9.0, 1.4, ()).agrees\n",
        encoding="utf-8",
    )
    monkeypatch.setattr("scripts.mutate.near_tests", lambda path: [str(test)])
    assert judge(mutant, timeout=100.0).word == word


#: Parts of earlier versions.
GONE = ("verification", "judge", "keeping")

#: Quick to ask about, and to be relied on by everything that is handed out or reported.
PARTS = ["validation/outcome", "validation/error_stats", "verify/certificate", "dh/table"]
SEED = int(os.environ.get("URDFKIN_MUTATION_SEED", "1"))


def drawn(count: int) -> list[Mutant]:
    """Return the mutants with the smallest hashes: a change elsewhere in a file draws no others."""
    named = {f"{SEED} {mutant.place} {mutant.what}".encode(): mutant for mutant in mutants(PARTS)}
    return [named[name] for name in sorted(named, key=lambda name: hashlib.sha256(name).hexdigest())[:count]]


@pytest.mark.long
@pytest.mark.parametrize("mutant", drawn(6), ids=lambda mutant: str(mutant.name))
def test_a_slip_drawn_by_a_seed_is_noticed_or_argued(mutant: Mutant) -> None:
    if (mutant.place, mutant.what) not in argued():
        outcome = judge(mutant, timeout=300.0, slow=True)
        assert outcome.word != "survived", f"{mutant.place}: {mutant.what}"


@pytest.mark.long
def test_what_is_argued_can_still_be_made_and_stands_on_the_page_once() -> None:
    page = (ROOT / "docs" / "mutation.md").read_text(encoding="utf-8")
    lines = [line for line in page.splitlines() if line.startswith("- `urdfkin.")]
    assert len(lines) == len(argued()) > 0
    modules = {module_of(path): path for path in files([])}
    named = {place: [name for name in modules if place.startswith(name)] for place, _ in argued()}
    parts = {str(modules[max(names, key=len)].relative_to(PACKAGE)) for names in named.values()}
    assert argued().keys() <= {(mutant.place, mutant.what) for mutant in mutants(sorted(parts))}


def test_a_harmless_mutant_is_one_line_of_the_page() -> None:
    assert not [what for _, what in argued() if "\n" in what]
    assert all(why[-1] == "." for why in argued().values())


@pytest.mark.parametrize(
    "words", [["verification"], ["validation", "judge", "--count"], ["keeping", "--named"]]
)
def test_a_part_that_does_not_exist_is_an_error_and_named(
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
def test_no_mutant_at_all_is_a_failure(words: str, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    monkeypatch.setattr(sys, "argv", ["mutate.py", *words.split()])
    assert main() == 1
    assert "no mutant was selected" in capsys.readouterr().err


def test_every_part_that_the_page_names_exists() -> None:
    page = (ROOT / "docs" / "mutation.md").read_text(encoding="utf-8")
    measured = re.findall(r"^\| `([\w/]+)` \|", page, re.M)
    commands = [line.split() for line in re.findall(r"scripts/mutate\.py (.*?)  ", page)]
    named = [word for words in commands for word in takewhile(lambda word: word[0] != "-", words)]
    assert len(measured) > 9
    assert len(named) > 2
    assert files(measured + named)


@pytest.mark.parametrize(("line", "place"), [(3, "C"), (5, "C.f"), (7, "C.f.g"), (9, "h"), (1, "")])
def test_a_slip_is_found_again_by_the_function_it_stands_in(line: int, place: str) -> None:
    source = (
        "x = 1\nclass C:\n  y = 2\n  def f(self):\n    z = 3\n    def g():\n      return 4\n    return g\n"
        "def h(): return 5\n"
    )
    assert function_at(ast.parse(source), line) == place
