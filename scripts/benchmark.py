"""Time urdfkin against Pinocchio called in a Python loop, interleaved in one process.

Ratios hold on a noisy machine, absolute times do not: each round times every contender once, and medians,
minima and the ratio of medians are printed. Results are compared first; a difference fails the run, a slow
time never does. Run: python scripts/benchmark.py [--quick] [--json FILE]
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pinocchio as pin

import urdfkin
from urdfkin.tree import FloatArray
from urdfkin.validation.report import versions

#: Robot and frame of each table: an arm, and a humanoid of which a path is a small part.
SUBJECTS = (("panda", "panda_hand"), ("talos", "gripper_left_base_link"))
#: How many configurations Pinocchio's loop takes; its time for one does not depend on it.
LOOP = 2000


class Subject:
    """One robot, one frame, the same work for everyone."""

    def __init__(self, name: str, frame: str, n: int) -> None:
        self.name, self.frame, self.n = name, frame, n
        # Without mimic both sides have the same coordinates.
        self.robot = urdfkin.load(name, verify=False, mimic=False)
        self.q = self.robot.sample(n, seed=0)
        self.v, self.a = np.random.default_rng(0).standard_normal((2, n, self.robot.nv))
        self.J = np.empty((n, 6, self.robot.nv))
        self.acceleration = np.empty((n, 6))
        self.model = pin.buildModelFromXML(self.robot.urdf)
        self.data = self.model.createData()
        self.id = self.model.getFrameId(frame)
        self.loop = min(n, LOOP)
        self.q_loop = self.robot.to_pinocchio(self.q[: self.loop])
        self.J_loop = np.empty((self.loop, 6, self.robot.nv))
        self.acceleration_loop = np.empty((self.loop, 6))

    def contenders(self) -> dict[str, dict[str, tuple[int, Callable[[], object]]]]:
        """For each quantity: who computes it, how many at a time, and how."""

        def jacobian(threads: int) -> Callable[[], object]:
            return lambda: self.robot.jacobian(self.q, self.frame, out=self.J, threads=threads)

        def acceleration(threads: int) -> Callable[[], object]:
            return lambda: self.robot.acceleration(
                self.q, self.v, self.a, self.frame, out=self.acceleration, threads=threads
            )

        return {
            "jacobian": {
                "urdfkin, 1 thread": (self.n, jacobian(1)),
                "urdfkin, 2 threads": (self.n, jacobian(2)),
                "Pinocchio, Python loop": (self.loop, self.loop_jacobian),
            },
            "acceleration": {
                "urdfkin, 1 thread": (self.n, acceleration(1)),
                "urdfkin, 2 threads": (self.n, acceleration(2)),
                "Pinocchio, Python loop": (self.loop, self.loop_acceleration),
            },
        }

    def loop_jacobian(self) -> None:
        """`computeFrameJacobian` for one configuration after the other."""
        for k in range(self.loop):
            self.J_loop[k] = pin.computeFrameJacobian(
                self.model, self.data, self.q_loop[k], self.id, pin.LOCAL_WORLD_ALIGNED
            )

    def loop_acceleration(self) -> None:
        """`forwardKinematics`, then `getFrameClassicalAcceleration`."""
        for k in range(self.loop):
            pin.forwardKinematics(self.model, self.data, self.q_loop[k], self.v[k], self.a[k])
            self.acceleration_loop[k] = pin.getFrameClassicalAcceleration(
                self.model, self.data, self.id, pin.LOCAL_WORLD_ALIGNED
            ).vector

    def differs(self) -> list[str]:
        """Which quantities are not the same on both sides: to 1e-9 here, exactly is `validate`'s business."""
        for _, compute in (work for table in self.contenders().values() for work in table.values()):
            compute()
        pairs: dict[str, tuple[FloatArray, FloatArray]] = {
            "jacobian": (self.J[: self.loop], self.J_loop),
            "acceleration": (self.acceleration[: self.loop], self.acceleration_loop),
        }
        return [what for what, (ours, theirs) in pairs.items() if not np.allclose(ours, theirs, atol=1e-9)]


def measure(subject: Subject, rounds: int) -> list[dict[str, object]]:
    """Median and minimum, in ns for one configuration, and how many times faster than Pinocchio's loop."""
    rows: list[dict[str, object]] = []
    for quantity, contenders in subject.contenders().items():
        times: dict[str, list[float]] = {who: [] for who in contenders}
        for _ in range(rounds):
            for who, (n, compute) in contenders.items():
                begin = time.perf_counter()
                compute()
                times[who].append((time.perf_counter() - begin) / n * 1e9)
        loop = statistics.median(times["Pinocchio, Python loop"])
        for who, values in times.items():
            median = statistics.median(values)
            rows.append(
                {
                    "robot": subject.name,
                    "quantity": quantity,
                    "who": who,
                    "median_ns": round(median, 1),
                    "minimum_ns": round(min(values), 1),
                    "times_pinocchio": round(loop / median, 1),
                }
            )
    return rows


def main() -> int:
    """Exit 1 when results differ."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--quick", action="store_true", help="few configurations, few rounds")
    parser.add_argument("--json", type=Path, help="write the figures as data")
    arguments = parser.parse_args()
    n, rounds = (2_000, 3) if arguments.quick else (100_000, 21)
    rows: list[dict[str, object]] = []
    for name, frame in SUBJECTS:
        subject = Subject(name, frame, n)
        if different := subject.differs():
            print(f"{name}: results differ: {', '.join(different)}", file=sys.stderr)
            return 1
        rows += measure(subject, rounds)
    print(f"{n:,} configurations, {rounds} rounds, float64, ns for one configuration")
    for row in rows:
        print(
            f"{row['robot']:6} {row['quantity']:13} {row['who']:24} median {row['median_ns']:8}"
            f"  minimum {row['minimum_ns']:8}  x{row['times_pinocchio']}"
        )
    if arguments.json:
        arguments.json.write_text(json.dumps({"versions": versions(), "rows": rows}, indent=2) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
