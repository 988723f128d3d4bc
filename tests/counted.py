"""Numbers that remember each of their roundings: the equations' own text says how it rounds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import count

import numpy as np

from urdfkin.kinematics.arithmetic import bound
from urdfkin.model.tree import FloatArray

_NEW = count()


@dataclass(frozen=True)
class Counted:
    """A double; what each rounding so far did to it at most, in u = eps/2, to first order; whether sums fuse.

    A product that is fused waits for the sum that it meets, as in `urdfkin.compiled.machine.numbers`.
    """

    value: float
    errors: dict[int, float] = field(default_factory=dict)
    fused: bool = False
    waits: bool = False

    def rounded(self) -> Counted:
        """As it stands in a register: what is rounded may be off by u of itself."""
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
        if isinstance(other, int):  # 0, 1 and 2 round nothing
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
        """A function of the number, rounded."""
        x = self._number()
        return Counted(value, {k: slope * e for k, e in x.errors.items()}, self.fused).rounded()


Vector = tuple[Counted, Counted, Counted]
Matrix = tuple[Vector, Vector, Vector]
eq = bound()


def matrix(R: FloatArray, *, fused: bool) -> Matrix:
    """Exact numbers."""
    return tuple(tuple(Counted(float(x), fused=fused) for x in row) for row in R)  # type: ignore[return-value]


def sine_cosine(angle: float, *, fused: bool) -> tuple[Counted, Counted]:
    """Right to half a unit in the last place."""
    return tuple(Counted(f(angle), fused=fused).rounded() for f in (math.sin, math.cos))  # type: ignore[return-value]


def unit(x: Sequence[Counted]) -> list[Counted]:
    """Divided by its length."""
    squares = x[0] * x[0]
    for c in x[1:]:
        squares = squares + c * c
    length = squares.of(math.sqrt(squares.value), 0.5 / math.sqrt(squares.value))
    inverse = Counted(1.0 / length.value, {k: -e / length.value**2 for k, e in length.errors.items()})
    return [c * inverse for c in x]


def rows_of(R: Matrix) -> list[FloatArray]:
    """For each row, what each rounding does to its three numbers, in eps: (roundings, 3)."""
    found = []
    for row in R:
        numbers = [x.rounded() if x.waits else x for x in row]
        keys = sorted(set().union(*(x.errors for x in numbers)))
        found.append(0.5 * np.array([[x.errors.get(k, 0.0) for x in numbers] for k in keys]))
    return found


def all_conspiring(R: Matrix) -> float:
    """How far a number of a turned unit vector may be off, in eps: all signs as they hurt most."""
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
    """The same where each rounding is anything up to its half unit, independently: the standard deviation."""
    return max(math.sqrt(np.linalg.eigvalsh(E.T @ E)[-1] / 3.0) for E in rows_of(R))
