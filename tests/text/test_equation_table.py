"""docs/equations.md is complete, current and correct; its LaTeX, and the misprints of the chapter."""

import importlib
import re
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.high_precision import array, column, mp, rate, turn
from tests.kinematics.rotation.strategies import ROUNDING
from tests.moving import ORIENTATIONS, ORIGINS, T, frame, point
from tests.mutation import slightly_wrong
from tests.text.robots import close, motion, robot
from urdfkin.errors import UrdfkinError
from urdfkin.kinematics.bodies import (
    analytical_jacobian,
    compose,
    jacobian_column,
    joint_angular_velocity,
    point_acceleration,
    velocity_jacobian,
)
from urdfkin.kinematics.registry import (
    LAST_EQUATION,
    LOST_PAGE_EQUATIONS,
    Equation,
    equations,
    equations_page,
    explain,
    misprints,
)
from urdfkin.kinematics.rotation import (
    euler_rate_matrix,
    quaternion_of,
    quaternion_rates,
    rotation_about,
    skew,
)
from urdfkin.model.base_motion import BaseMotion

ROOT = Path(__file__).parents[2]


def resolve(function: str) -> Any:
    module, _, name = function.partition(":")
    found: Any = importlib.import_module(module)
    for part in name.split("."):
        found = getattr(found, part)
    return found


@cache
def test_function(test: str) -> Callable[..., None]:
    file, _, name = test.partition("::")
    assert (ROOT / file).is_file(), file
    module = importlib.import_module(file.removesuffix(".py").replace("/", "."))
    found: Callable[..., None] = getattr(module, name)
    return found


test_function.__test__ = False  # type: ignore[attr-defined]


def arguments(function: Callable[..., None]) -> Iterator[dict[str, Any]]:
    marks = [mark for mark in getattr(function, "pytestmark", []) if mark.name == "parametrize"]
    assert len(marks) <= 1
    if not marks:
        yield {}
        return
    names, values = marks[0].args[:2]
    names = [names] if isinstance(names, str) else list(names)
    for value in values:
        yield dict(zip(names, [value] if len(names) == 1 else value, strict=True))


def passes(test: str) -> bool:
    function = test_function(test)
    try:
        for given in arguments(function):
            function(**given)
    except (AssertionError, UrdfkinError):
        return False
    return True


@cache
def passes_as_it_is(test: str) -> bool:
    """Return whether the tests pass without a mutant; equations share tests, so each test runs once."""
    return passes(test)


def test_the_table_contains_every_equation_except_the_four_lost_equations() -> None:
    assert list(equations()) == [
        f"7.{i}" for i in range(1, LAST_EQUATION + 1) if f"7.{i}" not in LOST_PAGE_EQUATIONS
    ]
    assert len(equations()) == 126
    assert LOST_PAGE_EQUATIONS == ("7.6", "7.8", "7.9", "7.10")


def test_every_function_and_test_in_the_equation_table_exists() -> None:
    for equation in equations().values():
        assert equation.functions
        assert equation.tests
        assert len({*equation.functions}) == len(equation.functions), equation.number
        for function in equation.functions:
            assert callable(resolve(function)), function
        for test in equation.tests:
            assert callable(test_function(test)), test
            assert test.split("::")[1].startswith("test_"), test


@pytest.mark.slow
@pytest.mark.parametrize("number", list(equations()))
def test_the_tests_of_an_equation_detect_a_slightly_wrong_function(number: str) -> None:
    equation = equations()[number]
    assert all(passes_as_it_is(test) for test in equation.tests)
    for name in equation.functions:
        with slightly_wrong(resolve(name)):
            assert not all(passes(test) for test in equation.tests), f"{name} may be wrong unnoticed"
    # Only the changed function caused the failures, because all tests pass without the change.
    assert all(passes(test) for test in equation.tests)


def test_every_listed_misprint_has_a_passing_test() -> None:
    assert misprints()
    for misprint in misprints():
        assert passes(misprint.test), misprint.where


def test_the_generated_page_of_equations_is_current() -> None:
    page = (ROOT / "docs" / "equations.md").read_text(encoding="utf-8")
    assert page == equations_page(), "run python scripts/make_pages.py equations"


def test_explain_describes_each_equation_and_states_the_lost_equations() -> None:
    for number, equation in equations().items():
        page = explain(number)
        assert page is not None
        assert equation.statement in page
        assert equation.meaning in page
    assert "lost" in str(explain("7.8"))
    assert explain("(7.130)") == explain("eq. 7.130") == explain("7.130")
    assert explain("7.131") is explain("URDF101") is explain("7") is None


# -- LaTeX and plain text of each equation have the same symbols -----------------------------------


_WORDS = {r"\times": "x", r"\cdot": ".", r"\ldots": "...", r"\omega": "w", r"\left": "", r"\right": ""}
#: Brackets and signs between entries, which are different in the two notations.
_BETWEEN = re.compile(r"[\s_{}()\[\],;&\\]")


def of_latex(latex: str) -> str:
    text = re.sub(r"\\(?:begin|end)\{bmatrix\}", "", latex)
    for word, plain in _WORDS.items():
        text = text.replace(word, plain)
    text = re.sub(r"\\sum_\{(\w)=1\}\^\{(\w)\}", r"sum over \1 = 1..\2 of ", text)
    text = re.sub(r"\\sum_(\w)", r"sum over \1 of ", text)
    text = re.sub(r"\\(d?)dot\{(.*?)\}", lambda dots: dots[2] + "-dot" * (1 + len(dots[1])), text)
    text = re.sub(r"\\frac\{([^{}]*)\}\{([^{}]*)\}", r"\1/\2", text)
    return _BETWEEN.sub("", re.sub(r"\\text", "", text))


def of_statement(statement: str) -> str:
    """Return the plain characters, with dots before subscripts as in LaTeX."""
    return _BETWEEN.sub("", re.sub(r"\b(theta|[a-zA-Z])(_?[0-9a-z])((?:-dot)+)", r"\1\3\2", statement))


@pytest.mark.parametrize("equation", equations().values(), ids=equations())
def test_both_notations_have_the_same_symbols_in_the_same_order(equation: Equation) -> None:
    assert of_latex(equation.latex) == of_statement(equation.statement)


def test_a_changed_sign_dot_or_index_of_a_notation_is_detected() -> None:
    equation = equations()["7.130"]
    for mistake in (("+ 2", "- 2"), (r"\ddot", r"\dot"), ("i-1,i", "i,i-1")):
        assert of_latex(equation.latex.replace(*mistake, 1)) != of_statement(equation.statement)


# -- misprints of the chapter: the printed equation is wrong, the corrected one holds --------------


def test_omega_zyz_is_singular_at_pi_as_well_as_at_zero() -> None:
    for theta in (0.0, np.pi, -np.pi):
        assert abs(np.linalg.det(euler_rate_matrix("ZYZ", [0.4, theta, 1.0]))) <= ROUNDING
    for theta in (0.5, np.pi / 2, 3.0):
        determinant = np.linalg.det(euler_rate_matrix("ZYZ", [0.4, theta, 1.0]))
        assert abs(determinant + np.sin(theta)) <= ROUNDING


def test_quaternion_rates_preserve_the_norm_and_an_euler_step_does_not() -> None:
    quat, w, step = quaternion_of(rotation_about([0.6, 0.8, 0.0], 1.2)), np.array([0.0, 0.6, 0.8]), 0.1
    rates = quaternion_rates(quat, w)
    assert abs(quat @ rates) <= ROUNDING
    assert abs(np.linalg.norm(quat + step * rates) - np.sqrt(1.0 + 0.05**2)) <= ROUNDING


def test_the_vector_in_7_17_is_the_links_angular_velocity() -> None:
    theta, speed, a1 = 0.9, -1.7, 0.8
    d_01 = rotation_about([0.0, 0.0, 1.0], theta) @ [a1, 0.0, 0.0]
    exact = array(
        rate(lambda t: turn("z", mp.mpf(theta) + t * mp.mpf(speed)) * column(mp.mpf(a1), 0, 0), 0.0)
    )
    w_0, w_01 = np.zeros(3), speed * np.array([0.0, 0.0, 1.0])
    assert np.abs(skew(w_01) @ d_01 - exact).max() <= ROUNDING
    assert np.abs(skew(w_0) @ d_01 - exact).max() > 0.1


def test_the_relative_velocity_of_7_61_is_expressed_in_the_previous_frame() -> None:
    first, second = frame(0), frame(1)
    both = compose(first, second)
    exact = array(rate(lambda t: ORIGINS[0](t) + ORIENTATIONS[0](t) * ORIGINS[1](t), T))
    rest = first.v_0_1 + np.cross(first.w_0_1, first.R_0_1 @ second.d_0_1)
    assert np.abs(rest + first.R_0_1 @ second.v_0_1 - exact).max() <= 32 * ROUNDING
    assert np.abs(rest + both.R_0_1 @ second.v_0_1 - exact).max() > 0.1


def test_the_joint_kind_in_7_62_is_that_of_joint_i() -> None:
    polar = motion("polar")
    turns = [True, False]
    right = sum(joint_angular_velocity(polar.axis(i), polar.v[i - 1], turns[i - 1]) for i in (1, 2))
    wrong = sum(joint_angular_velocity(polar.axis(i), polar.v[i - 1], turns[2 - i]) for i in (1, 2))
    assert close(right, polar.w(2))
    assert not close(wrong, polar.w(2))


def test_the_moment_arm_begins_at_the_origin_on_the_joints_axis() -> None:
    elbow = motion("elbow")
    J = robot("elbow").jacobian(elbow.q, "wrist")
    for i, right in ((2, True), (2, False)):
        start = elbow.origin(i - 1) if right else elbow.origin(i)
        found = jacobian_column(elbow.axis(i), elbow.origin(6) - start, turns=True)
        assert close(found, J[:, i - 1]) is right


def test_7_121_holds_for_a_robot_that_is_not_the_elbow() -> None:
    polar = motion("polar")
    J_v, R = robot("polar").jacobian(polar.q, "slider"), polar.rotation(2)
    # For a robot that rotates only about z, ZYZ angles are singular; roll, pitch and yaw are not.
    assert close(velocity_jacobian("xyz", R, analytical_jacobian("xyz", R, J_v)), J_v)
    assert J_v.shape != (6, 6)


def test_coriolis_acceleration_is_perpendicular_to_the_relative_velocity_in_frame_0() -> None:
    v_1 = array(rate(point, T))
    coriolis = point_acceleration(frame(0), array(point(mp.mpf(T))), v_1).coriolis
    assert abs(coriolis @ (frame(0).R_0_1 @ v_1)) <= 64 * ROUNDING
    assert abs(coriolis @ v_1) > 0.1


def test_a_base_at_rest_also_has_zero_angular_acceleration() -> None:
    still, turning = np.zeros(6), BaseMotion(acceleration=np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0]))
    elbow = motion("elbow")
    assert not robot("elbow").acceleration(elbow.q, still, still, "wrist", base=BaseMotion()).any()
    assert np.abs(robot("elbow").acceleration(elbow.q, still, still, "wrist", base=turning)).max() > 0.1
