"""What is asked of one mutant: check it, load it, compute it, and have Pinocchio compute it."""

from __future__ import annotations

import traceback
import warnings
from dataclasses import dataclass

import numpy as np

import urdfkin
from urdfkin.diagnostics import Finding, Severity, UrdfError
from urdfkin.errors import UrdfkinError
from urdfkin.robot import Robot

#: Findings about sizes that arithmetic cannot carry: a result that is no number is no surprise after them.
_SIZES = {"URDF526", "URDF603", "URDF606"}


@dataclass(frozen=True, slots=True)
class Outcome:
    """What happened, in one of the words of `GOOD` or in words that accuse, and the details."""

    word: str
    details: str = ""


def judge(data: bytes) -> Outcome:
    """What happens to a document on its way to numbers."""
    try:
        return _judge(data)
    except UrdfkinError as error:
        return Outcome(f"raises {type(error).__name__}", str(error))
    except Exception as error:
        return Outcome(f"traceback: {type(error).__name__}", traceback.format_exc())


def _judge(data: bytes) -> Outcome:
    findings = urdfkin.check(data)
    errors = [finding for finding in findings if finding.severity is Severity.ERROR]
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        try:
            robot = urdfkin.load(data)
        except UrdfError as error:
            if errors:
                return Outcome("refused", errors[0].code)
            return Outcome("load refuses what check does not", str(error))
        if errors:
            return Outcome("load takes what check refuses", str(errors[0]))
        return _computed(robot, findings, warned)


def _computed(robot: Robot, findings: list[Finding], warned: list[warnings.WarningMessage]) -> Outcome:
    frames = [f"link:{robot.tree.links[-1]}", f"link:{robot.tree.links[len(robot.tree.links) // 2]}"]
    generator = np.random.default_rng(0)
    q = robot.sample(2, seed=0)
    v, a = generator.normal(size=(2, 2, robot.nv))
    big = bool(_SIZES & {finding.code for finding in findings})
    try:
        results = [
            result
            for frame in frames
            for result in (
                robot.placement(q, frame),
                robot.velocity(q, v, frame),
                robot.jacobian(q, frame),
                robot.acceleration(q, v, a, frame),
            )
        ]
    except (urdfkin.VerificationError, urdfkin.InputError) as error:
        words = {True: "too large to compute, with a finding", False: "disagrees with Pinocchio"}
        overflow = isinstance(error, urdfkin.InputError)
        return Outcome(
            "overflows, and no finding says why" if overflow and not big else words[big], str(error)
        )
    certified = robot.certificate()
    if not all(np.isfinite(result).all() for result in results):
        return Outcome("too large to compute, with a finding" if big else "a result that is no number")
    if certified.verified:
        return Outcome("verified")
    marked = [finding for finding in findings if finding.oracle is not None]
    if marked:
        return Outcome("not verified, with a finding that says why", marked[0].code)
    return Outcome("not verified, and no finding says why", "; ".join(str(w.message) for w in warned))
