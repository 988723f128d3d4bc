"""Read report documents, and check the layout and the consistency of all entries.

A user relies on a report, but somebody may have edited or truncated the file. This module computes the
outcome, the verdicts, the sums and the percentiles from the other entries. Each ratio must lie between bounds
that follow from other entries. The module reports every contradiction. The links and joints of a robot must
form a tree. Independent joints must have consecutive indices in q and v, in the order of the joints.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import islice, pairwise
from pathlib import Path

from urdfkin.errors import InputError
from urdfkin.report.words import check_name, worst
from urdfkin.system.documents import read_json
from urdfkin.validation.chunk import SPECIAL_SAMPLES
from urdfkin.validation.document import (
    VALIDATION,
    Chain,
    Document,
    ReportedCheck,
    ReportedJoint,
    ReportedModel,
    ReportedRobot,
    Units,
    ValidationVerdict,
    outcome_of,
)
from urdfkin.validation.error_stats import histogram_bin, percentile
from urdfkin.validation.robot_summary import chain_disagreement, reader_disagreement

_WITH_AXIS = ("revolute", "continuous", "prismatic")
#: Number of coordinates (nq) and of joint velocities (nv) of each kind of joint.
_COORDINATE_COUNTS = {"fixed": (0, 0), "planar": (3, 3), "floating": (7, 6)} | dict.fromkeys(
    _WITH_AXIS, (1, 1)
)
#: Tolerance of rotation matrices and unit axes. It is large, because a robot file may have only 6 digits.
_ROTATION_TOLERANCE = 1e-5


def frame_names(model: ReportedModel) -> list[str]:
    return [f"link:{name}" for name in model["links"]] + [f"joint:{j['name']}" for j in model["joints"]]


def moving_names(model: ReportedModel) -> list[str]:
    return [joint["name"] for joint in model["joints"] if joint["kind"] != "fixed"]


def column_names(model: ReportedModel) -> list[str]:
    """Return the joint name of each column, for Jacobians in which mimic joints have their own columns."""
    return [joint["name"] for joint in model["joints"] for _ in range(_COORDINATE_COUNTS[joint["kind"]][1])]


def model_contradictions(model: ReportedModel, chains: Sequence[Chain]) -> Iterator[str]:
    links, joints = model["links"], model["joints"]
    names = [joint["name"] for joint in joints]
    if len(set(links)) != len(links) or len(set(names)) != len(names):
        yield "`model`: a name occurs twice"
        return
    if links[1:] != [joint["child"] for joint in joints] or not links:
        yield "`links` of `model` must be the root link and the child link of each joint"
        return
    for i, joint in enumerate(joints):
        if joint["parent"] not in links[: i + 1]:
            yield (
                f"`model`: joint {joint['name']}: its parent link {joint['parent']} must come before"
                " the joint"
            )
        yield from _joint(joint, joints)
    yield from _check_coordinate_indices(model)
    frames = {*links, *names, *frame_names(model)}
    ends = [model["base"], model["tip"], *(end for chain in chains for end in (chain["base"], chain["tip"]))]
    yield from (f"`model`: there is no frame {end}" for end in ends if end not in frames)
    kinds = {joint["name"]: joint["kind"] for joint in joints}
    for chain in chains:
        for row in (*chain["standard"]["rows"], *chain["modified"]["rows"]):
            if kinds.get(row["joint"]) != row["kind"]:
                yield (
                    f"tables from {chain['base']} to {chain['tip']}: the model has no {row['kind']}"
                    f" joint {row['joint']}"
                )


def _joint(joint: ReportedJoint, joints: Sequence[ReportedJoint]) -> Iterator[str]:
    where, axis, mimic = f"`model`: joint {joint['name']}", joint["axis"], joint["mimic"]
    if (axis is not None) != (joint["kind"] in _WITH_AXIS):
        yield f"{where}: a {joint['kind']} joint must {'not ' if axis else ''}have an axis"
    elif axis is not None and abs(math.hypot(*axis) - 1.0) > _ROTATION_TOLERANCE:
        yield f"{where}: axis {axis} is not a unit vector"
    rows = joint["placement"]
    R = [row[:3] for row in rows[:3]]
    errors = [
        abs(sum(a * b for a, b in zip(R[i], R[j], strict=True)) - (i == j))
        for i in range(3)
        for j in range(i + 1)
    ]
    if rows[3] != [0.0, 0.0, 0.0, 1.0] or max(errors) > _ROTATION_TOLERANCE:
        yield f"{where}: its placement is not a rigid transform"
    if mimic is not None:
        mimicked_joint = next((other for other in joints if other["name"] == mimic["mimicked_joint"]), None)
        if (
            mimicked_joint is None
            or mimicked_joint["mimic"]
            or not {joint["kind"], mimicked_joint["kind"]} <= set(_WITH_AXIS)
        ):
            yield f"{where}: it cannot mimic {mimic['mimicked_joint']}"


def _check_coordinate_indices(model: ReportedModel) -> Iterator[str]:
    q, v, places = 0, 0, dict[str, tuple[int | None, int | None]]()
    for joint in model["joints"]:
        if joint["mimic"] is None:
            nq, nv = _COORDINATE_COUNTS[joint["kind"]]
            places[joint["name"]] = (q, v) if nq else (None, None)
            q, v = q + nq, v + nv
    for joint in model["joints"]:
        owner = joint["mimic"]["mimicked_joint"] if joint["mimic"] else joint["name"]
        if places.get(owner) != (joint["q"], joint["v"]):
            yield (
                f"`model`: joint {joint['name']}: wrong index in q or v: `q` is {joint['q']}, and `v` is"
                f" {joint['v']}"
            )
    if (model["nq"], model["nv"]) != (q, v) or (len(model["coordinates"]), len(model["rates"])) != (q, v):
        yield (
            "`model`: `nq`, `nv`, `coordinates` or `rates` is wrong:"
            f" the joints have {q} coordinates and {v} joint velocities"
        )


_TOLERANCE = 1e-9
#: Maximum number of results. A double represents all integers up to this number exactly.
_MAX_RESULTS = 2**53


def contradictions(document: Document) -> Iterator[str]:
    """Yield the contradictions in a document that conforms to the schema, each with its location."""
    edges, robots = document["histogram_edges"], document["robots"]
    if not edges or any(a >= b for a, b in pairwise(edges)):
        yield "`histogram_edges` are not in ascending order"
        return
    if document["robots_requested"] < len(robots):
        yield f"`robots_requested` is {document['robots_requested']}, but {len(robots)} robots have a report"
    found = outcome_of(document)
    if document["verdict"] != found.verdict:
        yield f"`verdict` is {document['verdict']}, but {found.reason or 'every robot was verified'}"
    if (document["reason"] is None) != found.passed:
        yield f"`reason` is {document['reason']}, but {found.reason or 'the run has passed'}"
    if missing := [name for name in ("urdfkin", "pin", "python") if name not in document["versions"]]:
        yield f"`versions` has no version of {missing[0]}"
    if document["command"] is None:
        yield "`command` is missing"
    if document["sha256"] != [robot["model"]["sha256"] if robot["model"] else None for robot in robots]:
        yield "`sha256` differs from the digests of the robots"
    for i, robot in enumerate(robots):
        for contradiction in _robot(robot, document):
            yield f"robots[{i}] ({robot['source']}): {contradiction}"


def _robot(robot: ReportedRobot, document: Document) -> Iterator[str]:
    if robot["model"] is not None:
        yield from model_contradictions(robot["model"], robot["chains"])
    elif robot["checks"] or robot["chains"]:
        yield "`model` is missing, but `checks` or `chains` is not empty"
        return
    sums = {
        "results": (robot["results"], sum(check["results"] for check in robot["checks"])),
        "failed": (robot["failed"], sum(check["failed"] for check in robot["checks"])),
    }
    for name, (value, expected) in sums.items():
        if value != expected:
            yield f"`{name}` is {value}, but the sum over the robot's checks is {expected}"
    yield from _verdict(robot, document["samples"] + SPECIAL_SAMPLES)
    names = [(check["quantity"], check["reference"]) for check in robot["checks"]]
    if len(set(names)) != len(names):
        yield "`checks`: a quantity occurs twice"
    subjects = _subjects(robot)
    if robot["checks"] and not (
        robot["joints"] == subjects["joints"] and robot["frames"] == subjects["frames"]
    ):
        yield "`joints` or `frames` differ from those of the model"
        return
    for check in robot["checks"]:
        own = subjects[check["subjects"]]
        for contradiction in _check(check, own, robot, document):
            yield f"{check_name(check)}: {contradiction}"
    for chain in robot["chains"]:
        figures = chain["metres"], chain["worst"], chain["bound_ratio"]
        if not chain["samples"] and any(figure is not None for figure in figures):
            ends = f"{chain['base']} to {chain['tip']}"
            yield f"tables from {ends}: `samples` is 0, but `metres`, `worst` or `bound_ratio` has a value"


def _subjects(robot: ReportedRobot) -> dict[str, list[str]]:
    model = robot["model"]
    if model is None:
        return {"frames": [], "joints": [], "columns": []}
    return {"frames": frame_names(model), "joints": moving_names(model), "columns": column_names(model)}


def _verdict(robot: ReportedRobot, samples: int) -> Iterator[str]:
    verdict, reason = ValidationVerdict(robot["verdict"]), robot["reason"]
    second_differs = any(
        check["second_oracle"]["urdfkin"]["failed"] for check in robot["checks"] if "second_oracle" in check
    )
    reading = robot["second_reader"]
    outside = (
        robot["failed"] > 0
        or second_differs
        or any(chain_disagreement(chain) for chain in robot["chains"])
        or (reading is not None and reader_disagreement(reading) is not None)
    )
    if outside != (verdict is ValidationVerdict.DISAGREES):
        yield (
            f"`verdict` is {verdict}, but {'something lies' if outside else 'nothing lies'} outside its bound"
        )
    if verdict is ValidationVerdict.VERIFIED:
        if not robot["results"]:
            yield "`verdict` is verified, but nothing was compared"
        if reason is not None:
            yield f"`verdict` is verified, but `reason` says {reason}"
        if robot["samples"] != samples:
            yield f"`verdict` is verified, but only {robot['samples']} of {samples} samples were compared"
    elif verdict is not ValidationVerdict.DISAGREES and not reason:
        yield f"`verdict` is {verdict}, but there is no `reason`"
    if robot["samples"] > samples:
        yield f"`samples` is {robot['samples']}, but {samples} samples were requested"


def _check(
    check: ReportedCheck, subjects: list[str], robot: ReportedRobot, document: Document
) -> Iterator[str]:
    results, histogram, edges = check["results"], check["histogram"], document["histogram_edges"]
    if results != robot["samples"] * len(subjects) or results > _MAX_RESULTS:
        yield (
            f"`results` is {results}, but there are {robot['samples']} samples of {len(subjects)}"
            f" {check['subjects']}"
        )
    if len(histogram) != len(edges) + 1 or sum(histogram) != results:
        yield (
            f"`histogram` has {sum(histogram)} results in {len(histogram)} bins, but must have {results}"
            f" results in {len(edges) + 1} bins"
        )
        return
    if len(check["worst_by_subject"]) != len(subjects):
        yield f"`worst_by_subject` must have one entry for each of {len(subjects)} {check['subjects']}"
        return
    if check["worst"] != worst(check["worst_by_subject"]):
        yield (
            f"`worst` is {check['worst']}, but the largest entry of `worst_by_subject` is"
            f" {worst(check['worst_by_subject'])}"
        )
    last = max((i for i, count in enumerate(histogram) if count), default=0)
    if results and last != histogram_bin(_none_as_infinity(check["worst"]), edges):
        yield (
            f"`worst` is {check['worst']}, but the last bin of `histogram` with results does not contain this"
            " value"
        )
    for name, percent, stated in (("median", 50.0, check["median"]), ("p99", 99.0, check["p99"])):
        computed = percentile(histogram, edges, _none_as_infinity(check["worst"]), percent)
        if not math.isclose(_none_as_infinity(stated), computed, rel_tol=_TOLERANCE):
            yield f"`{name}` is {stated}, but the histogram gives {computed:g}"
    yield from _check_bound_ratio(check)
    yield from _case(check, subjects, robot, document["samples"] + SPECIAL_SAMPLES)


def _check_bound_ratio(check: ReportedCheck) -> Iterator[str]:
    """Yield an error if `bound_ratio` contradicts the disagreements and bounds.

    `bound_ratio` must be at least `worst` / largest bound, and at most `worst` / smallest bound.
    """
    ratio, largest = _none_as_infinity(check["bound_ratio"]), _none_as_infinity(check["worst"])
    low, high = _none_as_infinity(check["bound"][0]), _none_as_infinity(check["bound"][1])
    if (ratio > 1.0) != (check["failed"] > 0) or check["failed"] > check["results"]:
        yield f"`failed` is {check['failed']} of {check['results']}, but `bound_ratio` is {ratio:g}"
    if low > high:
        # In a check without results, `bound[0]` is larger than `bound[1]`.
        if ratio or largest or check["worst_case"]:
            yield (
                f"`bound` is {check['bound']}, as in a check without results, but `worst`, `bound_ratio` or"
                " `worst_case` has a value"
            )
        return
    ends = (largest / high if high else math.inf, largest / low if low else math.inf)
    if not (ends[0] * (1.0 - _TOLERANCE) <= ratio <= ends[1] * (1.0 + _TOLERANCE)):
        yield f"`bound_ratio` is {ratio:g}, but `worst` is {largest:g} and `bound` is {low:g} to {high:g}"


def _case(check: ReportedCheck, subjects: list[str], robot: ReportedRobot, samples: int) -> Iterator[str]:
    case, model = check["worst_case"], robot["model"]
    if case is None:
        if check["worst"] != 0.0 or check["failed"]:
            yield (
                f"`worst_case` is missing, but `worst` is {check['worst']}, and `failed` is {check['failed']}"
            )
        return
    if case["frame"] not in subjects:
        yield f"`worst_case`: {case['frame']} is not one of the compared {check['subjects']}"
        return
    of_frame = worst(
        units
        for name, units in zip(subjects, check["worst_by_subject"], strict=True)
        if name == case["frame"]
    )
    if _none_as_infinity(case["disagreement"]) > _none_as_infinity(of_frame):
        yield (
            f"`worst_case` has {case['disagreement']} at {case['frame']}, but the worst disagreement at"
            f" {case['frame']} is {of_frame}"
        )
    ratio, units = _none_as_infinity(check["bound_ratio"]), _none_as_infinity(case["disagreement"])
    low, high = (ratio * (bound or 0.0) for bound in check["bound"])
    if math.isfinite(units) and not low * (1 - _TOLERANCE) <= units <= high * (1 + _TOLERANCE):
        yield f"`worst_case`: the disagreement {units:g} is not {ratio:g} times a bound"
    if model is not None and (len(case["q"]), len(case["v"]), len(case["a"])) != (
        model["nq"],
        model["nv"],
        model["nv"],
    ):
        yield "`worst_case`: the length of q, v or a differs from that of the robot"
    if case["sample"] >= samples:
        yield f"`worst_case`: there is no sample {case['sample']} among {samples} samples"


def _none_as_infinity(units: Units) -> float:
    return math.inf if units is None else units


_MAX_CONTRADICTIONS = 3


def read_document(path: Path) -> Document:
    return check_document(read_json(path), str(path))


def read_stored_document(folder: Path) -> Document:
    from urdfkin.validation.campaign import read_stored_report

    return check_document(read_stored_report(folder).as_dict(), str(folder))


def check_document(data: object, where: str) -> Document:
    document = VALIDATION.validate(data, where)
    if against := list(islice(contradictions(document), _MAX_CONTRADICTIONS + 1)):
        more = " ..." if len(against) > _MAX_CONTRADICTIONS else ""
        raise InputError(
            "the report contradicts itself",
            where=where,
            found="; ".join(against[:_MAX_CONTRADICTIONS]) + more,
            remedy=f"make the report again: {VALIDATION.command}",
        )
    return document
