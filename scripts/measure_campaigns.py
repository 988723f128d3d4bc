"""Measure the cost of a validation run: in one process, with stored results, in two processes, in a cluster.

    python scripts/measure_campaigns.py ur5 --samples 10000 --rounds 3
    python scripts/measure_campaigns.py --all --samples 1000 --rounds 1 --engines serial,jobs
    python scripts/measure_campaigns.py --chunk     # compute, store, read and add one chunk of samples

The variants alternate, so that other load of the machine affects all of them. The script prints medians
over rounds. Processor time includes all processes, and hardly depends on other load.
"""

import argparse
import os
import tempfile
import time
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from statistics import median
from typing import Any

from urdfkin.urdf.catalogue import example_robot_data_names
from urdfkin.validation.campaign import validate
from urdfkin.validation.chunk import Chunking, run_chunk
from urdfkin.validation.cluster import connect_cluster
from urdfkin.validation.results import ValidationReport
from urdfkin.validation.robot_input import make_robot_input
from urdfkin.validation.store import Manifest, open_store


def validate_with_store(*robots: Any, **options: Any) -> ValidationReport:
    with tempfile.TemporaryDirectory() as folder:
        report = validate(*robots, store=folder, **options)
        files = [path.stat().st_size for path in Path(folder).glob("chunks/*/*")]
        print(f"    {len(files)} files, {sum(files) / len(files):,.0f} bytes each")
        return report


def validate_on_cluster(*robots: Any, **options: Any) -> ValidationReport:
    """Validate with two local Dask workers."""
    with connect_cluster("local:2") as cluster:
        validate("planar_two_link", samples=400, executor=cluster)  # the workers load their modules
        chunks = len(Chunking(options["samples"])) * len(robots[0])
        begin, before = time.perf_counter(), time.process_time()
        report = validate(*robots, executor=cluster, **options)
        chunk_ms = 1e3 * (time.process_time() - before) / chunks
        print(f"    run time without starting and stopping the workers: {time.perf_counter() - begin:.1f} s")
        print(
            f"    processor time of client and scheduler: {chunk_ms:.1f} ms for each of"
            f" {chunks} chunks of samples"
        )
        return report


ENGINES: dict[str, Callable[..., ValidationReport]] = {
    "serial": validate,
    "store": validate_with_store,
    "jobs": lambda *robots, **how: validate(*robots, jobs=2, **how),
    "cluster": validate_on_cluster,
}


def measure(robots: list[str], engines: list[str], samples: int, rounds: int) -> None:
    validate("planar_two_link", samples=400)  # import all modules and load all kernels before the measurement
    wall: dict[str, list[float]] = {name: [] for name in engines}
    processor: dict[str, list[float]] = {name: [] for name in engines}
    for name in engines * rounds:
        begin, before = time.perf_counter(), sum(os.times()[:4])  # includes finished child processes
        report = ENGINES[name](robots, samples=samples)
        wall[name].append(time.perf_counter() - begin)
        processor[name].append(sum(os.times()[:4]) - before)
        results = sum(robot.results for robot in report.robots)
        print(f"  {name}: {wall[name][-1]:.1f} s, processor {processor[name][-1]:.1f} s", flush=True)
    print(f"{len(robots)} robots, {samples:,} samples each, {results:,} results; {rounds} rounds")
    for name in engines:
        a_second = [results / median(seconds[name]) for seconds in (wall, processor)]
        share = median(p / s for p, s in zip(processor[name], processor[engines[0]], strict=True))
        print(f"{name}: {a_second[0]:,.0f} results/s, {a_second[1]:,.0f} per processor second;", end=" ")
        print(f"processor time {share:.3f} of {engines[0]}")


def measure_chunk() -> None:
    def measure_cost(work: Callable[[int], object], times: int = 100) -> float:
        moments = [time.process_time()]
        for i in range(times):
            work(i)
            moments.append(time.process_time())
        return 1e3 * median(after - before for before, after in pairwise(moments))

    robot, chunking = make_robot_input("ur5"), Chunking(100_000)
    chunk = chunking.make_chunk(robot, 0, 1)
    result = run_chunk(chunk)
    cost = measure_cost(lambda _: run_chunk(chunk), 3)
    print(f"a chunk of {chunk.configuration_count} samples: {cost:.0f} ms")
    manifest = Manifest.of([robot], chunking.samples, 0, "now")
    with tempfile.TemporaryDirectory() as folder, open_store(Path(folder) / "s", manifest, print) as store:
        print(f"time to store it: {measure_cost(lambda i: store.write_answer(0, i, result)):.2f} ms")
        print(f"time to read it: {measure_cost(lambda i: store.read_answer(0, i)):.2f} ms")
    print(f"time to add two: {measure_cost(lambda _: result + result):.2f} ms")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("robots", nargs="*")
    parser.add_argument("--all", action="store_true", help="the robots of example-robot-data")
    parser.add_argument("--samples", type=int, default=10_000)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--engines", default=",".join(ENGINES), help=f"default: {','.join(ENGINES)}")
    parser.add_argument("--chunk", action="store_true", help="measure the cost of one chunk of samples")
    options = parser.parse_args()
    if options.chunk:
        measure_chunk()
    else:
        robots = list(example_robot_data_names()) if options.all else options.robots
        measure(robots, options.engines.split(","), options.samples, options.rounds)
