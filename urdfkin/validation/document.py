"""Types of the JSON document of a validation, and the outcome of a validation run.

The JSON schema is generated from these types. Only this module decides whether a run has passed, for new
reports and for reports that are read from a file.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Literal, NotRequired, TypedDict

from urdfkin.system.documents import (
    Count,
    DocumentKind,
    Header,
    NonNegativeFloat,
    Sha256,
    TransformRows,
    doc,
    of_length,
)

_NULL_MEANING = (
    "null: infinite, for example because a result is NaN, or because two different values have the bound 0."
)
Units = Annotated[
    NonNegativeFloat | None, doc(f"A disagreement in multiples of eps * scale. {_NULL_MEANING}")
]
BoundRatio = Annotated[
    float | None, doc(f"Largest ratio of a disagreement to its bound; above 1: a failure. {_NULL_MEANING}")
]
ReferenceName = Literal["local", "world", "local_world_aligned"]


class ReportedLimit(TypedDict):
    """Limits of a joint."""

    lower: Annotated[
        float | None, doc("Lower position limit, rad or m; null: no limit, as for a continuous joint.")
    ]
    upper: Annotated[
        float | None, doc("Upper position limit, rad or m; null: no limit, as for a continuous joint.")
    ]
    velocity: Annotated[float | None, doc("Limit of the joint velocity, rad/s or m/s; null: no limit.")]
    effort: Annotated[float | None, doc("Limit of the joint torque or force, N m or N; null: no limit.")]


class ReportedMimic(TypedDict):
    """Mimic rule: the joint's value is multiplier * (value of `mimicked_joint`) + offset."""

    mimicked_joint: Annotated[str, doc("Name of the mimicked joint.")]
    multiplier: Annotated[float, doc("Factor by which the mimicked joint's value is multiplied.")]
    offset: Annotated[float, doc("Offset of the rule, rad or m.")]


class ReportedRange(TypedDict):
    """Range in which a mimicked joint keeps its mimic joints within their limits."""

    lower: Annotated[float | None, doc("Lower end, rad or m; null if the range is empty or a single value.")]
    upper: Annotated[float | None, doc("Upper end, rad or m; null if the range is empty or a single value.")]
    by: Annotated[list[str], doc("Names of the mimic joints that reduce the joint's range.")]


class ReportedJoint(TypedDict):
    """A joint. Fixed joints are included."""

    name: Annotated[str, doc("Name of the joint in the URDF.")]
    kind: Annotated[
        Literal["revolute", "continuous", "prismatic", "fixed", "planar", "floating"],
        doc("Kind of the joint."),
    ]
    parent: Annotated[str, doc("Name of the parent link.")]
    child: Annotated[
        str,
        doc("Name of the child link. The child link's frame is the joint's frame after the joint's motion."),
    ]
    placement: Annotated[TransformRows, doc("Pose of the joint's frame in the parent link's frame at q = 0.")]
    axis: Annotated[
        Annotated[list[float], of_length(3)] | None,
        doc("Unit axis in the joint's frame; null for kinds without an axis."),
    ]
    q: Annotated[
        int | None,
        doc(
            "Index in q of the joint's first coordinate. A mimic joint has the index of the mimicked joint."
            " null: a fixed joint."
        ),
    ]
    v: Annotated[
        int | None,
        doc(
            "Index of the joint's first entry in v and in a. A mimic joint has the index of the mimicked"
            " joint. null: a fixed joint."
        ),
    ]
    limit: Annotated[ReportedLimit | None, doc("The joint's limits; null: the joint has no limits.")]
    mimic: Annotated[ReportedMimic | None, doc("The rule of a mimic joint; null for other joints.")]
    remaining_range: Annotated[
        ReportedRange | None,
        doc(
            "The joint values for which all mimic joints of this joint are within their limits."
            " null: the joint's whole range."
        ),
    ]
    locked: NotRequired[
        Annotated[float, doc("Value of a locked joint, rad or m. The `kind` of a locked joint is `fixed`.")]
    ]


class ReportedModel(TypedDict):
    """Links and joints of the robot, in Pinocchio's order."""

    name: Annotated[str, doc("The robot's name.")]
    source: Annotated[str, doc("A path, a catalogue name, - for standard input, or <text>.")]
    path: Annotated[str | None, doc("Path of the robot's file; null for a robot given as text.")]
    sha256: Annotated[Sha256, doc("SHA-256 of the URDF's text as UTF-8, or of the MJCF or USD file.")]
    mimic: Annotated[
        bool | None,
        doc("Whether mimic joints are coupled to the mimicked joints; null: the default of this robot."),
    ]
    root_joint: Annotated[
        Literal["floating", "planar"] | None,
        doc("Kind of the joint between the world and the root link; null: there is no such joint."),
    ]
    nq: Annotated[Count, doc("Number of coordinates (length of q).")]
    nv: Annotated[Count, doc("Number of joint velocities (length of v and of a).")]
    base: Annotated[str, doc("Name of the default base frame of chains.")]
    tip: Annotated[str, doc("Name of the default tip frame of chains.")]
    coordinates: Annotated[list[str], doc("Name of each coordinate in q.")]
    rates: Annotated[list[str], doc("Name of each entry of v and a.")]
    frames: Annotated[
        list[str], doc("Names of all frames (links and joints) in Pinocchio's order, each name once.")
    ]
    links: Annotated[list[str], doc("Names of all links; links[i + 1] is the child of joints[i].")]
    joints: Annotated[list[ReportedJoint], doc("All joints; a parent link comes before its child links.")]


class ReportedFinding(TypedDict):
    """A finding in the URDF file, as `urdfkin check` reports it."""

    code: Annotated[str, doc("A code such as URDF502; `urdfkin explain CODE` explains the code.")]
    severity: Annotated[
        Literal["error", "warning", "note"],
        doc("Severity of the finding. A file with an error is not compared with Pinocchio."),
    ]
    message: Annotated[str, doc("Description of the problem.")]
    found: Annotated[str | None, doc("The text or value that caused the finding; null: none.")]
    remedy: Annotated[str | None, doc("How to correct the file; null: no remedy is known.")]
    file: Annotated[str, doc("Name of the file with the problem.")]
    line: Annotated[Count, doc("Line number of the problem, counted from 1.")]
    column: Annotated[Count, doc("Column number of the problem, counted from 1.")]
    element: Annotated[
        str | None,
        doc("Tag of the joint, link or other child of <robot> with the problem; null: the whole file."),
    ]
    name: Annotated[str | None, doc("Name of the joint, link or material with the problem; null: none.")]
    pinocchio_reading: Annotated[
        Literal["refuses", "differs"] | None,
        doc("refuses: Pinocchio refuses the file. differs: Pinocchio misreads the file. null: neither."),
    ]
    other_lines: Annotated[
        list[int], doc("Line numbers of further findings that are merged into this finding.")
    ]


class ReportedDHRow(TypedDict):
    """The constant parameters of a row of a Denavit-Hartenberg table, in metres and radians."""

    joint: Annotated[str, doc("Name of the joint.")]
    kind: Annotated[Literal["revolute", "continuous", "prismatic"], doc("Kind of the joint.")]
    a: Annotated[float, doc("Translation along x.")]
    alpha: Annotated[float, doc("Rotation about x.")]
    beta: Annotated[float, doc("Hayati parameter: rotation about y after alpha; 0 in other rows.")]
    d: Annotated[
        float,
        doc("Translation along the joint axis. For a prismatic joint: the constant part of the translation."),
    ]
    theta: Annotated[
        float,
        doc(
            "Rotation about the joint axis. For a revolute or continuous joint: the constant part of the"
            " rotation."
        ),
    ]
    sense: Annotated[
        Literal[1, -1],
        doc(
            "1: the joint's value is added to theta or, for a prismatic joint, to d."
            " -1: the joint's value is subtracted."
        ),
    ]


class ReportedDHTable(TypedDict):
    """A table in one convention."""

    rows: Annotated[list[ReportedDHRow], doc("Rows of the table from base to tip.")]
    base: TransformRows
    tool: TransformRows


class Chain(TypedDict):
    """A chain of the robot, with its Denavit-Hartenberg tables."""

    limb: Annotated[str | None, doc("Name of the limb in the catalogue; null: none.")]
    base: Annotated[str, doc("Name of the chain's base frame.")]
    tip: Annotated[str, doc("Name of the chain's tip frame.")]
    standard: ReportedDHTable
    modified: ReportedDHTable
    samples: Annotated[Count, doc("Number of compared configurations; 0 if nothing was compared.")]
    metres: Annotated[
        float | None,
        doc("Largest distance (metres) of a table's tip from Pinocchio's tip. null: nothing was compared."),
    ]
    worst: Annotated[
        Units,
        doc(
            "Largest disagreement of a table's tip with Pinocchio in placement, Jacobian and acceleration, in"
            " eps * scale. null: infinite, or nothing was compared."
        ),
    ]
    bound_ratio: Annotated[
        float | None,
        doc("Largest ratio of a disagreement to its bound. null: infinite, or nothing was compared."),
    ]


class ReportedErrors(TypedDict):
    """Errors of one library, in eps * scale. An error is the difference from a value with fifty digits."""

    worst: Annotated[float, doc("Largest error.")]
    typical: Annotated[float, doc("Root mean square of the errors.")]


class ReportedAccuracyLine(TypedDict):
    """Accuracy of one quantity in one reference frame."""

    quantity: Annotated[str, doc("Name of the quantity: placement, velocity, ...")]
    reference: Annotated[
        ReferenceName | Literal["euler angles", "quaternion"] | None,
        doc(
            "Reference frame; null for a placement. For analytical Jacobians: the representation of the"
            " orientation."
        ),
    ]
    numbers: Annotated[Count, doc("Number of values compared with fifty-digit values.")]
    urdfkin: ReportedErrors
    pinocchio: ReportedErrors


class ReportedAccuracy(TypedDict):
    """Result of the accuracy study: differences of urdfkin and Pinocchio from values with fifty digits."""

    robot: Annotated[str, doc("The robot's name.")]
    samples: Annotated[Count, doc("Number of configurations in the accuracy study.")]
    seed: Annotated[int, doc("Seed of the random samples.")]
    moving_base: Annotated[bool, doc("Whether the root link had a random motion.")]
    lines: Annotated[list[ReportedAccuracyLine], doc("One entry for each quantity and reference frame.")]


class Case(TypedDict):
    """The sample with the largest ratio of a disagreement to its bound."""

    sample: Annotated[
        Count,
        doc(
            "Index of the sample. 0: the neutral configuration. 1: the lower limits. 2: the upper limits."
            " Above 2: random configurations."
        ),
    ]
    frame: Annotated[
        str,
        doc(
            "Name of the frame (link:NAME or joint:NAME). It is the name of a joint if `subjects` is `joints`"
            " or `columns`."
        ),
    ]
    disagreement: Units
    q: Annotated[list[float], doc("Configuration of the sample.")]
    v: Annotated[list[float], doc("Joint velocities of the sample.")]
    a: Annotated[list[float], doc("Joint accelerations of the sample.")]
    replay: Annotated[str, doc("Command that reproduces the disagreement.")]


class ReportedOraclePair(TypedDict):
    """Comparison of one library, urdfkin or Pinocchio, with the second oracle."""

    failed: Annotated[Count, doc("Number of results with a disagreement above the bound.")]
    worst: Units
    bound_ratio: BoundRatio


class Alone(TypedDict):
    """For each library, the number of results in which it differs from two libraries that agree."""

    urdfkin: Annotated[Count, doc("Number of results in which only urdfkin differs.")]
    pinocchio: Annotated[Count, doc("Number of results in which only Pinocchio differs.")]
    second_oracle: Annotated[Count, doc("Number of results in which only the second oracle differs.")]


class SecondOracle(TypedDict):
    """Comparisons of urdfkin and of Pinocchio with a second oracle.

    Without a second oracle, the document has no such entry.
    """

    by: Annotated[str, doc("Name of the second oracle: mujoco.")]
    urdfkin: ReportedOraclePair
    pinocchio: ReportedOraclePair
    alone: Alone
    undecided: Annotated[
        Count,
        doc(
            "Number of disagreements that do not show which library is wrong, because none or two of the"
            " three pairs of libraries agree."
        ),
    ]


class ReportedCheck(TypedDict):
    """Comparison of one quantity with Pinocchio in one reference frame."""

    quantity: Annotated[str, doc("Name of the quantity: placement, velocity, jacobian, ...")]
    reference: Annotated[
        ReferenceName | None, doc("Pinocchio's name of the reference frame; null for a placement.")
    ]
    results: Annotated[Count, doc("Number of compared matrices or six-vectors.")]
    failed: Annotated[Count, doc("Number of results with a disagreement above the bound.")]
    median: Units
    p99: Units
    worst: Units
    bound_ratio: BoundRatio
    bound: Annotated[
        Annotated[list[float | None], of_length(2)],
        doc("Smallest and largest bound of the results, in eps * scale. [null, 0]: nothing was compared."),
    ]
    histogram: Annotated[
        list[Count],
        doc(
            "Number of results in each bin. The first bin is below the first of `histogram_edges`, the last"
            " bin is above the last edge, and every other bin is between two adjacent edges."
        ),
    ]
    subjects: Annotated[
        Literal["frames", "joints", "columns"],
        doc(
            "Meaning of the entries of `worst_by_subject`: one for each frame, for each joint, or for each"
            " column of the full Jacobian of all joints."
        ),
    ]
    worst_by_subject: Annotated[list[Units], doc("The largest disagreement of each frame, joint or column.")]
    worst_case: Annotated[
        Case | None, doc("Sample with the largest ratio of disagreement to bound; null: no comparison.")
    ]
    second_oracle: NotRequired[SecondOracle]


class ReportedTimings(TypedDict):
    """Sums of the computing times of all processes, in seconds."""

    read: Annotated[float, doc("Time of reading the file, and of building the models and tables.")]
    urdfkin: Annotated[
        float, doc("Time of computing with urdfkin. It includes the loading or compilation of kernels.")
    ]
    pinocchio: Annotated[float, doc("Time of computing with Pinocchio.")]
    compare: Annotated[float, doc("Time of computing the bounds and comparing the results.")]
    second_oracle: NotRequired[
        Annotated[float, doc("Time of computing with the second oracle, if there is one.")]
    ]


class ReportedSecondReading(TypedDict):
    """Comparison of the links and joints that urdfkin and yourdfpy read from the same text."""

    by: Annotated[str, doc("Name and version of the second URDF parser, yourdfpy.")]
    joints: Annotated[Count, doc("Number of compared joints, fixed joints included.")]
    differences: Annotated[
        list[str],
        doc("Differences between urdfkin and yourdfpy that no known fault of yourdfpy explains."),
    ]
    known: Annotated[
        list[str],
        doc(
            "Known faults of yourdfpy that explain other differences, with the names of the affected joints."
        ),
    ]
    unread: Annotated[
        str | None, doc("Reason why there is no comparison with yourdfpy; null: there is a comparison.")
    ]


class ReportedRobot(TypedDict):
    """Report of one robot."""

    source: Annotated[str, doc("A path, a catalogue name, - for standard input, or <text>.")]
    name: Annotated[str, doc("The robot's name in its file; the source if the name is unknown.")]
    verdict: Annotated[
        Literal["verified", "disagrees", "not verified", "bad input"], doc("Verdict on the robot.")
    ]
    reason: Annotated[str | None, doc("Reason why the robot is not verified; null if it is verified.")]
    error: Annotated[str | None, doc("Traceback of an unexpected error; null: no such error.")]
    joints: Annotated[list[str], doc("Names of the moving joints, mimic joints included.")]
    frames: Annotated[list[str], doc("Names of the compared frames: link:NAME or joint:NAME.")]
    samples: Annotated[Count, doc("Number of compared configurations, including the three special ones.")]
    results: Annotated[Count, doc("Number of results compared with Pinocchio.")]
    failed: Annotated[Count, doc("Number of results with a disagreement above the bound.")]
    seconds: Annotated[float, doc("Computing time of this robot, seconds.")]
    timings: Annotated[
        ReportedTimings | None, doc("Computing times of the parts of the validation; null: unknown.")
    ]
    model: Annotated[
        ReportedModel | None,
        doc(
            "Links and joints. null: unknown, for example because the file could not be read. Without links"
            " and joints, there are no chains."
        ),
    ]
    findings: Annotated[list[ReportedFinding], doc("Findings of the linter in the robot's file.")]
    chains: Annotated[list[Chain], doc("Chains of the robot with their Denavit-Hartenberg tables.")]
    second_reader: Annotated[
        ReportedSecondReading | None,
        doc("Comparison with the tree that yourdfpy reads from the same text; null: no comparison."),
    ]
    checks: Annotated[
        list[ReportedCheck], doc("Comparisons with Pinocchio, one for each quantity and reference frame.")
    ]
    accuracy: Annotated[
        ReportedAccuracy | None,
        doc("Result of the accuracy study; null without `--accuracy`, or if the study has no result."),
    ]


class Document(Header):
    """The output of `urdfkin validate --json`.

    The version of the layout changes if a release removes an entry or changes its meaning. A release may add
    entries without a new version of the layout.
    """

    started: Annotated[str, doc("Start time of the validation, ISO 8601, UTC.")]
    seconds: Annotated[
        float,
        doc(
            "Wall time of the validation in seconds, without compilation before the first chunk. If `urdfkin"
            " report DIR` makes the report from a store, the sum of the robots' computing times."
        ),
    ]
    seed: Annotated[int, doc("Seed of the random samples.")]
    samples: Annotated[Count, doc("Number of random configurations for each robot.")]
    histogram_edges: Annotated[list[float], doc("Edges of the bins of all histograms, in eps * scale.")]
    robots_requested: Annotated[
        Count, doc("Number of robots in the validation, including those without a report.")
    ]
    interrupted: Annotated[bool, doc("Whether the validation ended early, or its store is incomplete.")]
    reason: Annotated[str | None, doc("One-line reason why the validation has not passed; null: passed.")]
    robots: Annotated[list[ReportedRobot], doc("Reports of the robots in the requested order.")]


# -- outcome --------------------------------------------------------------------------------------------


class ValidationVerdict(StrEnum):
    """Verdict on one robot.

    HTML and Markdown reports sort the robots by verdict, bad input first.
    """

    BAD_INPUT = "bad input"
    NOT_VERIFIED = "not verified"
    DISAGREES = "disagrees"
    VERIFIED = "verified"


EXIT_DISAGREES, EXIT_BAD_INPUT, EXIT_NOT_VERIFIED = 1, 2, 3
#: Exit code of an interrupted run, as in shells: 128 + SIGINT.
EXIT_INTERRUPTED = 130
_VERDICT_WORDS = {
    ValidationVerdict.DISAGREES: ("disagrees", "disagree"),
    ValidationVerdict.NOT_VERIFIED: ("is not verified", "are not verified"),
    ValidationVerdict.BAD_INPUT: ("has bad input", "have bad input"),
}
OUTCOMES = {
    0: ValidationVerdict.VERIFIED.value,
    EXIT_DISAGREES: ValidationVerdict.DISAGREES.value,
    EXIT_INTERRUPTED: "interrupted",
    EXIT_BAD_INPUT: ValidationVerdict.BAD_INPUT.value,
    EXIT_NOT_VERIFIED: ValidationVerdict.NOT_VERIFIED.value,
}


@dataclass(frozen=True, slots=True)
class RunOutcome:
    """The outcome of a validation run.

    Attributes:
        exit_code: 0: every robot is verified. 1: a result disagrees. 130: the run was interrupted. 2: a robot
            cannot be read. 3: a robot was not verified or has no report, or there was no robot.
            Order of precedence: 1, 130, 2, 3.
    """

    exit_code: int
    reason: str | None

    @property
    def verdict(self) -> str:
        """The verdict on the run: "verified", "disagrees", "not verified", "bad input" or "interrupted"."""
        return OUTCOMES[self.exit_code]

    @property
    def passed(self) -> bool:
        return self.reason is None


def outcome(verdicts: Iterable[str], robots_requested: int, interrupted: bool) -> RunOutcome:
    """Return the outcome of a run with `robots_requested` requested robots.

    >>> outcome(["bad input", "bad input"], robots_requested=3, interrupted=False).reason
    '2 of 3 robots have bad input, 1 of 3 robots without a report'
    """
    counts = Counter(map(str, verdicts))
    robots = "1 robot" if robots_requested == 1 else f"{robots_requested:,} robots"
    reasons = ["the validation was interrupted before everything was compared"] if interrupted else []
    reasons += [
        f"{counts[verdict]} of {robots} {words[counts[verdict] > 1]}"
        for verdict, words in _VERDICT_WORDS.items()
        if counts[verdict]
    ]
    if missing := robots_requested - counts.total():
        reasons.append(f"{missing} of {robots} without a report")
    if not robots_requested:
        reasons.append("no robot was validated")
    return RunOutcome(_exit_code(counts, interrupted, bool(reasons)), ", ".join(reasons) or None)


def _exit_code(counts: Counter[str], interrupted: bool, failed: bool) -> int:
    if counts[ValidationVerdict.DISAGREES]:
        return EXIT_DISAGREES
    if interrupted:
        return EXIT_INTERRUPTED
    if counts[ValidationVerdict.BAD_INPUT]:
        return EXIT_BAD_INPUT
    return EXIT_NOT_VERIFIED if failed else 0


VALIDATION = DocumentKind(
    "urdfkin-validation/1",
    Document,
    tuple(OUTCOMES.values()),
    "urdfkin validate ROBOT --json FILE",
    is_open=True,
)


def outcome_of(document: Document) -> RunOutcome:
    verdicts = [robot["verdict"] for robot in document["robots"]]
    return outcome(verdicts, document["robots_requested"], document["interrupted"])
