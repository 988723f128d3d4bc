"""The LaTeX of each equation says what its plain statement says, symbol by symbol."""

from __future__ import annotations

import re

import pytest

from urdfkin.kinematics.registry import Equation, equations

_WORDS = {r"\times": "x", r"\cdot": ".", r"\ldots": "...", r"\omega": "w", r"\left": "", r"\right": ""}
#: Brackets and signs between entries, which the two notations write differently.
_BETWEEN = re.compile(r"[\s_{}()\[\],;&\\]")


def of_latex(latex: str) -> str:
    """LaTeX read aloud."""
    text = re.sub(r"\\(?:begin|end)\{bmatrix\}", "", latex)
    for word, plain in _WORDS.items():
        text = text.replace(word, plain)
    text = re.sub(r"\\sum_\{(\w)=1\}\^\{(\w)\}", r"sum over \1 = 1..\2 of ", text)
    text = re.sub(r"\\sum_(\w)", r"sum over \1 of ", text)
    text = re.sub(r"\\(d?)dot\{(.*?)\}", lambda dots: dots[2] + "-dot" * (1 + len(dots[1])), text)
    text = re.sub(r"\\frac\{([^{}]*)\}\{([^{}]*)\}", r"\1/\2", text)
    return _BETWEEN.sub("", re.sub(r"\\text", "", text))


def of_statement(statement: str) -> str:
    """Plain characters, dots before subscripts as LaTeX has them."""
    return _BETWEEN.sub("", re.sub(r"\b(theta|[a-zA-Z])(_?[0-9a-z])((?:-dot)+)", r"\1\3\2", statement))


@pytest.mark.parametrize("equation", equations().values(), ids=equations())
def test_both_notations_have_the_same_symbols_in_the_same_order(equation: Equation) -> None:
    assert of_latex(equation.latex) == of_statement(equation.statement)


def test_a_lost_sign_or_dot_is_seen() -> None:
    equation = equations()["7.130"]
    for slip in (("+ 2", "- 2"), (r"\ddot", r"\dot"), ("i-1,i", "i,i-1")):
        assert of_latex(equation.latex.replace(*slip, 1)) != of_statement(equation.statement)
