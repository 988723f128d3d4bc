"""Report of a validation, and the versions on which the report's numbers depend.

`urdfkin.validation.document` defines the layout of the JSON document.
"""

from __future__ import annotations

import hashlib
import shlex
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from urdfkin.errors import InputError, UnknownNameError
from urdfkin.errors.display import Displayable, Table, TextDocument
from urdfkin.errors.validators import as_str, safe_repr
from urdfkin.system.documents import as_json_data
from urdfkin.system.files import read_bytes
from urdfkin.system.lazy_import import get_hook
from urdfkin.urdf.catalogue import example_robot_data_names
from urdfkin.urdf.sources import Origin
from urdfkin.validation.chunk import Timings
from urdfkin.validation.document import VALIDATION, Document, RunOutcome, ValidationVerdict, outcome
from urdfkin.validation.error_stats import HISTOGRAM_EDGES, ErrorStats, Key
from urdfkin.validation.robot_summary import EMPTY_SUMMARY, RobotSummary
from urdfkin.verify.oracles import ORACLES, package_version, package_versions
from urdfkin.verify.quantities import QUANTITIES, format_replay_command

if TYPE_CHECKING:
    from urdfkin.validation.accuracy import AccuracyStudy


_PACKAGE_FOLDER = Path(__file__).resolve().parents[1]
#: Packages that display results, but compute no results. A campaign can resume if only the code of these
#: packages has changed.
_DISPLAY_PACKAGES = ("cli", "report", "view")
LIBRARIES = ("urdfkin", "numpy", "numba", "llvmlite", "yourdfpy", *(one.package for one in ORACLES.values()))


@cache
def provenance() -> dict[str, str]:
    """Return library versions, and digests of the equations and of the code that can affect results."""
    equations = hashlib.sha256(read_bytes(_PACKAGE_FOLDER / "kinematics" / "equations.py")).hexdigest()
    return {name: package_version(name) for name in LIBRARIES} | {
        "code": _digest_code(),
        "equations": equations,
    }


def _digest_code() -> str:
    digest = hashlib.sha256()
    for path in sorted(_PACKAGE_FOLDER.rglob("*")):
        relative = path.relative_to(_PACKAGE_FOLDER)
        if path.suffix in (".py", ".toml", ".json") and relative.parts[0] not in _DISPLAY_PACKAGES:
            content = read_bytes(path)
            digest.update(f"{relative.as_posix()}\0{len(content)}\0".encode() + content)
    return digest.hexdigest()


@dataclass(frozen=True, slots=True)
class RobotReport:
    """Report of one robot.

    Attributes:
        reason: Reason why the robot is not verified; None if it is verified.
        joints: Names of the moving joints, mimic joints included.
        frames: Names of the compared frames: every link and every joint.
        error: The traceback of an unexpected error, for a bug report; None otherwise.
    """

    origin: Origin
    name: str
    verdict: ValidationVerdict
    reason: str | None
    joints: tuple[str, ...]
    frames: tuple[str, ...]
    error_stats: dict[Key, ErrorStats]
    samples: int
    seconds: float
    summary: RobotSummary = EMPTY_SUMMARY
    timings: Timings | None = None
    error: str | None = None

    @property
    def source(self) -> str:
        return self.origin.source

    @property
    def results(self) -> int:
        return sum(stats.results for stats in self.error_stats.values())

    @property
    def failed(self) -> int:
        """Number of results outside their bound."""
        return sum(stats.failed for stats in self.error_stats.values())

    def stats_of(self, quantity: str) -> list[ErrorStats]:
        """Return the statistics of a quantity in each reference frame.

        Raise UnknownNameError if there is no such quantity.
        """
        if as_str(quantity, "quantity") not in QUANTITIES:
            raise UnknownNameError("quantity", quantity, QUANTITIES)
        return [stats for (kind, _), stats in self.error_stats.items() if kind == quantity]

    def replay(self, key: Key) -> str | None:
        """Return a command that computes the worst result again; None if nothing was compared.

        Raise InputError if `error_stats` does not contain the key.
        """
        if key not in list(self.error_stats):  # A list also compares keys that cannot be hashed.
            raise InputError(
                "the report does not contain this key",
                where=self.name,
                found=safe_repr(key),
                remedy="give a key of error_stats, such as ('velocity', 'world')",
            )
        quantity, reference = key
        if (case := self.error_stats[key].case) is None:
            return None
        row = QUANTITIES[quantity]
        # A joint needs the prefix "joint:", because a link may have the same name.
        frame = case.frame if row.object_kind == "frames" else f"joint:{case.frame}"
        origin = replace(self.origin, oracle=None)  # The command compares the result with Pinocchio.
        return format_replay_command(
            origin, row.command, frame, reference, {x: getattr(case, x) for x in row.inputs}
        )

    def as_dict(self, study: AccuracyStudy | None = None) -> dict[str, Any]:
        names = (
            "source",
            "name",
            "verdict",
            "reason",
            "error",
            "joints",
            "frames",
            "samples",
            "results",
            "failed",
        )
        return {name: getattr(self, name) for name in names} | {
            "seconds": round(self.seconds, 3),
            "timings": self.timings.as_dict() if self.timings else None,
            "model": self.summary.model,
            "findings": self.summary.findings,
            "chains": self.summary.chains,
            "second_reader": self.summary.second_reader,
            "checks": [self._make_check_entry(key) for key in self.error_stats],
            "accuracy": study,
        }

    def _make_check_entry(self, key: Key) -> dict[str, Any]:
        quantity, reference = key
        stats = self.error_stats[key]
        case = stats.case
        worst_case = case and {
            **{name: getattr(case, name) for name in ("sample", "frame", "q", "v", "a")},
            "disagreement": case.units,
            "replay": self.replay(key),
        }
        return {
            "quantity": quantity,
            "reference": reference or None,
            "results": stats.results,
            "failed": stats.failed,
            "median": stats.percentile(50.0),
            "p99": stats.percentile(99.0),
            "worst": stats.worst,
            "bound_ratio": stats.bound_ratio,
            "bound": stats.bounds,
            "histogram": stats.histogram,
            "subjects": QUANTITIES[quantity].object_kind,
            "worst_by_subject": stats.worst_by_frame,
            "worst_case": worst_case,
        } | ({"second_oracle": stats.cross_check.as_dict()} if stats.cross_check else {})


@dataclass(frozen=True, slots=True)
class ValidationReport(Displayable):
    """Report of a whole run.

    Attributes:
        robots_requested: Number of requested robots.
        started: Start time, ISO 8601, UTC.
        seconds: Wall time.
        interrupted: Whether the run ended early. Finished results are included.
        library_versions: Package versions of the run; None for the installed versions.
        studies: Results of the accuracy study, one for each compared robot. Empty if no study was requested.
            The result of a robot is None if its study failed or is missing.
    """

    robots: tuple[RobotReport, ...]
    robots_requested: int
    samples: int
    seed: int
    started: str
    seconds: float
    interrupted: bool = False
    library_versions: dict[str, str] | None = None
    studies: tuple[AccuracyStudy | None, ...] = ()

    def to_html(self) -> str:
        """Return the report as one offline HTML page, as `urdfkin validate --html` writes it."""
        return str(get_hook("a report as a page")(self.as_dict()))

    def to_markdown(self) -> str:
        """Return the report as Markdown for a pull request, as `urdfkin validate --markdown` writes it."""
        return str(get_hook("a report as a comment")(self.as_dict()))

    def _text_document(self) -> TextDocument:
        heads = ("robot", "verdict", "results", "outside", "worst [eps*scale]", "of the bound")
        rows = []
        for robot in self.robots:
            error_stats = robot.error_stats.values()
            worst, bound_ratio = (
                max((getattr(x, of) for x in error_stats), default=0.0) for of in ("worst", "bound_ratio")
            )
            figures = (f"{worst:.2g}", f"{bound_ratio:.1%}") if error_stats else ("", "")
            rows.append((robot.source, robot.verdict.value, str(robot.results), str(robot.failed), *figures))
        verified = sum(robot.verdict is ValidationVerdict.VERIFIED for robot in self.robots)
        samples = f"{self.samples} samples of each robot, seed {self.seed}, in {self.seconds:.1f} s."
        reasons = [f"{robot.source}: {robot.reason}" for robot in self.robots if robot.reason]
        return TextDocument(
            f"{verified} of {self.robots_requested} robots verified", (Table(heads, rows), samples, *reasons)
        )

    @property
    def command(self) -> str:
        """The commands that repeat the run, one on each line.

        Robots with the same options share a command. A command can read only one robot from standard input.
        """
        settings = f"--samples {self.samples} --seed {self.seed}{self._accuracy_options}"
        return "\n".join(
            f"urdfkin validate {_join_sources(origins)} {settings} {origins[0].command_line_options}".rstrip()
            for origins in _group_by_command([robot.origin for robot in self.robots])
        )

    @property
    def _accuracy_options(self) -> str:
        if not self.studies:
            return ""
        if (study := next(filter(None, self.studies), None)) is None:
            return " --accuracy"
        moving = " --accuracy-moving-base" if study.moving_base else ""
        return f" --accuracy --accuracy-samples {study.samples}{moving}"

    @property
    def outcome(self) -> RunOutcome:
        """The outcome of the run, with a reason if the run has not passed."""
        return outcome((robot.verdict for robot in self.robots), self.robots_requested, self.interrupted)

    @property
    def passed(self) -> bool:
        """Whether every requested robot was verified without interruption. False if there is no robot."""
        return self.outcome.passed

    @property
    def exit_code(self) -> int:
        """Exit code of the command `validate`.

        0: verified. 1: a disagreement. 130: interrupted. 2: bad input. 3: a robot was not verified
        or has no report, or there was no robot.
        """
        return self.outcome.exit_code

    def as_dict(self) -> Document:
        """Return the JSON document; an infinite or NaN disagreement becomes null."""
        studies = iter(self.studies)  # Only compared robots have an accuracy result.
        document = {
            "schema": VALIDATION.name,
            "versions": self.library_versions
            or package_versions(robot.origin.oracle for robot in self.robots),
            "sha256": [robot.summary.model and robot.summary.model["sha256"] for robot in self.robots],
            "verdict": self.outcome.verdict,
            "command": self.command,
            "started": self.started,
            "seconds": round(self.seconds, 3),
            "seed": self.seed,
            "samples": self.samples,
            "histogram_edges": HISTOGRAM_EDGES,
            "robots_requested": self.robots_requested,
            "interrupted": self.interrupted,
            "reason": self.outcome.reason,
            "robots": [
                robot.as_dict(next(studies, None) if robot.error_stats else None) for robot in self.robots
            ],
        }
        return cast("Document", as_json_data(document))


def _group_by_command(origins: Sequence[Origin]) -> list[list[Origin]]:
    groups: dict[tuple[str, int], list[Origin]] = {}
    texts = Counter[str]()
    for origin in origins:
        is_text = origin.source_argument == "-"
        groups.setdefault(
            (origin.command_line_options, texts[origin.command_line_options] if is_text else 0), []
        ).append(origin)
        texts[origin.command_line_options] += is_text
    return list(groups.values())


def _join_sources(origins: Sequence[Origin]) -> str:
    if tuple(origin.source for origin in origins) == example_robot_data_names():
        return "--all"
    return shlex.join(origin.source_argument for origin in origins)
