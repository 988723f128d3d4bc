"""Numbers that record each rounding error of the equations that compute with them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import count

import numpy as np

from urdfkin.kinematics.arithmetic import bind_equations
from urdfkin.model.tree import FloatArray

_NEW = count()


@dataclass(frozen=True)
class Counted:
    """A double with the largest first-order effect of each earlier rounding, in u = eps/2.

    Attributes:
        errors: Effect of each rounding, by the number of the rounding.
        fused: Whether a product is rounded only in the next sum, as in `urdfkin.compiled.machine.numbers`.
        waits: Whether the number is a product that is not rounded yet.
    """

    value: float
    errors: dict[int, float] = field(default_factory=dict)
    fused: bool = False
    waits: bool = False

    def rounded(self) -> Counted:
        """Return the number with one more rounding, whose error is at most u times the value."""
        new = {next(_NEW): abs(self.value)} if self.value else {}
        return Counted(self.value, self.errors | new, self.fused)

    def _number(self) -> Counted:
        return self.rounded() if self.waits else self

    def _sum(self, other: Counted | int, sign: float) -> Counted:
        if isinstance(other, int):
            other = Counted(float(other), fused=self.fused)
        x, y = (self._number(), other) if other.waits else (self, other._number())
        if not y.value and not y.errors:
            return x
        errors = {k: x.errors.get(k, 0.0) + sign * y.errors.get(k, 0.0) for k in x.errors | y.errors}
        return Counted(x.value + sign * y.value, errors, self.fused).rounded()

    def __add__(self, other: Counted | int) -> Counted:
        return self._sum(other, 1.0)

    def __sub__(self, other: Counted | int) -> Counted:
        return self._sum(other, -1.0)

    def __rsub__(self, other: int) -> Counted:
        return -self + other

    def __neg__(self) -> Counted:
        return Counted(-self.value, {k: -e for k, e in self.errors.items()}, self.fused, self.waits)

    def __mul__(self, other: Counted | int) -> Counted:
        if isinstance(other, int):  # products with 0, 1 and 2 are exact
            scaled = {k: other * e for k, e in self.errors.items()} if other else {}
            return Counted(other * self.value, scaled, self.fused, self.waits)
        x, y = self._number(), other._number()
        errors = {
            k: y.value * x.errors.get(k, 0.0) + x.value * y.errors.get(k, 0.0) for k in x.errors | y.errors
        }
        product = Counted(x.value * y.value, errors, self.fused, waits=True)
        return product if self.fused else product.rounded()

    __radd__, __rmul__ = __add__, __mul__

    def of(self, value: float, slope: float) -> Counted:
        """Return the rounded value of a function with the derivative `slope` at the number."""
        x = self._number()
        return Counted(value, {k: slope * e for k, e in x.errors.items()}, self.fused).rounded()


Vector = tuple[Counted, Counted, Counted]
Matrix = tuple[Vector, Vector, Vector]
eq = bind_equations()


def matrix(R: FloatArray, *, fused: bool) -> Matrix:
    """Return a matrix of exact numbers."""
    return tuple(tuple(Counted(float(x), fused=fused) for x in row) for row in R)  # type: ignore[return-value]


def sine_cosine(angle: float, *, fused: bool) -> tuple[Counted, Counted]:
    """Return sine and cosine, correctly rounded."""
    return tuple(Counted(f(angle), fused=fused).rounded() for f in (math.sin, math.cos))  # type: ignore[return-value]


def unit(x: Sequence[Counted]) -> list[Counted]:
    """Return the vector divided by its length."""
    squares = x[0] * x[0]
    for c in x[1:]:
        squares = squares + c * c
    length = squares.of(math.sqrt(squares.value), 0.5 / math.sqrt(squares.value))
    inverse = Counted(1.0 / length.value, {k: -e / length.value**2 for k, e in length.errors.items()})
    return [c * inverse for c in x]


def rows_of(R: Matrix) -> list[FloatArray]:
    """Return the effects (roundings, 3) of the roundings on the numbers of each row, in eps."""
    found = []
    for row in R:
        numbers = [x.rounded() if x.waits else x for x in row]
        keys = sorted(set().union(*(x.errors for x in numbers)))
        found.append(0.5 * np.array([[x.errors.get(k, 0.0) for x in numbers] for k in keys]))
    return found


def all_conspiring(R: Matrix) -> float:
    """Return the largest error (eps) of a component of a rotated unit vector, for the worst signs.

    For each row, the function alternates between the best direction and the worst signs from five directions.
    """
    worst = 0.0
    for E in rows_of(R):
        for start in np.vstack((np.eye(3), [[1.0, 1.0, 1.0], [1.0, -1.0, 1.0]])):
            direction, size = start, -1.0
            while (reached := np.sign(E @ direction) @ E) @ reached > size + 1e-12:
                size = float(reached @ reached)
                direction = reached
            worst = max(worst, math.sqrt(max(size, 0.0)))
    return worst


def deviation(R: Matrix) -> float:
    """Return the error's standard deviation (eps), for independent, uniformly distributed roundings."""
    return max(math.sqrt(np.linalg.eigvalsh(E.T @ E)[-1] / 3.0) for E in rows_of(R))
