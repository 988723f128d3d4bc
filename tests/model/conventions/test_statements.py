"""The conventions for which no library runs here: they agree with what their sources say.

The quantities are computed from placements and velocities of the base's frame, without `Conversion`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import urdfkin
from tests.model.conventions.libraries import LIBRARIES
from tests.model.conventions.test_libraries import MISTAKES
from urdfkin.model.conventions import BUILT_IN, Convention, find_convention
from urdfkin.robot import Robot

Rows = list[tuple[str, str, str]]


def _rows(robot: Robot) -> Rows:
    """Return name, parent and child of each joint in the order of the file."""

    def link(joint: ElementTree.Element, end: str) -> str:
        found = joint.find(end)
        assert found is not None
        return found.get("link", "")

    joints = ElementTree.fromstring(robot.urdf).iterfind("joint")
    return [(joint.get("name", ""), link(joint, "parent"), link(joint, "child")) for joint in joints]


def _depth_first(rows: Rows, link: str) -> list[str]:
    below = sorted(row for row in rows if row[1] == link)
    return [name for joint, _, child in below for name in (joint, *_depth_first(rows, child))]


def _breadth_first(rows: Rows, links: list[str]) -> list[str]:
    """Return the joints by depth; the rows of siblings keep their order. A fixed joint connects one link."""
    level = [row for link in links for row in rows if row[1] == link]
    return [row[0] for row in level] + _breadth_first(rows, [row[2] for row in level]) if level else []


ORDERS: dict[str, Callable[[Rows, str], list[str]]] = {
    "urdfkin": _depth_first,
    "urdf": lambda rows, root: [row[0] for row in rows],
    "alphabetical": lambda rows, root: sorted(row[0] for row in rows),
    "kdl": _depth_first,  # kdl_parser follows child_links, which urdfdom fills from a std::map by name
    "isaacgym": _depth_first,
    "isaaclab": lambda rows, root: _breadth_first(sorted(rows), [root]),
    "isaaclab3": lambda rows, root: _breadth_first(rows, [root]),
    "ros": lambda rows, root: [row[0] for row in rows],
}
#: Order of the base's quaternion, and axes of its velocity [linear; angular] of the link's origin.
BASES = {
    "urdfkin": ("xyzw", "local"),
    "urdf": ("xyzw", "local"),
    "alphabetical": ("xyzw", "local"),
    "isaacgym": ("xyzw", "local_world_aligned"),  # legged_robot.py: root_states
    "isaaclab": ("wxyz", "local_world_aligned"),  # articulation_data.py: root_link_state_w
    "isaaclab3": ("xyzw", "local_world_aligned"),
    "ros": ("xyzw", "local"),  # Quaternion.msg, Odometry.msg
}


def _wrong(convention: Convention) -> list[str]:
    """Return the statements that a convention contradicts.

    The file of the A1 has the right legs first. The centre of mass of the Go2's base is not at its origin.
    """
    return [*_wrong_for("a1", convention), *_wrong_for("go2", convention)]


def _wrong_for(dog: str, convention: Convention) -> list[str]:
    name = convention.name
    free = name in BASES
    robot = urdfkin.load(dog, verify=False, root_joint="floating" if free else None)
    conversion, root = robot.convention(convention), robot.link_names[int(free)]
    q, v = robot.sample(1, 2)[0], np.random.default_rng(3).standard_normal(robot.nv)
    their_q, their_v = conversion.to(q, v)
    order = [joint for joint in ORDERS[name](_rows(robot), root) if joint in set(robot.joint_names)]
    values = dict(zip(robot.coordinate_names, q, strict=True))
    rates = dict(zip(robot.rate_names, v, strict=True))
    six, joints, found = np.arange(6.0), slice(7, None) if free else slice(None), []
    if not np.array_equal(their_q[joints], [values[joint] for joint in order]):
        found.append("order of q")
    if not np.array_equal(their_v[6:] if free else their_v, [rates[joint] for joint in order]):
        found.append("order of v")
    if not np.array_equal(conversion.six(six), six):
        found.append("six")
    if free:
        quaternion, axes = BASES[name]
        T = robot.placement(q, root)
        turn = Rotation.from_matrix(T[:3, :3]).as_quat(scalar_first=quaternion == "wxyz")
        if not np.allclose(their_q[:3], T[:3, 3], 0, 1e-15):
            found.append("position")
        if min(np.abs(their_q[3:7] - sign * turn).max() for sign in (1, -1)) > 1e-14:
            found.append("quaternion")
        if not np.allclose(their_v[:6], robot.velocity(q, v, root, axes), 0, 1e-14):
            found.append("velocity")
    return found


def test_each_convention_is_compared_with_a_library_or_a_statement() -> None:
    assert set(ORDERS) | set(LIBRARIES) == set(BUILT_IN)
    assert set(ORDERS) - set(BASES) == {"kdl"}  # it has no floating joint


@pytest.mark.parametrize("name", ORDERS)
def test_a_convention_agrees_with_its_sources(name: str) -> None:
    assert _wrong(find_convention(name)) == []


@pytest.mark.parametrize("mistake", [*MISTAKES, "order"])
@pytest.mark.parametrize("name", ORDERS)
def test_a_planted_mistake_contradicts_them(name: str, mistake: str) -> None:
    right = find_convention(name)
    if mistake == "order":
        joints = list(urdfkin.load("a1", verify=False).convention(name).joint_names)
        joints[0], joints[1] = joints[1], joints[0]
        root = ["root_joint"] * (name in BASES)
        wrong = replace(right, order="given", joints=(*root, *joints))
    elif name == "kdl" and mistake in ("quaternion", "linear", "angular", "base_v", "base_q", "point"):
        return
    else:
        changes: dict[str, Any] = MISTAKES[mistake][getattr(right, mistake)]
        wrong = replace(right, **changes)
    assert _wrong(wrong)
