"""Arms with known errors, and poses measured on them."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from urdfkin.calibration.calibrate import Calibration, calibrate
from urdfkin.calibration.parameters import CalibrationModel, make_urdf_model
from urdfkin.kinematics.rotation import exp_rotation
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.robot.loading import load

#: Revolute, prismatic and continuous joints with oblique axes and coordinate axes, on two branches.
BRANCHED = """<?xml version="1.0"?>
<!-- measured on the bench; do not touch -->
<robot name="branched">
  <link name="trunk"/><link name="a"/><link name="b"/><link name="c"/><link name="d"/><link name="hand"/>
  <joint name="one" type="continuous">
    <parent link="trunk"/><child link="a"/>
    <origin xyz="0.1 0.2 0.3"   rpy='0.1 -0.2 1.5'/>
    <axis xyz="0 -1 0"/>
  </joint>
  <joint name="two" type="prismatic"><parent link="a"/><child link="b"/>
    <axis xyz="0.6 0 0.8"/> <!-- no origin -->
    <limit lower="-0.5" upper="0.5" effort="1" velocity="1"/></joint>
  <joint name="three" type="revolute">
    <origin
        rpy="1.5707963267948966 0 0"
        xyz="0 0.3 0"/>
    <parent link="trunk"/>
    <child link="c"/>
    <axis xyz="0.48 0.6 0.64"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/>
  </joint>
  <joint name="four" type="continuous"><parent link="c"/><child link="d"/><origin xyz="0.4 0 0.1"/>
    <axis xyz="0 0 1"/></joint>
  <joint name="fix" type="fixed"><parent link="d"/><child link="hand"/><origin xyz="0.05 0.06 0.07"/></joint>
</robot>
"""


@dataclass(frozen=True)
class Bench:
    """A robot, the true errors of its parameters, configurations, and the true poses of the tip."""

    robot: Robot
    model: CalibrationModel
    truth: FloatArray
    q: FloatArray
    T: FloatArray

    def values(self, q: FloatArray) -> FloatArray:
        return self.model.coupling.values(self.model.coupling.select(self.robot.tree, q))

    def poses(self, q: FloatArray) -> FloatArray:
        """Return the true poses (s, 4, 4) at configurations."""
        return self.model.chain.poses(self.values(q), self.truth)

    def noisy(self, metres: float, radians: float, seed: int) -> FloatArray:
        """Return the poses (s, 4, 4) that an instrument measures with noise of these standard deviations."""
        rng = np.random.default_rng(seed)
        T, s = self.T.copy(), len(self.T)
        T[:, :3, 3] += metres * rng.standard_normal((s, 3))
        T[:, :3, :3] = exp_rotation(radians * rng.standard_normal((s, 3))) @ T[:, :3, :3]
        return T

    def calibrate(
        self, poses: FloatArray | None = None, q: FloatArray | None = None, **how: Any
    ) -> Calibration:
        """Calibrate the robot, by default with the true poses."""
        poses = self.T if poses is None else poses
        q = self.q if q is None else q
        return calibrate(self.robot, q, poses, tip=self.model.tip, base=self.model.base, **how)


def bench(
    name: str,
    fit: tuple[str, ...],
    tip: str,
    base: str,
    *,
    poses: int = 30,
    error: float = 2e-3,
    seed: int = 0,
) -> Bench:
    """Return a robot whose parameters have random errors with the standard deviation `error` (m, rad).

    The parameters of base and tool have no errors.
    """
    robot = load(name, verify=False)
    model = make_urdf_model(robot.tree, tip, base, fit)
    rng = np.random.default_rng(seed)
    truth = error * rng.standard_normal(len(model.chain.parameters))
    truth[[p.is_base_or_tool for p in model.chain.parameters]] = 0.0
    q = robot.sample(poses, seed)
    values = model.coupling.values(model.coupling.select(robot.tree, q))
    return Bench(robot, model, truth, q, model.chain.poses(values, truth))


def pose(seed: int, distance: float) -> FloatArray:
    """Return a pose (4, 4) with a random orientation, and a random position at a distance."""
    rng = np.random.default_rng(seed)
    T = np.eye(4)
    T[:3, :3] = exp_rotation(rng.uniform(-2.0, 2.0, 3))
    direction = rng.standard_normal(3)
    T[:3, 3] = distance * direction / np.linalg.norm(direction)
    return T
