"""Where each number of a user's q, v and a stands in Pinocchio's model, from that model and the text alone.

The layout is the one that the README promises: joints in Pinocchio's order; one number for a revolute,
continuous or prismatic joint, three for a planar and seven for a floating one; none for a follower. Nothing
of `KinematicTree` enters, so that a coordinate that urdfkin gives to another joint is found.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from urdfkin.errors import OracleError
from urdfkin.model.tree import FloatArray, Mimic
from urdfkin.verify.coupling import Places, coupled

#: urdfkin's coordinates for a joint to which Pinocchio gives so many (nq, nv).
_CONTINUOUS, _PLANAR, _FLOATING = (2, 1), (4, 3), (7, 6)
_COORDINATES = {(1, 1): 1, _CONTINUOUS: 1, _PLANAR: 3, _FLOATING: 7}


class _Place(NamedTuple):
    """A joint: its sizes and first places in Pinocchio's model, its first places in q and v, and its rule."""

    sizes: tuple[int, int]
    full_q: int
    full_v: int
    q: int
    v: int
    multiplier: float
    offset: float


class Layout:
    """The way from q, v and a to Pinocchio's, and from its columns back.

    Args:
        model: Pinocchio's model.
        joints: The robot's own joints, by Pinocchio's numbers, in order.
        names: Their names.
        rules: Whom each follower follows.

    Attributes:
        nq: Length of q.
        nv: Length of v.
        joint_ids: The robot's moving joints, followers too, by Pinocchio's numbers.
        coordinates: Names of the joints that have coordinates of their own.
        rate_columns: Pinocchio's columns of their rates, in that order.
    """

    def __init__(
        self, model: Any, joints: Sequence[int], names: Sequence[str], rules: Mapping[str, Mimic]
    ) -> None:
        self._model, self.joint_ids = model, list(joints)
        sizes = [(int(model.joints[j].nq), int(model.joints[j].nv)) for j in joints]
        at, self.nq, self.nv = dict[str, tuple[int, int]](), 0, 0
        for name, own in zip(names, sizes, strict=True):
            if name not in rules:
                at[name] = self.nq, self.nv
                self.nq, self.nv = self.nq + _COORDINATES[own], self.nv + own[1]
        self.coordinates = tuple(at)
        self._places = list[_Place]()
        for j, name, own in zip(joints, names, sizes, strict=True):
            rule = rules.get(name, Mimic(name, 1.0, 0.0))
            if rule.leader not in at:
                raise OracleError(
                    "Pinocchio knows no joint to follow", where=f"joint {name}", found=repr(rule.leader)
                )
            full = int(model.joints[j].idx_q), int(model.joints[j].idx_v)
            self._places.append(_Place(own, *full, *at[rule.leader], rule.multiplier, rule.offset))
        self.rate_columns = [place.full_v + c for place in self._places for c in range(place.sizes[1])]
        self._index, self._factor = self._rates()
        #: Whether Pinocchio's coordinates, and its rates, are the robot's as they stand.
        plain = [(p.q, (1, 1), 1.0, 0.0) == (p.full_q, p.sizes, p.multiplier, p.offset) for p in self._places]
        self._same_q = all(plain) and model.nq == self.nq
        self._same_v = model.nv == self.nv and bool((self._factor == 1.0).all())
        self._same_v &= bool((self._index == np.arange(model.nv)).all())

    def _rates(self) -> tuple[Places, FloatArray]:
        """For each of Pinocchio's rates: which of v it is, and the factor (G); 0 where it is the base's."""
        index, factor = np.zeros(self._model.nv, dtype=np.int64), np.zeros(self._model.nv)
        for place in self._places:
            for c in range(place.sizes[1]):
                index[place.full_v + c] = place.v + c
                factor[place.full_v + c] = place.multiplier
        return index, factor

    def configurations(self, q: FloatArray) -> FloatArray:
        """(n, Pinocchio's nq) for (n, nq); quaternions are brought to norm 1 here, as they are given."""
        if self._same_q:
            return np.array(q)
        full = np.zeros((len(q), self._model.nq))
        for sizes, at, _, own, _, multiplier, offset in self._places:
            if sizes == _FLOATING:
                full[:, at : at + 7] = q[:, own : own + 7]
                full[:, at + 3 : at + 7] /= np.linalg.norm(full[:, at + 3 : at + 7], axis=1, keepdims=True)
            elif sizes == _PLANAR:
                full[:, at : at + 2] = q[:, own : own + 2]
                full[:, at + 2], full[:, at + 3] = np.cos(q[:, own + 2]), np.sin(q[:, own + 2])
            else:
                value = multiplier * q[:, own] + offset
                if sizes == _CONTINUOUS:
                    full[:, at], full[:, at + 1] = np.cos(value), np.sin(value)
                else:
                    full[:, at] = value
        return full

    def rates(self, v: FloatArray) -> FloatArray:
        """(n, Pinocchio's nv) for (n, nv): v_full = G v."""
        if not self.nv:
            return np.zeros((len(v), self._model.nv))
        full: FloatArray = v[:, self._index] * self._factor
        return full

    def couple(self, full: FloatArray) -> FloatArray:
        """J_full G: columns of followers are added to their leaders'; a base's are left out."""
        if self._same_v:
            return full
        return coupled(full, np.array(self.rate_columns, dtype=np.int64), self._index, self._factor, self.nv)
