"""A number that writes code keeps the value of what it writes, and writes nothing twice or for nothing."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from urdfkin.export.expression import Graph, Node, needed
from urdfkin.kinematics import equations

INPUTS = (0.7, -1.3, 2.9)
_OPERATIONS: dict[str, Callable[..., Any]] = {
    "+": lambda x, y: x + y,
    "-": lambda x, y: x - y,
    "*": lambda x, y: x * y,
    "neg": lambda x: -x,
    "sin": math.sin,
    "cos": math.cos,
}


def value(x: Any) -> float:
    """What an expression comes to for `INPUTS`."""
    if not isinstance(x, Node):
        return float(x)
    if x.op == "q":
        return INPUTS[x.of[0]]
    return float(_OPERATIONS[x.op](*map(value, x.of)))


@st.composite
def written(draw: st.DrawFn) -> list[tuple[str, int, int]]:
    """Operations, each on two of the numbers so far."""
    letters = st.sampled_from("+-*n")
    return [(draw(letters), draw(st.integers(0, 30)), draw(st.integers(0, 30))) for _ in range(12)]


@pytest.mark.slow
@given(written())
def test_an_expression_has_the_value_of_its_arithmetic(steps: list[tuple[str, int, int]]) -> None:
    graph = Graph()
    numbers: list[Any] = [0.0, 1.0, -1.0, 0.5, *(graph.input("q", i) for i in range(3))]
    plain = [0.0, 1.0, -1.0, 0.5, *INPUTS]
    for op, i, k in steps:
        for row in (numbers, plain):
            x, y = row[i % len(row)], row[k % len(row)]
            row.append(-x if op == "n" else _OPERATIONS[op](x, y))
    for found, expected in zip(numbers, plain, strict=True):
        size = max(map(abs, plain))
        assert abs(value(found) - expected) <= 1e-13 * size


@pytest.mark.slow
@given(written())
def test_no_operation_is_made_for_nothing(steps: list[tuple[str, int, int]]) -> None:
    graph = Graph()
    numbers: list[Any] = [0.0, 1.0, -1.0, 0.5, *(graph.input("q", i) for i in range(3))]
    for op, i, k in steps:
        x, y = numbers[i % len(numbers)], numbers[k % len(numbers)]
        numbers.append(-x if op == "n" else _OPERATIONS[op](x, y))
    for node in needed(numbers):
        constants = [x for x in node.of if not isinstance(x, Node)]
        if node.op in "+-*":
            assert len(constants) < 2
            assert 0.0 not in constants
            assert all(x > 0.0 for x in constants)
            assert not any(x.op == "neg" for x in node.operands)
        if node.op == "*":
            assert 1.0 not in constants
        if node.op == "neg":
            assert node.operands[0].op != "neg"


def test_what_was_written_before_is_the_same_again() -> None:
    graph = Graph()
    x, y, z = (graph.input("q", i) for i in range(3))
    assert x * y + z is z + y * x
    difference = y - x
    assert (x - y).of == (difference,), "turned round it is the same with a minus"
    assert (-x) * y is -(x * y)
    assert graph.sine_cosine(x)[0] is graph.sine_cosine(x)[0]


def test_an_equation_notes_its_numbers_on_what_it_makes_itself_or_through_another() -> None:
    graph = Graph()
    x = tuple(graph.input("q", i) for i in range(3))
    y = tuple(graph.input("v", i) for i in range(3))
    turned = graph.chapter.point_acceleration(x, x, y, x)
    assert {node.equation for node in needed(turned) if node.op in "+-*"} == {"7.123, 7.130"}
    assert graph.chapter.plus(x, y)[0].equation == ""
    assert "7.123, 7.130" in str(equations.point_acceleration.__doc__)
