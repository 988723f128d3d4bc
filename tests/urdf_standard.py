"""Kinematics of URDF, written from the standard (https://wiki.ros.org/urdf/XML) and textbook definitions.

It shares no code with urdfkin. The standard library parses the XML. Numbers have 90 digits (mpmath). Poses
are products of homogeneous matrices, velocities and accelerations are differences of poses along a motion,
and the Jacobian is z x (p - o) for each axis. Its derivatives are differences of Jacobians. A difference with
a step of 1e-25 is right to 25 digits or more.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from typing import Any

import mpmath
import numpy as np

mp = mpmath.mp.clone()
mp.dps = 90
_STEP = mp.mpf(10) ** -25
#: Value of a joint: a number; x, y and an angle; or x, y, z and a quaternion x, y, z, w.
Value = Any


def _numbers(text: str) -> list[Any]:
    return [mp.mpf(word) for word in text.split()]


def _vector(x: Sequence[Any]) -> Any:
    return mp.matrix([[each] for each in x])


def _skew(x: Any) -> Any:
    return mp.matrix([[0, -x[2], x[1]], [x[2], 0, -x[0]], [-x[1], x[0], 0]])


def _turn(axis: Any, angle: Any) -> Any:
    """Return the rotation about a unit axis by Rodrigues' formula."""
    S = _skew(axis)
    return mp.eye(3) + mp.sin(angle) * S + (1 - mp.cos(angle)) * S * S


def _pose(R: Any, p: Any) -> Any:
    T = mp.eye(4)
    T[:3, :3], T[:3, 3] = R, p
    return T


def _quaternion(x: Any, y: Any, z: Any, w: Any) -> Any:
    """Return the rotation of a quaternion of any length, from q v q*."""
    v = _vector((x, y, z))
    s = x * x + y * y + z * z + w * w
    return ((2 * w * w - s) * mp.eye(3) + 2 * v * v.T + 2 * w * _skew(v)) / s


def _of(element: ET.Element | None, name: str, default: str) -> str:
    return default if element is None else element.get(name, default)


class _Joint:
    """A joint of the file: its kind, its pose in the parent link, its axis and its rule."""

    def __init__(self, element: ET.Element, version: str) -> None:
        self.kind, origin = element.get("type"), element.find("origin")
        self.parent = _of(element.find("parent"), "link", "")
        self.child = _of(element.find("child"), "link", "")
        p = _vector(_numbers(_of(origin, "xyz", "0 0 0")))
        quaternion = _of(origin, "quat_xyzw", "") if version == "1.1" else ""
        self.angles = None if quaternion else [float(x) for x in _of(origin, "rpy", "0 0 0").split()]
        if quaternion:
            R = _quaternion(*_numbers(quaternion))
        else:
            x, y, z = (_vector(one) for one in ((1, 0, 0), (0, 1, 0), (0, 0, 1)))
            roll, pitch, yaw = _numbers(_of(origin, "rpy", "0 0 0"))
            R = _turn(z, yaw) * _turn(y, pitch) * _turn(x, roll)
        self.origin = _pose(R, p)
        axis = _vector(_numbers(_of(element.find("axis"), "xyz", "1 0 0")))
        self.axis = axis / mp.norm(axis) if self.kind in ("revolute", "continuous", "prismatic") else axis
        if self.kind == "planar":
            assert list(axis) == [0, 0, 1], "x and y of another plane are no part of the standard"
        rule = element.find("mimic") if self.kind != "fixed" else None
        self.leader = _of(rule, "joint", "")
        self.multiplier = mp.mpf(_of(rule, "multiplier", "1"))
        self.offset = mp.mpf(_of(rule, "offset", "0"))

    def motion(self, value: Value) -> Any:
        """Return the pose of the child link in the joint's frame."""
        if self.kind == "fixed":
            return mp.eye(4)
        if self.kind in ("revolute", "continuous"):
            return _pose(_turn(self.axis, value), mp.zeros(3, 1))
        if self.kind == "prismatic":
            return _pose(mp.eye(3), self.axis * value)
        R, p = value
        return _pose(R, p)


class Robot:
    """A robot of a URDF file.

    Values are by the name of the joint: a number, or for a planar or floating joint a rotation and a
    position in the joint's frame (`value`).
    """

    def __init__(self, text: str | bytes) -> None:
        root = ET.fromstring(text)
        version = root.get("version", "1.0")
        self.joints = {joint.get("name", ""): _Joint(joint, version) for joint in root.findall("joint")}
        for joint in self.joints.values():
            if joint.leader not in self.joints:  # such a joint is free
                joint.leader = ""
        self.links = [link.get("name", "") for link in root.findall("link")]
        self.above = {joint.child: name for name, joint in self.joints.items()}

    def value(self, name: str, numbers: Sequence[Any]) -> Value:
        """Return the value of a joint from its numbers in q."""
        kind, x = self.joints[name].kind, [mp.mpf(one) for one in numbers]
        if kind == "planar":
            return _turn(_vector((0, 0, 1)), x[2]), _vector((x[0], x[1], 0))
        return (_quaternion(*x[3:]), _vector(x[:3])) if kind == "floating" else x[0]

    def path(self, link: str) -> list[str]:
        """Return the joints from the root to a link."""
        names: list[str] = []
        while link in self.above:
            names.insert(0, self.above[link])
            link = self.joints[names[0]].parent
        return names

    def rule(self, name: str) -> tuple[str, Any, Any]:
        """Return the joint that a joint follows in the end, with multiplier and offset."""
        joint = self.joints[name]
        if not joint.leader:
            return name, mp.mpf(1), mp.mpf(0)
        leader, multiplier, offset = self.rule(joint.leader)
        return leader, joint.multiplier * multiplier, joint.multiplier * offset + joint.offset

    def own(self, name: str, values: Mapping[str, Value]) -> Value:
        """Return the value of a joint, also of a mimic joint and of a fixed joint."""
        leader, multiplier, offset = self.rule(name)
        value = values.get(leader)
        return value if leader == name else multiplier * value + offset

    def pose(self, link: str, values: Mapping[str, Value]) -> Any:
        """Return the pose (4, 4) of a link in the root."""
        T = mp.eye(4)
        for name in self.path(link):
            T = T * self.joints[name].origin * self.joints[name].motion(self.own(name, values))
        return T

    def later(self, values: Mapping[str, Value], v: Mapping[str, Any], a: Mapping[str, Any], t: Any) -> Any:
        """Return the values after a time t, to second order in t, from joint velocities and accelerations.

        A planar or floating joint has the linear and the angular velocity of the child link in its axes.
        """
        found: dict[str, Value] = {}
        for name, value in values.items():
            u, u_rate = v[name], a[name]
            if not isinstance(value, tuple):
                found[name] = value + u[0] * t + u_rate[0] * t * t / 2
                continue
            R, p = value
            planar = self.joints[name].kind == "planar"
            (slide, turn), (slide_rate, turn_rate) = (
                (_vector((x[0], x[1], 0)), _vector((0, 0, x[2])))
                if planar
                else (_vector(x[:3]), _vector(x[3:]))
                for x in (u, u_rate)
            )
            rotation = turn * t + turn_rate * (t * t / 2)
            angle = mp.norm(rotation)
            axis = rotation / angle if angle else rotation
            moved = slide * t + (slide_rate + _skew(turn) * slide) * (t * t / 2)
            found[name] = R * _turn(axis, angle), p + R * moved
        return found

    def jacobian(
        self, link: str, values: Mapping[str, Value], columns: Mapping[str, int], reference: str
    ) -> dict[int, list[Any]]:
        """Return the columns of the Jacobian that may differ from 0, by their index.

        `columns` has the index of each joint's first column.
        """
        end = self.pose(link, values)
        point = mp.zeros(3, 1) if reference == "world" else end[:3, 3]
        found: dict[int, list[Any]] = {}
        T = mp.eye(4)
        for name in self.path(link):
            joint = self.joints[name]
            T = T * joint.origin
            before = T
            T = T * joint.motion(self.own(name, values))
            leader, multiplier, _ = self.rule(name)
            unit = [_vector((1, 0, 0)), _vector((0, 1, 0)), _vector((0, 0, 1))]
            axes: list[tuple[Any, bool, Any]] = []
            if joint.kind in ("revolute", "continuous", "prismatic"):
                axes = [(before[:3, :3] * joint.axis, joint.kind != "prismatic", before)]
            elif joint.kind == "planar":
                axes = [(T[:3, :3] * unit[k], k == 2, T) for k in range(3)]
            elif joint.kind == "floating":
                axes = [(T[:3, :3] * unit[k % 3], k > 2, T) for k in range(6)]
            for k, (z, turns, at) in enumerate(axes):
                linear = _skew(z) * (point - at[:3, 3]) if turns else z
                angular = z if turns else mp.zeros(3, 1)
                if reference == "local":
                    linear, angular = end[:3, :3].T * linear, end[:3, :3].T * angular
                six = [*linear, *angular]
                column = found.setdefault(columns[leader] + k, [mp.mpf(0)] * 6)
                found[columns[leader] + k] = [x + multiplier * y for x, y in zip(column, six, strict=True)]
        return found

    def quantities(
        self, link: str, sample: Mapping[str, Sequence[Any]], joints: Sequence[Mapping[str, Any]]
    ) -> dict[tuple[str, str | None], list[Any]]:
        """Return all quantities of a link, each as a list whose last index varies fastest.

        Args:
            link: Name of the link.
            sample: q, v and a.
            joints: Name of each joint with coordinates, and its places in q and v.
        """
        values = {one["name"]: self.value(one["name"], sample["q"][slice(*one["q"])]) for one in joints}
        v, a = (
            {one["name"]: [mp.mpf(x) for x in sample[name][slice(*one["v"])]] for one in joints}
            for name in "va"
        )
        columns, nv = {one["name"]: one["v"][0] for one in joints}, len(sample["v"])
        still = {name: [mp.mpf(0)] * len(x) for name, x in v.items()}

        def at(t: Any) -> Any:
            return self.pose(link, self.later(values, v, a, t))

        T, after, before = self.pose(link, values), at(_STEP), at(-_STEP)
        T_1, T_2 = (after - before) / (2 * _STEP), (after - 2 * T + before) / _STEP**2
        R, p, R_1, p_1, p_2 = T[:3, :3], T[:3, 3], T_1[:3, :3], T_1[:3, 3], T_2[:3, 3]
        turning, turning_2 = R_1 * R.T, T_2[:3, :3] * R.T
        w = _vector((turning[2, 1], turning[0, 2], turning[1, 0]))
        odd = (turning_2 - turning_2.T) / 2
        alpha = _vector((odd[2, 1], odd[0, 2], odd[1, 0]))
        found: dict[tuple[str, str | None], list[Any]] = {("placement", None): list(T)}
        for reference in ("local", "world", "local_world_aligned"):
            at_origin = reference == "world"
            back = R.T if reference == "local" else mp.eye(3)
            velocity = p_1 - _skew(w) * p if at_origin else p_1
            classical = p_2 - (_skew(alpha) + _skew(w) * _skew(w)) * p if at_origin else p_2
            # the time derivative of the numbers of the velocity in WORLD; in LOCAL, those of R^T p'
            spatial = p_2 - _skew(alpha) * p - _skew(w) * p_1 if at_origin else R * (R_1.T * p_1 + R.T * p_2)
            for name, linear, angular in (
                ("velocity", velocity, w),
                ("acceleration", classical, alpha),
                ("spatial acceleration", spatial, alpha),
            ):
                found[name, reference] = [*(back * linear), *(back * angular)]
            J = self.jacobian(link, values, columns, reference)
            found["jacobian", reference] = [J[c][i] if c in J else 0 for i in range(6) for c in range(nv)]
            rate = self._change(link, values, v, columns, reference)
            found["jacobian rate", reference] = [
                rate[c][i] if c in rate else 0 for i in range(6) for c in range(nv)
            ]
            by = {}
            for name, zeros in still.items():
                for k in range(len(zeros)):
                    if columns[name] + k in J:
                        unit = still | {name: [mp.mpf(int(i == k)) for i in range(len(zeros))]}
                        by[columns[name] + k] = self._change(link, values, unit, columns, reference)
            found["hessian", reference] = [
                by[d][c][i] if d in by and c in J else 0
                for i in range(6)
                for c in range(nv)
                for d in range(nv)
            ]
        return found

    def _change(
        self,
        link: str,
        values: Mapping[str, Value],
        v: Mapping[str, Sequence[Any]],
        columns: Mapping[str, int],
        reference: str,
    ) -> dict[int, list[Any]]:
        """Return the time derivative of the Jacobian's columns."""
        still = {name: [mp.mpf(0)] * len(x) for name, x in v.items()}
        after, before = (
            self.jacobian(link, self.later(values, v, still, t), columns, reference) for t in (_STEP, -_STEP)
        )
        return {c: [(x - y) / (2 * _STEP) for x, y in zip(after[c], before[c], strict=True)] for c in after}


def poses(text: str, values: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Return the pose (4, 4) of each link in the root, from the values of the joints that do not mimic."""
    robot = Robot(text)
    own = {name: robot.value(name, np.atleast_1d(x).tolist()) for name, x in values.items()}
    return {link: np.array(robot.pose(link, own).tolist(), dtype=np.float64) for link in robot.links}
