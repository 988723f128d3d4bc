"""Time urdfkin against Pinocchio and other libraries at the same work, interleaved in one process.

    python scripts/benchmark.py [--quick] [--json FILE] [--plot FILE] [--only batch single ...] [--no-peers]

Ratios hold on a noisy machine, absolute times do not: each round times every contender once; medians, minima
and the ratio of medians are printed. Results are compared first; a difference fails the run, a slow time
never does. Libraries that are not installed are listed and left out.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))  # run from a checkout that is not installed
os.environ.setdefault("OMP_WAIT_POLICY", "passive")  # PyTorch's threads do not spin into the next contender

import urdfkin
from scripts.benchmarking.batches import batch_rows
from scripts.benchmarking.clock import Row
from scripts.benchmarking.contenders import Contender, find
from scripts.benchmarking.growth import frame_rows, joint_rows, size_rows
from scripts.benchmarking.machine import machine
from scripts.benchmarking.memory import peak_over_output
from scripts.benchmarking.operations import operations
from scripts.benchmarking.show import show
from scripts.benchmarking.single import single_rows
from scripts.benchmarking.subject import QUANTITIES, SUBJECTS, Subject
from scripts.benchmarking.verified import verified_rows
from scripts.benchmarking.work import DifferenceError
from urdfkin.validation.report import versions

SECTIONS = ("batch", "single", "verified", "joints", "frames", "sizes", "memory")


@dataclass(frozen=True)
class Plan:
    """How much is measured.

    Attributes:
        configurations: Of a batch.
        rounds: Of each table.
        joints: Of the chains.
        numbers: Written by a chain's batch of Jacobians.
        frames: How many placements at once.
        frame_configurations: Of their batches.
        sizes: Of batches.
        memory: Configurations whose memory is measured.
    """

    configurations: int = 100_000
    rounds: int = 21
    joints: tuple[int, ...] = (6, 12, 25, 50, 100)
    numbers: int = 4_000_000
    frames: tuple[int, ...] = (1, 4, 16, 1000)
    frame_configurations: int = 4_000
    sizes: tuple[int, ...] = (1_000, 10_000, 100_000, 1_000_000)
    memory: int = 1_000_000


QUICK = Plan(1_000, 3, (6, 12), 20_000, (1, 1000), 100, (100, 1_000), 200_000)


def rows_of(section: str, plan: Plan, contenders: Sequence[Contender]) -> Iterator[Row]:
    """One section's rows."""
    if section == "joints":
        yield from joint_rows(plan.joints, plan.numbers, plan.rounds)
    elif section == "sizes":
        yield from size_rows(SUBJECTS[0], plan.sizes, plan.rounds)
    elif section == "frames":
        with Subject(*SUBJECTS[1], plan.frame_configurations) as subject:
            yield from frame_rows(subject, plan.frames, plan.rounds)
    else:
        for source in SUBJECTS:
            with Subject(*source, plan.configurations) as subject:
                if section == "batch":
                    yield from batch_rows(subject, contenders, plan.rounds)
                elif section == "single":
                    yield from single_rows(subject, contenders, plan.rounds)
                elif section == "verified":
                    yield from verified_rows(subject, plan.rounds)


def document(plan: Plan, sections: Sequence[str], contenders: Sequence[Contender]) -> dict[str, Any]:
    """Everything measured, as data.

    Raises:
        DifferenceError: contenders disagree.
    """
    name, frame = SUBJECTS[0]
    return {
        "machine": machine(),
        "versions": versions(),
        "libraries": {contender.library: contender.state for contender in contenders},
        "rounds": plan.rounds,
        "operations": dict(_operations()),
        "rows": [row.as_data() for section in sections for row in rows_of(section, plan, contenders)],
        "memory": [
            peak_over_output(name, frame, quantity, plan.memory, out=out)
            for quantity in ("jacobian", "acceleration")
            for out in (True, False)
            if "memory" in sections
        ],
    }


def _operations() -> Iterator[tuple[str, int]]:
    for name, frame in SUBJECTS:
        robot = urdfkin.load(name, mimic=False, verify=False)
        for quantity in QUANTITIES:
            yield f"{name}, {quantity}", operations(robot.plan([robot.tree.frame_link(frame)]), quantity)


def main(words: Sequence[str] | None = None) -> int:
    """Exit 1 when results differ."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--quick", action="store_true", help="few configurations, few rounds")
    parser.add_argument("--json", type=Path, help="write the figures as data")
    parser.add_argument("--plot", type=Path, help="draw them: svg, png or pdf")
    parser.add_argument("--only", nargs="+", choices=SECTIONS, default=SECTIONS, help="some sections")
    parser.add_argument("--no-peers", action="store_true", help="urdfkin and Pinocchio alone")
    parser.add_argument("--rounds", type=int, help="how often each is timed")
    arguments = parser.parse_args(words)
    plan = QUICK if arguments.quick else Plan()
    if arguments.rounds:
        plan = Plan(**{**vars(plan), "rounds": arguments.rounds})
    try:
        figures = document(plan, arguments.only, find(peers=not arguments.no_peers))
    except DifferenceError as difference:
        print(f"results differ: {difference}", file=sys.stderr)
        return 1
    show(figures)
    if arguments.json:
        arguments.json.write_text(json.dumps(figures, indent=1) + "\n", "utf-8")
    if arguments.plot:
        from scripts.benchmarking.picture import draw  # noqa: PLC0415  needs matplotlib

        arguments.plot.write_bytes(draw(figures, arguments.plot))
    return 0


if __name__ == "__main__":
    status = main()
    if "roboticstoolbox" in sys.modules:  # its bindings list a hundred lines of leaks when Python ends
        sys.stdout.flush()
        os._exit(status)
    sys.exit(status)
