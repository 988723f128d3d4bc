"""Compute the Jacobian at a pose with named joints, and interpret a column.

You learn how to name joints and which units apply. You also learn the order of rows and columns, and how
results are checked.
"""

import numpy as np

import urdfkin

robot = urdfkin.load("panda")  # The argument is a name, a path, or URDF text.
# The text changes three joints of the configuration `neutral`.
# `-30deg` is in degrees; `1.5` and `-2*pi/3` are in radians.
# You can also pass a mapping from joint names to values.
pose = "neutral, panda_joint2=-30deg, panda_joint4=-2*pi/3, panda_joint6=1.5"

J = robot.jacobian(pose, "panda_hand_tcp")  # (6, nv), rows [linear; angular], eq. 7.85
np.set_printoptions(precision=3, suppress=True)
print(f"columns: {', '.join(robot.velocity_names)}")
print(J)

column = J[:, robot.velocity_names.index("panda_joint4")]
print(f"1 rad/s of the elbow alone: {column[:3]} m/s and {column[3:]} rad/s")
print(robot.certificate())
