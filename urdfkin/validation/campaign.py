"""`validate`: cut the work into chunks, have an engine run them, and make the report of what comes back."""

from __future__ import annotations

import datetime
import hashlib
import os
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path

from urdfkin.compiled.ahead import load_kernels
from urdfkin.dh.table import DHTable
from urdfkin.errors import UrdfkinError
from urdfkin.errors.demands import switch, whole_number
from urdfkin.loading import load
from urdfkin.robot import Robot
from urdfkin.urdf.origin import Origin
from urdfkin.urdf.sources import Source, as_word, is_xacro, read_source
from urdfkin.validation import memory
from urdfkin.validation.answer import Failure, failure, traced, unforeseen
from urdfkin.validation.chunk import Subject, chunks
from urdfkin.validation.engine import Engine, Here, OnExecutor, Task
from urdfkin.validation.gathering import Gathering, Progress
from urdfkin.validation.outcome import Verdict
from urdfkin.validation.results import ValidationReport
from urdfkin.validation.workers import Processes
from urdfkin.verify.pinocchio_module import pinocchio
from urdfkin.verify.witnesses import PINOCCHIO, WitnessName, witness_of
from urdfkin.verify.worst import load_kernel


def validate(
    robots: Source | DHTable | Robot | Sequence[Source | DHTable | Robot],
    *,
    samples: int = 1000,
    seed: int = 0,
    jobs: int = 1,
    mimic: bool | None = None,
    root_joint: str | None = None,
    xacro_args: Mapping[str, object] | None = None,
    oracle: WitnessName = "pinocchio",
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
        jobs: Local processes. One that dies costs the robot in its hands a second try, alone; no other robot.
        mimic: As in `load`.
        root_joint: As in `load`.
        xacro_args: As in `load`, for each .xacro file among the robots.
        oracle: "mujoco": MuJoCo is asked about every frame besides Pinocchio, and the report says who stands
            alone where two of the three agree (needs the extra `mujoco`).
        isolate: Each robot is checked in a process of its own, `jobs` at a time; when one dies, that robot is
            reported as not verified with the reason, and the others go on.
        executor: Runs the chunks instead of local processes.
        progress: Told after each chunk.

    Returns:
        The report, on every robot that was asked for. One that cannot be read or checked is reported,
        whatever it raises; an interrupt ends the run and keeps what had finished.

    Raises:
        InputError: a negative number of samples, a negative seed or no job; an oracle that is not installed.
        InstallationError: Pinocchio is missing, or another project goes by its name.

    >>> report = validate("ur5", samples=10)
    >>> report.passed, report.robots[0].failed
    (True, 0)
    """
    samples, seed = whole_number(samples, "samples", 0), whole_number(seed, "seed", 0)
    jobs, isolate = whole_number(jobs, "jobs", 1), switch(isolate, "isolate")
    many = robots if isinstance(robots, Sequence) and not isinstance(robots, str | bytes) else [robots]
    started = datetime.datetime.now(datetime.UTC)
    pinocchio()  # before the work, not robot by robot
    subjects, unread = _subjects(many, mimic, root_joint, xacro_args)
    if witness_of(oracle) is not PINOCCHIO:
        subjects = [replace(one, origin=replace(one.origin, oracle=oracle)) for one in subjects]
    most = memory.share(jobs) if executor is None else None  # an executor's machines know their own
    tasks = [
        Task(i, chunk) for i, subject in enumerate(subjects) for chunk in chunks(subject, samples, seed, most)
    ]
    gathering, interrupted, begin = Gathering(subjects, tasks, progress), False, time.perf_counter()
    for task in tasks:
        if task.robot in unread and task.chunk.index == 0:
            gathering.enter(task, unread[task.robot])
    try:
        if isolate or any(_is_robot(subject) for i, subject in enumerate(subjects) if i not in unread):
            load_kernels()  # once, here, so that no worker has to compile, nor any robot's seconds hold it
            load_kernel()
            begin = time.perf_counter()
        engine = _engine(jobs, isolate, executor)
        engine.run([task for task in tasks if task.robot not in unread], gathering.enter)
    except KeyboardInterrupt:
        interrupted = True
    except Exception as error:  # what is there already stays
        gathering.give_up(Failure(Verdict.NOT_VERIFIED, unforeseen(error), error=traced(error)))
    return ValidationReport(
        robots=tuple(gathering.reports()),
        asked=len(many),
        samples=samples,
        seed=seed,
        started=started.isoformat(timespec="seconds"),
        seconds=time.perf_counter() - begin,
        interrupted=interrupted,
    )


def _is_robot(subject: Subject) -> bool:
    """Whether there is something to compute with; what is wrong with it, its chunk reports."""
    try:
        subject.load()
    except Exception:
        return False
    return True


def _engine(jobs: int, isolate: bool, executor: Executor | None) -> Engine:
    if executor is not None:
        return OnExecutor(executor)
    return Processes(jobs, isolate=isolate) if isolate or jobs > 1 else Here()


def _subjects(
    robots: Sequence[Source | DHTable | Robot],
    mimic: bool | None,
    root_joint: str | None,
    xacro_args: Mapping[str, object] | None,
) -> tuple[list[Subject], dict[int, Failure]]:
    """The robots as plain data, and those whose text cannot be had: by their place, and why."""
    subjects, failures = list[Subject](), dict[int, Failure]()
    for i, robot in enumerate(robots):
        try:
            subjects.append(_subject(robot, mimic, root_joint, xacro_args))
        except Exception as error:
            subjects.append(Subject(b"", Origin(_called(robot), mimic, root_joint)))
            failures[i] = failure(subjects[i], error)
    return subjects, failures


def _called(robot: Source | DHTable | Robot) -> str:
    """What to call a robot whose text cannot be had."""
    if isinstance(robot, str | os.PathLike):
        return str(robot) if isinstance(robot, str) else as_word(Path(robot))
    return f"<{type(robot).__name__}>"


def _subject(
    robot: Source | DHTable | Robot,
    mimic: bool | None,
    root_joint: str | None,
    xacro_args: Mapping[str, object] | None = None,
) -> Subject:
    if isinstance(robot, DHTable):
        robot = load(robot, mimic=mimic, root_joint=root_joint)
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
