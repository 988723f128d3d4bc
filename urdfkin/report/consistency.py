"""Whether a report agrees with itself: what is said twice is the same, what is counted adds up.

A report is evidence, and may have been edited, cut short or put together by hand. Whatever follows from
other entries is computed again here, the outcome first of all; the robot itself is looked at by
`urdfkin.report.model_consistency`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

from urdfkin.report.document import Chain, Check, Document, Robot, Units, outcome_of
from urdfkin.report.model_consistency import column_names, frame_names, model_contradictions, moving_names
from urdfkin.report.words import check_name, worst
from urdfkin.validation.chunk import SPECIAL
from urdfkin.validation.outcome import Verdict
from urdfkin.validation.portrait import chain_disagreement
from urdfkin.validation.tally import histogram_bin, percentile

#: Figures that are quotients are computed again to this relative difference.
_ALIKE = 1e-9
#: Counts beyond this are nobody's.
_MOST = 2**53


def contradictions(document: Document) -> Iterator[str]:
    """What a document that fits the schema says against itself, each with its place."""
    edges, robots = document["histogram_edges"], document["robots"]
    if not edges or any(a >= b for a, b in pairwise(edges)):
        yield "histogram_edges: not in ascending order"
        return
    if document.get("asked", len(robots)) < len(robots):
        yield f"asked: {document.get('asked')}, but {len(robots)} robots are reported on"
    found = outcome_of(document)
    if document["passed"] != found.passed:
        yield f"passed: {document['passed']}, but {found.reason or 'every robot was verified'}"
    if "reason" in document and (document["reason"] is None) != found.passed:
        yield f"reason: {document['reason']}, but {found.reason or 'the run has passed'}"
    for i, robot in enumerate(robots):
        for contradiction in _robot(robot, document):
            yield f"robots[{i}] ({robot['source']}): {contradiction}"


def _robot(robot: Robot, document: Document) -> Iterator[str]:
    if robot["model"] is not None:
        yield from model_contradictions(robot["model"], robot["chains"])
    elif robot["checks"] or robot["chains"]:
        yield "model: none, but something was compared"
        return
    for what in ("results", "failed"):
        counted = sum(check["results" if what == "results" else "failed"] for check in robot["checks"])
        if robot["results" if what == "results" else "failed"] != counted:
            yield f"{what}: not the {counted} of its checks"
    yield from _verdict(robot, document["samples"] + SPECIAL)
    names = [(check["quantity"], check["reference"]) for check in robot["checks"]]
    if len(set(names)) != len(names):
        yield "checks: a quantity is there twice"
    subjects = _subjects(robot)
    if robot["checks"] and not (
        robot["joints"] == subjects["joints"] and robot["frames"] == subjects["frames"]
    ):
        yield "joints or frames: not the model's"
        return
    for check in robot["checks"]:
        own = subjects[check["subjects"]]
        for contradiction in _check(check, own, robot, document):
            yield f"{check_name(check)}: {contradiction}"
    for chain in robot["chains"]:
        for contradiction in _chain(chain):
            yield f"tables from {chain['base']} to {chain['tip']}: {contradiction}"


def _subjects(robot: Robot) -> dict[str, list[str]]:
    model = robot["model"]
    if model is None:
        return {"frames": [], "joints": [], "columns": []}
    return {"frames": frame_names(model), "joints": moving_names(model), "columns": column_names(model)}


def _verdict(robot: Robot, samples: int) -> Iterator[str]:
    """The verdict follows from what was compared; what is not verified needs a reason."""
    verdict, reason = Verdict(robot["verdict"]), robot["reason"]
    witnessed = any(check["witness"]["urdfkin"]["failed"] for check in robot["checks"] if "witness" in check)
    outside = robot["failed"] > 0 or witnessed or any(chain_disagreement(chain) for chain in robot["chains"])
    if outside != (verdict is Verdict.DISAGREES):
        yield f"verdict: {verdict}, but {'something lies' if outside else 'nothing lies'} outside its bound"
    if verdict is Verdict.VERIFIED:
        if not robot["results"]:
            yield "verdict: verified, but nothing was compared"
        if reason is not None:
            yield f"verdict: verified, but the reason says {reason}"
        if robot["samples"] != samples:
            yield f"verdict: verified, but on {robot['samples']} of {samples} samples"
    elif verdict is not Verdict.DISAGREES and not reason:
        yield f"verdict: {verdict}, but no reason"
    if robot["samples"] > samples:
        yield f"samples: {robot['samples']}, but {samples} were asked for"


def _check(check: Check, subjects: list[str], robot: Robot, document: Document) -> Iterator[str]:
    results, histogram, edges = check["results"], check["histogram"], document["histogram_edges"]
    if results != robot["samples"] * len(subjects) or results > _MOST:
        yield f"results: {results}, but {robot['samples']} samples of {len(subjects)} {check['subjects']}"
    if len(histogram) != len(edges) + 1 or sum(histogram) != results:
        yield f"histogram: not of {results} results between its edges"
        return
    if len(check["worst_by_subject"]) != len(subjects):
        yield f"worst_by_subject: not one for each of {len(subjects)} {check['subjects']}"
        return
    if check["worst"] != worst(check["worst_by_subject"]):
        yield f"worst: {check['worst']}, but {worst(check['worst_by_subject'])} by {check['subjects']}"
    last = max((i for i, count in enumerate(histogram) if count), default=0)
    if results and last != histogram_bin(_number(check["worst"]), edges):
        yield f"worst: {check['worst']}, but the histogram ends elsewhere"
    for name, percent, said in (("median", 50.0, check["median"]), ("p99", 99.0, check["p99"])):
        computed = percentile(histogram, edges, _number(check["worst"]), percent)
        if not _alike(_number(said), computed):
            yield f"{name}: {said}, but {computed:g} by the histogram"
    yield from _share(check)
    yield from _case(check, subjects, robot, document["samples"] + SPECIAL)


def _share(check: Check) -> Iterator[str]:
    """The largest share of a bound lies between the worst over the widest and over the tightest."""
    share, largest = _number(check["share_of_bound"]), _number(check["worst"])
    low, high = _number(check["bound"][0]), _number(check["bound"][1])
    if (share > 1.0) != (check["failed"] > 0) or check["failed"] > check["results"]:
        yield f"failed: {check['failed']} of {check['results']}, but the largest share is {share:g}"
    if low > high:
        if share or largest or check["worst_case"]:  # no numbers to compare: no bound
            yield f"bound: {check['bound']}, but something was compared"
        return
    ends = (largest / high if high else math.inf, largest / low if low else math.inf)
    if not (ends[0] * (1.0 - _ALIKE) <= share <= ends[1] * (1.0 + _ALIKE)):
        yield f"share_of_bound: {share:g}, but the worst is {largest:g} and the bound {low:g} to {high:g}"


def _case(check: Check, subjects: list[str], robot: Robot, samples: int) -> Iterator[str]:
    case, model = check["worst_case"], robot["model"]
    if case is None:
        if check["worst"] != 0.0 or check["failed"]:
            yield "worst_case: none, but something disagrees"
        return
    if case["frame"] not in subjects:
        yield f"worst_case: {case['frame']} is none of its {check['subjects']}"
        return
    of_frame = worst(
        units
        for name, units in zip(subjects, check["worst_by_subject"], strict=True)
        if name == case["frame"]
    )
    if _number(case["disagreement"]) > _number(of_frame):
        yield f"worst_case: {case['disagreement']} at {case['frame']}, but at most {of_frame} there"
    share, low, high = _number(check["share_of_bound"]), check["bound"][0] or 0.0, check["bound"][1] or 0.0
    units = _number(case["disagreement"])
    if math.isfinite(units) and not share * low * (1 - _ALIKE) <= units <= share * high * (1 + _ALIKE):
        yield f"worst_case: {units:g} is not {share:g} of its bound"
    if model is not None and (len(case["q"]), len(case["v"]), len(case["a"])) != (
        model["nq"],
        model["nv"],
        model["nv"],
    ):
        yield "worst_case: q, v or a has another length than the robot's"
    if case["sample"] >= samples:
        yield f"worst_case: sample {case['sample']} of {samples}"


def _chain(chain: Chain) -> Iterator[str]:
    figures = chain["metres"], chain["worst"], chain["share_of_bound"]
    if not chain["samples"] and any(figure is not None for figure in figures):
        yield "not compared, but with figures"


def _number(units: Units) -> float:
    return math.inf if units is None else units


def _alike(a: float, b: float) -> bool:
    return a == b or math.isclose(a, b, rel_tol=_ALIKE)
