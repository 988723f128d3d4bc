"""Types and schema of the JSON document of a validation."""

from __future__ import annotations

import json
from functools import cache
from importlib import resources
from typing import Any, Literal, NotRequired, TypedDict, cast

from urdfkin.validation.outcome import Outcome, outcome

#: A disagreement in eps * scale. None: a result is NaN, or two values that must be equal differ.
Units = float | None
Verdict = Literal["verified", "disagrees", "not verified", "bad input"]


class Limit(TypedDict):
    """Limits of a joint."""

    lower: float | None
    upper: float | None
    velocity: float | None
    effort: float | None


class Mimic(TypedDict):
    """Mimic rule of a joint: multiplier * (value of the mimicked joint) + offset."""

    leader: str
    multiplier: float
    offset: float


class Kept(TypedDict):
    """The part of a joint's range in which its mimic joints stay within their limits; None: no such part."""

    lower: float | None
    upper: float | None
    by: list[str]


class Joint(TypedDict):
    """A joint. Fixed joints are included."""

    name: str
    kind: str
    parent: str
    child: str
    placement: list[list[float]]
    axis: list[float] | None
    q: int | None
    v: int | None
    limit: Limit | None
    mimic: Mimic | None
    kept: NotRequired[Kept | None]


class Model(TypedDict):
    """The links and joints of a robot."""

    name: str
    source: str
    mimic: bool | None
    root_joint: str | None
    nq: int
    nv: int
    base: str
    tip: str
    coordinates: list[str]
    rates: list[str]
    frames: list[str]
    links: list[str]
    joints: list[Joint]


class Finding(TypedDict):
    """A finding in the URDF file."""

    code: str
    severity: Literal["error", "warning", "note"]
    message: str
    found: str | None
    remedy: str | None
    file: str
    line: int
    column: int
    element: str | None
    name: str | None
    oracle: str | None
    also: list[int]


class Row(TypedDict):
    """A row of a Denavit-Hartenberg table."""

    joint: str
    kind: str
    a: float
    alpha: float
    beta: float
    d: float
    theta: float
    sense: int


class Table(TypedDict):
    """A table in one convention."""

    rows: list[Row]
    base: list[list[float]]
    tool: list[list[float]]


class Chain(TypedDict):
    """A chain and its tables."""

    limb: str | None
    base: str
    tip: str
    standard: Table
    modified: Table
    samples: int
    metres: float | None
    worst: Units
    share_of_bound: Units


class Errors(TypedDict):
    """Errors of one library with respect to the values at fifty digits."""

    worst: float
    typical: float


class Judged(TypedDict):
    """Accuracy of one quantity in one reference frame."""

    quantity: str
    reference: str | None
    numbers: int
    urdfkin: Errors
    pinocchio: Errors


class Judgement(TypedDict):
    """Result of the accuracy study: errors with respect to values at fifty digits."""

    robot: str
    samples: int
    seed: int
    moving_base: NotRequired[bool]
    lines: list[Judged]


class Case(TypedDict):
    """The sample with the largest ratio to its bound."""

    sample: int
    frame: str
    disagreement: Units
    q: list[float]
    v: list[float]
    a: list[float]
    replay: str


class Pair(TypedDict):
    """Comparison of one library with a second oracle."""

    failed: int
    worst: Units
    share_of_bound: Units


class Alone(TypedDict):
    """Number of results in which one library differs and the two others agree."""

    urdfkin: int
    pinocchio: int
    witness: int


class Witness(TypedDict):
    """Comparison with a second oracle."""

    by: str
    urdfkin: Pair
    pinocchio: Pair
    alone: Alone
    undecided: int


class Check(TypedDict):
    """Comparison of one quantity in one reference frame."""

    quantity: str
    reference: str | None
    results: int
    failed: int
    median: Units
    p99: Units
    worst: Units
    share_of_bound: Units
    bound: list[float | None]
    histogram: list[int]
    subjects: Literal["frames", "joints", "columns"]
    worst_by_subject: list[Units]
    worst_case: Case | None
    witness: NotRequired[Witness]


class SecondReading(TypedDict):
    """Comparison of the tree with that of a second reader of the same text."""

    by: str
    joints: int
    differences: list[str]
    known: list[str]
    unread: str | None


class Timings(TypedDict):
    """Computing times in seconds, summed over processes."""

    read: float
    urdfkin: float
    pinocchio: float
    compare: float
    witness: NotRequired[float]


class Robot(TypedDict):
    """Report of one robot."""

    source: str
    name: str
    verdict: Verdict
    reason: str | None
    error: NotRequired[str | None]
    joints: list[str]
    frames: list[str]
    samples: int
    results: int
    failed: int
    seconds: float
    timings: Timings | None
    model: Model | None
    findings: list[Finding]
    chains: list[Chain]
    second_reader: NotRequired[SecondReading | None]
    checks: list[Check]
    judge: Judgement | None


class Document(TypedDict):
    """The whole document."""

    schema: str
    versions: dict[str, str]
    started: str
    seconds: float
    seed: int
    samples: int
    histogram_edges: list[float]
    asked: NotRequired[int]
    interrupted: bool
    passed: bool
    reason: NotRequired[str | None]
    command: str
    robots: list[Robot]


def outcome_of(document: Document) -> Outcome:
    """Return the outcome of the run, from the verdicts of its robots."""
    verdicts = [robot["verdict"] for robot in document["robots"]]
    return outcome(verdicts, document.get("asked", len(verdicts)), document["interrupted"])


def asset(name: str) -> str:
    """Return the text of a file in `urdfkin/report/assets`."""
    return resources.files("urdfkin.report").joinpath("assets", name).read_text(encoding="utf-8")


@cache
def schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of the document."""
    return cast("dict[str, Any]", json.loads(asset("validation-1.schema.json")))
