"""Pinocchio, called in a Python loop: the fewest calls that give each quantity."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pinocchio as pin

from scripts.benchmarking.calls import Calls
from scripts.benchmarking.subject import Subject
from scripts.benchmarking.work import Work

LIBRARY = "pin"
LOOP = "Pinocchio, Python loop"


def calls(subject: Subject, quantity: str) -> Iterator[Calls]:
    """`computeFrameJacobian`, or `forwardKinematics` and `getFrameClassicalAcceleration`."""
    yield pinocchio_calls(subject.urdf, subject.frame, quantity)


def batches(subject: Subject, quantity: str) -> Iterator[Work]:
    """One configuration after the other."""
    for one in calls(subject, quantity):
        yield one.batch(subject, quantity)


def pinocchio_calls(urdf: str, frame: str, quantity: str) -> Calls:
    """The calls on a model of their own."""
    model = pin.buildModelFromXML(urdf)
    names = {
        "model": model,
        "data": model.createData(),
        "frame": model.getFrameId(frame),
        "aligned": pin.LOCAL_WORLD_ALIGNED,
        "jacobian": pin.computeFrameJacobian,
        "forward": pin.forwardKinematics,
        "acceleration": pin.getFrameClassicalAcceleration,
    }
    if quantity == "jacobian":
        return Calls(LOOP, names, ("jacobian(model, data, q, frame, aligned)",))
    forward, get = "forward(model, data, q, v, a)", "acceleration(model, data, frame, aligned)"
    return Calls(
        LOOP,
        names,
        (forward, get),
        store=(forward, f"out[k] = {get}.vector"),
        read_one=lambda motion: np.array(motion.vector),
    )


def oracle_calls(subject: Subject, quantity: str) -> Calls:
    """What a check of urdfkin asks Pinocchio: `computeJointJacobians` and `getFrameJacobian`, or as above."""
    usual = pinocchio_calls(subject.urdf, subject.frame, quantity)
    if quantity == "acceleration":
        return usual
    names = {**usual.names, "compute": pin.computeJointJacobians, "get": pin.getFrameJacobian}
    return Calls(LOOP, names, ("compute(model, data, q)", "get(model, data, frame, aligned)"))
