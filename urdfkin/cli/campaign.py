"""`urdfkin campaign`: what a store has, and several stores as one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from urdfkin.cli.streams import say

if TYPE_CHECKING:
    from urdfkin.validation.store import Store

EXAMPLE = "urdfkin campaign status nightly"
#: How many robots that failed are named, and how many chunks are read for their times.
_NAMED, _READ = 20, 200

_FOLDER = click.Path(path_type=Path, file_okay=False)


@click.group(epilog=f"Example: {EXAMPLE}")
def command() -> None:
    """Validations that are kept in a folder, by `urdfkin validate ... --store DIR`."""


@command.command(epilog=f"Example: {EXAMPLE}")
@click.argument("folder", metavar="DIR", type=_FOLDER)
@click.pass_context
def status(context: click.Context, folder: Path) -> None:
    """Say what is done, what failed and how long the rest takes.

    By the files' names alone, so that it is quick and disturbs nobody; `urdfkin report DIR` reads and checks
    them. Exit 0: complete. 3: something is missing or failed.
    """
    from urdfkin.cli.progress import duration  # noqa: PLC0415  keeps --help fast
    from urdfkin.validation.store import Store  # noqa: PLC0415

    store = Store.reading(folder, _warn)
    manifest, counts = store.manifest, store.counts()
    size = len(manifest.cut)
    failed = [robot for robot, (_, has_failed) in counts.items() if has_failed]
    there = sum(done for done, _ in counts.values())
    missing = sum(size - done for done, has_failed in counts.values() if not has_failed)
    over = sum(done == size or has_failed for done, has_failed in counts.values())
    of = f"{manifest.samples:,} samples of each robot, seed {manifest.seed}"
    say(f"{folder}: {of}, began {manifest.started}")
    say(f"robots: {over:,} of {len(counts):,} are done, {len(failed):,} of them failed")
    say(f"chunks: {there:,} are there, {missing:,} are missing")
    _say_judged(store, counts)
    for robot in failed[:_NAMED]:
        say(f"  failed: {manifest.robots[robot][0].words}{_why(store, robot)}")
    if len(failed) > _NAMED:
        say(f"  and {len(failed) - _NAMED:,} more")
    if missing and (seconds := _seconds(store, counts)) is not None:
        say(
            f"left: {duration(missing * seconds)} of one processor, at {seconds:.2g} s a chunk;"
            " divide by the processors at work"
        )
    if (holder := store.at_work()) is not None:
        say(f"at work: {holder}")
    elif missing:
        say("nobody is at work on it: give the same `urdfkin validate ... --store` again to go on")
    if failed:
        say("the same with --retry failed computes what failed again")
    context.exit(3 if missing or failed else 0)


def _say_judged(store: Store, counts: dict[int, tuple[int, bool]]) -> None:
    """How far the judge has come, where it was asked for."""
    if not store.has_judge:
        return
    robots = [robot for robot, (_, has_failed) in counts.items() if not has_failed]
    from urdfkin.report.words import counted  # noqa: PLC0415  keeps --help fast
    from urdfkin.validation.accuracy_store import AccuracyResult  # noqa: PLC0415

    if (judged := AccuracyResult.of(store)) is not None:
        say(f"judged: {sum(map(judged.has, robots)):,} of {counted(len(robots), 'robot')}")


def _why(store: Store, robot: int) -> str:
    """The reason that the first of its failures gives."""
    from urdfkin.validation.answer import Failure  # noqa: PLC0415

    for index in range(len(store.manifest.cut)):
        found = store.answer(robot, index)
        if isinstance(found, Failure):
            return f": {found.reason}"
    return ""


def _seconds(store: Store, counts: dict[int, tuple[int, bool]]) -> float | None:
    """What a chunk takes, from some of those that are there, of as many robots as possible."""
    from urdfkin.validation.chunk import ChunkResult  # noqa: PLC0415

    known = [robot for robot, (done, _) in counts.items() if done]
    found = []
    for robot in known[:: max(1, len(known) // _READ)][:_READ]:
        answers = (store.answer(robot, index) for index in reversed(range(len(store.manifest.cut))))
        found += [next(a.seconds for a in answers if isinstance(a, ChunkResult))]
    return sum(found) / len(found) if found else None


@command.command(epilog="Example: urdfkin campaign merge whole shard-1 shard-2 shard-3 shard-4")
@click.argument("folder", metavar="DIR", type=_FOLDER)
@click.argument("stores", metavar="STORE...", nargs=-1, required=True, type=_FOLDER)
def merge(folder: Path, stores: tuple[Path, ...]) -> None:
    """Copy into DIR what other stores of the same campaign have, the judge's too: shards from other machines.

    Each file is read and checked; what is damaged is said and left out. DIR is made if it is not there.
    """
    from urdfkin.validation.accuracy_store import AccuracyResult  # noqa: PLC0415  keeps --help fast
    from urdfkin.validation.store import Store, opened  # noqa: PLC0415

    others = [Store.reading(store, _warn) for store in stores]
    with opened(folder, others[0].manifest, _warn) as whole:
        for other in others[1:]:
            whole.demand_same(other.manifest, other.folder)
        for other in others:
            say(f"{other.folder}: {whole.take(other):,} chunks taken")
        if any(other.has_judge for other in others):
            AccuracyResult.merge(whole, others)
        counts = whole.counts()
        size = len(whole.manifest.cut)
        missing = sum(size - done for done, failed in counts.values() if not failed)
        _say_judged(whole, counts)
    say(f"{folder}: complete" if not missing else f"{folder}: {missing:,} chunks are missing")


def _warn(message: str) -> None:
    say(f"urdfkin: warning: {message}", err=True)
