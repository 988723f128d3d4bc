"""Convert the arguments of a call to flat batches for the oracle, independently of `urdfkin.verify.call`.

`urdfkin.verify.call` converts the same arguments for the recursion. Apart from the exceptions below, the two
modules share no code. A wrong broadcast, order or name in one of them therefore leads to a disagreement.

Names are looked up here a second time, among the joints in their order. The oracle compares that order of the
joints with its own. Both modules use the same numbers of named poses and the same parser of units
(`urdfkin.errors.numbers`).
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.compiled.plan import IntArray
from urdfkin.errors import OracleError
from urdfkin.errors.numbers import parse_float, parse_quantity
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray
from urdfkin.verify.pinocchio_inputs import BaseNumbers

#: Suffixes of the names of coordinates and joint velocities, by the number of joint velocities of a joint.
_OF_Q = {3: ("x", "y", "angle"), 6: ("x", "y", "z", "qx", "qy", "qz", "qw")}
_OF_RATES = {3: ("vx", "vy", "wz"), 6: ("vx", "vy", "vz", "wx", "wy", "wz")}


class _Names:
    """Lookup from names to indices in q or v.

    Args:
        joints: Name and number of joint velocities of each joint, in order.
        of: `_OF_Q` or `_OF_RATES`.

    >>> names = _Names([("base", 3), ("elbow", 1)], _OF_Q)
    >>> names.place("base.y"), names.place("base"), names.place("elbow")
    (1, slice(0, 3, None), 3)
    >>> names.pairs("ready, base.x = 5mm, elbow=pi / 2")
    [('base.x', '5mm'), ('elbow', 'pi / 2')]
    """

    def __init__(self, joints: Sequence[tuple[str, int]], of: Mapping[int, tuple[str, ...]]) -> None:
        self._joints, at = dict[str, tuple[int, tuple[str, ...]]](), 0
        for joint, rates in joints:
            own = of.get(rates, ())
            self._joints[joint] = at, own
            at += len(own) or 1

    def place(self, name: str) -> int | slice:
        """Return the index of a number, or the slice of a joint; raise OracleError for an unknown name."""
        if name in self._joints:
            at, own = self._joints[name]
            return slice(at, at + len(own)) if own else at
        for joint, (at, own) in self._joints.items():
            suffix = name.removeprefix(joint).lstrip(".:")
            if name.startswith(joint) and suffix in own:
                return at + own.index(suffix)
        raise OracleError("the robot has no coordinate with this name", found=repr(name[:60]))

    def pairs(self, text: str) -> list[tuple[str, str]]:
        """Return the pairs (name, number) of a text with `NAME=NUMBER`."""
        plain = " ".join(text.split())
        plain = plain[1:-1].strip() if plain[:1] + plain[-1:] in ("[]", "()", "{}") else plain
        names = [
            f"{re.escape(joint)}(?:[.:]+(?:{'|'.join(own)}))?" if own else re.escape(joint)
            for joint, (_, own) in self._joints.items()
        ]
        known = "|".join(sorted(names, key=len, reverse=True))
        starts = list(re.finditer(rf"(?:^|(?<=[ ,]))({known}) ?= ?", plain))
        ends = [*(match.start() for match in starts[1:]), len(plain)]
        return [(m[1], plain[m.end() : end].strip(" ,")) for m, end in zip(starts, ends, strict=False)]


def _number(text: str) -> float:
    """Return the number in SI units."""
    found = parse_quantity(text)
    value = parse_float(text) if found is None else found.value
    if value is None:
        raise OracleError("the two readers read this number differently", found=repr(text[:60]))
    return value


class BaseRows(NamedTuple):
    """Motion of the base, one row for each configuration: (n, 4, 4), (n, 6), (n, 6)."""

    placement: FloatArray
    velocity: FloatArray
    acceleration: FloatArray


class QueryBatch(NamedTuple):
    """Some configurations of a query as a flat batch.

    Attributes:
        frames: Names of the frames, as the user gave them.
        reference: The reference frame, as the user gave it.
        inputs: q (n, nq), or q and v (n, nv), or q, v and a (n, nv).
        base: Motion of the base; None: fixed at the world origin.
    """

    frames: tuple[str, ...]
    reference: Reference | str
    inputs: tuple[FloatArray, ...]
    base: BaseNumbers | None


class OracleQuery:
    """The arguments of one call.

    Args:
        frame: Name of a frame, or several names.
        reference: A `Reference` or its name.
        base: Motion of the base; None: fixed at the world origin.
        inputs: q, or q and v, or q, v and a, as numbers that broadcast.
        named: The original argument of each input that was given by names; None for the others.
        joints: Name and number of joint velocities of each joint with coordinates, in order.
    """

    def __init__(
        self,
        frame: str | Sequence[str],
        reference: Reference | str,
        base: BaseNumbers | None,
        inputs: Sequence[ArrayLike],
        named: Sequence[str | Mapping[str, ArrayLike] | None] = (),
        joints: Sequence[tuple[str, int]] = (),
    ) -> None:
        self._is_one = isinstance(frame, str)
        self.frames = (frame,) if isinstance(frame, str) else tuple(frame)
        self.reference, self.base = reference, base
        self._given, self._named, self._joints = inputs, named or [None] * len(inputs), joints

    def read(self) -> None:
        """Convert the inputs now. They may be views of `out`, which the computation overwrites."""
        _ = self._inputs

    @cached_property
    def _inputs(self) -> tuple[FloatArray, ...]:
        return tuple(
            np.asarray(x, dtype=np.float64) if given is None else self._by_name(np.array(x, float), given, of)
            for x, given, of in zip(self._given, self._named, (_OF_Q, _OF_RATES, _OF_RATES), strict=False)
        )

    def _by_name(
        self, x: FloatArray, given: str | Mapping[str, ArrayLike], of: Mapping[int, tuple[str, ...]]
    ) -> FloatArray:
        """Return `x` with each named number at the index of its name."""
        names = _Names(self._joints, of)
        for name, value in given.items() if isinstance(given, Mapping) else names.pairs(given):
            x[..., names.place(name)] = _number(value) if isinstance(value, str) else np.asarray(value, float)
        return x

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """Batch shape of the result."""
        axes = [x.shape[:-1] for x in self._inputs]
        if self.base is not None:
            axes += [self.base.placement.shape[:-2], self.base.velocity.shape[:-1]]
            axes.append(self.base.acceleration.shape[:-1])
        return np.broadcast_shapes(*axes)

    @cached_property
    def n(self) -> int:
        """Number of configurations."""
        return math.prod(self.shape)

    def rows(self, part: slice | IntArray) -> QueryBatch:
        """Return some of the configurations, by index in the flat batch (C order)."""
        numbers = np.arange(part.start, part.stop) if isinstance(part, slice) else part
        places = np.unravel_index(numbers, self.shape) if self.shape else (np.zeros(1, dtype=np.int64),)

        def pick(x: FloatArray, own: int = 1) -> FloatArray:
            spread: FloatArray = np.broadcast_to(x, (*(self.shape or (1,)), *x.shape[x.ndim - own :]))
            return spread[places]

        base = self.base
        if base is not None:
            base = BaseRows(pick(base.placement, 2), pick(base.velocity), pick(base.acceleration))
        return QueryBatch(self.frames, self.reference, tuple(map(pick, self._inputs)), base)

    def flat(self, result: FloatArray, axes: int) -> FloatArray:
        """Return (n, frames, ...) of a result in the user's shape; one result has `axes` axes.

        Raises:
            OracleError: the shape does not match the query.
        """
        own, several = result.shape[result.ndim - axes :], () if self._is_one else (len(self.frames),)
        if result.shape != (*self.shape, *several, *own):
            raise OracleError(
                "the batch shape of a result does not match that of the arguments", found=str(result.shape)
            )
        return result.reshape(self.n, len(self.frames), *own)
