"""LaTeX text of the textbook's equations.

The module calls the functions of `equations` with LaTeX expressions as arguments.
"""

from __future__ import annotations

import inspect
from dataclasses import dataclass
from typing import Any

from urdfkin.kinematics import equations
from urdfkin.kinematics.arithmetic import bind_equations

#: LaTeX symbol of the textbook for each parameter name in `equations`. If a parameter has no entry, its name
#: is the LaTeX symbol.
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
#: LaTeX symbols that apply only to the parameters of one function, by function name. These symbols override
#: `_SYMBOLS`.
_SYMBOLS_BY_FUNCTION = {
    "sliding_velocity": {"v": r"\dot{d}_i"},
    "sliding_acceleration": {"v": r"\dot{d}_i", "a": r"\ddot{d}_i"},
    "interorigin_vector": {"a": "a_i", "d": "d_i"},
    "derivative_by_earlier_joint": {"w": "z_j", "linear": "v_i", "angular": r"\omega_i"},
    "derivative_by_later_joint": {"z": "z_i", "linear": "v_j"},
    "motion_product": {
        "linear_1": "v_1",
        "linear_2": "v_2",
        "angular_1": r"\omega_1",
        "angular_2": r"\omega_2",
    },
    "moving_point_velocity": {"u": r"\dot{p}"},
    "moving_point_acceleration": {"u": r"\dot{p}", "b": r"\ddot{p}"},
}

_ATOM, _CROSS, _SUM = 0, 1, 2


@dataclass(frozen=True)
class LatexTerm:
    text: str
    kind: int = _ATOM  #: `_ATOM`, `_CROSS` or `_SUM`.

    def add_brackets(self, kind: int) -> str:
        return f"({self.text})" if self.kind >= kind else self.text

    def __neg__(self) -> LatexTerm:
        return LatexTerm(f"-{self.add_brackets(_SUM)}")

    def __add__(self, other: LatexTerm) -> LatexTerm:
        return LatexTerm(f"{self.text} + {other.text}", _SUM)

    def __sub__(self, other: LatexTerm) -> LatexTerm:
        return LatexTerm(f"{self.text} - {other.add_brackets(_SUM)}", _SUM)

    def __rsub__(self, other: int) -> LatexTerm:
        return LatexTerm(str(other)) - self

    def __mul__(self, other: LatexTerm) -> LatexTerm:
        return LatexTerm(f"{self.add_brackets(_SUM)} {other.add_brackets(_SUM)}")

    def __rmul__(self, other: int) -> LatexTerm:
        return LatexTerm(f"{other} {self.add_brackets(_SUM)}")


def _times(c: LatexTerm | int, x: LatexTerm) -> LatexTerm:
    return LatexTerm(
        f"{c if isinstance(c, int) else c.add_brackets(_CROSS)} \\, {x.add_brackets(_SUM)}", x.kind
    )


def _cross(x: LatexTerm, y: LatexTerm) -> LatexTerm:
    return LatexTerm(f"{x.add_brackets(_CROSS)} \\times {y.add_brackets(_CROSS)}", _CROSS)


def _rotate(R: LatexTerm, x: LatexTerm) -> LatexTerm:
    return LatexTerm(f"{R.add_brackets(_CROSS)} \\, {x.add_brackets(_CROSS)}")


_latex_equations = bind_equations(
    plus=lambda x, y: x + y,
    minus=lambda x, y: x - y,
    times=_times,
    cross=_cross,
    rotate=_rotate,
    product=_rotate,
    dot=lambda x, y: LatexTerm(f"{x.add_brackets(_CROSS)} \\cdot {y.add_brackets(_CROSS)}"),
    transposed=lambda R: LatexTerm(f"{R.add_brackets(_CROSS)}^T"),
)


def latex(name: str) -> str:
    r"""Return the LaTeX text of a function in `urdfkin.kinematics.equations`.

    >>> print(latex("point_acceleration"))
    \ddot{d} + \dot{\omega} \times d + \omega \times (\omega \times d)
    """
    parameters = inspect.signature(getattr(equations, name)).parameters
    symbols = _SYMBOLS | _SYMBOLS_BY_FUNCTION.get(name, {})
    terms = (LatexTerm(symbols.get(parameter, parameter)) for parameter in parameters)
    return _latex_of(getattr(_latex_equations, name)(*terms))


def _latex_of(value: Any) -> str:
    """Return a term, column (tuple of terms) or matrix (tuple of rows) as LaTeX."""
    if isinstance(value, LatexTerm):
        return value.text
    rows = [" & ".join(map(_latex_of, row)) if isinstance(row, tuple) else _latex_of(row) for row in value]
    return r"\begin{bmatrix} " + r" \\ ".join(rows) + r" \end{bmatrix}"
