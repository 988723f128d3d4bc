"""Compare the speed of urdfkin, Pinocchio and other libraries for the same computations, in one process.

    python scripts/benchmark.py [--quick] [--json FILE] [--plot FILE] [--only batch single ...] [--no-peers]

The script first compares the results of all libraries, and fails if they differ. Each round then times every
library once. Ratios are therefore reliable even on a machine with other load, but absolute times are not. The
script prints medians, minima and ratios of medians. A library that is not installed is listed, but not
measured.

The section `where` measures the time of each step of a batch, and of each step of a single call. The section
`first` measures the first call of each quantity, in a new process.
"""

import argparse
import json
import os
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from itertools import product
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))  # Import urdfkin and `scripts` from this checkout.
# Without this setting, idle threads of PyTorch make other libraries slower.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")

from scripts.benchmarking import sections as measured
from scripts.benchmarking.contenders import ALWAYS, PEERS, Contender
from scripts.benchmarking.machine import USES, describe_machine, measure_first_uses, measure_memory
from scripts.benchmarking.tables import format_machine, make_tables
from scripts.benchmarking.timing import DifferenceError, Row
from scripts.benchmarking.workload import QUANTITIES, ROBOT_FRAMES
from urdfkin.compiled.preload import use_only
from urdfkin.verify.oracles import package_versions

SECTIONS = ("batch", "single", "checked", "verified", "where", "first", "joints", "frames", "sizes", "memory")


@dataclass(frozen=True)
class BenchmarkSize:
    configurations: int = 100_000  # configurations of a batch
    rounds: int = 21
    first: tuple[str, ...] = tuple(USES)  # quantities whose first use is measured
    joints: tuple[int, ...] = (6, 12, 25, 50, 100)  # numbers of joints of the chains
    numbers: int = 4_000_000  # approximate number of Jacobian elements per batch, in the section `joints`
    frames: tuple[int, ...] = (1, 4, 16, 1000)  # numbers of frames in one pass
    frame_configurations: int = 4_000  # configurations of a batch in the section `frames`
    sizes: tuple[int, ...] = (1_000, 10_000, 100_000, 1_000_000)  # sizes of batches
    memory: int = 1_000_000  # configurations for the measurement of memory


QUICK = BenchmarkSize(1_000, 3, ("placement",), (6, 12), 20_000, (1, 1000), 100, (100, 1_000), 200_000)


def measure_sections(
    size: BenchmarkSize, sections: Sequence[str], contenders: Sequence[Contender]
) -> dict[str, Any]:
    name, frame = ROBOT_FRAMES[0]
    n, rounds = size.configurations, size.rounds
    rows: dict[str, Iterator[Row]] = {
        **{name: measured.contender_rows(name, n, contenders, rounds) for name in SECTIONS[:4]},
        "joints": measured.joint_rows(size.joints, size.numbers, rounds),
        "frames": measured.frame_rows(size.frame_configurations, size.frames, rounds),
        "sizes": measured.size_rows(size.sizes, rounds),
    }
    figures: dict[str, Any] = {
        "machine": describe_machine(),
        "versions": package_versions(),
        "libraries": {contender.library: contender.version for contender in contenders},
        "rounds": rounds,
        "operations": dict(measured.operation_counts()),
        "rows": [
            asdict(row)
            for section, section_rows in rows.items()
            if section in sections
            for row in section_rows
        ],
        "memory": [
            measure_memory(name, frame, quantity, size.memory, out=out)
            for quantity, out in product(QUANTITIES, (True, False) if "memory" in sections else ())
        ],
    }
    if "where" in sections:
        single = measured.call_step_times(min(n, 2_000), rounds)
        figures["where"] = [*measured.batch_step_times(n, rounds), *single]
    if "first" in sections:
        figures["first"] = list(measure_first_uses(name, frame, size.first))
    return figures


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    option = parser.add_argument
    option("--quick", action="store_true", help="make a short run with few configurations and rounds")
    option("--json", type=Path, help="write the measurements to a file")
    option("--plot", type=Path, help="plot the measurements: svg, png or pdf")
    option("--only", nargs="+", choices=SECTIONS, default=SECTIONS, help="some sections")
    option("--no-peers", action="store_true", help="compare only urdfkin and Pinocchio")
    options = parser.parse_args(words)
    contenders = ALWAYS if options.no_peers else ALWAYS + PEERS
    try:
        with use_only("compiled"):
            figures = measure_sections(QUICK if options.quick else BenchmarkSize(), options.only, contenders)
    except DifferenceError as difference:
        print(f"results differ: {difference}", file=sys.stderr)
        return 1
    print(format_machine(figures), *(table.text for table in make_tables(figures)), sep="\n\n")
    if options.json:
        options.json.write_text(json.dumps(figures, indent=1) + "\n", "utf-8")
    if options.plot:
        from scripts.benchmarking.picture import draw

        options.plot.write_bytes(draw(figures, options.plot))
    return 0


if __name__ == "__main__":
    status = main()
    if "roboticstoolbox" in sys.modules:  # At exit, the toolbox would print warnings about memory leaks.
        sys.stdout.flush()
        os._exit(status)
    sys.exit(status)
