"""A robot as what its motion is fixed by: rigid bodies, and between them joints with their screws at home.

By the product of exponentials a link's pose is exp(S_1 t_1) ... exp(S_n t_n) H, with the unit screws S_i and
the pose H as they are where every joint's value is zero, all seen from one place. No link between the joints
enters it, so that fixed links may be merged or split; and nothing in it says which body is the root: seen
from another body, what lies on the way is passed backwards, with its screw reversed.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from urdfkin.kinematics.roundings import EPS, of_two_texts
from urdfkin.model.chain import LEAST_SIZE
from urdfkin.model.tree import FloatArray, Joint, KinematicTree


@dataclass(frozen=True, slots=True, eq=False)
class Screw:
    """A joint's axis as a line that points: a unit direction through a point."""

    direction: FloatArray
    point: FloatArray

    def moved(self, T: FloatArray) -> Screw:
        """The screw after a rigid motion."""
        return Screw(T[:3, :3] @ self.direction, T[:3, :3] @ self.point + T[:3, 3])

    def reversed(self) -> Screw:
        """The same line, pointing the other way."""
        return Screw(-self.direction, self.point)


@dataclass(frozen=True, slots=True)
class Edge:
    """A joint between two bodies.

    Attributes:
        joint: Its index in the tree.
        inner: The body that carries it.
        outer: The body that it moves.
    """

    joint: int
    inner: int
    outer: int

    def beyond(self, body: int) -> int:
        """The body at the other end."""
        return self.outer if body == self.inner else self.inner


class Mechanism:
    """Bodies and joints of a tree at home, where every joint's value is zero.

    Args:
        tree: The robot.
        parting: Fixed joints (indices) that count as joints all the same, since another model's move there.
    """

    def __init__(self, tree: KinematicTree, parting: Collection[int] = ()) -> None:
        self.tree = tree
        homes, body, edges, bodies = [np.eye(4)], [0], list[Edge](), [[0]]
        lengths, depths = [0.0], [0]
        for i, joint in enumerate(tree.joints):
            homes.append(homes[joint.parent] @ joint.T_parent_joint)
            lengths.append(lengths[joint.parent] + math.hypot(*joint.T_parent_joint[:3, 3].tolist()))
            depths.append(depths[joint.parent] + 1)
            if joint.kind.nv or i in parting:
                body.append(len(bodies))
                edges.append(Edge(i, body[joint.parent], len(bodies)))
                bodies.append([i + 1])
            else:
                body.append(body[joint.parent])
                bodies[body[-1]].append(i + 1)
        self.homes, self.body_of, self.edges = homes, body, edges
        self.bodies = bodies
        #: Joints that are taken in another order than the tree's, run by run.
        self.orders: tuple[tuple[str, ...], ...] = ()
        #: How far (m) the way from the root to each link is, and how many joints it passes, fixed ones too.
        self.lengths, self.depths = lengths, depths
        self._screws: dict[int, Screw] = {}

    def joint(self, edge: Edge) -> Joint:
        """What the tree says of it."""
        return self.tree.joints[edge.joint]

    def screw(self, edge: Edge) -> Screw:
        """Of a joint that turns or slides, at home, seen from the root."""
        if (known := self._screws.get(edge.joint)) is None:
            T = self.homes[edge.joint + 1]
            known = self._screws[edge.joint] = Screw(T[:3, :3] @ self.joint(edge).axis, T[:3, 3])
        return known

    def in_order(self, names: Sequence[str]) -> Mechanism:
        """The same motion with joints one behind the other taken in another order, which their axes allow.

        Links between them that other joints then carry are on no body any more.

        Args:
            names: Joints of a run, from the inner body outwards.
        """
        joints = [self.tree.joint_index(name) for name in names]
        run = [edge for edge in self.edges if edge.joint in joints]
        other = copy(self)
        vars(other).pop("edges_of", None)
        places = dict(zip(run, joints, strict=True))
        other.edges = [replace(edge, joint=places[edge]) if edge in places else edge for edge in self.edges]
        other.bodies = list(self.bodies)
        for k, edge in enumerate(run[:-1]):
            if {one.joint for one in run[: k + 1]} != set(joints[: k + 1]):
                other.bodies[edge.outer] = []
        other.orders = (*self.orders, tuple(names))
        return other

    def may_be_taken(self, names: Sequence[str], tolerance: Tolerance) -> bool:
        """Whether joints are such a run, and axes allow that order: any two that change places commute."""
        joints = [self.tree.joint_index(name) for name in names]
        run = [edge for edge in self.edges if edge.joint in joints]
        one_line = all(
            inner.outer == outer.inner and len(self.edges_of[outer.inner]) == 2
            for inner, outer in pairwise(run)
        )
        changed = (
            (one, other)
            for k, one in enumerate(run)
            for other in run[k + 1 :]
            if joints.index(one.joint) > joints.index(other.joint)
        )
        return len(run) == len(names) and one_line and all(self._commute(*two, tolerance) for two in changed)

    def orders_of_runs(self, tolerance: Tolerance) -> Iterator[Iterator[list[str]]]:
        """For each run of joints, nothing else on the bodies between, its orders that move alike."""
        run: list[Edge] = []
        for edge in self.edges:  # depth first: what follows is next where the body between has no other
            if run and edge.inner == run[-1].outer and len(self.edges_of[edge.inner]) == 2:
                run.append(edge)
                continue
            yield self._orders(run, tolerance)
            run = [edge]
        yield self._orders(run, tolerance)

    def _orders(self, run: Sequence[Edge], tolerance: Tolerance) -> Iterator[list[str]]:
        """All that exchanging neighbours leads to, the run's own first."""
        if not run:
            yield []
        for k, edge in enumerate(run):
            if all(self._commute(one, edge, tolerance) for one in run[:k]):
                for others in self._orders([*run[:k], *run[k + 1 :]], tolerance):
                    yield [self.joint(edge).name, *others]

    def _commute(self, one: Edge, other: Edge, tolerance: Tolerance) -> bool:
        """Two slides, a slide along a turn's axis, two turns about one line."""
        kinds = [self.joint(edge).kind for edge in (one, other)]
        if not all(kind.has_axis and kind.nv for kind in kinds):
            return False
        if not any(kind.turns for kind in kinds):
            return True
        s, t = self.screw(one), self.screw(other)
        angle, way = between_lines(s, t, placed=all(kind.turns for kind in kinds))
        return tolerance.holds(angle, way)

    @cached_property
    def edges_of(self) -> list[list[Edge]]:
        """The joints at each body."""
        found: list[list[Edge]] = [[] for _ in self.bodies]
        for edge in self.edges:
            found[edge.inner].append(edge)
            found[edge.outer].append(edge)
        return found

    @cached_property
    def size(self) -> float:
        """Metres: the longest way from the root to a link, the scale of its lengths."""
        return max(self.lengths)

    @cached_property
    def rounding(self) -> float:
        """By how much (rad, and as a share of `size`) what is read from a text may be off, for all links.

        Pinocchio turns about some axes that are tilted by as little (URDF514).
        """
        return EPS * of_two_texts(max(self.depths)) + 2.0 * sum(joint.tilt for joint in self.tree.joints)


@dataclass(frozen=True, slots=True)
class Tolerance:
    """What of an angle (rad) and of a way (m) is rounding."""

    angle: float
    way: float

    def holds(self, angle: float, way: float) -> bool:
        """Whether both are."""
        return angle <= self.angle and way <= self.way


def tolerance_of(a: Mechanism, b: Mechanism) -> Tolerance:
    """What two texts of one robot may differ by."""
    k = a.rounding + b.rounding
    return Tolerance(k, k * size_of(a, b))


def size_of(a: Mechanism, b: Mechanism) -> float:
    """Metres: what angles are counted with where both are compared."""
    return max(a.size, b.size, LEAST_SIZE)


def between_lines(s: Screw, t: Screw, *, placed: bool) -> tuple[float, float]:
    """By what angle (rad), and if they have a place by what way (m), two axes differ as lines."""
    ux, uy, uz = s.direction.tolist()  # a walk asks this thousands of times: plain numbers
    vx, vy, vz = t.direction.tolist()
    sine = math.hypot(uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx)
    angle = math.atan2(sine, abs(ux * vx + uy * vy + uz * vz))
    if not placed:
        return angle, 0.0
    x, y, z = (s.point - t.point).tolist()
    along = vx * x + vy * y + vz * z
    return angle, math.hypot(x - along * vx, y - along * vy, z - along * vz)
