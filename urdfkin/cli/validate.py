"""`urdfkin validate`: every frame and joint against Pinocchio, on many samples."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

import click

from urdfkin.cli.accuracy import judge_all
from urdfkin.cli.arguments import how_to_load, mimic_option, root_joint_option, xacro_option
from urdfkin.cli.completion_items import complete_robot
from urdfkin.cli.exit import stoppable
from urdfkin.cli.options import Whole, reject_unused_options
from urdfkin.cli.output import compiling, console
from urdfkin.cli.progress import progress
from urdfkin.cli.report_options import FILES, check_writable, report_options, say_written, write_reports
from urdfkin.cli.streams import say
from urdfkin.errors import InputError
from urdfkin.urdf.catalogue import examples
from urdfkin.verify.quantities import compared, not_compared

if TYPE_CHECKING:
    from urdfkin.robot import Robot
    from urdfkin.validation.engines import Engine
    from urdfkin.validation.results import ValidationReport

_T = TypeVar("_T", bound=click.Command)
EXAMPLE = "urdfkin validate panda ur5 ./my.urdf --samples 1000 --seed 0"


def _with_quantities(command: _T) -> _T:
    """The help, which names the quantities as the table has them."""
    assert command.help is not None
    command.help = command.help.format(compared=compared(), not_compared=not_compared())
    return command


@_with_quantities
@click.command(epilog=f"Example: {EXAMPLE}")
@click.argument("robots", nargs=-1, metavar="[ROBOT]...", shell_complete=complete_robot)
@click.option("--all", "all_", is_flag=True, help="Every robot of example-robot-data in the catalogue.")
@click.option("--samples", type=Whole(0), default=1000, show_default=True, help="For each robot.")
@click.option(
    "--seed", type=Whole(0), default=0, show_default=True, help="The same seed gives the same numbers."
)
@click.option("--jobs", type=Whole(1), default=1, show_default=True, help="Local processes.")
@mimic_option("Whether mimic joints follow (the default).")
@root_joint_option("Hang the root from a joint.")
@click.option(
    "--oracle",
    type=click.Choice(["pinocchio", "mujoco"]),
    default="pinocchio",
    help="mujoco: MuJoCo is a second witness.",
)
@click.option("--isolate", is_flag=True, help="Each robot in a process of its own, whose death is a result.")
@xacro_option
@click.option(
    "--store", type=click.Path(path_type=Path), help="A folder that keeps every chunk; go on there."
)
@click.option("--retry", type=click.Choice(["failed"]), help="Compute these again, with --store.")
@click.option("--shard", metavar="I/N", help="Only the I-th of N parts, with --store.")
@click.option("--scheduler", metavar="ADDRESS", help="A dask scheduler's, or local:N for N workers here.")
@click.option("--json-progress", is_flag=True, help="Progress as lines of JSON on standard error.")
@click.option("--judge", "judged", is_flag=True, help="Say whose last digits are right, at 50 digits.")
@click.option("--judge-samples", type=Whole(1), default=5, show_default=True, help="For --judge.")
@click.option("--judge-moving-base", is_flag=True, help="For --judge: the root link moves, at random.")
@click.option("--json", "json_", type=click.Path(path_type=Path), help="Write the report as data.")
@report_options
@click.pass_context
def command(
    context: click.Context,
    /,
    robots: tuple[str, ...],
    all_: bool,
    judged: bool,
    judge_samples: int,
    judge_moving_base: bool,
    scheduler: str | None,
    json_progress: bool,
    cases: bool,
    **asked: Any,
) -> None:
    """Compare every frame and joint with Pinocchio's, in all three references, on many samples.

    Compared: {compared}. Not compared: {not_compared}; calls of the library and commands check those one by
    one.

    Configurations are drawn within limits; the neutral one and the ends of the limits are added, and every
    eighth sample has rates a hundred times larger. Disagreement is given in multiples of eps * scale: 1 to
    10 is what rounding gives. Exit 0: verified. 1: a disagreement. 2: a robot that cannot be read. 3: a robot
    that was not verified. 128 and the signal's number: ended by it; what had finished is written.

    With --store the same command goes on where one was ended, however it was, and `urdfkin report DIR` has
    the report at any time.
    """
    files = {name: asked.pop(name) for name in FILES}
    store, shard, retry = (asked[name] for name in ("store", "shard", "retry"))
    if bool(robots) == all_:
        raise click.UsageError("name robots, or say --all for every robot of example-robot-data")
    if (retry or shard) and store is None:
        raise click.UsageError("--retry and --shard go with --store DIR")
    if scheduler and (asked["jobs"] > 1 or asked["isolate"]):
        raise click.UsageError(
            "--jobs and --isolate are for this machine's processes, --scheduler for others'"
        )
    if shard and any(files.values()):
        raise click.UsageError("a shard has no report: merge the stores, then `urdfkin report DIR`")
    from urdfkin.report.document import Document  # noqa: PLC0415  keeps --help fast
    from urdfkin.report.terminal import print_report  # noqa: PLC0415
    from urdfkin.urdf.sources import is_xacro  # noqa: PLC0415
    from urdfkin.validation.accuracy_store import Asked  # noqa: PLC0415
    from urdfkin.validation.campaign import validate  # noqa: PLC0415

    check_writable(*files.values())
    how = how_to_load()
    if how["xacro_args"] and not any(map(is_xacro, robots)):
        reject_unused_options(context, ("xacro_arg",), "without a .xacro file")
    given = [_once(robot, how) if judged else robot for robot in robots or examples()]
    with stoppable() as stop, compiling(), _cluster(scheduler) as on, progress(as_json=json_progress) as tell:
        report = validate(given, executor=on, progress=tell, **asked, **how)
        if judged and not report.interrupted:
            of = Asked(judge_samples, asked["seed"], judge_moving_base)
            report = judge_all(report, given, of, store=store, shard=shard, retry=retry is not None, how=how)
    if shard:
        _say_shard(report, shard, store)
        context.exit(stop.exit_code(report.exit_code))
    document = cast("Document", report.as_dict())
    written = write_reports(document, files)
    print_report(document, console(), cases=cases)
    if not written:
        say_written(files)
    context.exit(stop.exit_code(report.exit_code) or written)


@contextmanager
def _cluster(scheduler: str | None) -> Iterator[Engine | None]:
    """The cluster that was asked for, with a line on where to watch it."""
    if scheduler is None:
        yield None
        return
    try:
        from urdfkin.validation.cluster import connected  # noqa: PLC0415  an extra
    except ImportError:
        raise InputError(
            "a cluster needs dask.distributed", remedy="pip install 'urdfkin[cluster]'"
        ) from None
    with connected(scheduler, lambda line: say(f"urdfkin: {line}", err=True)) as cluster:
        yield cluster


def _once(source: str, how: dict[str, Any]) -> Robot | str:
    """Standard input can be read once, and the judge comes second: load it now."""
    from urdfkin.loading import load  # noqa: PLC0415  keeps --help fast

    return load(source, **how) if source == "-" else source


def _say_shard(report: ValidationReport, shard: str, store: Path | None) -> None:
    """What a part came to; the report is of the whole."""
    from urdfkin.report.words import counted  # noqa: PLC0415  keeps --help fast

    for robot in report.robots:
        if robot.reason is not None:
            say(f"{robot.source}: {robot.verdict}: {robot.reason}")
    results = sum(robot.results for robot in report.robots)
    say(
        f"shard {shard} of {store}: {counted(len(report.robots), 'robot')}, {results:,} results compared, "
        f"{sum(robot.failed for robot in report.robots):,} outside their bound, {report.seconds:.1f} s"
    )
    say("then: urdfkin campaign merge DIR STORE..., urdfkin report DIR")
