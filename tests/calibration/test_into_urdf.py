"""A URDF gets new origins, and keeps every other byte."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.calibration.arms import BRANCHED, pose
from urdfkin.calibration.write_back import nearest_rpy, with_origins
from urdfkin.errors import InputError
from urdfkin.kinematics.rotation import rotation_from_rpy
from urdfkin.model.tree import FloatArray
from urdfkin.robot.loading import load
from urdfkin.system.files import Edit, edited

ORIGINS = {name: pose(k, 0.5) for k, name in enumerate(["one", "two", "three", "fix"])}


def blank(data: bytes) -> bytes:
    """A text without its origins' values."""
    return re.sub(rb"""(<origin\b[^>]*?)((?:\s+\w+\s*=\s*(?:"[^"]*"|'[^']*'))+)""", rb"\1", data)


def origins(data: bytes) -> dict[str, FloatArray]:
    robot = load(data, verify=False)
    return {joint.name: joint.T_parent_joint for joint in robot.tree.joints}


@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_every_other_byte_stays_and_the_new_origins_are_read(end: str, mark: bytes) -> None:
    old = mark + BRANCHED.replace("\n", end).encode()
    new = with_origins(old, ORIGINS)
    # The joint that had no origin has one before its parent.
    assert blank(new).replace(b'type="prismatic"><origin/>', b'type="prismatic">') == blank(old)
    found = origins(new)
    for name, T in ORIGINS.items():
        assert np.abs(found[name] - T).max() < 1e-14
    assert (found["four"] == origins(old)["four"]).all()


def test_lines_without_a_moved_joint_stay_and_quotes_and_order_too() -> None:
    text = BRANCHED.encode()
    old, new = (data.splitlines() for data in (text, with_origins(text, {"one": ORIGINS["one"]})))
    assert [k for k, pair in enumerate(zip(old, new, strict=True)) if pair[0] != pair[1]] == [6]
    assert re.fullmatch(rb"""    <origin xyz="\S+ \S+ \S+"   rpy='\S+ \S+ \S+'/>""", new[6])


def test_a_number_that_stays_keeps_its_digits() -> None:
    text = BRANCHED.replace('xyz="0.1 0.2 0.3"', 'xyz="1e-1 .20 0.3"').encode()
    T = origins(text)["one"].copy()
    assert with_origins(text, {"one": T}) == text
    T[2, 3] += 0.001
    assert with_origins(text, {"one": T}) == text.replace(b"1e-1 .20 0.3", b"1e-1 .20 0.301")


@pytest.mark.filterwarnings("ignore::urdfkin.UrdfWarning")
def test_a_quaternion_stays_a_quaternion() -> None:
    text = BRANCHED.replace('name="branched"', 'name="branched" version="1.1"')
    text = text.replace('<origin xyz="0.4 0 0.1"/>', '<origin xyz="0.4 0 0.1" quat_xyzw="0 0 -0.6 -0.8"/>')
    drawn = origins(text.encode())["four"].copy()
    new = with_origins(text.encode(), {"four": drawn @ pose(3, 0.1)})
    assert np.abs(origins(new)["four"] - drawn @ pose(3, 0.1)).max() < 1e-14
    assert b"rpy" not in next(line for line in new.splitlines() if b"quat_xyzw" in line)
    written = re.search(rb'quat_xyzw="([^"]*)"', new)
    assert written is not None
    assert np.dot([float(x) for x in written[1].split()], [0, 0, -0.6, -0.8]) > 0.0


def test_a_follower_that_cannot_follow_is_no_reason_to_refuse() -> None:
    text = BRANCHED.replace('<axis xyz="0 -1 0"/>', '<axis xyz="0 -1 0"/><mimic joint="nobody"/>').encode()
    assert b'<mimic joint="nobody"/>' in with_origins(text, {"one": ORIGINS["one"]})


def test_what_has_errors_or_no_such_joint_is_not_edited() -> None:
    with pytest.raises(InputError, match="a URDF with errors is not edited"):
        with_origins(b"<robot>", {})
    with pytest.raises(InputError, match="no such joint"):
        with_origins(BRANCHED.encode(), {"five": np.eye(4)})
    with pytest.raises(InputError, match="two edits overlap"):
        edited(b"abc", [Edit(0, 2), Edit(1, 3)])


angles = st.floats(-7.0, 7.0)


@given(st.tuples(angles, angles, angles), st.tuples(*[st.floats(-1e-3, 1e-3)] * 3))
def test_of_all_angles_the_nearest_are_written(
    old: tuple[float, float, float], by: tuple[float, float, float]
) -> None:
    wanted = np.array(old) + by
    R = rotation_from_rpy(wanted)
    found = nearest_rpy(R, old)
    assert np.abs(rotation_from_rpy(found) - R).max() < 1e-14
    assert np.abs(found - old).sum() <= np.abs(by).sum() + 1e-12 / max(abs(np.cos(wanted[1])), 1e-16)


@pytest.mark.parametrize("pitch", [np.pi / 2, -np.pi / 2])
def test_where_roll_and_yaw_are_one_the_roll_stays(pitch: float) -> None:
    R = np.round(rotation_from_rpy([0.0, pitch, 0.5]), 16)
    R[:2, 0] = R[2, 1:] = 0.0
    found = nearest_rpy(R, (0.3, pitch, 0.0))
    assert found[0] == 0.3
    assert np.abs(rotation_from_rpy(found) - R).max() < 1e-15
