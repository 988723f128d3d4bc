"""Measure the processor time to compute, store, read and add a chunk, in milliseconds.

python scripts/measure_store.py
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median

from urdfkin.validation.chunk import Cut, run_chunk
from urdfkin.validation.manifest import Manifest
from urdfkin.validation.robot_input import subject
from urdfkin.validation.store import opened


def main() -> None:
    """Print the measured times."""
    robot, cut = subject("ur5"), Cut(100_000)
    chunk = cut.chunk(robot, 0, 1)
    found = run_chunk(chunk)
    print(f"a chunk of {chunk.configurations} samples: {_cost(lambda _: run_chunk(chunk), 3):.0f} ms")
    manifest = Manifest.of([robot], cut.samples, 0, "now")
    with tempfile.TemporaryDirectory() as folder, opened(Path(folder) / "s", manifest, print) as store:
        print(f"time to store it: {_cost(lambda i: store.keep(0, i, found), 100):.2f} ms")
        print(f"time to read it: {_cost(lambda i: store.answer(0, i), 100):.2f} ms")
    print(f"time to add two: {_cost(lambda _: found + found, 100):.2f} ms")


def _cost(work: Callable[[int], object], times: int) -> float:
    """Return the median processor time in milliseconds."""
    seconds = []
    for i in range(times):
        begin = time.process_time()
        work(i)
        seconds.append(time.process_time() - begin)
    return 1e3 * median(seconds)


if __name__ == "__main__":
    main()
