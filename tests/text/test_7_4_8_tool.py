"""Section 7.4.8: velocities of a tool, referred to the wrist; equation 7.115."""

import numpy as np

from tests.text.robots import close, motion, robot
from urdfkin.kinematics.bodies import frame_velocity, tool_velocity

MOVING = motion("elbow", 6)
#: The tool of robots/elbow.urdf lies 0.15 m along z6.
D_6_TOOL = 0.15 * MOVING.rotation(6)[:, 2]


def test_7_115_the_tools_velocity_is_converted_to_the_wrist_and_back() -> None:
    tool = robot("elbow").velocity(MOVING.q, MOVING.v, "tool")
    wrist = robot("elbow").velocity(MOVING.q, MOVING.v, "wrist")
    assert close(frame_velocity(tool, D_6_TOOL), wrist)
    assert close(tool_velocity(wrist, D_6_TOOL), tool)
    assert close(frame_velocity(tool, D_6_TOOL), np.concatenate((MOVING.vel(6), MOVING.w(6))))
    assert np.abs(tool[:3] - wrist[:3]).max() > 0.01


def test_the_wrists_linear_velocity_does_not_depend_on_the_last_three_joints() -> None:
    other = MOVING.v.copy()
    other[3:] += [1.0, -2.0, 3.0]
    wrist = [robot("elbow").velocity(MOVING.q, v, "wrist") for v in (MOVING.v, other)]
    assert close(wrist[0][:3], wrist[1][:3])
    assert not close(wrist[0][3:], wrist[1][3:])
