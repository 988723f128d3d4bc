"""`urdfkin validate --judge`: the true errors of urdfkin and of Pinocchio."""

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
    """The report with a judgement of every robot that was compared.

    One that cannot be judged costs its judgement and a line on stderr; an interrupt costs those to come.

    Args:
        report: What `validate` found about the robots given, in their order.
        given: Robots, or what names them.
        asked: What the judge is asked for.
        store: The folder that keeps what `validate` found, and the judge.
        shard: Only the robots whose first chunk is in that part, of which the report tells.
        retry: Whether what could not be judged before is tried again.
        how: `mimic`, `root_joint` and `xacro_args`, as in `load`.
    """
    from urdfkin.validation.accuracy_store import NotJudged  # noqa: PLC0415
    from urdfkin.validation.campaign import shares  # noqa: PLC0415  keeps --help fast
    from urdfkin.validation.chunk import Cut  # noqa: PLC0415

    parts = shares(len(given), Cut(report.samples), shard)
    here = [i for i, part in enumerate(parts) if part]
    judgements: list[Judgement | None] = []
    try:
        with _kept(store, asked, shard) as kept:
            for i, robot in zip(here, report.robots, strict=True):
                if not robot.tallies or parts[i].start > 0:
                    continue
                found = None if kept is None else kept.found(i)
                if found is None or (retry and isinstance(found, NotJudged)):
                    found, is_lasting = _judged(given[i], asked, None if kept is None else kept.stamp(i), how)
                    if kept is not None and is_lasting:
                        kept.keep(i, found)
                if isinstance(found, NotJudged):
                    say(f"urdfkin: {robot.source}: not judged: {found.reason}", err=True)
                judgements.append(None if isinstance(found, NotJudged) else found)
    except KeyboardInterrupt:
        report = replace(report, interrupted=True)
    return replace(report, judgements=tuple(judgements))


@contextmanager
def _kept(folder: Path | None, asked: Asked, shard: str | None) -> Iterator[AccuracyResult | None]:
    """The judgements in a store, of which the whole or a part is for this process alone."""
    if folder is None:
        yield None
        return
    from urdfkin.validation.accuracy_store import AccuracyResult  # noqa: PLC0415  keeps --help fast
    from urdfkin.validation.store import Store, opened  # noqa: PLC0415

    def tell(message: str) -> None:
        say(f"urdfkin: warning: {message}", err=True)

    with opened(folder, Store.reading(folder, tell).manifest, tell, shard=shard) as store:
        judged = AccuracyResult(store, asked)
        judged.begin()
        yield judged


def _judged(
    source: Robot | str, asked: Asked, stamp: str | None, how: Mapping[str, Any]
) -> tuple[Judgement | NotJudged, bool]:
    """What the judge says, and whether it would say so again."""
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
        raise InputError("the file has changed since it was compared", remedy="begin again when it stays")
    except Exception as error:
        return NotJudged(f"{type(error).__name__}: {error}"), is_same and isinstance(error, UrdfkinError)
