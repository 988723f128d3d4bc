"""`validate`: cut the work into chunks, have an engine run them, and make the report of what comes back."""

from __future__ import annotations

import contextlib
import datetime
import os
import re
import time
import warnings
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from urdfkin.errors import InputError, UrdfkinError
from urdfkin.errors.validators import as_bool, as_str, safe_repr, whole_number
from urdfkin.validation import memory
from urdfkin.validation.answer import Answer, Failure, failure, traced, unforeseen
from urdfkin.validation.chunk import Cut
from urdfkin.validation.collector import Progress, ResultCollector
from urdfkin.validation.engines import Engine, ExecutorEngine, SerialEngine, Task
from urdfkin.validation.manifest import Manifest
from urdfkin.validation.outcome import Verdict
from urdfkin.validation.results import RobotReport, ValidationReport
from urdfkin.validation.robot_input import Given, RobotInput, subjects
from urdfkin.validation.store import Store, opened
from urdfkin.validation.worker_processes import ProcessEngine
from urdfkin.verify.ahead import load_kernels
from urdfkin.verify.oracles import PINOCCHIO, WitnessName, witness_of
from urdfkin.verify.pinocchio_module import pinocchio

if TYPE_CHECKING:
    from urdfkin.validation.accuracy import Judgement


class StoreWarning(UserWarning):
    """A file of a store that cannot be trusted, and is computed again."""


def validate(
    robots: Given | Sequence[Given],
    *,
    samples: int = 1000,
    seed: int = 0,
    jobs: int = 1,
    mimic: bool | None = None,
    root_joint: str | None = None,
    xacro_args: Mapping[str, object] | None = None,
    oracle: WitnessName = "pinocchio",
    isolate: bool = False,
    executor: Executor | Engine | None = None,
    store: str | os.PathLike[str] | None = None,
    retry: Literal["failed"] | None = None,
    shard: str | None = None,
    progress: Progress | None = None,
) -> ValidationReport:
    """Hold every frame and joint against Pinocchio's, in all three references.

    The quantities are `urdfkin.verify.quantities.compared()`; `not_compared()` names the others.

    Args:
        robots: One robot or several: anything `load` takes, or robots that were loaded.
        samples: Random configurations within limits for each robot; the neutral one and the two ends of
            the limits are added. Every eighth sample has rates a hundred times larger.
        seed: The same seed gives the same numbers, whatever `jobs` and `executor` are.
        jobs: Local processes. One that dies costs the robot in its hands a second try, alone; no other robot.
        mimic: As in `load`.
        root_joint: As in `load`.
        xacro_args: As in `load`, for each .xacro file among the robots.
        oracle: "mujoco": MuJoCo is asked about every frame besides Pinocchio, and the report says who stands
            alone where two of the three agree (needs the extra `mujoco`).
        isolate: Each robot is checked in a process of its own, `jobs` at a time; when one dies, that robot is
            reported as not verified with the reason, and the others go on.
        executor: Runs the chunks instead of local processes: anything like those of `concurrent.futures`, or
            a cluster (`urdfkin.validation.cluster.connected`).
        store: A folder that keeps each chunk as soon as it is there: the same call goes on where one was
            ended, however it was. `stored` makes a report of it at any time.
        retry: "failed": what the store has of robots that could not be checked is computed again; their
            texts may have changed.
        shard: "2/4": only the second of four equal parts, into a store; the report tells of that part alone.
        progress: Told before the work and after each chunk.

    Returns:
        The report, on every robot that was asked for. One that cannot be read or checked is reported,
        whatever it raises; an interrupt ends the run and keeps what had finished.

    Raises:
        InputError: a negative number of samples, a negative seed or no job; an oracle that is not installed;
            a store of another campaign, or one that somebody else is at work on.
        InstallationError: Pinocchio is missing, or another project goes by its name.
        SourceError: the store cannot be made.

    >>> report = validate("ur5", samples=10)
    >>> report.passed, report.robots[0].failed
    (True, 0)
    """
    samples, seed = whole_number(samples, "samples", 0), whole_number(seed, "seed", 0)
    jobs, isolate = whole_number(jobs, "jobs", 1), as_bool(isolate, "isolate")
    shard = None if shard is None else as_str(shard, "shard")
    if retry is not None and as_str(retry, "retry") != "failed":
        raise InputError(
            "what failed can be computed again", found=f"retry={retry!r}", remedy='retry="failed"'
        )
    folder = None if store is None else _folder(store)
    if (retry or shard is not None) and store is None:
        raise InputError("only a store has something to retry or a shard", remedy="give store=, a folder")
    many = robots if isinstance(robots, Sequence) and not isinstance(robots, str | bytes) else [robots]
    started = datetime.datetime.now(datetime.UTC)
    pinocchio()  # before the work, not robot by robot
    found, unread = subjects(many, mimic, root_joint, xacro_args)
    if witness_of(oracle) is not PINOCCHIO:
        found = [replace(one, origin=replace(one.origin, oracle=oracle)) for one in found]
    cut = Cut(samples)
    gathering = ResultCollector(found, cut, shares(len(found), cut, shard), progress)
    most = memory.share(jobs) if executor is None else None  # an executor's machines know their own
    campaign = _Campaign(found, cut, seed, most, gathering)
    interrupted, kept, begin = False, None, time.perf_counter()
    with contextlib.ExitStack() as stack:
        if folder is not None:
            manifest = Manifest.of(found, samples, seed, started.isoformat(timespec="seconds"))
            there = opened(folder, manifest, _warn, shard=shard, retry_failed=retry == "failed")
            kept = stack.enter_context(there)
        try:
            if kept is not None:
                campaign.use(kept)
            for i, error in unread.items():
                for index in gathering.missing(i):  # the first, for then it has failed
                    campaign.enter(campaign.task(i, index), failure(found[i], error))
            missing = [robot for i, robot in enumerate(found) if any(True for _ in gathering.missing(i))]
            if missing and (isolate or any(map(_is_robot, missing))):
                load_kernels()  # once, here: no worker has to compile, no robot's seconds hold it
                begin = time.perf_counter()
            gathering.begin()
            _engine(jobs, isolate, executor).run(campaign.work(), campaign.enter)
        except KeyboardInterrupt:
            interrupted = True
        except UrdfkinError as error:
            gathering.give_up(Failure(Verdict.NOT_VERIFIED, str(error)))
        except Exception as error:  # what is there already stays
            gathering.give_up(Failure(Verdict.NOT_VERIFIED, unforeseen(error), error=traced(error)))
    reports = tuple(gathering.reports())
    return ValidationReport(
        robots=reports,
        asked=len(reports),
        samples=samples,
        seed=seed,
        started=started.isoformat(timespec="seconds"),
        seconds=time.perf_counter() - begin,
        interrupted=interrupted,
    )


def _folder(store: str | os.PathLike[str]) -> Path:
    """A store's path, of letters that a file system has."""
    try:
        name = os.fsencode(store)
    except (TypeError, ValueError):
        name = b""
    if not name or b"\0" in name:
        raise InputError("a store is a folder's path", found=safe_repr(store))
    return Path(os.fsdecode(name))


def _is_robot(subject: RobotInput) -> bool:
    """Whether there is something to compute with; what is wrong with it, its chunk reports."""
    try:
        subject.load()
    except Exception:
        return False
    return True


def stored(folder: str | os.PathLike[str]) -> ValidationReport:
    """The report of what a store holds, as one run would have made it; interrupted until it is complete.

    Args:
        folder: The store.

    Raises:
        SourceError, InputError: it is none.
    """
    store = Store.reading(Path(folder), _warn)
    store.check_names()
    manifest, found = store.manifest, store.manifest.subjects()
    gathering = ResultCollector(found, manifest.cut, shares(len(found), manifest.cut))
    _Campaign(found, manifest.cut, manifest.seed, None, gathering).use(store)
    reports, standing = tuple(gathering.reports()), gathering.standing()
    judgements, all_judged = _judgements(store, reports)
    return ValidationReport(
        robots=reports,
        asked=len(reports),
        samples=manifest.samples,
        seed=manifest.seed,
        started=manifest.started,
        seconds=sum(robot.seconds for robot in reports),
        interrupted=standing.chunks_done < standing.chunks or not all_judged,
        made_by=manifest.versions,
        judgements=judgements,
    )


def _judgements(store: Store, reports: Sequence[RobotReport]) -> tuple[tuple[Judgement | None, ...], bool]:
    """What the judge said of each robot that was compared, if it was asked; and whether it is through."""
    if not store.has_judge:
        return (), True
    from urdfkin.validation.accuracy_store import AccuracyResult, NotJudged  # noqa: PLC0415  fifty digits take a library

    if (judged := AccuracyResult.of(store)) is None:
        return (), True
    found = [judged.found(i) for i, report in enumerate(reports) if report.tallies]
    return tuple(None if isinstance(one, NotJudged) else one for one in found), None not in found


@dataclass
class _Campaign:
    """The chunks of some robots, what is known of them and what is still to be done."""

    subjects: Sequence[RobotInput]
    cut: Cut
    seed: int
    memory: int | None
    gathering: ResultCollector
    store: Store | None = None

    def task(self, robot: int, index: int) -> Task:
        return Task(robot, self.cut.chunk(self.subjects[robot], self.seed, index, self.memory))

    def use(self, store: Store) -> None:
        """Begin with what a store has, and keep there what comes."""
        for robot in range(len(self.subjects)):
            for index in self.gathering.missing(robot):
                if (found := store.answer(robot, index)) is not None:
                    self.gathering.enter(self.task(robot, index), found, kept=True)
        self.store = store

    def work(self) -> Iterator[Iterator[Task]]:
        """What is missing, robot by robot, made when it is asked for."""
        return (self._tasks(robot) for robot in range(len(self.subjects)))

    def _tasks(self, robot: int) -> Iterator[Task]:
        return (self.task(robot, index) for index in self.gathering.missing(robot))

    def enter(self, task: Task, found: Answer) -> None:
        """Take an answer: what is counted was kept before."""
        if self.store is not None and not (isinstance(found, Failure) and found.passing):
            self.store.keep(task.robot, task.chunk.index, found)
        self.gathering.enter(task, found)


def shares(robots: int, cut: Cut, shard: str | None = None) -> list[range]:
    """Which chunks of each robot belong to a part of the work; without one, all.

    Parts are equal and without gaps in the order of robots and chunks, so that most robots are read once.

    Raises:
        InputError: not a part.

    >>> shares(2, Cut(1000), "1/4"), shares(2, Cut(1000), "4/4")
    ([range(0, 4), range(0, 0)], [range(0, 0), range(4, 8)])
    """
    part, parts = _shard(shard) if shard is not None else (1, 1)
    size = len(cut)
    start, stop = ((part - 1) * robots * size // parts, part * robots * size // parts)
    found = []
    for robot in range(robots):
        low, high = (min(max(end - robot * size, 0), size) for end in (start, stop))
        found.append(range(low, high) if low < high else range(0))
    return found


def _shard(word: str) -> tuple[int, int]:
    match = re.fullmatch(r"(\d{1,9})/(\d{1,9})", word)
    if match is None or not 1 <= int(match[1]) <= int(match[2]):
        raise InputError("a shard is i/n, the i-th of n parts", found=repr(word), remedy="1/4, ..., 4/4")
    return int(match[1]), int(match[2])


def _warn(message: str) -> None:
    warnings.warn(message, StoreWarning, stacklevel=2)


def _engine(jobs: int, isolate: bool, executor: Executor | Engine | None) -> Engine:
    if executor is not None:
        return ExecutorEngine(executor) if isinstance(executor, Executor) else executor
    return ProcessEngine(jobs, isolate=isolate) if isolate or jobs > 1 else SerialEngine()
