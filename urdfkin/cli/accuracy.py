"""`urdfkin validate --judge`: accuracy study of urdfkin and Pinocchio."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from urdfkin.cli.streams import say
from urdfkin.errors import InputError, UrdfkinError

if TYPE_CHECKING:
    from urdfkin.robot import Robot
    from urdfkin.validation.accuracy import Judgement
    from urdfkin.validation.accuracy_store import AccuracyResult, Asked, NotJudged
    from urdfkin.validation.results import ValidationReport


def judge_all(
    report: ValidationReport,
    given: Sequence[Robot | str],
    asked: Asked,
    *,
    store: Path | None = None,
    shard: str | None = None,
    retry: bool = False,
    how: Mapping[str, Any],
) -> ValidationReport:
    """Run the accuracy study of every compared robot and return the report with its results.

    If the study of a robot fails, a line on stderr states the reason. An interrupt skips the remaining
    robots.

    Args:
        report: The report of `validate` on the given robots, in their order.
        given: Robots, or their sources.
        asked: Settings of the study.
        store: Folder of the campaign, which also stores the results of the study; None: no store.
        shard: Only the robots with their first chunk in that part. The report covers the same part.
        retry: Whether to repeat studies that failed before.
        how: `mimic`, `root_joint` and `xacro_args`, as in `load`.

    Returns:
        The report with the results of the study.
    """
    from urdfkin.validation.accuracy_store import NotJudged  # noqa: PLC0415
    from urdfkin.validation.campaign import shares  # noqa: PLC0415  keeps --help fast
    from urdfkin.validation.chunk import Cut  # noqa: PLC0415

    parts = shares(len(given), Cut(report.samples), shard)
    here = [i for i, part in enumerate(parts) if part]
    judgements: list[Judgement | None] = []
    try:
        with _open_results(store, asked, shard) as results:
            for i, robot in zip(here, report.robots, strict=True):
                if not robot.tallies or parts[i].start > 0:
                    continue
                found = None if results is None else results.found(i)
                if found is None or (retry and isinstance(found, NotJudged)):
                    found, is_lasting = _study(
                        given[i], asked, None if results is None else results.stamp(i), how
                    )
                    if results is not None and is_lasting:
                        results.keep(i, found)
                if isinstance(found, NotJudged):
                    say(f"urdfkin: {robot.source}: no accuracy result: {found.reason}", err=True)
                judgements.append(None if isinstance(found, NotJudged) else found)
    except KeyboardInterrupt:
        report = replace(report, interrupted=True)
    return replace(report, judgements=tuple(judgements))


@contextmanager
def _open_results(folder: Path | None, asked: Asked, shard: str | None) -> Iterator[AccuracyResult | None]:
    """Open the accuracy results of a store, locked as a whole or for one part."""
    if folder is None:
        yield None
        return
    from urdfkin.validation.accuracy_store import AccuracyResult  # noqa: PLC0415  keeps --help fast
    from urdfkin.validation.store import Store, opened  # noqa: PLC0415

    def tell(message: str) -> None:
        say(f"urdfkin: warning: {message}", err=True)

    with opened(folder, Store.reading(folder, tell).manifest, tell, shard=shard) as store:
        store_results = AccuracyResult(store, asked)
        store_results.begin()
        yield store_results


def _study(
    source: Robot | str, asked: Asked, stamp: str | None, how: Mapping[str, Any]
) -> tuple[Judgement | NotJudged, bool]:
    """Return the accuracy result of a robot, and whether a repetition would give the same."""
    import numpy as np  # noqa: PLC0415  keeps --help fast

    from urdfkin.validation.accuracy import judge  # noqa: PLC0415
    from urdfkin.validation.accuracy_store import NotJudged  # noqa: PLC0415
    from urdfkin.validation.robot_input import subject  # noqa: PLC0415
    from urdfkin.verify.sampling import draw_base  # noqa: PLC0415

    is_same = True
    try:
        robot = subject(source, **how)
        if is_same := stamp in (None, robot.stamp):
            rng = np.random.default_rng([asked.seed, 1])
            base = draw_base(asked.samples, rng) if asked.moving_base else None
            return judge(robot.read(), samples=asked.samples, seed=asked.seed, base=base), True
        raise InputError(
            "the file has changed since it was compared",
            remedy="start the validation again when the file no longer changes",
        )
    except Exception as error:
        return NotJudged(f"{type(error).__name__}: {error}"), is_same and isinstance(error, UrdfkinError)
