"""Describe the machine; measure the memory of a batch and the time of a first use in new processes.

This module runs itself in a new process, which has loaded no kernel and no library yet.
"""

import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import urdfkin
from urdfkin.compiled.preload import use_only
from urdfkin.robot import Robot

ROOT = Path(__file__).parents[2]
#: Keys of the time (ms) for a first result, with an empty kernel cache and with stored kernels.
EMPTY, STORED = "empty_ms", "stored_ms"
#: Maps a method to the number of its inputs: 1 (q), 2 (q and v) or 3 (q, v and a). The first call of the
#: method compiles a kernel. A name with `prepared.` is a method of a prepared evaluator, any other name a
#: method of `Robot`.
USES = {
    "placement": 1,
    "velocity": 2,
    "jacobian": 1,
    "jacobian_rate": 2,
    "acceleration": 3,
    "acceleration_breakdown": 3,
    "prepared.jacobian": 1,
    "prepared.acceleration": 3,
}


def describe_machine() -> dict[str, object]:
    lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines()
    entries = {key.strip(): value.strip() for key, _, value in (line.partition(":") for line in lines)}
    flags = entries.get("flags", "").split()
    units = {"avx512f": "AVX-512", "avx2": "AVX2", "avx": "AVX"}
    return {
        "processor": entries.get("model name", platform.processor() or platform.machine()),
        "processors": len(os.sched_getaffinity(0)),
        "vectors": next((name for flag, name in units.items() if flag in flags), "SSE2 or other"),
        "memory_gib": round(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 2**30),
        "system": platform.system(),
        "python": platform.python_version(),
    }


def measure_memory(robot: str, frame: str, quantity: str, n: int, *, out: bool) -> dict[str, Any]:
    """Return the peak memory and the result's size (bytes)."""
    return _run_in_process("memory", robot, frame, quantity, str(n), "out" if out else "fresh")


def measure_first_uses(robot: str, frame: str, uses: Sequence[str]) -> Iterator[dict[str, Any]]:
    together = " + ".join(uses) if len(uses) > 1 else None
    for what in (*uses, *filter(None, [together])):
        with tempfile.TemporaryDirectory() as folder:
            words = "first", robot, frame, *what.split(" + ")
            times = {key: _run_in_process(*words, cache=folder)["ms"] for key in (EMPTY, STORED)}
        yield {"robot": robot, "what": "all of them" if what == together else what, **times}


def _run_in_process(*words: str, cache: str | None = None) -> dict[str, Any]:
    command = [sys.executable, "-m", "scripts.benchmarking.machine", *words]
    environment = os.environ | ({} if cache is None else {"NUMBA_CACHE_DIR": cache})
    done = subprocess.run(command, cwd=ROOT, capture_output=True, check=True, env=environment)
    result: dict[str, Any] = json.loads(done.stdout)
    return result


def _time_first_calls(robot: str, frame: str, *uses: str) -> dict[str, object]:
    model = urdfkin.load(robot, verify=False, mimic=False)
    begin = time.process_time()
    for use in uses:
        _call_once(model, frame, use)
    return {"ms": round(1e3 * (time.process_time() - begin), 1)}


def _call_once(model: Robot, frame: str, use: str) -> None:
    inputs = [np.zeros(model.nq), np.zeros(model.nv), np.zeros(model.nv)][: USES[use]]
    of_prepared, _, name = use.rpartition(".")
    with use_only("compiled"):
        if of_prepared:
            getattr(model.prepare(frame), name)(*inputs)
        else:
            getattr(model, name)(*inputs, frame, verify=False)


def _measure_peak(robot: str, frame: str, quantity: str, count: str, kind: str) -> dict[str, object]:
    from scripts.benchmarking.workload import Workload

    n = int(count)
    with Workload(robot, frame, n) as workload:
        method, inputs = getattr(workload.robot, quantity), workload.inputs(quantity, n)
        out = np.ones((n, *workload.result_shape(quantity))) if kind == "out" else None
        warm_up_inputs = tuple(x[:64] for x in inputs)
        with use_only("compiled"):
            # This call loads compiled code and starts threads.
            method(*warm_up_inputs, frame, verify=False, threads=2)
        Path("/proc/self/clear_refs").write_text("5")  # The 5 resets VmHWM, the maximum of VmRSS.
        before = _read_bytes("VmRSS")
        result = method(*inputs, frame, out=out, verify=False)
        peak = _read_bytes("VmHWM") - before + (out.nbytes if out is not None else 0)
    sizes = {"output_bytes": result.nbytes, "peak_bytes": peak}
    return {"robot": robot, "quantity": quantity, "n": n, "out": kind == "out", **sizes}


def _read_bytes(entry: str) -> int:
    lines = Path("/proc/self/status").read_text("utf-8").splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith(entry))


if __name__ == "__main__":
    question, *given = sys.argv[1:]
    print(json.dumps(_time_first_calls(*given) if question == "first" else _measure_peak(*given)))
