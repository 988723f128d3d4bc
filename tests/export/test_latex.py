"""The formulas of a document are those of the code: read back as text, they compute what Pinocchio does."""

from __future__ import annotations

import math
import re

import numpy as np

import urdfkin
from tests.export.writing import ALL, code
from tests.laws.subjects import state
from urdfkin.export import write

_LINE = re.compile(r"^(\S+) &= (.*?)(?: \\\\)?$", re.MULTILINE)
_SYMBOL = re.compile(r"(?:\\(?:d?dot|omega)(?:\{\\?[A-Za-z]+\})?|[A-Za-z])(?:\^\{\(\d+\)\})?_\{[\w,]+\}")


def evaluated(text: str, values: dict[str, float]) -> dict[str, float]:
    """What each formula comes to; nothing is used before it is defined."""
    for name, formula in _LINE.findall(text):
        plain = re.sub(r" \\cdot 10\^\{(-?\d+)\}", r"e\1", formula)
        plain = re.sub(r"\\operatorname\{(\w+)\}", r"\1", plain).replace(r" \, ", " * ")
        plain = _SYMBOL.sub(lambda found: f"x[{found[0]!r}]", plain)
        scope = {"x": values, "sin": math.sin, "cos": math.cos, "sqrt": math.sqrt}
        values[name] = float(eval(plain, {"__builtins__": {}}, scope))
    return values


def test_a_documents_formulas_compute_what_the_robot_does() -> None:
    robot = urdfkin.load("ur5")
    document = write(code(robot, "tool0", ALL), "latex")
    q, v, a = (x[0] for x in state(robot, 1, 4))
    given = {
        f"{letter}_{{{k + 1}}}": float(number)
        for letter, numbers in (("q", q), ("v", v), ("a", a))
        for k, number in enumerate(numbers)
    }
    sections = document.split(r"\subsection*")[1:]
    assert len(sections) == len(ALL)
    expected = {
        "T": robot.placement(q, "tool0"),
        "J": robot.jacobian(q, "tool0"),
        r"\dot{J}": robot.jacobian_rate(q, v, "tool0"),
    }
    found = [evaluated(section, dict(given)) for section in sections]
    for letter, matrix in expected.items():
        (own,) = (x for x in found if f"{letter}_{{1,1}}" in x)
        numbers = [
            [own[f"{letter}_{{{i + 1},{k + 1}}}"] for k in range(matrix.shape[1])] for i in range(len(matrix))
        ]
        assert np.abs(np.array(numbers) - matrix).max() < 1e-12


def test_braces_and_environments_of_a_document_are_closed() -> None:
    document = write(code(urdfkin.load("planar_two_link")), "latex")
    assert document.count(r"\begin{") == document.count(r"\end{")
    assert document.replace(r"\{", "").count("{") == document.replace(r"\}", "").count("}")
