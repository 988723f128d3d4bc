"""What has come back of a run, and the report that it makes of each robot.

Whatever was asked for is reported on: a robot of which nothing came back, or not everything, is not verified.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import reduce

from urdfkin.validation.answer import Answer, Failure
from urdfkin.validation.chunk import ChunkResult, Subject
from urdfkin.validation.clock import total
from urdfkin.validation.engine import Task
from urdfkin.validation.outcome import Verdict
from urdfkin.validation.portrait import NO_PORTRAIT, Portrait
from urdfkin.validation.results import RobotReport
from urdfkin.validation.tally import Key, Tally
from urdfkin.validation.three_sides import plus
from urdfkin.verify.witnesses import WITNESSES

#: Called after each chunk with (chunks done, chunks in all, the robot's source).
Progress = Callable[[int, int, str], None]


class Gathering:
    """The answers of a run, by robot and chunk.

    Args:
        subjects: The robots.
        tasks: All chunks.
        progress: Told after each answer.
    """

    def __init__(self, subjects: Sequence[Subject], tasks: Sequence[Task], progress: Progress | None) -> None:
        self._subjects, self._progress = subjects, progress
        self._samples: list[dict[int, int]] = [{} for _ in subjects]
        for task in tasks:
            self._samples[task.robot][task.chunk.index] = task.chunk.configurations
        self._results: list[dict[int, ChunkResult]] = [{} for _ in subjects]
        self._failures: list[dict[int, Failure]] = [{} for _ in subjects]

    def enter(self, task: Task, found: Answer) -> None:
        """Take an answer."""
        if isinstance(found, Failure):
            self._failures[task.robot][task.chunk.index] = found
        else:
            self._results[task.robot][task.chunk.index] = found
        if self._progress is not None:
            done = sum(self._done(i) for i in range(len(self._subjects)))
            self._progress(done, sum(map(len, self._samples)), self._subjects[task.robot].label)

    def _done(self, robot: int) -> int:
        """How many of a robot's chunks need no more waiting for."""
        return len(self._samples[robot]) if self._failures[robot] else len(self._results[robot])

    def give_up(self, found: Failure) -> None:
        """The answer for every robot that has not all of its own."""
        for i, samples in enumerate(self._samples):
            if self._done(i) < len(samples):
                self._failures[i][len(samples)] = found

    def reports(self) -> Iterator[RobotReport]:
        """A report for each robot, in the order asked for."""
        return (self._report(i) for i in range(len(self._subjects)))

    def _report(self, i: int) -> RobotReport:
        results = [self._results[i][index] for index in sorted(self._results[i])]
        failures = self._failures[i]
        failure = failures[min(failures)] if failures else None
        tallies: dict[Key, Tally] = {}
        for result in results:
            for key, tally in result.tallies.items():
                tallies[key] = tallies[key] + tally if key in tallies else tally
        portrait = next((result.portrait for result in results if result.portrait), NO_PORTRAIT)
        if failure is not None and portrait is NO_PORTRAIT:
            portrait = failure.portrait
        subject, samples = self._subjects[i], sum(self._samples[i][index] for index in self._results[i])
        verdict, reasons = _verdict(tallies, portrait, failure, samples, sum(self._samples[i].values()))
        known = results[0].name if results else portrait.model["name"] if portrait.model else subject.label
        return RobotReport(
            origin=subject.origin,
            name=known,
            verdict=verdict,
            reason="; ".join(reasons) or None,
            joints=results[0].joints if results else (),
            frames=results[0].frames if results else (),
            tallies=tallies,
            samples=samples,
            seconds=sum(result.seconds for result in results),
            portrait=portrait,
            clock=total(result.clock for result in results) if results else None,
            error=failure.error if failure else None,
        )


def _verdict(
    tallies: dict[Key, Tally], portrait: Portrait, failure: Failure | None, samples: int, wanted: int
) -> tuple[Verdict, list[str]]:
    """The verdict and every reason for it: a disagreement stays one, whatever else went wrong."""
    disagreements = [*_outside(tallies), *portrait.disagreements]
    verdict, reasons = Verdict.VERIFIED, list[str]()
    if failure is not None:
        verdict, reasons = failure.verdict, [failure.reason]
    elif samples < wanted:
        verdict = Verdict.NOT_VERIFIED
        reasons = [f"interrupted: {samples:,} of {wanted:,} samples were compared"]
    elif not any(tally.results for tally in tallies.values()):
        verdict, reasons = Verdict.NOT_VERIFIED, ["nothing was compared"]
    return (Verdict.DISAGREES if disagreements else verdict), disagreements + reasons


def _outside(tallies: dict[Key, Tally]) -> Iterator[str]:
    failed = sum(tally.failed for tally in tallies.values())
    if failed:
        results = sum(tally.results for tally in tallies.values())
        yield f"{failed:,} of {results:,} results lie outside their bound"
    found = reduce(plus, (tally.witness for tally in tallies.values()), None)
    if found is not None and found.urdfkin.failed:
        ours, theirs, witness = found.alone
        title = WITNESSES[found.by].title
        yield (
            f"{found.urdfkin.failed:,} results disagree with {title}'s: urdfkin stands alone in {ours:,},"
            f" Pinocchio in {theirs:,}, {title} in {witness:,}"
        )
