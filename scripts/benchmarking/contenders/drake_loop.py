"""Drake, called in a loop: `CalcJacobianSpatialVelocity` and `CalcBiasSpatialAcceleration`."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JacobianWrtVariable

from scripts.benchmarking.calls import Calls
from scripts.benchmarking.conventions import LINEAR_FIRST
from scripts.benchmarking.subject import Subject
from scripts.benchmarking.work import Work

LIBRARY = "drake"


def calls(subject: Subject, quantity: str) -> Iterator[Calls]:
    """Rows come as [angular; linear]; an acceleration is J a and what the rates add to it."""
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModelsFromString(subject.urdf, "urdf")
    world = plant.world_frame()
    plant.WeldFrames(world, plant.GetFrameByName(subject.robot.link_names[0]))
    plant.Finalize()
    starts = [plant.GetJointByName(name).velocity_start() for name in subject.robot.joint_names]
    names = {
        "plant": plant,
        "context": plant.CreateDefaultContext(),
        "tip": (
            JacobianWrtVariable.kV,
            plant.GetFrameByName(subject.frame),
            np.zeros(3),
            world,
            world,
        ),
        "place": plant.SetPositions,
        "move": plant.SetVelocities,
        "jacobian": plant.CalcJacobianSpatialVelocity,
        "bias": plant.CalcBiasSpatialAcceleration,
    }
    J = "jacobian(context, *tip)"
    if quantity == "jacobian":
        lines: tuple[str, ...] = ("place(context, q)", J)
    else:
        total = f"{J} @ a + bias(context, *tip).get_coeffs()"
        lines = ("place(context, q)", "move(context, v)", total)
    yield Calls(
        "Drake, loop",
        names,
        lines,
        order=[int(i) for i in np.argsort(starts)],
        read=lambda x: x[:, LINEAR_FIRST] if x.ndim == 2 else x[:, LINEAR_FIRST][..., starts],
    )


def batches(subject: Subject, quantity: str) -> Iterator[Work]:
    """One configuration after the other."""
    for one in calls(subject, quantity):
        yield one.batch(subject, quantity)
