"""Mutants that no test detected once: each runs in its own process, and its test must fail."""

from pathlib import Path

import pytest

from scripts.mutate import ROOT, Named, evaluate_named, named_mutants
from scripts.mutating.operators import rewritten

MUTANTS = named_mutants()


def _source(mutant: Named) -> str:
    return mutant.file.read_text(encoding="utf-8")


def test_every_listed_mutant_can_be_made_and_names_an_existing_test() -> None:
    assert len({mutant.claim for mutant in MUTANTS}) == len(MUTANTS)
    for mutant in MUTANTS:
        rewritten(_source(mutant), mutant.before, mutant.after)
        file, _, name = mutant.test.partition("::")
        assert f"def {name}(" in Path(ROOT / file).read_text(encoding="utf-8"), mutant.test


@pytest.mark.long
@pytest.mark.parametrize("mutant", MUTANTS, ids=[mutant.claim.replace(" ", "-") for mutant in MUTANTS])
def test_the_named_test_of_each_listed_mutant_fails(mutant: Named) -> None:
    outcome = evaluate_named(mutant, timeout=300.0)
    assert outcome.word == "noticed", outcome.by


def test_a_mutant_of_a_text_that_does_not_occur_exactly_once_is_an_error() -> None:
    for text in ("x = 1\nx = 1\n", "y = 2\n"):
        with pytest.raises(ValueError, match=r"found \d times"):
            rewritten(text, "x = 1", "x = 2")
