"""Verification covers the whole analytical Jacobian, with C^-1: it catches each mutant of the code."""

import ast
import importlib
import inspect
import sys
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from itertools import islice

import numpy as np
import pytest

import urdfkin
from scripts.mutating.operators import apply_change, function_at, list_changes
from tests.attacks.input_to_result_mutants import make
from urdfkin.errors import RepresentationSingularityError
from urdfkin.kinematics import bodies as module
from urdfkin.kinematics import rotation
from urdfkin.kinematics.rotation import EULER_SEQUENCES, quaternion_of, rotation_from_euler
from urdfkin.kinematics.roundings import EPS
from urdfkin.model.base_motion import BaseMotion
from urdfkin.model.tree import FloatArray, pose
from urdfkin.robot import Robot
from urdfkin.verify.analytical_reference import euler_jacobian, quaternion_jacobian

REPRESENTATIONS = (*EULER_SEQUENCES, "quaternion")


@pytest.fixture(scope="module")
def ur5() -> Robot:
    return urdfkin.load("ur5")


@pytest.fixture(scope="module")
def free() -> Robot:
    """Return a robot with a floating joint; q is its position and quaternion."""
    return urdfkin.load('<robot name="free"><link name="body"/></robot>', root_joint="floating")


@pytest.mark.slow
@pytest.mark.parametrize("factor", [-1.0, 1.0 + 1e-10, 1.0 + 1e-12])
@pytest.mark.parametrize("representation", REPRESENTATIONS)
def test_an_error_in_the_rate_matrix_is_caught(
    ur5: Robot, representation: str, factor: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    right = module.pose_rate_inverse
    monkeypatch.setattr(module, "pose_rate_inverse", lambda *x: right(*x) * factor)
    with pytest.raises(urdfkin.VerificationError, match="analytical jacobian"):
        ur5.analytical_jacobian(ur5.sample(5, 3), "tool0", representation)


@pytest.mark.slow
def test_the_analytical_jacobian_has_its_own_line_in_the_certificate() -> None:
    robot = urdfkin.load("ur5")
    for verify, unchecked in ((True, 0), (False, 7)):
        robot.analytical_jacobian(robot.sample(7), "tool0", "xyz", verify=verify)
        (line,) = robot.certificate().lines
        assert (line.quantity, line.checked, line.unchecked) == ("analytical jacobian", 7, unchecked)
    assert not robot.certificate().verified


@pytest.mark.slow
@pytest.mark.parametrize("moving", [False, True])
def test_the_line_that_reproduces_an_error_calls_analytical_jacobian(
    moving: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = urdfkin.load("ur5")
    q, right = robot.sample(3, 1), module.pose_rate_inverse
    base = BaseMotion(np.array([[0, -1, 0, 3], [1, 0, 0, 2], [0, 0, 1, 1], [0, 0, 0, 1]])) if moving else None
    monkeypatch.setattr(module, "pose_rate_inverse", lambda *x: 1.001 * right(*x))
    with pytest.raises(urdfkin.VerificationError) as caught:
        robot.analytical_jacobian(q, "tool0", "XYX", base=base)
    line = caught.value.reproduce
    assert ".analytical_jacobian(" in line
    with pytest.raises(urdfkin.VerificationError):
        eval(line)
    monkeypatch.undo()
    (k,) = caught.value.index
    np.testing.assert_array_equal(eval(line), robot.analytical_jacobian(q[k], "tool0", "XYX", base=base))


@pytest.mark.slow
@pytest.mark.parametrize("representation", REPRESENTATIONS)
def test_the_analytical_jacobian_is_verified_in_each_representation(representation: str) -> None:
    for name in ("ur5", "panda"):
        robot = urdfkin.load(name)
        for base in (None, BaseMotion(pose(rotation_from_euler("ZYZ", [0.3, 0.7, 1.1])))):
            robot.analytical_jacobian(robot.sample(200, 11), robot.tip_frame, representation, base=base)
        assert robot.certificate().verified
        assert robot.certificate().lines[0].bound_ratio < 0.25


@pytest.mark.slow
@pytest.mark.parametrize("name", EULER_SEQUENCES)
def test_near_the_singularity_the_analytical_jacobian_is_verified_and_the_bound_grows(
    free: Robot, name: str
) -> None:
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
        # This result is not counted as checked.
        assert np.isfinite(free.analytical_jacobian(q, "body", name, nearest=0.0, verify=False)).all()
    assert next(x for x in free.certificate().lines if x.quantity == "analytical jacobian").bound_ratio < 0.5


@pytest.mark.parametrize("name", ["ZYZ", "xyz"])
def test_an_error_far_above_rounding_is_caught_near_the_singularity(
    free: Robot, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    right = module.pose_rate_inverse
    for distance in (1e-1, 1e-2, 1e-3):
        middle = distance if name == "ZYZ" else np.pi / 2 - distance
        quat = quaternion_of(rotation_from_euler(name, [0.4, middle, 0.9]))
        mistake = 200.0 * 24.0 * EPS / distance
        monkeypatch.setattr(module, "pose_rate_inverse", lambda *x, s=mistake: right(*x) * (1.0 + s))
        with pytest.raises(urdfkin.VerificationError):
            free.analytical_jacobian([0.0, 0.0, 0.0, *quat], "body", name)
        monkeypatch.undo()


def test_half_turns_with_quaternions_of_either_sign_are_verified(free: Robot) -> None:
    rng = np.random.default_rng(8)
    axis = rng.normal(size=(300, 3))
    quat = np.hstack((axis, rng.choice([0.0, 1e-17, -1e-17, 1e-16, -1e-16, 1e-15, 1e-12], (300, 1))))
    quat /= np.linalg.norm(quat, axis=1, keepdims=True)
    free.analytical_jacobian(np.hstack((axis, quat)), "body", "quaternion")


@pytest.mark.parametrize("name", EULER_SEQUENCES)
def test_rates_from_the_line_of_nodes_equal_difference_quotients(name: str) -> None:
    rng = np.random.default_rng(1)
    low, high = (0.3, 2.8) if name[0].lower() == name[2].lower() else (-1.3, 1.3)
    for _ in range(10):
        angles, rates = rng.uniform([-3, low, -3], [3, high, 3]), rng.normal(size=3)
        h, R = 1e-6, rotation_from_euler(name, angles)
        before, after = (rotation_from_euler(name, angles + step * rates) for step in (-h, h))
        S = (after - before) / (2 * h) @ R.T
        w = np.array([S[2, 1], S[0, 2], S[1, 0]])
        found, apart = euler_jacobian(name, R, np.concatenate((np.zeros(3), w))[:, np.newaxis])
        assert np.abs(found[3:, 0] - rates).max() < 1e-8 / apart
        assert abs(apart - abs((np.sin if low > 0 else np.cos)(angles[1]))) < 4 * EPS


def test_the_line_of_nodes_is_independent_code_and_quaternion_rates_preserve_the_norm() -> None:
    tree = ast.parse(inspect.getsource(sys.modules[euler_jacobian.__module__]))
    imported = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    assert imported == {"__future__", "typing", "numpy.typing"}
    rng = np.random.default_rng(2)
    quat, J = rng.normal(size=(50, 4)), rng.normal(size=(50, 6, 5))
    quat /= np.linalg.norm(quat, axis=1, keepdims=True)
    rates = quaternion_jacobian(quat, J)[:, 3:]
    assert np.abs(np.einsum("ni,nij->nj", quat, rates)).max() < 1e-15
    assert np.abs(np.linalg.norm(rates, axis=1) - np.linalg.norm(J[:, 3:], axis=1) / 2).max() < 1e-14


#: Names that are easily confused, each with its replacement in a mutant.
OTHER_NAMES = {
    "cos": "sin", "sin": "cos", "arctan2": "hypot", "cosine": "sine", "sine": "cosine", "first": "second",
    "second": "third", "third": "first", "other": "first", "along": "across", "across": "along",
}  # fmt: skip


def mutants(source: str, called: Collection[str]) -> Iterator[tuple[str, ast.Module]]:
    """Yield every module with one changed node in a called function, and a description of the change."""
    right = ast.parse(source)
    for number, change in enumerate(list_changes(right)):
        if function_at(right, change.line) in called:
            yield f"{change.line}: {change.text}", apply_change(source, number)
    for number, node in enumerate(ast.walk(right)):
        field = "attr" if isinstance(node, ast.Attribute) else "id"
        name = getattr(node, field, "")
        if name in OTHER_NAMES and function_at(right, getattr(node, "lineno", 0)) in called:
            wrong = ast.parse(source)
            setattr(next(islice(ast.walk(wrong), number, None)), field, OTHER_NAMES[name])
            yield f"{getattr(node, 'lineno', 0)}: {name}", wrong


def outcome(robot: Robot, q: FloatArray, representation: str) -> FloatArray | None:
    before = sum(line.unchecked for line in robot.certificate().lines)
    try:
        J = robot.analytical_jacobian(q, "tool0", representation)
    except Exception:  # a mutant that raises an error returns no result
        return None
    return J if sum(line.unchecked for line in robot.certificate().lines) == before else None


@contextmanager
def names_called() -> Iterator[set[str]]:
    names = set[str]()
    sys.setprofile(lambda frame, *_: names.add(frame.f_code.co_qualname.replace(".<locals>", "")))
    try:
        yield names
    finally:
        sys.setprofile(None)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("name", ["kinematics.bodies", "kinematics.rotation"])
def test_no_mutant_gives_a_wrong_verified_result(ur5: Robot, name: str) -> None:
    module = importlib.import_module(f"urdfkin.{name}")
    source, q = inspect.getsource(module), ur5.sample(6, 2)

    def results() -> dict[str, FloatArray | None]:
        rotation._make_sequence.cache_clear()
        return {representation: outcome(ur5, q, representation) for representation in REPRESENTATIONS}

    with names_called() as called:
        true = results()
    tried, caught, wrong = 0, 0, []
    for words, tree in mutants(source, called):
        tried += make(module, tree)
        found = results()
        make(module, ast.parse(source))
        caught += any(J is None for J in found.values())
        for representation, J in found.items():
            right = true[representation]
            assert right is not None
            if J is not None and (
                J.shape != right.shape or np.abs(J / right - 1.0)[np.abs(right) > 1e-6].max() > 1e-10
            ):
                wrong.append((words, representation))
    rotation._make_sequence.cache_clear()
    assert wrong == []
    assert tried > 10
    assert caught > 0.5 * tried  # other mutants change only a check of inputs, a tie or a type
