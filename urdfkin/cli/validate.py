"""`urdfkin validate`: compare every frame and joint with Pinocchio on many samples; study the accuracy."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from urdfkin.cli.campaign import progress, warn
from urdfkin.cli.exit import handle_signals
from urdfkin.cli.options import (
    FILE_OR_FOLDER,
    WholeNumber,
    load_options,
    load_robot,
    oracle_option,
    reject_unused_options,
    robot_options,
    samples_option,
    seed_option,
)
from urdfkin.cli.output import check_writable, make_console, report_compilation
from urdfkin.cli.reports import REPORT_FILE_OPTIONS, report_options, say_written, write_reports
from urdfkin.cli.shell import complete_robot
from urdfkin.cli.streams import join_lines, say
from urdfkin.errors import InputError, UrdfkinError
from urdfkin.errors.display import format_count
from urdfkin.system.files import is_folder
from urdfkin.system.lazy_import import install_command
from urdfkin.urdf.catalogue import catalogue, example_robot_data_names
from urdfkin.verify.quantities import format_unvalidated_titles, format_validated_titles

if TYPE_CHECKING:
    from urdfkin.robot import Robot
    from urdfkin.validation.accuracy import AccuracyStudy
    from urdfkin.validation.engines import Engine
    from urdfkin.validation.results import ValidationReport
    from urdfkin.validation.store import AccuracyStore, FailedStudy, StudySettings


def study_all(
    report: ValidationReport,
    given: Sequence[Robot | str],
    settings: StudySettings,
    *,
    store: Path | None = None,
    shard: str | None = None,
    retry: bool = False,
    how: Mapping[str, Any],
    raise_if_signal: Callable[[], None] = lambda: None,
) -> ValidationReport:
    """Run the accuracy study of each compared robot, and return the report with the results of the study.

    `how` are arguments of `load`. With `shard`, for example "1/4", only the robots with their first sample in
    this part of the validation are studied. An interrupt skips the remaining robots.
    """
    from urdfkin.validation.campaign import chunks_of_shard
    from urdfkin.validation.chunk import Chunking
    from urdfkin.validation.store import FailedStudy

    parts = chunks_of_shard(len(given), Chunking(report.samples), shard)
    here = [i for i, part in enumerate(parts) if part]
    studies: list[AccuracyStudy | None] = []
    try:
        with _open_results(store, settings, shard) as results:
            for i, robot in zip(here, report.robots, strict=True):
                raise_if_signal()
                if not robot.error_stats or parts[i].start > 0:
                    continue
                found = None if results is None else results.read(i)
                if found is None or (retry and isinstance(found, FailedStudy)):
                    sha256 = None if results is None else results.robot_sha256(i)
                    found, is_lasting = _study_accuracy(given[i], settings, sha256, how)
                    if results is not None and is_lasting:
                        results.write(i, found)
                if isinstance(found, FailedStudy):
                    say(f"urdfkin: {robot.source}: no accuracy result: {join_lines(found.reason)}", err=True)
                studies.append(None if isinstance(found, FailedStudy) else found)
    except KeyboardInterrupt:
        report = replace(report, interrupted=True)
    return replace(report, studies=tuple(studies))


@contextmanager
def _open_results(
    folder: Path | None, settings: StudySettings, shard: str | None
) -> Iterator[AccuracyStore | None]:
    """Lock the store, or its part `shard`, and yield the accuracy results in the store."""
    if folder is None:
        yield None
        return
    from urdfkin.validation.store import AccuracyStore, Store, open_store

    with open_store(folder, Store.open_read_only(folder, warn).manifest, warn, shard=shard) as store:
        results = AccuracyStore(store, settings)
        results.write_settings()
        yield results


def _study_accuracy(
    source: Robot | str, settings: StudySettings, sha256: str | None, how: Mapping[str, Any]
) -> tuple[AccuracyStudy | FailedStudy, bool]:
    """Return a robot's accuracy result, and whether the result may be stored.

    A failure may be stored only if the robot file is unchanged and the exception is an `UrdfkinError`.
    """
    import numpy as np

    from urdfkin.model.configuration import draw_base_motion
    from urdfkin.validation.accuracy import accuracy_study
    from urdfkin.validation.robot_input import make_robot_input
    from urdfkin.validation.store import FailedStudy

    is_same = True
    try:
        robot = make_robot_input(source, **how)
        if is_same := sha256 in (None, robot.sha256):
            rng = np.random.default_rng([settings.seed, 1])
            base = draw_base_motion(settings.samples, rng) if settings.moving_base else None
            return accuracy_study(
                robot.make_robot(), samples=settings.samples, seed=settings.seed, base=base
            ), True
        raise InputError(
            "the robot file has changed since the validation read the file",
            remedy="start the validation again when the file no longer changes",
        )
    except Exception as error:
        return FailedStudy(f"{type(error).__name__}: {error}"), is_same and isinstance(error, UrdfkinError)


_T = TypeVar("_T", bound=click.Command)


def _list_quantities_in_help(command: _T) -> _T:
    assert command.help is not None
    command.help = command.help.format(
        compared=format_validated_titles(), not_compared=format_unvalidated_titles()
    )
    return command


@_list_quantities_in_help
@click.command(epilog="Example: urdfkin validate panda ur5 ./my.urdf --samples 1000 --seed 0")
@click.argument("robots", nargs=-1, metavar="[ROBOT]...", shell_complete=complete_robot)
@click.option(
    "--all", "all_", is_flag=True, help="Validate all robots of example-robot-data in the catalogue."
)
@samples_option(1000, "Number of random configurations of each robot.")
@seed_option
@click.option("--jobs", type=WholeNumber(1), default=1, help="Number of local processes.")
@robot_options
@oracle_option("Compare with Pinocchio only, or with Pinocchio and MuJoCo (mujoco).")
@click.option(
    "--isolate",
    is_flag=True,
    help="Run each robot in its own process; a crash is reported as that robot's result.",
)
@click.option(
    "--store",
    type=FILE_OR_FOLDER,
    metavar="DIR",
    help="Folder for the results. To resume an interrupted run, repeat the same command.",
)
@click.option("--retry", type=click.Choice(["failed"]), help="With --store: compute failed robots again.")
@click.option(
    "--shard", metavar="I/N", help="With --store: split the validation into N parts, and run only part I."
)
@click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Compute with the workers of this dask scheduler; local:N starts N workers on this machine.",
)
@click.option("--json-progress", is_flag=True, help="Print progress as lines of JSON on standard error.")
@click.option(
    "--accuracy",
    "with_study",
    is_flag=True,
    help="Also study the accuracy: compare urdfkin and Pinocchio with results computed at 50 digits.",
)
@click.option(
    "--accuracy-samples",
    type=WholeNumber(1),
    default=5,
    help="With --accuracy: number of random configurations of each robot.",
)
@click.option(
    "--accuracy-moving-base", is_flag=True, help="With --accuracy: also move the root link at random."
)
@report_options
@click.pass_context
def validate_command(
    context: click.Context,
    /,
    robots: tuple[str, ...],
    all_: bool,
    with_study: bool,
    accuracy_samples: int,
    accuracy_moving_base: bool,
    scheduler: str | None,
    json_progress: bool,
    cases: bool,
    **options: Any,
) -> None:
    """Compare every frame and joint with Pinocchio, in all three reference frames, on many samples.

    Compared: {compared}. Not compared: {not_compared}. By default, every command checks these quantities when
    it computes them.

    Configurations are random within the joint limits. The command adds the neutral configuration, and the
    configurations in which all joints are at their lower or upper limits. In 4 of 25 samples, joint
    velocities and accelerations are a hundred times larger than in the others.

    Disagreements are in multiples of eps * scale. The number eps is 2.2e-16. The number scale is the size of
    the terms that are added to compute a value. Rounding alone causes disagreements of 1 to 10.

    ROBOT is a path, a name that `urdfkin robots` lists, or a folder. In a folder, the command validates all
    .urdf files, also in subfolders, but not in hidden folders.

    With --store, the same command resumes an interrupted run, and `urdfkin report DIR` shows the report at
    any time.

    Exit 0: verified. 1: a disagreement. 2: a robot cannot be read. 3: a robot was not verified. 128 + n:
    stopped by signal n; finished results are saved.
    """
    files = {name: options.pop(name) for name in REPORT_FILE_OPTIONS}
    store, shard, retry = (options[name] for name in ("store", "shard", "retry"))
    if bool(robots) == all_:
        raise click.UsageError("give either robots, or --all (every robot of example-robot-data)")
    if robots.count("-") > 1:
        raise click.UsageError("only one of the robots can come from standard input")
    if (retry or shard) and store is None:
        raise click.UsageError("--retry and --shard need --store DIR")
    if scheduler and (options["jobs"] > 1 or options["isolate"]):
        raise click.UsageError(
            "--scheduler cannot be combined with --jobs or --isolate, which start processes on this machine"
        )
    if not with_study:
        reject_unused_options(context, ("accuracy_samples", "accuracy_moving_base"), "without --accuracy")
    if shard and any(files.values()):
        raise click.UsageError(
            "--shard cannot be combined with a report file; run `urdfkin report merge`, then `urdfkin report`"
        )
    from urdfkin.report.terminal import print_report
    from urdfkin.urdf.sources import is_usd, is_xacro
    from urdfkin.validation.campaign import validate
    from urdfkin.validation.store import StudySettings

    check_writable(*files.values())
    how = load_options()
    if how["xacro_args"] and not any(map(is_xacro, robots)):
        reject_unused_options(context, ("xacro_arg",), "without a .xacro file")
    if not any(map(is_usd, robots)):
        reject_unused_options(context, ("variant", "articulation"), "without a USD file")
    usd: dict[str, Any] = {name: how.pop(name) for name in ("variant", "articulation") if name in how}
    if not any(map(is_usd, robots)):
        reject_unused_options(context, ("variant", "articulation"), "without a USD file")
    sources = [source for robot in robots for source in _list_urdf_files(robot)] or list(
        example_robot_data_names()
    )
    given = [_load_stdin(robot, how) if with_study else robot for robot in sources]
    given = [_load_usd(robot, how, usd) if usd else robot for robot in given]
    with (
        handle_signals() as stop,
        report_compilation(),
        _cluster(scheduler) as executor,
        progress(as_json=json_progress) as tell,
    ):
        watched = stop.interrupting(tell)
        report = validate(given, executor=executor, progress=watched, **options, **how)
        if with_study and not report.interrupted:
            settings = StudySettings(accuracy_samples, options["seed"], accuracy_moving_base)
            retries = retry is not None
            report = study_all(
                report, given, settings, store=store, shard=shard, retry=retries, how=how,
                raise_if_signal=stop.raise_if_signal,
            )  # fmt: skip
    if shard:
        _say_shard(report, shard, store)
        is_empty = not report.robots and not report.interrupted
        context.exit(stop.exit_code(0 if is_empty else report.exit_code))
    document = report.as_dict()
    written = write_reports(document, files)
    print_report(document, make_console(), cases=cases)
    if not written:
        say_written(files)
    context.exit(stop.exit_code(report.exit_code) or written)


@contextmanager
def _cluster(scheduler: str | None) -> Iterator[Engine | None]:
    if scheduler is None:
        yield None
        return
    try:
        from urdfkin.validation.cluster import connect_cluster
    except ImportError:
        raise InputError("--scheduler needs dask.distributed", remedy=install_command("cluster")) from None
    with connect_cluster(scheduler, lambda line: say(f"urdfkin: {line}", err=True)) as cluster:
        yield cluster


def _list_urdf_files(robot: str) -> list[str]:
    """Return `robot`; if `robot` is a folder, return the .urdf files in it and its subfolders."""
    from urdfkin.urdf.lint.settings import DEFAULT_INCLUDE, Settings, find_files

    if not robot or robot in catalogue() or not is_folder(Path(robot)):
        return [robot]
    return find_files(robot, Settings(), DEFAULT_INCLUDE, ())


def _load_stdin(source: str, how: dict[str, Any]) -> Robot | str:
    """Load the robot now if `source` is standard input, which can be read only once.

    The robot has no locked joint, because `validate` and the accuracy study lock the joints.
    """
    from urdfkin.robot.loading import load

    loading = {name: value for name, value in how.items() if name not in ("lock", "joints")}
    return load(source, **loading) if source == "-" else source


def _load_usd(source: Robot | str, how: dict[str, Any], usd: dict[str, Any]) -> Robot | str:
    """Load the robot now if `source` is a USD file; as in `_load_stdin`, no joint is locked."""
    from urdfkin.urdf.sources import is_usd

    loading = {name: how[name] for name in ("mimic", "root_joint") if name in how}
    if not isinstance(source, str) or not is_usd(source):
        return source
    return load_robot(str(source), **loading, **usd, lock={}, joints=None)


def _say_shard(report: ValidationReport, shard: str, store: Path | None) -> None:
    for robot in report.robots:
        if robot.reason is not None:
            say(f"{robot.source}: {robot.verdict}: {join_lines(robot.reason)}")
    if not report.robots and not report.interrupted:
        say(f"shard {shard} of {store}: nothing to do, because the validation has fewer chunks than parts")
        return
    results = sum(robot.results for robot in report.robots)
    say(
        f"shard {shard} of {store}: {format_count(len(report.robots), 'robot')}, {results:,} results"
        f" compared, {sum(robot.failed for robot in report.robots):,} outside their bound,"
        f" {report.seconds:.1f} s"
    )
    say("after all parts: run `urdfkin report merge DIR STORE...`, then `urdfkin report DIR`")
