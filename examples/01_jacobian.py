"""Compute the Jacobian at a pose that is given by joint names, and interpret one of its columns.

You learn how to name joints, which units apply, how rows and columns are ordered, and how results are
checked.
"""

import numpy as np

import urdfkin

robot = urdfkin.load("panda")  # The argument is a name, a path, or URDF text.
# The text describes a configuration: three joints have the given values, and the other joints have the values
# of `neutral`. An angle without a unit is in radians; `-30deg` is in degrees; `-2*pi/3` is a multiple of pi.
# Instead of a text, you can pass a mapping from joint names to values.
pose = "neutral, panda_joint2=-30deg, panda_joint4=-2*pi/3, panda_joint6=1.5"

J = robot.jacobian(pose, "panda_hand_tcp")  # (6, nv), rows [linear; angular], eq. 7.85
np.set_printoptions(precision=3, suppress=True)
print(f"columns: {', '.join(robot.velocity_names)}")
print(J)

column = J[:, robot.velocity_names.index("panda_joint4")]
print(f"1 rad/s of the elbow alone: {column[:3]} m/s and {column[3:]} rad/s")
print(robot.certificate())
