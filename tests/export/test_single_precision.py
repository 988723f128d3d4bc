"""The error bound of an export in single precision holds, and fails without any of its terms."""

from collections.abc import Callable
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

import urdfkin
from tests import urdfs
from tests.export.writing import code, file, module
from tests.laws.subjects import robot_of, state
from tests.reading import module_of
from tests.urdfs import joint, limit, loaded, mimic
from urdfkin.export import function as export_function
from urdfkin.export import proof
from urdfkin.export.expression import Graph, Node
from urdfkin.export.function import Function, single_bounds
from urdfkin.kinematics.roundings import SINGLE_EPS, SINGLE_OPERATION_ERRORS
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray
from urdfkin.verify.exact.numbers import conversion_errors
from urdfkin.verify.quantities import JACOBIAN

_N = 4000
Made = Callable[[Graph, Node, Node, Node], Any]


def function(make_node: Made) -> Function:
    graph = Graph()
    x, y, z = (graph.make_input("q", k) for k in range(3))
    robot = urdfkin.load("planar_two_link", verify=False)
    plan = robot.plan([robot.tree.frame_link("tip")])
    return Function(JACOBIAN, Reference.LOCAL, plan, (make_node(graph, x, y, z),))


def inputs(scale: float = 1.0) -> FloatArray:
    """Return single-precision numbers: x from 1 to 2, y near 0.75 x, z near 1e-3."""
    rng = np.random.default_rng(0)
    x = rng.uniform(1.0, 2.0, _N)
    y = 0.75 * x * (1.0 + rng.uniform(0.5, 1.5, _N) * 1e-3)
    z = rng.uniform(0.5e-3, 1.5e-3, _N)
    return (scale * np.stack([x, y, z], axis=1)).astype(np.float32).astype(np.float64)


def least_accurate(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a sine or cosine with the largest error of SLEEF's functions u35, which PyTorch uses."""

    def off(x: Any) -> Any:
        true = function(np.float64(x))
        return true + 3.4999 * np.spacing(np.abs(true).astype(np.float32)).astype(np.float64)

    return off


def in_single(of: Function, q: FloatArray) -> FloatArray:
    """Compute a function with NumPy in single precision.

    Results of sine and cosine are not rounded, because they already contain the largest error.
    """
    numbers: dict[Node, Any] = {}
    plain: dict[str, Callable[..., Any]] = {"neg": np.negative, "sqrt": np.sqrt}
    plain |= {"sin": least_accurate(np.sin), "cos": least_accurate(np.cos)}
    plain |= {"+": np.add, "-": np.subtract, "*": np.multiply, "/": np.divide}
    for node in of.nodes:
        if node.op == "q":
            numbers[node] = q[:, node.operands[0]].astype(np.float32)
        else:
            operands = (numbers[x] if isinstance(x, Node) else np.float32(x) for x in node.operands)
            numbers[node] = plain[node.op](*operands)
    (result,) = of.results
    return np.asarray(numbers[result], dtype=np.float64)


def worst(make_node: Made, scale: float = 1.0) -> float:
    """Return the largest error in single precision as a share of its bound."""
    of, q = function(make_node), inputs(scale)
    true = of.node_values((q,))[of.results[0]]
    with np.errstate(all="ignore"):
        error, bound = np.abs(in_single(of, q) - true), SINGLE_EPS * single_bounds(of, (q,))[:, 0]
        return float(np.where(error > 0.0, error / bound, 0.0).max())


#: Expressions whose only error is that of one operation
OPERATIONS: dict[str, Made] = {
    "+": lambda g, x, y, z: x + y, "-": lambda g, x, y, z: x - z, "*": lambda g, x, y, z: x * y,
    "/": lambda g, x, y, z: x / y, "sqrt": lambda g, x, y, z: g.root(x),
    "sin": lambda g, x, y, z: g.sine_cosine(x)[0], "cos": lambda g, x, y, z: g.sine_cosine(x)[1],
}  # fmt: skip


@pytest.mark.parametrize("op", OPERATIONS)
def test_the_bound_of_an_operation_holds_and_fails_without_the_term_of_the_operation(
    op: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert (0.9 if op in ("sin", "cos") else 0.2) < worst(OPERATIONS[op]) <= 1.0
    monkeypatch.setitem(SINGLE_OPERATION_ERRORS, op, 0.0)
    monkeypatch.setattr(export_function, "SINGLE_POLYNOMIAL_ERROR", 0.0)
    assert worst(OPERATIONS[op]) > 1.0


def inexact(x: Node, y: Node) -> Any:
    """Return a difference with a relative error of a thousand eps, from the rounding of the product."""
    return 0.75 * x - y


#: For an operation and one of its operands: an expression in which this operand has an error
PASSED: dict[tuple[str, int], Made] = {
    ("+", 1): lambda g, x, y, z: z + inexact(x, y),  # the graph puts the older operand first
    ("-", 0): lambda g, x, y, z: inexact(x, y) - z,
    ("-", 1): lambda g, x, y, z: z - inexact(x, y),
    ("*", 1): lambda g, x, y, z: z * inexact(x, y),
    ("/", 0): lambda g, x, y, z: inexact(x, y) / x,
    ("/", 1): lambda g, x, y, z: x / inexact(x, y),
    ("neg", 0): lambda g, x, y, z: g.make_node("neg", inexact(x, y)),
    ("sin", 0): lambda g, x, y, z: g.sine_cosine(1024.0 * inexact(x, y))[0],
    ("cos", 0): lambda g, x, y, z: g.sine_cosine(1024.0 * inexact(x, y))[1],
    ("sqrt", 0): lambda g, x, y, z: g.root(y - 0.75 * x),
}


@pytest.mark.parametrize(("op", "operand"), PASSED)
def test_the_bound_includes_the_propagated_error_of_each_operand(
    op: str, operand: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    make_node, right = PASSED[op, operand], export_function._SLOPES[op]
    node = function(make_node).results[0]
    assert node.op == op
    assert node.operands[operand].op != "q"
    assert worst(make_node) <= 1.0

    def without(*given: Any) -> tuple[Any, ...]:
        return tuple(0.0 * s if k == operand else s for k, s in enumerate(right(*given)))

    monkeypatch.setitem(export_function._SLOPES, op, without)
    assert worst(make_node) > 1.0


def test_the_bound_of_a_product_includes_the_propagated_error_of_the_first_operand(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    make_node: Made = lambda g, x, y, z: inexact(x, y) * (z * z)  # noqa: E731
    assert worst(make_node) <= 1.0
    monkeypatch.setitem(export_function._SLOPES, "*", lambda value, x, y: (0.0 * y, x))
    assert worst(make_node) > 1.0


def test_the_bound_includes_the_underflow_error_of_numbers_near_zero(monkeypatch: pytest.MonkeyPatch) -> None:
    make_node: Made = lambda g, x, y, z: x * y  # noqa: E731
    assert 0.0 < worst(make_node, 2.0**-68) <= 1.0
    monkeypatch.setattr(export_function, "SINGLE_SMALLEST", 0.0)
    assert worst(make_node, 2.0**-68) > 1.0


def test_a_number_that_overflows_in_single_precision_has_an_infinite_bound() -> None:
    of = function(lambda g, x, y, z: x * y)
    assert np.all(np.isinf(single_bounds(of, (inputs(2.0**65),))))
    assert np.all(np.isfinite(single_bounds(of, (inputs(2.0**60),))))


# -- in files -----------------------------------------------------------------------------------------------

_FIXED = urdfs.robot(joint("j", "fixed", "a", "b", 'xyz="{}" rpy="{}"', axis=""))


def shares(text: str, folder: Path) -> dict[tuple[str, str], float]:
    """Return the shares that the check of an exported file finds, in both precisions."""
    found: dict[tuple[str, str], float]
    found = module(loaded(text), "array", folder, "placement", frame="b").check()
    return found


def test_the_bounds_of_a_file_include_the_rounding_of_constants(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = _FIXED.format("0.1 0 0", "0 0 0")
    assert shares(text, tmp_path)["placement", "float32"] <= 1.0
    monkeypatch.setattr(export_function, "_constant_error", lambda x: 0.0)
    assert shares(text, tmp_path)["placement", "float32"] > 1.0
    assert shares(text, tmp_path)["placement", "float64"] <= 1.0


def test_the_bounds_of_a_file_include_the_errors_of_constants_in_double_precision(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = _FIXED.format("0 0 0", "1.5707963267948966 0 0")  # its cosine, 6e-17, is 0 in the code
    assert shares(text, tmp_path)["placement", "float32"] <= 1.0
    monkeypatch.setattr(proof, "EPS", 0.0)
    assert shares(text, tmp_path)["placement", "float32"] > 1.0


def shares_of(robot: urdfkin.Robot, quantities: tuple[str, ...], folder: Path, frame: str) -> float:
    """Return the largest error of an exported file in double precision, as a share of its bound."""
    shares = module(robot, "array", folder, *quantities, frame=frame).check()
    return max(float(share) for (_, kind), share in shares.items() if kind == "float64")


_RULE = mimic("j", "{multiplier}", "{offset}") + limit(-1e9, 1e9)
_TURNED = urdfs.robot(
    joint("j", "revolute", "a", "b", 'rpy="{angle} {angle} 0.1"', more=limit(-2, 2)),
    joint("k", "revolute", "b", "c", 'xyz="1 0 0"', "0 1 0", _RULE),
)


@pytest.mark.parametrize("seed", range(1, 4))
@pytest.mark.parametrize("large", ["angle", "multiplier", "offset"])
def test_the_bounds_of_a_file_include_the_conversion_errors_of_large_angles_and_mimic_rules(
    large: str, seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    usual = {"angle": 0.1, "multiplier": 2.0, "offset": 0.3}
    text = _TURNED.format(**usual | {large: f"{1e7 + 1e-3 * seed:.4f}"})
    robot = loaded(text)
    assert shares_of(robot, ("placement", "jacobian"), tmp_path, "c") <= 1.0
    held = robot.with_locked_joints({"j": 0.7})
    assert shares_of(held, ("placement",), tmp_path, "c") <= 1.0
    right = conversion_errors
    monkeypatch.setattr(
        proof, "conversion_errors", lambda *of: right(*of)._replace(angles=np.zeros(proof.VECTOR_COUNT))
    )
    assert shares_of(robot, ("placement", "jacobian"), tmp_path, "c") > 1.0
    assert shares_of(held, ("placement",), tmp_path, "c") > 1.0


_CANCELLED = urdfs.robot(
    joint("j", "revolute", "a", "b", axis="0 1 0", more=limit(-2, 2)),
    joint("k", "prismatic", "b", "c", more=mimic("i", -37.123, "{offset}") + limit(-1e9, 1e9)),
    joint("i", "prismatic", "a", "d", more=mimic("j", 0.001, "{before}") + limit(-1e9, 1e9)),
)


@pytest.mark.parametrize("before", ["6732.655", "589262.492", "58731509.822"])
def test_the_bounds_of_a_file_include_the_size_of_each_cancelling_offset(
    before: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = loaded(_CANCELLED.format(before=before, offset=Decimal(before) * Decimal("37.123")))
    right = conversion_errors
    for one in (robot, robot.with_locked_joints({"j": 0.7})):
        with monkeypatch.context() as patch:
            assert shares_of(one, ("placement",), tmp_path, "c") <= 1.0
            patch.setattr(proof, "conversion_errors", lambda *of: right(*of)._replace(lengths=np.zeros(1)))
            assert shares_of(one, ("placement",), tmp_path, "c") > 1.0


@given(st.floats(1e-300, 1e300))
@example(3.9268392647265107)
def test_a_printed_bound_is_rounded_up_by_at_most_2e_6_or_down_by_at_most_1e_5(x: float) -> None:
    assert x <= float(proof._round_up(x)) <= x * (1.0 + 2e-6)
    assert x * (1.0 - 1e-5) <= float(proof._round_down(x)) <= x
    assert proof._round_up(np.inf) == proof._round_down(np.nan) == "0.0"


def test_a_file_states_its_bounds_and_what_single_precision_cannot_represent(tmp_path: Path) -> None:
    text = code(urdfkin.load("ur5"), quantities=("placement", "jacobian")).header
    words = "with rounded constants; unit eps*scale, eps = 2^-23:"
    assert f"Error bounds in single precision, {words}" in text
    (line,) = (x for x in text if x.startswith("  placement ") and ", jacobian " in x)
    assert 1.0 < float(line.split()[1].rstrip(",")) < 24.0 * 7
    large = _FIXED.format("1e39 0 0", "0 0 0")
    head = code(loaded(large), "b", ("placement",)).header
    assert "Single precision cannot represent a number of placement" in head
    with np.errstate(over="ignore"):
        found = shares(large, tmp_path)
    assert found["placement", "float64"] <= 1.0
    assert not found["placement", "float32"] <= 1.0


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["panda", "sizes", "mimic_hand_40_sliding", "planar_and_floating_in_the_middle", "floating_root"]
)
def test_bounds_in_single_precision_hold_and_are_at_most_20_times_the_largest_error(
    name: str, tmp_path: Path
) -> None:
    robot = robot_of(name)
    written = code(robot, quantities=("placement", "jacobian", "jacobian_rate", "acceleration"))
    own = module_of(file(written, "array", tmp_path))
    given = [x.astype(np.float32).astype(np.float64) for x in state(robot, 200, 3)]
    for of in written.functions:
        used = given[: len(of.inputs)]
        found = getattr(own, of.name)(*(x.astype(np.float32) for x in used))
        assert found.dtype == np.float32
        error = np.abs(found - of.evaluate(used)).reshape(200, -1)
        bound = SINGLE_EPS * single_bounds(of, used)
        assert np.all(error <= bound)
        assert float((error[bound > 0.0] / bound[bound > 0.0]).max()) > 0.05
