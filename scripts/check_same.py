"""Check the verdicts and the distance intervals of `urdfkin same` for changed robots of the catalogue.

    python scripts/check_same.py --keep pairs.jsonl          # continues a stopped run
    python scripts/check_same.py --keep pairs.jsonl panda    # only some robots

`tests/comparison/pairs.py` defines twenty-one changes of a robot. Eleven changes leave the robot the same.
After such a change, all links must have the poses that `same` predicts, at random configurations. After any
other change, the robot differs from the original. The change `rounded` is an exception: it rounds numbers
to four digits, and leaves some robots unchanged. An independent global
search then looks for the largest distance between a frame of the robot and the corresponding frame of the
changed robot. The script computes this distance with fifty digits from the decimal numbers in the two URDF
texts. The distance must lie in the interval of `same`. Exit 1: a distance is outside its interval, or a
verdict is wrong.
"""

import argparse
import json
import math
import statistics
import sys
import time
import warnings
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

import urdfkin
from tests.comparison.pairs import ALIKE, UNLIKE, changed, moves_alike, robot
from tests.comparison.searching import far, searched
from urdfkin.comparison.result import Verdict
from urdfkin.urdf.catalogue import catalogue

#: Maximum rounding error of a placement: of its position in metres, and of an entry of its rotation matrix.
ROUNDING = 1e-10


def check_pair(name: str, what: str) -> dict[str, Any] | None:
    """Check one change of one robot; return None if the change is impossible."""
    a, b = robot(name), changed(name, what)
    if b is None:
        return None
    began = time.process_time()
    found = urdfkin.same(a, b, bounds=what in UNLIKE)
    seconds = round(time.process_time() - began, 2)
    result = {"robot": name, "change": what, "verdict": found.verdict.value, "seconds": seconds}
    if what in ALIKE:
        return result | {"right": bool(found) and moves_alike(found, a, b, ROUNDING)}
    # Rounding to four digits leaves some files unchanged. Every verdict is then accepted.
    result["right"] = found.verdict is Verdict.DIFFERS or what == "rounded"
    tools = {tool.b for tool in found.tools}
    frames = [frame for frame in found.frames if frame.frame_b not in tools and frame.q_a]
    worst = max(frames, key=lambda frame: (frame.upper, frame.lower), default=None)
    if worst is None or not math.isfinite(worst.upper) or not np.array_equal(found.base, np.eye(4)):
        return result
    attained = far(a, b, np.array(worst.q_a), np.array(worst.q_b), worst)
    truth = max(attained, searched(a, b, found.to_b, worst))
    result |= {"frame": worst.frame, "lower": worst.lower, "upper": worst.upper, "truth": truth}
    return result | {"holds": worst.lower <= attained and truth <= worst.upper}


def summarize(some: list[dict[str, Any]]) -> Iterator[str]:
    wrong = [one for one in some if not one["right"]]
    bounded = [one for one in some if "holds" in one]
    missed = [one for one in bounded if not one["holds"]]
    robots = len({one["robot"] for one in some})
    yield f"{len(some) - len(wrong)} of {len(some)} verdicts right, {robots} robots"
    yield f"{len(bounded) - len(missed)} of {len(bounded)} intervals contain the result of the search"
    for what in UNLIKE:
        widths = [one["upper"] / one["truth"] for one in bounded if one["change"] == what and one["truth"]]
        found = [one["lower"] / one["truth"] for one in bounded if one["change"] == what and one["truth"]]
        if widths:
            above = f"{statistics.median(widths) - 1:.1%} (median), {max(widths) - 1:.1%} (largest)"
            yield f"{what}: {len(widths)}; the upper bound is {above} above the result of the search,"
            yield f"  the lower bound at most {1 - min(found):.1%} below"
    seconds = [one["seconds"] for one in some if one["change"] in UNLIKE]
    if seconds:
        yield f"seconds with bounds: median {statistics.median(seconds):.1f}, largest {max(seconds):.1f}"
    yield from (f"WRONG: {json.dumps(one)}" for one in (*wrong, *missed))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("robots", nargs="*", help="names of robots in the catalogue (default: all robots)")
    parser.add_argument("--keep", type=Path, required=True, help="file for the results, one per line")
    options = parser.parse_args()
    warnings.simplefilter("ignore", urdfkin.UrdfWarning)
    lines = options.keep.read_text().splitlines() if options.keep.exists() else []
    some = [json.loads(line) for line in lines]
    known = {(one["robot"], one["change"]) for one in some}
    for name, what in product(options.robots or sorted(catalogue()), (*ALIKE, *UNLIKE)):
        if (name, what) not in known and (one := check_pair(name, what)) is not None:
            some.append(one)
            with options.keep.open("a") as file:
                print(json.dumps(one), file=file)
    print(*summarize([one for one in some if not options.robots or one["robot"] in options.robots]), sep="\n")
    sys.exit(any(not one["right"] or not one.get("holds", True) for one in some))
