"""A reader of URDF that was written from the standard alone (https://wiki.ros.org/urdf/XML).

It shares no code with urdfkin: the standard library parses the XML, and rotations are matrix exponentials of
a Taylor series, in mpmath with 40 digits.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from typing import Any

import mpmath as mp
import numpy as np

mp.mp.dps = 40


def _numbers(text: str) -> list[Any]:
    return [mp.mpf(word) for word in text.split()]


def _turn(axis: Sequence[Any], angle: Any) -> Any:
    """Return the rotation about a unit axis: the exponential of its cross-product matrix."""
    x, y, z = axis
    return mp.expm(mp.matrix([[0, -z, y], [z, 0, -x], [-y, x, 0]]) * angle, method="taylor")


def _pose(R: Any, p: Sequence[Any]) -> Any:
    T = mp.eye(4)
    for i in range(3):
        T[i, 3] = p[i]
        for j in range(3):
            T[i, j] = R[i, j]
    return T


def _quaternion(x: Any, y: Any, z: Any, w: Any) -> Any:
    """Return the rotation of a quaternion of any length, from q v q*."""
    s = x * x + y * y + z * z + w * w
    outer = mp.matrix([[x * x, x * y, x * z], [x * y, y * y, y * z], [x * z, y * z, z * z]])
    cross = mp.matrix([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return ((w * w - x * x - y * y - z * z) * mp.eye(3) + 2 * outer + 2 * w * cross) / s


def _origin(joint: ET.Element) -> Any:
    origin = joint.find("origin")
    if origin is None:
        return mp.eye(4)
    p = _numbers(origin.get("xyz", "0 0 0"))
    if (written := origin.get("quat_xyzw")) is not None:
        return _pose(_quaternion(*_numbers(written)), p)
    roll, pitch, yaw = _numbers(origin.get("rpy", "0 0 0"))
    return _pose(_turn((0, 0, 1), yaw) * _turn((0, 1, 0), pitch) * _turn((1, 0, 0), roll), p)


def _axis(joint: ET.Element) -> list[Any]:
    element = joint.find("axis")
    axis = _numbers("1 0 0" if element is None else element.get("xyz", "1 0 0"))
    length = mp.sqrt(sum(x * x for x in axis))
    return [x / length for x in axis]


def _motion(joint: ET.Element, value: Any) -> Any:
    kind, zero = joint.get("type"), [mp.mpf(0)] * 3
    if kind == "fixed":
        return mp.eye(4)
    if kind in ("revolute", "continuous"):
        return _pose(_turn(_axis(joint), mp.mpf(value)), zero)
    if kind == "prismatic":
        return _pose(mp.eye(3), [x * mp.mpf(value) for x in _axis(joint)])
    numbers = [mp.mpf(x) for x in value]
    if kind == "floating":
        return _pose(_quaternion(*numbers[3:]), numbers[:3])
    assert _axis(joint) == [0, 0, 1], "x and y of another plane are no part of the standard"
    return _pose(_turn((0, 0, 1), numbers[2]), [*numbers[:2], mp.mpf(0)])


def poses(text: str, values: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Return the pose (4, 4) of each link in the root, from the values of the joints that do not mimic."""
    joints = {joint.get("name", ""): joint for joint in ET.fromstring(text).iterfind("joint")}
    above = {joint.find("child").get("link"): name for name, joint in joints.items()}  # type: ignore[union-attr]

    def value(name: str) -> Any:
        rule = joints[name].find("mimic")
        if rule is None:
            return values.get(name)
        multiplier, offset = mp.mpf(rule.get("multiplier", "1")), mp.mpf(rule.get("offset", "0"))
        return multiplier * value(rule.get("joint", "")) + offset

    def pose(link: str) -> Any:
        if link not in above:
            return mp.eye(4)
        joint = joints[above[link]]
        parent = joint.find("parent")
        assert parent is not None
        return pose(parent.get("link", "")) * _origin(joint) * _motion(joint, value(above[link]))

    links = [link.get("name", "") for link in ET.fromstring(text).iterfind("link")]
    return {link: np.array(pose(link).tolist(), dtype=np.float64) for link in links}
