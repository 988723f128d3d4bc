"""Configurations: the layout of `q`, named poses, limits and ranges, random samples, and Pinocchio's `q`.

| joint | urdfkin | Pinocchio |
|---|---|---|
| revolute, prismatic | one number | the same |
| continuous | one number | cos, sin |
| planar | x, y, angle | x, y, cos, sin |
| floating | x, y, z, qx, qy, qz, qw | the same |
| mimic | none | a coordinate of its own, in the default model |

The limits of a joint and of its mimic joints determine the range of the joint's coordinate.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.errors import DegreesWarning, InputError, NotFiniteError, QuestionsSection, warn_caller
from urdfkin.kinematics.inputs import as_floats, check_range
from urdfkin.kinematics.rotation import NORM_TOLERANCE, normalise_quaternions, rotation_from_quaternion
from urdfkin.kinematics.roundings import EPS, MIMIC_LIMIT_ROUNDINGS
from urdfkin.model.base_motion import BaseMotion
from urdfkin.model.configuration_like import (
    ConfigurationLike,
    CoordinateLayout,
    Hint,
    as_text_or_mapping,
    join_names,
)
from urdfkin.model.tree import (
    MAX_PLAUSIBLE_ANGLE,
    FloatArray,
    Joint,
    JointKind,
    KinematicTree,
    Limit,
    Mimic,
    freeze,
    is_bounded,
    limits_with_margin,
)

#: Largest absolute value (rad or m) that `sample` draws for a joint with one coordinate. If the limits of a
#: joint exclude all of these values, `sample` draws larger values. Some upper bounds assume that joints
#: without limits travel at most this distance (m) from zero. Few linear axes of robots are longer than 10 m.
ASSUMED_LIMIT = 10.0
#: Text of the condition under which an upper bound holds.
TRAVEL_CONDITION = f"joints without limits travel at most {ASSUMED_LIMIT:g} m"


@dataclass(frozen=True, slots=True)
class RangeReduction:
    """A mimicked joint's range, which the limits of mimic joints narrow."""

    joint: str
    joint_range: tuple[float, float]
    allowed_range: tuple[float, float] | None
    mimic_joints: tuple[str, ...]
    unit: str

    def __str__(self) -> str:
        names = ", ".join(self.mimic_joints)
        own = f"joint {self.joint} ranges over {format_range(self.joint_range)} {self.unit}"
        if self.allowed_range is None:
            return f"{own}; the limits of its mimic joints ({names}) allow at most one value"
        allowed = format_range(self.allowed_range)
        return f"{own}; the limits of its mimic joints ({names}) allow only values from {allowed}"


def format_range(ends: tuple[float, float]) -> str:
    """Return a range as text.

    >>> format_range((-0.005, 0.055))
    '-0.005 to 0.055'
    """
    return f"{ends[0]:.6g} to {ends[1]:.6g}"


def joint_value_range(kind: JointKind, limit: Limit | None) -> tuple[float, float]:
    if kind is not JointKind.CONTINUOUS and is_bounded(limit):
        return limit.lower, limit.upper
    return (-math.pi, math.pi) if kind.turns else (-ASSUMED_LIMIT, ASSUMED_LIMIT)


def largest_value(limit: Limit | None) -> float:
    return max(abs(limit.lower), abs(limit.upper)) if is_bounded(limit) else ASSUMED_LIMIT


def sample_uniform(ranges: Sequence[tuple[float, float]], count: int, seed: int = 0) -> FloatArray:
    """Draw uniform random values (count, ranges)."""
    lower, upper = np.array(ranges).reshape(-1, 2).T
    return np.random.default_rng(seed).uniform(lower, upper, (count, len(ranges)))


def joint_ranges(tree: KinematicTree) -> dict[str, tuple[float, float]]:
    """Return the range of each joint that has one coordinate, without regard to mimic joints.

    A range is cut to the interval from -`ASSUMED_LIMIT` to `ASSUMED_LIMIT`. If a range is outside this
    interval, only its part of length `ASSUMED_LIMIT` nearest to 0 remains.
    """

    def own_range(joint: Joint) -> tuple[float, float]:
        if joint.kind is JointKind.CONTINUOUS:
            return -math.pi, math.pi
        if joint.limit is None:
            return -ASSUMED_LIMIT, ASSUMED_LIMIT
        lower, upper = sorted((joint.limit.lower, joint.limit.upper))
        centre = lower if lower >= ASSUMED_LIMIT else upper if upper <= -ASSUMED_LIMIT else 0.0
        lower, upper = np.clip((lower, upper), centre - ASSUMED_LIMIT, centre + ASSUMED_LIMIT).tolist()
        return lower, upper

    return {joint.name: own_range(joint) for joint in tree.joints if joint.nq == 1}


def coordinate_ranges(tree: KinematicTree) -> dict[str, tuple[float, float]]:
    """Return the range of each joint, reduced by the limits of its mimic joints.

    If the mimic joints allow at most one value, the range is not reduced.
    """
    ranges = joint_ranges(tree)
    narrowed = {one.joint: one.allowed_range for one in range_reductions(tree)}
    return {name: narrowed.get(name) or own for name, own in ranges.items()}


def range_reductions(tree: KinematicTree) -> tuple[RangeReduction, ...]:
    ranges = joint_ranges(tree)
    allowed, limiting_joints = dict[str, tuple[float, float]](), dict[str, list[str]]()
    for joint in tree.joints:
        if (rule := joint.mimic) is None or (limit := joint.limit) is None:
            continue
        own = ranges[rule.mimicked_joint]
        if restrict_range(rule, limit, *own) != own:
            limiting_joints.setdefault(rule.mimicked_joint, []).append(joint.name)
        allowed[rule.mimicked_joint] = restrict_range(rule, limit, *allowed.get(rule.mimicked_joint, own))
    return tuple(
        RangeReduction(
            mimicked_joint,
            ranges[mimicked_joint],
            ends if ends[0] < ends[1] else None,
            tuple(limiting_joints[mimicked_joint]),
            "rad" if tree.joints[tree.joint_index(mimicked_joint)].kind.turns else "m",
        )
        for mimicked_joint, ends in allowed.items()
        if mimicked_joint in limiting_joints
    )


def restrict_range(rule: Mimic, limit: Limit, lower: float, upper: float) -> tuple[float, float]:
    """Return the part of a range that a mimic joint's limits allow.

    If no value is allowed, the lower end exceeds the upper end.
    """
    least, most = _widen_by_rounding(limit)

    def is_allowed(mimicked_joint: float) -> bool:
        return least <= rule.multiplier * mimicked_joint + rule.offset <= most

    if is_allowed(lower) and is_allowed(upper):
        return lower, upper
    if rule.multiplier == 0.0:
        return math.inf, -math.inf
    ends = sorted((end - rule.offset) / rule.multiplier for end in (limit.lower, limit.upper))
    # Move each end inwards by the rounding error, so that the mimic joint is within its limits.
    size = max(map(abs, (limit.lower, limit.upper))) + abs(rule.offset)
    error = MIMIC_LIMIT_ROUNDINGS * EPS * size / abs(rule.multiplier)
    if not math.isfinite(error):  # A mimic joint with only one limit has an infinite `size`.
        error = (
            MIMIC_LIMIT_ROUNDINGS * EPS * max((abs(end) for end in ends if math.isfinite(end)), default=0.0)
        )
    return (
        lower if is_allowed(lower) else max(lower, ends[0] + error),
        upper if is_allowed(upper) else min(upper, ends[1] - error),
    )


def _widen_by_rounding(limit: Limit) -> tuple[float, float]:
    """Widen limits by one unit in the last place, because parsing rounds decimal limits."""
    return math.nextafter(limit.lower, -math.inf), math.nextafter(limit.upper, math.inf)


#: Allowed deviation from a mimic rule in `from_pinocchio`, relative to max(1, largest absolute value).
_MIMIC_TOLERANCE = 1e-9


#: Suffix and unit of a planar or floating joint's coordinates.
_Q_SUFFIXES = {
    JointKind.PLANAR: {"x": "m", "y": "m", "angle": "rad"},
    JointKind.FLOATING: {"x": "m", "y": "m", "z": "m", "qx": "", "qy": "", "qz": "", "qw": ""},
}
#: Suffix and unit of each velocity of a planar or floating joint. The unit lacks "/s" for v and "/s^2" for a.
_VELOCITY_SUFFIXES = {
    JointKind.PLANAR: {"vx": "m", "vy": "m", "wz": "rad"},
    JointKind.FLOATING: {"vx": "m", "vy": "m", "vz": "m", "wx": "rad", "wy": "rad", "wz": "rad"},
}


def coordinate_names(tree: KinematicTree) -> tuple[str, ...]:
    return tuple(name for name, _ in _names_and_units(tree, _Q_SUFFIXES))


def velocity_names(tree: KinematicTree) -> tuple[str, ...]:
    return tuple(name for name, _ in _names_and_units(tree, _VELOCITY_SUFFIXES))


def _names_and_units(
    tree: KinematicTree, suffixes_by_kind: Mapping[JointKind, Mapping[str, str]]
) -> Iterator[tuple[str, str]]:
    taken = set[str]()
    for joint in tree.joints:
        if not joint.nv:
            continue
        if joint.kind.has_axis:
            yield joint.name, "rad" if joint.kind.turns else "m"
            continue
        taken = taken or {other.name for other in tree.joints}
        suffixes, separator = suffixes_by_kind[joint.kind], "."
        while not taken.isdisjoint(names := [f"{joint.name}{separator}{suffix}" for suffix in suffixes]):
            separator = ":" if separator == "." else separator + ":"
        taken.update(names)
        yield from zip(names, suffixes.values(), strict=True)


def units(tree: KinematicTree, symbol: str) -> tuple[str, ...]:
    """Return "rad", "m" or "" for each number of q, v or a, without the time unit."""
    return tuple(
        unit for _, unit in _names_and_units(tree, _Q_SUFFIXES if symbol == "q" else _VELOCITY_SUFFIXES)
    )


def coordinate_layout(tree: KinematicTree, symbol: str) -> CoordinateLayout:
    is_q = symbol == "q"
    spans = {
        joint.name: (at, joint.nq if is_q else joint.nv)
        for joint, at in zip(tree.joints, tree.q_index if is_q else tree.v_index, strict=True)
        if joint.nv > 1
    }
    return CoordinateLayout(
        symbol,
        _names(tree, symbol),
        units(tree, symbol),
        spans,
        poses=lambda: named_poses(tree) if is_q else {"neutral": np.zeros(tree.nv)},
        hints_by_name=lambda: _hints_by_name(tree),
        hints_by_length=lambda: _hints_by_length(tree, symbol),
    )


def _hints_by_name(tree: KinematicTree) -> dict[str, Hint]:
    return {
        joint.name: Hint(
            f"this joint mimics {joint.mimic.mimicked_joint}: give the value of {joint.mimic.mimicked_joint},"
            " or load with mimic=False (--no-mimic)",
            QuestionsSection.MIMIC_JOINTS,
        )
        if joint.mimic
        else Hint("leave out this fixed joint", QuestionsSection.FIXED_JOINTS)
        if joint.lock is None
        else Hint(f"leave out this joint, locked at {joint.lock.value:.6g}", QuestionsSection.LOCKED_JOINTS)
        for joint in tree.joints
        if not joint.nv
    }


def _hints_by_length(tree: KinematicTree, symbol: str) -> dict[int, Hint]:
    has_mimic_joints = any(joint.mimic for joint in tree.joints)
    leave_out = Hint(
        "leave out the mimic joints, which have no coordinate, or load with mimic=False (--no-mimic)",
        QuestionsSection.MIMIC_JOINTS,
    )
    mimic_count = sum(joint.kind.nv for joint in tree.joints if joint.mimic)
    hints: dict[int, Hint] = {}
    if symbol == "q":
        for mimic in (False, True):
            option = f", mimic={mimic}" if has_mimic_joints else ""
            hints[_pinocchio_length(tree, mimic=mimic)] = Hint(
                f"Pinocchio's q has that length: robot.from_pinocchio(q{option}) converts it to urdfkin's",
                QuestionsSection.CONTINUOUS_JOINTS,
            )
        if has_mimic_joints:
            convert = hints.get(tree.nq + mimic_count)
            remedy = f"{convert.remedy}; or {leave_out.remedy}" if convert else leave_out.remedy
            hints[tree.nq + mimic_count] = leave_out._replace(remedy=remedy)
    elif has_mimic_joints:
        remedy = f"Pinocchio's {symbol} has that length: {leave_out.remedy}"
        hints[tree.nv + mimic_count] = leave_out._replace(remedy=remedy)
    hints.pop(len(_names(tree, symbol)), None)
    return hints


def neutral(tree: KinematicTree) -> FloatArray:
    """Return the zero configuration."""
    q = np.zeros(tree.nq)
    for joint, at in zip(tree.joints, tree.q_index, strict=True):
        if joint.kind is JointKind.FLOATING:
            q[at + 6] = 1.0
    return q


def named_poses(tree: KinematicTree) -> dict[str, FloatArray]:
    """Return the named poses.

    In `ready`, a joint without a value is at 0. If the range excludes 0, the joint is in the middle of the
    range.
    """
    ready = neutral(tree)
    for name, (lower, upper) in coordinate_ranges(tree).items():
        if not lower <= 0.0 <= upper:
            ready[tree.q_index[tree.joint_index(name)]] = (lower + upper) / 2.0
    configurations = {"neutral": neutral(tree), "ready": ready}
    for pose, values in tree.poses.items():
        q = ready.copy() if pose == "ready" else neutral(tree)
        for name, value in values.items():
            q[tree.q_index[tree.joint_index(name)]] = value
        configurations[pose] = q
    return configurations


def parse_locks(
    tree: KinematicTree, lock: str | Mapping[str, ArrayLike], joints: Sequence[str] | None = None
) -> dict[str, float]:
    """Return the value of each locked joint, rad or m.

    If `joints` is given, all other joints are locked. A locked joint without a value in `lock` has the value
    of the pose that `lock` names, or 0.
    """
    layout = coordinate_layout(tree, "q")
    values, pose = layout.parse_by_name(lock, "lock")
    locked_names = set(values)
    if joints is not None:
        layout.check_names(joints, "joints")
        if repeated := sorted(locked_names.intersection(joints)):
            raise InputError("a joint to lock is also in `joints`", where="lock", found=join_names(repeated))
        locked_names |= {joint.name for joint in tree.joints if joint.nq}.difference(joints)
    elif pose is not None:
        remedy = "write NAME=VALUE, or use joints (--joints) to list the joints that remain movable"
        raise InputError(
            "a pose does not state which joints to lock",
            where="lock",
            remedy=remedy,
            question=QuestionsSection.LOCKED_JOINTS,
        )
    for name, (at, size) in layout.spans.items():
        if not locked_names.isdisjoint([name, *layout.names[at : at + size]]):
            kind = tree.joints[tree.joint_index(name)].kind.value
            remedy = "leave it out" if joints is None else "add it to joints (--joints)"
            claim, question = f"a {kind} joint has no single value to lock", QuestionsSection.LOCKED_JOINTS
            raise InputError(claim, where=name, remedy=remedy, question=question)
    defaults = zip(layout.names, (neutral(tree) if pose is None else pose).tolist(), strict=True)
    q = layout.parse({**dict(defaults), **values}, "lock")
    if q.ndim > 1:
        raise InputError("a locked joint needs one value", where="lock", found=f"shape {q.shape[:-1]}")
    locked = {name: float(x) for name, x in zip(layout.names, q, strict=True) if name in locked_names}
    for name, x in locked.items():
        if not math.isfinite(x):
            raise NotFiniteError("a locked joint needs a finite value", where=f"lock, {name}", found=str(x))
    _check_limits(tree, locked)
    return locked


def _check_limits(tree: KinematicTree, locked: Mapping[str, float]) -> None:
    q = np.full(tree.nq, np.nan)  # NaN is never outside a limit.
    for name, value in locked.items():
        q[tree.q_index[tree.joint_index(name)]] = value
    impossible = {
        name for one in range_reductions(tree) if one.allowed_range is None for name in one.mimic_joints
    }
    for joint, words in _violations(tree, q):
        if joint.name not in impossible:
            name = joint.mimic.mimicked_joint if joint.mimic else joint.name
            raise InputError(
                "a joint is locked outside its limits",
                where=tree.name,
                found=words,
                remedy=f"give a value within them: lock={{{name!r}: VALUE}} (--lock {name}=VALUE)",
            )


def limits(tree: KinematicTree) -> FloatArray:
    bounds = np.tile([[-np.inf], [np.inf]], tree.nq)
    for joint, at in zip(tree.joints, tree.q_index, strict=True):
        if joint.nq == 1 and joint.limit is not None and joint.kind is not JointKind.CONTINUOUS:
            bounds[:, at] = joint.limit.lower, joint.limit.upper
    return freeze(bounds)


def velocity_limits(tree: KinematicTree) -> FloatArray:
    bounds = np.full(tree.nv, np.inf)
    for joint, at in zip(tree.joints, tree.v_index, strict=True):
        if joint.nv == 1 and joint.limit is not None:
            bounds[at] = joint.limit.velocity
    return freeze(bounds)


def with_unit_quaternions(tree: KinematicTree, q: FloatArray) -> FloatArray:
    if not tree.floating_joints:
        return q
    q = q.copy()
    for i in tree.floating_joints:
        quaternion = q[..., tree.q_index[i] + 3 : tree.q_index[i] + 7]
        quaternion[...] = normalise_quaternions(quaternion, f"the quaternion of joint {tree.joints[i].name}")
    return q


def parse_numbers(tree: KinematicTree, value: ConfigurationLike, symbol: str) -> FloatArray:
    if (named := as_text_or_mapping(value, symbol)) is not None:
        return coordinate_layout(tree, symbol).parse(named)
    array, width = as_floats(cast("ArrayLike", value), symbol), tree.nq if symbol == "q" else tree.nv
    if array.shape[-1:] != (width,):
        names = ", ".join(_names(tree, symbol)) or "none, no joint moves"
        hint = _hints_by_length(tree, symbol).get(array.shape[-1]) if array.ndim else None
        raise InputError(
            f"{symbol} needs {width} numbers for {tree.name}: {names}",
            found=f"shape {array.shape}",
            remedy=hint and hint.remedy,
            question=hint.question if hint else QuestionsSection.JOINT_ORDER,
        )
    return array


def parse_and_normalise(
    tree: KinematicTree, value: ConfigurationLike, symbol: str, *, warn: bool = True
) -> FloatArray:
    array = parse_numbers(tree, value, symbol)
    if symbol != "q":
        return array
    if warn:
        warn_of_degrees(tree, array)
    return with_unit_quaternions(tree, array)


def parse_finite(
    tree: KinematicTree, value: ConfigurationLike, symbol: str, *, warn: bool = True
) -> FloatArray:
    array = parse_and_normalise(tree, value, symbol, warn=warn)
    if not np.isfinite(array).all():
        where = np.argwhere(~np.isfinite(array))[0]
        raise NotFiniteError(
            f"{symbol} must be finite", where=_names(tree, symbol)[where[-1]], found=str(array[tuple(where)])
        )
    return array


def _names(tree: KinematicTree, symbol: str) -> tuple[str, ...]:
    return coordinate_names(tree) if symbol == "q" else velocity_names(tree)


def limit_violations(tree: KinematicTree, q: FloatArray) -> list[str]:
    return [words for _, words in _violations(tree, q)]


def _violations(tree: KinematicTree, q: FloatArray) -> Iterator[tuple[Joint, str]]:
    for joint, at in zip(tree.joints, tree.q_index, strict=True):
        if not joint.kind.has_axis or joint.limit is None or not q.size:
            continue
        values = q[..., at]
        lower, upper = _widen_by_rounding(joint.limit)
        with np.errstate(over="ignore"):  # A value of inf is outside the limits.
            if joint.mimic:
                values = joint.mimic.multiplier * values + joint.mimic.offset
            outside = np.maximum(lower - values, values - upper)
        if outside.max() > 0.0:
            worst = float(values.flat[outside.argmax()])
            bounds = f"[{joint.limit.lower:.6g}, {joint.limit.upper:.6g}]"
            yield joint, f"joint {joint.name}: {worst:.6g} is outside {bounds}{_degrees_hint(joint, worst)}"


def _degrees_hint(joint: Joint, value: float) -> str:
    if not (joint.kind.turns and is_bounded(joint.limit) and abs(value) > MAX_PLAUSIBLE_ANGLE):
        return ""
    lower, upper = limits_with_margin(joint.limit.lower, joint.limit.upper)
    if lower <= value <= upper or not joint.limit.lower <= math.radians(value) <= joint.limit.upper:
        return ""
    return f"; degrees? write {value:.6g}deg"


#: Maximum number of configurations in which urdfkin looks for angles in degrees. A batch normally has one
#: unit, so a few configurations are enough.
_MAX_CHECKED = 16


def degrees_messages(tree: KinematicTree, q: FloatArray) -> list[str]:
    """Return messages about values that seem to be degrees."""
    if tree.min_implausible_angle == math.inf or not q.size:
        return []
    if q.ndim == 2:
        q = q[:: -(-len(q) // _MAX_CHECKED)]
    elif q.ndim > 2:
        most = max(1, int(_MAX_CHECKED ** (1.0 / (q.ndim - 1))))
        q = q[tuple(slice(None, None, -(-size // most)) for size in q.shape[:-1])]
    flat = q.ravel()  # For short arrays, argmax is faster than max.
    if not max(flat.item(flat.argmax()), -flat.item(flat.argmin())) > tree.min_implausible_angle:
        return []
    return [words for joint, words in _violations(tree, q) if not joint.mimic and "; degrees? " in words]


def warn_of_degrees(tree: KinematicTree, q: FloatArray) -> None:
    if lines := degrees_messages(tree, q):
        more = f" ({len(lines) - 1} more joints likewise)" if len(lines) > 1 else ""
        advice = "q is in radians; numpy.radians converts degrees"
        warn_caller(f"{tree.name}: {lines[0]}{more}: {advice}; {QuestionsSection.DEGREES}", DegreesWarning)


# -- Pinocchio's layout ------------------------------------------------------------------------------


def _is_in_pinocchio(joint: Joint, *, mimic: bool) -> bool:
    return joint.kind.nq > 0 and not (mimic and joint.mimic)


def _pinocchio_length(tree: KinematicTree, *, mimic: bool) -> int:
    present = (joint.kind for joint in tree.joints if _is_in_pinocchio(joint, mimic=mimic))
    return sum(kind.nq_pinocchio for kind in present)


@np.errstate(over="ignore")  # RangeError replaces this warning.
def to_pinocchio(tree: KinematicTree, q: FloatArray, *, mimic: bool = False) -> FloatArray:
    blocks = [np.zeros((*q.shape[:-1], 0))]
    for joint, at in zip(tree.joints, tree.q_index, strict=True):
        if not _is_in_pinocchio(joint, mimic=mimic):
            continue
        own = q[..., at : at + joint.kind.nq]
        if joint.mimic:
            own = joint.mimic.multiplier * own + joint.mimic.offset
        if joint.kind.nq_pinocchio > joint.kind.nq:
            own = np.concatenate((own[..., :-1], np.cos(own[..., -1:]), np.sin(own[..., -1:])), axis=-1)
        blocks.append(check_range(own))
    converted = np.concatenate(blocks, axis=-1)
    if mimic and (omitted := [i for i, joint in enumerate(tree.joints) if joint.mimic]):
        check_turns(tree, omitted, q, from_pinocchio(tree, converted, mimic=True), tree.name)
    return converted


def from_pinocchio(tree: KinematicTree, q: FloatArray, *, mimic: bool = False) -> FloatArray:
    """Convert Pinocchio's configurations to urdfkin's.

    (cos, sin) of a continuous or planar joint becomes an angle in [-pi, pi]. `count_turns` adds the whole
    turns that the mimic joints show.
    """
    length = _pinocchio_length(tree, mimic=mimic)
    if q.shape[-1:] != (length,):
        other = q.ndim and q.shape[-1] == _pinocchio_length(tree, mimic=not mimic)
        raise InputError(
            "a Pinocchio configuration has the wrong length",
            where=tree.name,
            found=f"{q.shape}, expected (..., {length})",
            remedy=f"use mimic={not mimic} for a model of buildModelFromUrdf(..., mimic={not mimic})"
            if other
            else None,
            question=QuestionsSection.MIMIC_JOINTS if other else QuestionsSection.CONTINUOUS_JOINTS,
        )
    own, mimic_joints, at = np.zeros((*q.shape[:-1], tree.nq)), [], 0
    for i, joint in enumerate(tree.joints):
        if not _is_in_pinocchio(joint, mimic=mimic):
            continue
        size = joint.kind.nq_pinocchio
        values = q[..., at : at + size]
        if size > joint.kind.nq:
            angle = angle_of_pair(values[..., -2], values[..., -1], f"joint {joint.name}")
            values = np.concatenate((values[..., :-2], angle[..., None]), axis=-1)
        at += size
        if joint.mimic:
            mimic_joints.append((joint, tree.q_index[i], values))
        else:
            own[..., tree.q_index[i] : tree.q_index[i] + joint.kind.nq] = values
    for joint, mimicked_at in zip(tree.joints, tree.q_index, strict=True):
        if joint.kind is JointKind.CONTINUOUS and not joint.mimic:
            shown = [
                (one.mimic.multiplier, one.mimic.offset, values[..., 0], one.kind is JointKind.CONTINUOUS)
                for one, index, values in mimic_joints
                if one.mimic and index == mimicked_at
            ]
            own[..., mimicked_at] += math.tau * count_turns(own[..., mimicked_at], shown)
    for joint, mimicked_at, values in mimic_joints:
        _check_mimic_rule(joint, own[..., mimicked_at], values[..., 0])
    return own


def angle_of_pair(cosine: FloatArray, sine: FloatArray, where: str) -> FloatArray:
    norm = np.hypot(cosine, sine)
    if (np.abs(norm - 1.0) > NORM_TOLERANCE).any():
        raise InputError(
            "(cos, sin) must have norm 1",
            where=where,
            found=f"{norm.flat[np.abs(norm - 1.0).argmax()]:.9g}",
            question=QuestionsSection.CONTINUOUS_JOINTS,
        )
    return np.arctan2(sine, cosine)


#: Largest number of turns of either joint that `count_turns` finds from cosines and sines.
_MAX_TURNS = 16
#: Smallest |multiplier| for which `count_turns` counts the mimic joint's turns.
#: A much smaller multiplier fits any value within `_MIMIC_TOLERANCE`.
_MIN_MULTIPLIER = 1e-4


def count_turns(angle: FloatArray, shown: Sequence[tuple[float, float, FloatArray, bool]]) -> FloatArray:
    """Return the whole turns that mimic joints show in addition to a continuous joint's angle (rad).

    Each mimic joint has a multiplier, an offset and a value. True: the value is known only up to whole turns.
    If the values contradict the angle, the result has no meaning.

    >>> count_turns(np.array(0.5), [(0.5, 0.0, np.array(0.25 + math.pi), False)]).tolist()
    1.0
    """
    if not shown:
        return np.zeros(angle.shape)
    for multiplier, offset, value, is_pair in shown:
        if multiplier and not is_pair:
            return np.rint((value - offset - multiplier * angle) / (multiplier * math.tau))
    few = np.arange(-_MAX_TURNS, _MAX_TURNS + 1, dtype=np.float64)
    candidates = [np.broadcast_to(few, (*angle.shape, few.size))]
    # A gear of 1/50 turns once while its motor turns 50 times.
    candidates += [
        np.rint(((value - offset - multiplier * angle)[..., None] + math.tau * few) / (multiplier * math.tau))
        for multiplier, offset, value, _ in shown
        if _MIN_MULTIPLIER <= abs(multiplier) < 1.0
    ]
    turns = np.concatenate(candidates, axis=-1)
    # The first value that fits is nearest to 0: 0, 1, -1, 2, ... turns for a negative angle.
    away = (turns > 0.0) == (angle[..., None] > 0.0)
    turns = np.take_along_axis(turns, np.argsort(np.abs(turns) + 0.5 * away, axis=-1), axis=-1)
    fits = np.ones(turns.shape, bool)
    for multiplier, offset, value, _ in shown:
        rest = (value - offset - multiplier * angle)[..., None] - multiplier * math.tau * turns
        # With the rounding error, a very large multiplier would fit for any number of turns.
        rounding = np.where(turns == 0.0, _mimic_rounding(multiplier, offset, angle)[..., None], 0.0)
        fits &= np.abs(_without_turns(rest)) <= _MIMIC_TOLERANCE + rounding
    return np.take_along_axis(turns, fits.argmax(axis=-1)[..., None], axis=-1)[..., 0]


def _without_turns(angle: FloatArray) -> FloatArray:
    return np.arctan2(np.sin(angle), np.cos(angle))


def check_turns(
    tree: KinematicTree, joints: Sequence[int], q: FloatArray, recovered: FloatArray, where: str
) -> None:
    """Raise InputError if cosines and sines lose turns that move a joint of `joints`.

    `recovered` is q after the conversion to cosines and sines and back.
    """
    for i in joints:
        joint, at = tree.joints[i], tree.q_index[i]
        if not joint.kind.has_axis or not q.size:
            continue
        multiplier = joint.mimic.multiplier if joint.mimic else 1.0
        lost = multiplier * (q[..., at] - recovered[..., at])
        lost = np.abs(_without_turns(lost) if joint.kind.turns else lost)
        allowed = _MIMIC_TOLERANCE * max(1.0, abs(multiplier)) * np.maximum(1.0, np.abs(q[..., at]))
        if (lost > allowed).any():
            raise InputError(
                f"the cosine and sine of an angle lose whole turns, which move joint {joint.name}",
                where=where,
                found=f"a difference of {lost.max():.3g} {'rad' if joint.kind.turns else 'm'}",
                remedy="give an angle in [-pi, pi], or load with mimic=False (--no-mimic)",
                question=QuestionsSection.MIMIC_JOINTS,
            )


def _mimic_rounding(multiplier: float, offset: float, x: FloatArray) -> FloatArray:
    """Return the rounding error that is added to `_MIMIC_TOLERANCE`, for a mimic rule m x + c.

    | Rounding error | At most, in eps |
    |---|---|
    | cosine and sine of x, each 0.5; x = arctan2(sine, cosine), at most pi | 0.7 abs(m) + 1.6 abs(m) |
    | m x + c, in `to_pinocchio` and here: product and sum, each 0.5 | 2 abs(m x) + abs(c) |
    | cosine and sine of the mimic joint; arctan2 | less than `_MIMIC_TOLERANCE` |
    | sum, at most | 4.3 (abs(m) max(1, abs(x)) + abs(c)) |
    | allowed | 5 (abs(m) max(1, abs(x)) + abs(c)) |
    """
    return np.asarray(5.0 * EPS * (abs(multiplier) * np.maximum(1.0, np.abs(x)) + abs(offset)))


def _check_mimic_rule(joint: Joint, mimicked_joint: FloatArray, values: FloatArray) -> None:
    """Compare the values of a mimic joint with its rule m x + c."""
    rule = joint.mimic
    if rule is None or not values.size:
        return
    deviation = rule.multiplier * mimicked_joint + rule.offset - values
    if joint.kind is JointKind.CONTINUOUS:
        deviation = _without_turns(deviation)
    rounding = float(_mimic_rounding(rule.multiplier, rule.offset, mimicked_joint).max())
    if np.abs(deviation).max() > _MIMIC_TOLERANCE * max(1.0, float(np.abs(values).max())) + rounding:
        raise InputError(
            f"the mimic joint must be {rule.multiplier:g} * {rule.mimicked_joint} + {rule.offset:g}",
            where=f"joint {joint.name}",
            found=f"the value is off by {np.abs(deviation).max():.3g}",
            remedy="load with mimic=False to give the mimic joint its own coordinate",
            question=QuestionsSection.MIMIC_JOINTS,
        )


# -- random samples --------------------------------------------------------------------------------------

#: `sample` draws the positions of planar and floating joints from -2 to 2 m.
_MAX_SAMPLED_POSITION = 2.0


@dataclass(frozen=True, slots=True)
class Samples:
    q: FloatArray
    v: FloatArray
    a: FloatArray


def sample(tree: KinematicTree, n: int, rng: np.random.Generator) -> FloatArray:
    """Draw random configurations (n, nq) within `coordinate_ranges`."""
    return _uniform(tree, n, rng, coordinate_ranges(tree))


def _uniform(
    tree: KinematicTree, n: int, rng: np.random.Generator, ranges: dict[str, tuple[float, float]]
) -> FloatArray:
    q = np.empty((n, tree.nq))
    for joint, at in zip(tree.joints, tree.q_index, strict=True):
        if joint.nq == 1:
            q[:, at] = rng.uniform(*ranges[joint.name], (n, 1))[:, 0]
        elif joint.nq:
            q[:, at : at + joint.nq] = _SAMPLERS[joint.kind](n, rng)
    return q


def _sample_planar(n: int, rng: np.random.Generator) -> FloatArray:
    return np.hstack(
        (
            rng.uniform(-_MAX_SAMPLED_POSITION, _MAX_SAMPLED_POSITION, (n, 2)),
            rng.uniform(-math.pi, math.pi, (n, 1)),
        )
    )


def _sample_floating(n: int, rng: np.random.Generator) -> FloatArray:
    quaternion = rng.standard_normal((n, 4))
    quaternion /= np.linalg.norm(quaternion, axis=1, keepdims=True)
    return np.hstack((rng.uniform(-_MAX_SAMPLED_POSITION, _MAX_SAMPLED_POSITION, (n, 3)), quaternion))


_SAMPLERS = {JointKind.PLANAR: _sample_planar, JointKind.FLOATING: _sample_floating}


def zero_and_limit_configurations(tree: KinematicTree) -> FloatArray:
    """Return (3, nq): zero, all lower limits and all upper limits."""
    q = np.tile(neutral(tree), (3, 1))
    ranges = joint_ranges(tree)
    for joint, at in zip(tree.joints, tree.q_index, strict=True):
        if joint.nq == 1:
            q[1, at], q[2, at] = ranges[joint.name]
    return q


def draw_base_motion(n: int, rng: np.random.Generator) -> BaseMotion:
    placed = _sample_floating(n, rng)
    placement = np.tile(np.eye(4), (n, 1, 1))
    placement[:, :3, :3], placement[:, :3, 3] = rotation_from_quaternion(placed[:, 3:]), placed[:, :3]
    velocity, acceleration = rng.standard_normal((2, n, 6))
    velocity[::8] *= 100.0
    acceleration[::8] *= 100.0
    return BaseMotion(placement, velocity, acceleration)


def draw_samples(
    tree: KinematicTree, n: int, rng: np.random.Generator, *, with_zero_and_limits: bool
) -> Samples:
    """Draw random samples for a validation.

    A mimic joint may exceed its limits, because the equations are also valid there. In every eighth sample,
    large velocities make the quadratic terms of the acceleration dominant (7.129, 7.130).
    """
    q = _uniform(tree, n, rng, joint_ranges(tree))
    if with_zero_and_limits:
        q = np.concatenate((zero_and_limit_configurations(tree), q))
    v, a = rng.standard_normal((2, len(q), tree.nv))
    v[::8] *= 100.0
    a[::8] *= 100.0
    return Samples(q, v, a)
