"""Find common mistakes that explain a wrong result of a user's function.

Examples of mistakes are exchanged rows, a wrong reference frame, a wrong frame, degrees instead of radians,
and joints in another order. The module applies each mistake to urdfkin's results, and compares the changed
results with the user's results. Each difference is divided by its scale. A mistake explains the whole result
under this condition:

`max |user's results - changed results| <= max |user's results - urdfkin's results| / 1000`

If no mistake explains the whole result, each Jacobian column is searched for a mistake of its own. The last
step combines each mistake with exchanged linear and angular rows. At most three mistakes are reported.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from urdfkin.errors import UrdfkinError
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray

if TYPE_CHECKING:
    from urdfkin.model.conventions import Conversion
    from urdfkin.robot import Robot
    from urdfkin.verify.quantities import Quantity

#: Largest `DiagnosisCase.remainder` of a mistake that explains the user's results.
EXPLANATION_TOLERANCE = 1e-3
_MAX_REPORTED = 3
#: Number of configurations in a fast first test for exchanged joints.
_FIRST_SAMPLES = 4
#: Smallest scale by which a difference is divided, relative to the largest scale.
_MIN_SCALE = 1e-9
#: Two numbers count as equal if their difference is at most this number times the scale.
_EQUALITY_TOLERANCE = 1e-9
_SWAPPED_HALVES = [3, 4, 5, 0, 1, 2]
_G = 9.81

#: Inputs of a function: q, or q and v, or q, v and a.
Inputs = tuple[FloatArray, ...]


@dataclass(frozen=True)
class DiagnosisCase:
    """Results of the user's function (`actual`) and of urdfkin (`expected`).

    Attributes:
        inputs: q, or q and v, or q, v and a, in the function's convention.
        scale: The bound on the rounding error of each number is k * eps * scale.
        compute: Function that returns urdfkin's results for inputs, a frame and a reference frame.
    """

    inputs: Inputs
    actual: FloatArray
    expected: FloatArray
    scale: FloatArray
    compute: Callable[..., FloatArray]

    def remainder(self, predicted: FloatArray, n: int | None = None) -> float:
        """Return the part of the difference that a mistake does not explain.

        `max |actual - predicted| / max |actual - expected|`

        Each difference is divided by its scale. `predicted` contains urdfkin's results with the mistake, for
        the first n configurations. Return inf if `predicted` is not finite, or if `actual` equals `expected`.
        """
        scale = self._nonzero_scale(n)
        with np.errstate(all="ignore"):
            whole = float((np.abs(self.actual[:n] - self.expected[:n]) / scale).max())
            left = float((np.abs(self.actual[:n] - predicted) / scale).max())
            return left / whole if np.isfinite(left) and whole > 0.0 else np.inf

    def is_expected(self, predicted: FloatArray) -> bool:
        return bool((np.abs(predicted - self.expected) <= _EQUALITY_TOLERANCE * self._nonzero_scale()).all())

    def _nonzero_scale(self, n: int | None = None) -> FloatArray:
        scale: FloatArray = np.maximum(self.scale[:n], _MIN_SCALE * self.scale[:n].max(initial=_MIN_SCALE))
        return scale

    def first_inputs(self, n: int) -> Inputs:
        return tuple(x[:n] for x in self.inputs)


def diagnose(mistakes: Mistakes, case: DiagnosisCase) -> list[str]:
    """Return at most three sentences about the mistakes that explain the results."""
    single, double = list[tuple[float, str]](), list[tuple[float, str]]()
    halves_text = mistakes.exchanged_halves_text
    if halves_text:
        single.append(
            (
                case.remainder(case.expected[:, _SWAPPED_HALVES]),
                f"{halves_text}; {mistakes.halves_order_text}",
            )
        )
    for words, predict in mistakes.all(case):
        try:
            predicted = predict()
        except UrdfkinError:  # This robot cannot have the mistake.
            continue
        if predicted.shape != case.actual.shape or case.is_expected(predicted):
            continue
        single.append((case.remainder(predicted), words))
        if halves_text:
            double.append((case.remainder(predicted[:, _SWAPPED_HALVES]), f"{words}, and {halves_text}"))
    for candidates in (single, list(_find_column_mistakes(mistakes, case)), double):
        best = min((remainder for remainder, _ in candidates), default=np.inf)
        if best <= EXPLANATION_TOLERANCE:
            limit = min(EXPLANATION_TOLERANCE, 100.0 * best + 1e-12)
            return [words for remainder, words in candidates if remainder <= limit][:_MAX_REPORTED]
    return []


#: Description of a mistake, and a function that returns urdfkin's results with this mistake.
Mistake = tuple[str, Callable[[], FloatArray]]


@dataclass(frozen=True)
class Mistakes:
    """Common mistakes in a user's function.

    Attributes:
        options: Further arguments of the `Robot` method that computes the quantity.
    """

    robot: Robot
    row: Quantity
    frame: str
    reference: Reference | None
    conversion: Conversion | None
    options: Mapping[str, Any]

    @property
    def exchanged_halves_text(self) -> str:
        first = "linear" if self._is_angular_first else "angular"
        return f"the {first} rows come first" if self.row.shape[0] == 6 else ""

    @property
    def halves_order_text(self) -> str:
        tool = "urdfkin" if self.conversion is None else self.conversion.convention.name
        return f"{tool} has the {'angular' if self._is_angular_first else 'linear'} rows first"

    @property
    def _is_angular_first(self) -> bool:
        return self.conversion is not None and self.conversion.angular_first

    def all(self, case: DiagnosisCase) -> Iterator[Mistake]:
        yield from self._of_references(case)
        if self.row.name == "acceleration":
            yield from self._of_accelerations(case)
        if self.row.name in ("placement", "relative placement"):
            yield from self._of_placements(case)
        yield from self._of_array_axes(case)
        yield from self._of_units(case)
        yield from self._of_mimic_joints(case)
        yield from self._of_joints(case)
        yield from self._of_orders(case)
        yield from self._of_frames(case)

    def _linear_rows(self) -> slice:
        return slice(3, 6) if self._is_angular_first else slice(0, 3)

    def _angular_rows(self) -> slice:
        return slice(0, 3) if self._is_angular_first else slice(3, 6)

    def _of_references(self, case: DiagnosisCase) -> Iterator[Mistake]:
        for other in Reference if self.reference is not None else ():
            if other is not self.reference:
                assert self.reference is not None
                words = f"the result is in {other.name} instead of {self.reference.name}"
                yield words, partial(case.compute, case.inputs, reference=other)

    def _of_accelerations(self, case: DiagnosisCase) -> Iterator[Mistake]:
        q, v, a = case.inputs
        linear, angular = self._linear_rows(), self._angular_rows()

        def compute_spatial() -> FloatArray:
            velocity = self._compute_velocity(q, v)
            found = case.expected.copy()
            found[:, linear] -= np.cross(velocity[:, angular], velocity[:, linear])
            return found

        def add_gravity(sign: float) -> FloatArray:
            found = case.expected.copy()
            down = np.array([0.0, 0.0, sign * _G])
            if self.reference is Reference.LOCAL:
                R = self.robot.placement(self._to_native_inputs(case.inputs)[0], self.frame, verify=False)[
                    :, :3, :3
                ]
                found[:, linear] += np.einsum("nji,j->ni", R, down)
            else:
                found[:, linear] += down
            return found

        yield "the spatial acceleration was computed; the classical one adds w x v", compute_spatial
        for sign, words in ((1.0, "upwards"), (-1.0, "downwards")):
            yield f"gravity ({_G} m/s^2 {words}) is included", partial(add_gravity, sign)
        zero = np.zeros_like(v)
        yield "the term J' v is missing", partial(case.compute, (q, zero, a))
        yield "the term J a is missing", partial(case.compute, (q, v, zero))

    def _compute_velocity(self, q: FloatArray, v: FloatArray) -> FloatArray:
        q, v = self._to_native_inputs((q, v))
        assert self.reference is not None
        found = self.robot.velocity(q, v, self.frame, self.reference, verify=False)
        return found if self.conversion is None else self.conversion.reorder_six_vector(found)

    def _to_native_inputs(self, inputs: Inputs) -> Inputs:
        return inputs if self.conversion is None else as_tuple(self.conversion.from_(*inputs))

    def _of_placements(self, case: DiagnosisCase) -> Iterator[Mistake]:
        yield "the placement is inverted", partial(np.asarray, np.linalg.inv(case.expected))

        def transpose_rotation() -> FloatArray:
            found = case.expected.copy()
            found[:, :3, :3] = found[:, :3, :3].swapaxes(1, 2)
            return found

        yield "the rotation is transposed", transpose_rotation
        q = self._to_native_inputs(case.inputs)[0]
        for link in self.robot.link_names[:64]:
            base = self.robot.placement(q, f"link:{link}", verify=False)
            if not np.allclose(base, np.eye(4)):
                words = f"the placement is relative to the link {link!r} instead of the root link"
                yield words, partial(np.linalg.solve, base, case.expected)

    def _of_array_axes(self, case: DiagnosisCase) -> Iterator[Mistake]:
        shape = case.expected.shape[1:]
        if len(shape) == 2 and shape[0] == shape[1]:
            yield "the result is transposed", partial(case.expected.swapaxes, 1, 2)
        if len(shape) == 3:
            yield (
                "the last two axes are exchanged; entry (row, i, j) is the derivative of J[row, i] for"
                " joint velocity j",
                partial(case.expected.swapaxes, 2, 3),
            )

    def _of_units(self, case: DiagnosisCase) -> Iterator[Mistake]:
        angle_indices = [(q, v) for _, q, v, is_angle in self._find_scalar_joints() if is_angle]
        lengths = case.expected.copy()
        if self.row.name.endswith("placement"):
            lengths[:, :3, 3] *= 1000.0
        elif lengths.shape[1] == 6:
            lengths[:, self._linear_rows()] *= 1000.0
        yield "lengths are in millimetres", partial(np.asarray, lengths)
        if lengths.shape[1] == 6:
            angles = case.expected.copy()
            angles[:, self._angular_rows()] *= np.degrees(1.0)
            yield "angles of the result are in degrees", partial(np.asarray, angles)
        for factor, words in (
            (np.radians(1.0), "the function takes q in degrees"),
            (np.degrees(1.0), "the function multiplies q by 180/pi, although q must be in radians"),
        ):
            yield words, partial(case.compute, self._scale_joints(case.inputs, angle_indices, factor, 1))
            if len(case.inputs) > 1:
                all_inputs = " q, v and a " if len(case.inputs) == 3 else " q and v "
                scaled = self._scale_joints(case.inputs, angle_indices, factor, 3)
                yield words.replace(" q ", all_inputs), partial(case.compute, scaled)

    def _find_scalar_joints(self) -> list[tuple[str, int, int, bool]]:
        """Return (name, index in q, index in v, is_angle) of each independent joint with one coordinate.

        The indices are those of the function's convention.
        """
        tree = self.robot.tree
        joints = []
        indices = None if self.conversion is None else self.conversion.q_and_v_indices
        for i, joint in enumerate(tree.joints):
            if joint.mimic or joint.kind.nq != 1:
                continue
            if indices is None:
                joints.append((joint.name, tree.q_index[i], tree.v_index[i], joint.kind.turns))
            elif joint.name in indices and len(indices[joint.name][0]) == 1:
                (q,), (v,) = indices[joint.name]
                joints.append((joint.name, q, v, joint.kind.turns))
        return joints

    @staticmethod
    def _scale_joints(
        inputs: Inputs, indices: Sequence[tuple[int, int]], factor: float, count: int
    ) -> Inputs:
        """Multiply the entries of some joints by `factor` in the first `count` inputs.

        `indices` contains a pair for each joint: the index in q, and the index in v and a.
        """
        scaled = [x.copy() for x in inputs]
        for k, x in enumerate(scaled[:count]):
            x[:, [pair[min(k, 1)] for pair in indices]] *= factor
        return tuple(scaled)

    def _of_mimic_joints(self, case: DiagnosisCase) -> Iterator[Mistake]:
        tree = self.robot.tree
        mimics = [joint for joint in tree.joints if joint.mimic]
        if not mimics or self.conversion is not None:
            return
        from urdfkin.robot.loading import load

        lock = dict(self.robot.origin.lock)
        free = load(self.robot.urdf, mimic=False, root_joint=self.robot.root_joint, lock=lock, verify=False)
        velocity_indices = [free.velocity_names.index(name) for name in self.robot.velocity_names]
        frame, method = self.frame, getattr(free, self.row.method)
        options = {**self.options, **({} if self.reference is None else {"reference": self.reference})}

        def expand(x: FloatArray, letter: str, *, mimics_move: bool) -> FloatArray:
            names = free.coordinate_names if letter == "q" else free.velocity_names
            own_names = self.robot.coordinate_names if letter == "q" else self.robot.velocity_names
            found = np.zeros((len(x), len(names)))
            found[:, [names.index(name) for name in own_names]] = x
            for joint in mimics if mimics_move else ():
                assert joint.mimic is not None
                rule = joint.mimic
                value = rule.multiplier * x[:, own_names.index(rule.mimicked_joint)]
                found[:, names.index(joint.name)] = value + (rule.offset if letter == "q" else 0.0)
            return found

        def compute_result(moving_inputs: str) -> FloatArray:
            inputs = [
                expand(x, letter, mimics_move=letter in moving_inputs)
                for letter, x in zip("qva", case.inputs, strict=False)
            ]
            found: FloatArray = method(*inputs, frame=frame, verify=False, **options)
            for axis in range(2, found.ndim) if self.row.has_columns else ():
                found = found.take(velocity_indices, axis)
            return found

        listed = ", ".join(repr(joint.name) for joint in mimics[:4])
        if self.row.has_columns:
            yield (
                f"the columns of the mimic joints ({listed}) are not added to the columns of the mimicked"
                " joints",
                partial(compute_result, "qva"),
            )
        elif len(case.inputs) > 1:
            yield f"the velocities of the mimic joints ({listed}) are missing", partial(compute_result, "q")
        yield f"the mimic joints ({listed}) do not move", partial(compute_result, "")

    def _of_joints(self, case: DiagnosisCase) -> Iterator[Mistake]:
        scalar_joints = self._find_scalar_joints()
        for name, q, v, _ in scalar_joints:
            words = f"the joint {name!r} has the opposite sign"
            flipped = self._scale_joints(case.inputs, [(q, v)], -1.0, 3)
            if self.row.has_columns:
                sign = np.ones(case.expected.shape[-1])
                sign[v] = -1.0
                yield words, partial(self._compute_with_signs, case, flipped, sign)
                yield f"{words} in q only", partial(case.compute, flipped)
            else:
                yield words, partial(case.compute, flipped)
                if len(case.inputs) > 1:
                    flipped_q = self._scale_joints(case.inputs, [(q, v)], -1.0, 1)
                    yield f"{words} in q only", partial(case.compute, flipped_q)
        for (one, *at), (other, *to) in combinations(((name, q, v) for name, q, v, _ in scalar_joints), 2):
            words = f"the joints {one!r} and {other!r} are exchanged"
            first_inputs = self._exchange_joints(case.first_inputs(_FIRST_SAMPLES), tuple(at), tuple(to))
            variants = (
                ((words, True), (f"{words} in q only", False)) if self.row.has_columns else ((words, False),)
            )
            for sentence, columns in variants:
                order = np.arange(case.expected.shape[-1])
                if columns:
                    order[[at[1], to[1]]] = order[[to[1], at[1]]]
                try:
                    predicted = self._compute_with_order(case, first_inputs, order)
                except UrdfkinError:
                    # In some conventions, a mimic joint has a coordinate, which the exchange makes wrong.
                    continue
                if case.remainder(predicted, _FIRST_SAMPLES) <= EXPLANATION_TOLERANCE:
                    exchanged = self._exchange_joints(case.inputs, tuple(at), tuple(to))
                    yield sentence, partial(self._compute_with_order, case, exchanged, order)

    def _compute_with_signs(self, case: DiagnosisCase, inputs: Inputs, sign: FloatArray) -> FloatArray:
        found: FloatArray = case.compute(inputs) * sign
        return found * sign[:, None] if len(self.row.shape) == 3 else found

    def _compute_with_order(self, case: DiagnosisCase, inputs: Inputs, order: Any) -> FloatArray:
        result = case.compute(inputs)
        if not self.row.has_columns:
            return result
        found: FloatArray = result[..., order]
        return found[..., order, :] if len(self.row.shape) == 3 else found

    @staticmethod
    def _exchange_joints(inputs: Inputs, one: tuple[int, ...], other: tuple[int, ...]) -> Inputs:
        exchanged = [x.copy() for x in inputs]
        for k, x in enumerate(exchanged):
            indices = [one[min(k, 1)], other[min(k, 1)]]
            x[:, indices] = x[:, indices[::-1]]
        return tuple(exchanged)

    def _of_orders(self, case: DiagnosisCase) -> Iterator[Mistake]:
        if self.conversion is not None:
            return
        from urdfkin.model.conventions import BUILT_IN_NAMES

        seen = {tuple(range(self.robot.nq))}
        for name in BUILT_IN_NAMES:
            try:
                other = self.robot.convention(name)
            except UrdfkinError:
                continue
            q, v = other.permutation, other.velocity_permutation
            if q is None or v is None or len(q) != self.robot.nq or tuple(q.tolist()) in seen:
                continue
            seen.add(tuple(q.tolist()))
            indices = [np.argsort(q), np.argsort(v), np.argsort(v)]
            inputs = tuple(x[:, index] for x, index in zip(case.inputs, indices, strict=False))
            yield (
                f"the joints are in the order of {name}; try convention={name!r}",
                partial(self._compute_with_order, case, inputs, v),
            )

    def _of_frames(self, case: DiagnosisCase) -> Iterator[Mistake]:
        names = [f"link:{name}" for name in self.robot.link_names if name != self.frame]
        if self.row.results_and_bound is not None or not names:
            return
        results = case.compute(case.inputs, frame=names)
        for k, name in enumerate(names):
            title = name.removeprefix("link:")
            yield (
                f"the function computes the result for the frame {title!r} instead of {self.frame!r}",
                partial(np.asarray, results[:, k]),
            )


def as_tuple(x: FloatArray | Inputs) -> Inputs:
    return x if isinstance(x, tuple) else (x,)


def _find_column_mistakes(mistakes: Mistakes, case: DiagnosisCase) -> Iterator[tuple[float, str]]:
    if case.expected.shape[1:2] != (6,) or case.expected.ndim != 3:
        return
    names = (mistakes.conversion or mistakes.robot).velocity_names
    expected, actual = case.expected, case.actual
    scale = np.maximum(case.scale, np.finfo(float).tiny)

    def is_equal(i: int, x: FloatArray) -> bool:
        return bool((np.abs(actual[..., i] - x) <= _EQUALITY_TOLERANCE * scale[..., i]).all())

    wrong = [i for i in range(expected.shape[-1]) if not is_equal(i, expected[..., i])]
    for i in wrong:
        if is_equal(i, -expected[..., i]):
            yield 0.0, f"the column of {names[i]!r} has the opposite sign"
        elif is_equal(i, np.zeros_like(expected[..., i])):
            yield 0.0, f"the column of {names[i]!r} is zero"
        else:
            other = next(
                (k for k in range(expected.shape[-1]) if k != i and is_equal(i, expected[..., k])), None
            )
            if other is not None:
                yield 0.0, f"the column of {names[i]!r} is that of {names[other]!r}"
