"""Whether two models are one robot, to read: on a terminal and as Markdown.

Whether two models are one robot, as a page: verdict, intervals, both at the worst configuration.

Reading what `urdfkin same --certificate` wrote: JSON that keeps to its published schema.
"""

from __future__ import annotations

import json
import math
import shlex
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from urdfkin.comparison.certificate import LAYOUT
from urdfkin.comparison.result import BOUNDED, Interval, Question, Sameness, Verdict, angle, length, up_to
from urdfkin.comparison.verdict import base_as_written
from urdfkin.errors.escape import markdown_text
from urdfkin.kinematics.roundings import NOT_ZERO
from urdfkin.model.mechanisms.mechanism import Mechanism
from urdfkin.model.pose import inverse
from urdfkin.model.tree import FloatArray
from urdfkin.report.document import asset
from urdfkin.report.html import as_is, environment, when
from urdfkin.report.reading import keeps_to, read_json
from urdfkin.report.terminal import plain_table
from urdfkin.report.words import counted
from urdfkin.robot import Robot
from urdfkin.validation.results import versions

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
    seen_some = [up_to(*one) for one in parts if one[1] > 0.0]
    bounded = [words(most) for words, low, most in parts if low <= 0.0]
    texts = [f"up to {' and '.join(seen_some)}"] if seen_some else []
    texts += [f"at most {' and '.join(bounded)}"] if bounded else []
    return f" by {', and '.join(texts)}" if texts else ""


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


#: The picture's half side, and how much of it the robots take, in its own units.
HALF, FILLED = 150.0, 0.9
#: Of the picture's side what its scale takes at most, and where it stands: up from the lower edge.
SCALE, FOOT = 0.3, 6.0
#: Of a frame's axes in the close view, as a share of it.
AXIS = 0.35
#: Two ways to look: from ahead and to the left, a little from above; and along the same way from the side.
VIEWS = (("from the front", 0.6, 0.35), ("from the side", 0.6 + np.pi / 2.0, 0.35))


def as_html(
    found: Sameness,
    robots: tuple[Robot, Robot],
    question: Question = EQUIVALENT,
    options: Sequence[str] = (),
    started: datetime | None = None,
) -> str:
    """The page, which answers what was asked. Names may be anything: the template escapes them all.

    Args:
        found: What `same` found.
        robots: A and B.
        question: What was asked.
        options: Of the command that repeats it, besides the question.
        started: When; None: now.
    """
    moment = started or datetime.now(UTC)
    frames = far_frames(found)
    written = question.within is not None and found.as_written is not None
    worst = found.as_written if written else frames[0] if frames and frames[0].q_a else None
    return (
        environment()
        .get_template("same.html.j2")
        .render(
            found=found,
            headline=headline(found, question),
            good=found.holds(question),
            narrowed=found.narrowed,
            narrowed_head=NARROWED.capitalize(),
            started=moment.isoformat(timespec="seconds"),
            when=when(moment.isoformat(timespec="seconds")),
            versions=versions(),
            command=_command(robots, question, options),
            heads=HEADS,
            frames=rows(frames),
            as_written=as_written(found),
            renamed=renamed(found),
            where=where(found, worst) if worst else "",
            pictures=pictures(found, robots, worst, written=written),
            title=f"Where {worst.frame} is {attained(worst)} off{' as written' if written else ''}"
            if worst and attained(worst)
            else "Both, at the zero configuration",
            style=as_is(asset("report.css")),
        )
    )


def _command(robots: tuple[Robot, Robot], question: Question, options: Sequence[str]) -> str:
    """The command line that asks the same again."""
    words = [robot.origin.words for robot in robots]
    words += [] if question.within is None else [f"--within {question.within!r}"]
    words += ["--strict"] if question.strict else []
    return " ".join(["urdfkin same", *words, *map(shlex.quote, options)])


def pictures(
    found: Sameness, robots: tuple[Robot, Robot], worst: Interval | None, *, written: bool = False
) -> list[dict[str, Any]]:
    """Both robots' skeletons from two sides, and the frame close by: lines (x, y, x, y) for A and for B.

    Args:
        found: What `same` found.
        robots: A and B.
        worst: The frame and the configurations; None: the zero configuration.
        written: Whether B stands as it is written, not where it is equivalent to A.
    """
    a, b = robots
    q_a = np.array(worst.q_a) if worst else a.neutral()
    q_b = np.array(worst.q_b) if worst else found.to_b(a.neutral())
    T_a = a.placement(q_a, a.link_frames, verify=False)
    T_b = b.placement(q_b, b.link_frames, verify=False)
    ours, theirs = Mechanism(a.tree), Mechanism(b.tree)
    if written:
        T_b = T_a[0] @ base_as_written(ours, theirs) @ inverse(T_b[0]) @ T_b
    else:
        i, j = a.tree.link_index(found.base_links[0]), b.tree.link_index(found.base_links[1])
        T_b = T_a[i] @ inverse(ours.homes[i]) @ found.base @ theirs.homes[j] @ inverse(T_b[j]) @ T_b
    bones = _bones(a, T_a), _bones(b, T_b)
    drawn = [_drawn(title, turn, tip, bones) for title, turn, tip in VIEWS]
    if worst is not None:
        at = T_a[a.tree.link_index(worst.frame)], T_b[b.tree.link_index(worst.frame_b)]
        room = float(np.linalg.norm(at[0][:3, 3] - at[1][:3, 3]))
        if room > 0.0:
            axes = tuple(_axes(T, AXIS * room) for T in at)
            gap = np.stack((at[0][:3, 3], at[1][:3, 3]))[np.newaxis]
            drawn.append(_drawn(f"{worst.frame}, close by", *VIEWS[0][1:], (axes[0], axes[1]), gap))
    return drawn


def _bones(robot: Robot, Ts: FloatArray) -> FloatArray:
    """(joints, 2, 3) from each link to the links that hang on it."""
    ends = [(Ts[joint.parent, :3, 3], Ts[i + 1, :3, 3]) for i, joint in enumerate(robot.tree.joints)]
    return np.array(ends).reshape(-1, 2, 3)


def _axes(T: FloatArray, size: float) -> FloatArray:
    """(3, 2, 3) a frame's axes."""
    origin = np.tile(T[:3, 3], (3, 1))
    return np.stack((origin, origin + size * T[:3, :3].T), axis=1)


def _drawn(
    title: str, turn: float, tip: float, lines: tuple[FloatArray, FloatArray], gap: FloatArray | None = None
) -> dict[str, Any]:
    """A view: seen from a direction, fitted into the picture."""
    c, s, up, down = np.cos(turn), np.sin(turn), np.cos(tip), np.sin(tip)
    seen = np.array([[-s, c, 0.0], [down * c, down * s, -up]])  # right, and down the page
    flat = [x @ seen.T for x in (*lines, np.zeros((0, 2, 3)) if gap is None else gap)]
    points = np.concatenate([x.reshape(-1, 2) for x in flat])
    low, high = (points.min(axis=0), points.max(axis=0)) if len(points) else (np.zeros(2), np.ones(2))
    scale = 2.0 * HALF * FILLED / max(float((high - low).max()), NOT_ZERO)
    placed = [np.round((x - (low + high) / 2.0) * scale, 1).reshape(-1, 4).tolist() for x in flat]
    ruler = round_length(2.0 * HALF * SCALE / scale)
    bar = {"x": -HALF * FILLED, "y": HALF - FOOT, "width": round(ruler * scale, 1), "words": length(ruler)}
    return {
        "title": title,
        "a": placed[0],
        "b": placed[1],
        "gap": placed[2],
        "half": HALF,
        "scale": bar,
    }


def round_length(most: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is no larger.

    >>> round_length(0.034), round_length(7.0), round_length(1.0)
    (0.02, 5.0, 1.0)
    """
    exponent = math.floor(math.log10(most))
    return max(x for x in (float(f"{k}e{exponent}") for k in (1, 2, 5)) if x <= most)


def schema_text() -> str:
    """The JSON Schema (draft 2020-12) of a certificate."""
    return asset("same-1.schema.json")


def read_certificate(path: Path) -> dict[str, Any]:
    """A certificate from a file.

    Raises:
        SourceError: the file cannot be read.
        InputError: it is not JSON, no certificate, of another version, or breaks the schema.
    """
    data = read_json(path)
    keeps_to(json.loads(schema_text()), data, LAYOUT, str(path), "urdfkin same A B --certificate FILE")
    return cast("dict[str, Any]", data)
