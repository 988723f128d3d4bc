"""Load the compiled kernels of all checks in advance."""

from __future__ import annotations

from urdfkin.compiled.preload import load_kernels as load_cores
from urdfkin.verify import comparison, mimic_columns


def load_kernels() -> None:
    """Compile each kernel or read it from disk. Call this before worker processes start.

    Otherwise each worker process would compile the kernels again.
    """
    load_cores()
    comparison.load_kernel()
    mimic_columns.load_kernel()
