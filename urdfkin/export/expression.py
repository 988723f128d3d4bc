"""Symbolic numbers for exported code.

Arithmetic with symbolic numbers creates a graph of expressions. The equations of
`urdfkin.kinematics.equations` accept symbolic numbers instead of floats. The graph simplifies each new
expression:

| Expression | Simplified expression |
|---|---|
| operation on constants (floats) | float |
| product with 0 or 1, sum with 0 | 0, or the other number |
| (-x) y | -(x y) |
| x + (-y) | x - y |
| equal expressions | the same node |

The sine and the cosine of each joint therefore occur once.

>>> graph = Graph()
>>> x, y = graph.make_input("q", 0), graph.make_input("q", 1)
>>> 0.0 * x + y * 1.0 is y, x * y is y * x, x - x
(True, True, 0.0)
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Sequence
from functools import wraps
from typing import Any

from urdfkin.kinematics.arithmetic import bind_equations

#: A number in an equation is a float or a node of the graph.
Number = Any
_EQUATION_NUMBERS = re.compile(r"(?:7\.\d+(?:, )?)+")


class Node:
    """An input or an operation.

    Attributes:
        op: "q", "v" or "a" for an input; "+", "-", "*", "/", "neg", "sin", "cos" or "sqrt".
        operands: Operands of the operation, as nodes or constants. An input has one operand, its index.
        index: Number in the order of creation. Operands have smaller numbers than the operation.
        step: Index of the recursion's step. The steps are the joints, the frame and the results, in this
            order. Exact constants have the step -1.
    """

    __slots__ = ("equation", "graph", "index", "name", "op", "operands", "step")

    def __init__(self, graph: Graph, op: str, operands: tuple[Any, ...], index: int) -> None:
        self.graph, self.op, self.operands, self.index = graph, op, operands, index
        self.step, self.equation, self.name = graph.step, graph.equation, ""

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
        return self.graph.make_node("/", self, other)

    def __rtruediv__(self, other: Number) -> Number:
        return other if _equals(other, 0.0) else self.graph.make_node("/", other, self)

    def __neg__(self) -> Number:
        return self.operands[0] if self.op == "neg" else self.graph.make_node("neg", self)

    @property
    def operand_nodes(self) -> list[Node]:
        return [x for x in self.operands if isinstance(x, Node)]


class Graph:
    """The expressions of one function."""

    #: Constant that replaces products with 0 and differences x - x.
    zero: float = 0.0

    def __init__(self) -> None:
        self._nodes: dict[tuple[Any, ...], Node] = {}
        self.step, self.equation = 0, ""
        self.chapter: Any = bind_equations(decorate=self._record_equation_numbers)

    def make_input(self, letter: str, index: int) -> Node:
        return self.make_node(letter, index)

    def make_node(self, op: str, *operands: Any) -> Node:
        """Return the node of an operation. Equal operations share a node."""
        key = (op, *operands)
        if (node := self._nodes.get(key)) is None:
            node = self._nodes[key] = Node(self, op, operands, len(self._nodes))
        return node

    def sine_cosine(self, x: Number) -> tuple[Number, Number]:
        if not isinstance(x, Node):
            return math.sin(x), math.cos(x)
        return self.make_node("sin", x), self.make_node("cos", x)

    def root(self, x: Number) -> Number:
        return self.make_node("sqrt", x) if isinstance(x, Node) else math.sqrt(x)

    def sum(self, x: Number, y: Number) -> Number:
        if _equals(x, 0.0) or _equals(y, 0.0):
            return y if _equals(x, 0.0) else x
        if (positive := _negated_operand(y)) is not None:
            return self.difference(x, positive)
        if (positive := _negated_operand(x)) is not None:
            return self.difference(y, positive)
        return self.make_node("+", *_sort_operands(x, y))

    def difference(self, x: Number, y: Number) -> Number:
        if x is y or _equals(y, 0.0):
            return self.zero if x is y else x
        if _equals(x, 0.0):
            return -y
        if (positive := _negated_operand(y)) is not None:
            return self.sum(x, positive)
        if (positive := _negated_operand(x)) is not None:
            return -self.sum(positive, y)
        if (other := self._nodes.get(("-", y, x))) is not None:
            return -other
        return self.make_node("-", x, y)

    def product(self, x: Number, y: Number) -> Number:
        if _equals(x, 0.0) or _equals(y, 0.0):
            return self.zero
        for one, other in ((x, y), (y, x)):
            if _equals(one, 1.0):
                return other
            if (positive := _negated_operand(one)) is not None:
                return -(positive * other)
        return self.make_node("*", *_sort_operands(x, y))

    def _record_equation_numbers(self, equation: Callable[..., Any]) -> Callable[..., Any]:
        """Wrap an equation, so that each new node stores the number of the outermost equation."""
        found = _EQUATION_NUMBERS.match(equation.__doc__ or "")
        if found is None:
            return equation
        numbers = found[0].rstrip(", ")

        @wraps(equation)
        def numbered_equation(*arguments: Any) -> Any:
            if self.equation:
                return equation(*arguments)
            self.equation = numbers
            try:
                return equation(*arguments)
            finally:
                self.equation = ""

        return numbered_equation


def _equals(x: Number, value: float) -> bool:
    return not isinstance(x, Node) and x == value


def _negated_operand(x: Number) -> Number:
    """Return -x if x is a negation or a negative constant, otherwise None."""
    if isinstance(x, Node):
        return x.operands[0] if x.op == "neg" else None
    return -x if x < 0.0 else None


def _sort_operands(x: Number, y: Number) -> tuple[Number, Number]:
    """Sort operands of a commutative operation, so that x + y and y + x are the same node."""
    first, second = sorted((x, y), key=lambda z: z.index if isinstance(z, Node) else -1)
    return first, second


def find_dependencies(results: Sequence[Number], leaves: Collection[str] = ()) -> list[Node]:
    """Return all nodes that the results depend on.

    Operations in `leaves` are treated as inputs.
    """
    waiting, seen = [x for x in results if isinstance(x, Node)], set[Node]()
    while waiting:
        if (node := waiting.pop()) not in seen:
            seen.add(node)
            waiting += [] if node.op in leaves else node.operand_nodes
    return sorted(seen, key=lambda node: node.index)
