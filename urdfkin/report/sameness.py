"""Whether two models are one robot, to read: on a terminal and as Markdown."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from urdfkin.errors.printable import markdown_text
from urdfkin.report.terminal import plain_table
from urdfkin.report.words import counted
from urdfkin.sameness.result import Interval, Sameness, Verdict, angle, length, up_to

if TYPE_CHECKING:
    from rich.console import Console

#: Lines of a kind that are shown unless all are asked for.
SHOWN = 12
#: Where models differ and names did not say which joints are each other's.
GUESSED = "by how joints lie, since names do not tell; if other pairs are meant, --map says so"
HEADS = ("frame", "at least", "at most", "turned at most")


def headline(found: Sameness) -> str:
    """The verdict in a line."""
    if found.verdict is Verdict.DIFFERS:
        worst = found.worst
        by = f" by up to {up_to(worst.lower, worst.upper)}" if worst else ""
        if found.frames and not far_frames(found):
            by = ", though no frame of both is off by more than rounding"
        return f"DIFFERS{by}; first here: {found.differences[0].words}"
    how = "SAME" if found.verdict is Verdict.SAME else "SAME after what is said below"
    metres, radians = found.rounding
    off = f"{length(metres)} and {angle(radians)}"
    return f"{how}: in every configuration no frame is off by more than rounding, {off}"


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
    """How far they are off as they stand; empty where that is no more than rounding."""
    frame = found.as_written
    if frame is None or (frame.upper <= found.rounding[0] and frame.radians <= found.rounding[1]):
        return ""
    off = "turned" if frame.upper <= found.rounding[0] else f"{up_to(frame.lower, frame.upper)} off"
    return f"as they are written, {frame.frame} comes {off}"


def where(found: Sameness, frame: Interval) -> str:
    """At which configuration a lower bound is attained, in A's coordinates."""
    from urdfkin.model.configuration import coordinate_names  # noqa: PLC0415

    names = coordinate_names(found.trees[0])
    return ", ".join(f"{name} {value:.6g}" for name, value in zip(names, frame.q_a, strict=False) if value)


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


def print_sameness(found: Sameness, out: Console, *, all_: bool = False) -> None:
    """Print the verdict and what it rests on; every line reads without colour.

    Args:
        found: What `same` found.
        out: Where to.
        all_: Whether every line is shown, not the first dozen of a kind.
    """
    for which, name, source in zip("AB", found.names, found.sources, strict=True):
        out.print(f"{which}: {name} ({source})", soft_wrap=True)
    out.print(headline(found), style="bold red" if not found else "bold green", soft_wrap=True)
    some = None if all_ else SHOWN
    _print_lines(out, "after", found.after, some)
    if found.after:
        _print_lines(out, "", [as_written(found)], some)
    _print_lines(out, "differences", [one.words for one in found.differences][1:], some)
    frames = far_frames(found)
    if frames:
        out.print("largest distance over all configurations within limits:")
        out.print(plain_table(list(HEADS), rows(frames[:some]), words=(0,)))
        _left(out, len(frames), some)
        if frames[0].lower > 0.0:
            out.print(
                f"{frames[0].frame} is {length(frames[0].lower)} off at: {where(found, frames[0])}",
                soft_wrap=True,
            )
    _print_lines(out, "called otherwise", renamed(found), some)
    _print_lines(out, "besides", [one.words for one in found.remarks], some)
    out.print(found.checked, soft_wrap=True)


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


def markdown_of(found: Sameness) -> str:
    """The verdict, for a pull request's comment."""
    mark = "❌" if not found else "✅"
    text = markdown_text
    names = " and ".join(
        text(f"{name} ({source})") for name, source in zip(found.names, found.sources, strict=True)
    )
    lines = [f"## {mark} {text(headline(found))}", "", names, ""]
    for head, words in (
        ("After", [*found.after, as_written(found)] if found.after else []),
        ("Differences", [one.words for one in found.differences]),
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
