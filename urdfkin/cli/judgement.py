"""`urdfkin validate --judge`: the true errors of urdfkin and of Pinocchio."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from urdfkin.cli.door import say

if TYPE_CHECKING:
    from urdfkin.robot import Robot
    from urdfkin.validation.judgement import Judgement
    from urdfkin.validation.results import ValidationReport


def judge_all(
    report: ValidationReport,
    given: Sequence[Robot | str],
    samples: int,
    seed: int,
    *,
    moving_base: bool,
    **how: Any,
) -> ValidationReport:
    """The report with a judgement of every robot that was compared.

    One that cannot be judged costs its judgement and a line on stderr; an interrupt costs those to come.

    Args:
        report: What `validate` found about the robots given, in their order.
        given: Robots, or what names them.
        samples: Configurations for each.
        seed: What they are drawn from.
        moving_base: Whether the root links move, at random.
        **how: `mimic`, `root_joint` and `xacro_args`, as in `load`.
    """
    found: list[Judgement | None] = []
    try:
        for robot, source in zip(report.robots, given, strict=True):
            if robot.tallies:
                found.append(_judged(source, samples, seed, moving_base, how))
    except KeyboardInterrupt:
        report = replace(report, interrupted=True)
    return replace(report, judgements=tuple(found))


def _judged(
    source: Robot | str, samples: int, seed: int, moving_base: bool, how: dict[str, Any]
) -> Judgement | None:
    import numpy as np  # noqa: PLC0415  keeps --help fast

    from urdfkin.lint import UrdfWarning  # noqa: PLC0415  keeps --help fast
    from urdfkin.loading import load  # noqa: PLC0415
    from urdfkin.validation.judgement import judge  # noqa: PLC0415
    from urdfkin.verify.sampling import draw_base  # noqa: PLC0415

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UrdfWarning)  # said already
            loaded = load(source, **how) if isinstance(source, str) else source
        base = draw_base(samples, np.random.default_rng([seed, 1])) if moving_base else None
        return judge(loaded, samples=samples, seed=seed, base=base)
    except Exception as error:
        name = source if isinstance(source, str) else source.source
        say(f"urdfkin: {name}: not judged: {type(error).__name__}: {error}", err=True)
        return None
