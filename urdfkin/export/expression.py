"""A number that writes code: arithmetic on it makes a graph of expressions instead of a result.

The chapter's equations (`urdfkin.kinematics.equations`) run on it as on any other kind of number. What is
known is folded as it comes: constants are Python's floats, products with 0 and 1 and sums with 0 are gone, a
minus is drawn out of products and into differences, and an expression that was made before is the same node
again. So sine and cosine of each joint stand in the graph once, and whatever else two equations share.

>>> graph = Graph()
>>> x, y = graph.input("q", 0), graph.input("q", 1)
>>> 0.0 * x + y * 1.0 is y, x * y is y * x, x - x
(True, True, 0.0)
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from functools import wraps
from typing import Any

from urdfkin.kinematics.number_kinds import bound

#: A number of an equation that runs on the graph: known, or an expression.
Number = Any
_EQUATIONS = re.compile(r"(?:7\.\d+(?:, )?)+")


class Node:
    """An expression: an input, or an operation on others; made by a graph and by arithmetic.

    Attributes:
        op: "q", "v" or "a" for an input; "+", "-", "*", "/", "neg", "sin", "cos" or "sqrt".
        of: What it is made of, nodes and constants; an input's place.
        index: When it was made: nothing is made before what it is made of.
        place: At which step of the walk it was made.
        equation: The numbers of the equation that made it, if one has them.
        name: What to call it; "" where nobody asks.
    """

    __slots__ = ("equation", "graph", "index", "name", "of", "op", "place")

    def __init__(self, graph: Graph, op: str, of: tuple[Any, ...], index: int) -> None:
        self.graph, self.op, self.of, self.index = graph, op, of, index
        self.place, self.equation, self.name = graph.place, graph.equation, ""

    def __add__(self, other: Number) -> Number:
        return self.graph.sum(self, other)

    def __radd__(self, other: Number) -> Number:
        return self.graph.sum(other, self)

    def __sub__(self, other: Number) -> Number:
        return self.graph.difference(self, other)

    def __rsub__(self, other: Number) -> Number:
        return self.graph.difference(other, self)

    def __mul__(self, other: Number) -> Number:
        return self.graph.product(self, other)

    def __rmul__(self, other: Number) -> Number:
        return self.graph.product(other, self)

    def __truediv__(self, other: Number) -> Number:
        return self.graph.made("/", self, other)

    def __neg__(self) -> Number:
        return self.of[0] if self.op == "neg" else self.graph.made("neg", self)

    @property
    def operands(self) -> list[Node]:
        """The expressions it is made of."""
        return [x for x in self.of if isinstance(x, Node)]


class Graph:
    """The expressions of one function.

    Attributes:
        place: At which step the walk is.
        equation: The numbers of the equation that runs.
        chapter: The equations, which note their numbers on what they make.
    """

    def __init__(self) -> None:
        self._made: dict[tuple[Any, ...], Node] = {}
        self.place, self.equation = 0, ""
        self.chapter: Any = bound(made=self._noting)

    def input(self, letter: str, place: int) -> Node:
        """Number `place` of q, v or a."""
        return self.made(letter, place)

    def made(self, op: str, *of: Any) -> Node:
        """The node of an operation, made once."""
        key = (op, *of)
        if (node := self._made.get(key)) is None:
            node = self._made[key] = Node(self, op, of, len(self._made))
        return node

    def sine_cosine(self, x: Number) -> tuple[Number, Number]:
        """Of an angle that may be known."""
        if not isinstance(x, Node):
            return math.sin(x), math.cos(x)
        return self.made("sin", x), self.made("cos", x)

    def root(self, x: Number) -> Number:
        """The square root."""
        return self.made("sqrt", x) if isinstance(x, Node) else math.sqrt(x)

    def sum(self, x: Number, y: Number) -> Number:
        """X + y."""
        if _is(x, 0.0) or _is(y, 0.0):
            return y if _is(x, 0.0) else x
        if (positive := _negated(y)) is not None:
            return self.difference(x, positive)
        if (positive := _negated(x)) is not None:
            return self.difference(y, positive)
        return self.made("+", *_ordered(x, y))

    def difference(self, x: Number, y: Number) -> Number:
        """X - y."""
        if x is y or _is(y, 0.0):
            return 0.0 if x is y else x
        if _is(x, 0.0):
            return -y
        if (positive := _negated(y)) is not None:
            return self.sum(x, positive)
        if (positive := _negated(x)) is not None:
            return -self.sum(positive, y)
        if (other := self._made.get(("-", y, x))) is not None:
            return -other
        return self.made("-", x, y)

    def product(self, x: Number, y: Number) -> Number:
        """X y."""
        if _is(x, 0.0) or _is(y, 0.0):
            return 0.0
        for one, other in ((x, y), (y, x)):
            if _is(one, 1.0):
                return other
            if (positive := _negated(one)) is not None:
                return -(positive * other)
        return self.made("*", *_ordered(x, y))

    def _noting(self, equation: Callable[..., Any]) -> Callable[..., Any]:
        """An equation that notes its numbers on what it makes, unless another called it."""
        found = _EQUATIONS.match(equation.__doc__ or "")
        if found is None:
            return equation
        numbers = found[0].rstrip(", ")

        @wraps(equation)
        def noting(*arguments: Any) -> Any:
            if self.equation:
                return equation(*arguments)
            self.equation = numbers
            try:
                return equation(*arguments)
            finally:
                self.equation = ""

        return noting


def _is(x: Number, value: float) -> bool:
    return not isinstance(x, Node) and x == value


def _negated(x: Number) -> Number:
    """`y` where x is -y, y no negative constant itself; else None."""
    if isinstance(x, Node):
        return x.of[0] if x.op == "neg" else None
    return -x if x < 0.0 else None


def _ordered(x: Number, y: Number) -> tuple[Number, Number]:
    """The same for x, y and y, x: a constant first, then what was made first."""
    first, second = sorted((x, y), key=lambda z: z.index if isinstance(z, Node) else -1)
    return first, second


def needed(results: Sequence[Number]) -> list[Node]:
    """The expressions that some numbers are made of, and they themselves, as they were made one by one."""
    waiting, seen = [x for x in results if isinstance(x, Node)], set[Node]()
    while waiting:
        if (node := waiting.pop()) not in seen:
            seen.add(node)
            waiting += node.operands
    return sorted(seen, key=lambda node: node.index)
