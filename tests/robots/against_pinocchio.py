"""Ask Pinocchio directly, not through urdfkin's oracle: the oracle itself is under test here."""

from __future__ import annotations

from dataclasses import dataclass
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
    """Pinocchio's own model of a robot's text; `mimic=True` throws for some robots."""
    roots = {"floating": pin.JointModelFreeFlyer, "planar": pin.JointModelPlanar}
    if robot.root_joint is not None:
        return pin.buildModelFromXML(robot.urdf, roots[robot.root_joint](), mimic=mimic)
    return pin.buildModelFromXML(robot.urdf, mimic=mimic)


def coupling(robot: Robot, model: Any) -> FloatArray:
    """G of v_full = G v: from the tree's mimic rules and the models' joint names."""
    G = np.zeros((model.nv, robot.nv))
    for i, joint in enumerate(robot.tree.joints):
        if joint.kind.nv:
            theirs = model.joints[model.getJointId(joint.name)]
            for c in range(joint.kind.nv):
                factor = joint.mimic.multiplier if joint.mimic else 1.0
                G[theirs.idx_v + c, robot.tree.v_index[i] + c] = factor
    return G


@dataclass(frozen=True)
class Answers:
    """One frame at one sample."""

    placement: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jacobian: FloatArray


def ask(
    robot: Robot, q: FloatArray, v: FloatArray, a: FloatArray, frame: str, reference: Reference
) -> Answers:
    """Pinocchio's default model about a link, followers coupled by `coupling`."""
    model = model_of(robot)
    data, G, full = model.createData(), coupling(robot, model), robot.to_pinocchio(q)
    index = model.getFrameId(frame.removeprefix("link:"), pin.FrameType.BODY)
    assert index < model.nframes
    wanted = REFERENCES[reference]
    pin.forwardKinematics(model, data, full, G @ v, G @ a)
    placement = np.array(pin.updateFramePlacement(model, data, index).homogeneous)
    velocity = np.array(pin.getFrameVelocity(model, data, index, wanted).vector)
    acceleration = np.array(pin.getFrameClassicalAcceleration(model, data, index, wanted).vector)
    J = np.zeros((6, 0))
    if model.nv:  # Pinocchio 4.1 kills the process for a robot without joints
        pin.computeJointJacobians(model, data, full)
        J = np.array(pin.getFrameJacobian(model, data, index, wanted)).reshape(6, model.nv)
    return Answers(placement, velocity, acceleration, J @ G)
