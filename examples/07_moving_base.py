"""Compute the motion of a robot on a moving base.

You learn two ways to describe a moving base: pass a known motion as `BaseMotion`, or add a floating root
joint.
"""

import numpy as np

import urdfkin

arm = urdfkin.load("ur5")
q, v, a = np.full(6, 0.3), np.zeros(6), np.zeros(6)

# The arm is at rest on a turntable at 1 rad/s, so there is only the centripetal acceleration.
turntable = urdfkin.BaseMotion(velocity=np.array([0, 0, 0, 0, 0, 1.0]))  # [linear; angular], world axes
acceleration = arm.acceleration(q, v, a, "tool0", base=turntable)
x, y, _ = arm.placement(q, "tool0", base=turntable)[:3, 3]
print("on a turntable:", acceleration[:3].round(6), "m/s^2")
assert np.allclose(acceleration[:3], [-x, -y, 0.0])  # w x (w x d), 7.130

# The pose of a floating base is part of q, and its velocity is part of v.
free = urdfkin.load("ur5", root_joint="floating")
# A configuration begins with the position x, y, z and the quaternion x, y, z, w of the base.
q_free = np.concatenate([[0, 0, 0, 0, 0, 0, 1.0], q])
v_free = np.concatenate([[0, 0, 0, 0, 0, 1.0], v])
print("as a floating base:", free.velocity(q_free, v_free, "tool0").round(6))
print(free.certificate())
