"""Mutants that no test detected once: each runs in its own process, and its test must fail."""

import ast
from pathlib import Path

import pytest

from scripts.mutate import ROOT, NamedMutant, evaluate_named, named_mutants
from scripts.mutating.operators import replace_code

MUTANTS = named_mutants()


def test_every_listed_mutant_can_be_made_and_names_an_existing_test() -> None:
    assert len({mutant.claim for mutant in MUTANTS}) == len(MUTANTS)
    for mutant in MUTANTS:
        replace_code(mutant.file.read_text(encoding="utf-8"), *mutant.change)
        file, _, name = mutant.test.partition("::")
        assert f"def {name}(" in Path(ROOT / file).read_text(encoding="utf-8"), mutant.test


@pytest.mark.long
@pytest.mark.parametrize("mutant", MUTANTS, ids=[mutant.claim.replace(" ", "-") for mutant in MUTANTS])
def test_the_named_test_of_each_listed_mutant_fails(mutant: NamedMutant) -> None:
    outcome = evaluate_named(mutant, timeout=300.0)
    assert outcome.result == "detected", outcome.detail


def test_a_mutant_of_code_that_does_not_occur_exactly_once_in_its_function_is_an_error() -> None:
    for text in ("def f():\n    x = 1\n    x = 1\n", "def f():\n    y = 2\ndef g():\n    x = 1\n"):
        with pytest.raises(ValueError, match=r"found \d times"):
            replace_code(text, "f", "x = 1", "x = 2")
    with pytest.raises(ValueError, match="no function h"):
        replace_code(text, "h", "x = 1", "x = 2")


@pytest.mark.parametrize(
    ("before", "after", "expected"),
    [
        ("x + 1", "x - 1", "g(x - 1, key=2)"),  # an expression
        ("key=2", "key=3", "g(x + 1, key=3)"),  # a keyword argument
        ("key=2", "", "g(x + 1)"),
        ("g(x + 1, key=2)", "x", "x"),
    ],
)
def test_a_mutant_replaces_code_however_it_is_written(before: str, after: str, expected: str) -> None:
    body = "    def f(self, x):\n        return g(\n            (x +  1), key=2,  # comment\n        )\n"
    expected = f"class A:\n\n    def f(self, x):\n        return {expected}"
    assert ast.unparse(replace_code(f"class A:\n{body}", "A.f", before, after)) == expected


def test_a_mutant_replaces_one_statement_by_several() -> None:
    found = replace_code("def f(x):\n    x = 1\n    return x\n", "f", "x = 1", "y = 1\nx = y")
    assert ast.unparse(found) == "def f(x):\n    y = 1\n    x = y\n    return x"
