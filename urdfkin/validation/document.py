"""Types of the JSON document of a validation. Its schema is generated from them."""

from __future__ import annotations

from typing import Annotated, Literal, NotRequired, TypedDict

from urdfkin.system.documents import Count, Header, Layout, Matrix, Sha256, Size, of_length, says
from urdfkin.validation.outcome import OUTCOMES, Outcome, outcome

#: A disagreement.
Units = Annotated[
    Size | None,
    says(
        "A disagreement in multiples of eps * scale. null: a result is NaN, or two values that must be equal "
        "differ."
    ),
]


class Limit(TypedDict):
    """Limits of a joint; null: no limit."""

    lower: Annotated[float | None, says("rad or m")]
    upper: Annotated[float | None, says("rad or m")]
    velocity: Annotated[float | None, says("rad/s or m/s")]
    effort: Annotated[float | None, says("N m or N")]


class Mimic(TypedDict):
    """Mimic rule: the joint's value is multiplier * (value of `leader`) + offset."""

    leader: Annotated[str, says("Name of the mimicked joint.")]
    multiplier: Annotated[float, says("Factor.")]
    offset: Annotated[float, says("rad or m")]


class Kept(TypedDict):
    """The part of a joint's range in which its mimic joints stay within their limits; null: no such part."""

    lower: Annotated[float | None, says("rad or m; null: no such part.")]
    upper: Annotated[float | None, says("rad or m")]
    by: Annotated[list[str], says("The mimic joints that narrow it.")]


class Joint(TypedDict):
    """A joint. Fixed joints are included."""

    name: Annotated[str, says("Name in the URDF.")]
    kind: Annotated[
        Literal["revolute", "continuous", "prismatic", "fixed", "planar", "floating"],
        says("Kind of the joint."),
    ]
    parent: Annotated[str, says("Parent link.")]
    child: Annotated[str, says("Child link. Its frame is the joint's frame after the joint motion.")]
    placement: Annotated[Matrix, says("Pose of the joint's frame in the parent link's frame at q = 0.")]
    axis: Annotated[
        Annotated[list[float], of_length(3)] | None,
        says("Unit axis in the joint's frame; null for kinds without an axis."),
    ]
    q: Annotated[
        int | None,
        says("Index of its first coordinate in q. A mimic joint has the index of its mimicked joint."),
    ]
    v: Annotated[int | None, says("Index of its first number in v and a.")]
    limit: Annotated[Limit | None, says("The joint's limits.")]
    mimic: Annotated[Mimic | None, says("The mimic rule; null for other joints.")]
    kept: Annotated[
        Kept | None,
        says(
            "The part of the joint's range in which its mimic joints stay within their limits. null: "
            "the whole range, or the joint has no mimic joints."
        ),
    ]


class Model(TypedDict):
    """Links and joints of the robot, in Pinocchio's order."""

    name: Annotated[str, says("The robot's name.")]
    source: Annotated[str, says("Source: a path, a catalogue name, - for standard input, or <text>.")]
    path: Annotated[str | None, says("Path of the file; null for a robot given as text.")]
    sha256: Annotated[Sha256, says("Digest of the URDF's text as UTF-8, or of the MJCF file.")]
    mimic: Annotated[bool | None, says("Whether mimic joints follow their rule; null: the default.")]
    root_joint: Annotated[
        Literal["floating", "planar"] | None, says("Kind of the joint above the root link; null: none.")
    ]
    nq: Annotated[Count, says("Number of coordinates (length of q).")]
    nv: Annotated[Count, says("Length of v and of a.")]
    base: Annotated[str, says("Default base frame of chains.")]
    tip: Annotated[str, says("Default tip frame.")]
    coordinates: Annotated[list[str], says("A name for each number of q.")]
    rates: Annotated[list[str], says("A name for each number of v and a.")]
    frames: Annotated[list[str], says("Every link and joint, under Pinocchio's names.")]
    links: Annotated[list[str], says("Every link; links[i + 1] is the child of joints[i].")]
    joints: Annotated[list[Joint], says("Every joint. A joint's parent link comes before its child link.")]


class Finding(TypedDict):
    """A finding in the URDF file, as `urdfkin check` reports it."""

    code: Annotated[str, says("Stable code; `urdfkin explain CODE` explains it.")]
    severity: Annotated[
        Literal["error", "warning", "note"], says("Severity. A file with an error is not compared.")
    ]
    message: Annotated[str, says("The problem.")]
    found: Annotated[str | None, says("The text in the file that causes the problem.")]
    remedy: Annotated[str | None, says("The remedy.")]
    file: Annotated[str, says("Name of the file.")]
    line: Annotated[Count, says("Counted from 1.")]
    column: Annotated[Count, says("Counted from 1.")]
    element: Annotated[str | None, says("Tag of the XML element.")]
    name: Annotated[str | None, says("The name of the link or joint.")]
    oracle: Annotated[
        Literal["refuses", "differs"] | None,
        says(
            "Pinocchio's behaviour if it differs from the specification: it refuses the file, or "
            "reads it differently."
        ),
    ]
    also: Annotated[list[int], says("Lines of further findings of the same kind, merged into this one.")]


class Row(TypedDict):
    """A row of a Denavit-Hartenberg table: the constant parts, metres and radians."""

    joint: Annotated[str, says("Name of the joint.")]
    kind: Annotated[Literal["revolute", "continuous", "prismatic"], says("Kind of the joint.")]
    a: Annotated[float, says("Translation along x.")]
    alpha: Annotated[float, says("Rotation about x.")]
    beta: Annotated[float, says("Rotation about y after alpha; 0 except in a Hayati row.")]
    d: Annotated[float, says("Translation along the axis. The value of a prismatic joint is added.")]
    theta: Annotated[float, says("Rotation about the axis. The value of a revolute joint is added.")]
    sense: Annotated[Literal[1, -1], says("Sign of the joint's value.")]


class Table(TypedDict):
    """A table in one convention."""

    rows: Annotated[list[Row], says("The rows from base to tip.")]
    base: Matrix
    tool: Matrix


class Chain(TypedDict):
    """A chain of the robot and its tables."""

    limb: Annotated[str | None, says("Name in the catalogue.")]
    base: Annotated[str, says("Base frame.")]
    tip: Annotated[str, says("Tip frame.")]
    standard: Table
    modified: Table
    samples: Annotated[
        Count,
        says("Number of configurations at which both tables were compared with Pinocchio; 0: not checked."),
    ]
    metres: Annotated[
        float | None, says("The largest distance between the tip of a table and Pinocchio's tip, metres.")
    ]
    worst: Annotated[
        Units,
        says(
            "The largest disagreement of the tip's placement, Jacobian and acceleration in eps * "
            "scale, for both tables; also null if not checked."
        ),
    ]
    share_of_bound: Annotated[float | None, says("The largest ratio of these disagreements to their bound.")]


class Errors(TypedDict):
    """Errors of one library with respect to values at fifty digits, in eps * scale."""

    worst: Annotated[float, says("The largest error.")]
    typical: Annotated[float, says("Root mean square of the errors.")]


class Judged(TypedDict):
    """Accuracy of one quantity in one reference frame."""

    quantity: Annotated[str, says("Name of the quantity: placement, velocity, ...")]
    reference: Annotated[
        Literal["local", "world", "local_world_aligned", "euler angles", "quaternion"] | None,
        says(
            "Reference frame, as in a check. For analytical Jacobians: the representation of the orientation."
        ),
    ]
    numbers: Annotated[Count, says("Number of compared values.")]
    urdfkin: Errors
    pinocchio: Errors


class Judgement(TypedDict):
    """Result of the accuracy study: errors of both libraries with respect to values at fifty digits."""

    robot: Annotated[str, says("The robot's name.")]
    samples: Annotated[Count, says("Number of configurations.")]
    seed: Annotated[int, says("Seed of the random samples.")]
    moving_base: Annotated[bool, says("Whether the root link moved.")]
    lines: Annotated[list[Judged], says("One line for each quantity and reference frame.")]


class Case(TypedDict):
    """The sample with the largest ratio of disagreement to bound."""

    sample: Annotated[
        Count,
        says("Index of the sample. 0, 1 and 2 are the neutral configuration and the two ends of the limits."),
    ]
    frame: Annotated[str, says("Name of the frame: link:NAME or joint:NAME.")]
    disagreement: Units
    q: Annotated[list[float], says("Configuration.")]
    v: Annotated[list[float], says("Joint velocities.")]
    a: Annotated[list[float], says("Joint accelerations.")]
    replay: Annotated[str, says("Command that computes the case again.")]


class Pair(TypedDict):
    """Comparison of one library with a second oracle."""

    failed: Annotated[Count, says("Number of results outside their bound.")]
    worst: Units
    share_of_bound: Annotated[
        float | None, says("The largest ratio of a disagreement to its bound; null as for a disagreement.")
    ]


class Alone(TypedDict):
    """Number of results in which one of the three differs and the two others agree."""

    urdfkin: Annotated[Count, says("Only urdfkin differs.")]
    pinocchio: Annotated[Count, says("Only Pinocchio differs.")]
    witness: Annotated[Count, says("Only the second oracle differs.")]


class Witness(TypedDict):
    """Comparison of the same results with a second oracle; missing without one."""

    by: Annotated[str, says("Name of the second oracle: mujoco.")]
    urdfkin: Pair
    pinocchio: Pair
    alone: Alone
    undecided: Annotated[Count, says("Number of results without a majority.")]


class Check(TypedDict):
    """Comparison of one quantity with Pinocchio in one reference frame."""

    quantity: Annotated[str, says("Name of the quantity: placement, velocity, jacobian, ...")]
    reference: Annotated[
        Literal["local", "world", "local_world_aligned"] | None,
        says("Reference frame, under Pinocchio's name; null for a placement."),
    ]
    results: Annotated[Count, says("Number of compared matrices or six-vectors.")]
    failed: Annotated[Count, says("Number of results outside their bound.")]
    median: Units
    p99: Units
    worst: Units
    share_of_bound: Annotated[
        float | None,
        says(
            "The largest ratio of a disagreement to its bound; above 1: a failure. null as for a "
            "disagreement."
        ),
    ]
    bound: Annotated[
        Annotated[list[float | None], of_length(2)],
        says("Tightest and widest bound in eps * scale; null if nothing was compared."),
    ]
    histogram: Annotated[
        list[Count],
        says(
            "Number of results in each bin: below the first of histogram_edges, between each two "
            "adjacent edges, above the last."
        ),
    ]
    subjects: Annotated[
        Literal["frames", "joints", "columns"],
        says(
            "The entries of worst_by_subject: the robot's frames, its joints, or the columns of the "
            "full Jacobian of all joints."
        ),
    ]
    worst_by_subject: Annotated[list[Units], says("The largest disagreement of each frame, joint or column.")]
    worst_case: Annotated[Case | None, says("The worst case; null if nothing was compared.")]
    witness: NotRequired[Witness]


class Timings(TypedDict):
    """Computing times in seconds, summed over processes."""

    read: Annotated[
        float, says("Reading the file, building both models and the tables; compiling, if needed.")
    ]
    urdfkin: Annotated[float, says("Computation with urdfkin.")]
    pinocchio: Annotated[float, says("Computation with Pinocchio.")]
    compare: Annotated[float, says("Bounds and comparison.")]
    witness: NotRequired[Annotated[float, says("Computation with a second oracle, if there is one.")]]


class SecondReading(TypedDict):
    """Comparison of the tree with that of a second reader of the same text."""

    by: Annotated[str, says("Name and version of the reader.")]
    joints: Annotated[Count, says("Number of compared joints, fixed joints included.")]
    differences: Annotated[list[str], says("Differences that are an error of one of the two readers.")]
    known: Annotated[list[str], says("Known faults of the reader that explain a difference.")]
    unread: Annotated[str | None, says("Why the reader cannot read the text; null if it can.")]


class Robot(TypedDict):
    """Report of one robot."""

    source: Annotated[str, says("Source: a path, a catalogue name, - for standard input, or <text>.")]
    name: Annotated[str, says("The robot's name in the URDF.")]
    verdict: Annotated[Literal["verified", "disagrees", "not verified", "bad input"], says("The verdict.")]
    reason: Annotated[str | None, says("Why the robot is not verified; null if it is.")]
    error: Annotated[str | None, says("Traceback of an unexpected error, for a bug report.")]
    joints: Annotated[list[str], says("Names of the moving joints, mimic joints included.")]
    frames: Annotated[list[str], says("Names of the compared links and joints.")]
    samples: Annotated[Count, says("Number of compared configurations, including the three special ones.")]
    results: Annotated[Count, says("Number of compared results.")]
    failed: Annotated[Count, says("Number of results outside their bound.")]
    seconds: Annotated[float, says("Computing time, seconds.")]
    timings: Annotated[Timings | None, says("Computing times of the parts.")]
    model: Annotated[Model | None, says("Links and joints; null if the file could not be read.")]
    findings: Annotated[list[Finding], says("Findings in the file.")]
    chains: Annotated[list[Chain], says("Chains with their Denavit-Hartenberg tables.")]
    second_reader: Annotated[
        SecondReading | None, says("Comparison with yourdfpy's tree of the same text; null if there is none.")
    ]
    checks: Annotated[list[Check], says("The comparisons.")]
    judge: Annotated[Judgement | None, says("With --judge: result of the accuracy study.")]


class Document(Header):
    """The output of `urdfkin validate --json`.

    Within a version, entries may be added. They are never removed and never change their meaning.
    """

    started: Annotated[str, says("Start time, ISO 8601, UTC.")]
    seconds: Annotated[float, says("Wall time in seconds. For a store: the sum over its chunks.")]
    seed: Annotated[int, says("Seed of the random samples.")]
    samples: Annotated[Count, says("Number of random configurations for each robot.")]
    histogram_edges: Annotated[list[float], says("Bin edges of all histograms, in eps * scale.")]
    asked: Annotated[Count, says("Number of requested robots.")]
    interrupted: Annotated[bool, says("Whether the run ended early, or the store is incomplete.")]
    reason: Annotated[str | None, says("Why the run has not passed, in one line; null if it has.")]
    robots: Annotated[list[Robot], says("The robots in the requested order.")]


#: The layout of the document. Entries may be added, but are never removed and never change their meaning.
VALIDATION = Layout(
    "urdfkin-validation/1",
    Document,
    tuple(OUTCOMES.values()),
    "urdfkin validate ROBOT --json FILE",
    is_open=True,
)


def outcome_of(document: Document) -> Outcome:
    """Return the outcome of the run, from the verdicts of its robots."""
    verdicts = [robot["verdict"] for robot in document["robots"]]
    return outcome(verdicts, document["asked"], document["interrupted"])
