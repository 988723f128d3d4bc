"""Compute one velocity in three reference frames, and convert it from one reference frame to another.

You learn that LOCAL, WORLD and LOCAL_WORLD_ALIGNED have the same meaning as in Pinocchio.
"""

import numpy as np

import urdfkin

robot = urdfkin.load("ur5")
q, v = np.full(6, 0.5), np.full(6, 0.2)
np.set_printoptions(precision=4, suppress=True)
for reference in urdfkin.Reference:
    print(f"{reference.name:<20} {robot.velocity(q, v, 'tool0', reference)}")

# LOCAL expresses the velocity in the tool's axes, and LOCAL_WORLD_ALIGNED in the world's axes. The tool's
# rotation matrix converts from LOCAL to LOCAL_WORLD_ALIGNED.
R_world_tool = robot.placement(q, "tool0")[:3, :3]
local = robot.velocity(q, v, "tool0", "local")
aligned = robot.velocity(q, v, "tool0")  # the default frame
assert np.allclose(R_world_tool @ local[:3], aligned[:3])

# The velocity in WORLD is the velocity of the body's point that coincides with the world's origin.
p_world_tool = robot.placement(q, "tool0")[:3, 3]
there = aligned[:3] - np.cross(aligned[3:], p_world_tool)
assert np.allclose(there, robot.velocity(q, v, "tool0", "world")[:3])
print("the conversions by hand agree")
