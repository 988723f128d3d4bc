"""docs/equations.md is complete, current and true."""

import importlib
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from tests.mutation import slightly_wrong
from urdfkin.errors import UrdfkinError
from urdfkin.kinematics.registry import LAST, LOST, equations, explain, misprints, table

ROOT = Path(__file__).parents[2]


def resolve(function: str) -> Any:
    """The function that "module:Class.name" names."""
    module, _, name = function.partition(":")
    found: Any = importlib.import_module(module)
    for part in name.split("."):
        found = getattr(found, part)
    return found


@cache
def test_function(test: str) -> Callable[..., None]:
    """The test that "file::name" names."""
    file, _, name = test.partition("::")
    assert (ROOT / file).is_file(), file
    module = importlib.import_module(file.removesuffix(".py").replace("/", "."))
    found: Callable[..., None] = getattr(module, name)
    return found


test_function.__test__ = False  # type: ignore[attr-defined]


def arguments(function: Callable[..., None]) -> Iterator[dict[str, Any]]:
    """The argument sets of a test that is parametrised at most once."""
    marks = [mark for mark in getattr(function, "pytestmark", []) if mark.name == "parametrize"]
    assert len(marks) <= 1
    if not marks:
        yield {}
        return
    names, values = marks[0].args[:2]
    names = [names] if isinstance(names, str) else list(names)
    for value in values:
        yield dict(zip(names, [value] if len(names) == 1 else value, strict=True))


def passes(test: str) -> bool:
    """Whether a test passes with every set of its arguments."""
    function = test_function(test)
    try:
        for given in arguments(function):
            function(**given)
    except (AssertionError, UrdfkinError):
        return False
    return True


@cache
def passes_as_it_is(test: str) -> bool:
    """The same while nothing is wrong: equations share tests, and each need pass but once."""
    return passes(test)


def test_every_equation_is_there_but_the_four_that_are_lost() -> None:
    assert list(equations()) == [f"7.{i}" for i in range(1, LAST + 1) if f"7.{i}" not in LOST]
    assert len(equations()) == 126
    assert LOST == ("7.6", "7.8", "7.9", "7.10")


def test_every_function_exists_and_every_test_is_a_test() -> None:
    for equation in equations().values():
        assert equation.functions
        assert equation.tests
        for function in equation.functions:
            assert callable(resolve(function)), function
        for test in equation.tests:
            assert callable(test_function(test)), test
            assert test.split("::")[1].startswith("test_"), test


@pytest.mark.slow
@pytest.mark.parametrize("number", list(equations()))
def test_its_tests_pass_and_fail_when_one_of_its_functions_is_slightly_wrong(number: str) -> None:
    equation = equations()[number]
    assert all(passes_as_it_is(test) for test in equation.tests)
    for name in equation.functions:
        with slightly_wrong(resolve(name)):
            assert not all(passes(test) for test in equation.tests), f"{name} may be wrong unnoticed"
    # What failed did so because of that function alone: with all of them right again everything passes.
    assert all(passes(test) for test in equation.tests)


def test_every_misprint_has_a_proof_that_passes() -> None:
    assert misprints()
    for misprint in misprints():
        assert passes(misprint.test), misprint.where


def test_the_page_is_current() -> None:
    page = (ROOT / "docs" / "equations.md").read_text(encoding="utf-8")
    assert page == table(), "run scripts/make_equations.py"


def test_explain_gives_a_page_for_each_equation_and_says_which_are_lost() -> None:
    for number, equation in equations().items():
        page = explain(number)
        assert page is not None
        assert equation.statement in page
        assert equation.meaning in page
    assert "lost" in str(explain("7.8"))
    assert explain("(7.130)") == explain("eq. 7.130") == explain("7.130")
    assert explain("7.131") is explain("URDF101") is explain("7") is None
