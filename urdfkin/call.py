"""One call's inputs as flat batches, its check, and the way back to the caller's shape."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.errors import InputError, RangeError
from urdfkin.recursion.base import STILL_STATE, BaseMotion
from urdfkin.reference import Reference
from urdfkin.tree import FloatArray
from urdfkin.verification import bounds
from urdfkin.verification.bounds import Bound, Quantity
from urdfkin.verification.certificate import VerificationError, compare
from urdfkin.verification.magnitudes import magnitudes
from urdfkin.verification.replay import replay_line

if TYPE_CHECKING:
    from urdfkin.robot import Robot


class Call:
    """One call's inputs as flat batches, and the way back to the caller's shape."""

    def __init__(
        self,
        robot: Robot,
        frames: Sequence[str],
        reference: Reference | str,
        base: BaseMotion | None,
        *inputs: ArrayLike,
    ) -> None:
        if base is not None and not isinstance(base, BaseMotion):
            raise InputError("base is a BaseMotion or None", found=type(base).__name__)
        self.robot, self.frames, self.base = robot, tuple(frames), base
        self.reference = Reference.of(reference)
        self.links = tuple(robot.tree.frame_link(frame) for frame in self.frames)
        self.plan = robot.plan(self.links)
        given = [robot.checked(x, name) for x, name in zip(inputs, "qva", strict=False)]
        self.shape = self._batch_shape(given)
        self.n = int(np.prod(self.shape))
        flat = [self._flat_input(array) for array in given]
        still = np.zeros((self.n, robot.nv)) if len(flat) < 3 else flat[-1]
        self.q, self.v, self.a = (*flat, still, still)[:3]
        self.state = STILL_STATE if base is None else base.state(self.shape)
        self.given = len(given)

    def _batch_shape(self, given: list[FloatArray]) -> tuple[int, ...]:
        shapes = [array.shape[:-1] for array in given]
        if self.base is not None:
            shapes.append(self.base.batch_shape)
        try:
            return np.broadcast_shapes(*shapes)
        except ValueError:
            found = ", ".join(str(shape) for shape in shapes)
            raise InputError("the batch shapes of q, v, a and base do not fit", found=found) from None

    def _flat_input(self, array: FloatArray) -> FloatArray:
        width = array.shape[-1]
        return np.ascontiguousarray(np.broadcast_to(array, (*self.shape, width)).reshape(self.n, width))

    @property
    def results(self) -> int:
        """How many results the call hands out."""
        return self.n * len(self.links)

    @property
    def flat_base(self) -> BaseMotion | None:
        """The base with one flat batch axis, for the oracle."""
        if self.base is None or not self.base.batch_shape:
            return self.base
        fields = (self.base.placement, 2), (self.base.velocity, 1), (self.base.acceleration, 1)
        return BaseMotion(
            *(
                np.broadcast_to(x, (*self.shape, *x.shape[-own:])).reshape(self.n, *x.shape[-own:])
                for x, own in fields
            )
        )

    def flat(self, out: FloatArray | None, *own: int) -> FloatArray | None:
        """`out`, for one frame, as the kernels write it: (n, 1, ...)."""
        if out is None:
            return None
        good = isinstance(out, np.ndarray) and out.dtype == np.float64 and out.flags.c_contiguous
        if not good or out.shape != (*self.shape, *own) or not out.flags.writeable:
            raise InputError(
                f"out must be a writable C-contiguous float64 array of shape {(*self.shape, *own)}",
                found=f"{getattr(out, 'dtype', type(out).__name__)} {getattr(out, 'shape', '')}",
            )
        if any(np.may_share_memory(out, array) for array in (self.q, self.v, self.a)):
            raise InputError("out must not share memory with q, v or a: they are read again for the check")
        return out.reshape(self.n, 1, *own)

    def one(self, result: FloatArray, out: FloatArray | None) -> FloatArray:
        """The (n, 1, ...) result of a call for one frame, in the caller's batch shape."""
        return result.reshape(*self.shape, *result.shape[2:]) if out is None else out

    def every(self, result: FloatArray) -> FloatArray:
        """The (n, frames, ...) result of a call for several, in the caller's batch shape."""
        return result.reshape(*self.shape, *result.shape[1:])

    def size(self) -> Any:
        """How large the terms are that the results are summed from."""
        return magnitudes(self.plan, self.q, self.v, self.a, self.state)

    def check(self, quantity: Quantity, ours: FloatArray, theirs: FloatArray, bound: Bound) -> None:
        """Enter the comparison of (n, frames, ...) results in the ledger, or raise VerificationError."""
        comparison = compare(ours, theirs, bound, 2)
        if comparison.agrees:
            self.robot.ledger.checked(quantity, comparison)
            return
        k, f = comparison.index
        bound = Bound(*(np.broadcast_to(x, ours.shape)[k, f] for x in (bound.scale, bound.k)))
        if not (np.isfinite(bound.scale).all() and np.isfinite(theirs[k, f]).all()):
            raise RangeError(
                f"the {quantity} of {self.frames[f]} leaves the range of double precision",
                where=f"sample {list(self._index(k))}" if self.shape else None,
                remedy="give smaller numbers",
            )
        raise VerificationError(
            quantity,
            self.frames[f],
            self.reference.name,
            index=self._index(k),
            ours=ours[k, f],
            theirs=theirs[k, f],
            bound=bounds.EPS * bound.k * bound.scale,
            units=float(bounds.disagreement(ours[k, f], theirs[k, f], bound).max()),
            reproduce=self._replay(quantity, k, self.frames[f]),
        )

    def _index(self, k: int) -> tuple[int, ...]:
        """Flat sample `k` as an index into the caller's batch."""
        return tuple(int(i) for i in np.unravel_index(k, self.shape)) if self.shape else ()

    def _replay(self, quantity: Quantity, k: int, frame: str) -> str:
        reference = None if quantity is Quantity.PLACEMENT else self.reference.name.lower()
        values = {
            name: array[k].tolist()
            for name, array in zip("qva", (self.q, self.v, self.a)[: self.given], strict=False)
        }
        if self.base is None:
            command = str(quantity).replace(" ", "-")
            return replay_line(self.robot.origin, command, frame, reference, values)
        # The command line has no words for a moving base.
        base = self.flat_base or self.base
        arguments = [*map(repr, values.values()), repr(frame), *([repr(reference)] if reference else [])]
        fields = ((base.placement, 2), (base.velocity, 1), (base.acceleration, 1))
        motion = (repr((x if x.ndim == own else x[k]).tolist()) for x, own in fields)
        return (
            f"{self.robot.origin.python}.{str(quantity).replace(' ', '_')}({', '.join(arguments)},"
            f" base=urdfkin.BaseMotion({', '.join(motion)}))"
        )
