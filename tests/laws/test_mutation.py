"""The bounds are tight: they catch an error of 1e-10 in a term and a wrong 12th digit of a URDF."""

import ast
import inspect
import re
from collections.abc import Iterator
from types import ModuleType

import numpy as np
import pytest

import urdfkin
from tests.laws.subjects import robot_of
from tests.reading import present, tree_of
from urdfkin.compiled.plan import compile_tree
from urdfkin.kinematics import equations
from urdfkin.kinematics.arithmetic import VECTOR_OPERATIONS
from urdfkin.robot import Robot
from urdfkin.urdf.sources import Origin
from urdfkin.validation.accuracy import accuracy_study
from urdfkin.verify.exact import recursion
from urdfkin.verify.oracle import QueryBatch
from urdfkin.verify.pinocchio import PinocchioOracle

#: The relative change of a term.
FACTOR = "1.0000000001"
#: Upper limit of all bounds: 24 rounding errors for each of four factors and each of a dozen joints.
ASSUMED_LIMIT = 24.0 * 4 * 12


def terms() -> Iterator[tuple[str, str]]:
    """Yield (equation, term) for each vector in the last line of an equation."""
    for name, function in vars(equations).items():
        if not inspect.isfunction(function) or name in VECTOR_OPERATIONS or name not in USED:
            continue
        for node in ast.walk(ast.parse(inspect.getsource(function)).body[0]):
            if isinstance(node, ast.Call):
                yield name, ast.unparse(node)


#: The equations of a robot's motion; tests/text tests the equations of points and frames.
USED = (
    "angular_velocity", "tangential", "point_velocity", "sliding_velocity", "transverse", "centripetal",
    "coriolis", "angular_acceleration", "point_acceleration", "sliding_acceleration",
    "free_angular_acceleration", "free_acceleration", "turning_column", "axis_rate", "turning_column_rate",
    "rate_in_turning_axes",
)  # fmt: skip


def with_a_mistake(equation: str, term: str) -> ModuleType:
    tree = ast.parse(inspect.getsource(equations))
    (function,) = [node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name == equation]

    class Mistake(ast.NodeTransformer):
        def visit_Call(self, node: ast.Call) -> ast.AST:
            found = ast.unparse(node)
            self.generic_visit(node)
            larger = f"times({FACTOR}, {ast.unparse(node)})"
            return ast.parse(larger, mode="eval").body if found == term else node

    Mistake().visit(function)
    module = ModuleType("mistaken")
    exec(compile(ast.fix_missing_locations(tree), "mistaken", "exec"), vars(module))
    return module


def farthest(robot: Robot) -> float:
    return max(line.pinocchio.worst for line in accuracy_study(robot, samples=2).lines)


@pytest.fixture(scope="module")
def robots() -> list[Robot]:
    # Revolute joints, a prismatic joint, and moving planar and floating joints.
    return [urdfkin.load("panda"), urdfkin.load("polar"), robot_of("planar_and_floating_in_the_middle")]


@pytest.mark.long
def test_the_unmodified_equations_agree_with_pinocchio(robots: list[Robot]) -> None:
    assert max(map(farthest, robots)) < 30.0


@pytest.mark.long
@pytest.mark.parametrize(("equation", "term"), list(terms()))
def test_a_relative_error_of_1e_10_in_any_term_of_an_equation_is_detected(
    robots: list[Robot], equation: str, term: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recursion._RECURSION, "eq", with_a_mistake(equation, term))
    assert any(farthest(robot) > ASSUMED_LIMIT for robot in robots)


def robot_that_misreads(text: str, wrong: str) -> Robot:
    """Return a robot with the tree of `wrong`, which Pinocchio checks against `text`."""
    return Robot(tree_of(wrong.encode()), text, origin=Origin("<text>"))


@pytest.mark.parametrize("place", ["0.333", "-1.5707963267948966", "0.0825", "0.384"])
def test_a_number_with_a_wrong_12th_digit_is_caught(place: str) -> None:
    text = urdfkin.load("panda").urdf
    found = present(re.search(rf'(?:xyz|rpy)="[^"]*{re.escape(place)}[^"]*"', text))
    exponent = int(np.floor(np.log10(abs(float(place)))))
    changed = repr(float(place) + 2.0 * 10.0 ** (exponent - 11))
    wrong = text[: found.start()] + found[0].replace(place, changed, 1) + text[found.end() :]
    robot = robot_that_misreads(text, wrong)
    q = robot.sample(5, 0)
    with pytest.raises(urdfkin.VerificationError, match="disagrees with Pinocchio's"):
        robot.placement(q, "panda_hand_tcp")
    if place != "0.333":  # before the first joint, so no Jacobian depends on it
        with pytest.raises(urdfkin.VerificationError):
            robot.jacobian(q, "panda_hand_tcp")


@pytest.mark.parametrize(
    ("before", "after", "frame"),
    [
        ('<axis xyz="0 0 1" />', '<axis xyz="0 1e-11 1" />', "panda_hand_tcp"),
        ('"panda_finger_joint1"/>', '"panda_finger_joint1" multiplier="1.0000000001"/>', "panda_rightfinger"),
        ('"panda_finger_joint1"/>', '"panda_finger_joint1" offset="1e-12"/>', "panda_rightfinger"),
    ],
)  # fmt: skip
def test_a_wrong_axis_or_mimic_rule_is_caught(before: str, after: str, frame: str) -> None:
    text = urdfkin.load("panda").urdf
    spelled = next(
        way for way in (before, before.replace("/>", " />"), before.replace(" />", "/>")) if way in text
    )
    robot = robot_that_misreads(text, text.replace(spelled, after))
    with pytest.raises(urdfkin.VerificationError):
        robot.placement(robot.sample(20, 1), frame)


def test_the_pinocchio_oracle_reads_the_robots_text_and_not_the_tree() -> None:
    # The oracle's results depend on its text; the tree gives only names and layout.
    robot = urdfkin.load("panda")
    moved = robot.urdf.replace('xyz="0 0 0.333"', 'xyz="0 0 0.433"')
    assert moved != robot.urdf
    x = QueryBatch(["panda_link1"], (robot.neutral()[np.newaxis],))
    here, there = (PinocchioOracle(text, robot.tree).placements(x) for text in (robot.urdf, moved))
    assert there[0, 0, 2, 3] - here[0, 0, 2, 3] == pytest.approx(0.1)
    assert compile_tree(robot.tree, [1]).lengths.sum() == pytest.approx(0.333)
