"""How much memory a validation may take and a robot needs: asked before, not found out when it is gone.

A validation keeps to `SHARE` of what is free when it begins, its processes together. A robot that needs more
is not verified, and the reason says how much it would have been.
"""

from __future__ import annotations

import resource
from collections.abc import Iterator
from pathlib import Path

from urdfkin.model.tree import KinematicTree
from urdfkin.validation.comparison import BLOCK_BYTES, frame_bytes
from urdfkin.verify.pinocchio import OracleError

#: How much of the free memory a validation keeps to.
SHARE = 0.5
#: Pinocchio's workspace, bytes for the cube of the rates, and what a link takes in all (measured: 4.1.0).
_FOR_CUBE, _FOR_LINK = 64, 24_000
#: How many arrays of a block's size are there at a time.
_ARRAYS = 12
_PROC = Path("/proc")
_GROUPS = Path("/sys/fs/cgroup")


def share(processes: int = 1) -> int | None:
    """Bytes for each of so many processes of a validation; None where the system does not tell."""
    free = min(_free(), default=None)
    return None if free is None else int(SHARE * free / processes)


def needed(tree: KinematicTree, samples: int) -> int:
    """Bytes that checking a robot takes, at most."""
    rates, links = sum(joint.kind.nv for joint in tree.joints), len(tree.links)
    block = min(BLOCK_BYTES, 2 * links * frame_bytes(samples, rates))
    return _FOR_CUBE * rates**3 + _FOR_LINK * links + _ARRAYS * max(block, frame_bytes(samples, rates))


def demand(tree: KinematicTree, samples: int, most: int | None) -> None:
    """Refuse a robot that does not fit.

    Args:
        tree: The robot.
        samples: How many are compared at a time.
        most: Bytes that it may take; None: no matter.

    Raises:
        OracleError: it needs more.
    """
    wanted = needed(tree, samples)
    if most is not None and wanted > most:
        raise OracleError(
            f"checking it would take more memory than a validation keeps to ({SHARE:.0%} of what is free,"
            " its processes together)",
            where=tree.name,
            found=f"{_gigabytes(wanted)}, where {_gigabytes(most)} are left to each process",
            remedy="take fewer jobs or a larger machine",
        )


def _gigabytes(size: int) -> str:
    return f"{size / 1e9:.3g} GB"


def _free() -> Iterator[int]:
    """What the machine, each control group of this process and its own limit leave free."""
    for line in _lines(_PROC / "meminfo"):
        if line.startswith("MemAvailable:"):
            yield int(line.split()[1]) * 1024
    for line in _lines(_PROC / "self" / "cgroup"):
        _, controllers, group = line.split(":", 2)
        if not controllers:
            yield from _group(_GROUPS, group, "memory.max", "memory.current")
        elif "memory" in controllers.split(","):
            yield from _group(_GROUPS / "memory", group, "memory.limit_in_bytes", "memory.usage_in_bytes")
    most, _ = resource.getrlimit(resource.RLIMIT_AS)
    if most != resource.RLIM_INFINITY:
        for line in _lines(_PROC / "self" / "statm"):
            yield max(0, most - int(line.split()[0]) * resource.getpagesize())


def _group(mount: Path, group: str, limit: str, usage: str) -> Iterator[int]:
    """A control group's limit holds for the groups within; in a container its own is the topmost."""
    folder = mount / group.lstrip("/")
    for place in (folder, *folder.parents):
        if place == mount.parent:
            return
        numbers = [line for file in (limit, usage) for line in _lines(place / file)]
        if len(numbers) == 2 and all(number.isdigit() for number in numbers):
            yield max(0, int(numbers[0]) - int(numbers[1]) + _cached(place))


def _cached(place: Path) -> int:
    """What a control group counts as used, but gives back when it is needed: files not read of late."""
    counts = dict(line.split(maxsplit=1) for line in _lines(place / "memory.stat"))
    return int(counts.get("total_inactive_file") or counts.get("inactive_file") or 0)


def _lines(path: Path) -> list[str]:
    try:
        return path.read_text("utf-8").splitlines()
    except (OSError, ValueError):
        return []
