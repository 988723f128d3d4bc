"""What a validation comes to: a verdict for each robot, and one outcome of the run with its reason.

The one place that says when a run has passed: the report as it is made and the document that is read later
both ask here.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum


class Verdict(StrEnum):
    """What a robot's validation comes to; worse ones first."""

    BAD_INPUT = "bad input"
    NOT_VERIFIED = "not verified"
    DISAGREES = "disagrees"
    VERIFIED = "verified"


#: Exit codes: of a disagreement, and of nothing else; of input; of what Pinocchio did not check.
DISAGREEMENT, INPUT, UNCHECKED = 1, 2, 3
#: Of a run that was ended: 128 and SIGINT's number, as shells have it.
INTERRUPTED = 130


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a run ended.

    Attributes:
        exit_code: 0 everything verified; else the first that holds of 1 a disagreement, 130 interrupted, 2 a
            robot that cannot be read, 3 a robot that was not verified, or none.
        reason: Why it has not passed, in one line; None where it has.
    """

    exit_code: int
    reason: str | None

    @property
    def passed(self) -> bool:
        """Whether every robot that was asked for was verified, and there was one."""
        return self.reason is None


def outcome(verdicts: Iterable[str], asked: int, interrupted: bool) -> Outcome:
    """The outcome of a run.

    Args:
        verdicts: Of the robots that are reported on.
        asked: How many robots were to be validated.
        interrupted: Whether the run was ended before it was done.

    >>> outcome(["verified", "disagrees"], asked=3, interrupted=False)
    Outcome(exit_code=1, reason='1 of 3 robots disagrees, 1 of 3 robots without a report')
    """
    counts = Counter(map(str, verdicts))
    unknown = sum(counts.values()) != asked
    reasons = ["interrupted before everything was compared"] if interrupted else []
    reasons += [
        f"{counts[verdict]} of {_robots(asked)} {verdict.value}"
        for verdict in (Verdict.DISAGREES, Verdict.NOT_VERIFIED, Verdict.BAD_INPUT)
        if counts[verdict]
    ]
    if unknown:
        reasons.append(f"{asked - sum(counts.values())} of {_robots(asked)} without a report")
    if not asked:
        reasons.append("no robot was validated")
    return Outcome(_exit_code(counts, interrupted, bool(reasons)), ", ".join(reasons) or None)


def _exit_code(counts: Counter[str], interrupted: bool, failed: bool) -> int:
    if counts[Verdict.DISAGREES]:
        return DISAGREEMENT
    if interrupted:
        return INTERRUPTED
    if counts[Verdict.BAD_INPUT]:
        return INPUT
    return UNCHECKED if failed else 0


def _robots(n: int) -> str:
    return "1 robot" if n == 1 else f"{n:,} robots"
