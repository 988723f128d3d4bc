"""Measure the processor time and memory of one check, in a separate process."""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time
from dataclasses import asdict, dataclass

from scripts.growing.kinds import KINDS
from urdfkin.urdf.lint import check_text


@dataclass(frozen=True, slots=True)
class Cost:
    """The cost of a check.

    Attributes:
        megabytes: Size of the document.
        seconds: Processor time.
        memory: Largest growth of the process's memory in megabytes, including the memory of the findings.
        findings: Number of reported findings.
    """

    megabytes: float
    seconds: float
    memory: float
    findings: int


def cost_of(kind: str, size: int) -> Cost:
    """Check a document of a kind and about `size` bytes, in this process."""
    document = KINDS[kind](size)
    before, start = _peak(), time.process_time()
    findings = check_text(document, fold=False)
    seconds = time.process_time() - start
    return Cost(len(document) / 1e6, seconds, _peak() - before, len(findings))


def cost_apart(kind: str, size: int, patience: float) -> Cost | None:
    """Check a document in a separate process; return None after `patience` seconds."""
    command = [sys.executable, "-m", "scripts.growing.clock", kind, str(size)]
    try:
        done = subprocess.run(command, capture_output=True, check=True, timeout=patience)
    except subprocess.TimeoutExpired:
        return None
    return Cost(**json.loads(done.stdout))


def _peak() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


if __name__ == "__main__":
    print(json.dumps(asdict(cost_of(sys.argv[1], int(sys.argv[2])))))
