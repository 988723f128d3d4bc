"""Enclosures: intervals that provably contain the true values of one sample.

Interval arithmetic (`urdfkin.verify.exact.numbers`) evaluates `urdfkin.kinematics.equations`. The inputs are
the URDF's decimals and the exact values of q, v and a. An enclosure proves a bound on the rounding error. An
enclosure does not prove that the equations are correct. The comparison with Pinocchio checks the equations.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from urdfkin.compiled.plan import CompiledTree
from urdfkin.errors import InputError
from urdfkin.errors.escape import log_line
from urdfkin.errors.validators import as_int, as_str
from urdfkin.kinematics.inputs import as_floats
from urdfkin.model.base_motion import BaseMotion
from urdfkin.model.configuration import parse_finite
from urdfkin.model.configuration_like import ConfigurationLike
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray, freeze
from urdfkin.verify.call import Call
from urdfkin.verify.exact.numbers import enough_digits, interval_ends, precision, read_exact_joints
from urdfkin.verify.exact.recursion import compute_motion, make_base_state
from urdfkin.verify.quantities import (
    ACCELERATION,
    HESSIAN,
    JACOBIAN,
    JACOBIAN_RATE,
    PLACEMENT,
    VELOCITY,
    Quantity,
)
from urdfkin.verify.verifier import Verifier, compute_oracle_results, compute_own_results

#: Minimum and maximum number of decimal digits of the intervals. Different decimals of 15 digits are
#: different doubles. The maximum limits the computing time.
MIN_DIGITS, MAX_DIGITS = 15, 10_000

_round_ends = np.vectorize(interval_ends, otypes=[float, float])


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Enclosure:
    """Intervals that contain the true values of a result.

    Attributes:
        urdfkin: urdfkin's result.
        pinocchio: Pinocchio's result, or None if Pinocchio has no result.
    """

    quantity: str
    lower: FloatArray
    upper: FloatArray
    urdfkin: FloatArray
    pinocchio: FloatArray | None

    @property
    def width(self) -> FloatArray:
        """Width `upper - lower` of each interval.

        The width is 0 only if the true value is a double.
        A width above 0 is at least the distance between two neighbouring doubles.
        """
        return self.upper - self.lower

    def contains(self, x: ArrayLike) -> NDArray[np.bool_]:
        """Return whether each number of `x` is inside its interval.

        Raises:
            InputError: `x` has the wrong shape.
        """
        x = self._check_shape(x)
        return (self.lower <= x) & (x <= self.upper)

    def error_bound(self, x: ArrayLike) -> FloatArray:
        """Return an upper bound on |x - true value|.

        Raises:
            InputError: `x` has the wrong shape.
        """
        x = self._check_shape(x)
        farthest = np.maximum(np.abs(x - self.lower), np.abs(self.upper - x))
        return np.where(farthest > 0.0, np.nextafter(farthest, np.inf), 0.0)

    def _check_shape(self, x: ArrayLike) -> FloatArray:
        x = as_floats(x, f"the {self.quantity}")
        if x.shape != self.lower.shape:
            raise InputError(f"the {self.quantity} has the shape {self.lower.shape}", found=f"{x.shape}")
        return x

    def __str__(self) -> str:
        inside = f"{self.contains(self.urdfkin).sum()} numbers of urdfkin"
        if self.pinocchio is not None:
            inside += f", {self.contains(self.pinocchio).sum()} of Pinocchio"
        width = self.width.max(initial=0.0)
        return f"{self.quantity}: {self.lower.size} intervals, at most {width:.1e} wide; inside: {inside}"

    def __repr__(self) -> str:
        return f"<Enclosure {self}>"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Enclosures:
    """Intervals that contain the true quantities of a frame.

    Each quantity has the shape and the unit of the `Robot` method's result.
    The ends of the intervals are rounded outward to doubles.

    Attributes:
        digits: Decimal digits of the interval arithmetic.
    """

    frame: str
    reference: Reference
    digits: int
    placement: Enclosure
    velocity: Enclosure
    acceleration: Enclosure
    jacobian: Enclosure
    jacobian_rate: Enclosure
    hessian: Enclosure | None = None

    def __str__(self) -> str:
        quantities = [self.placement, self.velocity, self.acceleration, self.jacobian, self.jacobian_rate]
        quantities += [] if self.hessian is None else [self.hessian]
        head = f"{log_line(self.frame)} in {self.reference.name.lower()}, proven with {self.digits} digits"
        return "\n  ".join((head, *map(str, quantities)))

    def __repr__(self) -> str:
        return f"<Enclosures {self}>"


def enclose(
    verifier: Verifier,
    plan_of: Callable[[Sequence[int]], CompiledTree],
    inputs: tuple[ConfigurationLike, ConfigurationLike, ConfigurationLike],
    frame: str,
    reference: Reference | str,
    base: BaseMotion | None,
    digits: int | None,
    *,
    hessian: bool = False,
) -> Enclosures:
    if digits is not None:
        digits = as_int(digits, "digits", MIN_DIGITS, MAX_DIGITS)
    tree = verifier.tree
    call = Call(tree, plan_of, as_str(frame, "frame"), reference, base, inputs)
    if call.shape:
        raise InputError(
            "an enclosure needs one sample",
            found=f"a batch of shape {call.shape}",
            remedy="give q (nq,), v and a (nv,), and the base of one sample",
        )
    for x, name in zip(inputs, "qva", strict=True):
        parse_finite(tree, x, name)
    link, part = call.links[0], call.select(slice(0, 1))
    path = tree.path(link)
    digits = digits or enough_digits(len(path))
    with precision(digits):
        motion = compute_motion(
            tree,
            read_exact_joints(verifier.text, tree, path),
            *(batch[0] for batch in part.query.inputs),
            base=None if base is None else make_base_state(base),
        )
        quantities = [PLACEMENT, VELOCITY, ACCELERATION, JACOBIAN, JACOBIAN_RATE]
        quantities += [HESSIAN] if hessian else []
        bounds = [
            (quantity, *_round_ends(quantity.enclose(motion, link, call.reference)))
            for quantity in quantities
        ]
    oracle = None if verifier.find_refusal(base) else verifier.oracle(base)

    def make_enclosure(quantity: Quantity, lower: FloatArray, upper: FloatArray) -> Enclosure:
        ours = freeze(compute_own_results(quantity, part)[0, 0])
        theirs = (
            None if oracle is None else freeze(compute_oracle_results(quantity, oracle, part.query)[0, 0])
        )
        return Enclosure(quantity.name, freeze(lower), freeze(upper), ours, theirs)

    return Enclosures(frame, call.reference, digits, *(make_enclosure(*row) for row in bounds))
