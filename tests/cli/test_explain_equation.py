"""`urdfkin explain 7.130`: the equation, its meaning, its function and its check."""

import subprocess
import sys

import pytest


def explain(topic: str) -> "subprocess.CompletedProcess[str]":
    words = [sys.executable, "-m", "urdfkin", "explain", topic]
    return subprocess.run(words, capture_output=True, text=True, check=False)


@pytest.mark.slow
def test_an_equations_number_gives_its_page() -> None:
    page = explain("7.130")
    assert page.returncode == 0, page.stderr
    for part in ("Equation 7.130", "w-dot_0i x d_{i-1,i}", "Robot.acceleration", "Pinocchio", "tests/text/"):
        assert part in page.stdout


def test_a_lost_equation_is_said_to_be_lost() -> None:
    assert "page 2" in explain("7.8").stdout


@pytest.mark.slow
def test_a_number_that_the_chapter_does_not_have_is_no_topic() -> None:
    answer = explain("7.131")
    assert answer.returncode == 2
    assert answer.stdout == ""
