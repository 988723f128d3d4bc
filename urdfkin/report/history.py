"""History of robots in several validation reports: verdicts, results, findings and changes from run to run.

Runs are ordered by start time. Robots are matched by source, or by the robot's name if a file was renamed.
Each report is read twice, first for its start time and then for its results. Therefore, few reports are in
memory at the same time.
"""

from __future__ import annotations

import hashlib
import math
import os
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal, TypedDict, cast

from urdfkin.errors import InputError, UrdfkinError
from urdfkin.errors.display import Strong, Table, TextDocument, format_count
from urdfkin.report.compare import ChangeEntry, ReportChange, compare, find_renamed_files, robots_by_source
from urdfkin.report.html import format_date, render_template
from urdfkin.report.reading import check_document, read_stored_document
from urdfkin.report.words import (
    VERDICTS,
    bound_ratio_of,
    format_ratio,
    format_units,
    utc,
    worst,
)
from urdfkin.system.documents import Count, DocumentKind, Header, Sha256, as_json_data, doc, parse_json
from urdfkin.system.files import MAX_BYTES, abbreviate_path, is_folder, read_bytes
from urdfkin.validation.document import OUTCOMES, VALIDATION, BoundRatio, Document, ReportedRobot, Units
from urdfkin.verify.oracles import package_versions

#: Maximum number of reports, and maximum number of files in a folder.
MOST_RUNS, MOST_FILES = 1000, 20_000
#: The list of robots shows the verdicts of the latest MARKED_RUNS runs. The charts of the page show the
#: latest CHARTED_RUNS runs.
MARKED_RUNS, CHARTED_RUNS = 20, 60
#: Maximum number of runs, and of changes, that a terminal shows without the option `--all`. The list of
#: changes on the HTML page has at most this number of entries.
MAX_SHOWN = 20
#: Maximum number of runs, and of changes, in the HTML page's section on one robot.
_MAX_LISTED = 500
#: Symbol of each verdict on a robot. The key "" is for a run whose report does not contain the robot.
VERDICT_MARKS = {"verified": "✓", "disagrees": "✗", "not verified": "!", "bad input": "✗", "": "·"}
#: Lower end of the chart of disagreements, as log10(disagreement / bound).
_MIN_LOG_RATIO = -3.0


class ValidationRun(TypedDict):
    """One validation run, as the history lists it."""

    file: Annotated[str, doc("The report: a JSON file, or the folder of `validate --store`.")]
    started: Annotated[str, doc("Start time, ISO 8601, UTC.")]
    verdict: Annotated[str, doc("The verdict of the run.")]
    reason: Annotated[str | None, doc("Reason why the run has not passed; null if the run has passed.")]
    samples: Annotated[Count, doc("Number of random configurations for each robot.")]
    seed: Annotated[int, doc("Seed of the random samples.")]
    robots: Annotated[Count, doc("Number of robots.")]
    results: Annotated[Count, doc("Number of compared results.")]
    failed: Annotated[Count, doc("Number of results outside their bound.")]
    bound_ratio: BoundRatio
    versions: Annotated[dict[str, str], doc("Versions of urdfkin, its libraries and the oracles.")]
    changes: Annotated[
        list[ChangeEntry], doc("Changes since the previous run, as `urdfkin report compare` lists them.")
    ]


class Point(TypedDict):
    """The results of one robot in one validation run."""

    run: Annotated[Count, doc("Index of the run.")]
    source: Annotated[str, doc("The robot's source in this run.")]
    verdict: Annotated[Literal["verified", "disagrees", "not verified", "bad input"], doc("The verdict.")]
    reason: Annotated[str | None, doc("Reason why the robot is not verified; null if it is verified.")]
    sha256: Annotated[Sha256 | None, doc("SHA-256 of the robot's text; null: the robot could not be read.")]
    samples: Annotated[Count, doc("Number of compared configurations.")]
    results: Annotated[Count, doc("Number of compared results.")]
    failed: Annotated[Count, doc("Number of results outside their bound.")]
    worst: Units
    bound_ratio: BoundRatio
    errors: Annotated[Count, doc("Number of errors in the file.")]
    warnings: Annotated[Count, doc("Number of warnings in the file.")]
    notes: Annotated[Count, doc("Number of notes on the file.")]


class RobotHistory(TypedDict):
    """The results of one robot, from every validation run that included the robot."""

    robot: Annotated[str, doc("The robot's latest source.")]
    points: Annotated[list[Point], doc("The runs of this robot, the oldest first.")]


class Unused(TypedDict):
    """A file that is left out of the history, with the reason."""

    file: Annotated[str, doc("The file.")]
    reason: Annotated[str, doc("Why the file is not used.")]


class HistoryDocument(Header):
    """The output of `urdfkin report history --format json`.

    The verdict and `sha256` are those of the latest run.
    """

    runs: Annotated[list[ValidationRun], doc("The runs, the oldest first.")]
    robots: Annotated[list[RobotHistory], doc("The robots; worse verdicts first.")]
    unusable: Annotated[list[Unused], doc("Files that cannot be used, each with the reason.")]
    repeated: Annotated[
        list[Unused], doc("Files that are left out, because another file has the same validation run.")
    ]


HISTORY = DocumentKind(
    "urdfkin-history/1", HistoryDocument, tuple(OUTCOMES.values()), "urdfkin report history DIR --format json"
)

#: Changes between runs, as pairs (index of the run, change), by the source of the changed robot. The key None
#: is for changes of a whole run, for example a change of the number of samples.
ChangesBySource = dict[str | None, list[tuple[int, ChangeEntry]]]


@dataclass(slots=True)
class History:
    """Runs and robots of several reports. The keys of `robots` are the latest sources."""

    runs: list[ValidationRun] = field(default_factory=list)
    robots: dict[str, list[Point]] = field(default_factory=dict)
    unusable: list[Unused] = field(default_factory=list)
    repeated: list[Unused] = field(default_factory=list)

    @property
    def exit_code(self) -> int:
        return 2 if self.unusable else 0

    def as_dict(self, command: str | None = None) -> HistoryDocument:
        last = len(self.runs) - 1
        latest = [points[-1]["sha256"] for points in self.robots.values() if points[-1]["run"] == last]
        document = {
            "schema": HISTORY.name,
            "versions": package_versions(),
            "sha256": latest,
            "verdict": self.runs[-1]["verdict"],
            "command": command,
            "runs": self.runs,
            "robots": [{"robot": robot, "points": points} for robot, points in self.robots.items()],
            "unusable": self.unusable,
            "repeated": self.repeated,
        }
        return cast("HistoryDocument", as_json_data(document))


def read_history(paths: Sequence[Path]) -> History:
    """Read reports, folders of `validate --store`, and folders that contain reports.

    Raise InputError if no report is usable, or if there are too many reports or files.
    """
    history = History()
    before: Document | None = None
    for file, report in _reports_in_order(list(_files(paths)), history):
        history.runs.append(_run(file, report, before))
        _add_robots(history, before, report)
        before = report
    if not history.runs:
        some = "; ".join(f"{one['file']}: {one['reason']}" for one in history.unusable[:3])
        raise InputError(
            "no report to show",
            where=", ".join(abbreviate_path(path) for path in paths[:3]),
            found=some or "neither .json files nor a folder of `validate --store`",
            remedy=f"write one with: {VALIDATION.command}",
        )

    def rank(item: tuple[str, list[Point]]) -> tuple[bool, int]:
        latest = item[1][-1]
        return latest["run"] != len(history.runs) - 1, VERDICTS.index(latest["verdict"])

    history.robots = dict(sorted(history.robots.items(), key=rank))
    return history


def _files(paths: Sequence[Path]) -> Iterator[Path]:
    count = 0
    for path in paths:
        has_reports = is_folder(path) and not (path / "manifest.json").is_file()
        for file in _reports_in_folder(path) if has_reports else iter([path]):
            count += 1
            if count > MOST_RUNS:
                raise InputError(
                    f"more than {MOST_RUNS:,} reports",
                    where=abbreviate_path(path),
                    remedy="pass fewer files, or a folder with fewer files",
                )
            yield file


def _reports_in_folder(folder: Path) -> Iterator[Path]:
    """Yield the reports in a folder, ordered by name; links to folders are not followed."""
    seen = 0
    for place, folders, names in os.walk(folder):
        here = Path(place)
        if "manifest.json" in names:
            folders.clear()
            yield here
            continue
        folders.sort()
        seen += len(names)
        if seen > MOST_FILES:
            raise InputError(
                f"more than {MOST_FILES:,} files",
                where=abbreviate_path(folder),
                remedy="name the reports' folder",
            )
        yield from (here / name for name in sorted(names) if name.endswith(".json"))


def _reports_in_order(files: Sequence[Path], history: History) -> Iterator[tuple[str, Document]]:
    """Yield reports by start time, and add unusable files and repeated runs to `history`."""
    starts = list[tuple[float, str, Path]]()
    for path in files:
        try:
            starts.append((*_read_start_time(path), path))
        except UrdfkinError as error:
            history.unusable.append(_make_unused(path, error))
    seen = dict[str, str]()
    for _, _, path in sorted(starts):
        try:
            document = _read_report(path)
        except UrdfkinError as error:
            history.unusable.append(_make_unused(path, error))
            continue
        run = repr([document[key] for key in ("started", "command", "seconds", "sha256")])
        digest = hashlib.sha256(run.encode(errors="replace")).hexdigest()
        if digest in seen:
            history.repeated.append({"file": str(path), "reason": f"the same run as {seen[digest]}"})
            continue
        seen[digest] = str(path)
        yield str(path), document


def _make_unused(path: Path, error: UrdfkinError) -> Unused:
    return {"file": str(path), "reason": str(error).removeprefix(f"{path}: ")}


def _read_start_time(path: Path) -> tuple[float, str]:
    """Return a report's start time as Unix time in seconds, and as text; an invalid text gives infinity."""
    data = _read_report(path) if is_folder(path) else parse_json(read_bytes(path, MAX_BYTES), str(path))
    text = str(data.get("started", "")) if isinstance(data, dict) else ""
    moment = utc(text)
    return moment.timestamp() if moment else math.inf, text


def _read_report(path: Path) -> Document:
    if is_folder(path):
        return read_stored_document(path)
    return check_document(parse_json(read_bytes(path, MAX_BYTES), str(path)), str(path))


def _run(file: str, document: Document, before: Document | None) -> ValidationRun:
    robots = document["robots"]
    return {
        "file": file,
        "started": document["started"],
        "verdict": document["verdict"],
        "reason": document["reason"],
        "samples": document["samples"],
        "seed": document["seed"],
        "robots": len(robots),
        "results": sum(robot["results"] for robot in robots),
        "failed": sum(robot["failed"] for robot in robots),
        "bound_ratio": worst(map(bound_ratio_of, robots)),
        "versions": document["versions"],
        "changes": cast("list[ChangeEntry]", as_json_data(compare(before, document).changes))
        if before
        else [],
    }


def _add_robots(history: History, before: Document | None, document: Document) -> None:
    """Add the robots of the latest run; the history of a renamed file continues under the new name.

    If the new name already has a history, this history continues.
    """
    robots = robots_by_source(document)
    for old, new in find_renamed_files(robots_by_source(before) if before else {}, robots).items():
        if new not in history.robots:
            history.robots[new] = history.robots.pop(old)
    for source, robot in robots.items():
        history.robots.setdefault(source, []).append(_point(len(history.runs) - 1, source, robot))


def _point(run: int, source: str, robot: ReportedRobot) -> Point:
    counts = Counter[str]()
    for finding in robot["findings"]:
        counts[finding["severity"]] += 1 + len(finding["other_lines"])
    return {
        "run": run,
        "source": source,
        "verdict": robot["verdict"],
        "reason": robot["reason"],
        "sha256": robot["model"]["sha256"] if robot["model"] else None,
        "samples": robot["samples"],
        "results": robot["results"],
        "failed": robot["failed"],
        "worst": worst(check["worst"] for check in robot["checks"]),
        "bound_ratio": bound_ratio_of(robot),
        "errors": counts["error"],
        "warnings": counts["warning"],
        "notes": counts["note"],
    }


def document(history: History, *, all_: bool = False) -> TextDocument:
    max_shown = None if all_ else MAX_SHOWN
    first = 0 if all_ else max(0, len(history.runs) - MAX_SHOWN)
    runs = [
        [
            f"{k}", _date(run), run["verdict"], f"{run['robots']:,}", f"{run['results']:,}",
            f"{run['failed']:,}", _ratio_cell(run),
            *(run["versions"].get(name, "?") for name in ("urdfkin", "pin")),
        ]
        for k, run in enumerate(history.runs[first:], first + 1)
    ]  # fmt: skip
    heads = ["run", "started", "verdict", "robots", "results", "outside", "of bound", "urdfkin", "pin"]
    parts: list[str | Table] = [Table(heads, runs, left=(1, 2))]
    grouped = _changes_by_source(history)
    rows = [
        [
            robot, verdict_marks(history, points), points[-1]["verdict"],
            format_units(points[-1]["worst"], compared=points[-1]["results"] > 0),
            _ratio_cell(points[-1]), f"{points[-1]['errors']}", f"{points[-1]['warnings']}",
            f"{len(_robot_changes(grouped, points))}",
        ]
        for robot, points in history.robots.items()
    ]  # fmt: skip
    heads = ["robot", "runs", "latest", "worst", "of bound", "errors", "warnings", "changes"]
    parts += ["", Table(heads, rows, left=(0, 1, 2))]
    lines = [
        (Strong(words, "bold red") if change["regression"] else words)
        for run, change in list_changes(history)[:max_shown]
        for words in [f"run {run + 1}, {describe_change(change)}"]
    ]
    more = len(list_changes(history)) - len(lines)
    parts += ["", "changes, the latest first:", *lines] if lines else ["", "no changes between the runs"]
    parts += [f"... and {more:,} more: --all shows them"] if more else []
    parts += [Strong(f"not used: {one['file']}: {one['reason']}", "bold yellow") for one in history.unusable]
    parts += [f"not counted: {one['file']}: {one['reason']}" for one in history.repeated]
    good = history.runs[-1]["verdict"] == "verified"
    return TextDocument("", [*parts, Strong(headline(history), f"bold {'green' if good else 'red'}")])


def headline(history: History) -> str:
    """Return the latest verdict, and the number of consecutive earlier runs with the same verdict.

    >>> headline(History([{"verdict": v} for v in ("disagrees", "verified", "verified")]))
    '3 runs; latest verdict: verified, as in the run before'
    """
    verdicts = [run["verdict"] for run in history.runs]
    same = next((k for k, one in enumerate(reversed(verdicts)) if one != verdicts[-1]), len(verdicts))
    if len(verdicts) == 1:
        return f"1 run: {verdicts[0]}"
    if same == 1:
        return f"{format_count(len(verdicts), 'run')}; latest verdict: {verdicts[-1]}, before: {verdicts[-2]}"
    before = "the run before" if same == 2 else f"the {same - 1:,} runs before"
    return f"{format_count(len(verdicts), 'run')}; latest verdict: {verdicts[-1]}, as in {before}"


def verdict_marks(history: History, points: Sequence[Point]) -> str:
    return "".join(VERDICT_MARKS[verdict] for verdict in _latest_verdicts(history, points))


def _latest_verdicts(history: History, points: Sequence[Point]) -> list[str]:
    verdicts = {point["run"]: point["verdict"] for point in points}
    last = len(history.runs)
    return [verdicts.get(run, "") for run in range(max(0, last - MARKED_RUNS), last)]


def list_changes(history: History) -> list[tuple[int, ChangeEntry]]:
    """Return all changes with the index of the later run. The latest run and regressions come first."""
    all_changes = [(k, change) for k, run in enumerate(history.runs) for change in run["changes"]]
    return sorted(all_changes, key=lambda one: (-one[0], not one[1]["regression"]))


def _changes_by_source(history: History) -> ChangesBySource:
    grouped: ChangesBySource = {}
    for run, change in list_changes(history):
        grouped.setdefault(change["robot"], []).append((run, change))
    return grouped


def _robot_changes(grouped: ChangesBySource, points: Sequence[Point]) -> list[tuple[int, ChangeEntry]]:
    sources = dict.fromkeys(point["source"] for point in points)
    return [one for source in sources for one in grouped.get(source, [])]


def describe_change(change: ChangeEntry) -> str:
    words = str(ReportChange(**change))
    return f"REGRESSION {words}" if change["regression"] else words


def _ratio_cell(one: ValidationRun | Point) -> str:
    return format_ratio(one["bound_ratio"]) if one["results"] else ""


def _date(run: ValidationRun) -> str:
    moment = utc(run["started"])
    return moment.isoformat(" ", "minutes")[:16] if moment else run["started"][:16].replace("T", " ")


def as_html(history: History, command: str | None = None) -> str:
    """Return a page with charts; the template escapes all names."""
    grouped = _changes_by_source(history)
    return render_template(
        "history.html.j2",
        headline=headline(history),
        runs=history.runs,
        last=history.runs[-1],
        dates=[_date(run) for run in history.runs],
        when=format_date(history.runs[-1]["started"]),
        charted=range(max(0, len(history.runs) - CHARTED_RUNS), len(history.runs)),
        stacks=_stacks(history),
        height=_height,
        robots=[_robot(history, robot, points, grouped) for robot, points in history.robots.items()],
        changes=list_changes(history)[:MAX_SHOWN],
        total=len(list_changes(history)),
        unusable=history.unusable,
        repeated=history.repeated,
        marks=VERDICT_MARKS,
        units=format_units,
        share=_ratio_cell,
        command=command,
        versions=package_versions(),
    )


def _stacks(history: History) -> list[dict[str, Counter[str]]]:
    stacks: list[dict[str, Counter[str]]] = [
        {"verdicts": Counter(), "findings": Counter()} for _ in history.runs
    ]
    for points in history.robots.values():
        for point in points:
            stack = stacks[point["run"]]
            stack["verdicts"][point["verdict"]] += 1
            stack["findings"].update({"errors": point["errors"], "warnings": point["warnings"]})
    return stacks


def _height(ratio: Units) -> float:
    """Return the height of a bar (%) on a logarithmic axis. The axis shows ratios from 0.001 to 1.

    >>> [_height(x) for x in (0.0, 0.001, 1.0, 7.0, None)]
    [2.0, 2.0, 100.0, 100.0, 100.0]
    """
    if ratio is None or ratio >= 1.0:
        return 100.0
    return max(2.0, 100.0 * (1.0 - math.log10(ratio) / _MIN_LOG_RATIO)) if ratio else 2.0


def _robot(history: History, robot: str, points: Sequence[Point], grouped: ChangesBySource) -> dict[str, Any]:
    verdicts, own_changes = _latest_verdicts(history, points), _robot_changes(grouped, points)
    return {
        "name": robot,
        "runs": len(points),
        "points": points[: -_MAX_LISTED - 1 : -1],
        "last": points[-1],
        "verdicts": verdicts,
        "good": verdicts.count("verified"),
        "changes": own_changes[:_MAX_LISTED],
        "total": len(own_changes),
        "is_current": points[-1]["run"] == len(history.runs) - 1,
    }
