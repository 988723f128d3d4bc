"""Memory: how much a large batch takes beyond its output, measured in a process of its own.

Run as a module in a fresh process: the kernel tells the largest size that a process had since it was last
told to forget it.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]


def peak_over_output(robot: str, frame: str, quantity: str, n: int, *, out: bool) -> dict[str, object]:
    """Bytes that `n` results take at the most, and those of the results themselves."""
    words = [robot, frame, quantity, str(n), "out" if out else "fresh"]
    command = [sys.executable, "-m", "scripts.benchmarking.memory", *words]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    result: dict[str, object] = json.loads(done.stdout)
    return result


def _measure(robot: str, frame: str, quantity: str, n: int, kind: str) -> dict[str, object]:
    from scripts.benchmarking.subject import Subject  # noqa: PLC0415  it loads numba

    with Subject(robot, frame, n) as subject:
        method, inputs = getattr(subject.robot, quantity), subject.inputs(quantity, n)
        out = np.ones((n, *subject.width(quantity))) if kind == "out" else None
        few = tuple(x[:64] for x in inputs)
        method(*few, frame, verify=False, threads=2)  # compiled code and threads are there
        Path("/proc/self/clear_refs").write_text("5")  # forget the largest size
        before = _bytes("VmRSS")
        result = method(*inputs, frame, out=out, verify=False)
        taken = _bytes("VmHWM") - before + (out.nbytes if out is not None else 0)
    return {
        "robot": robot,
        "quantity": quantity,
        "n": n,
        "out": kind == "out",
        "output_bytes": result.nbytes,
        "peak_bytes": taken,
    }


def _bytes(entry: str) -> int:
    """VmRSS is the memory in use, VmHWM the most that was in use."""
    lines = Path("/proc/self/status").read_text("utf-8").splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith(entry))


if __name__ == "__main__":
    name, frame, quantity, n, kind = sys.argv[1:]
    print(json.dumps(_measure(name, frame, quantity, int(n), kind)))
