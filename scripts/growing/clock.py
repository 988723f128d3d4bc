"""What one document costs a check: processor seconds and memory, in a process of its own."""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time
from dataclasses import asdict, dataclass

from scripts.growing.kinds import KINDS
from urdfkin.lint import check_text


@dataclass(frozen=True, slots=True)
class Cost:
    """What a check took.

    Attributes:
        megabytes: Size of the document.
        seconds: Processor time.
        memory: Megabytes by which the process grew at most, findings included.
        findings: How many findings were written out.
    """

    megabytes: float
    seconds: float
    memory: float
    findings: int


def cost_of(kind: str, size: int) -> Cost:
    """Check a document of a kind and about `size` bytes, here and now."""
    document = KINDS[kind](size)
    before, start = _peak(), time.process_time()
    findings = check_text(document, fold=False)
    seconds = time.process_time() - start
    return Cost(len(document) / 1e6, seconds, _peak() - before, len(findings))


def cost_apart(kind: str, size: int, patience: float) -> Cost | None:
    """The same in a process of its own, whose memory is nobody else's; None after `patience` seconds."""
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
