"""All kernels that a check needs, loaded before it does."""

from __future__ import annotations

from urdfkin.compiled.ahead import load_kernels as load_cores
from urdfkin.verify import coupling, worst


def load_kernels() -> None:
    """Compile every kernel, or read it from disk: before processes start that would all compile."""
    load_cores()
    worst.load_kernel()
    coupling.load_kernel()
