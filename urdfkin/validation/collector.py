"""Collect the answers of a run, report the progress, and make the report of each robot.

The results of consecutive chunks are stored as one sum, to save memory. The error statistics in the sum do
not depend on the order in which the results arrive.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add

from urdfkin.validation.answer import Answer, Failure
from urdfkin.validation.chunk import Chunking, ChunkResult
from urdfkin.validation.document import ValidationVerdict
from urdfkin.validation.engines import Task
from urdfkin.validation.error_stats import ErrorStats, Key, add_cross_checks
from urdfkin.validation.results import RobotReport
from urdfkin.validation.robot_input import RobotInput
from urdfkin.validation.robot_summary import EMPTY_SUMMARY, RobotSummary
from urdfkin.verify.oracles import ORACLES


@dataclass(frozen=True, slots=True)
class CampaignProgress:
    """Progress of a campaign.

    Attributes:
        robots_done: Number of complete or failed robots.
        chunks_done: Number of chunks that are finished or no longer needed.
        chunks_from_earlier_run: The part of `chunks_done` that comes from an earlier run.
        failures: Number of robots with a disagreement or a failed chunk.
        label: Name of the robot of the latest chunk; before the first chunk, the name of the first robot.
    """

    robots_done: int
    robots: int
    chunks_done: int
    chunks: int
    chunks_from_earlier_run: int
    failures: int
    label: str


Progress = Callable[[CampaignProgress], None]


class ResultCollector:
    """Collect the answers of a run. `chunk_ranges` contains the chunks to run of each robot."""

    def __init__(
        self,
        robot_inputs: Sequence[RobotInput],
        chunking: Chunking,
        chunk_ranges: Sequence[range],
        progress: Progress | None = None,
    ) -> None:
        self._robot_inputs, self._chunking, self._progress = robot_inputs, chunking, progress
        self._robots = [_RobotAnswers(chunks) for chunks in chunk_ranges]
        self._chunks = sum(map(len, chunk_ranges))
        self._chunks_done = self._from_earlier = self._robots_done = self._failures = 0

    def begin(self) -> None:
        if self._progress is not None:
            self._progress(self.make_progress(self._robot_inputs[0].label if self._robot_inputs else ""))

    def add(self, task: Task, answer: Answer, *, from_earlier_run: bool = False) -> None:
        robot = self._robots[task.robot]
        was_complete, had_problem, before = robot.is_complete, robot.has_problem, robot.chunks_done
        robot.add(task.chunk.index, answer)
        self._chunks_done += robot.chunks_done - before
        self._from_earlier += from_earlier_run * (robot.chunks_done - before)
        self._robots_done += robot.is_complete and not was_complete
        self._failures += robot.has_problem and not had_problem
        if self._progress is not None:
            self._progress(self.make_progress(self._robot_inputs[task.robot].label))

    def make_progress(self, label: str = "") -> CampaignProgress:
        return CampaignProgress(
            robots_done=self._robots_done,
            robots=sum(bool(robot.chunks) for robot in self._robots),
            chunks_done=self._chunks_done,
            chunks=self._chunks,
            chunks_from_earlier_run=self._from_earlier,
            failures=self._failures,
            label=label,
        )

    def missing_chunks(self, robot: int) -> Iterator[int]:
        robot_answers = self._robots[robot]
        for index in robot_answers.chunks:
            if robot_answers.failures:
                return
            if index not in robot_answers:
                yield index

    def fail_unfinished(self, failure: Failure) -> None:
        for robot in self._robots:
            if not robot.is_complete:
                robot.failures[len(self._chunking)] = failure

    def make_reports(self) -> Iterator[RobotReport]:
        for robot_input, robot in zip(self._robot_inputs, self._robots, strict=True):
            if robot.chunks:
                yield robot.make_report(robot_input, self._chunking.count_configurations(robot.chunks))


class _RobotAnswers:
    def __init__(self, chunks: range) -> None:
        self.chunks = chunks
        self.failures: dict[int, Failure] = {}
        #: Sum of the results in each range of chunks.
        #: The ranges are disjoint and in ascending order.
        self._sums: list[tuple[range, ChunkResult]] = []
        self._has_disagreed = False

    def add(self, index: int, answer: Answer) -> None:
        if isinstance(answer, Failure):
            self.failures[index] = answer
        else:
            summary = answer.summary or EMPTY_SUMMARY
            self._has_disagreed = self._has_disagreed or any(
                _describe_disagreements(answer.error_stats, summary)
            )
            self._add_result(range(index, index + 1), answer)

    def _add_result(self, chunks: range, result: ChunkResult) -> None:
        at = next((i for i, (run, _) in enumerate(self._sums) if run.start > chunks.start), len(self._sums))
        if at and self._sums[at - 1][0].stop == chunks.start:
            at -= 1
            before, earlier = self._sums.pop(at)
            chunks, result = range(before.start, chunks.stop), earlier + result
        if at < len(self._sums) and self._sums[at][0].start == chunks.stop:
            after, later = self._sums.pop(at)
            chunks, result = range(chunks.start, after.stop), result + later
        self._sums.insert(at, (chunks, result))

    def __contains__(self, index: int) -> bool:
        return index in self.failures or any(index in run for run, _ in self._sums)

    @property
    def has_problem(self) -> bool:
        return self._has_disagreed or bool(self.failures)

    @property
    def chunks_done(self) -> int:
        return len(self.chunks) if self.failures else sum(len(run) for run, _ in self._sums)

    @property
    def is_complete(self) -> bool:
        return self.chunks_done == len(self.chunks)

    def make_report(self, robot_input: RobotInput, requested_samples: int) -> RobotReport:
        # The report contains only results of chunks before the first failed chunk. Otherwise, the report
        # would depend on the speed of the workers.
        last = min(self.failures, default=self.chunks.stop)
        failure = self.failures.get(last)
        results = [each for run, each in self._sums if run.start < last]
        result = reduce(add, results) if results else None
        error_stats = result.error_stats if result else {}
        summary = (result.summary if result else None) or EMPTY_SUMMARY
        if failure is not None and summary is EMPTY_SUMMARY:
            summary = failure.summary
        samples = result.samples if result else 0
        verdict, reasons = _decide_verdict(error_stats, summary, failure, samples, requested_samples)
        name = result.name if result else summary.model["name"] if summary.model else robot_input.label
        return RobotReport(
            origin=robot_input.origin,
            name=name,
            verdict=verdict,
            reason="; ".join(reasons) or None,
            joints=result.joints if result else (),
            frames=result.frames if result else (),
            error_stats=error_stats,
            samples=samples,
            seconds=result.seconds if result else 0.0,
            summary=summary,
            timings=result.timings if result else None,
            error=failure.error if failure else None,
        )


def _decide_verdict(
    error_stats: dict[Key, ErrorStats],
    summary: RobotSummary,
    failure: Failure | None,
    samples: int,
    requested_samples: int,
) -> tuple[ValidationVerdict, list[str]]:
    """Return the verdict and its reasons; a disagreement takes precedence over a failure."""
    disagreements = list(_describe_disagreements(error_stats, summary))
    verdict, reasons = ValidationVerdict.VERIFIED, list[str]()
    if failure is not None:
        verdict, reasons = failure.verdict, [failure.reason]
    elif samples < requested_samples:
        verdict = ValidationVerdict.NOT_VERIFIED
        reasons = [f"interrupted: {samples:,} of {requested_samples:,} samples were compared"]
    elif not any(stats.results for stats in error_stats.values()):
        verdict, reasons = ValidationVerdict.NOT_VERIFIED, ["nothing was compared"]
    return (ValidationVerdict.DISAGREES if disagreements else verdict), disagreements + reasons


def _describe_disagreements(error_stats: dict[Key, ErrorStats], summary: RobotSummary) -> Iterator[str]:
    failed = sum(stats.failed for stats in error_stats.values())
    if failed:
        results = sum(stats.results for stats in error_stats.values())
        yield f"{failed:,} of {results:,} results lie outside their bound"
    total = reduce(add_cross_checks, (stats.cross_check for stats in error_stats.values()), None)
    if total is not None and total.urdfkin.failed:
        urdfkin, pinocchio, second = total.alone
        title = ORACLES[total.by].title
        words = "result of urdfkin disagrees" if total.urdfkin.failed == 1 else "results of urdfkin disagree"
        yield (
            f"{total.urdfkin.failed:,} {words} with {title} (results in which only one library differs from"
            f" the two others: urdfkin {urdfkin:,}, Pinocchio {pinocchio:,}, {title} {second:,})"
        )
    yield from summary.disagreements
