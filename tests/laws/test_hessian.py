"""The Hessian is the derivative of the Jacobian with respect to each joint, checked at fifty digits."""

from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

import urdfkin
from tests.laws.subjects import NAMES, robot_of, state
from urdfkin.compiled import evaluate
from urdfkin.kinematics import equations as eq
from urdfkin.kinematics.roundings import EPS
from urdfkin.model.base_motion import BaseMotion
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray, JointKind, pose
from urdfkin.robot import Robot
from urdfkin.verify.exact import recursion
from urdfkin.verify.exact.numbers import (
    as_interval,
    precision,
    read_exact_joints,
    rotation_about,
    rotation_from_quaternion,
)
from urdfkin.verify.quantities import HESSIAN, JACOBIAN

_STEP = as_interval(2.0**-60)
#: Tolerance of the difference quotients; their error is proportional to the square of the step, 2^-120.
#: Rounding loses only 18 of 80 digits.
_ROOM = 1e-30
_Z = (0, 0, 1)


def stepped(robot: Robot, q: FloatArray, rate: int, step: Any) -> list[Any]:
    out: list[Any] = [as_interval(x) for x in q]
    tree = robot.tree
    for joint, at, rate_at in zip(tree.joints, tree.q_index, tree.v_index, strict=True):
        if joint.mimic is not None or not rate_at <= rate < rate_at + joint.kind.nv:
            continue
        unit = [step if c == rate - rate_at else 0.0 for c in range(joint.kind.nv)]
        if joint.kind is JointKind.PLANAR:
            x, y, _ = eq.rotate(rotation_about(_Z, out[at + 2]), (unit[0], unit[1], 0))
            out[at : at + 3] = [out[at] + x, out[at + 1] + y, out[at + 2] + unit[2]]
        elif joint.kind is JointKind.FLOATING:
            quaternion = tuple(out[at + 3 : at + 7])
            x, y, z, w = quaternion
            slide = eq.rotate(rotation_from_quaternion(quaternion), tuple(unit[:3]))
            half = tuple(part / 2 for part in unit[3:])
            turn = eq.plus(eq.times(w, half), eq.cross((x, y, z), half))
            moved = [*eq.plus(tuple(out[at : at + 3]), slide), *eq.plus((x, y, z), turn)]
            out[at : at + 7] = [*moved, w - eq.dot((x, y, z), half)]
        else:
            out[at] += step
    return out


@pytest.mark.slow
@pytest.mark.parametrize("reference", Reference)
@pytest.mark.parametrize("name", ["panda", "floating_root", "planar_and_floating_in_the_middle", "tree_3"])
def test_the_hessian_is_the_difference_quotient_of_the_jacobian_at_fifty_digits(
    name: str, reference: Reference
) -> None:
    robot = robot_of(name)
    q, link, still = state(robot, 1, 3)[0][0], robot.tree.frame_link(robot.tip_frame), [0.0] * robot.nv

    def jacobian(rate: int, step: Any) -> NDArray[Any]:
        motion = recursion.compute_motion(robot.tree, joints, stepped(robot, q, rate, step), still, still)
        return JACOBIAN.enclose(motion, link, reference)

    with precision(80):
        joints = read_exact_joints(robot.urdf, robot.tree, robot.tree.path(link))
        found = HESSIAN.enclose(
            recursion.compute_motion(robot.tree, joints, list(q), still, still), link, reference
        )
        for j in range(robot.nv):
            quotient = (jacobian(j, _STEP) - jacobian(j, -_STEP)) / (2 * _STEP)
            assert (abs(found[..., j] - quotient) < _ROOM).all()
    ours = robot.hessian(q, robot.tip_frame, reference)
    size = max(1.0, float(np.abs(ours).max()))
    assert np.abs(ours - found.astype(float)).max() < 100.0 * EPS * size


@pytest.mark.slow
@pytest.mark.parametrize("reference", Reference)
@pytest.mark.parametrize("name", NAMES)
def test_the_hessian_times_the_rates_is_the_jacobian_rate(name: str, reference: Reference) -> None:
    robot = robot_of(name)
    q, v, _ = state(robot, 9, 4)
    frames = robot.link_frames[-3:]
    H = robot.hessian(q, frames, reference)
    J_rate = robot.jacobian_rate(q, v, frames, reference)
    summed = np.einsum("nfrij,nj->nfri", H, v)
    size = np.einsum("nfrij,nj->nfri", np.abs(H), np.abs(v)).max() + 1.0
    assert np.abs(summed - J_rate).max() < 200.0 * EPS * size


@pytest.mark.parametrize("name", ["panda", "ur5", "mimic_hand_40_sliding"])
def test_the_asymmetry_of_the_hessian_is_zero_in_linear_rows_and_the_cross_product_of_axes_in_angular_rows(
    name: str,
) -> None:
    robot = urdfkin.load(name, verify=False) if name == "ur5" else robot_of(name)
    q = state(robot, 5, 5)[0]
    H, w = robot.hessian(q, robot.tip_frame), robot.jacobian(q, robot.tip_frame)[:, 3:]
    linear, angular = np.split(H - H.swapaxes(-1, -2), 2, axis=1)
    np.testing.assert_allclose(linear, np.zeros_like(linear), rtol=0, atol=1e-14)
    curl = np.cross(w[:, :, np.newaxis, :], w[:, :, :, np.newaxis], axis=1)
    np.testing.assert_allclose(angular, curl, rtol=0, atol=1e-14)


def test_the_angular_rows_of_the_hessian_of_a_planar_arm_are_zero() -> None:
    arm = urdfkin.load("planar_two_link", verify=False)
    assert not arm.hessian(arm.sample(5), arm.tip_frame)[:, 3:].any()
    spatial = urdfkin.load("ur5", verify=False)
    H = spatial.hessian(spatial.sample(5), "tool0")[:, 3:]
    assert np.abs(H - H.swapaxes(-1, -2)).max() > 0.1


@pytest.mark.parametrize("name", NAMES)
def test_hessians_in_two_references_differ_by_the_motion_of_axes_and_point(name: str) -> None:
    robot = robot_of(name)
    q, _, _ = state(robot, 5, 6)
    frame = robot.tip_frame
    R, J = robot.placement(q, frame)[:, :3, :3], robot.jacobian(q, frame)
    H, local = robot.hessian(q, frame), robot.hessian(q, frame, "local")
    w = J[:, 3:, np.newaxis, :]
    for rows in (slice(0, 3), slice(3, 6)):
        own = H[:, rows] - np.cross(w, J[:, rows, :, np.newaxis], axis=1)
        turned = np.einsum("nsr,nsij->nrij", R, own)
        np.testing.assert_allclose(local[:, rows], turned, rtol=0, atol=1e-12 * max(1.0, np.abs(J).max()))


def test_the_placement_of_the_base_rotates_the_hessian() -> None:
    robot = urdfkin.load("panda")
    q = robot.sample(4)
    T = pose([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], [1.0, 2.0, 3.0])
    make_base_state = robot.hessian(q, "panda_hand", base=BaseMotion(T, np.ones(6), np.ones(6)))
    turned = np.kron(np.eye(2), T[:3, :3])
    expected = np.einsum("rs,nsij->nrij", turned, robot.hessian(q, "panda_hand"))
    np.testing.assert_allclose(make_base_state, expected, rtol=0, atol=1e-14)


def test_an_error_of_1e_12_in_the_hessian_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    robot, original = urdfkin.load("panda"), evaluate.hessians
    monkeypatch.setattr(evaluate, "hessians", lambda *x, **how: original(*x, **how) * (1.0 + 1e-11))
    with pytest.raises(urdfkin.VerificationError, match="the hessian of panda_hand"):
        robot.hessian(robot.sample(20), "panda_hand")


# -- behaviour of Pinocchio 4.1 that the oracle corrects; if a test fails, remove the correction ---


def pinocchios(model: Any, q: FloatArray, reference: Any) -> tuple[FloatArray, FloatArray]:
    """Return Pinocchio's Hessian of the last frame, and the difference quotient of Pinocchio's Jacobian."""
    frame, step = model.nframes - 1, 1e-6

    def jacobian(rate: int, by: float) -> FloatArray:
        data, v = model.createData(), np.zeros(model.nv)
        v[rate] = by
        pin.computeJointJacobians(model, data, pin.integrate(model, q, v))
        J: FloatArray = pin.getFrameJacobian(model, data, frame, reference)
        return J.copy()

    data = model.createData()
    pin.computeJointJacobians(model, data, q)
    pin.computeJointKinematicHessians(model, data)
    slopes = [(jacobian(j, step) - jacobian(j, -step)) / (2.0 * step) for j in range(model.nv)]
    return pin.getFrameKinematicHessian(model, data, frame, reference), np.stack(slopes, axis=-1)


@pytest.mark.parametrize("reference", [pin.LOCAL, pin.WORLD, pin.LOCAL_WORLD_ALIGNED])
def test_the_array_of_hessians_from_pinocchio_has_column_major_order_labelled_as_row_major(
    reference: Any,
) -> None:
    model = pin.buildModelFromXML(urdfkin.load("ur5", verify=False).urdf)
    said, is_so = pinocchios(model, np.linspace(0.1, 1.3, 6), reference)
    assert np.abs(said - is_so).max() > 0.1
    nv = model.nv
    assert np.abs(said.ravel("K").reshape(nv, nv, 6).T - is_so).max() < 1e-8


def test_pinocchios_local_hessian_of_a_free_flyer_behind_a_joint_has_wrong_columns() -> None:
    model = pin.Model()
    arm = model.addJoint(0, pin.JointModelRX(), pin.SE3.Identity(), "arm")
    ball = model.addJoint(arm, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "ball")
    model.addFrame(pin.Frame("tip", ball, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    said, is_so = pinocchios(model, pin.neutral(model), pin.LOCAL)
    said = said.ravel("K").reshape(7, 7, 6).T
    own = slice(1, 7)
    assert np.abs(is_so[:, own, own]).max() < 1e-9
    assert np.abs(said[:, own, own]).max() == 1.0
    said[:, own, own] = 0.0
    assert np.abs(said - is_so).max() < 1e-8
