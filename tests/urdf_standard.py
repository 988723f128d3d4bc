"""Kinematics of URDF from the URDF standard (https://wiki.ros.org/urdf/XML) and textbook definitions.

This module shares no code with urdfkin. The standard library parses the XML. Numbers have 90 digits (mpmath).
Poses are products of homogeneous matrices. Velocities and accelerations are differences of poses along a
motion. A column of the Jacobian is z x (p - o), and derivatives of the Jacobian are differences of Jacobians.
A difference with a step of 1e-25 is correct to at least 25 digits.
"""

import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from typing import Any

import mpmath
import numpy as np

mp = mpmath.mp.clone()
mp.dps = 90
_STEP = mp.mpf(10) ** -25
#: Value of a joint: a number, or a rotation and a position.
Value = Any


def _numbers(text: str) -> list[Any]:
    return [mp.mpf(word) for word in text.split()]


def _vector(x: Sequence[Any]) -> Any:
    return np.array(x, dtype=object)


_UNIT = np.array([[mp.mpf(int(i == j)) for j in range(4)] for i in range(4)], dtype=object)


def _length(x: Any) -> Any:
    return mp.sqrt((x * x).sum())


def _skew(x: Any) -> Any:
    zero = mp.mpf(0)
    return np.array([[zero, -x[2], x[1]], [x[2], zero, -x[0]], [-x[1], x[0], zero]], dtype=object)


def _turn(axis: Any, angle: Any) -> Any:
    """Return the rotation about a unit axis by Rodrigues' formula."""
    S = _skew(axis)
    return _UNIT[:3, :3] + mp.sin(angle) * S + (1 - mp.cos(angle)) * (S @ S)


def _pose(R: Any, p: Any) -> Any:
    T = _UNIT.copy()
    T[:3, :3], T[:3, 3] = R, p
    return T


def _quaternion(x: Any, y: Any, z: Any, w: Any) -> Any:
    """Return the rotation v -> q v q^-1 of a quaternion q of any length."""
    v, s = _vector((x, y, z)), x * x + y * y + z * z + w * w
    return ((2 * w * w - s) * _UNIT[:3, :3] + 2 * np.outer(v, v) + 2 * w * _skew(v)) / s


def _of(element: ET.Element | None, name: str, default: str) -> str:
    return default if element is None else element.get(name, default)


#: Axis of the child link, and whether it is a rotation, for each velocity of a planar or floating joint.
_FREE = {
    "planar": ((0, False), (1, False), (2, True)),
    "floating": tuple((i, turns) for turns in (False, True) for i in range(3)),
}


class _Joint:
    """The type, the pose in the parent link, the axis and the mimic rule of a joint."""

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
            x, y, z = _UNIT[:3, :3]
            roll, pitch, yaw = _numbers(_of(origin, "rpy", "0 0 0"))
            R = _turn(z, yaw) @ _turn(y, pitch) @ _turn(x, roll)
        self.origin = _pose(R, p)
        axis = _vector(_numbers(_of(element.find("axis"), "xyz", "1 0 0")))
        self.axis = axis / _length(axis) if self.kind in ("revolute", "continuous", "prismatic") else axis
        if self.kind == "planar":
            assert axis.tolist() == [0, 0, 1], "x and y of another plane are no part of the standard"
        rule = element.find("mimic") if self.kind != "fixed" else None
        self.mimicked_joint = _of(rule, "joint", "")
        self.multiplier = mp.mpf(_of(rule, "multiplier", "1"))
        self.offset = mp.mpf(_of(rule, "offset", "0"))

    def motion(self, value: Value) -> Any:
        """Return the pose of the child link in the joint's frame."""
        if self.kind == "fixed":
            return _UNIT
        if self.kind in ("revolute", "continuous"):
            return _pose(_turn(self.axis, value), _UNIT[:3, 3])
        if self.kind == "prismatic":
            return _pose(_UNIT[:3, :3], self.axis * value)
        R, p = value
        return _pose(R, p)


class Robot:
    """A robot of a URDF file. The value of a planar or floating joint is a rotation and a position."""

    def __init__(self, text: str | bytes) -> None:
        root = ET.fromstring(text)
        version = root.get("version", "1.0")
        self.joints = {joint.get("name", ""): _Joint(joint, version) for joint in root.findall("joint")}
        for joint in self.joints.values():
            if joint.mimicked_joint not in self.joints:  # the joint moves independently
                joint.mimicked_joint = ""
        self.links = [link.get("name", "") for link in root.findall("link")]
        self.above = {joint.child: name for name, joint in self.joints.items()}

    def value(self, name: str, numbers: Sequence[Any]) -> Value:
        """Return the value of a joint from its numbers in q."""
        kind, x = self.joints[name].kind, [mp.mpf(one) for one in numbers]
        if kind == "planar":
            return _turn(_UNIT[2, :3], x[2]), _vector((x[0], x[1], mp.mpf(0)))
        return (_quaternion(*x[3:]), _vector(x[:3])) if kind == "floating" else x[0]

    def path(self, link: str) -> list[str]:
        """Return the joints from the root to a link."""
        names: list[str] = []
        while link in self.above:
            names.insert(0, self.above[link])
            link = self.joints[names[0]].parent
        return names

    def rule(self, name: str) -> tuple[str, Any, Any]:
        """Return the independent joint that a joint mimics, with multiplier and offset."""
        joint = self.joints[name]
        if not joint.mimicked_joint:
            return name, mp.mpf(1), mp.mpf(0)
        mimicked_joint, multiplier, offset = self.rule(joint.mimicked_joint)
        return mimicked_joint, joint.multiplier * multiplier, joint.multiplier * offset + joint.offset

    def own(self, name: str, values: Mapping[str, Value]) -> Value:
        """Return the value of a joint, which may be a mimic joint or a fixed joint."""
        mimicked_joint, multiplier, offset = self.rule(name)
        value = values.get(mimicked_joint)
        return value if mimicked_joint == name else multiplier * value + offset

    def pose(self, link: str, values: Mapping[str, Value]) -> Any:
        """Return the pose (4, 4) of a link in the root."""
        T = _UNIT
        for name in self.path(link):
            T = T @ self.joints[name].origin @ self.joints[name].motion(self.own(name, values))
        return T

    def later(self, values: Mapping[str, Value], v: Mapping[str, Any], a: Mapping[str, Any], t: Any) -> Any:
        """Return the values after a time t, to second order in t, from joint velocities and accelerations.

        The velocity of a planar or floating joint is the velocity of the child link in the link's axes.
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
                (_vector((x[0], x[1], mp.mpf(0))), x[2] * _UNIT[2, :3])
                if planar
                else (_vector(x[:3]), _vector(x[3:]))
                for x in (u, u_rate)
            )
            rotation = turn * t + turn_rate * (t * t / 2)
            angle = _length(rotation)
            axis = rotation / angle if angle else rotation
            moved = slide * t + (slide_rate + _skew(turn) @ slide) * (t * t / 2)
            found[name] = R @ _turn(axis, angle), p + R @ moved
        return found

    def jacobians(
        self, link: str, values: Mapping[str, Value], columns: Mapping[str, int]
    ) -> dict[tuple[str, int], Any]:
        """Return the columns of the Jacobians that may differ from 0, by reference frame and column index.

        `columns` contains the index of each joint's first column.
        """
        axes: list[tuple[int, Any, Any, bool, Any]] = []  # index, multiplier, axis, whether it turns, point
        T = _UNIT
        for name in self.path(link):
            joint = self.joints[name]
            before = T @ joint.origin
            T = before @ joint.motion(self.own(name, values))
            mimicked_joint, multiplier, _ = self.rule(name)
            if joint.kind in ("revolute", "continuous", "prismatic"):
                z = before[:3, :3] @ joint.axis
                axes.append(
                    (columns[mimicked_joint], multiplier, z, joint.kind != "prismatic", before[:3, 3])
                )
            for k, (i, turns) in enumerate(_FREE.get(str(joint.kind), ())):
                axes.append((columns[mimicked_joint] + k, multiplier, T[:3, i], turns, T[:3, 3]))
        points = {"local": T[:3, 3], "local_world_aligned": T[:3, 3], "world": _UNIT[:3, 3]}
        found: dict[tuple[str, int], Any] = {}
        for reference, point in points.items():
            for index, multiplier, z, turns, at in axes:
                linear, angular = (_skew(z) @ (point - at), z) if turns else (z, _UNIT[:3, 3])
                if reference == "local":
                    linear, angular = T[:3, :3].T @ linear, T[:3, :3].T @ angular
                six = multiplier * np.concatenate((linear, angular))
                found[reference, index] = found.get((reference, index), 0) + six
        return found

    def quantities(
        self, link: str, sample: Mapping[str, Sequence[Any]], joints: Sequence[Mapping[str, Any]]
    ) -> dict[tuple[str, str | None], list[Any]]:
        """Return all quantities of a link, each as a list whose last index varies fastest.

        `sample` has q, v and a. `joints` has the name and the slices of q and v of each moving joint.
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
        turning, turning_2 = R_1 @ R.T, T_2[:3, :3] @ R.T
        w = _vector((turning[2, 1], turning[0, 2], turning[1, 0]))
        odd = (turning_2 - turning_2.T) / 2
        alpha = _vector((odd[2, 1], odd[0, 2], odd[1, 0]))
        found: dict[tuple[str, str | None], list[Any]] = {("placement", None): T.ravel().tolist()}
        J, rate = self.jacobians(link, values, columns), self._change(link, values, v, columns)
        by = {}
        for name, zeros in still.items():
            for k in range(len(zeros)):
                if ("world", columns[name] + k) in J:
                    unit = still | {name: [mp.mpf(int(i == k)) for i in range(len(zeros))]}
                    by[columns[name] + k] = self._change(link, values, unit, columns)
        for reference in ("local", "world", "local_world_aligned"):
            at_origin = reference == "world"
            back = R.T if reference == "local" else _UNIT[:3, :3]
            velocity = p_1 - _skew(w) @ p if at_origin else p_1
            classical = p_2 - (_skew(alpha) + _skew(w) @ _skew(w)) @ p if at_origin else p_2
            # `local` and `local_world_aligned`: R times the time derivative of R^T p'
            # `world`: time derivative of the linear velocity p' - w x p
            spatial = R @ (R_1.T @ p_1 + R.T @ p_2)
            if at_origin:
                spatial = p_2 - _skew(alpha) @ p - _skew(w) @ p_1
            for name, linear, angular in (
                ("velocity", velocity, w),
                ("acceleration", classical, alpha),
                ("spatial acceleration", spatial, alpha),
            ):
                found[name, reference] = [*(back @ linear), *(back @ angular)]
            zero = [0] * 6
            found["jacobian", reference] = [
                J.get((reference, c), zero)[i] for i in range(6) for c in range(nv)
            ]
            found["jacobian rate", reference] = [
                rate.get((reference, c), zero)[i] for i in range(6) for c in range(nv)
            ]
            found["hessian", reference] = [
                by[d].get((reference, c), zero)[i] if d in by else 0
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
    ) -> dict[tuple[str, int], Any]:
        """Return the time derivatives of the columns of the Jacobians."""
        still = {name: [mp.mpf(0)] * len(x) for name, x in v.items()}
        after, before = (
            self.jacobians(link, self.later(values, v, still, t), columns) for t in (_STEP, -_STEP)
        )
        return {place: (after[place] - before[place]) / (2 * _STEP) for place in after}


def poses(text: str, values: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Return the pose (4, 4) of each link in the root, from the values of the joints that do not mimic."""
    robot = Robot(text)
    own = {name: robot.value(name, np.atleast_1d(x).tolist()) for name, x in values.items()}
    return {link: robot.pose(link, own).astype(np.float64) for link in robot.links}
