"""Whether two models are one robot, as a page: verdict, intervals, both at the worst configuration."""

from __future__ import annotations

import math
import shlex
from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Any

import numpy as np

from urdfkin.kinematics.roundings import NOT_ZERO
from urdfkin.model.mechanisms.mechanism import Mechanism
from urdfkin.model.pose import inverse
from urdfkin.model.tree import FloatArray
from urdfkin.report.document import asset
from urdfkin.report.html import as_is, environment, when
from urdfkin.report.sameness import (
    EQUIVALENT,
    HEADS,
    NARROWED,
    as_written,
    attained,
    far_frames,
    headline,
    renamed,
    rows,
    where,
)
from urdfkin.robot import Robot
from urdfkin.sameness.judging import base_as_written
from urdfkin.sameness.result import Interval, Question, Sameness, length
from urdfkin.validation.results import versions

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
