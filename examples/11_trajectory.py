"""Find a frame's largest velocity, largest acceleration and smallest singular value along a trajectory.

You learn to make a straight joint motion from rest to rest, and to compute and check the motion of a frame.
"""

import numpy as np

import urdfkin
from urdfkin.robot.trajectory import make_line_trajectory

robot = urdfkin.load("ur5")
start = np.array([0.0, -1.5, 1.2, -1.0, -1.5, 0.0])
end = np.array([1.5, -0.8, 0.6, -1.2, -1.0, 0.5])
motion = make_line_trajectory(robot, start, end, duration=2.0, samples=101)
tool = urdfkin.frame_motion(robot, motion, "tool0")

speed = np.linalg.norm(tool.velocity[:, :3], axis=1)
magnitude = np.linalg.norm(tool.acceleration[:, :3], axis=1)
smallest = tool.singular_values[:, -1]
for what, values, best, unit in (
    ("fastest", speed, speed.argmax(), "m/s"),
    ("most accelerated", magnitude, magnitude.argmax(), "m/s^2"),
    ("nearest to a singularity", smallest, smallest.argmin(), "(smallest singular value)"),
):
    print(f"{what:<25} at {motion.t[best]:.2f} s: {values[best]:.3f} {unit}")
print("Pinocchio agrees with every sample:", tool.agrees)
