"""Compute with mimic joints: one finger of a gripper mimics the other finger.

You learn that the vector `q` contains no mimic joints. In the Jacobian, the column of the mimicked joint
includes the motion of the mimic joint. With `mimic=False`, mimic joints are independent joints.
"""

import numpy as np

import urdfkin

robot = urdfkin.load("panda")
free = urdfkin.load("panda", mimic=False)
print("with mimic rules:", robot.nq, "coordinates; without:", free.nq)
print("free joints:", sorted(set(free.coordinate_names) - set(robot.coordinate_names)))

q = robot.neutral()
q[-1] = 0.04  # the mimicked finger, metres
left, right = (robot.placement(q, f"panda_{side}finger")[:3, 3] for side in ("left", "right"))
print(f"gap between the fingers: {1e3 * np.linalg.norm(left - right):.1f} mm")

J = robot.jacobian(q, "panda_rightfinger")
print("Jacobian column of the mimicked joint, for the frame of the mimic joint:", J[:3, -1].round(3))
assert np.linalg.norm(J[:3, -1]) > 0.99
