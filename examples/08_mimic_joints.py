"""Mimic joints: fingers that follow a leader have no coordinate of their own.

Learn: `q` holds leaders only, a follower's motion stands in its leader's column, and `mimic=False` frees it.
"""

import numpy as np

import urdfkin

robot = urdfkin.load("panda")
free = urdfkin.load("panda", mimic=False)
print("coupled:", robot.nq, "coordinates; freed:", free.nq)
print("the freed ones:", sorted(set(free.coordinate_names) - set(robot.coordinate_names)))

q = robot.neutral()
q[-1] = 0.04  # the leading finger, metres
left, right = (robot.placement(q, f"panda_{side}finger")[:3, 3] for side in ("left", "right"))
print(f"gap between the fingers: {1e3 * np.linalg.norm(left - right):.1f} mm")

J = robot.jacobian(q, "panda_rightfinger")
print("the follower's column for its leader's rate:", J[:3, -1].round(3))
assert np.linalg.norm(J[:3, -1]) > 0.99
