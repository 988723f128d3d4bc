"""A subject: one robot, one frame and the configurations that everyone gets."""

from __future__ import annotations

import contextlib
import tempfile
from functools import cached_property
from pathlib import Path

import numpy as np

import urdfkin
from scripts.benchmarking.bare import bare_urdf
from urdfkin.robot import Robot
from urdfkin.tree import FloatArray

#: The quantities of the tables.
QUANTITIES = ("jacobian", "acceleration")
#: Robot and frame: an arm, and a humanoid of which the path is a small part.
SUBJECTS = (("panda", "panda_hand"), ("talos", "gripper_left_base_link"))
#: How many configurations a library called in a loop takes; its cost for one does not depend on it.
LOOP = 2_000


class Subject:
    """The same work for everyone.

    Mimic joints are free, so that every library has the same coordinates, each a single number.

    Attributes:
        name: What the tables call the robot.
        frame: Whose Jacobian and acceleration.
        n: How many configurations a batch has.
        robot: urdfkin's.
        q: (n, nq).
        v: (n, nv).
        a: (n, nv).
        stack: Closes what a contender leaves open.
    """

    def __init__(self, source: str, frame: str, n: int, *, name: str | None = None) -> None:
        self.name, self.frame, self.n = name or source, frame, n
        self.robot: Robot = urdfkin.load(source, verify=False, mimic=False)
        self.q = self.robot.sample(n, seed=0)
        if not np.array_equal(self.q[:1], self.robot.to_pinocchio(self.q[:1])):
            raise ValueError(f"{self.name}: Pinocchio has other coordinates")
        self.v, self.a = np.random.default_rng(0).standard_normal((2, n, self.robot.nv))
        self.stack = contextlib.ExitStack()

    def __enter__(self) -> Subject:
        return self

    def __exit__(self, *exception: object) -> None:
        self.stack.close()

    @property
    def nv(self) -> int:
        """How many columns a Jacobian has."""
        return self.robot.nv

    @property
    def loop(self) -> int:
        """How many configurations a loop takes."""
        return min(self.n, LOOP)

    @cached_property
    def urdf(self) -> str:
        """The robot without meshes, inertias and rules."""
        return bare_urdf(self.robot.urdf)

    @cached_property
    def file(self) -> Path:
        """`urdf` as a file, for libraries that read nothing else; gone when the subject is closed."""
        folder = Path(self.stack.enter_context(tempfile.TemporaryDirectory()))
        (folder / "robot.urdf").write_text(self.urdf, "utf-8")
        return folder / "robot.urdf"

    def width(self, quantity: str) -> tuple[int, ...]:
        """The shape of one configuration's result."""
        return (6, self.nv) if quantity == "jacobian" else (6,)

    def numbers(self, quantity: str) -> int:
        """How many numbers one configuration's result has."""
        return int(np.prod(self.width(quantity)))

    def inputs(self, quantity: str, n: int) -> tuple[FloatArray, ...]:
        """The first `n` of q, or of q, v and a: what the quantity depends on."""
        return tuple(x[:n] for x in ((self.q,) if quantity == "jacobian" else (self.q, self.v, self.a)))
