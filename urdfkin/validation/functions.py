"""Compare a user's function with urdfkin and the oracle.

The user's function computes a quantity from q, from q and v, or from q, v and a. The function is called at
random configurations, at the zero configuration and at the joint limits. The allowed difference is a derived
bound on rounding errors. If urdfkin and the oracle agree, but the function disagrees with urdfkin, the error
is in the function.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from urdfkin.errors import DegreesWarning, InputError
from urdfkin.errors.display import Displayable, Table, TextDocument
from urdfkin.errors.validators import (
    as_bool,
    as_choice,
    as_finite_float,
    as_instance,
    as_int,
    as_str,
    safe_repr,
)
from urdfkin.kinematics.roundings import EPS
from urdfkin.model.configuration import draw_samples
from urdfkin.model.conventions import Convention
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.system.documents import as_json_data
from urdfkin.validation.diagnosis import DiagnosisCase, Mistakes, as_tuple, diagnose
from urdfkin.verify.bounds import broadcast_k
from urdfkin.verify.comparison import bound_ratios, disagreement
from urdfkin.verify.oracles import package_versions
from urdfkin.verify.quantities import ACCELERATION_BREAKDOWN, Quantity
from urdfkin.verify.quantities import find_quantity as quantity_of
from urdfkin.verify.verifier import Verifier, compute_bound, compute_oracle_results_with_bound

if TYPE_CHECKING:
    from urdfkin.model.conventions import Conversion
    from urdfkin.verify.call import Call

_BATCH_SIZE = 256
#: Maximum number of random configurations, because more do not fit in memory.
_MAX_SAMPLES = 10**9
_DIAGNOSIS_SAMPLES = 48
_MAX_MESSAGES = 5
#: Largest relative difference that single precision can cause.
_MAX_SINGLE_PRECISION_ERROR = 1e-5


@dataclass(frozen=True)
class FunctionError:
    """The user's function failed, or returned an invalid result."""

    sample: int
    message: str


@dataclass(frozen=True, eq=False)
class WorstResult:
    """The result with the largest ratio of difference to bound.

    Attributes:
        sample: Index of the configuration.
        inputs: The function's inputs: q, or q and v, or q, v and a.
        bound: Allowed difference of each number: the bound on rounding errors times `FunctionCheck.factor`.
        replay: A command or a line of Python that computes the expected result.
    """

    sample: int
    inputs: tuple[FloatArray, ...]
    actual: FloatArray
    expected: FloatArray
    bound: FloatArray
    replay: str

    def describe_largest(self, rows: Sequence[str], columns: Sequence[str]) -> str:
        """Describe the number with the largest ratio of difference to bound."""
        with np.errstate(all="ignore"):
            ratios = np.abs(self.actual - self.expected) / np.maximum(self.bound, np.finfo(float).tiny)
        flat_index = int(np.nan_to_num(ratios, nan=np.inf).argmax())
        index = tuple(int(i) for i in np.unravel_index(flat_index, ratios.shape))
        names = [rows[index[0]], *(columns[k] if columns else f"column {k}" for k in index[1:])]
        return (
            f"The number {', '.join(names)} is {self.actual[index]:.17g}; {self.expected[index]:.17g} was"
            f" expected, within {self.bound[index]:.2g}."
        )


@dataclass(frozen=True)
class FunctionCheck(Displayable):
    """Result of `verify_function`: the user's function compared with urdfkin and with the oracle.

    Attributes:
        function: Name of the function.
        robot: Name of the robot.
        quantity: Name of the quantity.
        frame: Name of the frame.
        reference: Name of the reference frame; None if the quantity has no reference frame.
        convention: Name of the convention of inputs and results; None: urdfkin's convention.
        oracle: Name and version of the oracle that confirmed urdfkin's results; "" if no oracle could check
            urdfkin's results.
        samples: Number of configurations.
        compared: Number of results that are real numbers in the right shape, NaN included.
        factor: Number by which each bound is multiplied.
        eps_scale: Largest difference in multiples of eps * scale.
        bound_ratio: Largest difference from urdfkin's result, as a multiple of the allowed difference. The
            ratio is at most 1 if all results agree.
        oracle_bound_ratio: Largest difference from the oracle's result, as a multiple of the allowed
            difference. None without an oracle.
        rows: The `bound_ratio` of each row, for example {"vx": 0.2}.
        columns: The `bound_ratio` of each column of a Jacobian. The keys are names of joint velocities. Empty
            for a result without such columns, for example a placement.
        worst: The worst result; None if no number was compared.
        errors: Number of configurations with an exception, or without real numbers in the right shape.
        first_errors: At most five exceptions and invalid results, with messages.
        diagnoses: Possible causes of the differences: mistakes in the function, rounding, or results that are
            not finite. Each mistake, or pair of mistakes, explains all results, or one column of a Jacobian.

    >>> import urdfkin
    >>> arm = urdfkin.load("planar_two_link")
    >>> check = urdfkin.verify_function(lambda q: arm.jacobian(q, "tip")[[3, 4, 5, 0, 1, 2]], arm)
    >>> check.agrees, check.diagnoses
    (False, ('the angular rows come first; urdfkin has the linear rows first',))
    """

    function: str
    robot: str
    quantity: str
    frame: str
    reference: str | None
    convention: str | None
    oracle: str
    samples: int
    compared: int
    factor: float
    eps_scale: float
    bound_ratio: float
    oracle_bound_ratio: float | None
    rows: dict[str, float]
    columns: dict[str, float]
    worst: WorstResult | None
    errors: int
    first_errors: tuple[FunctionError, ...]
    diagnoses: tuple[str, ...]

    @property
    def agrees(self) -> bool:
        """Whether every configuration has a valid result, and no difference exceeds `factor` times the bound.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link")
        >>> urdfkin.verify_function(lambda q: arm.jacobian(q, "tip"), arm, samples=5).agrees
        True
        """
        good = self.compared == self.samples and not self.errors and self.bound_ratio <= 1.0
        return good and (self.oracle_bound_ratio is None or self.oracle_bound_ratio <= 1.0)

    @property
    def smallest_factor(self) -> float:
        """The smallest `factor` with which all compared results agree with urdfkin's results.

        >>> import urdfkin
        >>> import numpy as np
        >>> arm = urdfkin.load("planar_two_link")
        >>> single = lambda q: arm.jacobian(q, "tip").astype(np.float32)
        >>> urdfkin.verify_function(single, arm, samples=5).smallest_factor > 1.0
        True
        """
        return self.bound_ratio * self.factor

    def as_dict(self) -> dict[str, Any]:
        """Return plain data for JSON; a value that is not finite becomes null.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link")
        >>> check = urdfkin.verify_function(lambda q: arm.jacobian(q, "tip"), arm, samples=5)
        >>> check.as_dict()["agrees"]
        True
        """
        return {"agrees": self.agrees, **as_json_data(self), "versions": package_versions()}

    def _text_document(self) -> TextDocument:
        of = f"{self.quantity} of {self.frame}" + (f" ({self.reference})" if self.reference else "")
        verdict = "agrees" if self.agrees else "DISAGREES"
        parts: list[str | Table] = [
            f"{self.compared} of {self.samples} results compared"
            + (f"; convention {self.convention}" if self.convention else "")
        ]
        if self.compared:
            parts.append(
                f"Largest difference from urdfkin: {self.eps_scale:.3g} eps*scale, {self.bound_ratio:.3g}"
                f" of the allowed difference (the bound times {self.factor:g})."
            )
        if self.oracle_bound_ratio is None:
            parts.append("urdfkin's results were NOT checked: no oracle can check this robot.")
        elif self.compared:
            parts.append(
                f"Largest difference from {self.oracle}: {self.oracle_bound_ratio:.3g} of the allowed"
                " difference."
            )
        if self.errors:
            configurations = "configuration" if self.errors == 1 else "configurations"
            parts.append(f"{self.errors} {configurations} without a usable result; the first ones:")
            parts += self._list_first_errors()
        if not self.agrees:
            parts += [f"Diagnosis: {words}." for words in self.diagnoses]
        if not self.agrees and self.worst is not None:
            parts += self._describe_worst(self.worst)
        return TextDocument(f"{self.function}: {verdict} on the {of} of {self.robot}", parts)

    def _list_first_errors(self) -> Iterator[str]:
        for message in dict.fromkeys(error.message for error in self.first_errors):
            samples = [str(error.sample) for error in self.first_errors if error.message == message]
            yield f"  sample{'s' if len(samples) > 1 else ''} {', '.join(samples)}: {message}"

    def _describe_worst(self, worst: WorstResult) -> Iterator[str | Table]:
        for title, ratios in (("row", self.rows), ("column", self.columns)):
            wrong = [(name, f"{ratio:.3g}") for name, ratio in ratios.items() if not ratio <= 1.0]
            if wrong and len(wrong) < len(ratios):
                yield Table((title, "of the bound"), wrong)
            elif wrong:
                yield f"Every {title} differs."
        yield worst.describe_largest(tuple(self.rows), tuple(self.columns))
        yield f"Worst result: sample {worst.sample}, with"
        for letter, values in zip("qva", worst.inputs, strict=False):
            yield f"  {letter} = [{', '.join(map(repr, values.tolist()))}]"
        yield f"  the expected result: {worst.replay}"


class _RecordingVerifier:
    """A verifier that stores the latest call of each quantity."""

    def __init__(self, verifier: Verifier) -> None:
        self._verifier = verifier
        self.calls: dict[str, Call] = {}

    def __getattr__(self, name: str) -> Any:
        return getattr(self._verifier, name)

    def check(self, row: Quantity, call: Call, result: FloatArray, verify: object) -> None:
        self.calls[row.name] = call
        self._verifier.check(row, call, result, cast("Any", verify))


def verify_function(
    function: Callable[..., object],
    robot: Robot,
    quantity: str = "jacobian",
    *,
    frame: str | None = None,
    reference: Reference | str = Reference.LOCAL_WORLD_ALIGNED,
    convention: str | Path | Convention | None = None,
    samples: int = 1000,
    seed: int = 0,
    factor: float = 1.0,
    batch: bool = False,
    **options: Any,
) -> FunctionCheck:
    """Compare the results of your function with the results of urdfkin and of the oracle.

    The allowed difference is a derived bound on rounding errors. The function receives q (nq,) for all
    quantities, and v (nv,) and a (nv,) for some quantities. Without `convention`, the units are rad, m and s.
    The values are random within the limits; the zero configuration and the joint limits come first. In every
    eighth sample, v and a are a hundred times larger, so that quadratic terms have a visible effect.
    Exceptions and wrong shapes are reported, and do not end the check.

    Args:
        function: The function to check: q -> result, (q, v) -> result or (q, v, a) -> result.
        robot: The robot whose kinematics the function computes.
        quantity: Name of the quantity: "placement", "velocity", "jacobian", "jacobian rate", "hessian",
            "acceleration", "relative placement", "analytical jacobian" or "imu".
        frame: Name of a link or joint; None: the default tip, `robot.tip_frame`.
        reference: Reference frame of the result.
        convention: Convention of the function's inputs and results, in a form that `Robot.convention`
            accepts. None: urdfkin's convention.
        samples: Number of random configurations.
        seed: Seed of the random configurations.
        factor: The allowed difference is the bound on rounding errors times this factor. The bound is derived
            for a recursion from joint to joint. For a method with larger rounding errors, give a factor above
            1. `FunctionCheck.smallest_factor` is the smallest `factor` with which all compared results agree
            with urdfkin's.
        batch: If True, the function computes n configurations in one call, and returns n results. The
            function receives q (n, nq), v (n, nv) and a (n, nv).
        **options: Further arguments of the `Robot` method that computes the quantity, such as
            `representation`.

    Returns:
        The result; `print` shows it. In a test: `assert check.agrees, check`.

    Raises:
        UnknownNameError: urdfkin does not know the quantity, the frame or the convention.
        InputError: an argument is invalid, or urdfkin cannot check the quantity in this convention.
        VerificationError: urdfkin and the oracle disagree.

    >>> import urdfkin
    >>> import numpy as np
    >>> arm = urdfkin.load("planar_two_link")
    >>> def tip_jacobian(q):  # links of 0.5 m and 0.4 m
    ...     s, c = np.sin([q[0], q[0] + q[1]]), np.cos([q[0], q[0] + q[1]])
    ...     J = np.zeros((6, 2))
    ...     J[:2] = [[-0.5 * s[0] - 0.4 * s[1], -0.4 * s[1]], [0.5 * c[0] + 0.4 * c[1], 0.4 * c[1]]]
    ...     J[5] = 1.0
    ...     return J
    >>> check = urdfkin.verify_function(tip_jacobian, arm, "jacobian", frame="tip", samples=100)
    >>> check.agrees
    True
    """
    if not callable(function):
        raise InputError(
            "the function to check must be callable",
            found=safe_repr(function),
            remedy="give a function that takes q, or q, v and a",
        )
    as_instance(robot, Robot, "robot", "call urdfkin.load")
    row = quantity_of(as_str(quantity, "quantity"))
    if row.object_kind != "frames" or row is ACCELERATION_BREAKDOWN:
        raise InputError(
            "urdfkin cannot check functions that compute this quantity",
            found=quantity,
            remedy="give the name of a quantity of one frame, such as placement or jacobian",
        )
    run = _Run(
        function,
        robot,
        row,
        as_choice(frame, robot.tip_frame, "frame"),
        None if not row.has_reference else Reference.of(reference),
        as_int(samples, "samples", 0, _MAX_SAMPLES),
        as_int(seed, "seed", 0),
        as_finite_float(factor, "factor"),
        as_bool(batch, "batch"),
        options,
    )
    if not run.factor > 0.0:
        raise InputError("factor must be positive", found=safe_repr(factor))
    run.conversion = None if convention is None else robot.convention(convention)
    return run.check()


@dataclass
class _FunctionResults:
    """Results for a batch. The function returned a valid result for n configurations of the batch.

    Attributes:
        first: Index of the batch's first configuration in the whole check.
        inputs: Inputs of the whole batch, in the function's convention.
        valid_indices: (n,) indices in the batch.
        actual: (n, ...) results of the user's function.
        expected: (n, ...) results of urdfkin.
        scale: (n, ...) scales of the results. The allowed difference is k * eps * scale.
        k: (n,) products of `FunctionCheck.factor` and the bound of a result.
    """

    first: int
    inputs: tuple[FloatArray, ...]
    valid_indices: list[int]
    actual: FloatArray
    expected: FloatArray
    scale: FloatArray
    k: FloatArray
    oracle_results: FloatArray | None

    def bound_ratios(self, other: FloatArray) -> FloatArray:
        k = self.k.reshape(-1, *[1] * (self.actual.ndim - 1))
        return bound_ratios(self.units(other), k)

    def units(self, other: FloatArray) -> FloatArray:
        return disagreement(self.actual, other, self.scale)


@dataclass
class _Run:
    function: Callable[..., object]
    robot: Robot
    row: Quantity
    frame: str
    reference: Reference | None
    samples: int
    seed: int
    factor: float
    batch: bool
    options: dict[str, Any]
    conversion: Conversion | None = None

    def __post_init__(self) -> None:
        self.recording_verifier = _RecordingVerifier(self.robot.verifier)
        self.recording_robot = copy(self.robot)
        self.recording_robot.verifier = cast("Verifier", self.recording_verifier)

    def check(self) -> FunctionCheck:
        robot = self.robot
        drawn = draw_samples(
            robot.tree, self.samples, np.random.default_rng(self.seed), with_zero_and_limits=True
        )
        total = _Total(self._list_row_names(), self._list_column_names())
        has_oracle = robot.verifier.find_refusal(None, robot.verifier.library) is None
        for first in range(0, len(drawn.q), _BATCH_SIZE):
            part = slice(first, first + _BATCH_SIZE)
            total.add(
                self._compute_batch(first, (drawn.q[part], drawn.v[part], drawn.a[part]), total, has_oracle)
            )
        return self._make_check(total, len(drawn.q), has_oracle)

    def _make_check(self, total: _Total, samples: int, has_oracle: bool) -> FunctionCheck:
        robot = self.robot
        diagnoses: tuple[str, ...] = ()
        if total.bound_ratio > 1.0 or total.errors:
            diagnoses = tuple(self._find_diagnoses(total))
        worst = total.worst
        if worst is not None:
            worst = replace(worst, replay=self._make_replay_line(self._to_native_inputs(worst.inputs)))
        return FunctionCheck(
            getattr(self.function, "__name__", type(self.function).__name__),
            robot.name,
            self.row.name,
            self.frame,
            None if self.reference is None else self.reference.name.lower(),
            None if self.conversion is None else self.conversion.convention.name,
            robot.certificate().oracle if has_oracle else "",
            samples,
            total.compared,
            self.factor,
            total.eps_scale,
            total.bound_ratio,
            total.oracle_bound_ratio if has_oracle else None,
            dict(zip(total.row_names, total.by_row.tolist(), strict=True)),
            dict(zip(total.column_names, total.by_column.tolist(), strict=True)),
            worst,
            total.errors,
            tuple(total.first_errors),
            diagnoses,
        )

    # -- the two results -----------------------------------------------------------------------------

    def compute_expected(
        self,
        inputs: Sequence[FloatArray],
        frame: str | Sequence[str] | None = None,
        reference: Reference | None = None,
    ) -> FloatArray:
        """Compute unverified results in the function's convention."""
        native_inputs = self._to_native_inputs(inputs)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DegreesWarning)  # A diagnosis tries q in degrees.
            found = self._call_method(self.robot, native_inputs, frame or self.frame, reference, verify=False)
            return self._convert_result(native_inputs, found, frame, reference)

    def _compute_batch(
        self, first: int, drawn: tuple[FloatArray, ...], total: _Total, has_oracle: bool
    ) -> _FunctionResults:
        row = self.row
        native_inputs = drawn[: len(row.inputs)]
        result = self._call_method(self.recording_robot, native_inputs, self.frame, None, verify=has_oracle)
        call = self.recording_verifier.calls[row.name]
        with_frame_axis = result[:, None]
        part = call.select(slice(0, call.n))
        oracle_results, bound = None, None
        if has_oracle:
            oracle = self.robot.verifier.oracle(call.base, self.robot.verifier.library)
            oracle_results, bound = compute_oracle_results_with_bound(
                row, oracle, part, with_frame_axis, self.robot.verifier.library
            )
        else:
            bound = compute_bound(row, part)
        scale = np.broadcast_to(bound.scale, with_frame_axis.shape)[:, 0]
        k = broadcast_k(bound, with_frame_axis.shape[:2])[:, 0] * self.factor
        expected = self._convert_result(native_inputs, result)
        inputs: tuple[FloatArray, ...] = native_inputs
        if self.conversion is not None:
            inputs = as_tuple(self.conversion.to(*native_inputs))
            scale = self._convert_scale(native_inputs, scale)
            k = k + self._compute_conversion_k(native_inputs[0]) * self.factor
        actual, valid = self._call_function(inputs, expected.shape[1:], first, total)
        if oracle_results is not None:
            oracle_results = self._convert_result(native_inputs, np.asarray(oracle_results)[:, 0])[valid]
        return _FunctionResults(
            first, inputs, valid, actual, expected[valid], scale[valid], k[valid], oracle_results
        )

    def _call_method(
        self,
        robot: Robot,
        native_inputs: Sequence[FloatArray],
        frame: str | Sequence[str],
        reference: Reference | None,
        *,
        verify: bool,
    ) -> FloatArray:
        reference = self.reference if reference is None else reference
        reference_argument = {} if self.reference is None else {"reference": reference}
        method = getattr(robot, self.row.method)
        result: FloatArray = method(
            *native_inputs, frame=frame, verify=verify, **reference_argument, **self.options
        )
        return result

    def _to_native_inputs(self, inputs: Sequence[FloatArray]) -> tuple[FloatArray, ...]:
        return tuple(inputs) if self.conversion is None else as_tuple(self.conversion.from_(*inputs))

    def _convert_result(
        self,
        native_inputs: Sequence[FloatArray],
        result: FloatArray,
        frame: str | Sequence[str] | None = None,
        reference: Reference | None = None,
    ) -> FloatArray:
        if self.conversion is None:
            return result
        reference = self.reference if reference is None else reference
        reference = Reference.LOCAL_WORLD_ALIGNED if reference is None else reference
        jacobian = partial(
            self.robot.jacobian, native_inputs[0], frame or self.frame, reference, verify=False
        )
        return self.conversion.convert_result(self.row.name, native_inputs, result, jacobian)

    def _convert_scale(self, native_inputs: Sequence[FloatArray], scale: FloatArray) -> FloatArray:
        """Convert the scale of a bound to the function's convention.

        A Jacobian is multiplied from the right by `conversion.inverse_matrix`. Therefore, the scale is
        multiplied by the absolute values of this matrix.
        """
        conversion, name = self.conversion, self.row.name
        assert conversion is not None
        if name == "placement":
            return scale
        scale = conversion.reorder_six_vector(scale, 1)
        if name in ("velocity", "acceleration"):
            return scale
        if not conversion.is_constant and name != "jacobian":
            raise InputError(
                f"urdfkin has no bound for the {name}: in this convention, the velocity of a floating or"
                " planar joint has other axes",
                where=conversion.convention.name,
                remedy="check the Jacobian in this convention, or use urdfkin's convention",
            )
        inverse = np.abs(conversion.inverse_matrix(native_inputs[0]))
        converted: FloatArray = np.asarray(
            scale @ inverse if name != "hessian" else np.einsum("nrkl,ki,lj->nrij", scale, inverse, inverse)
        )
        return converted

    def _compute_conversion_k(self, q: FloatArray) -> float:
        """Return the factor k; the rounding error of the conversion is at most k * eps * scale.

        Reordering has no rounding errors. A conversion of angles, for example from radians to degrees, has
        these errors:

        - The error of an angle and of its rotation matrix is at most 2 eps |q|.
        - The error of a vector is at most the sum of the errors of all rotation matrices.
        - A term of a result is a product of `row.factors` vectors.
        - The velocity conversion of a planar or floating joint has an error of at most 16 eps.
        """
        conversion, row = self.conversion, self.row
        assert conversion is not None
        if conversion.permutation is not None and conversion.velocity_permutation is not None:
            return 0.0
        return 16.0 + 2.0 * row.factors * len(self.robot.tree.joints) * float(np.abs(q).max(initial=1.0))

    def _call_function(
        self, inputs: tuple[FloatArray, ...], shape: tuple[int, ...], first: int, total: _Total
    ) -> tuple[FloatArray, list[int]]:
        """Return the valid results, and their indices in the batch."""
        n = len(inputs[0])
        if self.batch:
            array = _try_call(self.function, [x.copy() for x in inputs], (n, *shape), first, total, n)
            return (np.zeros((0, *shape)), []) if array is None else (array, list(range(n)))
        found = dict[int, FloatArray]()
        for k in range(n):
            array = _try_call(self.function, [x[k].copy() for x in inputs], shape, first + k, total, 1)
            if array is not None:
                found[k] = array
        return np.array(list(found.values())).reshape(len(found), *shape), list(found)

    # -- explanations --------------------------------------------------------------------------------

    def _find_diagnoses(self, total: _Total) -> Iterator[str]:
        if total.wrong_shapes and not total.compared:
            shape = next(iter(total.wrong_shapes))
            if len(shape) > 1 and shape == total.shape[::-1]:
                yield f"the result is transposed: its shape is {shape} in place of {total.shape}"
            return
        if (first_batch := total.first_batch) is None:
            return
        if total.not_finite:
            yield f"{total.not_finite} {'result is' if total.not_finite == 1 else 'results are'} not finite"
            return
        if total.bound_ratio <= 1.0:
            return
        if total.eps_scale * EPS <= _MAX_SINGLE_PRECISION_ERROR and math.isfinite(total.bound_ratio):
            precision = "single" if total.eps_scale * EPS > 1e-9 else "double"
            yield (
                f"rounding in {precision} precision explains all differences: the largest difference is"
                f" {total.eps_scale * EPS:.1g} times the size of the terms;"
                f" factor={math.ceil(total.bound_ratio * self.factor)} accepts them"
            )
            return
        mistakes = Mistakes(self.robot, self.row, self.frame, self.reference, self.conversion, self.options)
        first = slice(_DIAGNOSIS_SAMPLES)
        inputs = tuple(x[first_batch.valid_indices[first]] for x in first_batch.inputs)
        case = DiagnosisCase(
            inputs,
            first_batch.actual[first],
            first_batch.expected[first],
            first_batch.scale[first],
            self.compute_expected,
        )
        yield from diagnose(mistakes, case)

    def _make_replay_line(self, native_inputs: tuple[FloatArray, ...]) -> str:
        call = copy(self.recording_verifier.calls[self.row.name])
        q, *rates = (x[None] for x in native_inputs)
        call.q, call.rates, call.shape, call.n = q, rates, (1,), 1
        return self.robot.verifier._make_replay_line(self.row, call, 0, self.frame)

    def _list_row_names(self) -> tuple[str, ...]:
        row = self.row
        angular_first = self.conversion is not None and self.conversion.angular_first
        labels = row.labels[3:] + row.labels[:3] if angular_first and len(row.labels) == 6 else row.labels
        nv = (self.conversion or self.robot).nv
        return labels or tuple(f"row {k}" for k in range(row.result_shape(nv)[0]))

    def _list_column_names(self) -> tuple[str, ...]:
        if not self.row.has_columns:
            return ()
        return (self.conversion or self.robot).velocity_names


@dataclass
class _Total:
    row_names: tuple[str, ...]
    column_names: tuple[str, ...]
    compared: int = 0
    not_finite: int = 0
    eps_scale: float = 0.0
    bound_ratio: float = 0.0
    oracle_bound_ratio: float = 0.0
    errors: int = 0
    first_errors: list[FunctionError] = field(default_factory=list)
    wrong_shapes: set[tuple[int, ...]] = field(default_factory=set)
    shape: tuple[int, ...] = ()
    worst: WorstResult | None = None
    first_batch: _FunctionResults | None = None

    def __post_init__(self) -> None:
        self.by_row, self.by_column = np.zeros(len(self.row_names)), np.zeros(len(self.column_names))

    def add_error(self, sample: int, message: str, configurations: int) -> None:
        self.errors += configurations
        if len(self.first_errors) < _MAX_MESSAGES:
            self.first_errors.append(FunctionError(sample, message))

    def add(self, batch: _FunctionResults) -> None:
        self.shape = batch.expected.shape[1:]
        if not batch.valid_indices:
            return
        self.compared += len(batch.valid_indices)
        ratios, units = batch.bound_ratios(batch.expected), batch.units(batch.expected)
        self.eps_scale = max(self.eps_scale, float(units.max(initial=0.0)))
        axes = tuple(range(1, ratios.ndim))
        self.not_finite += int((~np.isfinite(batch.actual).all(axis=axes)).sum())
        result_ratios = ratios.max(axis=axes, initial=0.0)
        self.by_row = np.maximum(self.by_row, ratios.max(axis=(0, *axes[1:]), initial=0.0))
        if len(self.by_column):
            self.by_column = np.maximum(self.by_column, ratios.max(axis=(0, 1, *axes[2:]), initial=0.0))
        if self.first_batch is None:
            self.first_batch = batch
        if batch.actual[0].size and (self.worst is None or result_ratios.max() > self.bound_ratio):
            k = int(result_ratios.argmax())
            self.worst = WorstResult(
                batch.first + batch.valid_indices[k],
                tuple(x[batch.valid_indices[k]] for x in batch.inputs),
                batch.actual[k],
                batch.expected[k],
                EPS * batch.k[k] * batch.scale[k],
                "",
            )
        self.bound_ratio = max(self.bound_ratio, float(result_ratios.max()))
        if batch.oracle_results is not None:
            self.oracle_bound_ratio = max(
                self.oracle_bound_ratio, float(batch.bound_ratios(batch.oracle_results).max(initial=0.0))
            )


def _try_call(
    function: Callable[..., object],
    inputs: list[FloatArray],
    shape: tuple[int, ...],
    sample: int,
    total: _Total,
    configurations: int,
) -> FloatArray | None:
    """Return a copy of the result, or None after an error.

    The result is copied, because the function may reuse its arrays.
    """
    try:
        result = function(*inputs)
        if result is None:
            total.add_error(sample, "the function returns None; is `return` missing?", configurations)
            return None
        array = np.asanyarray(result)
        if np.ma.isMaskedArray(array) or array.dtype.kind not in "fiu":
            kind = "a masked array" if np.ma.isMaskedArray(array) else f"an array of {array.dtype}"
            total.add_error(sample, f"{kind}, expected real numbers", configurations)
            return None
        copied = np.array(array, dtype=np.float64)
    except (Exception, SystemExit) as error:  # The check reports exceptions of the user's code.
        total.add_error(sample, f"{type(error).__name__}: {str(error)[:300]}", configurations)
        return None
    if copied.shape != shape:
        total.wrong_shapes.add(copied.shape)
        total.add_error(sample, f"shape {copied.shape}, expected {shape}", configurations)
        return None
    return copied
