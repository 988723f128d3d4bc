"""One call's inputs as flat batches, its check, and the way back to the caller's shape."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.asked import Question
from urdfkin.checks import Part, axes_of, held_against
from urdfkin.demands import words
from urdfkin.errors import InputError, NotFiniteError, RangeError
from urdfkin.recursion.base import STILL_STATE, BaseMotion
from urdfkin.recursion.plan import IntArray
from urdfkin.reference import Reference
from urdfkin.roundings import EPS
from urdfkin.tree import FloatArray
from urdfkin.verification import bounds
from urdfkin.verification.bounds import Bound, Quantity
from urdfkin.verification.certificate import Comparison, VerificationError, compare
from urdfkin.verification.choosing import SAMPLE, Verify, checked_choice, parts
from urdfkin.verification.replay import replay_line

if TYPE_CHECKING:
    from urdfkin.robot import Robot

T = TypeVar("T")

#: The commands that compute a quantity again.
_COMMANDS = {
    Quantity.PLACEMENT: "placement",
    Quantity.VELOCITY: "velocity",
    Quantity.JACOBIAN: "jacobian",
    Quantity.JACOBIAN_RATE: "jacobian-rate",
    Quantity.ACCELERATION: "acceleration",
    Quantity.ACCELERATION_BREAKDOWN: "acceleration --explain",
}


class NotVerifiedWarning(UserWarning):
    """Results are handed out that Pinocchio could not check; the message says why."""


def _every_link(robot: Robot) -> tuple[str, ...]:
    return tuple(robot.tree.frame_name(link) for link in range(len(robot.tree.links)))


class Call:
    """One call's inputs as flat batches, and the way back to the caller's shape.

    Args:
        robot: Who is asked.
        frames: Names; None means every link.
        reference: A member or its name.
        base: How the root link moves; None if it stands still.
        inputs: q, v and a, as far as the quantity needs them.
        options: What else the call was given, by the method's names for it.
    """

    def __init__(
        self,
        robot: Robot,
        frames: Sequence[str] | None,
        reference: Reference | str,
        base: BaseMotion | None,
        *inputs: ArrayLike,
        **options: object,
    ) -> None:
        if base is not None and not isinstance(base, BaseMotion):
            raise InputError("base is a BaseMotion or None", found=type(base).__name__)
        self.robot, self.base = robot, base
        self.frames = _every_link(robot) if frames is None else words(frames, "frames")
        self.question = Question(
            robot.tree.link_frames if frames is None else frames, reference, base, inputs
        )
        self.reference = Reference.of(reference)
        self.links = tuple(robot.tree.frame_link(frame) for frame in self.frames)
        self.plan = robot.plan(self.links)
        self.inputs, self.options = inputs, options
        given = [robot.shaped(x, name) for x, name in zip(inputs, "qva", strict=False)]
        self.shape = self._batch_shape(given)
        self.n = math.prod(self.shape)
        flat = [self._flat_input(array) for array in given]
        self.q, *self.rates = flat
        self.state = STILL_STATE if base is None else base.state(self.shape)

    def _batch_shape(self, given: list[FloatArray]) -> tuple[int, ...]:
        shapes = [array.shape[:-1] for array in given]
        if self.base is not None:
            shapes.append(self.base.batch_shape)
        if all(shape == shapes[0] for shape in shapes):
            return shapes[0]
        try:
            return np.broadcast_shapes(*shapes)
        except ValueError:
            found = ", ".join(str(shape) for shape in shapes)
            raise InputError("the batch shapes of q, v, a and base do not fit", found=found) from None

    def _flat_input(self, array: FloatArray) -> FloatArray:
        """(n, width); a single row for many configurations stays one in memory."""
        width = array.shape[-1]
        if array.shape[:-1] == self.shape:
            return np.ascontiguousarray(array.reshape(self.n, width))
        if array.size == width:
            return np.broadcast_to(np.ascontiguousarray(array).reshape(width), (self.n, width))
        return np.ascontiguousarray(np.broadcast_to(array, (*self.shape, width)).reshape(self.n, width))

    @property
    def results(self) -> int:
        """How many results the call hands out."""
        return self.n * len(self.links)

    def flat(self, out: FloatArray | None, *own: int, every: bool = False) -> FloatArray | None:
        """`out`, for one frame or for every one, as the kernels write it: (n, frames, ...)."""
        if out is None:
            return None
        wanted = (*self.shape, len(self.links), *own) if every else (*self.shape, *own)
        good = isinstance(out, np.ndarray) and out.dtype == np.float64 and out.flags.c_contiguous
        if not good or out.shape != wanted or not out.flags.writeable:
            raise InputError(
                f"out must be a writable C-contiguous float64 array of shape {wanted}",
                found=f"{getattr(out, 'dtype', type(out).__name__)} {getattr(out, 'shape', '')}",
            )
        if any(np.may_share_memory(out, array) for array in (*self.inputs, self.q, *self.rates)):
            raise InputError("out must not share memory with q, v or a: they are read again for the check")
        return out.reshape(self.n, len(self.links), *own)

    def one(self, result: FloatArray, out: FloatArray | None) -> FloatArray:
        """The (n, 1, ...) result of a call for one frame, in the caller's batch shape."""
        return result.reshape(*self.shape, *result.shape[2:]) if out is None else out

    def every(self, result: FloatArray, out: FloatArray | None = None) -> FloatArray:
        """The (n, frames, ...) result of a call for several, in the caller's batch shape."""
        return result.reshape(*self.shape, *result.shape[1:]) if out is None else out

    def compute(self, evaluate: Callable[..., T], *arguments: Any, **options: Any) -> T:
        """Evaluate the walk, or name the number that is not finite."""
        try:
            return evaluate(*arguments, **options)
        except NotFiniteError:
            for x, name in zip(self.inputs, "qva", strict=False):
                self.robot.checked(x, name)
            raise

    def wanted(self, verify: Verify | None) -> Verify:
        """Which results are to be checked; None leaves it to the robot."""
        return checked_choice(self.robot.verify if verify is None else verify)

    def verify(self, quantity: Quantity, handed_out: FloatArray, verify: Verify | None) -> None:
        """Have results checked, in the shape in which the user gets them, and entered in the ledger.

        Raises:
            VerificationError: Pinocchio computes something else.
            OracleError: they have another shape than what was asked.
        """
        robot, ledger, wanted = self.robot, self.robot.ledger, self.wanted(verify)
        if wanted is False:
            ledger.unchecked(quantity, self.results)
            return
        if (reason := robot.cannot_verify(self.base)) is not None:
            warnings.warn(f"not verified: {reason}", NotVerifiedWarning, stacklevel=3)
            ledger.unchecked(quantity, self.results, reason)
            return
        results = self.question.flat(handed_out, axes_of(quantity))
        total, worst = Comparison.of_nothing(), None
        for part in parts(wanted, self.n, results[:1].size):
            comparison, failure = self._compare(quantity, results[part], part)
            if failure is not None and (worst is None or comparison.share > total.share):
                worst = failure
            total += comparison
        if worst is not None:
            raise worst
        ledger.checked(quantity, total)
        if left := self.results - total.results:
            ledger.unchecked(quantity, left, f'verify="sample" checks {SAMPLE} configurations of a call')

    def part(self, part: slice | IntArray) -> Part:
        """Some of its configurations, for the check."""
        state = self.state if len(self.state) == 1 else self.state[part]
        rates = tuple(x[part] for x in self.rates)
        representation = str(self.options.get("representation", ""))
        asked = self.question.rows(part)
        return Part(self.plan, self.reference, self.q[part], rates, state, asked, representation)

    def _compare(
        self, quantity: Quantity, ours: FloatArray, part: slice | IntArray
    ) -> tuple[Comparison, VerificationError | None]:
        """Hold some of the results against Pinocchio's; the worst of them, if it disagrees."""
        x = self.part(part)
        theirs, bound = held_against(quantity, self.robot.oracle(self.base), x, ours)
        comparison = compare(ours, theirs, bound, 2)
        if comparison.agrees:
            return comparison, None
        i, f = comparison.index
        k = part.start + i if isinstance(part, slice) else int(part[i])
        bound = Bound(*(np.broadcast_to(x, ours.shape)[i, f] for x in (bound.scale, bound.k)))
        if not (np.isfinite(bound.scale).all() and np.isfinite(theirs[i, f]).all()):
            raise RangeError(
                f"the {quantity} of {self.frames[f]} leaves the range of double precision",
                where=f"sample {list(self.index(k))}" if self.shape else None,
                remedy="give smaller numbers",
            )
        return comparison, VerificationError(
            quantity,
            self.frames[f],
            x.representation or self.reference.name,
            index=self.index(k),
            ours=ours[i, f],
            theirs=theirs[i, f],
            bound=EPS * bound.k * bound.scale,
            units=float(bounds.disagreement(ours[i, f], theirs[i, f], bound).max()),
            reproduce=self._replay(quantity, k, self.frames[f]),
        )

    def index(self, k: int) -> tuple[int, ...]:
        """Flat sample `k` as an index into the caller's batch."""
        return tuple(int(i) for i in np.unravel_index(k, self.shape)) if self.shape else ()

    def _replay(self, quantity: Quantity, k: int, frame: str) -> str:
        values = {name: array[k].tolist() for name, array in zip("qva", (self.q, *self.rates), strict=False)}
        without = quantity in (Quantity.PLACEMENT, Quantity.ANALYTICAL_JACOBIAN)
        reference = None if without else self.reference.name.lower()
        if self.base is None and quantity in _COMMANDS:
            return replay_line(self.robot.origin, _COMMANDS[quantity], frame, reference, values)
        options = self.options if reference is None else {"reference": reference, **self.options}
        # The command line has no words for a moving base, and none for the rest.
        words = [*map(repr, values.values()), repr(frame), *(f"{x}={y!r}" for x, y in options.items())]
        if (asked := self.question.rows(np.array([k])).base) is not None:
            fields = asked.placement, asked.velocity, asked.acceleration
            words.append(f"base=urdfkin.BaseMotion({', '.join(repr(x[0].tolist()) for x in fields)})")
        return f"{self.robot.origin.python}.{str(quantity).replace(' ', '_')}({', '.join(words)})"
