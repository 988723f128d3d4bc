"""All kernels that a check needs, loaded before it does."""

from __future__ import annotations

from urdfkin.compiled.preload import load_kernels as load_cores
from urdfkin.verify import comparison, mimic_columns


def load_kernels() -> None:
    """Compile every kernel, or read it from disk: before processes start that would all compile."""
    load_cores()
    comparison.load_kernel()
    mimic_columns.load_kernel()
