"""Test one robot: check it, load it, compute all quantities and compare them with Pinocchio.

Results of different calls must have the same bits, because all calls use the same forward recursion.
"""

import traceback
import warnings
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

import urdfkin
from scripts.fuzzing import Case, Outcome, mjcf
from urdfkin import BaseMotion, Reference
from urdfkin.errors import (
    InputError,
    RangeError,
    RepresentationSingularityError,
    UnknownNameError,
    UrdfkinError,
)
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.urdf.lint import Finding, Severity, UrdfError
from urdfkin.urdf.mjcf import is_mjcf
from urdfkin.verify.verifier import NotVerifiedWarning

#: Codes of findings about huge numbers, for which results may be inf or nan.
_SIZES = {"URDF526", "URDF603", "URDF606"}
#: Maximum number of frames in one call.
FRAMES_PER_CALL = 12
#: Maximum number of frames that are also computed alone. The results must equal the results of the call for
#: several frames.
SINGLE_FRAMES = 2
TESTED_NAMES = 6
#: Standard deviation of each coordinate of the far base's position, in metres.
FAR = 1e6
#: Quantities that one call can compute for several frames, each with its number of inputs: 1 (q), 2 (q and v)
#: or 3 (q, v and a).
QUANTITIES = {"placement": 1, "velocity": 2, "jacobian": 1, "hessian": 1, "acceleration": 3}


class MismatchError(Exception):
    """Two computations of the same quantity return different results."""


def evaluate(case: Case) -> Outcome:
    try:
        with warnings.catch_warnings(record=True) as warned:
            warnings.simplefilter("always")
            return _evaluate_mjcf(case, warned) if is_mjcf(case.data) else _evaluate(case, warned)
    except UrdfkinError as error:
        return Outcome(f"raises {type(error).__name__}", traceback.format_exc())
    except Exception as error:
        return Outcome(f"traceback: {type(error).__name__}", traceback.format_exc())


def _evaluate(case: Case, warned: list[warnings.WarningMessage]) -> Outcome:
    options: dict[str, Any] = {"root_joint": case.root_joint, "mimic": case.mimic}
    findings = urdfkin.check(case.data, **options)
    errors = [finding for finding in findings if finding.severity is Severity.ERROR]
    try:
        robot = urdfkin.load(case.data, **options)
    except UrdfError as error:
        if errors:
            return Outcome("refused", errors[0].code)
        return Outcome("load refuses a file that check accepts", str(error))
    if errors:
        return Outcome("load accepts a file that check refuses", str(errors[0]))
    return _check_results(robot, findings, warned)


def _evaluate_mjcf(case: Case, warned: list[warnings.WarningMessage]) -> Outcome:
    model = mjcf.compile_model(case.data)
    try:
        robot = urdfkin.load(case.data, mimic=case.mimic)
    except InputError as error:
        known = model is None or error.remedy is not None
        return Outcome("refused" if known else "load refuses a file that MuJoCo accepts", str(error))
    if model is not None and (found := mjcf.find_difference(robot, model, 0)) is not None:
        return Outcome("MuJoCo reads another robot", found)
    return _check_results(robot, robot.findings, warned)


def _check_results(robot: Robot, findings: list[Finding], warned: list[warnings.WarningMessage]) -> Outcome:
    too_large = "a result is not a finite number"
    sizes = _SIZES & {finding.code for finding in findings}
    if sizes:
        too_large = "too large to compute; a finding states the reason"
    try:
        for computation, result in compute_all(robot, seed=0):
            if not np.isfinite(result).all():
                return Outcome(too_large, computation)
        # The certificate does not cover DH tables, but a table that is not verified causes a warning.
        doubted = any(issubclass(w.category, NotVerifiedWarning) for w in warned)
        certified = robot.certificate().verified
        compare_prepared(robot, seed=0)
    except (urdfkin.VerificationError, urdfkin.TableError, RangeError, MismatchError) as error:
        words = {
            urdfkin.VerificationError: "disagrees with Pinocchio",
            urdfkin.TableError: "a table disagrees with Pinocchio",
            RangeError: too_large,
            MismatchError: "two computations of one result differ",
        }
        return Outcome(next(word for kind, word in words.items() if isinstance(error, kind)), str(error))
    if certified and not doubted:
        return Outcome("verified")
    reasons = [finding.code for finding in findings if finding.pinocchio_reading is not None]
    # Huge numbers can make a table inaccurate, although all other results are verified.
    reasons += sorted(sizes) if certified else []
    if reasons:
        return Outcome("not verified; a finding states the reason", reasons[0])
    if (reason := robot.verifier.find_refusal()) is not None:
        return Outcome("Pinocchio refuses a file that check accepts", reason)
    texts = "; ".join(str(w.message) for w in warned)
    return Outcome("not verified; no finding states the reason", texts)


def compute_all(robot: Robot, seed: int) -> Iterator[tuple[str, FloatArray]]:
    generator = np.random.default_rng(seed)
    inputs = _draw_inputs(robot, seed)
    frames = robot.all_frames
    if len(frames) > FRAMES_PER_CALL:
        frames = tuple(
            frames[i] for i in sorted(generator.choice(len(frames), FRAMES_PER_CALL, replace=False))
        )
    alone = [frames[i] for i in sorted({len(frames) - 1, int(generator.integers(len(frames)))})][
        :SINGLE_FRAMES
    ]
    yield from _placements_by_name(robot, inputs[0][0], generator)
    for base in (None, _draw_base(generator, 1.0), _draw_base(generator, FAR)):
        for reference in Reference:
            yield from _compare_calls(robot, frames, alone, reference, base, inputs)
        for frame in alone:
            for representation in ("ZYZ", "xyz", "quaternion"):
                try:
                    J = robot.analytical_jacobian(inputs[0], frame, representation, base=base)
                except RepresentationSingularityError:
                    continue
                yield f"analytical_jacobian {representation}", J
    yield from _table_placements(robot, alone)


def compare_prepared(robot: Robot, seed: int) -> None:
    inputs = [x[0] for x in _draw_inputs(robot, seed)]
    frame = robot.all_frames[-1]
    for reference in Reference:
        fast = robot.prepare(frame, reference)
        for name in ("placement", "velocity", "jacobian", "acceleration"):
            ours = getattr(fast, name)(*inputs[: QUANTITIES[name]])
            theirs = _compute(robot, name, inputs, frame, reference)
            _check_equal(f"{name} of {frame!r} prepared and not", ours, theirs)


def _draw_inputs(robot: Robot, seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    v, a = np.random.default_rng([seed, 1]).normal(size=(2, 2, robot.nv))
    return robot.sample(2, seed), v, a


def _draw_base(generator: np.random.Generator, size: float) -> BaseMotion:
    R = np.linalg.qr(generator.normal(size=(3, 3)))[0]
    T = np.eye(4)
    T[:3, :3] = R * np.linalg.det(R)
    T[:3, 3] = size * generator.normal(size=3)
    return BaseMotion(T, *generator.normal(size=(2, 6)))


def _compute(
    robot: Robot,
    name: str,
    inputs: Sequence[FloatArray],
    frame: str | tuple[str, ...],
    reference: Reference,
    base: BaseMotion | None = None,
) -> FloatArray:
    words = (frame,) if name == "placement" else (frame, reference)
    result: FloatArray = getattr(robot, name)(*inputs[: QUANTITIES[name]], *words, base=base)
    return result


def _compare_calls(
    robot: Robot,
    frames: tuple[str, ...],
    alone: list[str],
    reference: Reference,
    base: BaseMotion | None,
    inputs: tuple[FloatArray, ...],
) -> Iterator[tuple[str, FloatArray]]:
    q, v, a = inputs
    single = [x[1] for x in inputs]
    for name in QUANTITIES:
        if name == "placement" and reference is not Reference.LOCAL_WORLD_ALIGNED:
            continue
        every = _compute(robot, name, inputs, frames, reference, base)
        yield name, every
        for frame in alone:
            batch = _compute(robot, name, inputs, frame, reference, base)
            single_result = _compute(robot, name, single, frame, reference, base)
            _check_equal(f"{name} of several frames and of {frame!r}", every[:, frames.index(frame)], batch)
            _check_equal(f"{name} of {frame!r} in a batch and alone", batch[1], single_result)
    for frame in alone:
        words = (frame, reference)
        rate = robot.jacobian_rate(q, v, *words, base=base)
        _check_equal(
            f"jacobian_rate of {frame!r}", rate[0], robot.jacobian_rate(q[0], v[0], *words, base=base)
        )
        yield "jacobian_rate", rate
        yield "acceleration_breakdown", robot.acceleration_breakdown(q, v, a, *words, base=base).total


def _placements_by_name(
    robot: Robot, q: FloatArray, generator: np.random.Generator
) -> Iterator[tuple[str, FloatArray]]:
    links, joints = set(robot.link_names), {joint.name for joint in robot.tree.joints}
    names = sorted(links | joints)
    prefixed_names = [f"{prefix}{name}" for name in names for prefix in ("", "link:", "joint:")]
    for i in generator.permutation(len(prefixed_names))[:TESTED_NAMES]:
        try:
            yield f"placement of {prefixed_names[i]!r}", robot.placement(q, prefixed_names[i])
        except UnknownNameError:  # For example, `joint:x` is unknown if the robot has no joint x.
            if prefixed_names[i] in names:
                raise
        except InputError:  # A link and a joint have the same name.
            if prefixed_names[i] not in links & joints:
                raise


def _table_placements(robot: Robot, frames: list[str]) -> Iterator[tuple[str, FloatArray]]:
    tree = robot.tree
    for frame in frames:
        if any(tree.joints[i].nq > 1 for i in tree.path(tree.frame_link(frame))):
            continue
        for convention in ("standard", "modified"):
            table = robot.dh(frame, tree.link_frames[0], convention)
            yield f"{convention} table", table.placement(robot.select(table, robot.neutral()))


def _check_equal(what: str, x: FloatArray, y: FloatArray) -> None:
    if x.tobytes() != y.tobytes() and not np.array_equal(x, y, equal_nan=True):
        raise MismatchError(f"{what}: off by {np.abs(x - y).max():.3g}")
