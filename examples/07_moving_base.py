"""A robot on a base that moves: the initial conditions of the recursion.

Learn: a base is given where it is known (`BaseMotion`), or as coordinates (a floating root joint).
"""

import numpy as np

import urdfkin

arm = urdfkin.load("ur5")
q, v, a = np.full(6, 0.3), np.zeros(6), np.zeros(6)

# A turntable at 1 rad/s, the arm standing still on it: only the centripetal acceleration is left.
turntable = urdfkin.BaseMotion(velocity=np.array([0, 0, 0, 0, 0, 1.0]))  # [linear; angular], world axes
acceleration = arm.acceleration(q, v, a, "tool0", base=turntable)
x, y, _ = arm.placement(q, "tool0", base=turntable)[:3, 3]
print("on a turntable:", acceleration[:3].round(6), "m/s^2")
assert np.allclose(acceleration[:3], [-x, -y, 0.0])  # w x (w x d), 7.130

# The same arm with six more coordinates: its base is unknown to the file, and known to q and v.
free = urdfkin.load("ur5", root_joint="floating")
q_free = np.concatenate([[0, 0, 0, 0, 0, 0, 1.0], q])  # x y z, quaternion x y z w, then the joints
v_free = np.concatenate([[0, 0, 0, 0, 0, 1.0], v])
print("as a floating base:", free.velocity(q_free, v_free, "tool0").round(6))
print(free.certificate())
