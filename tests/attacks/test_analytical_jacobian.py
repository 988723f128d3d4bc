"""The whole analytical Jacobian is checked, C^-1 too: no mutant of what makes it ends verified and wrong."""

import ast
import importlib
import inspect
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import CodeType, FunctionType
from typing import Any

import numpy as np
import pytest

import urdfkin
from urdfkin.errors import RepresentationSingularityError
from urdfkin.kinematics import bodies as module
from urdfkin.kinematics.rotation import SEQUENCES, quaternion_of, rotation_from_euler
from urdfkin.kinematics.roundings import EPS
from urdfkin.model.base_motion import BaseMotion
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.verify.analytical_reference import euler_jacobian, quaternion_jacobian

REPRESENTATIONS = (*SEQUENCES, "quaternion")
FREE = '<robot name="free"><link name="body"/></robot>'


@pytest.fixture(scope="module")
def ur5() -> Robot:
    return urdfkin.load("ur5")


@pytest.fixture(scope="module")
def free() -> Robot:
    """A body that stands and turns as it likes: q is its place and quaternion."""
    return urdfkin.load(FREE, root_joint="floating")


# -- what the certificate says -----------------------------------------------------------------------


@pytest.mark.slow
def test_minus_the_result_is_caught(ur5: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    right = module.representation_inverse
    monkeypatch.setattr(module, "representation_inverse", lambda *x: -right(*x))
    with pytest.raises(urdfkin.VerificationError, match="analytical jacobian"):
        ur5.analytical_jacobian(ur5.sample(1)[0], "tool0")


@pytest.mark.slow
@pytest.mark.parametrize("slip", [1e-10, 1e-12])
@pytest.mark.parametrize("representation", REPRESENTATIONS)
def test_a_slip_of_the_rate_matrix_is_caught(
    ur5: Robot, representation: str, slip: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    right = module.representation_inverse
    monkeypatch.setattr(module, "representation_inverse", lambda *x: right(*x) * (1.0 + slip))
    with pytest.raises(urdfkin.VerificationError, match="analytical jacobian"):
        ur5.analytical_jacobian(ur5.sample(5, 3), "tool0", representation)


@pytest.mark.slow
def test_it_has_a_line_of_its_own_in_the_certificate() -> None:
    robot = urdfkin.load("ur5")
    robot.analytical_jacobian(robot.sample(7), "tool0", "xyz")
    (line,) = robot.certificate().lines
    assert (line.quantity, line.checked, line.unchecked) == ("analytical jacobian", 7, 0)
    robot.analytical_jacobian(robot.sample(7), "tool0", "xyz", verify=False)
    (line,) = robot.certificate().lines
    assert (line.checked, line.unchecked) == (7, 7)
    assert not robot.certificate().verified


@pytest.mark.slow
@pytest.mark.parametrize("moving", [False, True])
def test_its_replay_line_calls_itself(moving: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = urdfkin.load("ur5")
    q, right = robot.sample(3, 1), module.representation_inverse
    base = BaseMotion(np.array([[0, -1, 0, 3], [1, 0, 0, 2], [0, 0, 1, 1], [0, 0, 0, 1]])) if moving else None
    monkeypatch.setattr(module, "representation_inverse", lambda *x: 1.001 * right(*x))
    with pytest.raises(urdfkin.VerificationError) as caught:
        robot.analytical_jacobian(q, "tool0", "XYX", base=base)
    line = caught.value.reproduce
    assert ".analytical_jacobian(" in line
    with pytest.raises(urdfkin.VerificationError):
        eval(line)
    monkeypatch.undo()
    (k,) = caught.value.index
    np.testing.assert_array_equal(eval(line), robot.analytical_jacobian(q[k], "tool0", "XYX", base=base))


# -- no false alarm ----------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("representation", REPRESENTATIONS)
def test_it_is_verified_in_every_representation(representation: str) -> None:
    for name in ("ur5", "panda"):
        robot = urdfkin.load(name)
        q = robot.sample(200, 11)
        robot.analytical_jacobian(q, robot.tip_frame, representation)
        T = np.eye(4)
        T[:3, :3] = rotation_from_euler("ZYZ", [0.3, 0.7, 1.1])
        robot.analytical_jacobian(q, robot.tip_frame, representation, base=BaseMotion(T))
        assert robot.certificate().verified
        assert robot.certificate().lines[0].share < 0.25


@pytest.mark.slow
@pytest.mark.parametrize("name", SEQUENCES)
def test_near_the_singularity_it_is_verified_and_the_bound_grows(free: Robot, name: str) -> None:
    rng = np.random.default_rng(3)
    turn = 0.0 if name[0].lower() == name[2].lower() else np.pi / 2
    for distance in (1e-1, 1e-3, 1e-5, 1e-7, 1e-8, 2e-9):
        angles = rng.uniform(-3.0, 3.0, (20, 3))
        angles[:, 1] = turn + distance if turn == 0.0 else turn - distance
        q = np.hstack((rng.normal(size=(20, 3)), quaternion_of(rotation_from_euler(name, angles))))
        free.analytical_jacobian(q, "body", name)
    for distance in (1e-11, 1e-12, 1e-13):
        angles[:, 1] = turn + distance if turn == 0.0 else turn - distance
        q[:, 3:] = quaternion_of(rotation_from_euler(name, angles))
        with pytest.raises(RepresentationSingularityError):
            free.analytical_jacobian(q, "body", name)
        try:
            free.analytical_jacobian(q, "body", name, nearest=0.0)
        except RepresentationSingularityError:
            assert distance < 1e-12
        # Nobody is told that this was checked.
        assert np.isfinite(free.analytical_jacobian(q, "body", name, nearest=0.0, verify=False)).all()
    line = next(x for x in free.certificate().lines if x.quantity == "analytical jacobian")
    assert line.share < 0.5


@pytest.mark.parametrize("name", ["ZYZ", "xyz"])
def test_a_slip_far_above_rounding_is_caught_near_the_singularity_too(
    free: Robot, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    right = module.representation_inverse
    for distance in (1e-1, 1e-2, 1e-3):
        middle = distance if name == "ZYZ" else np.pi / 2 - distance
        quat = quaternion_of(rotation_from_euler(name, [0.4, middle, 0.9]))
        slip = 200.0 * 24.0 * EPS / distance
        monkeypatch.setattr(module, "representation_inverse", lambda *x, s=slip: right(*x) * (1.0 + s))
        with pytest.raises(urdfkin.VerificationError):
            free.analytical_jacobian([0.0, 0.0, 0.0, *quat], "body", name)
        monkeypatch.undo()


def test_half_turns_whose_quaternion_has_either_sign_are_verified(free: Robot) -> None:
    rng = np.random.default_rng(8)
    axis = rng.normal(size=(300, 3))
    quat = np.hstack((axis, rng.choice([0.0, 1e-17, -1e-17, 1e-16, -1e-16, 1e-15, 1e-12], (300, 1))))
    quat /= np.linalg.norm(quat, axis=1, keepdims=True)
    free.analytical_jacobian(np.hstack((axis, quat)), "body", "quaternion")


# -- the second opinion is right and another's -------------------------------------------------------


@pytest.mark.parametrize("name", SEQUENCES)
def test_the_line_of_nodes_gives_the_rates_that_differences_give(name: str) -> None:
    rng = np.random.default_rng(1)
    low, high = (0.3, 2.8) if name[0].lower() == name[2].lower() else (-1.3, 1.3)
    for _ in range(10):
        angles, rates = rng.uniform([-3, low, -3], [3, high, 3]), rng.normal(size=3)
        h, R = 1e-6, rotation_from_euler(name, angles)
        change = (
            rotation_from_euler(name, angles + h * rates) - rotation_from_euler(name, angles - h * rates)
        ) / (2 * h)
        S = change @ R.T
        w = np.array([S[2, 1], S[0, 2], S[1, 0]])
        found, apart = euler_jacobian(name, R, np.concatenate((np.zeros(3), w))[:, np.newaxis])
        assert np.abs(found[3:, 0] - rates).max() < 1e-8 / apart
        assert abs(apart - abs((np.sin if low > 0 else np.cos)(angles[1]))) < 4 * EPS


def test_the_line_of_nodes_shares_nothing_with_what_it_checks() -> None:
    imported = [
        node.module or ""
        for node in ast.walk(ast.parse(inspect.getsource(sys.modules[euler_jacobian.__module__])))
        if isinstance(node, ast.ImportFrom)
    ]
    assert set(imported) == {"__future__", "typing", "numpy.typing"}


def test_a_quaternions_rates_keep_its_length() -> None:
    rng = np.random.default_rng(2)
    quat, J = rng.normal(size=(50, 4)), rng.normal(size=(50, 6, 5))
    quat /= np.linalg.norm(quat, axis=1, keepdims=True)
    rates = quaternion_jacobian(quat, J)[:, 3:]
    assert np.abs(np.einsum("ni,nij->nj", quat, rates)).max() < 1e-15
    assert np.abs(np.linalg.norm(rates, axis=1) - np.linalg.norm(J[:, 3:], axis=1) / 2).max() < 1e-14


# -- mutants -----------------------------------------------------------------------------------------

MODULES = ("kinematics.bodies", "kinematics.rotation")
#: Functions that no analytical Jacobian calls: what is wrong there is another test's business.
ELSEWHERE = {
    "velocity_jacobian", "pose_rates", "velocity_of_pose_rates", "representation_matrix", "orientation_of",
    "angular_velocity_from_euler_rates", "euler_rates", "euler_rate_matrix", "euler_condition",
    "quaternion_rates", "angular_velocity_from_quaternion_rates", "rotation_from_euler", "rotation_from_rpy",
    "rpy_of", "rotation_of", "multiply", "conjugate", "turned", "compose", "compose_all", "seen_from",
    "point_position", "point_velocity", "point_acceleration", "interorigin_vector", "joint_angular_velocity",
    "interorigin_velocity", "jacobian_column", "planar_rotation", "planar_rotation_derivative",
    "link_endpoint", "link_endpoint_velocity", "tool_velocity", "frame_velocity", "integrate_orientation",
    "_step", "_slope",
    "unskew", "rotate_skew", "nearest_rotation", "polar_factor", "axis_aligning", "rotation_rate",
    "angular_velocity_of", "turning_vector_rate", "add_angular_velocities", "rotation_about",
    "rotation_about_derivative", "angular_velocity_about", "circular_velocity", "split_along", "exp_rotation",
    "log_rotation", "axis_angle_of",
}  # fmt: skip
_SWAPS: dict[type[ast.AST], type[ast.AST]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult,
    ast.Lt: ast.Gt, ast.Gt: ast.Lt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.LtE: ast.Gt,
}  # fmt: skip
_OTHER_NAMES = {"cos": "sin", "sin": "cos", "arctan2": "hypot", "cosine": "sine", "sine": "cosine",
                "first": "second", "second": "third", "third": "first", "other": "first", "along": "across",
                "across": "along"}  # fmt: skip


def _changes(node: ast.AST) -> Iterator[Callable[[ast.AST], None]]:
    """Each way in which one node may be written wrongly."""
    operator = getattr(node, "op", None)
    if type(operator) in _SWAPS:
        yield lambda node: setattr(node, "op", _SWAPS[type(node.op)]())  # type: ignore[attr-defined]
    if isinstance(node, ast.Compare) and type(node.ops[0]) in _SWAPS:
        yield lambda node: setattr(node, "ops", [_SWAPS[type(node.ops[0])]()])  # type: ignore[attr-defined]
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        yield lambda node: setattr(node, "op", ast.UAdd())
    if isinstance(node, ast.Constant) and isinstance(node.value, float | int):
        for by in (lambda x: -x, lambda x: x + 1, lambda x: x * (1 + 1e-9)):
            yield lambda node, by=by: setattr(node, "value", by(node.value))  # type: ignore[misc]
    if isinstance(node, ast.Attribute) and node.attr in _OTHER_NAMES:
        yield lambda node: setattr(node, "attr", _OTHER_NAMES[node.attr])  # type: ignore[attr-defined]
    if isinstance(node, ast.Name) and node.id in _OTHER_NAMES and isinstance(node.ctx, ast.Load):
        yield lambda node: setattr(node, "id", _OTHER_NAMES[node.id])  # type: ignore[attr-defined]
    if isinstance(node, ast.Return):
        yield lambda node: setattr(node, "value", ast.UnaryOp(ast.USub(), node.value))  # type: ignore[attr-defined]


def _functions(tree: ast.Module) -> Iterator[ast.FunctionDef]:
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef) and node.name not in ELSEWHERE:
            yield node


def mutants(name: str) -> Iterator[tuple[str, ast.Module]]:
    """Every module that differs from `name` in one node of one function, with words on where."""
    source = inspect.getsource(importlib.import_module(f"urdfkin.{name}"))
    for f, function in enumerate(_functions(ast.parse(source))):
        body = [part for statement in function.body for part in ast.walk(statement)]
        for at, node in enumerate(body):
            for which, _ in enumerate(_changes(node)):
                wrong = ast.parse(source)  # ten times sooner than a deep copy
                target = list(_functions(wrong))[f]
                there = [part for statement in target.body for part in ast.walk(statement)][at]
                list(_changes(there))[which](there)
                line = getattr(node, "lineno", function.lineno)
                yield f"{name}:{line} {type(node).__name__} {which}", ast.fix_missing_locations(wrong)


def _codes(code: CodeType) -> Iterator[CodeType]:
    for part in code.co_consts:
        if isinstance(part, CodeType):
            yield part
            yield from _codes(part)


@contextmanager
def in_place(name: str, wrong: ast.Module) -> Iterator[None]:
    """While open, the module's functions do what the mutant's do, wherever they were imported to."""
    real = importlib.import_module(f"urdfkin.{name}")
    new = {code.co_qualname: code for code in _codes(compile(wrong, str(real.__file__), "exec"))}
    found: list[FunctionType] = []
    for holder in (real, *(value for value in vars(real).values() if inspect.isclass(value))):
        for value in vars(holder).values():
            function: Any = getattr(value, "__wrapped__", getattr(value, "fget", None) or value)
            if isinstance(function, FunctionType) and function.__module__ == real.__name__:
                found.append(function)
    before = [function.__code__ for function in found]
    for function in found:
        if (code := new.get(function.__qualname__)) and len(code.co_freevars) == 0:
            function.__code__ = code
    _forget()
    try:
        yield
    finally:
        for function, code in zip(found, before, strict=True):
            function.__code__ = code
        _forget()


def _forget() -> None:
    importlib.import_module("urdfkin.kinematics.rotation")._sequence.cache_clear()


def outcome(robot: Robot, q: FloatArray, representation: str) -> FloatArray | None:
    """The result, if it comes with a certificate."""
    before = sum(line.unchecked for line in robot.certificate().lines)
    try:
        J = robot.analytical_jacobian(q, "tool0", representation)
    except Exception:  # whatever a mutant raises: it hands out nothing
        return None
    return J if sum(line.unchecked for line in robot.certificate().lines) == before else None


@pytest.mark.long
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("name", MODULES)
def test_no_mutant_ends_verified_and_wrong(ur5: Robot, name: str) -> None:
    q = ur5.sample(6, 2)
    true = {
        representation: ur5.analytical_jacobian(q, "tool0", representation)
        for representation in REPRESENTATIONS
    }
    tried, caught, wrong = 0, 0, []
    for words, tree in mutants(name):
        with in_place(name, tree):
            found = {representation: outcome(ur5, q, representation) for representation in REPRESENTATIONS}
        tried += 1
        caught += any(J is None for J in found.values())
        wrong += [
            (words, representation)
            for representation, J in found.items()
            if J is not None
            and (
                J.shape != true[representation].shape
                or np.abs(J / true[representation] - 1.0)[np.abs(true[representation]) > 1e-6].max() > 1e-10
            )
        ]
    assert wrong == []
    assert tried > 10
    assert caught > 0.5 * tried  # the rest computes the same: a check of inputs, a tie, a type
