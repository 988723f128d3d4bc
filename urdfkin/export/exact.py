"""Make exported functions with exact constants, for computer algebra.

| Number | Exact form |
|---|---|
| constant | the URDF's decimal as a fraction |
| angle that equals a multiple of pi/12 in double precision | pi/2 instead of 1.5707963267948966 |
| rational square root | fraction |
| sine or cosine of a multiple of pi/2 | integer |
| other square root, sine or cosine | expression |
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np

from urdfkin.compiled.plan import ColumnField, CompiledTree, Geometry
from urdfkin.dh.units import format_pi_fraction, pi_fraction
from urdfkin.export.expression import Graph, Node, Number
from urdfkin.export.function import INPUT_LETTERS, Function, make_function
from urdfkin.export.proof import Proof, compare_with_pinocchio
from urdfkin.model.recursion import IDENTITY, ZERO, Matrix, Vector
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray, KinematicTree
from urdfkin.verify.exact.numbers import (
    REFERENCE_DIGITS,
    NumberType,
    as_interval,
    enough_digits,
    precision,
    read_exact_joints,
)
from urdfkin.verify.verifier import Verifier

#: Larger angles (rad) are never replaced by multiples of pi/12. Up to this angle, the distance between
#: neighbouring doubles is far smaller than pi/12.
_MAX_PI_MULTIPLE_ANGLE = 100.0
#: Sine and cosine of 0, pi/2, pi and 3 pi/2.
_RIGHT_ANGLES = ((0, 1), (1, 0), (0, -1), (-1, 0))


@dataclass(frozen=True)
class PiMultiple:
    factor: Fraction

    def __neg__(self) -> PiMultiple:
        return PiMultiple(-self.factor)

    def __lt__(self, other: float) -> bool:
        return self.factor < other

    def __radd__(self, other: Number) -> Number:
        return other.graph.sum(other, self) if isinstance(other, Node) else self  # The other summand is 0.


class ExactGraph(Graph):
    """Expressions with exact constants.

    Attributes:
        pi_multiples: The multiple of each replaced angle.
    """

    zero = 0

    def __init__(self) -> None:
        super().__init__()
        self.pi_multiples: dict[Fraction, PiMultiple] = {}

    def make_node(self, op: str, *operands: Any) -> Node:
        if any(isinstance(x, float) for x in operands):
            raise TypeError(f"an operand of {op} is a double")
        return super().make_node(op, *operands)

    def exact_angle(self, x: Fraction) -> Fraction | PiMultiple:
        """Replace a nonzero multiple of pi/12 in double precision by a `PiMultiple`."""
        factor = pi_fraction(float(x)) if 0 < abs(x) < _MAX_PI_MULTIPLE_ANGLE else None
        return x if factor is None else self.pi_multiples.setdefault(x, PiMultiple(factor))

    def sine_cosine(self, x: Number) -> tuple[Number, Number]:
        if not isinstance(x, Node | PiMultiple):
            x = self.exact_angle(Fraction(x))
        if x == 0:
            return 0, 1
        if isinstance(x, PiMultiple) and (2 * x.factor).denominator == 1:
            return _RIGHT_ANGLES[int(2 * x.factor) % 4]
        return self.make_node("sin", x), self.make_node("cos", x)

    def root(self, x: Number) -> Number:
        if not isinstance(x, Node):
            x = Fraction(x)
            root = Fraction(math.isqrt(x.numerator), math.isqrt(x.denominator))
            if root * root == x:
                return root
        return self.make_node("sqrt", x)


def make_exact_plan(
    graph: ExactGraph, text: str, tree: KinematicTree, plan: CompiledTree, link: int
) -> CompiledTree:
    graph.step = -1
    eq, path = graph.chapter, tree.path(link)
    joints = read_exact_joints(text, tree, path, NumberType(Fraction, graph.sine_cosine, graph.root))
    R, p, rows = IDENTITY, ZERO, list[tuple[Number, ...]]()
    for i in path:
        joint, own = tree.joints[i], joints[i]
        R, p = eq.product(R, own.R), eq.point_position(p, R, own.p)
        if joint.kind.nv:
            A = _rotation_with_z_axis(own.axis, float(joint.axis[2])) if joint.kind.has_axis else IDENTITY
            offset = graph.exact_angle(Fraction(own.offset)) if joint.kind.turns else own.offset
            rows.append((*(x for row in eq.product(R, A) for x in row), *p, own.multiplier, offset))
            R, p = eq.transposed(A), ZERO
    geometry = np.array(rows, dtype=object).reshape(-1, len(plan.geometry.T))
    offsets = np.array([(*(x for row in R for x in row), *p)], dtype=object)
    multipliers = geometry[plan.columns[:, ColumnField.STEP], Geometry.MULTIPLIER]
    return replace(plan, geometry=geometry, offsets=offsets, multipliers=multipliers)


def _rotation_with_z_axis(axis: Vector, z: float) -> Matrix:
    """Compute `rotation_with_z_axis` for an exact unit vector; z is its third component as a float."""
    x, y, own = axis
    sign = 1 if z >= 0.0 else -1
    scale = -1 / (sign + own)
    rows: Matrix = (
        (1 + sign * x * x * scale, x * y * scale, x),
        (sign * x * y * scale, sign + y * y * scale, y),
        (-sign * x, -y, own),
    )
    return rows


def to_interval(x: Number) -> Number:
    if isinstance(x, PiMultiple):
        return as_interval(0).pi() * to_interval(x.factor)
    return as_interval(x.numerator) / x.denominator if isinstance(x, Fraction) else as_interval(x)


_INTERVAL_OPERATIONS: dict[str, Callable[..., Number]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
    "neg": operator.neg,
    "sin": operator.methodcaller("sin"),
    "cos": operator.methodcaller("cos"),
    "sqrt": operator.methodcaller("sqrt"),
}


def evaluate_intervals(function: Function, inputs: Sequence[Sequence[float]]) -> list[Number]:
    values: dict[Any, Number] = {}

    def interval_of(x: Number) -> Number:
        return values[x] if isinstance(x, Node) else to_interval(x)

    for node in function.nodes:
        if node.op in INPUT_LETTERS:
            values[node] = as_interval(inputs[INPUT_LETTERS.index(node.op)][node.operands[0]])
        else:
            values[node] = _INTERVAL_OPERATIONS[node.op](*map(interval_of, node.operands))
    return list(map(interval_of, function.results))


@dataclass(frozen=True)
class ExactProof(Proof):
    """The checks of an exact file.

    Attributes:
        angle_count: Number of different replaced angles.
        max_angle_change: Largest change of an angle, rad.
    """

    angle_count: int = 0
    max_angle_change: float = 0.0

    @property
    def precision_text(self) -> str:
        return f"at {REFERENCE_DIGITS} digits"

    @property
    def constants_text(self) -> str:
        change = f", changed by at most {self.max_angle_change:.1e} rad" if self.angle_count else ""
        angles = f"{self.angle_count} different angles are multiples of pi"
        return f"Constants are the URDF's decimals; {angles}{change}"


def make_exact_functions(
    verifier: Verifier,
    plan_of: Callable[[Sequence[int]], CompiledTree],
    frame: str,
    reference: Reference,
    functions: Sequence[Function],
    proof: Proof,
    verify: bool | None,
) -> tuple[tuple[Function, ...], ExactProof]:
    """Make and check exact functions.

    The test vectors are taken from `proof`.
    """
    tree, found, angles = verifier.tree, list[Function](), dict[Fraction, PiMultiple]()
    with precision(REFERENCE_DIGITS):
        for other in functions:
            graph = ExactGraph()
            plan = make_exact_plan(graph, verifier.text, tree, other.plan, tree.frame_link(frame))
            found.append(make_function(plan, other.quantity, reference, graph))
            angles |= graph.pi_multiples
        max_angle_change = max(
            (float(abs(to_interval(x) - to_interval(y)).upper()) for x, y in angles.items()), default=0.0
        )
    certificate = compare_with_pinocchio(
        verifier, plan_of, frame, reference, found, _evaluate_exactly, verify
    )
    fields = {name: getattr(proof, name) for name in ("sha256", "urdfkin", "vectors", "lock")}
    return tuple(found), ExactProof(
        **fields,
        certificate=certificate,
        single_precision_bounds={},
        angle_count=len(angles),
        max_angle_change=max_angle_change,
    )


def _evaluate_exactly(function: Function, inputs: Sequence[FloatArray]) -> FloatArray:
    """Evaluate with more than `REFERENCE_DIGITS` digits, and return the results (n, ...) as doubles."""
    with precision(REFERENCE_DIGITS + enough_digits(len(function.plan.steps))):
        rows = [
            list(map(float, evaluate_intervals(function, one)))
            for one in zip(*(x.tolist() for x in inputs), strict=True)
        ]
    return np.array(rows).reshape(-1, *function.shape)


def format_exact_literal(x: Number) -> str:
    """Return code such as `Rational(17, 40)`."""
    if isinstance(x, PiMultiple):
        text = format_pi_fraction(abs(x.factor)).replace("pi", "*pi").removeprefix("*")
        return text if x.factor > 0 else f"(-{text})"
    x = Fraction(x)
    return str(x) if x.denominator == 1 else f"Rational({x.numerator}, {x.denominator})"
