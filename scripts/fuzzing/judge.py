"""Test one robot: check it, load it, compute all quantities and compare them with Pinocchio."""

from __future__ import annotations

import traceback
import warnings
from dataclasses import dataclass

import numpy as np

import urdfkin
from scripts.fuzzing import Case, mjcf
from scripts.fuzzing.asking import MismatchError, ask, ask_prepared
from urdfkin.errors import InputError, RangeError, UrdfkinError
from urdfkin.robot import Robot
from urdfkin.urdf.lint import Finding, Severity, UrdfError
from urdfkin.urdf.mjcf import is_mjcf
from urdfkin.verify.verifier import NotVerifiedWarning

#: Findings about sizes beyond the floating-point range.
#: Results of robots with such findings may be infinite or nan.
_SIZES = {"URDF526", "URDF603", "URDF606"}


@dataclass(frozen=True, slots=True)
class Outcome:
    """The outcome of a test and its details. The outcome is one of `GOOD`, or the name of a failure."""

    word: str
    details: str = ""


def judge(case: Case) -> Outcome:
    """Return the outcome of a document."""
    try:
        return _judge_mjcf(case) if is_mjcf(case.data) else _judge(case)
    except UrdfkinError as error:
        return Outcome(f"raises {type(error).__name__}", traceback.format_exc())
    except Exception as error:
        return Outcome(f"traceback: {type(error).__name__}", traceback.format_exc())


def _judge(case: Case) -> Outcome:
    findings = urdfkin.check(case.data, root_joint=case.root_joint, mimic=case.mimic)
    errors = [finding for finding in findings if finding.severity is Severity.ERROR]
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        try:
            robot = urdfkin.load(case.data, root_joint=case.root_joint, mimic=case.mimic)
        except UrdfError as error:
            if errors:
                return Outcome("refused", errors[0].code)
            return Outcome("load refuses a file that check accepts", str(error))
        if errors:
            return Outcome("load accepts a file that check refuses", str(errors[0]))
        return _computed(robot, findings, warned) or _unverified(robot, findings, warned)


def _judge_mjcf(case: Case) -> Outcome:
    model = mjcf.compiled(case.data)
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        try:
            robot = urdfkin.load(case.data, mimic=case.mimic)
        except InputError as error:
            known = model is None or error.remedy is not None
            return Outcome("refused" if known else "load refuses a file that MuJoCo accepts", str(error))
        if model is not None and (found := mjcf.difference(robot, model, 0)) is not None:
            return Outcome("MuJoCo reads another robot", found)
        return _computed(robot, robot.findings, warned) or _unverified(robot, robot.findings, warned)


def _computed(robot: Robot, findings: list[Finding], warned: list[warnings.WarningMessage]) -> Outcome | None:
    """Compute all quantities and return the outcome; None if some results are not verified."""
    big = bool(_SIZES & {finding.code for finding in findings})
    too_large = (
        "too large to compute, with a finding that states the reason"
        if big
        else "a result is not a finite number"
    )
    try:
        for what, result in ask(robot, seed=0):
            if not np.isfinite(result).all():
                return Outcome(too_large, what)
        # The certificate does not include tables; for a table that is not verified there is a warning.
        doubted = any(issubclass(w.category, NotVerifiedWarning) for w in warned)
        verified = robot.certificate().verified and not doubted
        ask_prepared(robot, seed=0)
    except urdfkin.VerificationError as error:
        return Outcome("disagrees with Pinocchio", str(error))
    except urdfkin.TableError as error:
        return Outcome("a table disagrees with Pinocchio", str(error))
    except RangeError as error:
        return Outcome(too_large, str(error))
    except MismatchError as error:
        return Outcome("two computations of one result differ", str(error))
    return Outcome("verified") if verified else None


def _unverified(robot: Robot, findings: list[Finding], warned: list[warnings.WarningMessage]) -> Outcome:
    """Return the outcome if some results are not verified.

    The outcome is good if urdfkin reported the reason. Otherwise, it is a failure.
    """
    marked = [finding for finding in findings if finding.oracle is not None]
    if marked:
        return Outcome("not verified, with a finding that states the reason", marked[0].code)
    if (reason := robot.verifier.cannot()) is not None:
        return Outcome("Pinocchio refuses a file that check accepts", reason)
    return Outcome(
        "not verified, without a finding that states the reason", "; ".join(str(w.message) for w in warned)
    )
