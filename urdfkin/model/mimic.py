"""Map a path's coordinates q to the joint values G q + g, including the values of mimic joints.

The coordinates of a path are the independent joints that determine its joint values, in the order of their
first use on the path. A mimic joint has no coordinate; its value is `multiplier * q_mimicked + offset`. The
mimicked joint is a coordinate of the path even if the path does not contain the mimicked joint.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.errors import InputError, NotFiniteError, QuestionsSection
from urdfkin.kinematics.inputs import as_floats, check_range
from urdfkin.model.configuration import parse_numbers
from urdfkin.model.configuration_like import ConfigurationLike, CoordinateLayout, Hint, as_text_or_mapping
from urdfkin.model.tree import FloatArray, JointKind, KinematicTree, Mimic, freeze


@dataclass(frozen=True)
class Coupling:
    """The linear map from a path's coordinates to joint values: G q + g.

    >>> turn = JointKind.REVOLUTE
    >>> couple = Coupling(("a", "b"), (None, Mimic("a", 2.0, 0.5)), (turn, turn))
    >>> couple.names, couple.values([1.0]).tolist(), couple.values({"a": "180deg"}).round(2).tolist()
    (('a',), [1.0, 2.5], [3.14, 6.78])
    """

    joints: tuple[str, ...]
    mimics: tuple[Mimic | None, ...]
    kinds: tuple[JointKind, ...]

    @cached_property
    def _coordinate_by_joint(self) -> list[str]:
        pairs = zip(self.joints, self.mimics, strict=True)
        return [mimic.mimicked_joint if mimic else joint for joint, mimic in pairs]

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the path's coordinates, in the order of their first use on the path."""
        return tuple(dict.fromkeys(self._coordinate_by_joint))

    @cached_property
    def matrix(self) -> FloatArray:
        G = np.zeros((len(self.joints), len(self.names)))
        G[np.arange(len(self.joints)), self._independent_index] = self._multiplier
        return freeze(G)

    @cached_property
    def offset(self) -> FloatArray:
        return freeze([mimic.offset if mimic else 0.0 for mimic in self.mimics])

    def layout(self, symbol: str = "q") -> CoordinateLayout:
        rules = list(zip(self.joints, self.mimics, self.kinds, strict=True))
        units = {joint: "rad" if kind.turns else "m" for joint, mimic, kind in rules if not mimic}
        # The unit of a mimicked joint outside the path is unknown.
        own = tuple(map(units.get, self.names))
        hints = {
            joint: Hint(
                f"this joint mimics {mimic.mimicked_joint}: give the value of {mimic.mimicked_joint}",
                QuestionsSection.MIMIC_JOINTS,
            )
            for joint, mimic, _ in rules
            if mimic
        }
        neutral = {"neutral": np.zeros(len(self.names))}
        return CoordinateLayout(symbol, self.names, own, poses=lambda: neutral, hints_by_name=lambda: hints)

    def values(self, q: ConfigurationLike) -> FloatArray:
        """Return all joint values, rad or m."""
        coordinates = self.parse(q, "q")
        with np.errstate(over="ignore"):  # RangeError replaces this warning.
            # Each row of G has at most one nonzero number, so no matrix product is needed.
            return check_range(coordinates[..., self._independent_index] * self._multiplier + self.offset)

    def parse(self, array: ConfigurationLike, symbol: str) -> FloatArray:
        if (by_name := as_text_or_mapping(array, symbol)) is not None:
            return self._check_finite(self.layout(symbol).parse(by_name), symbol)
        values = as_floats(cast("ArrayLike", array), symbol)
        if values.ndim == 0 or values.shape[-1] != len(self.names):
            names = ", ".join(self.names) or "none"
            raise InputError(
                f"{symbol} needs {len(self.names)} values on its last axis: {names}",
                found=f"shape {values.shape}",
                remedy="take the path's coordinates from the robot's q, for example with select()",
            )
        return self._check_finite(values, symbol)

    def _check_finite(self, values: FloatArray, symbol: str) -> FloatArray:
        if not np.isfinite(values).all():
            where = tuple(np.argwhere(~np.isfinite(values))[0])
            found = str(values[where])
            raise NotFiniteError(f"{symbol} must be finite", where=self.names[where[-1]], found=found)
        return values

    @cached_property
    def _independent_index(self) -> list[int]:
        column = {name: i for i, name in enumerate(self.names)}
        return [column[mimicked_joint] for mimicked_joint in self._coordinate_by_joint]

    @cached_property
    def _multiplier(self) -> FloatArray:
        return freeze([mimic.multiplier if mimic else 1.0 for mimic in self.mimics])

    def q_index(self, tree: KinematicTree) -> tuple[int, ...]:
        return tuple(tree.q_index[tree.joint_index(name)] for name in self.names)

    def v_index(self, tree: KinematicTree) -> tuple[int, ...]:
        return tuple(tree.v_index[tree.joint_index(name)] for name in self.names)

    def select(self, tree: KinematicTree, q: ConfigurationLike) -> FloatArray:
        return parse_numbers(tree, q, "q")[..., list(self.q_index(tree))]


def make_coupling(joints: Sequence[tuple[str, Mimic | None, JointKind]]) -> Coupling:
    names, mimics, kinds = zip(*joints, strict=True) if joints else ((), (), ())
    return Coupling(names, mimics, kinds)
