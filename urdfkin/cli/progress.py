"""How far a campaign has come: a bar on a terminal, plain lines in a log, JSON for programs."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from urdfkin.cli.output import console
from urdfkin.cli.streams import say
from urdfkin.errors.escape import printable

if TYPE_CHECKING:
    from urdfkin.validation.collector import CampaignProgress, Progress

#: Seconds between two lines: of a log, and for a program.
_LINES, _JSON = 10.0, 0.5


class Pace:
    """Chunks a second in this run, and how long what is missing takes at that; no clock that can be set.

    It counts from when last nothing was computed yet: what was compiled before makes nobody slow.
    """

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now, self._begin = now, now()

    def of(self, standing: CampaignProgress) -> tuple[float | None, float | None]:
        """Chunks a second and seconds left; None while nobody can know."""
        seconds, fresh = self._now() - self._begin, standing.chunks_done - standing.chunks_kept
        if fresh <= 0:
            self._begin = self._now()
        if fresh <= 0 or seconds <= 0.0:
            return None, None
        rate = fresh / seconds
        return rate, (standing.chunks - standing.chunks_done) / rate


@contextmanager
def progress(*, as_json: bool) -> Iterator[Progress]:
    """What `validate` is told of its progress with: lines of JSON, or what suits standard error."""
    pace = Pace()
    if as_json:
        with _now_and_then(_JSON, lambda standing: _json(standing, pace)) as tell:
            yield tell
    elif sys.stderr is not None and sys.stderr.isatty():
        with _bar(pace) as tell:
            yield tell
    else:
        with _now_and_then(
            _LINES, lambda standing: say(f"urdfkin: {line(standing, pace)}", err=True)
        ) as tell:
            yield tell


def line(standing: CampaignProgress, pace: Pace) -> str:
    """It all in words."""
    return (
        f"{standing.robots_done:,} of {standing.robots:,} robots, {standing.chunks_done:,} of"
        f" {standing.chunks:,} chunks{_kept(standing)}; {_speed(standing, pace)}"
        f"{_failures(standing)}; {standing.label}"
    )


def duration(seconds: float) -> str:
    """Seconds in the words of who waits.

    >>> duration(7), duration(100), duration(9000), duration(200_000)
    ('7 s', '1 min 40 s', '2 h 30 min', '2 d 7 h')
    """
    whole = round(seconds)
    for size, unit, smaller, name in ((86_400, "d", 3600, "h"), (3600, "h", 60, "min"), (60, "min", 1, "s")):
        if whole >= size:
            rest = whole % size // smaller
            return f"{whole // size} {unit}" + (f" {rest} {name}" if rest else "")
    return f"{whole} s"


def _kept(standing: CampaignProgress) -> str:
    return f" ({standing.chunks_kept:,} from before)" if standing.chunks_kept else ""


def _speed(standing: CampaignProgress, pace: Pace) -> str:
    rate, left = pace.of(standing)
    if rate is None or left is None:
        return "nothing computed yet, "
    return f"{rate:.3g} chunks/s, {duration(left)} left, "


def _failures(standing: CampaignProgress) -> str:
    return f"{standing.failures:,} failed" if standing.failures else "none failed"


@contextmanager
def _now_and_then(seconds: float, show: Callable[[CampaignProgress], Any]) -> Iterator[Progress]:
    """Show the first standing after some seconds and so on; JSON the first and the last one too."""
    shown, last = time.monotonic(), None
    first = seconds == _JSON

    def tell(standing: CampaignProgress) -> None:
        nonlocal shown, last, first
        last = standing
        if first or time.monotonic() - shown >= seconds:
            shown, last, first = time.monotonic(), None, False
            show(standing)

    try:
        yield tell
    finally:
        if last is not None and seconds == _JSON:
            show(last)


def _json(standing: CampaignProgress, pace: Pace) -> None:
    rate, left = pace.of(standing)
    data = asdict(standing) | {"chunks_per_second": rate, "seconds_left": left}
    say(json.dumps(data), err=True)


@contextmanager
def _bar(pace: Pace) -> Iterator[Progress]:
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn  # noqa: PLC0415

    columns = (
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("chunks, {task.fields[words]} {task.description}", markup=False),
    )
    with Progress(*columns, console=console(err=True), transient=True) as bar:
        task = bar.add_task("", total=None, words="")

        def tell(standing: CampaignProgress) -> None:
            pace_ = _speed(standing, pace)
            words = f"{standing.robots_done}/{standing.robots} robots, {pace_}{_failures(standing)},"
            bar.update(
                task,
                completed=standing.chunks_done,
                total=standing.chunks,
                description=printable(standing.label),
                words=words,
            )

        yield tell
