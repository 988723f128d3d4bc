"""The terminal's report fits its width, needs no colour, and shows what failed."""

from __future__ import annotations

import io
from typing import Any

import pytest
from rich.console import Console

from tests.report.documents import arms, failing, hostile
from urdfkin.report.compare import compare, document
from urdfkin.report.listing import print_document
from urdfkin.report.terminal import print_report
from urdfkin.validation.document import Document


def printed(document: Document, width: int, **how: Any) -> str:
    stream = io.StringIO()
    print_report(document, Console(file=stream, width=width, markup=False, highlight=False), **how)
    return stream.getvalue()


def one(document: Document) -> Document:
    document["robots"] = document["robots"][:1]
    return document


@pytest.mark.parametrize("width", [80, 100, 140])
@pytest.mark.parametrize("make", [arms, failing, hostile, lambda: one(arms())])
def test_no_line_but_a_replay_line_is_wider_than_the_terminal(make: Any, width: int) -> None:
    lines = printed(make(), width).splitlines()
    assert [line for line in lines if len(line) > width and "urdfkin" not in line] == []


def test_it_has_no_escapes_and_no_markup_where_there_is_no_terminal() -> None:
    assert "\x1b" not in printed(arms(), 80)
    document = arms()
    document["robots"][0]["source"] = "[bold red]name[/]"
    assert "[bold" in printed(document, 80)


def test_80_columns_have_a_row_for_each_robot_and_for_each_quantity() -> None:
    text = printed(arms(), 80)
    for words in ("panda", "ur5", "Jacobian rate", "acceleration", "data.J", "verified"):
        assert words in text


def test_100_columns_have_a_column_for_each_quantity() -> None:
    head = next(line for line in printed(arms(), 100).splitlines() if "robot" in line and "results" in line)
    for word in ("place", "vel", "J", "J-dot", "acc", "data.J", "verdict"):
        assert word in head


def test_failures_come_with_their_replay_line_and_reasons_are_told() -> None:
    text = printed(failing(), 80)
    assert "urdfkin velocity panda --frame" in text
    assert "broken.urdf: bad input" in text
    assert "URDF502" in text
    assert "urdfkin velocity panda --frame" not in printed(arms(), 80)
    assert "urdfkin velocity panda --frame" in printed(arms(), 80, cases=True)


def test_a_comparison_reads_without_colour() -> None:
    stream = io.StringIO()
    old, new = arms(), failing()
    print_document(Console(file=stream, width=80, markup=False), document(old, new, compare(old, new)))
    text = stream.getvalue()
    assert "REGRESSION panda: verdict: verified -> disagrees" in text
    assert "regressions" in text.splitlines()[-1]
