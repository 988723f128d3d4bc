"""Make a function of the exported code, and bound the rounding errors of the function.

Each function computes one quantity of one frame. These expressions are assigned to variables:

    an expression that occurs more than once
    a sine, cosine, square root or quotient
    a number of a link's pose, velocity or acceleration
    a part of a long expression

All other expressions are parts of larger expressions.

**Single precision.** `single_bounds` bounds the rounding errors to first order in eps. An operation or
constant of the code has the value x_i with the rounding error e_i (`urdfkin.kinematics.roundings`). A result
y has this error and this bound:

    error = sum of e_i dy/dx_i
    bound = sum of |e_i dy/dx_i|

A backward pass over the operations computes the derivatives.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from urdfkin.compiled.plan import CompiledTree
from urdfkin.export import recursion
from urdfkin.export.expression import Graph, Node, Number, find_dependencies
from urdfkin.kinematics.roundings import (
    SINGLE_EPS,
    SINGLE_LARGEST,
    SINGLE_OPERATION_ERRORS,
    SINGLE_POLYNOMIAL_ERROR,
    SINGLE_SMALLEST,
)
from urdfkin.model.recursion import LinkState
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray
from urdfkin.verify.quantities import Quantity

INPUT_LETTERS = ("q", "v", "a")
_ASSIGNED_OPERATIONS = ("sin", "cos", "sqrt", "/")
#: Maximum number of operations in a statement of exported code.
_MAX_STATEMENT_OPERATIONS = 12
#: Maximum number of results in one backward pass, which limits the memory for the derivatives.
_RESULTS_PER_PASS = 512


@dataclass(frozen=True, eq=False)
class Function:
    """Straight-line code for one quantity.

    Attributes:
        results: Constants and expressions, row by row.
    """

    quantity: Quantity
    reference: Reference
    plan: CompiledTree
    results: tuple[Number, ...]

    @property
    def name(self) -> str:
        return self.quantity.method

    @property
    def inputs(self) -> str:
        """Letters of the inputs: "q", "qv" or "qva"."""
        return self.quantity.inputs

    @property
    def shape(self) -> tuple[int, ...]:
        return self.quantity.result_shape(self.plan.nv)

    @cached_property
    def nodes(self) -> list[Node]:
        """Expressions of the results, operands first."""
        return find_dependencies(self.results)

    @cached_property
    def operation_count(self) -> int:
        return sum(node.op not in (*INPUT_LETTERS, "neg") for node in self.nodes)

    @cached_property
    def angles(self) -> list[Node]:
        found = (node.operands[0] for node in self.nodes if node.op in ("sin", "cos"))
        return list(dict.fromkeys(found))

    @cached_property
    def statements(self) -> list[Node]:
        uses = Counter[Node]()
        for value in self.results:
            if isinstance(value, Node):
                uses[_strip_minus(value)] += 1
        for node in self.nodes:
            if node.op != "neg":
                uses.update(map(_strip_minus, node.operand_nodes))
        found, length = list[Node](), dict[Node, int]()
        for node in self.nodes:
            length[node] = 1 + sum(length[x] for x in node.operand_nodes)
            if node.op in INPUT_LETTERS or node.op == "neg":
                length[node] = 0 if node.op in INPUT_LETTERS else length[node.operands[0]]
            elif (
                node.name
                or uses[node] > 1
                or node.op in _ASSIGNED_OPERATIONS
                or length[node] > _MAX_STATEMENT_OPERATIONS
            ):
                found.append(node)
                length[node] = 0
        return found

    def dependencies_without(self, leaves: Collection[str]) -> set[Node]:
        return set(find_dependencies(self.results, leaves))

    def node_values(self, inputs: Sequence[FloatArray]) -> dict[Node, FloatArray]:
        """Return each expression's values (n,) for q (n, nq), v and a (n, nv)."""
        value: dict[Node, Any] = {}
        arrays = dict(zip(INPUT_LETTERS, inputs, strict=False))
        for node in self.nodes:
            if node.op in arrays:
                value[node] = arrays[node.op][:, node.operands[0]]
            else:
                value[node] = _OPERATIONS[node.op](
                    *(value[x] if isinstance(x, Node) else x for x in node.operands)
                )
        return value

    def evaluate(self, inputs: Sequence[FloatArray]) -> FloatArray:
        """Return the results (n, ...) for q (n, nq), v and a (n, nv)."""
        value = self.node_values(inputs)
        out = np.empty((len(inputs[0]), len(self.results)))
        for k, x in enumerate(self.results):
            out[:, k] = value[x] if isinstance(x, Node) else x
        return out.reshape(len(out), *self.shape)


_OPERATIONS: dict[str, Callable[..., Any]] = {
    "+": np.add,
    "-": np.subtract,
    "*": np.multiply,
    "/": np.divide,
    "neg": np.negative,
    "sin": np.sin,
    "cos": np.cos,
    "sqrt": np.sqrt,
}
#: Derivatives of an operation's value with respect to its operands.
_SLOPES: dict[str, Callable[..., tuple[FloatArray | float, ...]]] = {
    "+": lambda value, x, y: (1.0, 1.0),
    "-": lambda value, x, y: (1.0, -1.0),
    "*": lambda value, x, y: (y, x),
    "/": lambda value, x, y: (1.0 / y, -value / y),
    "neg": lambda value, x: (-1.0,),
    "sin": lambda value, x: (np.cos(x),),
    "cos": lambda value, x: (-np.sin(x),),
    "sqrt": lambda value, x: (0.5 / value,),
}


def _strip_minus(node: Node) -> Node:
    """Return x for -x, because exported code stores x and negates it at each use."""
    return node.operands[0] if node.op == "neg" else node


def make_function(
    plan: CompiledTree, quantity: Quantity, reference: Reference, graph: Graph | None = None
) -> Function:
    """Make the function of one frame.

    If `plan` contains expressions, `graph` must contain the same expressions.
    """
    graph = graph or Graph()

    def begin_step(step: int) -> None:
        graph.step = step

    kind = recursion.NumberKind(graph.chapter, graph.sine_cosine, graph.root, begin_step, _name_nodes)
    inputs = [
        [graph.make_input(letter, i) for i in range(plan.nq if letter == "q" else plan.nv)]
        if letter in quantity.inputs
        else [0.0] * plan.nv
        for letter in INPUT_LETTERS
    ]
    results = recursion.QUANTITY_FUNCTIONS[quantity.name](plan, kind, inputs, reference)
    # The sum with 0.0 turns -0.0 into 0.0.
    return Function(
        quantity, reference, plan, tuple(x + 0.0 if isinstance(x, int | float) else x for x in results)
    )


def _name_nodes(step: int, state: LinkState) -> None:
    """Name nodes, for example `w2_z`."""
    named = {f"R{step + 1}_{r}{c}": x for r, row in enumerate(state.R) for c, x in enumerate(row)}
    for letter in ("p", "w", "vel", "alpha", "acc"):
        vector = getattr(state, letter)
        named |= {f"{letter}{step + 1}_{axis}": x for axis, x in zip("xyz", vector, strict=True)}
    for name, x in named.items():
        if isinstance(x, Node) and x.op in ("+", "-", "*") and not x.name:
            x.name = name


# -- rounding errors in single precision ------------------------------------------------------------------


@np.errstate(all="ignore")
def single_bounds(function: Function, inputs: Sequence[FloatArray]) -> FloatArray:
    """Bound the errors (n, results) in single precision.

    The unit is eps = 2^-23. The inputs must be single-precision numbers. The bound does not include the
    errors of the double-precision constants. The bound is inf if single precision overflows.
    """
    value = function.node_values(inputs)
    bounds = np.zeros((len(inputs[0]), len(function.results)))
    for first in range(0, bounds.shape[1], _RESULTS_PER_PASS):
        part = slice(first, first + _RESULTS_PER_PASS)
        bounds[:, part] = _bounds_of_results(function, value, function.results[part], len(bounds))
    return bounds


def _bounds_of_results(
    function: Function, value: dict[Node, FloatArray], results: Sequence[Number], n: int
) -> FloatArray:
    bound, slopes = np.zeros((n, len(results))), dict[Node, FloatArray]()

    def add_derivative(x: Number, slope: FloatArray, columns: slice | int) -> None:
        """Add `slope` to the derivatives with respect to x; for a constant x, add its error to the bounds."""
        if not isinstance(x, Node):
            bound[:, columns] += np.abs(slope) * _constant_error(x)
        elif x in slopes:
            slopes[x][:, columns] += slope
        else:
            slopes[x] = np.zeros_like(bound)
            slopes[x][:, columns] = slope

    for k, x in enumerate(results):
        add_derivative(x, np.ones(n), k)
    for node in reversed(function.nodes):
        if (slope := slopes.pop(node, None)) is None:
            continue
        bound += np.abs(slope) * _operation_error(node, value[node])[:, np.newaxis]
        if node.op not in INPUT_LETTERS:
            operands = [value[x] if isinstance(x, Node) else x for x in node.operands]
            for x, factor in zip(node.operands, _SLOPES[node.op](value[node], *operands), strict=True):
                add_derivative(x, slope * np.reshape(factor, (-1, 1)), slice(None))
    return np.where(np.isnan(bound), np.inf, bound)


def _operation_error(node: Node, x: FloatArray) -> FloatArray:
    """Return the rounding errors (n,) of the node's operation with the results x, in eps = 2^-23."""
    size = np.abs(x)
    if node.op in INPUT_LETTERS:
        error = np.zeros_like(size)
    elif node.op in ("sin", "cos"):
        error = np.maximum(SINGLE_OPERATION_ERRORS[node.op] * size, SINGLE_POLYNOMIAL_ERROR)
    else:
        error = SINGLE_OPERATION_ERRORS[node.op] * size
    return _add_range_error(error, size)


def _constant_error(x: float) -> float:
    """Return the error of a constant that is rounded to single precision, in eps = 2^-23."""
    size = np.abs(x)
    return float(_add_range_error(np.abs(float(np.float32(x)) - x) / SINGLE_EPS, size))


def _add_range_error(error: FloatArray, size: FloatArray) -> FloatArray:
    """Add the error of a possible underflow. The error is inf if `size` overflows in single precision."""
    small = np.where((size > 0.0) & (size < 2.0 * SINGLE_SMALLEST), SINGLE_SMALLEST / SINGLE_EPS, 0.0)
    return np.where(size <= SINGLE_LARGEST, error + small, np.inf)
