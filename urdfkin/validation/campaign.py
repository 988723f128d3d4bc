"""`validate`: cut the work into chunks, run them here or in processes, add the tallies up.

The chunks go through `Executor.map`-like submission only, so that any engine with the interface of
`concurrent.futures` can run them.
"""

from __future__ import annotations

import datetime
import hashlib
import multiprocessing
import os
import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from pathlib import Path

from urdfkin.demands import switch, whole_number
from urdfkin.diagnostics import UrdfError
from urdfkin.errors import UrdfkinError
from urdfkin.oracle import OracleError
from urdfkin.origin import Origin
from urdfkin.recursion.announcing import load_kernels
from urdfkin.robot import Robot
from urdfkin.sources import Source, as_word, is_xacro, read_source
from urdfkin.validation.chunk import SPECIAL, Chunk, ChunkResult, Subject, chunks, run_chunk
from urdfkin.validation.clock import total
from urdfkin.validation.isolation import DiedError, run_isolated
from urdfkin.validation.portrait import NO_PORTRAIT, Portrait, as_data
from urdfkin.validation.report import RobotReport, ValidationReport, Verdict
from urdfkin.validation.tally import Key, Tally

#: Called after each chunk with (chunks done, chunks in all, the robot's source).
Progress = Callable[[int, int, str], None]


def validate(
    robots: Source | Robot | Sequence[Source | Robot],
    *,
    samples: int = 1000,
    seed: int = 0,
    jobs: int = 1,
    mimic: bool | None = None,
    root_joint: str | None = None,
    xacro_args: Mapping[str, object] | None = None,
    isolate: bool = False,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> ValidationReport:
    """Hold every quantity of every frame and joint against Pinocchio's, in all three references.

    Args:
        robots: One robot or several: anything `load` takes, or robots that were loaded.
        samples: Random configurations within limits for each robot; the neutral one and the two ends of
            the limits are added. Every eighth sample has rates a hundred times larger.
        seed: The same seed gives the same numbers, whatever `jobs` and `executor` are.
        jobs: Local processes.
        mimic: As in `load`.
        root_joint: As in `load`.
        xacro_args: As in `load`, for each .xacro file among the robots.
        isolate: Each robot is checked in a process of its own, `jobs` at a time; when one dies, that robot is
            reported as not verified with the reason, and the others go on.
        executor: Runs the chunks instead of local processes.
        progress: Told after each chunk.

    Returns:
        The report. A robot that cannot be read or checked is reported, not raised; an interrupt ends the
        run and keeps what had finished.

    Raises:
        InputError: a negative number of samples, a negative seed or no job.

    >>> report = validate("ur5", samples=10)
    >>> report.passed, report.robots[0].failed
    (True, 0)
    """
    samples, seed = whole_number(samples, "samples", 0), whole_number(seed, "seed", 0)
    jobs, isolate = whole_number(jobs, "jobs", 1), switch(isolate, "isolate")
    many = robots if isinstance(robots, Sequence) and not isinstance(robots, str | bytes) else [robots]
    subjects = [_subject(robot, mimic, root_joint, xacro_args) for robot in many]
    started, begin = datetime.datetime.now(datetime.UTC), time.perf_counter()
    run = _Run(subjects, samples, seed, progress)
    try:
        load_kernels()  # once, here, so that no worker has to compile
        if executor is not None:
            run.spread(executor)
        elif isolate:
            run.isolated(jobs)
        elif jobs == 1:
            run.here()
        else:
            _spread_over_processes(run, jobs)
    except KeyboardInterrupt:
        run.interrupted = True
    return ValidationReport(
        robots=tuple(run.reports()),
        samples=samples,
        seed=seed,
        started=started.isoformat(timespec="seconds"),
        seconds=time.perf_counter() - begin,
        interrupted=run.interrupted,
    )


def _spread_over_processes(run: _Run, jobs: int) -> None:
    """Workers leave an interrupt to this process, which ends the run and keeps what is there."""
    context = multiprocessing.get_context("spawn")
    ignore = (signal.SIGINT, signal.SIG_IGN)
    with ProcessPoolExecutor(jobs, context, initializer=signal.signal, initargs=ignore) as pool:
        run.spread(pool)


def _subject(
    robot: Source | Robot,
    mimic: bool | None,
    root_joint: str | None,
    xacro_args: Mapping[str, object] | None = None,
) -> Subject:
    if isinstance(robot, Robot):
        return Subject.of(robot)
    if is_xacro(robot):
        text = read_source(robot, xacro_args=xacro_args)  # expanded once, here
        return Subject(text.data, Origin(text.source, mimic, root_joint, text.xacro_args))
    source = as_word(Path(robot)) if isinstance(robot, os.PathLike) else robot
    if isinstance(source, bytes):
        return Subject(source, Origin("<bytes>", mimic, root_joint))
    if isinstance(source, str) and source != "-":
        return _word(source, mimic, root_joint)
    text = read_source(source)  # an open file, or standard input, is read once, here
    return Subject(text.data, Origin(text.source, mimic, root_joint))


def _word(source: str, mimic: bool | None, root_joint: str | None) -> Subject:
    """A path, a name or text."""
    try:
        text = read_source(source)
    except UrdfkinError:
        return Subject(source, Origin(source, mimic, root_joint))  # the chunk reports what is wrong
    # It tells one state of a file from another, so that no worker goes on with what it read before.
    stamp = hashlib.sha256(text.data).hexdigest()
    return Subject(source, Origin(text.source, mimic, root_joint), stamp)


class _Run:
    """The state of a run: which chunks there are and what has come back."""

    def __init__(
        self, subjects: Sequence[Subject], samples: int, seed: int, progress: Progress | None
    ) -> None:
        self._subjects, self._samples, self._progress = subjects, samples, progress
        self._work = [
            (i, chunk) for i, subject in enumerate(subjects) for chunk in chunks(subject, samples, seed)
        ]
        self._results: dict[int, list[ChunkResult]] = {}
        self._failures: dict[int, UrdfkinError] = {}
        self._done = 0
        self.interrupted = False

    def here(self) -> None:
        """One chunk after another, in this process."""
        for i, chunk in self._work:
            if i not in self._failures:
                try:
                    self._enter(i, run_chunk(chunk))
                except UrdfkinError as error:
                    self._failures[i] = error
            self._tell(i)

    def spread(self, executor: Executor) -> None:
        """All chunks at once to an executor; results are taken in order, so that sums are the same."""
        futures: list[tuple[int, Chunk, Future[ChunkResult]]] = [
            (i, chunk, executor.submit(run_chunk, chunk)) for i, chunk in self._work
        ]
        try:
            for i, _, future in futures:
                try:
                    self._enter(i, future.result())
                except UrdfkinError as error:
                    self._failures[i] = error
                except BrokenExecutor as error:
                    self._failures[i] = OracleError(
                        "the process that was to check it ended", found=str(error)
                    )
                self._tell(i)
        except BaseException:
            for _, _, future in futures:
                future.cancel()
            raise

    def isolated(self, jobs: int) -> None:
        """One child process a robot, `jobs` of them at a time; a death is that robot's result."""
        waiting = deque(range(len(self._subjects)))
        lock = threading.Lock()

        def work() -> None:
            while True:
                with lock:
                    if not waiting:
                        return
                    i = waiting.popleft()
                mine = [chunk for j, chunk in self._work if j == i]
                try:
                    for result in run_isolated(mine):
                        with lock:
                            self._enter(i, result)
                            self._tell(i)
                except UrdfkinError as error:
                    with lock:
                        self._failures[i] = error

        threads = [threading.Thread(target=work) for _ in range(jobs)]
        for thread in threads:
            thread.start()
        try:
            for thread in threads:
                thread.join()
        except BaseException:
            waiting.clear()
            raise

    def _enter(self, i: int, result: ChunkResult) -> None:
        self._results.setdefault(i, []).append(result)

    def _tell(self, i: int) -> None:
        self._done += 1
        if self._progress is not None:
            self._progress(self._done, len(self._work), self._subjects[i].label)

    def reports(self) -> Iterable[RobotReport]:
        """A report for each robot of which something is known."""
        for i, subject in enumerate(self._subjects):
            if i in self._failures:
                yield _refused(subject, self._failures[i])
            elif i in self._results:
                yield _report(subject, self._results[i], self._samples)


def _refused(subject: Subject, error: UrdfkinError) -> RobotReport:
    verdict = Verdict.NOT_VERIFIED if isinstance(error, OracleError | DiedError) else Verdict.BAD_INPUT
    portrait = _portrait(subject, error)
    name = portrait.model["name"] if portrait.model else subject.label
    return RobotReport(subject.origin, name, verdict, str(error), (), (), {}, 0, 0.0, portrait)


def _portrait(subject: Subject, error: UrdfkinError) -> Portrait:
    """What can be told of a robot that was not checked: its parts if it can be read, else the findings."""
    if isinstance(error, UrdfError):
        return Portrait(findings=as_data(error.findings))
    try:
        return Portrait.of(subject.read(), None)
    except UrdfkinError:
        return NO_PORTRAIT


def _report(subject: Subject, results: Sequence[ChunkResult], samples: int) -> RobotReport:
    tallies: dict[Key, Tally] = {}
    for result in results:
        for key, tally in result.tallies.items():
            tallies[key] = tallies[key] + tally if key in tallies else tally
    portrait = next((result.portrait for result in results if result.portrait), NO_PORTRAIT)
    failed = any(tally.failed for tally in tallies.values()) or not portrait.chains_agree
    first = results[0]
    return RobotReport(
        origin=subject.origin,
        name=first.name,
        verdict=Verdict.DISAGREES if failed else Verdict.VERIFIED,
        reason=None,
        joints=first.joints,
        frames=first.frames,
        tallies=tallies,
        samples=samples + SPECIAL,
        seconds=sum(result.seconds for result in results),
        portrait=portrait,
        clock=total(result.clock for result in results),
    )
