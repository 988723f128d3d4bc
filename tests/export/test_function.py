"""Exported expressions and formulas agree with Pinocchio, and contain no operation twice."""

import math
import re
from collections.abc import Callable, Iterable
from copy import copy
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import urdfkin
from scripts.benchmarking.operations import count_operations
from tests.export.writing import ALL, code
from tests.laws.subjects import robot_of, state
from urdfkin.compiled.plan import CompiledTree
from urdfkin.export import write
from urdfkin.export.code import exportable_quantities
from urdfkin.export.expression import Graph, Node, find_dependencies
from urdfkin.export.function import Function, make_function
from urdfkin.export.proof import PROOF_SAMPLES
from urdfkin.kinematics import equations
from urdfkin.model.configuration import draw_samples
from urdfkin.model.reference import Reference
from urdfkin.robot import Robot
from urdfkin.verify.call import Call
from urdfkin.verify.quantities import ACCELERATION, JACOBIAN

INPUT_LETTERS = (0.7, -1.3, 2.9)
_OPERATIONS: dict[str, Callable[..., Any]] = {
    "+": lambda x, y: x + y, "-": lambda x, y: x - y, "*": lambda x, y: x * y, "neg": lambda x: -x,
    "sin": math.sin, "cos": math.cos,
}  # fmt: skip


def value(x: Any) -> float:
    """Return the value of an expression for `INPUT_LETTERS`."""
    if not isinstance(x, Node):
        return float(x)
    if x.op == "q":
        return INPUT_LETTERS[x.operands[0]]
    return float(_OPERATIONS[x.op](*map(value, x.operands)))


@st.composite
def written(draw: st.DrawFn) -> list[tuple[str, int, int]]:
    """Draw operations, each on two of the earlier numbers."""
    letters = st.sampled_from("+-*n")
    return [(draw(letters), draw(st.integers(0, 30)), draw(st.integers(0, 30))) for _ in range(12)]


def done(steps: list[tuple[str, int, int]], inputs: Iterable[Any]) -> list[Any]:
    """Return the results of the operations, on constants and inputs."""
    numbers = [0.0, 1.0, -1.0, 0.5, *inputs]
    for op, i, k in steps:
        x, y = numbers[i % len(numbers)], numbers[k % len(numbers)]
        numbers.append(-x if op == "n" else _OPERATIONS[op](x, y))
    return numbers


@pytest.mark.slow
@given(written())
def test_an_expression_has_the_value_of_its_arithmetic(steps: list[tuple[str, int, int]]) -> None:
    graph = Graph()
    numbers, plain = (
        done(steps, three) for three in ((graph.make_input("q", i) for i in range(3)), INPUT_LETTERS)
    )
    for found, expected in zip(numbers, plain, strict=True):
        assert abs(value(found) - expected) <= 1e-13 * max(map(abs, plain))


@pytest.mark.slow
@given(written())
def test_a_graph_contains_no_redundant_operation(steps: list[tuple[str, int, int]]) -> None:
    graph = Graph()
    for node in find_dependencies(done(steps, (graph.make_input("q", i) for i in range(3)))):
        constants = [x for x in node.operands if not isinstance(x, Node)]
        if node.op in "+-*":
            assert len(constants) < 2
            assert 0.0 not in constants
            assert all(x > 0.0 for x in constants)
            assert not any(x.op == "neg" for x in node.operand_nodes)
        if node.op == "*":
            assert 1.0 not in constants
        if node.op == "neg":
            assert node.operand_nodes[0].op != "neg"


def test_equal_expressions_are_the_same_node() -> None:
    graph = Graph()
    x, y, z = (graph.make_input("q", i) for i in range(3))
    assert x * y + z is z + y * x
    difference = y - x
    assert (x - y).operands == (difference,), "turned round it is the same with a minus"
    assert (-x) * y is -(x * y)
    assert graph.sine_cosine(x)[0] is graph.sine_cosine(x)[0]


def test_each_operation_of_an_equation_records_the_numbers_of_the_equation() -> None:
    graph = Graph()
    x = tuple(graph.make_input("q", i) for i in range(3))
    y = tuple(graph.make_input("v", i) for i in range(3))
    turned = graph.chapter.point_acceleration(x, x, y, x)
    assert {node.equation for node in find_dependencies(turned) if node.op in "+-*"} == {"7.123, 7.130"}
    assert graph.chapter.plus(x, y)[0].equation == ""
    assert "7.123, 7.130" in str(equations.point_acceleration.__doc__)


ODD = (
    "floating_root", "planar_and_floating_in_the_middle", "two_floating_in_a_row", "mimic_hand_40_sliding",
    "followers_of_followers", "sizes", "sliding_only", "default_everything",
)  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("reference", list(Reference))
@pytest.mark.parametrize("name", [*ODD, "panda"])
def test_every_exported_quantity_agrees_with_pinocchio_within_the_bound(
    name: str, reference: Reference
) -> None:
    robot = robot_of(name)
    frame = robot.tip_frame
    drawn = draw_samples(robot.tree, 20, np.random.default_rng(3), with_zero_and_limits=True)
    checker = copy(robot.verifier)
    for row in exportable_quantities():
        inputs = (drawn.q, drawn.v, drawn.a)[: len(row.inputs)]
        call = Call(robot.tree, robot.plan, frame, reference, None, inputs)
        found = make_function(call.plan, row, reference).evaluate((call.q, *call.rates))
        checker.check(row, call, found, True)
    assert checker.certificate().verified


@pytest.mark.parametrize("quantity", ["placement", "jacobian", "acceleration"])
def test_a_wrong_expression_is_not_written(quantity: str, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = urdfkin.load("ur5")
    proof = code(robot, quantities=(quantity,)).proof
    (line,) = proof.certificate.lines
    assert line.checked >= PROOF_SAMPLES
    assert line.unchecked == 0
    assert proof.certificate.verified
    right = Function.evaluate
    monkeypatch.setattr(Function, "evaluate", lambda *given: right(*given) * (1.0 + 1e-9))
    with pytest.raises(urdfkin.VerificationError):
        code(robot, quantities=(quantity,))


def plan_of(robot: Robot) -> CompiledTree:
    return robot.plan([robot.tree.frame_link(robot.tip_frame)])


def test_sine_and_cosine_of_each_needed_joint_are_computed_once() -> None:
    robot = urdfkin.load("panda", verify=False)
    plan, aligned = robot.plan([robot.tree.frame_link("panda_hand")]), Reference.LOCAL_WORLD_ALIGNED
    place, jacobian = (make_function(plan, row, aligned) for row in (exportable_quantities()[0], JACOBIAN))
    assert sum(node.op == "sin" for node in place.nodes) == 7
    assert sum(node.op == "cos" for node in place.nodes) == 7
    assert len(jacobian.angles) == 6, "how the last joint turns moves no axis"


def test_exported_code_has_fewer_operations_than_the_general_recursion() -> None:
    robot = urdfkin.load("panda", verify=False)
    plan = robot.plan([robot.tree.frame_link("panda_hand")])
    for row in (JACOBIAN, ACCELERATION):
        function = make_function(plan, row, Reference.LOCAL_WORLD_ALIGNED)
        sines = 2 * len(function.angles)
        # `operations` counts 51 operations for a sine and its cosine, `Function` counts two.
        recursion = count_operations(plan, row.name) - 51 * len(plan.steps)
        assert function.operation_count - sines < 0.75 * recursion


def test_each_operand_is_computed_before_use() -> None:
    plan = plan_of(robot_of("planar_and_floating_in_the_middle"))
    function = make_function(plan, ACCELERATION, Reference.LOCAL)
    done = set[Node]()
    for node in function.nodes:
        assert set(node.operand_nodes) <= done
        done.add(node)
    assert {node for node in function.results if isinstance(node, Node)} <= done


def test_tiny_link_lengths_are_exported_beside_huge_ones() -> None:
    function = make_function(plan_of(robot_of("sizes")), exportable_quantities()[0], Reference.LOCAL)
    lengths = {x for node in function.nodes for x in node.operands if isinstance(x, float)}
    assert any(0.0 < x < 1e-5 for x in lengths)
    assert any(x > 100.0 for x in lengths)


# -- formulas of a LaTeX document ------------------------------------------------------------------------


_LINE = re.compile(r"^(\S+) &= (.*?)(?: \\\\)?$", re.MULTILINE)
_SYMBOL = re.compile(r"(?:\\(?:d?dot|omega)(?:\{\\?[A-Za-z]+\})?|[A-Za-z])(?:\^\{\(\d+\)\})?_\{[\w,]+\}")


def evaluate(text: str, values: dict[str, float]) -> dict[str, float]:
    """Add the value of each formula to `values`; a symbol must be defined before its use."""
    for name, formula in _LINE.findall(text):
        plain = re.sub(r" \\cdot 10\^\{(-?\d+)\}", r"e\1", formula)
        plain = re.sub(r"\\operatorname\{(\w+)\}", r"\1", plain).replace(r" \, ", " * ")
        plain = _SYMBOL.sub(lambda found: f"x[{found[0]!r}]", plain)
        scope = {"x": values, "sin": math.sin, "cos": math.cos, "sqrt": math.sqrt}
        values[name] = float(eval(plain, {"__builtins__": {}}, scope))
    return values


def test_the_formulas_of_a_latex_document_have_the_results_of_the_robot() -> None:
    robot = urdfkin.load("ur5")
    document = write(code(robot, "tool0", ALL), "latex")
    q, v, a = (x[0] for x in state(robot, 1, 4))
    inputs = (
        (letter, k, x) for letter, row in zip("qva", (q, v, a), strict=True) for k, x in enumerate(row, 1)
    )
    given = {f"{letter}_{{{k}}}": float(x) for letter, k, x in inputs}
    sections = document.split(r"\subsection*")[1:]
    assert len(sections) == len(ALL)
    found = [evaluate(section, dict(given)) for section in sections]
    for letter, matrix in (
        ("T", robot.placement(q, "tool0")),
        ("J", robot.jacobian(q, "tool0")),
        (r"\dot{J}", robot.jacobian_rate(q, v, "tool0")),
    ):
        (own,) = (x for x in found if f"{letter}_{{1,1}}" in x)
        for (i, k), expected in np.ndenumerate(matrix):
            assert abs(own[f"{letter}_{{{i + 1},{k + 1}}}"] - expected) < 1e-12


def test_braces_and_environments_of_a_latex_document_are_closed() -> None:
    document = write(code(urdfkin.load("planar_two_link")), "latex")
    assert document.count(r"\begin{") == document.count(r"\end{")
    assert document.replace(r"\{", "").count("{") == document.replace(r"\}", "").count("}")


def test_a_latex_document_does_not_claim_to_contain_test_vectors() -> None:
    document = write(code(urdfkin.load("planar_two_link")), "latex")
    assert "% Written by urdfkin" in document
    assert "test vectors" not in document
