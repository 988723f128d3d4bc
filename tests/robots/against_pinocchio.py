"""Compare a robot with Pinocchio directly, because these tests also test urdfkin's oracle."""

from typing import Any

import numpy as np
import pinocchio as pin

from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot

REFERENCES = {
    Reference.LOCAL: pin.LOCAL,
    Reference.WORLD: pin.WORLD,
    Reference.LOCAL_WORLD_ALIGNED: pin.LOCAL_WORLD_ALIGNED,
}


def model_of(robot: Robot, *, mimic: bool = False) -> Any:
    """Return Pinocchio's model of a robot's text; `mimic=True` raises an exception for some robots."""
    roots = {"floating": pin.JointModelFreeFlyer, "planar": pin.JointModelPlanar}
    if robot.root_joint is not None:
        return pin.buildModelFromXML(robot.urdf, roots[robot.root_joint](), mimic=mimic)
    return pin.buildModelFromXML(robot.urdf, mimic=mimic)


def coupling(robot: Robot, model: Any) -> FloatArray:
    """Return G of v_full = G v, from the mimic rules of the tree and the names of the joints."""
    G = np.zeros((model.nv, robot.nv))
    for i, joint in enumerate(robot.tree.joints):
        if joint.kind.nv:
            theirs = model.joints[model.getJointId(joint.name)]
            for c in range(joint.kind.nv):
                factor = joint.mimic.multiplier if joint.mimic else 1.0
                G[theirs.idx_v + c, robot.tree.v_index[i] + c] = factor
    return G


def assert_agrees(
    robot: Robot,
    q: FloatArray,
    v: FloatArray,
    a: FloatArray,
    link: str,
    reference: Reference,
    *,
    is_odd: bool = False,
) -> None:
    """Compare the results for a link with Pinocchio's model without mimic joints.

    The tolerance is larger for an odd robot, which may have large lengths.
    """
    model = model_of(robot)
    data, G, full = model.createData(), coupling(robot, model), robot.to_pinocchio(q)
    index = model.getFrameId(link.removeprefix("link:"), pin.FrameType.BODY)
    assert index < model.nframes
    wanted = REFERENCES[reference]
    pin.forwardKinematics(model, data, full, G @ v, G @ a)
    placement = np.array(pin.updateFramePlacement(model, data, index).homogeneous)
    velocity = np.array(pin.getFrameVelocity(model, data, index, wanted).vector)
    acceleration = np.array(pin.getFrameClassicalAcceleration(model, data, index, wanted).vector)
    J = np.zeros((6, 0))
    if model.nv:  # without joints, Pinocchio 4.1 crashes the process
        pin.computeJointJacobians(model, data, full)
        J = np.array(pin.getFrameJacobian(model, data, index, wanted)).reshape(6, model.nv)
    room = 1e-12 * (1.0 + np.abs(acceleration).max() + (np.abs(placement).max() if is_odd else 0.0))
    assert np.abs(robot.placement(q, link) - placement).max() < room
    assert np.abs(robot.velocity(q, v, link, reference) - velocity).max() < room
    assert np.abs(robot.jacobian(q, link, reference) - J @ G).max(initial=0.0) < room
    assert (
        np.abs(robot.acceleration(q, v, a, link, reference) - acceleration).max()
        < (1e3 if is_odd else 10.0) * room
    )
