"""Compare your results with test vectors; no library is needed.

from compare import wrong

for line in wrong("vectors/mimic.json", answer):
    print(line)

You write the function `answer(quantity, frame, reference, q, v, a)`. The function returns nested lists or an
array. For a quantity that you do not compute, the function returns None.
"""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any


def flat(x: Any) -> list[float]:
    """Return all numbers of an array or nested lists as one list, row by row."""
    return [number for row in x for number in flat(row)] if hasattr(x, "__len__") else [float(x)]


def wrong(path: str | Path, answer: Callable[..., Any]) -> Iterator[str]:
    """Yield a line for each number that is not within its tolerance."""
    vectors = json.loads(Path(path).read_text("utf-8"))
    for k, sample in enumerate(vectors["samples"]):
        for one in sample["results"]:
            what = one["quantity"], one["frame"], one["reference"]
            given = answer(*what, sample["q"], sample["v"], sample["a"])
            if given is None:
                continue
            if len(found := flat(given)) != len(one["value"]):
                yield f"sample {k}, {what}: {len(found)} numbers, expected {len(one['value'])}"
                continue
            for i, (x, y, most) in enumerate(zip(found, one["value"], one["tolerance"], strict=True)):
                if not abs(x - y) <= most:
                    yield f"sample {k}, {what}, number {i}: {x!r}, expected {y!r} within {most}"
