"""Compare exported expressions with Pinocchio, and make the test vectors of an exported file.

The test vectors check the file, and also the user's compiler, language version and libraries:

| Part | Numbers |
|---|---|
| inputs | single-precision numbers, equal in both precisions |
| results | true values at fifty digits, from the URDF's decimals |
| tolerances | bounds on the rounding errors of a correct computation, in eps |

    eps = 2^-52 in double precision
    eps = 2^-23 in single precision
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass
from decimal import ROUND_CEILING, ROUND_FLOOR, Decimal, localcontext

import numpy as np

from urdfkin.compiled.plan import CompiledTree
from urdfkin.export.function import Function, single_bounds
from urdfkin.export.naming import comment_name, comment_text
from urdfkin.kinematics.roundings import EPS, SINGLE_EPS, SMALLEST_NORMAL
from urdfkin.model.configuration import draw_samples
from urdfkin.model.recursion import Number
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray
from urdfkin.system.lazy_import import urdfkin_version
from urdfkin.verify.bounds import DecimalErrors, true_value_magnitudes
from urdfkin.verify.call import Call, CallPart
from urdfkin.verify.certificate import Certificate
from urdfkin.verify.exact.numbers import (
    REFERENCE_DIGITS,
    as_interval,
    conversion_errors,
    enough_digits,
    precision,
    read_exact_joints,
)
from urdfkin.verify.exact.recursion import compute_motion
from urdfkin.verify.verifier import Verifier

#: Number of random configurations at which Pinocchio checks the results. Pinocchio also checks the results at
#: the zero configuration and at the lower and upper limits.
PROOF_SAMPLES = 100
VECTOR_COUNT = 4


@dataclass(frozen=True)
class ExportVector:
    """One configuration with its true results.

    Attributes:
        tolerances: Bounds in double precision, in eps = 2^-52.
        single_tolerances: Bounds in single precision, in eps = 2^-23. The bound is 0.0 if single precision
            overflows.
    """

    inputs: tuple[list[float], ...]
    results: dict[str, list[str]]
    tolerances: dict[str, list[str]]
    single_tolerances: dict[str, list[str]]


@dataclass(frozen=True)
class Proof:
    """Test vectors and comparison with Pinocchio.

    Attributes:
        single_precision_bounds: Largest bound of each quantity, in eps * scale. The scale is an upper bound
            on the sum of |term| over a number's terms. The bound is inf if single precision overflows.
        lock: Names and values of locked joints.
    """

    sha256: str
    urdfkin: str
    certificate: Certificate
    vectors: tuple[ExportVector, ...]
    single_precision_bounds: dict[str, float]
    lock: tuple[tuple[str, float], ...] = ()

    @property
    def precision_text(self) -> str:
        return "in double precision"

    @property
    def constants_text(self) -> str:
        return ""

    @property
    def lines(self) -> list[str]:
        oracle = comment_text(self.certificate.oracle)
        if not self.certificate.verified:
            reasons = comment_text("; ".join(self.certificate.not_verified)) or "nothing was checked"
            verdict = [f"UNVERIFIED by {oracle}: {reasons}"]
        else:
            verdict = [f"Verified by {oracle}, the expressions below evaluated {self.precision_text}:"] + [
                f"  {line.quantity}: {line.checked} configurations, worst disagreement {line.worst:.2g}"
                f" eps*scale, {line.bound_ratio:.2%} of the bound"
                for line in self.certificate.lines
            ]
        return [
            *verdict,
            *self._single_lines,
            f"URDF sha256 {self.sha256}",
            *(f"Joint {comment_name(name)} is locked at {value!r}" for name, value in self.lock),
            f"Written by urdfkin {self.urdfkin}{self._vectors_text}",
            *([self.constants_text] if self.constants_text else []),
        ]

    @property
    def _vectors_text(self) -> str:
        return (
            f"; {len(self.vectors)} test vectors at {REFERENCE_DIGITS} digits below" if self.vectors else ""
        )

    @property
    def _single_lines(self) -> list[str]:
        beyond = [name for name, k in self.single_precision_bounds.items() if not np.isfinite(k)]
        bounds = ", ".join(
            f"{name} {k:.3g}" for name, k in self.single_precision_bounds.items() if name not in beyond
        )
        lines = [
            "Error bounds in single precision, with rounded constants; unit eps*scale, eps = 2^-23:",
            f"  {bounds}",
        ]
        return [
            *(lines if bounds else []),
            *(f"Single precision cannot represent a number of {name}" for name in beyond),
        ]


def make_proof(
    verifier: Verifier,
    plan_of: Callable[[Sequence[int]], CompiledTree],
    frame: str,
    reference: Reference,
    functions: Sequence[Function],
    verify: bool | None,
) -> Proof:
    certificate = compare_with_pinocchio(
        verifier, plan_of, frame, reference, functions, Function.evaluate, verify
    )
    vectors, bounds = _make_vectors(verifier, plan_of, frame, reference, functions)
    return Proof(
        sha256=hashlib.sha256(verifier.text.encode()).hexdigest(),
        urdfkin=urdfkin_version(),
        certificate=certificate,
        vectors=vectors,
        single_precision_bounds=bounds,
        lock=verifier.origin.lock,
    )


def compare_with_pinocchio(
    verifier: Verifier,
    plan_of: Callable[[Sequence[int]], CompiledTree],
    frame: str,
    reference: Reference,
    functions: Sequence[Function],
    evaluate: Callable[[Function, Sequence[FloatArray]], FloatArray],
    verify: bool | None,
) -> Certificate:
    # Use a copy of the verifier, because `Robot.certificate` must not count the checks of exported code.
    checker = copy(verifier)
    samples = draw_samples(verifier.tree, PROOF_SAMPLES, np.random.default_rng(0), with_zero_and_limits=True)
    for function in functions:
        inputs = (samples.q, samples.v, samples.a)[: len(function.inputs)]
        call = Call(verifier.tree, plan_of, frame, reference, None, inputs)
        found = evaluate(function, (call.q, *call.rates))
        checker.check(function.quantity, call, found, bool(checker.resolve_policy(verify)))
    return checker.certificate()


def _make_vectors(
    verifier: Verifier,
    plan_of: Callable[[Sequence[int]], CompiledTree],
    frame: str,
    reference: Reference,
    functions: Sequence[Function],
) -> tuple[tuple[ExportVector, ...], dict[str, float]]:
    tree = verifier.tree
    link = tree.frame_link(frame)
    samples = draw_samples(tree, VECTOR_COUNT, np.random.default_rng(1), with_zero_and_limits=False)
    inputs = tuple(x.astype(np.float32).astype(np.float64) for x in (samples.q, samples.v, samples.a))
    part = Call(tree, plan_of, frame, reference, None, inputs).select(slice(0, VECTOR_COUNT))
    tolerances, single_tolerances, largest_bounds = (
        dict[str, FloatArray](),
        dict[str, FloatArray](),
        dict[str, float](),
    )
    path, vectors = tree.path(link), []
    errors = conversion_errors(verifier.text, tree, path, part.q)
    for f in functions:
        tolerances[f.name], scale = _tolerances_and_scales(f, part, errors)
        single_tolerances[f.name] = single_bounds(f, inputs) + EPS / SINGLE_EPS * tolerances[f.name]
        relative_bounds = np.divide(
            single_tolerances[f.name], scale, out=np.zeros_like(scale), where=scale > 0.0
        )
        largest_bounds[f.name] = float(relative_bounds.max(initial=0.0))
    with precision(REFERENCE_DIGITS + enough_digits(len(path))):
        joints = read_exact_joints(verifier.text, tree, path)
        for k in range(VECTOR_COUNT):
            motion = compute_motion(tree, joints, *(x[k] for x in inputs))
            true = {f.name: f.quantity.enclose(motion, link, reference).ravel() for f in functions}
            vectors.append(
                ExportVector(
                    tuple(x[k].tolist() for x in inputs),
                    {name: [format_decimal(x) for x in values] for name, values in true.items()},
                    {name: [_round_down(x) for x in values[k]] for name, values in tolerances.items()},
                    {name: [_round_up(x) for x in values[k]] for name, values in single_tolerances.items()},
                )
            )
    return tuple(vectors), largest_bounds


def _tolerances_and_scales(
    function: Function, part: CallPart, errors: DecimalErrors
) -> tuple[FloatArray, FloatArray]:
    """Return the bounds (in eps) and the scales of n samples, as arrays (n, numbers per sample)."""
    v, a = (*part.rates, None, None)[:2]
    size = true_value_magnitudes(part.plan, part.q, v, a, errors)
    bound, n = function.quantity.bound(part.plan, size, part.reference), len(part.q)
    scale = np.where(bound.scale > 0.0, np.maximum(bound.scale, SMALLEST_NORMAL), 0.0)
    shape = (n, 1, *function.shape)
    tolerances, scale = (np.broadcast_to(x, shape).reshape(n, -1) for x in (scale * bound.k, scale))
    return tolerances, scale


def format_decimal(x: Number) -> str:
    """Return an interval's midpoint as decimal text with at most `REFERENCE_DIGITS` digits.

    Return "0.0" for an interval that contains 0, or if the midpoint rounds to the double 0.
    """
    ball = as_interval(x)
    # C compilers warn about a nonzero decimal that rounds to 0.
    if ball.contains(0) or float(ball) == 0.0:
        return "0.0"
    digits, e, exponent = ball.str(REFERENCE_DIGITS, radius=False).partition("e")
    whole, _, fraction = digits.partition(".")
    return f"{whole}.{fraction.rstrip('0') or '0'}{e}{exponent}"


def _round_down(x: float) -> str:
    return _round(x, 6, ROUND_FLOOR)


def _round_up(x: float) -> str:
    """Round a bound up.

    A smaller bound could reject a correct result, because a rounded constant's error can equal the bound.
    """
    return _round(x, 7, ROUND_CEILING)


def _round(x: float, digits: int, rounding: str) -> str:
    if not np.isfinite(x):
        return "0.0"  # With a bound of 0, the self-test accepts only equal numbers.
    with localcontext(prec=digits, rounding=rounding):
        return f"{float(+Decimal(x)):.{digits}g}"
