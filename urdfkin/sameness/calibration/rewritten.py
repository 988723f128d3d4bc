"""A robot whose joints stand elsewhere: its own text with their origins in it, and how far they moved."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from urdfkin.kinematics.rotation import log_rotation
from urdfkin.loading import load
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.sameness.calibration.into_urdf import with_origins
from urdfkin.sameness.changes import Changes, diff
from urdfkin.verify.certificate import Certificate


@dataclass(frozen=True, eq=False)
class Rewritten:
    """A robot with other origins.

    Attributes:
        robot: As it was.
        origins: (4, 4) by joint, of those that moved.
        certificate: What Pinocchio said of the text with them.
    """

    robot: Robot
    origins: Mapping[str, FloatArray]
    certificate: Certificate | None = None

    @cached_property
    def text(self) -> bytes:
        """The URDF's own text with the new origins in it; every other byte is as it was."""
        return with_origins(self.robot.urdf.encode(), self.origins)

    @cached_property
    def loaded(self) -> Robot:
        """The robot of that text, loaded as the first one was."""
        mimic = self.robot.verifier.mimic
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what there is to warn of was warned of when it was loaded
            return load(self.text, mimic=mimic, root_joint=self.robot.root_joint)

    @cached_property
    def changes(self) -> Changes:
        """What changed, in the words of `urdfkin.diff`, and how far each joint's changes move which frame."""
        return diff(self.robot, self.loaded)

    @cached_property
    def moved(self) -> dict[str, tuple[float, float]]:
        """By how much (m, rad) each joint's origin moved."""
        tree = self.robot.tree
        old = {name: tree.joints[tree.joint_index(name)].T_parent_joint for name in self.origins}
        return {
            name: (
                float(np.linalg.norm(T[:3, 3] - old[name][:3, 3])),
                float(np.linalg.norm(log_rotation(old[name][:3, :3].T @ T[:3, :3]))),
            )
            for name, T in self.origins.items()
        }
