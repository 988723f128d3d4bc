"""Report the comparison of two models: on a terminal, as Markdown and as an HTML page."""

from __future__ import annotations

import math
import shlex
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from typing import Any

import numpy as np

from urdfkin.comparison.result import (
    BOUNDED_DIFFERENCE_KINDS,
    Interval,
    Sameness,
    SameQuestion,
    Verdict,
    angle,
    base_as_written,
    interval_text,
    length,
)
from urdfkin.errors.display import Strong, Table, TextDocument, format_count
from urdfkin.errors.escape import markdown_text
from urdfkin.kinematics.roundings import MIN_DIVISOR
from urdfkin.model.configuration import TRAVEL_CONDITION, coordinate_names, units
from urdfkin.model.conventions.convention import spellings
from urdfkin.model.mechanisms.mechanism import Mechanism
from urdfkin.model.tree import FloatArray, inverse
from urdfkin.report.markdown import table_lines
from urdfkin.robot import Robot

#: Maximum number of printed lines for each kind of difference.
#: The option --all removes the limit.
MAX_LINES = 12
MATCHED_BY_AXES = (
    "joints are matched by their axes, because names or order differ; use --map to match other joints"
)
HEADS = ("frame", "at least", "at most", "angle at most")
EQUIVALENT = SameQuestion()
#: Distances and angles up to this factor times the bound on rounding errors are not printed. The factor
#: covers the rounding errors of sums of several terms.
ROUNDING_FACTOR = 1.001
#: Heading of a list of mimicked joints. Each listed joint can move a mimic joint beyond the mimic joint's
#: limits.
MIMIC_LIMITS_HEADING = "limits of mimic joints (the bounds of the distance ignore these limits)"


def headline(sameness: Sameness, question: SameQuestion = EQUIVALENT) -> str:
    limits = sum(one.what == "limits" for one in sameness.remarks)
    besides = f"; limits of {format_count(limits, 'joint')} differ" if limits else ""
    if sameness.unlimited:
        besides += f"; this result holds if {TRAVEL_CONDITION}"
    if question.within is not None:
        return _within_headline(sameness, question.within) + besides
    off = "the distance of the frames has no bound"
    if math.isfinite(max(sameness.bound_as_written)):
        bound = _length_and_angle(*sameness.bound_as_written)
        off = f"in every configuration no frame is off by more than {bound}"
    if sameness.up_to_single:
        cause = "each joint differs at most by the rounding errors of the joint's numbers"
        return f"SAME UP TO SINGLE PRECISION: {off}; {cause}{besides}"
    if sameness.within_single and sameness.single is not None:
        single = (
            f"rounding to single precision can move a frame by up to {_length_and_angle(*sameness.single)}"
        )
        return f"DIFFERS WITHIN SINGLE PRECISION: {off}; {single}, but {sameness.unexplained[0]}{besides}"
    if sameness.verdict is Verdict.DIFFERS:
        by = _describe_largest_distance(sameness.frames, sameness.rounding)
        if sameness.frames and not by:
            by = ", although the common frames differ only by rounding errors"
        single = (
            ""
            if sameness.single is None
            else f"; single precision explains up to {_length_and_angle(*sameness.single)}"
        )
        single += f", but {sameness.unexplained[0]}" if single and sameness.unexplained else ""
        return f"DIFFERS{by}; first difference: {sameness.differences[0].words}{single}{besides}"
    metres, radians = sameness.rounding
    off = f"no frame is off by more than rounding, {length(metres)} and {angle(radians)}"
    if sameness.verdict is Verdict.SAME:
        return f"SAME: in every configuration {off}{besides}"
    written = f"; {describe_as_written(sameness)}" if describe_as_written(sameness) else ""
    return f"EQUIVALENT up to {', '.join(sameness.up_to)}: in every configuration {off}{written}{besides}"


def _within_headline(sameness: Sameness, limit: float) -> str:
    prefix = f"WITHIN {limit:g} m and rad, without changes of model B: "
    if sameness.within(limit):
        return f"{prefix}no frame is ever off by more than {_length_and_angle(*sameness.bound_as_written)}"
    if (
        unbounded := next(
            (one for one in sameness.differences if one.what not in BOUNDED_DIFFERENCE_KINDS), None
        )
    ) is not None:
        return f"NOT {prefix}{unbounded.words}"
    frames = (sameness.as_written,) if sameness.as_written is not None else sameness.frames
    beyond_limit = [one for one in frames if one.lower > limit or one.radians_seen > limit]
    if beyond_limit:
        worst = max(beyond_limit, key=lambda one: (one.lower, one.radians_seen))
        return f"NOT {prefix}{worst.frame} is {_describe_distance(worst, sameness.rounding)} off"
    return f"NOT {prefix}the proven bound is {_length_and_angle(*sameness.bound_as_written)}"


def _length_and_angle(metres: float, radians: float) -> str:
    return f"{length(metres)} and {angle(radians)}"


def _describe_largest_distance(frames: Sequence[Interval], rounding: tuple[float, float]) -> str:
    """Describe the largest distance and angle that rounding errors cannot explain."""

    def largest_value(attribute: str) -> float:
        return max((getattr(frame, attribute) for frame in frames), default=0.0)

    upper, radians = largest_value("upper"), largest_value("radians")
    parts: list[tuple[Callable[[float], str], float, float]] = []
    parts += [(length, largest_value("lower"), upper)] if upper > ROUNDING_FACTOR * rounding[0] else []
    parts += (
        [(angle, largest_value("radians_seen"), radians)] if radians > ROUNDING_FACTOR * rounding[1] else []
    )
    if any(math.isinf(most) for _, _, most in parts):
        least = " and ".join(f"{words(low)} or more" for words, low, _ in parts if low)
        return f" by {least} (no bound is proven)" if least else ", and no bound is proven"
    seen_some = [interval_text(*one) for one in parts if one[1] > 0.0]
    bounded = [words(most) for words, low, most in parts if low <= 0.0]
    texts = [f"up to {' and '.join(seen_some)}"] if seen_some else []
    texts += [f"at most {' and '.join(bounded)}"] if bounded else []
    return f" by {', and '.join(texts)}" if texts else ""


def _describe_distance(frame: Interval, rounding: tuple[float, float]) -> str:
    """Describe the distance and the angle that rounding errors cannot explain."""
    parts = (
        [interval_text(length, frame.lower, frame.upper)]
        if frame.upper > ROUNDING_FACTOR * rounding[0]
        else []
    )
    if frame.radians > ROUNDING_FACTOR * rounding[1]:
        parts.append(interval_text(angle, frame.radians_seen, frame.radians))
    return " and ".join(parts)


def far_frames(sameness: Sameness) -> list[Interval]:
    metres, radians = sameness.rounding
    far = [frame for frame in sameness.frames if frame.upper > metres or frame.radians > radians]
    return sorted(far, key=lambda frame: (-frame.upper, -frame.lower))


def frames_heading(sameness: Sameness) -> str:
    """Return the heading of the table of `far_frames`.

    The table shows distances after the changes of model B. The verdict "same up to single precision" is about
    the unchanged models. Therefore, the heading then lists the changes.
    """
    changed = (
        f", after changes of {', '.join(sameness.up_to)}" if sameness.up_to_single and sameness.up_to else ""
    )
    return f"Largest distance over all configurations within limits{changed}"


def frame_rows(frames: Sequence[Interval]) -> list[list[str]]:
    return [[frame.frame, length(frame.lower), length(frame.upper), angle(frame.radians)] for frame in frames]


def describe_as_written(sameness: Sameness) -> str:
    """Describe the largest distance between matching frames of A and the unchanged B.

    The text is empty if rounding errors explain the distance, or if `sameness.after` is empty.
    """
    frame = sameness.as_written
    off = "" if frame is None else _describe_distance(frame, sameness.rounding)
    return f"without changes of B, {frame.frame} is {off} off" if frame is not None and off else ""


def configuration_text(sameness: Sameness, frame: Interval) -> str:
    """Return the configuration that gives the lower bound `frame.lower`, as text with units.

    The text contains the nonzero coordinates of model A, and those of unmatched joints of model B.
    """
    a, b = sameness.trees
    names = [*zip(coordinate_names(a), units(a, "q"), frame.q_a, strict=False)]
    driven = {
        one.b for one in sameness.joints if (own := a.joints[a.joint_index(one.a)]).nv and not own.mimic
    }
    alone = {b.q_index[i] for i, joint in enumerate(b.joints) if joint.nv == 1 and joint.name not in driven}
    of_b = zip(coordinate_names(b), units(b, "q"), frame.q_b, strict=False)
    names += [(f"{name} of B", unit, value) for k, (name, unit, value) in enumerate(of_b) if k in alone]
    some = [f"{name} {value:.6g} {unit}".rstrip() for name, unit, value in names if value]
    return ", ".join(some) or "the zero configuration"


def describe_renames(sameness: Sameness) -> list[str]:
    pairs = [one for one in sameness.joints if one.a != one.b]
    guessed = [one for one in pairs if one.b not in spellings(one.a) and one.a not in spellings(one.b)]
    joints = [f"joint {one.a} is {one.b}" for one in pairs]
    joints += [
        "joints of B have a different order, without effect on the motion; joints are compared in the order "
        + ", ".join(names)
        for names in sameness.orders
    ]
    if (guessed or sameness.orders) and not sameness:
        joints = [MATCHED_BY_AXES, *joints]
    return joints + [f"link {name_a} is {name_b}" for name_a, name_b in sameness.links if name_a != name_b]


def document(sameness: Sameness, question: SameQuestion = EQUIVALENT, *, all_: bool = False) -> TextDocument:
    """Return the verdict on two models, with the changes, differences and distances that explain it."""
    parts: list[str | Table] = [
        f"{k}: {name}" for k, name in zip("AB", _names_with_sources(sameness), strict=True)
    ]
    head = headline(sameness, question)
    parts.append(Strong(head, "bold green" if sameness.holds(question) else "bold red"))
    max_lines = None if all_ else MAX_LINES
    after, words = _changes_and_differences(sameness, all_=all_)
    parts += _lines("changes of B", after, max_lines)
    if after and describe_as_written(sameness) not in head:
        parts += _lines("", [describe_as_written(sameness)], max_lines)
    parts += _lines("differences", words[1:] if words and words[0] in head else words, max_lines)
    frames = far_frames(sameness)
    if frames:
        parts.append(f"{frames_heading(sameness).lower()}:")
        parts += [
            Table(HEADS, frame_rows(frames[:max_lines])),
            *_omission_note(len(frames), max_lines),
            *_worst_case(sameness, frames),
        ]
    parts += _lines(MIMIC_LIMITS_HEADING, sameness.narrowed, max_lines)
    parts += _lines("different names", describe_renames(sameness), max_lines)
    parts += _lines(
        "differences without effect on motion", [one.words for one in sameness.remarks], max_lines
    )
    return TextDocument("", [*parts, str(sameness.confirmation)])


def _names_with_sources(sameness: Sameness) -> list[str]:
    return [f"{name} ({source})" for name, source in zip(sameness.names, sameness.sources, strict=True)]


def _worst_case(sameness: Sameness, frames: Sequence[Interval]) -> list[str]:
    off = distance_text(frames[0])
    return [f"{frames[0].frame} is {off} off at: {configuration_text(sameness, frames[0])}"] if off else []


def _changes_and_differences(sameness: Sameness, *, all_: bool = False) -> tuple[tuple[str, ...], list[str]]:
    if sameness.up_to_single and not all_:
        return (), []
    return sameness.after, [one.words for one in sameness.differences]


PAIR_HEADS = ("A", "B", "verdict", "distance bound, as given", "single precision")


def _pair_rows(pairs: Sequence[Sameness], question: SameQuestion) -> list[tuple[str, ...]]:
    rows = list[tuple[str, ...]]()
    for one in pairs:
        words = "equivalent" if one.verdict is Verdict.SAME_AFTER else one.verdict.value
        if one.within_single:
            words = "differs within single precision"
        if question.within is not None:
            words = f"{'' if one.within(question.within) else 'not '}within {question.within:g}"
        metres, radians = one.bound_as_written
        off = "no bound" if math.isinf(metres) else _length_and_angle(metres, radians)
        single = "" if one.single is None else _length_and_angle(*one.single)
        rows.append((*one.sources, words, off, single))
    return rows


def pairs_document(pairs: Sequence[Sameness], question: SameQuestion = EQUIVALENT) -> TextDocument:
    rows = _pair_rows(pairs, question)
    different = [
        f"{one.sources[0]} and {one.sources[1]}: {headline(one, question)}"
        for one in pairs
        if not one.holds(question)
    ]
    return TextDocument("", [Table(PAIR_HEADS, rows, left=3), *different])


def pairs_markdown(pairs: Sequence[Sameness], question: SameQuestion = EQUIVALENT) -> str:
    rows = (map(markdown_text, row) for row in _pair_rows(pairs, question))
    return "\n".join([*table_lines(PAIR_HEADS, rows), ""])


def as_document(sameness: Sameness) -> TextDocument:
    parts: list[str | Table] = [
        f"{k}: {name}" for k, name in zip("AB", _names_with_sources(sameness), strict=True)
    ]
    after, words = _changes_and_differences(sameness)
    for head, lines in (
        ("Change of B", [*after, describe_as_written(sameness)] if after else []),
        ("Difference", words),
        ("Without effect on motion", [one.words for one in sameness.remarks]),
    ):
        parts += [f"{head}: {line}" for line in lines[:MAX_LINES] if line]
        parts += [f"... and {len(lines) - MAX_LINES} more lines"] if len(lines) > MAX_LINES else []
    if frames := far_frames(sameness):
        parts += [f"{frames_heading(sameness)}:", Table(HEADS, frame_rows(frames[:MAX_LINES]))]
        parts += [f"... and {len(frames) - MAX_LINES} more frames"] if len(frames) > MAX_LINES else []
        parts += _worst_case(sameness, frames)
    return TextDocument(headline(sameness), [*parts, str(sameness.confirmation)])


def distance_text(frame: Interval) -> str:
    """Return the distance of two matching frames as text, or the angle if the distance is 0."""
    if frame.lower:
        return length(frame.lower)
    return angle(frame.radians_seen) if frame.radians_seen else ""


def _lines(head: str, lines: Sequence[str], max_lines: int | None) -> list[str]:
    if not lines or not any(lines):
        return []
    heads = [f"{head}:"] if head else []
    return [*heads, *(f"  {line}" for line in lines[:max_lines]), *_omission_note(len(lines), max_lines)]


def _omission_note(n: int, max_lines: int | None) -> list[str]:
    return (
        [f"  ... and {n - max_lines} more: --all shows them"]
        if max_lines is not None and n > max_lines
        else []
    )


def markdown_of(sameness: Sameness, question: SameQuestion = EQUIVALENT) -> str:
    mark = "✅" if sameness.holds(question) else "❌"
    text = markdown_text
    names = " and ".join(map(text, _names_with_sources(sameness)))
    lines = [f"## {mark} {text(headline(sameness, question))}", "", names, ""]
    after, reasons = _changes_and_differences(sameness)
    for head, words in (
        ("Changes of B", [*after, describe_as_written(sameness)] if after else []),
        ("Differences", reasons),
        (MIMIC_LIMITS_HEADING.capitalize(), sameness.narrowed),
        ("Different names", describe_renames(sameness)),
        ("Differences without effect on motion", [one.words for one in sameness.remarks]),
    ):
        if words:
            lines += [f"**{head}**", ""]
            lines += [f"- {text(word)}" for word in words[: 4 * MAX_LINES]]
            lines += (
                [f"- {format_count(len(words) - 4 * MAX_LINES, 'more line')}"]
                if len(words) > 4 * MAX_LINES
                else []
            )
            lines.append("")
    frames = far_frames(sameness)
    if frames:
        cells = (map(text, row) for row in frame_rows(frames[: 4 * MAX_LINES]))
        lines += [f"{frames_heading(sameness)}:", "", *table_lines(HEADS, cells, left=[0]), ""]
    return "\n".join([*lines, text(str(sameness.confirmation)), ""])


#: Half the side length of a picture (SVG units), and the fraction of the side length that the drawn robots
#: fill.
HALF_SIDE, FILLED_FRACTION = 150.0, 0.9
#: Maximum length of the scale bar, relative to the side length of a picture.
MAX_SCALE_BAR_FRACTION = 0.3
#: Distance of the scale bar from the picture's lower edge (SVG units).
SCALE_BAR_MARGIN = 6.0
#: Length of the axes in the close view, relative to the distance between the two frames.
AXIS_FRACTION = 0.35
#: Views: title, azimuth (rad), elevation (rad).
VIEWS = (("from the front", 0.6, 0.35), ("from the side", 0.6 + np.pi / 2.0, 0.35))


def as_html(
    sameness: Sameness,
    robots: tuple[Robot, Robot],
    question: SameQuestion = EQUIVALENT,
    options: Sequence[str] = (),
    started: datetime | None = None,
) -> str:
    """Return an HTML page with the answer; the template escapes all names."""
    from urdfkin.report.html import format_date, render_template
    from urdfkin.verify.oracles import package_versions

    moment = started or datetime.now(UTC)
    frames = far_frames(sameness)
    written = question.within is not None and sameness.as_written is not None
    worst = sameness.as_written if written else frames[0] if frames and frames[0].q_a else None
    return render_template(
        "same.html.j2",
        found=sameness,
        headline=headline(sameness, question),
        good=sameness.holds(question),
        narrowed=sameness.narrowed,
        narrowed_head=MIMIC_LIMITS_HEADING.capitalize(),
        started=moment.isoformat(timespec="seconds"),
        when=format_date(moment.isoformat(timespec="seconds")),
        versions=package_versions(),
        command=command_of(robots, question, options),
        heads=HEADS,
        farthest=frames_heading(sameness),
        frames=frame_rows(frames),
        as_written=describe_as_written(sameness),
        renamed=describe_renames(sameness),
        where=configuration_text(sameness, worst) if worst else "",
        pictures=pictures(sameness, robots, worst, written=written),
        title=f"Where {worst.frame} is {distance_text(worst)} off{' without changes of B' if written else ''}"
        if worst and distance_text(worst)
        else "Both robots in the zero configuration",
    )


def command_of(robots: tuple[Robot, Robot], question: SameQuestion, options: Sequence[str]) -> str:
    words = [robot.origin.command_line for robot in robots]
    words += [] if question.within is None else [f"--within {question.within!r}"]
    words += ["--strict"] if question.strict else []
    return " ".join(["urdfkin same", *words, *map(shlex.quote, options)])


def pictures(
    sameness: Sameness, robots: tuple[Robot, Robot], worst: Interval | None, *, written: bool = False
) -> list[dict[str, Any]]:
    """Draw the skeletons of both robots in two views, and an enlarged picture of the worst frame.

    Without `worst`, A is in its zero configuration, and B is in the matching configuration. With `written`,
    the base of B has the pose in the file of B. Otherwise, it has the pose `sameness.base`, which brings B
    closest to A. A line segment is four numbers: x and y of the start, and x and y of the end.
    """
    a, b = robots
    q_a = np.array(worst.q_a) if worst else a.neutral()
    q_b = np.array(worst.q_b) if worst else sameness.to_b(a.neutral())
    T_a = a.placement(q_a, a.link_frames, verify=False)
    T_b = b.placement(q_b, b.link_frames, verify=False)
    mechanism_a, mechanism_b = Mechanism(a.tree), Mechanism(b.tree)
    if written:
        T_b = T_a[0] @ base_as_written(mechanism_a, mechanism_b) @ inverse(T_b[0]) @ T_b
    else:
        i, j = a.tree.link_index(sameness.base_links[0]), b.tree.link_index(sameness.base_links[1])
        T_b = (
            T_a[i]
            @ inverse(mechanism_a.zero_poses[i])
            @ sameness.base
            @ mechanism_b.zero_poses[j]
            @ inverse(T_b[j])
            @ T_b
        )
    skeletons = _skeleton_lines(a, T_a), _skeleton_lines(b, T_b)
    drawings = [_make_picture(title, azimuth, elevation, skeletons) for title, azimuth, elevation in VIEWS]
    if worst is not None:
        at = T_a[a.tree.link_index(worst.frame)], T_b[b.tree.link_index(worst.frame_b)]
        distance = float(np.linalg.norm(at[0][:3, 3] - at[1][:3, 3]))
        if distance > 0.0:
            axes = tuple(_axes(T, AXIS_FRACTION * distance) for T in at)
            gap = np.stack((at[0][:3, 3], at[1][:3, 3]))[np.newaxis]
            drawings.append(_make_picture(f"{worst.frame}, close by", *VIEWS[0][1:], (axes[0], axes[1]), gap))
    return drawings


def _skeleton_lines(robot: Robot, Ts: FloatArray) -> FloatArray:
    """Return a line for each joint (joints, 2, 3), from the parent link's origin to the child's origin."""
    ends = [(Ts[joint.parent, :3, 3], Ts[i + 1, :3, 3]) for i, joint in enumerate(robot.tree.joints)]
    return np.array(ends).reshape(-1, 2, 3)


def _axes(T: FloatArray, size: float) -> FloatArray:
    """Return lines (3, 2, 3) from the frame's origin along its axes."""
    origin = np.tile(T[:3, 3], (3, 1))
    return np.stack((origin, origin + size * T[:3, :3].T), axis=1)


def _make_picture(
    title: str,
    azimuth: float,
    elevation: float,
    lines: tuple[FloatArray, FloatArray],
    gap: FloatArray | None = None,
) -> dict[str, Any]:
    c, s, up, down = np.cos(azimuth), np.sin(azimuth), np.cos(elevation), np.sin(elevation)
    # Matrix that projects a point in space into the picture. In the picture, x points to the right, and y
    # points down.
    projection = np.array([[-s, c, 0.0], [down * c, down * s, -up]])
    flat = [x @ projection.T for x in (*lines, np.zeros((0, 2, 3)) if gap is None else gap)]
    points = np.concatenate([x.reshape(-1, 2) for x in flat])
    low, high = (points.min(axis=0), points.max(axis=0)) if len(points) else (np.zeros(2), np.ones(2))
    scale = 2.0 * HALF_SIDE * FILLED_FRACTION / max(float((high - low).max()), MIN_DIVISOR)
    placed = [np.round((x - (low + high) / 2.0) * scale, 1).reshape(-1, 4).tolist() for x in flat]
    ruler = round_length_down(2.0 * HALF_SIDE * MAX_SCALE_BAR_FRACTION / scale)
    bar = {
        "x": -HALF_SIDE * FILLED_FRACTION,
        "y": HALF_SIDE - SCALE_BAR_MARGIN,
        "width": round(ruler * scale, 1),
        "words": length(ruler),
    }
    return {"title": title, "a": placed[0], "b": placed[1], "gap": placed[2], "half": HALF_SIDE, "scale": bar}


def round_length_down(limit: float) -> float:
    """Return the largest of 1, 2 and 5 times a power of ten that is at most `limit`.

    >>> round_length_down(0.034), round_length_down(7.0), round_length_down(1.0)
    (0.02, 5.0, 1.0)
    """
    exponent = math.floor(math.log10(limit))
    return max(x for x in (float(f"{k}e{exponent}") for k in (1, 2, 5)) if x <= limit)
