"""Section 7.3: points in moving frames, equations 7.58 to 7.61."""

from functools import partial
from typing import Any

import numpy as np

from tests.high_precision import array, column, mp, rate
from tests.kinematics.rotation import strategies
from tests.moving import ORIENTATIONS, ORIGINS, T, frame
from urdfkin.kinematics.bodies import compose, point_position, point_velocity

close = partial(strategies.close, room=32.0)

P = column(mp.mpf(3) / 10, mp.mpf(11) / 10, -mp.mpf(7) / 10)


def p_0_in_frame_1(t: Any) -> Any:
    return ORIGINS[0](t) + ORIENTATIONS[0](t) * P


def p_0_in_frame_2(t: Any) -> Any:
    return ORIGINS[0](t) + ORIENTATIONS[0](t) * (ORIGINS[1](t) + ORIENTATIONS[1](t) * P)


def test_7_58_the_position_of_a_point_of_frame_1_is_rotated_and_displaced() -> None:
    assert close(point_position(frame(0), array(P)), array(p_0_in_frame_1(mp.mpf(T))))


def test_7_59_the_velocity_of_a_point_of_frame_1_is_w_cross_p_plus_the_origins_velocity() -> None:
    velocity = point_velocity(frame(0), array(P))
    assert close(velocity.total, array(rate(p_0_in_frame_1, T)))
    assert close(velocity.rotation, np.cross(frame(0).w_0_1, frame(0).R_0_1 @ array(P)))
    assert close(velocity.origin, array(rate(ORIGINS[0], T)))


def test_7_60_the_position_of_a_point_of_frame_2_is_rotated_and_displaced_twice() -> None:
    assert close(point_position(compose(frame(0), frame(1)), array(P)), array(p_0_in_frame_2(mp.mpf(T))))


def test_7_61_the_velocity_of_a_point_of_frame_2_has_the_texts_four_terms() -> None:
    first, second = frame(0), frame(1)
    both = compose(first, second)
    four = (
        first.v_0_1
        + np.cross(first.w_0_1, first.R_0_1 @ second.d_0_1)
        + first.R_0_1 @ second.v_0_1
        + np.cross(both.w_0_1, both.R_0_1 @ array(P))
    )
    assert close(point_velocity(both, array(P)).total, array(rate(p_0_in_frame_2, T)))
    assert close(four, array(rate(p_0_in_frame_2, T)))
