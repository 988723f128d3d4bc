"""Whether two models are one robot, to read: on a terminal and as Markdown."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from urdfkin.errors.printable import markdown_text
from urdfkin.report.terminal import plain_table
from urdfkin.report.words import counted
from urdfkin.sameness.result import (
    BOUNDED,
    Interval,
    Question,
    Sameness,
    Verdict,
    angle,
    length,
    up_to,
)

if TYPE_CHECKING:
    from rich.console import Console

#: Lines of a kind that are shown unless all are asked for.
SHOWN = 12
#: Where models differ and names did not say which joints are each other's.
GUESSED = "by how joints lie, since names do not tell; if other pairs are meant, --map says so"
HEADS = ("frame", "at least", "at most", "turned at most")
#: Of an interval: radians that are attained, and that are proven.
TURNED = ("radians_seen", "radians")
#: What is asked unless something else is.
EQUIVALENT = Question()
#: A bound that is rounding may be larger than it by so much: sums round too.
DUST = 1.001
#: Above lines about joints whose mimic joints leave their limits.
NARROWED = "limits of mimic joints, which intervals do not keep"


def headline(found: Sameness, question: Question = EQUIVALENT) -> str:
    """The answer to what was asked, in a line."""
    limits = sum(one.what == "limits" for one in found.remarks)
    besides = f"; limits of {counted(limits, 'joint')} differ" if limits else ""
    if question.within is not None:
        return _within(found, question.within) + besides
    if found.verdict is Verdict.DIFFERS:
        by = _by(found.frames, found.rounding)
        if found.frames and not by:
            by = ", though no frame of both is off by more than rounding"
        return f"DIFFERS{by}; first here: {found.differences[0].words}{besides}"
    metres, radians = found.rounding
    off = f"no frame is off by more than rounding, {length(metres)} and {angle(radians)}"
    if found.verdict is Verdict.SAME:
        return f"SAME: in every configuration {off}{besides}"
    written = f"; {as_written(found)}" if as_written(found) else ""
    return f"EQUIVALENT up to {', '.join(found.up_to)}: in every configuration {off}{written}{besides}"


def _within(found: Sameness, most: float) -> str:
    """Whether frames are off by no more, metres and radians, and which is not."""
    asked = f"WITHIN {most:g} m and rad: as written, "
    if found.within(most):
        return f"{asked}no frame is ever off by more than {_both(*found.written)}"
    if (beyond := next((one for one in found.differences if one.what not in BOUNDED), None)) is not None:
        return f"NOT {asked}{beyond.words}"
    frames = (found.as_written,) if found.as_written is not None else found.frames
    far = [one for one in frames if one.lower > most or one.radians_seen > most]
    if far:
        worst = max(far, key=lambda one: (one.lower, one.radians_seen))
        return f"NOT {asked}{worst.frame} is {_off(worst, found.rounding)} off"
    return f"NOT {asked}no frame is proven to be off by less than {_both(*found.written)}"


def _both(metres: float, radians: float) -> str:
    return f"{length(metres)} and {angle(radians)}"


def _by(frames: Sequence[Interval], rounding: tuple[float, float]) -> str:
    """By how much frames are apart, metres and radians, whichever is more than rounding; empty: neither."""
    lower, upper = (max((getattr(one, end) for one in frames), default=0.0) for end in ("lower", "upper"))
    seen, radians = (max((getattr(one, end) for one in frames), default=0.0) for end in TURNED)
    parts: list[tuple[Callable[[float], str], float, float]] = []
    parts += [(length, lower, upper)] if upper > DUST * rounding[0] else []
    parts += [(angle, seen, radians)] if radians > DUST * rounding[1] else []
    if any(math.isinf(most) for _, _, most in parts):
        least = " and ".join(f"{words(low)} or more" for words, low, _ in parts if low)
        return f" by {least} (no bound is proven)" if least else ", and no bound is proven"
    return f" by up to {' and '.join(up_to(*one) for one in parts)}" if parts else ""


def _off(frame: Interval, rounding: tuple[float, float]) -> str:
    """How far one frame is off, metres and radians, whichever is more than rounding; empty: neither."""
    parts = [up_to(length, frame.lower, frame.upper)] if frame.upper > DUST * rounding[0] else []
    parts += [up_to(angle, frame.radians_seen, frame.radians)] if frame.radians > DUST * rounding[1] else []
    return " and ".join(parts)


def far_frames(found: Sameness) -> list[Interval]:
    """Frames that may be off by more than rounding, the farthest first."""
    return sorted(
        (
            frame
            for frame in found.frames
            if frame.upper > found.rounding[0] or frame.radians > found.rounding[1]
        ),
        key=lambda frame: (-frame.upper, -frame.lower),
    )


def rows(frames: Sequence[Interval]) -> list[list[str]]:
    """A table's, under `HEADS`."""
    return [[frame.frame, length(frame.lower), length(frame.upper), angle(frame.radians)] for frame in frames]


def as_written(found: Sameness) -> str:
    """How far a frame is off where nothing is put right; empty where that is no more than rounding."""
    frame = found.as_written
    off = "" if frame is None else _off(frame, found.rounding)
    return f"as written, {frame.frame} is {off} off" if frame is not None and off else ""


def where(found: Sameness, frame: Interval) -> str:
    """At which configuration a lower bound is attained, in A's coordinates with their units."""
    from urdfkin.model.configuration import coordinate_names, units  # noqa: PLC0415

    names = zip(coordinate_names(found.trees[0]), units(found.trees[0], "q"), frame.q_a, strict=False)
    some = [f"{name} {value:.6g} {unit}".rstrip() for name, unit, value in names if value]
    return ", ".join(some) or "the zero configuration"


def renamed(found: Sameness) -> list[str]:
    """Joints and links that are called otherwise."""
    joints = [f"joint {one.a} is {one.b}" for one in found.joints if one.a != one.b]
    joints += [
        f"joints of B stand in another order, which their axes allow; taken as {', '.join(names)}"
        for names in found.orders
    ]
    if joints and not found:
        joints = [GUESSED, *joints]
    return joints + [f"link {ours} is {theirs}" for ours, theirs in found.links if ours != theirs]


def print_sameness(
    found: Sameness, out: Console, question: Question = EQUIVALENT, *, all_: bool = False
) -> None:
    """Print the answer and what it rests on; every line reads without colour.

    Args:
        found: What `same` found.
        out: Where to.
        question: What was asked.
        all_: Whether every line is shown, not the first dozen of a kind.
    """
    for which, name, source in zip("AB", found.names, found.sources, strict=True):
        out.print(f"{which}: {name} ({source})", soft_wrap=True)
    head = headline(found, question)
    out.print(head, style="bold green" if found.holds(question) else "bold red", soft_wrap=True)
    some = None if all_ else SHOWN
    _print_lines(out, "after", found.after, some)
    if found.after and as_written(found) not in head:
        _print_lines(out, "", [as_written(found)], some)
    words = [one.words for one in found.differences]
    _print_lines(out, "differences", words[1:] if words and words[0] in head else words, some)
    frames = far_frames(found)
    if frames:
        out.print("largest distance over all configurations within limits:")
        out.print(plain_table(list(HEADS), rows(frames[:some]), words=(0,)))
        _left(out, len(frames), some)
        if off := attained(frames[0]):
            out.print(f"{frames[0].frame} is {off} off at: {where(found, frames[0])}", soft_wrap=True)
    _print_lines(out, NARROWED, found.narrowed, some)
    _print_lines(out, "called otherwise", renamed(found), some)
    _print_lines(out, "besides", [one.words for one in found.remarks], some)
    out.print(found.checked, soft_wrap=True)


def attained(frame: Interval) -> str:
    """How far a frame is off at its configuration; empty where that is nothing."""
    parts = [length(frame.lower)] if frame.lower else []
    parts += [angle(frame.radians_seen)] if frame.radians_seen and not frame.lower else []
    return " and ".join(parts)


def _print_lines(out: Console, head: str, lines: Sequence[str], some: int | None) -> None:
    if not lines or not any(lines):
        return
    if head:
        out.print(f"{head}:")
    for line in lines[:some]:
        out.print(f"  {line}", soft_wrap=True)
    _left(out, len(lines), some)


def _left(out: Console, n: int, some: int | None) -> None:
    if some is not None and n > some:
        out.print(f"  ... and {n - some} more: --all shows them")


def markdown_of(found: Sameness, question: Question = EQUIVALENT) -> str:
    """The answer, for a pull request's comment."""
    mark = "✅" if found.holds(question) else "❌"
    text = markdown_text
    names = " and ".join(
        text(f"{name} ({source})") for name, source in zip(found.names, found.sources, strict=True)
    )
    lines = [f"## {mark} {text(headline(found, question))}", "", names, ""]
    for head, words in (
        ("After", [*found.after, as_written(found)] if found.after else []),
        ("Differences", [one.words for one in found.differences]),
        (NARROWED.capitalize(), found.narrowed),
        ("Called otherwise", renamed(found)),
        ("Besides", [one.words for one in found.remarks]),
    ):
        if words:
            lines += [f"**{head}**", ""]
            lines += [f"- {text(word)}" for word in words[: 4 * SHOWN]]
            lines += [f"- {counted(len(words) - 4 * SHOWN, 'more line')}"] if len(words) > 4 * SHOWN else []
            lines.append("")
    frames = far_frames(found)
    if frames:
        lines += ["Largest distance over all configurations within limits:", ""]
        lines += [f"| {' | '.join(HEADS)} |", "| --- | ---: | ---: | ---: |"]
        lines += [f"| {' | '.join(map(text, row))} |" for row in rows(frames[: 4 * SHOWN])]
        lines.append("")
    return "\n".join([*lines, text(found.checked), ""])
