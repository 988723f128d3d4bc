"""The equations in the words of LaTeX: what a function of `equations` says, found by running it on words.

A word is a piece of LaTeX that knows whether it is a sum, a product or a cross product, so that it is put in
brackets where it must be.
"""

from __future__ import annotations

import inspect
from dataclasses import dataclass
from typing import Any

from urdfkin.kinematics import equations
from urdfkin.kinematics.number_kinds import bound

#: What the parameters of equations are called in the text.
_SYMBOLS = {
    "vel": r"\dot{d}",
    "acc": r"\ddot{d}",
    "w": r"\omega",
    "alpha": r"\dot{\omega}",
    "v": r"\dot{\theta}",
    "a": r"\ddot{\theta}",
    "d_rate": r"\dot{d}",
    "z_rate": r"\dot{z}",
    "sine": r"\sin\theta",
    "cosine": r"\cos\theta",
    "zero": "0",
    "one": "1",
}
#: A sliding joint's rates, the length of a normal, columns of the Jacobian, where letters stand for these.
_OWN = {
    "sliding_velocity": {"v": r"\dot{d}_i"},
    "sliding_acceleration": {"v": r"\dot{d}_i", "a": r"\ddot{d}_i"},
    "interorigin_vector": {"a": "a_i", "d": "d_i"},
    "turned_along": {"w": "z_j", "linear": "v_i", "angular": r"\omega_i"},
    "end_moved": {"z": "z_i", "linear": "v_j"},
    "motion_product": {
        f"{name}_{i}": f"{symbol}_{i}"
        for name, symbol in (("linear", "v"), ("angular", r"\omega"))
        for i in (1, 2)
    },
    "moving_point_velocity": {"u": r"\dot{p}"},
    "moving_point_acceleration": {"u": r"\dot{p}", "b": r"\ddot{p}"},
}

_ATOM, _CROSS, _SUM = 0, 1, 2


@dataclass(frozen=True)
class Word:
    """A piece of LaTeX; `kind` says what its outermost operation is."""

    text: str
    kind: int = _ATOM

    def inside(self, kind: int) -> str:
        """The text as an operand of an operation, in brackets if that binds as tightly."""
        return f"({self.text})" if self.kind >= kind else self.text

    def __neg__(self) -> Word:
        return Word(f"-{self.inside(_SUM)}")

    def __add__(self, other: Word) -> Word:
        return Word(f"{self.text} + {other.text}", _SUM)

    def __sub__(self, other: Word) -> Word:
        return Word(f"{self.text} - {other.inside(_SUM)}", _SUM)

    def __rsub__(self, other: int) -> Word:
        return Word(str(other)) - self

    def __mul__(self, other: Word) -> Word:
        return Word(f"{self.inside(_SUM)} {other.inside(_SUM)}")

    def __rmul__(self, other: int) -> Word:
        return Word(f"{other} {self.inside(_SUM)}")


def _times(c: Word | int, x: Word) -> Word:
    return Word(f"{c if isinstance(c, int) else c.inside(_CROSS)} \\, {x.inside(_SUM)}", x.kind)


def _cross(x: Word, y: Word) -> Word:
    return Word(f"{x.inside(_CROSS)} \\times {y.inside(_CROSS)}", _CROSS)


def _applied(R: Word, x: Word) -> Word:
    return Word(f"{R.inside(_CROSS)} \\, {x.inside(_CROSS)}")


_words = bound(
    plus=lambda x, y: x + y,
    minus=lambda x, y: x - y,
    times=_times,
    cross=_cross,
    rotate=_applied,
    product=_applied,
    dot=lambda x, y: Word(f"{x.inside(_CROSS)} \\cdot {y.inside(_CROSS)}"),
    transposed=lambda R: Word(f"{R.inside(_CROSS)}^T"),
)


def latex(name: str) -> str:
    r"""What an equation's function says.

    Args:
        name: Of a function of `urdfkin.kinematics.equations`.

    >>> print(latex("point_acceleration"))
    \ddot{d} + \dot{\omega} \times d + \omega \times (\omega \times d)
    """
    parameters = inspect.signature(getattr(equations, name)).parameters
    symbols = _SYMBOLS | _OWN.get(name, {})
    return _written(getattr(_words, name)(*(Word(symbols.get(word, word)) for word in parameters)))


def _written(value: Any) -> str:
    """A word; a pair, one above the other; or a matrix row by row."""
    if isinstance(value, Word):
        return value.text
    rows = [" & ".join(map(_written, row)) if isinstance(row, tuple) else _written(row) for row in value]
    return r"\begin{bmatrix} " + r" \\ ".join(rows) + r" \end{bmatrix}"
