"""Reports to test with: real runs on a few robots, one of them hostile, and runs that went wrong."""

import copy
import json
import math
from functools import cache
from typing import cast

from tests.urdfs import joint, limit, robot
from urdfkin.validation.campaign import validate
from urdfkin.validation.document import Document, ReportedCheck
from urdfkin.validation.error_stats import HISTOGRAM_EDGES, percentile

#: What must never become an element, an attribute or a line of code.
HOSTILE_ROBOT = "<script>window.hacked=1</script>"
HOSTILE_JOINT = "j\"'><img src=x onerror=window.hacked=1>"
HOSTILE_LINK = "</script><script>window.hacked=1</script>&amp;{{7*7}}`|*\u2028"

HOSTILE_URDF = robot(
    joint(HOSTILE_JOINT, "revolute", "base", HOSTILE_LINK, 'xyz="0 0 0.4"', "0 1 0", limit()),
    joint("slide", "prismatic", HOSTILE_LINK, "tip", 'xyz="0.3 0 0"', "1 0 0", limit(0, 0.5)),
    name=HOSTILE_ROBOT,
)


@cache
def _run(robots: tuple[str, ...], samples: int) -> str:
    return json.dumps(validate([*robots], samples=samples).as_dict(), allow_nan=False)


def arms() -> Document:
    """A run over two arms; a fresh copy each time."""
    return cast("Document", json.loads(_run(("panda", "ur5"), 6)))


def hostile() -> Document:
    """A run over a robot whose names are attacks, and one that is sane."""
    document = cast("Document", json.loads(_run((HOSTILE_URDF, "ur5"), 4)))
    document["robots"][0]["source"] = HOSTILE_ROBOT  # a file may be called so
    return document


def failing() -> Document:
    """A run in which the Panda's local velocity disagrees, once beyond numbers, and a file was no URDF."""
    document = arms()
    panda, ur5 = document["robots"]
    check = next(c for c in panda["checks"] if c["quantity"] == "velocity" and c["reference"] == "local")
    beyond_numbers(check, panda["frames"].index("joint:panda_joint4"), "joint:panda_joint4")
    panda |= {"verdict": "disagrees", "failed": 3, "reason": "3 of 8,000 results lie outside their bound"}
    broken = copy.deepcopy(ur5)
    broken |= {"source": "broken.urdf", "name": "broken.urdf", "verdict": "bad input", "model": None}
    broken |= {"reason": "broken.urdf: the URDF has an error\n  broken.urdf:3:1: URDF502", "checks": []}
    broken |= {"joints": [], "frames": [], "chains": [], "results": 0, "timings": None}
    document["robots"].append(broken)
    document["sha256"].append(None)
    document |= {"asked": 3, "verdict": "disagrees"}
    document["reason"] = "1 of 3 robots disagrees, 1 of 3 robots has bad input"
    return document


def beyond_numbers(check: ReportedCheck, place: int, frame: str) -> None:
    """Three results of a frame are no numbers, in all entries that tell."""
    often = max(range(len(check["histogram"])), key=check["histogram"].__getitem__)
    check["histogram"][often] -= 3
    check["histogram"][-1] += 3
    check["worst_by_subject"][place] = None
    edges, case = HISTOGRAM_EDGES.tolist(), check["worst_case"]
    assert case is not None
    case |= {"frame": frame, "disagreement": None}
    check |= {"failed": 3, "worst": None, "share_of_bound": None}
    check["median"], check["p99"] = (percentile(check["histogram"], edges, math.inf, x) for x in (50.0, 99.0))


def run_on(day: int, document: Document) -> Document:
    """The document as a run on a day of November."""
    return document | {"started": f"2026-11-{day:02}T08:00:00+00:00", "seconds": float(day)}


def months_runs() -> list[Document]:
    """Eight runs of two arms: a warning that comes and goes, a disagreement, a changed axis."""
    runs = [run_on(day, arms()) for day in range(1, 9)]
    for document in runs[2:4]:
        finding = copy.deepcopy(document["robots"][0]["findings"][0])
        document["robots"][0]["findings"].append(finding | {"severity": "warning", "code": "URDF305"})
    runs[4] = run_on(5, failing())
    for document in runs[5:]:
        model = document["robots"][1]["model"]
        assert model is not None
        model["joints"][2]["axis"] = [-x for x in model["joints"][2]["axis"] or ()]
        model["sha256"] = document["sha256"][1] = "0" * 64
        document["versions"] = document["versions"] | {"pin": "4.2.0"}
    return runs
