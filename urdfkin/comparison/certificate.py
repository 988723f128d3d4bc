"""Write the result of `same` as a certificate, and recheck a certificate without a search."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from urdfkin.comparison.bounds import Search, pinocchios, tightened, urdfkins
from urdfkin.comparison.result import Difference, Interval, JointMap, Sameness
from urdfkin.comparison.verdict import CONFIRMED, Comparator, digest
from urdfkin.errors import InputError, UnknownNameError
from urdfkin.kinematics.roundings import EPS
from urdfkin.model.mechanisms.alignment import Alignment, FramePair, Gauge, Variables, variables_of
from urdfkin.model.mechanisms.matcher import align
from urdfkin.model.mechanisms.mechanism import JointTransform, apart, is_pose
from urdfkin.model.mechanisms.upper_bound import COARSE, FINE, upper_bounds
from urdfkin.model.tree import JointKind
from urdfkin.robot import Robot

#: Largest number of boxes at a time when a claimed bound is proven.
MOST_AGAIN = 2**22
#: Relative tolerance of a document's numbers between machines; absolute tolerance (m or rad) for zero.
_RELATIVE, _ZERO = 1e-9, 1e-15
#: Tolerance of a bound that is proven again, in eps of the bound: sums round differently on other machines.
_LAST_BITS = 64.0
#: The line of Pinocchio's confirmation, and the relative tolerance of its two digits.
_CONFIRMATION = (
    r"Pinocchio \S+ finds at most (?P<metres>\d+(\.\d+)?(e[+-]?\d+)?) m at (?P<count>\d+) configurations, "
    "within the bounds"
)
_TWO_DIGITS = 0.06
#: The layout of the document, and its version.
LAYOUT = "urdfkin-same-1"
#: Parts that follow from the alignment of the models.
DERIVED = ("after", "remarks", "joints", "orders", "links", "base", "base_links", "rounding")


def certificate(found: Sameness) -> dict[str, Any]:
    """Return the document: map, verdict, differences and the interval of each frame; null is "no bound"."""
    models = zip(found.names, found.sources, found.digests, strict=True)
    return {
        "schema": LAYOUT,
        **{
            k: dict(zip(("name", "source", "sha256"), model, strict=True))
            for k, model in zip("ab", models, strict=True)
        },
        "verdict": found.verdict.value,
        "after": list(found.after),
        "differences": [_difference(one) for one in found.differences],
        "remarks": [_difference(one) for one in found.remarks],
        "joints": [_joint(one) for one in found.joints],
        "orders": [list(names) for names in found.orders],
        "links": [list(pair) for pair in found.links],
        "base": found.base.tolist(),
        "base_links": list(found.base_links),
        "rounding": {"metres": found.rounding[0], "radians": found.rounding[1]},
        "frames": [_interval(frame) for frame in found.frames],
        "as_written": None if found.as_written is None else _interval(found.as_written),
        "checked": found.checked,
    }


def _joint(one: JointMap) -> dict[str, Any]:
    said = {"a": one.a, "b": one.b, "sense": one.sense, "offset": one.offset, "conversion": None}
    if (made := one.conversion) is not None:
        pair = {"before": made.before.tolist(), "behind": made.behind.tolist(), "back": made.back}
        said["conversion"] = pair
    return said


def _difference(one: Difference) -> dict[str, Any]:
    return {name: getattr(one, name) for name in ("place", "what", "words", "radians", "metres")}


def _interval(frame: Interval) -> dict[str, Any]:
    return {
        "a": frame.frame,
        "b": frame.frame_b,
        "lower": frame.lower,
        "upper": None if math.isinf(frame.upper) else frame.upper,
        "radians": None if math.isinf(frame.radians) else frame.radians,
        "radians_seen": frame.radians_seen,
        "q_a": list(frame.q_a),
        "q_b": list(frame.q_b),
    }


def recheck(document: Mapping[str, Any], a: Robot, b: Robot) -> list[str]:
    """Return the statements of a certificate that are wrong for two models; empty if all are right.

    The models are aligned as the certificate states, so no search is needed. The stated alignment must be
    allowed: its transforms are rigid motions, its joints exist, and the axes allow its orders. All statements
    that follow from the alignment are compared, including the remarks. Each lower bound is computed at its
    configuration by urdfkin and by Pinocchio. Each upper bound is proven again.

    Args:
        document: The result of `certificate`, checked against its schema.
        a: The first model.
        b: The second model.

    Raises:
        InputError: the certificate is about other texts, or names a joint or link that a model lacks.
    """
    for which, robot in (("a", a), ("b", b)):
        if document[which]["sha256"] != digest(robot):
            raise InputError(
                "the certificate is about another text",
                where=f"model {which.upper()}",
                found=f"SHA-256 {digest(robot)[:12]}..., not {document[which]['sha256'][:12]}...",
                remedy="compare the models again: urdfkin same A B",
            )
    try:
        return list(_errors(document, Comparator((a, b), {}, bounds=True)))
    except UnknownNameError as error:
        raise InputError(
            "the certificate names a joint or link that a model lacks", found=str(error)
        ) from error


def _errors(document: Mapping[str, Any], comparator: Comparator) -> Iterator[str]:
    gauge = _gauge(document)
    if (why := _not_a_gauge(document, gauge, comparator)) is not None:
        yield why
        return
    found = align(*comparator.mechanisms, {one["a"]: one["b"] for one in document["joints"]}, gauge)
    variables = variables_of(found, comparator.tolerance)
    said = comparator.said(found, variables)
    wrong = list(_statement_errors(document, comparator, said))
    yield from wrong
    claims = {(frame["a"], frame["b"]): frame for frame in document["frames"]}
    if len(claims) < len(document["frames"]):
        yield "a frame has two intervals"
    search = comparator.search(found, variables)
    for frame, names in zip(found.frames, said.links, strict=True):
        if (claim := claims.pop(names, None)) is None:
            yield f"frame {names[0]} has no interval"
        else:
            yield from _interval_errors(search, frame, claim, said.rounding, sharply=not wrong)
    yield from (f"frame {names[0]} is not a common frame of the models" for names in claims)
    if document["as_written"] is not None:
        yield from _as_written_errors(document["as_written"], comparator, found, sharply=not wrong)
    yield from _confirmation_errors(document["checked"], comparator, found, variables)


def _statement_errors(document: Mapping[str, Any], comparator: Comparator, said: Sameness) -> Iterator[str]:
    """Yield the wrong statements about names, verdict, differences and everything else without a proof."""
    for which, robot in zip("ab", comparator.robots, strict=True):
        if document[which]["name"] != robot.name:
            yield f"model {which.upper()}: its name is {robot.name}, not {document[which]['name']}"
    again = certificate(said)
    wrong = {one["words"]: one for one in again["differences"]}
    claimed = {one["words"]: one for one in document["differences"]}
    yield from (f"not listed as a difference: {words}" for words in wrong if words not in claimed)
    yield from (f"no difference: {words}" for words in claimed if words not in wrong)
    if len(claimed) < len(document["differences"]):
        yield "differences: one is listed twice"
    for words, one in claimed.items():
        if words in wrong and not _same_difference(one, wrong[words], said.rounding):
            yield f"differences: the size is wrong in: {words}"
    if document["verdict"] != said.verdict.value:
        yield f"the verdict is {said.verdict.value}, not {document['verdict']}"
    yield from (
        f"{part}: not what the models give" for part in DERIVED if not _equal(document[part], again[part])
    )


def _same_difference(
    claimed: Mapping[str, Any], said: Mapping[str, Any], rounding: tuple[float, float]
) -> bool:
    """Return whether place, parameter and sizes of a difference agree, sizes within rounding."""
    sizes = zip(("metres", "radians"), rounding, strict=True)
    return all(claimed[part] == said[part] for part in ("place", "what")) and all(
        math.isclose(claimed[part], said[part], rel_tol=_RELATIVE, abs_tol=most) for part, most in sizes
    )


def _confirmation_errors(
    claimed: str, comparator: Comparator, found: Alignment, variables: Variables
) -> Iterator[str]:
    """Yield the wrong statements about Pinocchio's confirmation; a skipped check claims nothing."""
    if claimed.startswith(("not asked of Pinocchio: ", "not verified by Pinocchio: ")):
        return
    said = re.fullmatch(_CONFIRMATION, claimed)
    if said is None or int(said["count"]) != CONFIRMED:
        yield "checked: not a confirmation in the form that urdfkin writes"
        return
    off, rounding = (
        float(comparator.pinocchio_distances(found, variables).max(initial=0.0)),
        comparator.rounding(found, variables)[0],
    )
    if not math.isclose(float(said["metres"]), off, rel_tol=_TWO_DIGITS, abs_tol=rounding):
        yield f"checked: Pinocchio finds at most {off:.2g} m, not {said['metres']} m"


def _gauge(document: Mapping[str, Any]) -> Gauge:
    """Return the gauge that the document states: base, senses, zeros, conversions and orders."""
    joints, base = document["joints"], document["base_links"]
    return Gauge(
        (base[0], base[1]),
        np.array(document["base"]),
        {one["a"]: (one["sense"], one["offset"]) for one in joints},
        {
            one["a"]: JointTransform(np.array(made["before"]), np.array(made["behind"]), made["back"])
            for one in joints
            if (made := one["conversion"]) is not None
        },
        tuple(tuple(names) for names in document["orders"]),
    )


def _not_a_gauge(document: Mapping[str, Any], gauge: Gauge, comparator: Comparator) -> str | None:
    """Return why the stated gauge is not allowed; None if it is allowed."""
    a, b = comparator.mechanisms
    for joint in document["joints"]:
        a.tree.joint_index(joint["a"])
        b.tree.joint_index(joint["b"])
    if not is_pose(JointKind.FLOATING, gauge.X):
        return "base: not a rigid motion"
    for name, made in gauge.conversions.items():
        if not made.holds_for(a.tree.joints[a.tree.joint_index(name)].kind):
            return f"joint {name}: its conversion is not possible for a joint of this kind"
    for names in gauge.orders:
        if not b.may_be_taken(names, comparator.tolerance):
            return f"orders: the axes do not allow {', '.join(names)}"
        b = b.in_order(names)
    return None


def _equal(claimed: Any, said: Any) -> bool:
    """Return whether two parts of a document are equal, numbers except for their last digits."""
    if isinstance(said, dict):
        return claimed.keys() == said.keys() and all(_equal(claimed[key], said[key]) for key in said)
    if isinstance(said, list):
        return len(claimed) == len(said) and all(map(_equal, claimed, said))
    if isinstance(said, float) and isinstance(claimed, float | int):
        return math.isclose(claimed, said, rel_tol=_RELATIVE, abs_tol=_ZERO)
    return bool(claimed == said)


def _as_written_errors(
    claim: Mapping[str, Any], comparator: Comparator, found: Alignment, *, sharply: bool
) -> Iterator[str]:
    """Yield the wrong statements about the largest distance of a frame as written."""
    written = comparator.as_written(found)
    variables = variables_of(written, comparator.tolerance)
    names = [
        (comparator.trees[0].links[frame.a], comparator.trees[1].links[frame.b]) for frame in written.frames
    ]
    if (claim["a"], claim["b"]) not in names:
        yield f"as written: frame {claim['a']} is not a common frame of the models"
        return
    frame = written.frames[names.index((claim["a"], claim["b"]))]
    search, rounding = comparator.search(written, variables), comparator.rounding(written, variables)
    problems = _interval_errors(search, frame, claim, rounding, sharply=sharply)
    yield from (f"as written: {line}" for line in problems)


def _interval_errors(
    search: Search,
    frame: FramePair,
    claim: Mapping[str, Any],
    rounding: tuple[float, float],
    *,
    sharply: bool,
) -> Iterator[str]:
    """Yield the wrong statements about an interval: compute its lower bound, prove its upper bounds.

    Args:
        search: Both robots.
        frame: The frame.
        claim: The document's statement about the frame.
        rounding: (m, rad) that counts as zero.
        sharply: Whether to prove an upper bound by branch and bound; useless if another part is wrong.
    """
    problems = list[str]()
    if claim["lower"] > 0.0 or claim["radians_seen"] > 0.0:
        problems += _not_attained(search, frame, claim, rounding)
    yield from problems
    metres = (math.inf if claim["upper"] is None else claim["upper"]) - rounding[0]
    radians = (math.inf if claim["radians"] is None else claim["radians"]) - rounding[1]
    for grid in (COARSE, FINE):
        proven = upper_bounds(search.found, search.variables, frame, grid)
        if holds := _within(proven[0], metres, rounding[0]) and _within(proven[1], radians, rounding[1]):
            break
    if holds:
        return
    place = f"frame {claim['a']}"
    if _within(proven[1], radians, rounding[1]):
        if problems or not sharply:
            return
        # A claimed bound below an attained distance cannot be proven.
        attained = max(claim["lower"], float(search.seen([frame])[0].max()))
        if metres < attained - 2.0 * rounding[0]:
            yield f"{place}: its upper bound is wrong: {attained:.6g} m is attained"
            return
        proven = tightened(search, frame, metres, proven[0], MOST_AGAIN), proven[1]
        if _within(proven[0], metres, rounding[0]):
            return
    yield f"{place}: its upper bound is not proven; {proven[0]:.6g} m and {proven[1]:.6g} rad are proven"


def _not_attained(
    search: Search, frame: FramePair, claim: Mapping[str, Any], rounding: tuple[float, float]
) -> Iterator[str]:
    """Yield why a lower bound is wrong: its configurations, or the distance that a library finds there."""
    place = f"frame {claim['a']}"
    q_a, q_b = np.array([claim["q_a"]]), np.array([claim["q_b"]])
    if not search.belong_together(q_a, q_b):
        yield f"{place}: its configurations do not correspond to each other, or leave the limits"
        return
    for computed, by in ((urdfkins, "urdfkin"), (pinocchios, "Pinocchio")):
        turned, off = apart(*(Ts[0, 0] for Ts in search.poses_at(q_a, q_b, [frame], computed)))
        if off < claim["lower"] - rounding[0]:
            yield f"{place}: {by} finds {off:.6g} m at its configuration, not {claim['lower']:.6g} m"
        if turned < claim["radians_seen"] - rounding[1]:
            yield f"{place}: {by} finds {turned:.6g} rad there, not {claim['radians_seen']:.6g} rad"


def _within(proven: float, claimed: float, rounding: float) -> bool:
    """Return whether the proven bound confirms the claimed one, except for rounding."""
    return proven <= claimed + rounding + _LAST_BITS * EPS * abs(claimed) if math.isfinite(claimed) else True
