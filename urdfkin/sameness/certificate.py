"""What `same` found as data that another can check again without searching."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from urdfkin.errors import InputError, UnknownNameError
from urdfkin.kinematics.roundings import EPS
from urdfkin.model.mechanisms.alignment import FramePair, Gauge, align
from urdfkin.model.mechanisms.conversion import Conversion
from urdfkin.model.mechanisms.upper import COARSE, FINE, upper_bounds
from urdfkin.model.mechanisms.variables import variables_of
from urdfkin.robot import Robot
from urdfkin.sameness.boxes import tightened
from urdfkin.sameness.judging import Judge, digest
from urdfkin.sameness.lower import Search, pinocchios, urdfkins
from urdfkin.sameness.result import Difference, Interval, JointMap, Sameness, Verdict
from urdfkin.sameness.wording import differences, put_right

#: How many boxes there may be at a time to prove a bound that is claimed.
MOST_AGAIN = 2**22
#: The layout of the document, and its version.
LAYOUT = "urdfkin-same-1"


def certificate(found: Sameness) -> dict[str, Any]:
    """The document: map, verdict, differences, and of each frame its interval; null is "no bound"."""
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
    """What of a certificate does not hold for two models; nothing where all of it does.

    The models are laid on each other as the certificate says, so that nothing is searched: what then differs
    must be what it names; each lower bound is computed at its configuration, each upper bound proven again.

    Args:
        document: What `certificate` made, checked against its schema.
        a: The first model.
        b: The second.

    Raises:
        InputError: it was made of other texts, or names what these models do not have.
    """
    for which, robot in (("a", a), ("b", b)):
        if document[which]["sha256"] != digest(robot):
            raise InputError(
                "the certificate was made of another text",
                where=f"model {which.upper()}",
                found=f"SHA-256 {digest(robot)[:12]}..., not {document[which]['sha256'][:12]}...",
                remedy="compare the models anew: urdfkin same A B",
            )
    try:
        return list(_against(document, Judge((a, b), {}, bounds=True)))
    except UnknownNameError as error:
        raise InputError("the certificate names what a model does not have", found=str(error)) from error


def _against(document: Mapping[str, Any], judge: Judge) -> Iterator[str]:
    zeros = {one["a"]: (one["sense"], one["offset"]) for one in document["joints"]}
    given = {one["a"]: one["b"] for one in document["joints"]}
    base = document["base_links"]
    conversions = {
        one["a"]: Conversion(np.array(made["before"]), np.array(made["behind"]), made["back"])
        for one in document["joints"]
        if (made := one["conversion"]) is not None
    }
    orders = tuple(tuple(names) for names in document["orders"])
    gauge = Gauge((base[0], base[1]), np.array(document["base"]), zeros, conversions, orders)
    found = align(*judge.mechanisms, given, gauge)
    variables = variables_of(found, judge.tolerance)
    after = put_right(found, judge.tolerance)
    wrong = [one.words for one in differences(found, variables)]
    claimed = [one["words"] for one in document["differences"]]
    yield from (f"not named as a difference: {words}" for words in wrong if words not in claimed)
    yield from (f"no difference: {words}" for words in claimed if words not in wrong)
    verdict = Verdict.DIFFERS if wrong else Verdict.SAME_AFTER if after else Verdict.SAME
    if document["verdict"] != verdict.value:
        yield f"the verdict is {verdict.value}, not {document['verdict']}"
    rounding = judge.rounding(found, variables)
    claims = {frame["a"]: frame for frame in document["frames"]}
    search = judge.search(found, variables)
    for frame in found.frames:
        name = found.a.tree.links[frame.a]
        if (claim := claims.pop(name, None)) is None:
            yield f"frame {name} has no interval"
            continue
        metres = (math.inf if claim["upper"] is None else claim["upper"]) - rounding[0]
        radians = (math.inf if claim["radians"] is None else claim["radians"]) - rounding[1]
        for grid in (COARSE, FINE):
            proven = upper_bounds(found, variables, frame, grid)
            if holds := _within(proven[0], metres, rounding[0]) and _within(proven[1], radians, rounding[1]):
                break
        # A claim below what is attained is not searched for: no search could prove it.
        possible = metres >= claim["lower"] - rounding[0]
        if not holds and possible and _within(proven[1], radians, rounding[1]):
            proven = tightened(search, frame, metres, proven[0], MOST_AGAIN), proven[1]
            holds = _within(proven[0], metres, rounding[0])
        if not holds:
            are = f"{proven[0]:.6g} m and {proven[1]:.6g} rad are"
            yield f"frame {name}: its upper bound is not proven, {are}"
        if claim["lower"] > 0.0:
            yield from _not_attained(search, frame, claim, rounding[0])
    yield from (f"frame {name} is not one of both models" for name in claims)


def _not_attained(
    search: Search, frame: FramePair, claim: Mapping[str, Any], rounding: float
) -> Iterator[str]:
    """Why a lower bound is none: its configurations, or what either library finds there."""
    place = f"frame {claim['a']}"
    q_a, q_b = np.array([claim["q_a"]]), np.array([claim["q_b"]])
    if not search.belong_together(q_a, q_b):
        yield f"{place}: its configurations do not belong together, or leave the limits"
        return
    for computed, by in ((urdfkins, "urdfkin"), (pinocchios, "Pinocchio")):
        off = float(search.at(q_a, q_b, [frame], computed)[0, 0])
        if off < claim["lower"] - rounding:
            yield f"{place}: {by} finds {off:.6g} m at its configuration, not {claim['lower']:.6g} m"


def _within(proven: float, claimed: float, rounding: float) -> bool:
    """Whether a bound that is proven allows the one that is claimed: both round, the same way or not."""
    return proven <= claimed + rounding + 64.0 * EPS * abs(claimed) if math.isfinite(claimed) else True
