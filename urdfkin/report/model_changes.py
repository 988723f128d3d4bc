"""What changed about a robot itself between two reports: joints, their axes, places, limits and leaders."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from urdfkin.dh.snapping import rotation_angle
from urdfkin.model.described import axis_words, rule_words
from urdfkin.model.mechanisms.mechanism import Tolerance
from urdfkin.report.document import Joint, Model
from urdfkin.sameness.result import angle, length
from urdfkin.sameness.wording import pose_words

#: Texts longer than this say no more.
_LONGEST = 200
#: Digits of a pose that are told; how far it is from the old one says the rest.
_TOLD = Tolerance(1e-9, 1e-9)


def model_changes(old: Model | None, new: Model | None) -> Iterator[tuple[str, str, str]]:
    """What, before, after; empty words where it was not there."""
    before, after = _joints(old), _joints(new)
    for name in dict.fromkeys([*before, *after]):
        was, now = before.get(name), after.get(name)
        if was is None or now is None:
            yield f"joint {name}", was["kind"] if was else "", now["kind"] if now else ""
            continue
        for aspect, first, second in _joint_changes(was, now):
            yield f"joint {name}, {aspect}", _cut(first), _cut(second)
    if old is not None and new is not None:
        for entry, what in (("base", "base frame"), ("tip", "tip frame"), ("coordinates", "coordinates")):
            frames = dict(old)[entry], dict(new)[entry]
            if frames[0] != frames[1]:
                yield what, _cut(_names(frames[0])), _cut(_names(frames[1]))


def _joints(model: Model | None) -> dict[str, Joint]:
    return {joint["name"]: joint for joint in model["joints"]} if model else {}


def _joint_changes(was: Joint, now: Joint) -> Iterator[tuple[str, str, str]]:
    """The same of one joint: lengths and angles as people say them."""
    for entry, aspect in (("kind", "kind"), ("parent", "parent link"), ("child", "child link")):
        if dict(was)[entry] != dict(now)[entry]:
            yield aspect, str(dict(was)[entry]), str(dict(now)[entry])
    if was["axis"] != now["axis"]:
        first, second = (axis_words(axis) if axis else "none" for axis in (was["axis"], now["axis"]))
        yield "axis", first, second + _turned(was["axis"], now["axis"])
    if was["placement"] != now["placement"]:
        Ts = [np.array(joint["placement"]) for joint in (was, now)]
        away = length(float(np.linalg.norm(Ts[1][:3, 3] - Ts[0][:3, 3])))
        turned = angle(float(rotation_angle(Ts[0][:3, :3], Ts[1][:3, :3])))
        first, second = (pose_words(T, _TOLD) for T in Ts)
        yield "origin", first, f"{second}: {away} away, turned by {turned}"
    limits = [dict(joint["limit"] or {}) for joint in (was, now)]
    for entry in ("lower", "upper", "velocity", "effort"):
        bounds = [limit.get(entry) for limit in limits]
        if bounds[0] != bounds[1]:
            first, second = ("none" if bound is None else f"{bound:.12g}" for bound in bounds)
            yield f"{entry} limit", first, second
    if was["mimic"] != now["mimic"]:
        yield "leader", _rule(was), _rule(now)


def _turned(first: Sequence[float] | None, second: Sequence[float] | None) -> str:
    if not first or not second:
        return ""
    a, b = np.array(first), np.array(second)
    return f", turned by {angle(float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)))}"


def _rule(joint: Joint) -> str:
    rule = joint["mimic"]
    return rule_words(rule["leader"], rule["multiplier"], rule["offset"]) if rule else "none"


def _names(value: Any) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def _cut(text: str) -> str:
    return text if len(text) <= _LONGEST else text[: _LONGEST - 4] + " ..."
