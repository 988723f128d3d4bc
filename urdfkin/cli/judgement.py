"""`urdfkin validate --judge`: the true errors of urdfkin and of Pinocchio."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from urdfkin.cli.door import say

if TYPE_CHECKING:
    from urdfkin.judge import Judgement
    from urdfkin.robot import Robot
    from urdfkin.validation.report import ValidationReport


def judge_all(
    report: ValidationReport, given: Sequence[Robot | str], samples: int, seed: int, **how: Any
) -> ValidationReport:
    """The report with a judgement of every robot that was compared.

    One that cannot be judged costs its judgement and a line on stderr; an interrupt costs those to come.

    Args:
        report: What `validate` found about the robots given, in their order.
        given: Robots, or what names them.
        samples: Configurations for each.
        seed: What they are drawn from.
        **how: `mimic`, `root_joint` and `xacro_args`, as in `load`.
    """
    found: list[Judgement | None] = []
    try:
        for robot, source in zip(report.robots, given, strict=True):
            if robot.tallies:
                found.append(_judged(source, samples, seed, how))
    except KeyboardInterrupt:
        report = replace(report, interrupted=True)
    return replace(report, judgements=tuple(found))


def _judged(source: Robot | str, samples: int, seed: int, how: dict[str, Any]) -> Judgement | None:
    from urdfkin.judge import judge  # noqa: PLC0415
    from urdfkin.lint import UrdfWarning  # noqa: PLC0415  keeps --help fast
    from urdfkin.loading import load  # noqa: PLC0415

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UrdfWarning)  # said already
            loaded = load(source, **how) if isinstance(source, str) else source
        return judge(loaded, samples=samples, seed=seed)
    except Exception as error:
        name = source if isinstance(source, str) else source.source
        say(f"urdfkin: {name}: not judged: {type(error).__name__}: {error}", err=True)
        return None
