"""Which coordinates move which joints of a path: leaders count, followers copy.

A path's own coordinates are its independent joints in path order. A joint that mimics another is no
coordinate: its value is `multiplier * q_leader + offset`, and its leader is a coordinate of the path even
when the leader itself lies elsewhere on the robot.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.errors import InputError, UnknownNameError
from urdfkin.model.tree import FloatArray, KinematicTree, Mimic, frozen


@dataclass(frozen=True)
class Coupling:
    """The linear map from a path's coordinates to the values of its joints: values = G q + g.

    Attributes:
        joints: Every joint of the path that moves, base to tip.
        mimics: Whom each of them follows, None for a joint with a coordinate of its own.

    Example:
        >>> couple = Coupling(("a", "b"), (None, Mimic("a", 2.0, 0.5)))
        >>> couple.names, couple.values([1.0]).tolist()
        (('a',), [1.0, 2.5])
    """

    joints: tuple[str, ...]
    mimics: tuple[Mimic | None, ...]

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

    def values(self, q: ArrayLike | Mapping[str, float]) -> FloatArray:
        """(..., joints) values of all joints, rad or m.

        Args:
            q: (..., coordinates) in the order of `names`, or one configuration as a mapping by name.

        Raises:
            InputError: the last axis has another length than `names`.
            UnknownNameError: the mapping has a name that is no coordinate of the path.
        """
        if isinstance(q, Mapping):
            q = self._from_mapping(q)
        coordinates = self.checked(q, "q")
        # One multiplication and one addition for each joint, so that G's zeros cost no rounding.
        return np.asarray(coordinates[..., self._leader_index] * self._multiplier + self.offset)

    def checked(self, array: ArrayLike, what: str) -> FloatArray:
        """`array` as float64 with the path's number of coordinates on its last axis."""
        values = np.asarray(array, dtype=np.float64)
        if values.ndim == 0 or values.shape[-1] != len(self.names):
            raise InputError(
                f"{what} needs {len(self.names)} values on its last axis: {', '.join(self.names) or 'none'}",
                found=f"shape {values.shape}",
                remedy="pick these out of the robot's own coordinates, for instance with select()",
            )
        return values

    def _from_mapping(self, q: Mapping[str, float]) -> FloatArray:
        for name in q:
            if name not in self.names:
                raise UnknownNameError("coordinate", name, self.names)
        return np.array([q.get(name, 0.0) for name in self.names], dtype=np.float64)

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

    def select(self, tree: KinematicTree, q: ArrayLike) -> FloatArray:
        """(..., coordinates) of the path out of the whole robot's `q` (..., nq).

        Raises:
            InputError: `q` has another length than the robot's.
        """
        whole = np.asarray(q, dtype=np.float64)
        if whole.ndim == 0 or whole.shape[-1] != tree.nq:
            raise InputError(
                f"q of {tree.name} needs {tree.nq} values on its last axis", found=f"shape {whole.shape}"
            )
        return whole[..., list(self.q_index(tree))]


def coupling_of(joints: Sequence[tuple[str, Mimic | None]]) -> Coupling:
    """The coupling of joints given as (name, whom it follows)."""
    return Coupling(tuple(name for name, _ in joints), tuple(mimic for _, mimic in joints))
