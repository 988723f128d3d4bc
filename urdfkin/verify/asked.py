"""What a call was asked, as its user gave it: the oracle's way from arguments to flat batches.

`urdfkin.verify.call` brings the same arguments into shape for the recursion. The two share no code, so that a
batch that is broadcast, reordered or read wrongly on the one way does not come out the same on the other.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.compiled.plan import IntArray
from urdfkin.errors import OracleError
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray
from urdfkin.verify.pinocchio_base import BaseNumbers


class BaseRows(NamedTuple):
    """A base's motion, one row for each configuration: (n, 4, 4), (n, 6), (n, 6)."""

    placement: FloatArray
    velocity: FloatArray
    acceleration: FloatArray


class Rows(NamedTuple):
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


class Question:
    """The arguments of one call.

    Args:
        frame: A name or several.
        reference: A member or its name.
        base: None if it stands still.
        inputs: q, v, a as far as they were given: numbers that broadcast.
    """

    def __init__(
        self,
        frame: str | Sequence[str],
        reference: Reference | str,
        base: BaseNumbers | None,
        inputs: Sequence[ArrayLike],
    ) -> None:
        self.frames = (frame,) if isinstance(frame, str) else tuple(frame)
        self.reference, self.base = reference, base
        self._given = inputs

    def read(self) -> None:
        """Read the numbers now, before what they may be views of is written to."""
        _ = self._inputs

    @cached_property
    def _inputs(self) -> tuple[FloatArray, ...]:
        return tuple(np.asarray(x, dtype=np.float64) for x in self._given)

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

    def rows(self, part: slice | IntArray) -> Rows:
        """Some of the configurations, counted through the batch with its last axis first."""
        numbers = np.arange(part.start, part.stop) if isinstance(part, slice) else part
        places = np.unravel_index(numbers, self.shape) if self.shape else (np.zeros(1, dtype=np.int64),)

        def pick(x: FloatArray, own: int = 1) -> FloatArray:
            spread: FloatArray = np.broadcast_to(x, (*(self.shape or (1,)), *x.shape[x.ndim - own :]))
            return spread[places]

        base = self.base
        if base is not None:
            base = BaseRows(pick(base.placement, 2), pick(base.velocity), pick(base.acceleration))
        return Rows(self.frames, self.reference, tuple(map(pick, self._inputs)), base)

    def flat(self, result: FloatArray, axes: int) -> FloatArray:
        """(n, frames, ...) of a result as it is handed out, each matrix or six-vector of `axes` axes.

        Raises:
            OracleError: it has another shape than the question.
        """
        own = result.shape[result.ndim - axes :]
        if result.shape not in ((*self.shape, *own), (*self.shape, len(self.frames), *own)):
            raise OracleError("a result has another batch shape than what was asked", found=str(result.shape))
        return result.reshape(self.n, len(self.frames), *own)
