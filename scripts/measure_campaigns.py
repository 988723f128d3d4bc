"""Measure the cost of a campaign in four variants: serial, two processes, with a store, on a local cluster.

The variants alternate, so that other load of the machine affects all of them. The script prints medians
over rounds. Processor time includes all processes, and hardly depends on other load.

    python scripts/measure_campaigns.py ur5 --samples 10000 --rounds 3
    python scripts/measure_campaigns.py --all --samples 1000 --rounds 1 --ways serial,jobs
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

from urdfkin.urdf.catalogue import examples
from urdfkin.validation.campaign import validate
from urdfkin.validation.chunk import Cut
from urdfkin.validation.cluster import connected
from urdfkin.validation.results import ValidationReport

Way = Callable[..., ValidationReport]


def store(*robots: Any, **how: Any) -> ValidationReport:
    """Validate serially, with a store."""
    with tempfile.TemporaryDirectory() as folder:
        report = validate(*robots, store=folder, **how)
        files = [path.stat().st_size for path in Path(folder).glob("chunks/*/*")]
        print(f"    {len(files)} files, {sum(files) / len(files):,.0f} bytes each")
        return report


def cluster(*robots: Any, **how: Any) -> ValidationReport:
    """Validate with two local Dask workers; the time includes the end of the workers, but not their start."""
    with connected("local:2") as two:
        # load the modules of the worker processes before the measurement
        validate("planar_two_link", samples=400, executor=two)
        chunks = len(Cut(how["samples"])) * len(robots[0])
        begin, before = time.perf_counter(), time.process_time()
        report = validate(*robots, executor=two, **how)
        own = 1e3 * (time.process_time() - before) / chunks
        print(f"    {time.perf_counter() - begin:.1f} s without start and end")
        print(f"    {own:.1f} ms of processor time per chunk in client and scheduler, {chunks} chunks")
        return report


WAYS: dict[str, Way] = {
    "serial": validate,
    "store": store,
    "jobs": lambda *robots, **how: validate(*robots, jobs=2, **how),
    "cluster": cluster,
}


def main() -> None:
    """Print the table of measurements."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("robots", nargs="*")
    parser.add_argument("--all", action="store_true")
    parser.add_argument("--samples", type=int, default=10_000)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--ways", default=",".join(WAYS))
    given = parser.parse_args()
    robots = list(examples()) if given.all else given.robots
    validate("planar_two_link", samples=10)  # compile and load all kernels before the measurement
    wall: dict[str, list[float]] = {}
    processor: dict[str, list[float]] = {}
    for _ in range(given.rounds):
        for name in given.ways.split(","):
            begin, before = time.perf_counter(), _processor()
            report = WAYS[name](robots, samples=given.samples)
            wall.setdefault(name, []).append(time.perf_counter() - begin)
            processor.setdefault(name, []).append(_processor() - before)
            results = sum(robot.results for robot in report.robots)
            print(f"  {name}: {wall[name][-1]:.1f} s, processor {processor[name][-1]:.1f} s", flush=True)
    print(f"{len(robots)} robots, {given.samples:,} samples each, {results:,} results; {given.rounds} rounds")
    for name, seconds in wall.items():
        work = [p / s for p, s in zip(processor[name], processor["serial"], strict=True)]
        each = (
            f"{results / median(seconds):,.0f} results/s, {results / median(processor[name]):,.0f} a second"
        )
        print(f"{name}: {each} of processor; processor time {median(work):.3f} of serial")


def _processor() -> float:
    """Return the processor time in seconds of this process and its finished children."""
    t = os.times()
    return t.user + t.system + t.children_user + t.children_system


if __name__ == "__main__":
    main()
