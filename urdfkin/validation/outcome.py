"""Verdict on a robot, and outcome of a validation run with the reason.

Only this module decides whether a run has passed, for new reports and for reports that are read from a file.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum


class ValidationVerdict(StrEnum):
    """Result of the validation of a robot; HTML and Markdown reports list robots in this order."""

    BAD_INPUT = "bad input"
    NOT_VERIFIED = "not verified"
    DISAGREES = "disagrees"
    VERIFIED = "verified"


#: Exit codes: a result disagrees, a robot cannot be read, or Pinocchio did not check a robot.
DISAGREEMENT, INPUT, UNCHECKED = 1, 2, 3
#: Exit code of an interrupted run, as in shells: 128 + SIGINT.
INTERRUPTED = 130
_WORDS = {
    ValidationVerdict.DISAGREES: ("disagrees", "disagree"),
    ValidationVerdict.NOT_VERIFIED: ("is not verified", "are not verified"),
    ValidationVerdict.BAD_INPUT: ("has bad input", "have bad input"),
}
OUTCOMES = {
    0: ValidationVerdict.VERIFIED.value,
    DISAGREEMENT: ValidationVerdict.DISAGREES.value,
    INTERRUPTED: "interrupted",
    INPUT: ValidationVerdict.BAD_INPUT.value,
    UNCHECKED: ValidationVerdict.NOT_VERIFIED.value,
}


@dataclass(frozen=True, slots=True)
class RunOutcome:
    """The outcome of a validation run.

    Attributes:
        exit_code: 0 if everything is verified. Otherwise the first code that applies, in this order: 1 (a
            disagreement), 130 (interrupted), 2 (a robot cannot be read), 3 (a robot was not verified, or
            there was no robot).
    """

    exit_code: int
    reason: str | None

    @property
    def verdict(self) -> str:
        """The verdict of the run, which belongs to `exit_code`: a verdict on a robot, or "interrupted"."""
        return OUTCOMES[self.exit_code]

    @property
    def passed(self) -> bool:
        return self.reason is None


def outcome(verdicts: Iterable[str], asked: int, interrupted: bool) -> RunOutcome:
    """Return the outcome of a run with `asked` requested robots.

    >>> outcome(["bad input", "bad input"], asked=3, interrupted=False).reason
    '2 of 3 robots have bad input, 1 of 3 robots without a report'
    """
    counts = Counter(map(str, verdicts))
    robots = "1 robot" if asked == 1 else f"{asked:,} robots"
    reasons = ["the validation was interrupted before everything was compared"] if interrupted else []
    reasons += [
        f"{counts[verdict]} of {robots} {words[counts[verdict] > 1]}"
        for verdict, words in _WORDS.items()
        if counts[verdict]
    ]
    if missing := asked - counts.total():
        reasons.append(f"{missing} of {robots} without a report")
    if not asked:
        reasons.append("no robot was validated")
    return RunOutcome(_exit_code(counts, interrupted, bool(reasons)), ", ".join(reasons) or None)


def _exit_code(counts: Counter[str], interrupted: bool, failed: bool) -> int:
    if counts[ValidationVerdict.DISAGREES]:
        return DISAGREEMENT
    if interrupted:
        return INTERRUPTED
    if counts[ValidationVerdict.BAD_INPUT]:
        return INPUT
    return UNCHECKED if failed else 0
