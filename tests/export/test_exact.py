"""Exact code for SymPy is algebra without a double, and equals the chain of the URDF's decimals."""

from __future__ import annotations

import warnings
from fractions import Fraction
from typing import Any

import pytest

import urdfkin
from tests.export.writing import ALL, code
from tests.laws.subjects import robot_of
from urdfkin.export import write
from urdfkin.export.exact import ExactGraph, ExactProof, PiMultiple, balls, literal
from urdfkin.export.proof import decimal
from urdfkin.robot import Robot
from urdfkin.verify.exact.numbers import precision

_ARM = """<robot name="arm"><link name="a"/><link name="b"/><link name="c"/><link name="d"/>
<joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="{axis}"/>
  <origin xyz="0.1 0 0.425" rpy="{rpy}"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<joint name="k" type="prismatic"><parent link="b"/><child link="c"/><axis xyz="0 -1 0"/>
  <origin xyz="0 0.3 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="m" type="revolute"><parent link="c"/><child link="d"/><axis xyz="0 0 -1"/>
  <mimic joint="j" multiplier="-0.5" offset="{offset}"/>
  <limit lower="-4" upper="4" effort="1" velocity="1"/></joint></robot>"""


def arm(rpy: str, axis: str = "0 0 1", offset: str = "1.5707963267948966") -> Robot:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", urdfkin.UrdfWarning)  # an axis that is not a unit vector
        return urdfkin.load(_ARM.format(rpy=rpy, axis=axis, offset=offset))


def algebra(robot: Robot, *quantities: str) -> tuple[Any, dict[str, Any]]:
    """Return SymPy and the functions of a file."""
    sympy, scope = pytest.importorskip("sympy"), dict[str, Any]()
    exec(robot.export("sympy-exact", quantities=quantities), scope)
    return sympy, scope


@pytest.mark.slow
@pytest.mark.parametrize("axis", ["0 0 1", "1 2 2", "1 1 -1", "0.1 0 0"])
@pytest.mark.parametrize("rpy", ["0.3 -0.2 0.7", "1.57 0 0", "0 0 0"])
def test_expressions_are_equal_to_the_chain_at_fifty_digits(rpy: str, axis: str) -> None:
    robot = arm(rpy, axis, "0.25")
    exact = code(robot).exact
    assert exact is not None
    found = exact()
    assert found.proof.certificate.verified
    assert {function.name for function in found.functions} == set(ALL)
    with precision(90):
        for function in found.functions:
            for vector in found.proof.vectors:
                true = vector.results[function.name]
                for x, text in zip(balls(function, vector.inputs), true, strict=True):
                    difference = abs(x - type(x)(text))
                    assert difference <= abs(x) * type(x)("1e-49") + type(x)("1e-57"), decimal(x)


@pytest.mark.slow
def test_placements_of_symbols_have_no_double_and_multiples_of_pi_vanish() -> None:
    sympy, scope = algebra(arm("1.5707963267948966 0 -0.5235987755982988"), "placement")
    q = sympy.symbols("q:2", real=True)
    T = scope["placement"](q)
    assert not T.atoms(sympy.Float)
    height = sympy.Rational(17, 40) + (sympy.Rational(3, 10) - q[1]) * sympy.cos(q[0])
    assert sympy.simplify(T[2, 3] - height) == 0
    at = T.subs(dict.fromkeys(q, 0))
    assert at[0, 3] == sympy.Rational(1, 10)
    assert sympy.simplify(T[:3, :3] * T[:3, :3].T) == sympy.eye(3)
    assert sympy.sqrt(3) / 2 in at.atoms(sympy.Mul)


@pytest.mark.slow
def test_the_jacobian_is_the_derivative_of_the_placement_exactly() -> None:
    sympy, scope = algebra(urdfkin.load("planar_two_link"), "placement", "jacobian")
    q = sympy.symbols("q:2", real=True)
    p = scope["placement"](q)[:3, 3]
    right = sympy.cos(q[0]) / 2 + 2 * sympy.cos(q[0] + q[1]) / 5
    assert sympy.simplify(sympy.expand_trig(p[0] - right)) == 0
    assert sympy.simplify(p.jacobian(q) - scope["jacobian"](q)[:3, :]) == sympy.zeros(3, 2)


@pytest.mark.slow
def test_the_file_states_the_angles_that_became_multiples_of_pi() -> None:
    text = arm("1.5707963267948966 0 -0.5235987755982988").export("sympy-exact", quantities=["placement"])
    assert "2 different angles are multiples of pi, changed by at most 7.3e-17 rad" in text
    assert "the expressions below evaluated at 50 digits:" in text
    assert "single precision" not in text
    assert "rpy" not in text
    written = code(robot_of("panda"), quantities=("placement",))
    assert written.exact is not None
    assert isinstance(written.exact().proof, ExactProof)
    assert "Rational" not in write(written, "sympy")


def test_a_double_cannot_enter_an_exact_expression() -> None:
    graph = ExactGraph()
    x = graph.input("q", 0)
    assert literal(Fraction(17, 40)) == "Rational(17, 40)"
    with pytest.raises(TypeError, match="is a double"):
        _ = 0.5 * x


@pytest.mark.parametrize(
    ("decimals", "text"),
    [
        ("1.5707963267948966", "pi/2"),
        ("-3.141592653589793", "(-pi)"),
        ("1.3089969389957472", "5*pi/12"),
        ("1.5708", "Rational(3927, 2500)"),
        ("0", "0"),
    ],
)
def test_an_angle_is_a_multiple_of_pi_if_its_double_is_the_nearest_one(decimals: str, text: str) -> None:
    assert literal(ExactGraph().angle(Fraction(decimals))) == text


def test_sines_and_roots_that_are_fractions_are_constants() -> None:
    graph = ExactGraph()
    assert graph.sine_cosine(PiMultiple(Fraction(-1, 2))) == (-1, 0)
    assert graph.sine_cosine(Fraction(0)) == (0, 1)
    assert graph.root(Fraction(9, 4)) == Fraction(3, 2)
    assert graph.root(Fraction(2)).op == "sqrt"
