"""The machine the figures were measured on."""

from __future__ import annotations

import os
import platform
from pathlib import Path


def machine() -> dict[str, object]:
    """Processor, how many of them, the widest vector unit, memory, system, Python."""
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
