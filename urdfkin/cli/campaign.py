"""Show the progress of a validation.

This module also defines the commands `urdfkin report status` and `urdfkin report merge`.
"""

from __future__ import annotations

import json
import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from urdfkin.cli.options import FOLDER
from urdfkin.cli.output import make_console
from urdfkin.cli.streams import join_lines, say
from urdfkin.errors.display import format_count
from urdfkin.errors.escape import escape_unprintable

if TYPE_CHECKING:
    from urdfkin.validation.collector import CampaignProgress, Progress
    from urdfkin.validation.store import Store


#: Minimum time between two progress lines of text, in seconds.
_LINE_INTERVAL = 10.0
#: Minimum time between two progress lines of JSON, in seconds.
#: The JSON line of the last state is always printed.
_JSON_INTERVAL = 0.5


class SpeedEstimator:
    """Estimates the speed of a validation in chunks per second, and the remaining time in seconds.

    A chunk is a part of the samples of one robot.
    """

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now, self._begin = now, now()

    def estimate(self, state: CampaignProgress) -> tuple[float | None, float | None]:
        seconds, new_chunks = self._now() - self._begin, state.chunks_done - state.chunks_from_earlier_run
        # Each call before the first new chunk restarts the clock, because urdfkin may compile kernels first.
        if new_chunks <= 0:
            self._begin = self._now()
        if new_chunks <= 0 or seconds <= 0.0:
            return None, None
        rate = new_chunks / seconds
        return rate, (state.chunks - state.chunks_done) / rate


@contextmanager
def progress(*, as_json: bool) -> Iterator[Progress]:
    estimator = SpeedEstimator()
    if as_json:
        with _at_intervals(_JSON_INTERVAL, lambda state: _print_json(state, estimator)) as show_progress:
            yield show_progress
    elif sys.stderr is not None and sys.stderr.isatty():
        with _show_bar(estimator) as show_progress:
            yield show_progress
    else:
        with _at_intervals(
            _LINE_INTERVAL, lambda state: say(f"urdfkin: {format_progress(state, estimator)}", err=True)
        ) as show_progress:
            yield show_progress


def format_progress(state: CampaignProgress, estimator: SpeedEstimator) -> str:
    earlier = (
        f" ({state.chunks_from_earlier_run:,} from an earlier run)" if state.chunks_from_earlier_run else ""
    )
    robots = f"{state.robots_done:,} of {state.robots:,} robots"
    chunks = f"{state.chunks_done:,} of {state.chunks:,} chunks{earlier}"
    return (
        f"{robots}, {chunks}; {_format_speed(state, estimator)}{_format_failure_count(state)}; {state.label}"
    )


def format_duration(seconds: float) -> str:
    """Format a duration in seconds.

    >>> format_duration(7), format_duration(100), format_duration(9000), format_duration(200_000)
    ('7 s', '1 min 40 s', '2 h 30 min', '2 d 7 h')
    """
    whole = round(seconds)
    for size, unit, smaller, name in ((86_400, "d", 3600, "h"), (3600, "h", 60, "min"), (60, "min", 1, "s")):
        if whole >= size:
            rest = whole % size // smaller
            return f"{whole // size} {unit}" + (f" {rest} {name}" if rest else "")
    return f"{whole} s"


def _format_speed(state: CampaignProgress, estimator: SpeedEstimator) -> str:
    rate, left = estimator.estimate(state)
    if rate is None or left is None:
        return "no chunk computed yet, "
    return f"{rate:.3g} chunks/s, {format_duration(left)} left, "


def _format_failure_count(state: CampaignProgress) -> str:
    return f"{state.failures:,} failed" if state.failures else "none failed"


@contextmanager
def _at_intervals(seconds: float, show: Callable[[CampaignProgress], Any]) -> Iterator[Progress]:
    as_json = seconds == _JSON_INTERVAL
    last_time = -math.inf if as_json else time.monotonic()
    hidden: CampaignProgress | None = None

    def show_progress(state: CampaignProgress) -> None:
        nonlocal last_time, hidden
        hidden = state
        if time.monotonic() - last_time >= seconds:
            last_time, hidden = time.monotonic(), None
            show(state)

    try:
        yield show_progress
    finally:
        if hidden is not None and as_json:
            show(hidden)


def _print_json(state: CampaignProgress, estimator: SpeedEstimator) -> None:
    rate, left = estimator.estimate(state)
    data = asdict(state) | {"chunks_per_second": rate, "seconds_left": left}
    say(json.dumps(data), err=True)


@contextmanager
def _show_bar(estimator: SpeedEstimator) -> Iterator[Progress]:
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    columns = (
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("chunks, {task.fields[words]} {task.description}", markup=False),
    )
    with Progress(*columns, console=make_console(err=True), transient=True) as bar:
        task = bar.add_task("", total=None, words="")

        def show_progress(state: CampaignProgress) -> None:
            speed = _format_speed(state, estimator)
            words = f"{state.robots_done}/{state.robots} robots, {speed}{_format_failure_count(state)},"
            done, label = state.chunks_done, escape_unprintable(state.label)
            bar.update(task, completed=done, total=state.chunks, description=label, words=words)

        yield show_progress


_MAX_FAILED = 20
#: Maximum number of finished chunks from which `status` estimates the computing time of one chunk.
_MAX_TIMED_CHUNKS = 200


@click.command(
    "status",
    short_help="Show the progress of a validation with --store.",
    epilog="Example: urdfkin report status nightly",
)
@click.argument("folder", metavar="DIR", type=FOLDER)
@click.pass_context
def status(context: click.Context, folder: Path) -> None:
    """Show the finished and failed robots, and an estimate of the remaining time.

    DIR is the folder of `urdfkin validate --store DIR`. The command reads only a few files of the folder, so
    it is fast and does not disturb a running validation. `urdfkin report DIR` reads and checks all files.

    Exit 0: complete. 3: results of the validation or of its accuracy study are missing, or a robot failed.
    """
    from urdfkin.validation.store import Store

    store = Store.open_read_only(folder, warn)
    manifest, counts = store.manifest, store.count_chunks()
    size = len(manifest.chunking)
    failed = [robot for robot, (_, has_failed) in counts.items() if has_failed]
    finished = sum(done for done, _ in counts.values())
    missing = _missing_chunks(store, counts)
    over = sum(done == size or has_failed for done, has_failed in counts.values())
    samples = f"{manifest.samples:,} samples of each robot, seed {manifest.seed}"
    say(f"{folder}: {samples}, started {manifest.started}")
    say(f"robots: {over:,} of {len(counts):,} done, {len(failed):,} of them failed")
    say(f"chunks: {finished:,} done, {missing:,} missing")
    missing_studies = _print_accuracy_progress(store, counts)
    for robot in failed[:_MAX_FAILED]:
        say(f"  failed: {manifest.robots[robot][0].command_line}{_failure_reason(store, robot)}")
    if len(failed) > _MAX_FAILED:
        say(f"  and {len(failed) - _MAX_FAILED:,} more")
    if missing and (seconds := _seconds_per_chunk(store, counts)) is not None:
        say(
            f"remaining: {format_duration(missing * seconds)} on one processor, with {seconds:.2g} s for each"
            " chunk; on n processors, divide the remaining time by n"
        )
    if (holder := store.writing_process()) is not None:
        say(f"the store is in use by: {holder}")
    elif missing or missing_studies:
        say("no process uses the store; to resume, repeat the same `urdfkin validate ... --store` command")
    if failed:
        say("to validate the failed robots again, add `--retry failed` to the `urdfkin validate` command")
    context.exit(3 if missing or missing_studies or failed else 0)


def _missing_chunks(store: Store, counts: dict[int, tuple[int, bool]]) -> int:
    size = len(store.manifest.chunking)
    return sum(size - done for done, has_failed in counts.values() if not has_failed)


def _print_accuracy_progress(store: Store, counts: dict[int, tuple[int, bool]]) -> int:
    """Print the progress of the accuracy study, and return the number of missing results."""
    from urdfkin.validation.store import AccuracyStore

    robots = [robot for robot, (_, has_failed) in counts.items() if not has_failed]
    if (results := AccuracyStore.from_store(store)) is None:
        return 0
    done = sum(map(results.has, robots))
    say(f"accuracy study: {done:,} of {format_count(len(robots), 'robot')} done")
    return len(robots) - done


def _failure_reason(store: Store, robot: int) -> str:
    from urdfkin.validation.answer import Failure

    answers = (store.read_answer(robot, index) for index in range(len(store.manifest.chunking)))
    return next((f": {join_lines(answer.reason)}" for answer in answers if isinstance(answer, Failure)), "")


def _seconds_per_chunk(store: Store, counts: dict[int, tuple[int, bool]]) -> float | None:
    from urdfkin.validation.chunk import ChunkResult

    begun = [robot for robot, (done, _) in counts.items() if done]
    seconds = []
    for robot in begun[:: max(1, len(begun) // _MAX_TIMED_CHUNKS)][:_MAX_TIMED_CHUNKS]:
        answers = (store.read_answer(robot, index) for index in reversed(range(len(store.manifest.chunking))))
        # `counts` includes damaged files, which contain no result.
        if (one := next((x.seconds for x in answers if isinstance(x, ChunkResult)), None)) is not None:
            seconds.append(one)
    return sum(seconds) / len(seconds) if seconds else None


@click.command(
    "merge",
    short_help="Merge the result stores of several machines.",
    epilog="Example: urdfkin report merge whole shard-1 shard-2 shard-3 shard-4",
)
@click.argument("folder", metavar="DIR", type=FOLDER)
@click.argument("stores", metavar="STORE...", nargs=-1, required=True, type=FOLDER)
def merge(folder: Path, stores: tuple[Path, ...]) -> None:
    """Copy the results of several stores of the same validation into the folder DIR.

    Each STORE is a folder that `urdfkin validate --store` wrote, for example on another machine. Results of
    the accuracy study are copied too. Each file is read and checked; damaged files are reported and skipped.
    DIR is made if it does not exist.
    """
    from urdfkin.validation.store import AccuracyStore, Store, open_store

    others = [Store.open_read_only(store, warn) for store in stores]
    for other in others[1:]:
        others[0].check_same_campaign(other.manifest, other.folder)
    with open_store(folder, others[0].manifest, warn) as whole:
        for other in others:
            say(f"{other.folder}: {format_count(whole.copy_missing(other), 'chunk')} copied")
        AccuracyStore.merge(whole, others)
        counts = whole.count_chunks()
        missing = _missing_chunks(whole, counts)
        missing_studies = _print_accuracy_progress(whole, counts)
    parts = [format_count(missing, "chunk")] if missing else []
    parts += [format_count(missing_studies, "result") + " of the accuracy study"] if missing_studies else []
    say(f"{folder}: {' and '.join(parts)} missing" if parts else f"{folder}: complete")


def warn(message: str) -> None:
    say(f"urdfkin: warning: {message}", err=True)
