"""Which coordinates move which joints of a path: leaders count, followers copy.

A path's own coordinates are its independent joints in path order. A joint that mimics another is no
coordinate: its value is `multiplier * q_leader + offset`, and its leader is a coordinate of the path even
when the leader itself lies elsewhere on the robot.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from urdfkin.errors import InputError, Question
from urdfkin.model.configuration import numbers
from urdfkin.model.configuration_like import CoordinateLayout, Given, Hint, by_name
from urdfkin.model.tree import FloatArray, JointKind, KinematicTree, Mimic, frozen


@dataclass(frozen=True)
class Coupling:
    """The linear map from a path's coordinates to the values of its joints: values = G q + g.

    Attributes:
        joints: Every joint of the path that moves, base to tip.
        mimics: Whom each of them follows, None for a joint with a coordinate of its own.
        kinds: How each of them moves.

    Example:
        >>> turn = JointKind.REVOLUTE
        >>> couple = Coupling(("a", "b"), (None, Mimic("a", 2.0, 0.5)), (turn, turn))
        >>> couple.names, couple.values([1.0]).tolist(), couple.values({"a": "180deg"}).round(2).tolist()
        (('a',), [1.0, 2.5], [3.14, 6.78])
    """

    joints: tuple[str, ...]
    mimics: tuple[Mimic | None, ...]
    kinds: tuple[JointKind, ...]

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The coordinates: names of independent joints, in the order in which the path meets them."""
        leaders = (
            mimic.leader if mimic else joint for joint, mimic in zip(self.joints, self.mimics, strict=True)
        )
        return tuple(dict.fromkeys(leaders))

    @cached_property
    def matrix(self) -> FloatArray:
        """(joints, coordinates) G: how fast each joint moves with each coordinate."""
        G = np.zeros((len(self.joints), len(self.names)))
        G[np.arange(len(self.joints)), self._leader_index] = self._multiplier
        return frozen(G)

    @cached_property
    def offset(self) -> FloatArray:
        """(joints,) g: where each joint stands when every coordinate is zero."""
        return frozen([mimic.offset if mimic else 0.0 for mimic in self.mimics])

    def places(self, what: str = "q") -> CoordinateLayout:
        """How the numbers of a path's q, v or a are called and measured, for those who give them by name."""
        rules = list(zip(self.joints, self.mimics, self.kinds, strict=True))
        units = {joint: "rad" if kind.turns else "m" for joint, mimic, kind in rules if not mimic}
        # A leader that is not on the path may be of any kind.
        own = tuple(map(units.get, self.names))
        follow = {
            joint: Hint(f"it follows {mimic.leader}: give that", Question.MIMIC_JOINTS)
            for joint, mimic, _ in rules
            if mimic
        }
        neutral = {"neutral": np.zeros(len(self.names))}
        return CoordinateLayout(what, self.names, own, poses=lambda: neutral, otherwise=lambda: follow)

    def values(self, q: Given) -> FloatArray:
        """(..., joints) values of all joints, rad or m.

        Args:
            q: (..., coordinates) in the order of `names`, or a mapping by name, or text
                (`urdfkin.model.configuration_like`).

        Raises:
            InputError: the last axis has another length than `names`, or a name is missing.
            UnknownNameError: a name that is no coordinate of the path.
        """
        coordinates = self.checked(q, "q")
        # One multiplication and one addition for each joint, so that G's zeros cost no rounding.
        return np.asarray(coordinates[..., self._leader_index] * self._multiplier + self.offset)

    def checked(self, array: Given, what: str) -> FloatArray:
        """`array`, "q", "v" or "a", as float64 with the path's number of coordinates on its last axis."""
        if (named := by_name(array, what)) is not None:
            return self.places(what).read(named)
        values = np.asarray(array, dtype=np.float64)
        if values.ndim == 0 or values.shape[-1] != len(self.names):
            raise InputError(
                f"{what} needs {len(self.names)} values on its last axis: {', '.join(self.names) or 'none'}",
                found=f"shape {values.shape}",
                remedy="pick these out of the robot's own coordinates, for instance with select()",
            )
        return values

    @cached_property
    def _leader_index(self) -> list[int]:
        column = {name: i for i, name in enumerate(self.names)}
        pairs = zip(self.joints, self.mimics, strict=True)
        return [column[mimic.leader if mimic else joint] for joint, mimic in pairs]

    @cached_property
    def _multiplier(self) -> FloatArray:
        return frozen([mimic.multiplier if mimic else 1.0 for mimic in self.mimics])

    def q_index(self, tree: KinematicTree) -> tuple[int, ...]:
        """Where the path's coordinates stand in the configuration `q` of the whole robot."""
        return tuple(tree.q_index[tree.joint_index(name)] for name in self.names)

    def v_index(self, tree: KinematicTree) -> tuple[int, ...]:
        """Where the path's rates stand in the rates `v` of the whole robot."""
        return tuple(tree.v_index[tree.joint_index(name)] for name in self.names)

    def select(self, tree: KinematicTree, q: Given) -> FloatArray:
        """(..., coordinates) of the path out of the whole robot's `q` (..., nq).

        Raises:
            InputError: `q` has another length than the robot's.
        """
        return numbers(tree, q, "q")[..., list(self.q_index(tree))]


def coupling_of(joints: Sequence[tuple[str, Mimic | None, JointKind]]) -> Coupling:
    """The coupling of joints given as (name, whom it follows, how it moves)."""
    names, mimics, kinds = zip(*joints, strict=True) if joints else ((), (), ())
    return Coupling(names, mimics, kinds)
