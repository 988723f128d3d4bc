"""Reports for tests: runs on a few robots, a robot with hostile names, and failed runs."""

import copy
import json
import math
from functools import cache
from pathlib import Path
from typing import cast

from tests.reading import present
from tests.urdfs import joint, limit, robot
from urdfkin.validation.campaign import validate
from urdfkin.validation.document import Document, ReportedCheck
from urdfkin.validation.error_stats import HISTOGRAM_EDGES, percentile

#: Names that must not become an element, an attribute or a line of code.
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


def saved(path: Path, document: Document) -> Path:
    """Write a report to a file, and return the path."""
    path.write_text(json.dumps(document), encoding="utf-8")
    return path


def arms() -> Document:
    """Return a new copy of the report on two arms."""
    return cast("Document", json.loads(_run(("panda", "ur5"), 6)))


def hostile() -> Document:
    """Return the report on a robot with hostile names and on an arm."""
    document = cast("Document", json.loads(_run((HOSTILE_URDF, "ur5"), 4)))
    document["robots"][0]["source"] = HOSTILE_ROBOT  # a file may have this name
    return document


def failing() -> Document:
    """Return a report with three infinite errors of the Panda's local velocity, and with a wrong file."""
    document = arms()
    panda, ur5 = document["robots"]
    check = next(c for c in panda["checks"] if c["quantity"] == "velocity" and c["reference"] == "local")
    make_infinite(check, panda["frames"].index("joint:panda_joint4"), "joint:panda_joint4")
    panda |= {"verdict": "disagrees", "failed": 3, "reason": "3 of 8,000 results lie outside their bound"}
    broken = copy.deepcopy(ur5)
    broken |= {"source": "broken.urdf", "name": "broken.urdf", "verdict": "bad input", "model": None}
    broken |= {"reason": "broken.urdf: the URDF has an error\n  broken.urdf:3:1: URDF502", "checks": []}
    broken |= {"joints": [], "frames": [], "chains": [], "results": 0, "timings": None}
    document["robots"].append(broken)
    document["sha256"].append(None)
    document |= {"robots_requested": 3, "verdict": "disagrees"}
    document["reason"] = "1 of 3 robots disagrees, 1 of 3 robots has bad input"
    return document


def make_infinite(check: ReportedCheck, index: int, frame: str) -> None:
    """Change all entries of a check so that three results of a frame are not finite."""
    fullest = max(range(len(check["histogram"])), key=check["histogram"].__getitem__)
    check["histogram"][fullest] -= 3
    check["histogram"][-1] += 3
    check["worst_by_subject"][index] = None
    edges, case = HISTOGRAM_EDGES.tolist(), present(check["worst_case"])
    case |= {"frame": frame, "disagreement": None}
    check |= {"failed": 3, "worst": None, "bound_ratio": None}
    check["median"], check["p99"] = (percentile(check["histogram"], edges, math.inf, x) for x in (50.0, 99.0))


def run_on(day: int, document: Document) -> Document:
    """Return the document with a start on a day of November."""
    return document | {"started": f"2026-11-{day:02}T08:00:00+00:00", "seconds": float(day)}


def months_runs() -> list[Document]:
    """Return eight reports on two arms, with a temporary warning, a disagreement and a changed axis."""
    runs = [run_on(day, arms()) for day in range(1, 9)]
    for document in runs[2:4]:
        finding = copy.deepcopy(document["robots"][0]["findings"][0])
        document["robots"][0]["findings"].append(finding | {"severity": "warning", "code": "URDF305"})
    runs[4] = run_on(5, failing())
    for document in runs[5:]:
        model = present(document["robots"][1]["model"])
        model["joints"][2]["axis"] = [-x for x in model["joints"][2]["axis"] or ()]
        model["sha256"] = document["sha256"][1] = "0" * 64
        document["versions"] = document["versions"] | {"pin": "4.2.0"}
    return runs
