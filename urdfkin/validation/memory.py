"""Limit the memory of a validation, and estimate the memory that a robot needs.

Frames are compared in blocks, to limit the memory. The largest arrays are the Jacobians, with
samples * frames * 6 * nv numbers. The report is the same for every size of the blocks, because a frame's
results do not depend on the other frames.

Each of n local processes may use 1 / (2 n) of the memory that is free at the start. A process of an executor
may use half of the free memory of its machine. If a robot needs more memory than one process may use,
the robot is not verified. Its report states the needed and the allowed memory.
"""

from __future__ import annotations

import resource
from collections.abc import Iterator
from pathlib import Path

from urdfkin.errors import OracleError
from urdfkin.model.tree import KinematicTree

#: Maximum size (bytes) of a block of results.
#: The results of one frame may be larger.
MAX_BLOCK_BYTES = 32 * 2**20
#: Fraction of the free memory that a validation uses.
_FREE_FRACTION = 0.5
#: Measured memory of Pinocchio 4.1.0. Its workspace is proportional to nv^3.
_BYTES_PER_NV_CUBED, _BYTES_PER_LINK = 64, 24_000
#: Maximum number of arrays in memory at the same time. Each array contains the results of a block of frames.
_MAX_ARRAYS = 12
_PROC = Path("/proc")
_CGROUPS = Path("/sys/fs/cgroup")


def limit(processes: int = 1) -> int | None:
    """Return the memory (bytes) for each of `processes` processes; None if unknown."""
    free = min(_find_free_bytes(), default=None)
    return None if free is None else int(_FREE_FRACTION * free / processes)


def frame_array_bytes(samples: int, nv: int) -> int:
    """Return the bytes of one frame's largest array: (samples, 4, 4) or (samples, 6, nv)."""
    return samples * 8 * max(16, 6 * nv)


def blocks(count: int, item_bytes: int) -> Iterator[slice]:
    """Yield slices of at most `MAX_BLOCK_BYTES`, or of one item. For zero items, yield one empty slice."""
    items = max(1, MAX_BLOCK_BYTES // item_bytes)
    for start in range(0, max(1, count), items):
        yield slice(start, min(count, start + items))


def estimate_bytes(tree: KinematicTree, samples: int) -> int:
    nv, links = sum(joint.kind.nv for joint in tree.joints), len(tree.links)
    block = min(MAX_BLOCK_BYTES, 2 * links * frame_array_bytes(samples, nv))
    return (
        _BYTES_PER_NV_CUBED * nv**3
        + _BYTES_PER_LINK * links
        + _MAX_ARRAYS * max(block, frame_array_bytes(samples, nv))
    )


def check(tree: KinematicTree, samples: int, allowed_bytes: int | None) -> None:
    needed_bytes = estimate_bytes(tree, samples)
    if allowed_bytes is not None and needed_bytes > allowed_bytes:
        raise OracleError(
            "not enough memory to check the robot (all processes of a validation may use"
            f" {_FREE_FRACTION:.0%} of the free memory)",
            where=tree.name,
            found=f"{needed_bytes / 1e9:.3g} GB needed,"
            f" {allowed_bytes / 1e9:.3g} GB allowed for each process",
            remedy="use fewer jobs or a larger machine",
        )


def _find_free_bytes() -> Iterator[int]:
    """Yield the free memory (bytes) under each limit: of the machine, of control groups, and RLIMIT_AS."""
    for line in _read_lines(_PROC / "meminfo"):
        if line.startswith("MemAvailable:"):
            yield int(line.split()[1]) * 1024
    for line in _read_lines(_PROC / "self" / "cgroup"):
        _, controllers, group = line.split(":", 2)
        if not controllers:
            yield from _find_group_free_bytes(_CGROUPS, group, "memory.max", "memory.current")
        elif "memory" in controllers.split(","):
            yield from _find_group_free_bytes(
                _CGROUPS / "memory", group, "memory.limit_in_bytes", "memory.usage_in_bytes"
            )
    address_space, _ = resource.getrlimit(resource.RLIMIT_AS)
    if address_space != resource.RLIM_INFINITY:
        for line in _read_lines(_PROC / "self" / "statm"):
            yield max(0, address_space - int(line.split()[0]) * resource.getpagesize())


def _find_group_free_bytes(mount: Path, group: str, limit: str, usage: str) -> Iterator[int]:
    """Yield the free memory of a control group and of its parents.

    In a container, the highest visible control group is the container's own group.
    """
    folder = mount / group.lstrip("/")
    for place in (folder, *folder.parents):
        if place == mount.parent:
            return
        numbers = [line for file in (limit, usage) for line in _read_lines(place / file)]
        if len(numbers) == 2 and all(number.isdigit() for number in numbers):
            counts = dict(line.split(maxsplit=1) for line in _read_lines(place / "memory.stat"))
            # Linux counts cached files as used memory, but frees inactive cached files on demand.
            cached = int(counts.get("total_inactive_file") or counts.get("inactive_file") or 0)
            yield max(0, int(numbers[0]) - int(numbers[1]) + cached)


def _read_lines(path: Path) -> list[str]:
    try:
        return path.read_text("utf-8").splitlines()
    except (OSError, ValueError):
        return []
