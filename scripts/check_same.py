"""Check the verdicts and the distance intervals of `urdfkin same` for changed robots of the catalogue.

    python scripts/check_same.py --keep pairs.jsonl          # continues a stopped run
    python scripts/check_same.py --keep pairs.jsonl panda    # only some robots

`tests/comparison/pairs.py` defines twenty-one changes of a robot. The script makes each change alone, in a
copy of the robot. For eleven of the changes, `same` must find that robot and copy are equivalent, and must
predict the poses of matched links in the copy. The script tests the predicted poses at random configurations.
For the other ten changes, `same` must find that robot and copy differ. The change `rounded` is an exception:
rounding to four digits leaves some robots unchanged, so every verdict is accepted.

For these ten changes, `same` also returns an interval for the largest distance between matching frames of
robot and copy. An independent global search maximizes the distance, which is computed with fifty digits from
the decimal numbers in the two URDF texts. The result must lie in the interval. The script skips an infinite
interval, and a copy whose base `same` moves.

Exit 1: a distance is outside its interval, or a verdict is wrong.
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

#: Maximum rounding error of each element of a placement: a coordinate (m) or an entry of the rotation.
ROUNDING = 1e-10


def check_pair(name: str, change: str) -> dict[str, Any] | None:
    """Check one change of a robot; return None if the change is impossible."""
    a, b = robot(name), changed(name, change)
    if b is None:
        return None
    began = time.process_time()
    comparison = urdfkin.same(a, b, bounds=change in UNLIKE)
    seconds = round(time.process_time() - began, 2)
    result = {"robot": name, "change": change, "verdict": comparison.verdict.value, "seconds": seconds}
    if change in ALIKE:
        return result | {"right": bool(comparison) and moves_alike(comparison, a, b, ROUNDING)}
    # For `rounded`, every verdict is accepted, because rounding leaves some files unchanged.
    result["right"] = comparison.verdict is Verdict.DIFFERS or change == "rounded"
    tools = {tool.b for tool in comparison.tools}
    frames = [frame for frame in comparison.frames if frame.frame_b not in tools and frame.q_a]
    worst = max(frames, key=lambda frame: (frame.upper, frame.lower), default=None)
    if worst is None or not math.isfinite(worst.upper) or not np.array_equal(comparison.base, np.eye(4)):
        return result
    attained = far(a, b, np.array(worst.q_a), np.array(worst.q_b), worst)
    truth = max(attained, searched(a, b, comparison.to_b, worst))
    result |= {"frame": worst.frame, "lower": worst.lower, "upper": worst.upper, "truth": truth}
    return result | {"holds": worst.lower <= attained and truth <= worst.upper}


def summarize(results: list[dict[str, Any]]) -> Iterator[str]:
    wrong = [result for result in results if not result["right"]]
    bounded = [result for result in results if "holds" in result]
    missed = [result for result in bounded if not result["holds"]]
    robots = len({result["robot"] for result in results})
    yield f"{len(results) - len(wrong)} of {len(results)} verdicts right, {robots} robots"
    held = len(bounded) - len(missed)
    yield f"{held} of {len(bounded)} intervals of `same` contain the largest distance that a search found"
    for change in UNLIKE:
        upper_ratios = [
            result["upper"] / result["truth"]
            for result in bounded
            if result["change"] == change and result["truth"]
        ]
        lower_ratios = [
            result["lower"] / result["truth"]
            for result in bounded
            if result["change"] == change and result["truth"]
        ]
        if upper_ratios:
            above = (
                f"{statistics.median(upper_ratios) - 1:.1%} (median), {max(upper_ratios) - 1:.1%} (largest)"
            )
            yield f"{change}: {len(upper_ratios)}; the upper bound is {above} above the result of the search,"
            yield f"  the lower bound at most {1 - min(lower_ratios):.1%} below"
    seconds = [result["seconds"] for result in results if result["change"] in UNLIKE]
    if seconds:
        yield f"seconds with bounds: median {statistics.median(seconds):.1f}, largest {max(seconds):.1f}"
    yield from (f"WRONG: {json.dumps(result)}" for result in (*wrong, *missed))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("robots", nargs="*", help="names of robots in the catalogue (default: all robots)")
    parser.add_argument("--keep", type=Path, required=True, help="file for the results, one per line")
    options = parser.parse_args()
    warnings.simplefilter("ignore", urdfkin.UrdfWarning)
    lines = options.keep.read_text().splitlines() if options.keep.exists() else []
    results = [json.loads(line) for line in lines]
    known = {(result["robot"], result["change"]) for result in results}
    for name, change in product(options.robots or sorted(catalogue()), (*ALIKE, *UNLIKE)):
        if (name, change) not in known and (result := check_pair(name, change)) is not None:
            results.append(result)
            with options.keep.open("a") as file:
                print(json.dumps(result), file=file)
    selected = [result for result in results if not options.robots or result["robot"] in options.robots]
    print(*summarize(selected), sep="\n")
    sys.exit(any(not result["right"] or not result.get("holds", True) for result in results))
