"""All known changes on all robots: is the verdict right, and does the interval hold the truth?

    python scripts/check_same.py --keep pairs.jsonl          # goes on where it was ended
    python scripts/check_same.py --keep pairs.jsonl panda    # of some robots alone
    python scripts/check_same.py --keep pairs.jsonl --tell   # the figures of docs/same.md, nothing computed

Twenty-one changes, eleven of which leave a robot the same (`tests/comparison/pairs.py`). Where it stays the
same, all links are placed at random configurations as `same` says they must be. Where it does not, a global
search of another kind than the product's looks for the largest distance of the frame that is said to be
farthest, and computes it at fifty digits from the decimals of both texts: it must lie in the interval. Exit
1 where it does not, or a verdict is wrong.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import sys
import time
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))  # run from a checkout that is not installed

import urdfkin
from tests.comparison.pairs import ALIKE, UNLIKE, changed, robot
from tests.comparison.searching import far, searched
from urdfkin.comparison.result import Interval, Sameness, Verdict
from urdfkin.robot import Robot
from urdfkin.urdf.catalogue import catalogue

#: What doubles may be off by, metres and entries of rotations, at configurations of some metres.
ROUNDING = 1e-10


def pair(name: str, what: str) -> dict[str, Any] | None:
    """One robot and one change; None where there is nothing to change."""
    a, b = robot(name), changed(name, what)
    if b is None:
        return None
    began = time.process_time()
    found = urdfkin.same(a, b, bounds=what in UNLIKE)
    seconds = round(time.process_time() - began, 2)
    said = {"robot": name, "change": what, "verdict": found.verdict.value, "seconds": seconds}
    if what in ALIKE:
        return said | {"right": bool(found) and _places_agree(found, a, b)}
    # A file that is rounded to four digits may be what it was; the interval tells all the same.
    right = found.verdict is Verdict.DIFFERS or what == "rounded"
    if (worst := _farthest(found)) is None:
        return said | {"right": right}
    return said | _enclosed(found, a, b, worst) | {"right": right}


def _farthest(found: Sameness) -> Interval | None:
    """The frame that may be farthest, of those that are not another tool; None where nothing bounds it."""
    frames = [frame for frame in found.frames if frame.frame_b not in _tools(found) and frame.q_a]
    worst = max(frames, key=lambda frame: (frame.upper, frame.lower), default=None)
    stands = np.array_equal(found.base, np.eye(4))
    return worst if worst is not None and math.isfinite(worst.upper) and stands else None


def _tools(found: Sameness) -> set[str]:
    """Frames of B that are said to be set elsewhere on their bodies."""
    return {line.split()[1] for line in found.after if line.startswith("frame ")}


def _enclosed(found: Sameness, a: Robot, b: Robot, worst: Interval) -> dict[str, Any]:
    attained = far(a, b, np.array(worst.q_a), np.array(worst.q_b), worst)
    truth = max(attained, searched(a, b, found.to_b, worst))
    return {
        "frame": worst.frame,
        "lower": worst.lower,
        "upper": worst.upper,
        "truth": truth,
        "holds": worst.lower <= attained and truth <= worst.upper,
    }


def _places_agree(found: Sameness, a: Robot, b: Robot) -> bool:
    """Whether all links of both stand alike at random configurations, and at B's for them."""
    q, base = a.sample(5, 1), f"link:{found.base_links[1]}"
    links = [pair for pair in found.links if pair[1] not in _tools(found)]
    T_a = a.placement(q, [f"link:{ours}" for ours, _ in links])
    T_b = b.placement(found.to_b(q), [base, *(f"link:{theirs}" for _, theirs in links)])
    home = found.base @ b.placement(b.neutral(), base)
    return bool(np.abs(T_a - home @ np.linalg.inv(T_b[:, :1]) @ T_b[:, 1:]).max(initial=0.0) <= ROUNDING)


def told(some: list[dict[str, Any]]) -> Iterator[str]:
    """The figures."""
    wrong = [one for one in some if not one["right"]]
    bounded = [one for one in some if "holds" in one]
    missed = [one for one in bounded if not one["holds"]]
    robots = len({one["robot"] for one in some})
    yield f"{len(some) - len(wrong)} of {len(some)} verdicts right, {robots} robots"
    yield f"{len(bounded) - len(missed)} of {len(bounded)} intervals hold what the search finds"
    for what in UNLIKE:
        widths = [one["upper"] / one["truth"] for one in bounded if one["change"] == what and one["truth"]]
        found = [one["lower"] / one["truth"] for one in bounded if one["change"] == what and one["truth"]]
        if widths:
            above = f"{statistics.median(widths) - 1:.1%} (median), {max(widths) - 1:.1%} (most)"
            below = f"{1 - min(found):.1%}"
            yield f"{what}: {len(widths)}; at most is above the search's by {above}, at least {below} below"
    seconds = [one["seconds"] for one in some if one["change"] in UNLIKE]
    if seconds:
        yield f"seconds with bounds: median {statistics.median(seconds):.1f}, most {max(seconds):.1f}"
    yield from (f"WRONG: {json.dumps(one)}" for one in (*wrong, *missed))


def main() -> int:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("robots", nargs="*", help="of the catalogue; all where none is named")
    parser.add_argument("--keep", type=Path, required=True, help="a file of results, a line each")
    parser.add_argument("--tell", action="store_true", help="tell what it has, and compute nothing")
    options = parser.parse_args()
    warnings.simplefilter("ignore", urdfkin.UrdfWarning)
    lines = options.keep.read_text().splitlines() if options.keep.exists() else []
    some = [json.loads(line) for line in lines]
    there = {(one["robot"], one["change"]) for one in some}
    for name in [] if options.tell else options.robots or sorted(catalogue()):
        for what in (*ALIKE, *UNLIKE):
            if (name, what) in there or (one := pair(name, what)) is None:
                continue
            some.append(one)
            with options.keep.open("a") as file:
                file.write(json.dumps(one) + "\n")
    print(*told([one for one in some if not options.robots or one["robot"] in options.robots]), sep="\n")
    return int(any(not one["right"] or not one.get("holds", True) for one in some))


if __name__ == "__main__":
    sys.exit(main())
