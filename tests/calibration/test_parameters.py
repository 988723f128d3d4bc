"""Derivatives of the tip's pose by each parameter, compared with difference quotients at fifty digits."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest

from tests.calibration.arms import BRANCHED
from urdfkin.calibration.calibrate import calibrate
from urdfkin.calibration.parameters import CalibrationModel, make_table_model, make_urdf_model
from urdfkin.dh.table import DHConvention, DHRow, DHTable
from urdfkin.errors import InputError
from urdfkin.kinematics import equations as eq
from urdfkin.kinematics.rotation import rotation_with_z_axis
from urdfkin.model.recursion import IDENTITY, ZERO, Matrix, Number, Vector
from urdfkin.model.tree import FloatArray, JointKind, inverse
from urdfkin.robot.loading import load
from urdfkin.verify.exact.numbers import ExactJoint, as_interval, precision, read_exact_joints, rotation_about
from urdfkin.verify.exact.recursion import compute_motion

#: Step of the difference quotients: its square is below the precision of a double, and thirty digits remain.
STEP = as_interval(2.0**-66)
Pose = tuple[Matrix, Vector]


@pytest.fixture(autouse=True)
def fifty_digits() -> Iterator[None]:
    with precision(50):
        yield


def vector(x: FloatArray) -> Vector:
    return as_interval(x[0]), as_interval(x[1]), as_interval(x[2])


def matrix(R: FloatArray) -> Matrix:
    return vector(R[0]), vector(R[1]), vector(R[2])


def joined(T: Pose, S: Pose) -> Pose:
    return eq.product(T[0], S[0]), eq.plus(T[1], eq.rotate(T[0], S[1]))


def back(T: Pose) -> Pose:
    R = eq.transposed(T[0])
    return R, eq.times(-1, eq.rotate(R, T[1]))


def elementary(turns: bool, axis: int, value: Number) -> Pose:
    if turns:
        return rotation_about(IDENTITY[axis], value), ZERO
    x, y, z = eq.times(value, IDENTITY[axis])
    return IDENTITY, (x, y, z)


def quotients(model: CalibrationModel, tip: Callable[[dict[int, Number]], Pose]) -> FloatArray:
    """Return the twists (6, p) of the tip by each parameter, from poses at fifty digits."""
    found = np.zeros((6, len(model.chain.parameters)))
    here = tip({})
    for k in range(len(model.chain.parameters)):
        (R_1, p_1), (R_2, p_2) = tip({k: -STEP}), tip({k: STEP})
        rate = [eq.times(1 / (2 * STEP), eq.minus(y, x)) for x, y in zip(R_1, R_2, strict=True)]
        W = eq.product(tuple(rate), eq.transposed(here[0]))
        found[:, k] = [
            float(x) for x in (*eq.times(1 / (2 * STEP), eq.minus(p_2, p_1)), W[2][1], W[0][2], W[1][0])
        ]
    return found


def six(model: CalibrationModel, where: str, moved: dict[int, Number]) -> Pose:
    """Return the motion by the six parameters of a joint, the base or the tool."""
    push: Pose = IDENTITY, ZERO
    for k, parameter in enumerate(model.chain.parameters):
        if parameter.element == where and parameter.name != "gain":
            axis = "xyz".index(parameter.name[-1])
            push = joined(push, elementary(parameter.name[0] == "r", axis, moved.get(k, 0)))
    return push


@pytest.mark.slow
@pytest.mark.parametrize(("base", "tip"), [("trunk", "hand"), ("b", "hand"), ("hand", "b")])
def test_the_parameter_jacobian_of_a_urdf_agrees_with_finite_differences_at_fifty_digits(
    base: str, tip: str
) -> None:
    robot = load(BRANCHED, verify=False)
    model = make_urdf_model(robot.tree, tip, base, ("base", "tool", "origins", "gains"))
    q = robot.sample(1, 3)[0]
    joints = read_exact_joints(robot.urdf, robot.tree)
    numbers = {(p.element, p.name): k for k, p in enumerate(model.chain.parameters)}

    def moved_joint(name: str, own: ExactJoint, moved: dict[int, Number]) -> ExactJoint:
        joint = robot.tree.joints[robot.tree.joint_index(name)]
        A = matrix(rotation_with_z_axis(joint.axis)) if joint.kind.has_axis else IDENTITY
        turned: Pose = A, ZERO
        R, p = joined((own.R, own.p), joined(joined(turned, six(model, name, moved)), back(turned)))
        gain = 1 + moved.get(numbers.get((name, "gain"), -1), 0)
        return replace(own, R=R, p=p, multiplier=own.multiplier * gain)

    def place(moved: dict[int, Number]) -> Pose:
        names = [robot.tree.joints[i].name for i in joints]
        changed = {i: moved_joint(n, own, moved) for (i, own), n in zip(joints.items(), names, strict=True)}
        states = compute_motion(robot.tree, changed, q, [0] * robot.nv, [0] * robot.nv).states
        ends = [states[robot.tree.frame_link(name)] for name in (base, tip)]
        way = joined(back((ends[0].R, ends[0].p)), (ends[1].R, ends[1].p))
        return joined(joined(six(model, "base", moved), way), six(model, "tool", moved))

    values = model.coupling.values(model.coupling.select(robot.tree, q[np.newaxis]))
    columns = model.chain.poses_and_jacobian(values)[1][0]
    bound = model.chain.rounding_bound(values)
    difference = np.abs(columns - quotients(model, place))
    assert difference[:3].max() < bound
    assert difference[3:].max() < bound / model.chain.characteristic_length


def table(convention: DHConvention) -> DHTable:
    rows = (
        DHRow(0.1, 1.2, 0.3, 0.4, JointKind.REVOLUTE, "one"),
        DHRow(0.5, 1e-3, 0.0, -0.2, JointKind.REVOLUTE, "two", beta=2e-3),
        DHRow(0.4, -1.5, 0.2, 0.7, JointKind.PRISMATIC, "three", sense=-1),
        DHRow(0.0, 0.0, 0.1, 0.0, JointKind.CONTINUOUS, "four"),
    )
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation_with_z_axis([0.6, 0.0, 0.8]), (0.1, 0.2, 0.3)
    return DHTable(convention, rows, base=T, tool=inverse(T))


@pytest.mark.parametrize("name", ["base", "tool"])
def test_parameters_of_base_and_tool_are_grouped_even_if_a_joint_has_their_name(name: str) -> None:
    dh = table(DHConvention.STANDARD)
    dh = replace(dh, rows=(replace(dh.rows[0], joint=name), *dh.rows[1:]))
    model = make_table_model(dh, ("base", "tool", "origins"))
    grouped = sorted(k for group in model.parameter_groups for k in group)
    assert grouped == list(range(len(model.chain.parameters)))


@pytest.mark.slow
@pytest.mark.parametrize("convention", list(DHConvention))
def test_the_parameter_jacobian_of_a_table_agrees_with_finite_differences_at_fifty_digits(
    convention: DHConvention,
) -> None:
    dh = table(convention)
    model = make_table_model(dh, ("base", "tool", "origins", "gains"))
    names = [(p.element, p.name) for p in model.chain.parameters]
    assert [where for where, what in names if what == "beta"] == ["two", "four"]
    numbers, q = {name: k for k, name in enumerate(names)}, np.array([[0.3, -0.5, 0.2, 1.1]])

    def place(moved: dict[int, Number]) -> Pose:
        def at(where: str, what: str, value: float) -> Number:
            return as_interval(value) + moved.get(numbers.get((where, what), -1), 0)

        T = joined(six(model, "base", moved), (matrix(dh.base[:3, :3]), vector(dh.base[:3, 3])))
        for i, row in enumerate(dh.rows):
            value = row.sense * as_interval(q[0, i]) * (1 + moved.get(numbers[row.joint, "gain"], 0))
            theta, d = at(row.joint, "theta", row.theta), at(row.joint, "d", row.d)
            theta, d = (theta + value, d) if row.kind.turns else (theta, d + value)
            S = joined(elementary(True, 2, theta), elementary(False, 2, d))
            a, alpha = at(row.joint, "a", row.a), at(row.joint, "alpha", row.alpha)
            X = joined(elementary(False, 0, a), elementary(True, 0, alpha))
            X = joined(X, elementary(True, 1, at(row.joint, "beta", row.beta)))
            T = joined(T, joined(S, X) if convention is DHConvention.STANDARD else joined(X, S))
        T = joined(T, (matrix(dh.tool[:3, :3]), vector(dh.tool[:3, 3])))
        return joined(T, six(model, "tool", moved))

    values = dh.coupling.values(q)
    poses, columns = model.chain.poses_and_jacobian(values)
    np.testing.assert_allclose(poses, dh.placement(q), atol=1e-14)
    difference = np.abs(columns[0] - quotients(model, place))
    assert difference.max() < model.chain.rounding_bound(values)


@pytest.mark.parametrize(("tip", "base"), [("three", None), (None, "three")])
def test_a_table_with_another_tip_or_base_is_refused(tip: str | None, base: str | None) -> None:
    with pytest.raises(InputError, match="a table is fitted from its base to its tip"):
        calibrate(table(DHConvention.STANDARD), tip=tip, base=base)
