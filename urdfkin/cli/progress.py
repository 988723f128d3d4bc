"""Progress of a campaign: a bar on a terminal, plain lines in a log, JSON for programs."""

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

#: Seconds between two lines of a log, and between two lines of JSON.
_LINES, _JSON = 10.0, 0.5


class Pace:
    """Speed in chunks per second and remaining time, measured with a monotonic clock.

    The measurement starts at the last call before the first computed chunk. Earlier compiling is not counted.
    """

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now, self._begin = now, now()

    def of(self, state: CampaignProgress) -> tuple[float | None, float | None]:
        """Return chunks per second and seconds left; None before the first chunk."""
        seconds, fresh = self._now() - self._begin, state.chunks_done - state.chunks_kept
        if fresh <= 0:
            self._begin = self._now()
        if fresh <= 0 or seconds <= 0.0:
            return None, None
        rate = fresh / seconds
        return rate, (state.chunks - state.chunks_done) / rate


@contextmanager
def progress(*, as_json: bool) -> Iterator[Progress]:
    """Yield the progress callback for `validate`: JSON lines, a bar on a terminal, or plain lines."""
    pace = Pace()
    if as_json:
        with _at_intervals(_JSON, lambda state: _json(state, pace)) as tell:
            yield tell
    elif sys.stderr is not None and sys.stderr.isatty():
        with _bar(pace) as tell:
            yield tell
    else:
        with _at_intervals(_LINES, lambda state: say(f"urdfkin: {line(state, pace)}", err=True)) as tell:
            yield tell


def line(state: CampaignProgress, pace: Pace) -> str:
    """Return the progress as one line of text."""
    return (
        f"{state.robots_done:,} of {state.robots:,} robots, {state.chunks_done:,} of"
        f" {state.chunks:,} chunks{_earlier(state)}; {_speed(state, pace)}"
        f"{_failures(state)}; {state.label}"
    )


def duration(seconds: float) -> str:
    """Format a duration.

    >>> duration(7), duration(100), duration(9000), duration(200_000)
    ('7 s', '1 min 40 s', '2 h 30 min', '2 d 7 h')
    """
    whole = round(seconds)
    for size, unit, smaller, name in ((86_400, "d", 3600, "h"), (3600, "h", 60, "min"), (60, "min", 1, "s")):
        if whole >= size:
            rest = whole % size // smaller
            return f"{whole // size} {unit}" + (f" {rest} {name}" if rest else "")
    return f"{whole} s"


def _earlier(state: CampaignProgress) -> str:
    return f" ({state.chunks_kept:,} from before)" if state.chunks_kept else ""


def _speed(state: CampaignProgress, pace: Pace) -> str:
    rate, left = pace.of(state)
    if rate is None or left is None:
        return "nothing computed yet, "
    return f"{rate:.3g} chunks/s, {duration(left)} left, "


def _failures(state: CampaignProgress) -> str:
    return f"{state.failures:,} failed" if state.failures else "none failed"


@contextmanager
def _at_intervals(seconds: float, show: Callable[[CampaignProgress], Any]) -> Iterator[Progress]:
    """Show the progress every `seconds`. With JSON also show the first and the last one."""
    shown, last = time.monotonic(), None
    first = seconds == _JSON

    def tell(state: CampaignProgress) -> None:
        nonlocal shown, last, first
        last = state
        if first or time.monotonic() - shown >= seconds:
            shown, last, first = time.monotonic(), None, False
            show(state)

    try:
        yield tell
    finally:
        if last is not None and seconds == _JSON:
            show(last)


def _json(state: CampaignProgress, pace: Pace) -> None:
    rate, left = pace.of(state)
    data = asdict(state) | {"chunks_per_second": rate, "seconds_left": left}
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

        def tell(state: CampaignProgress) -> None:
            pace_ = _speed(state, pace)
            words = f"{state.robots_done}/{state.robots} robots, {pace_}{_failures(state)},"
            bar.update(
                task,
                completed=state.chunks_done,
                total=state.chunks,
                description=printable(state.label),
                words=words,
            )

        yield tell
