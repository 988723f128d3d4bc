"""`urdfkin validate --judge`: the true errors of urdfkin and of Pinocchio."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from urdfkin.judge import Judgement
    from urdfkin.robot import Robot
    from urdfkin.validation.report import ValidationReport


def judge_all(
    report: ValidationReport, given: Sequence[Robot | str], samples: int, seed: int, **how: Any
) -> tuple[Judgement, ...]:
    """Judge every robot that was validated; one that could not be read has nothing to judge.

    Args:
        report: What `validate` found about the robots given, in their order.
        given: Robots, or what names them.
        samples: Configurations for each.
        seed: What they are drawn from.
        **how: `mimic`, `root_joint` and `xacro_args`, as in `load`.
    """
    from urdfkin.diagnostics import UrdfWarning  # noqa: PLC0415  keeps --help fast
    from urdfkin.judge import judge  # noqa: PLC0415
    from urdfkin.loading import load  # noqa: PLC0415

    judgements = []
    # An interrupted run reports on fewer robots than were given.
    for robot, source in zip(report.robots, given, strict=False):
        if robot.tallies:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UrdfWarning)  # said already
                loaded = load(source, **how) if isinstance(source, str) else source
            judgements.append(judge(loaded, samples=samples, seed=seed))
    return tuple(judgements)
