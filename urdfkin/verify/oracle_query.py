"""What a call was asked, as its user gave it: the oracle's way from arguments to flat batches.

`urdfkin.verify.call` brings the same arguments into shape for the recursion. The two share no code, so that a
batch that is broadcast, reordered or read wrongly on the one way does not come out the same on the other.

So are names: each is looked up again among the joints in their order, which the oracle compares with its own.
The numbers of a pose, and how a number with a unit reads (`urdfkin.errors.numbers`), are found once.
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

#: For so many rates of a joint: what its coordinates, or its rates, are called behind its name.
_OF_Q = {3: ("x", "y", "angle"), 6: ("x", "y", "z", "qx", "qy", "qz", "qw")}
_OF_RATES = {3: ("vx", "vy", "wz"), 6: ("vx", "vy", "vz", "wx", "wy", "wz")}


class _Names:
    """Where the number of each name is, in q or in v.

    Args:
        joints: The names of the joints, in order, and how many rates each has.
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
        """The index of a number, or of a joint's; raises OracleError where nothing is called so."""
        if name in self._joints:
            at, own = self._joints[name]
            return slice(at, at + len(own)) if own else at
        for joint, (at, own) in self._joints.items():
            suffix = name.removeprefix(joint).lstrip(".:")
            if name.startswith(joint) and suffix in own:
                return at + own.index(suffix)
        raise OracleError("no number is called so", found=repr(name[:60]))

    def pairs(self, text: str) -> list[tuple[str, str]]:
        """Each name that an equals sign follows in a text, and the number behind it."""
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
    """In SI units."""
    found = parse_quantity(text)
    value = parse_float(text) if found is None else found.value
    if value is None:
        raise OracleError("a number reads differently", found=repr(text[:60]))
    return value


class BaseRows(NamedTuple):
    """A base's motion, one row for each configuration: (n, 4, 4), (n, 6), (n, 6)."""

    placement: FloatArray
    velocity: FloatArray
    acceleration: FloatArray


class QueryBatch(NamedTuple):
    """Some configurations of a question, flat.

    Attributes:
        frames: As the user named them.
        reference: As the user named it.
        inputs: q (n, nq), then v and a (n, nv) as far as they were given.
        base: How the base moves; None if it stands still.
    """

    frames: tuple[str, ...]
    reference: Reference | str
    inputs: tuple[FloatArray, ...]
    base: BaseNumbers | None


class OracleQuery:
    """The arguments of one call.

    Args:
        frame: A name or several.
        reference: A member or its name.
        base: None if it stands still.
        inputs: q, v, a as far as they were given: numbers that broadcast.
        named: What of them was given by name, as it was given; None for the others.
        joints: The names of the joints that have coordinates, in order, and how many rates each has.
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
        """Read the numbers now, before what they may be views of is written to."""
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
        """`x` with each number that was given by a name where that name's coordinate or rate is."""
        names = _Names(self._joints, of)
        for name, value in given.items() if isinstance(given, Mapping) else names.pairs(given):
            x[..., names.place(name)] = _number(value) if isinstance(value, str) else np.asarray(value, float)
        return x

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """The batch shape of the result."""
        axes = [x.shape[:-1] for x in self._inputs]
        if self.base is not None:
            axes += [self.base.placement.shape[:-2], self.base.velocity.shape[:-1]]
            axes.append(self.base.acceleration.shape[:-1])
        return np.broadcast_shapes(*axes)

    @cached_property
    def n(self) -> int:
        """How many configurations it is about."""
        return math.prod(self.shape)

    def rows(self, part: slice | IntArray) -> QueryBatch:
        """Some of the configurations, counted through the batch with its last axis first."""
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
        """(n, frames, ...) of a result as it is handed out, each matrix or six-vector of `axes` axes.

        Raises:
            OracleError: it has another shape than the question.
        """
        own, several = result.shape[result.ndim - axes :], () if self._is_one else (len(self.frames),)
        if result.shape != (*self.shape, *several, *own):
            raise OracleError("a result has another batch shape than what was asked", found=str(result.shape))
        return result.reshape(self.n, len(self.frames), *own)
