"""What changed about a robot itself between two reports: joints, their axes, places, limits and leaders."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from urdfkin.report.document import Joint, Model

#: What is told of a joint, and the entry that holds it.
_ASPECTS = {
    "kind": "kind",
    "parent link": "parent",
    "child link": "child",
    "axis": "axis",
    "placement": "placement",
    "limits": "limit",
    "mimic": "mimic",
}
#: Texts longer than this say no more.
_LONGEST = 200


def model_changes(old: Model | None, new: Model | None) -> Iterator[tuple[str, str, str]]:
    """What, before, after; empty words where it was not there."""
    before, after = _joints(old), _joints(new)
    for name in dict.fromkeys([*before, *after]):
        was, now = before.get(name), after.get(name)
        if was is None or now is None:
            yield f"joint {name}", was["kind"] if was else "", now["kind"] if now else ""
            continue
        for aspect, entry in _ASPECTS.items():
            first, second = _entry(was, entry), _entry(now, entry)
            if first != second:
                yield f"joint {name}, {aspect}", _words(first), _words(second)
    if old is not None and new is not None:
        for entry, what in (("base", "base frame"), ("tip", "tip frame"), ("coordinates", "coordinates")):
            first, second = dict(old)[entry], dict(new)[entry]
            if first != second:
                yield what, _words(first), _words(second)


def _joints(model: Model | None) -> dict[str, Joint]:
    return {joint["name"]: joint for joint in model["joints"]} if model else {}


def _entry(joint: Joint, name: str) -> Any:
    return dict(joint)[name]


def _words(value: Any) -> str:
    """A value in a line: a pose as its rotation and its origin, numbers short."""
    if isinstance(value, dict):
        return _cut(", ".join(f"{key} {_words(each)}" for key, each in value.items()))
    if isinstance(value, list):
        return _cut(f"[{' '.join(map(_words, value))}]")
    if isinstance(value, float):
        return repr(value)
    return _cut("none" if value is None else str(value))


def _cut(text: str) -> str:
    return text if len(text) <= _LONGEST else text[: _LONGEST - 4] + " ..."
