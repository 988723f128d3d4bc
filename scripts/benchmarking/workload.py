"""A workload of the benchmark: one robot, one frame, and the inputs that all contenders use."""

import contextlib
import tempfile
from functools import cached_property
from pathlib import Path
from typing import Self
from xml.etree import ElementTree as ET

import numpy as np

import urdfkin
from urdfkin.compiled.plan import CompiledTree
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot

QUANTITIES = ("jacobian", "acceleration")
#: Most joints of the humanoid talos do not move `gripper_left_base_link`.
ROBOT_FRAMES = (("panda", "panda_hand"), ("ur5", "tool0"), ("talos", "gripper_left_base_link"))
#: Number of configurations in a loop of calls.
LOOP = 2_000
TIP = "tip"


class Workload:
    """The common input of all contenders.

    Without mimic rules, every library has the same coordinates.
    """

    def __init__(self, source: str, frame: str, n: int, *, name: str | None = None) -> None:
        self.name, self.frame, self.n, self.loop = name or source, frame, n, min(n, LOOP)
        self.robot: Robot = urdfkin.load(source, verify=False, mimic=False)
        self.nv = self.robot.nv
        self.q = self.robot.sample(n, seed=0)
        if not np.array_equal(self.q[:1], self.robot.to_pinocchio(self.q[:1])):
            raise ValueError(f"{self.name}: Pinocchio has other coordinates")
        self.v, self.a = np.random.default_rng(0).standard_normal((2, n, self.robot.nv))
        self.stack = contextlib.ExitStack()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self.stack.close()

    @property
    def plan(self) -> CompiledTree:
        return self.robot.plan([self.robot.tree.frame_link(self.frame)])

    @cached_property
    def urdf(self) -> str:
        return bare_urdf(self.robot.urdf)

    @cached_property
    def folder(self) -> Path:
        return Path(self.stack.enter_context(tempfile.TemporaryDirectory()))

    @cached_property
    def file(self) -> Path:
        file = self.folder / "robot.urdf"
        file.write_text(self.urdf, "utf-8")
        return file

    def result_shape(self, quantity: str) -> tuple[int, ...]:
        return (6, self.nv) if quantity == "jacobian" else (6,)

    def result_size(self, quantity: str) -> int:
        return int(np.prod(self.result_shape(quantity)))

    def inputs(self, quantity: str, n: int) -> tuple[FloatArray, ...]:
        return tuple(x[:n] for x in ((self.q,) if quantity == "jacobian" else (self.q, self.v, self.a)))


_INERTIA = {"ixx": "1", "iyy": "1", "izz": "1", "ixy": "0", "ixz": "0", "iyz": "0"}
_KEPT = ("origin", "parent", "child", "axis", "limit")


def bare_urdf(urdf: str, *, flags: dict[str, str] | None = None) -> str:
    """Return a copy without visuals, collisions and mimic rules.

    All links get the same inertia, because some libraries need inertias.
    The name `world` is replaced, because some libraries add a body of this name.
    """
    whole = ET.fromstring(urdf)
    robot = ET.Element("robot", name=whole.get("name", "robot"))
    if flags is not None:
        ET.SubElement(ET.SubElement(robot, "mujoco"), "compiler", flags)
    for link in whole.findall("link"):
        inertial = ET.SubElement(ET.SubElement(robot, "link", name=link.attrib["name"]), "inertial")
        ET.SubElement(inertial, "mass", value="1")
        ET.SubElement(inertial, "inertia", _INERTIA)
    for joint in whole.findall("joint"):
        copy = ET.SubElement(robot, "joint", joint.attrib)
        copy.extend(part for tag in _KEPT for part in joint.findall(tag))
    for attribute in ("name", "link"):
        for element in robot.iterfind(f".//*[@{attribute}='world']"):
            element.set(attribute, "root")
    return ET.tostring(robot, encoding="unicode")


def chain_urdf(joints: int, seed: int = 0) -> str:
    """Return a chain of revolute joints whose axes have random directions."""
    generator = np.random.default_rng(seed)
    axes = generator.standard_normal((joints, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    rpy_angles = generator.uniform(-3.0, 3.0, (joints, 3))

    def text(numbers: FloatArray) -> str:
        return " ".join(repr(float(x)) for x in numbers)

    parts = [f'<link name="link{i:03}"/>' for i in range(joints + 1)]
    parts += [
        f'<joint name="joint{i:03}" type="revolute"><origin xyz="0.1 0 0" rpy="{text(rpy_angles[i])}"/>'
        f'<parent link="link{i:03}"/><child link="link{i + 1:03}"/><axis xyz="{text(axes[i])}"/>'
        '<limit lower="-3" upper="3" velocity="1" effort="1"/></joint>'
        for i in range(joints)
    ]
    tip = (
        f'<link name="{TIP}"/><joint name="end" type="fixed"><origin xyz="0.1 0 0" rpy="0.0 0.0 0.0"/>'
        f'<parent link="link{joints:03}"/><child link="{TIP}"/></joint>'
    )
    return f'<robot name="chain{joints}">{"".join(parts)}{tip}</robot>'
