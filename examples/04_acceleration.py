"""Split an acceleration into its transverse, centripetal, Coriolis and sliding parts, by joint.

You learn that accelerations are classical, and that the terms of equation 7.130 add up to the acceleration.
"""

import numpy as np

import urdfkin
from urdfkin.compiled.breakdown import ACCELERATION_KINDS

robot = urdfkin.load("polar")  # The textbook's robot has a revolute and a prismatic joint.
q = np.array([0.4, 0.5])  # rad, m
v = np.array([1.0, 0.8])
a = np.array([0.2, -0.3])
frame = robot.tip_frame

total = robot.acceleration(q, v, a, frame)
parts = robot.acceleration_breakdown(q, v, a, frame)
print(f"{'':<14}" + "".join(f"{kind:>14}" for kind in ACCELERATION_KINDS) + "   |linear|, m/s^2")
for joint, terms in zip(parts.joints, parts.terms, strict=True):
    print(f"{joint:<14}" + "".join(f"{np.linalg.norm(term[:3]):14.4f}" for term in terms))
print("sum of the parts:", parts.total.round(6))
print("acceleration:    ", total.round(6))
assert np.allclose(parts.total, total)
