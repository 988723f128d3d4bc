"""Validate robots: compare urdfkin's results with Pinocchio's results, and return a report.

The function `validate` splits the work into chunks. An engine runs the chunks.
"""

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
from types import MappingProxyType
from typing import TYPE_CHECKING, Literal

from numpy.typing import ArrayLike

from urdfkin.compiled.preload import all_kernels_on_disk
from urdfkin.errors import InputError, UrdfkinError
from urdfkin.errors.validators import as_bool, as_int, as_path, as_str, safe_repr
from urdfkin.validation import memory
from urdfkin.validation.answer import Answer, Failure, make_failure, make_unexpected_failure
from urdfkin.validation.chunk import Chunking
from urdfkin.validation.collector import Progress, ResultCollector
from urdfkin.validation.document import ValidationVerdict
from urdfkin.validation.engines import Engine, ExecutorEngine, SerialEngine, Task
from urdfkin.validation.results import RobotReport, ValidationReport
from urdfkin.validation.robot_input import RobotInput, make_robot_inputs
from urdfkin.validation.store import AccuracyStore, FailedStudy, Manifest, Store, open_store
from urdfkin.validation.worker_processes import ProcessEngine
from urdfkin.verify.comparison import load_kernels
from urdfkin.verify.oracles import PINOCCHIO, OracleName, oracle_library
from urdfkin.verify.pinocchio import pinocchio

if TYPE_CHECKING:
    from urdfkin.validation.accuracy import AccuracyStudy
    from urdfkin.validation.robot_input import RobotSource


class StoreWarning(UserWarning):
    """A file of a store is damaged or has an unknown name.

    `validate` computes the lost results again.
    """


def validate(
    robots: RobotSource | Sequence[RobotSource],
    *,
    samples: int = 1000,
    seed: int = 0,
    jobs: int = 1,
    mimic: bool | None = None,
    root_joint: str | None = None,
    xacro_args: Mapping[str, object] | None = None,
    lock: str | Mapping[str, ArrayLike] = MappingProxyType({}),
    joints: Sequence[str] | None = None,
    oracle: OracleName = "pinocchio",
    isolate: bool = False,
    executor: Executor | Engine | None = None,
    store: str | os.PathLike[str] | None = None,
    retry: Literal["failed"] | None = None,
    shard: str | None = None,
    progress: Progress | None = None,
) -> ValidationReport:
    """Compare every frame and joint with Pinocchio in all three reference frames.

    `urdfkin.verify.quantities.format_validated_titles()` lists the quantities that are compared, and
    `format_unvalidated_titles()` lists all other quantities.

    Args:
        robots: One robot or several: anything that `load` accepts, or loaded robots.
        samples: Number of random configurations within the limits for each robot. `validate` also compares
            the results for the neutral configuration, the lower limits and the upper limits. Four of
            25 samples have joint velocities and joint accelerations a hundred times larger.
        seed: Seed of the samples. The same seed gives the same numbers for every `jobs` and `executor`.
        jobs: Number of local processes; 1: this process. If one of several processes crashes, its robot is
            tried once more, alone in a process. Other robots are not affected.
        mimic: As in `load`. A loaded robot with another value is reported with an error.
        root_joint: As in `load`. A loaded robot with another value is reported with an error.
        xacro_args: Arguments for the .xacro files among the robots, as in `load`.
        lock: The joints to lock, each with a value in rad or m, as in `load`. The joints are locked in every
            robot.
        joints: The joints that remain movable in each robot, as in `load`.
        oracle: "mujoco": also compare every frame with MuJoCo, which needs the extra `mujoco`. If only two of
            the three libraries agree, the report names the third library.
        isolate: Run each robot in its own process, `jobs` processes at a time. If a process crashes, its
            robot is not verified, and the report states the reason. Other robots are not affected.
        executor: An executor that runs the chunks, instead of `jobs` local processes. The executor has the
            interface of `concurrent.futures`, or is a cluster (`urdfkin.validation.cluster.connect_cluster`).
        store: Folder in which each finished chunk is saved. After any interruption, the same call resumes the
            run. The function `read_stored_report` makes a report from the folder at any time.
        retry: "failed": try again to check the robots that an earlier run could not check. The
            files of these robots, such as URDF files, may have changed since the earlier run.
        shard: "2/4": run only the second of four equal parts of the work. A store is required, and the report
            covers only this part of the work.
        progress: Callback, called before the work and after each chunk.

    Returns:
        The report on all robots. With `shard`, the report contains only robots with chunks in the shard. A
        robot that cannot be read or checked is reported with its error. After an interrupt, the report
        contains the finished results.

    Raises:
        InputError: An argument is invalid, for example `samples` < 0, `jobs` < 1, or `shard` without `store`.
            The oracle is not installed. The store contains a validation with other robots, settings or
            versions. Another process uses the store.
        UnknownNameError: There is no oracle with this name.
        InstallationError: Pinocchio is missing or unsupported, or the installed module `pinocchio` belongs to
            another project.
        SourceError: The folder of the store cannot be created or used.

    >>> report = validate("ur5", samples=10)
    >>> report.passed, report.robots[0].failed
    (True, 0)
    """
    samples, seed = as_int(samples, "samples", 0, _MAX_SAMPLES), as_int(seed, "seed", 0)
    jobs, isolate = as_int(jobs, "jobs", 1), as_bool(isolate, "isolate")
    shard = None if shard is None else as_str(shard, "shard")
    if retry is not None and as_str(retry, "retry") != "failed":
        raise InputError(
            "unknown value of `retry`", found=f"retry={retry!r}", remedy='give retry="failed" or None'
        )
    _check_objects(xacro_args, executor, progress)
    folder = None if store is None else as_path(store, "store")
    if (retry or shard is not None) and store is None:
        raise InputError("`retry` and `shard` need `store`", remedy="give store=FOLDER")
    sources = robots if isinstance(robots, Sequence) and not isinstance(robots, str | bytes) else [robots]
    started = datetime.datetime.now(datetime.UTC)
    pinocchio()  # If Pinocchio is missing, this call raises an error before the work starts.
    robot_inputs, read_errors = make_robot_inputs(sources, mimic, root_joint, xacro_args, lock, joints)
    if oracle_library(oracle) is not PINOCCHIO:
        robot_inputs = [replace(x, origin=replace(x.origin, oracle=oracle)) for x in robot_inputs]
    chunking = Chunking(samples)
    chunks = chunks_of_shard(len(robot_inputs), chunking, shard)
    collector = ResultCollector(robot_inputs, chunking, chunks, progress)
    # The machines of an executor compute their own memory limits.
    memory_limit = memory.limit(jobs) if executor is None else None
    campaign = _Campaign(robot_inputs, chunking, seed, memory_limit, collector)
    interrupted, begin = False, time.perf_counter()
    with contextlib.ExitStack() as stack:
        stored_answers = None
        if folder is not None:
            manifest = Manifest.of(robot_inputs, samples, seed, started.isoformat(timespec="seconds"))
            context = open_store(
                folder, manifest, _warn, shard=shard, retry=None if retry is None else chunks
            )
            stored_answers = stack.enter_context(context)
        try:
            if stored_answers is not None:
                campaign.load_answers(stored_answers)
            for i, error in read_errors.items():
                # After the first failure of a robot, `missing_chunks` yields no further chunk of the robot.
                for index in collector.missing_chunks(i):
                    campaign.save(campaign.make_task(i, index), make_failure(robot_inputs[i], error))
            unfinished_inputs = [
                robot
                for i, robot in enumerate(robot_inputs)
                if any(True for _ in collector.missing_chunks(i))
            ]
            if _should_load_kernels(len(unfinished_inputs) * samples) and (
                isolate or any(map(_can_be_loaded, unfinished_inputs))
            ):
                # Load the kernels now, so that no robot's computing time contains a compilation.
                load_kernels()
                begin = time.perf_counter()
            collector.begin()
            _choose_engine(jobs, isolate, executor).run(campaign.make_work(), campaign.save)
        except KeyboardInterrupt:
            interrupted = True
        except UrdfkinError as error:
            collector.fail_unfinished(Failure(ValidationVerdict.NOT_VERIFIED, str(error)))
        except Exception as error:  # Finished results stay in the report.
            collector.fail_unfinished(make_unexpected_failure(error))
    reports = tuple(collector.make_reports())
    return ValidationReport(
        robots=reports,
        robots_requested=len(reports),
        samples=samples,
        seed=seed,
        started=started.isoformat(timespec="seconds"),
        seconds=time.perf_counter() - begin,
        interrupted=interrupted,
    )


def _check_objects(xacro_args: object, executor: object, progress: object) -> None:
    if not isinstance(xacro_args, Mapping | None):
        raise InputError("`xacro_args` must be a mapping from names to values", found=safe_repr(xacro_args))
    if not (executor is None or isinstance(executor, Executor) or hasattr(executor, "run")):
        raise InputError(
            "`executor` must be an executor, as in `concurrent.futures`", found=safe_repr(executor)
        )
    if not (progress is None or callable(progress)):
        raise InputError("`progress` must be a function", found=safe_repr(progress))


def _can_be_loaded(robot_input: RobotInput) -> bool:
    # If loading fails, the robot's first chunk reports the error.
    try:
        robot_input.load()
    except Exception:
        return False
    return True


def read_stored_report(folder: str | os.PathLike[str]) -> ValidationReport:
    """Return a store's report; an incomplete run is marked as interrupted.

    Raises:
        SourceError: The folder has no manifest, or the manifest cannot be read.
        InputError: The manifest is not valid, or has another version.
    """
    store = Store.open_read_only(as_path(folder, "folder"), _warn)
    store.check_names()
    manifest, robot_inputs = store.manifest, store.manifest.make_robot_inputs()
    collector = ResultCollector(
        robot_inputs, manifest.chunking, chunks_of_shard(len(robot_inputs), manifest.chunking)
    )
    _Campaign(robot_inputs, manifest.chunking, manifest.seed, None, collector).load_answers(store)
    reports, progress = tuple(collector.make_reports()), collector.make_progress()
    studies, all_studied = _read_studies(store, reports)
    return ValidationReport(
        robots=reports,
        robots_requested=len(reports),
        samples=manifest.samples,
        seed=manifest.seed,
        started=manifest.started,
        seconds=sum(robot.seconds for robot in reports),
        interrupted=progress.chunks_done < progress.chunks or not all_studied,
        library_versions=manifest.versions,
        studies=studies,
    )


def _read_studies(
    store: Store, reports: Sequence[RobotReport]
) -> tuple[tuple[AccuracyStudy | None, ...], bool]:
    if (results := AccuracyStore.from_store(store)) is None:
        return (), True
    studies = [results.read(i) for i, report in enumerate(reports) if report.error_stats]
    return tuple(None if isinstance(study, FailedStudy) else study for study in studies), None not in studies


#: Maximum number of samples. The number of chunks of all robots must fit in an index of Python.
_MAX_SAMPLES = 10**15
#: Numbers of samples of a validation. Above the first number, loading kernels from disk saves time. Above the
#: second number, compiling missing kernels saves time too.
_WORTH_LOADING, _WORTH_COMPILING = 30, 300


def _should_load_kernels(samples: int) -> bool:
    return samples > _WORTH_COMPILING or (samples > _WORTH_LOADING and all_kernels_on_disk())


@dataclass
class _Campaign:
    robot_inputs: Sequence[RobotInput]
    chunking: Chunking
    seed: int
    memory_limit: int | None
    collector: ResultCollector
    store: Store | None = None

    def make_task(self, robot: int, index: int) -> Task:
        return Task(
            robot, self.chunking.make_chunk(self.robot_inputs[robot], self.seed, index, self.memory_limit)
        )

    def load_answers(self, store: Store) -> None:
        for robot in range(len(self.robot_inputs)):
            for index in self.collector.missing_chunks(robot):
                if (answer := store.read_answer(robot, index)) is not None:
                    self.collector.add(self.make_task(robot, index), answer, from_earlier_run=True)
        self.store = store

    def make_work(self) -> Iterator[Iterator[Task]]:
        return (self._make_tasks(robot) for robot in range(len(self.robot_inputs)))

    def _make_tasks(self, robot: int) -> Iterator[Task]:
        return (self.make_task(robot, index) for index in self.collector.missing_chunks(robot))

    def save(self, task: Task, answer: Answer) -> None:
        if self.store is not None and not (isinstance(answer, Failure) and answer.is_transient):
            self.store.write_answer(task.robot, task.chunk.index, answer)
        self.collector.add(task, answer)


def chunks_of_shard(robots: int, chunking: Chunking, shard: str | None = None) -> list[range]:
    """Return the chunks of each robot in a shard such as "2/4", or all chunks without a shard.

    Shards are contiguous, so that most robots are read by one shard only. The numbers of chunks of two shards
    differ by at most one.

    >>> chunks_of_shard(2, Chunking(1000), "1/4"), chunks_of_shard(2, Chunking(1000), "4/4")
    ([range(0, 4), range(0, 0)], [range(0, 0), range(4, 8)])
    """
    match = re.fullmatch(r"(\d{1,9})/(\d{1,9})", "1/1" if shard is None else shard)
    if match is None or not 1 <= int(match[1]) <= int(match[2]):
        raise InputError(
            "`shard` must have the form i/n",
            found=repr(shard),
            remedy="for a validation in four parts write 1/4, ..., 4/4",
        )
    part, parts = int(match[1]), int(match[2])
    size = len(chunking)
    start, stop = (part - 1) * robots * size // parts, part * robots * size // parts
    shards = []
    for robot in range(robots):
        low, high = (min(max(end - robot * size, 0), size) for end in (start, stop))
        shards.append(range(low, high) if low < high else range(0))
    return shards


def _warn(message: str) -> None:
    warnings.warn(message, StoreWarning, stacklevel=2)


def _choose_engine(jobs: int, isolate: bool, executor: Executor | Engine | None) -> Engine:
    if executor is not None:
        return ExecutorEngine(executor) if isinstance(executor, Executor) else executor
    return ProcessEngine(jobs, isolate=isolate) if isolate or jobs > 1 else SerialEngine()
