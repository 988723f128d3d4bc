"""Load the compiled kernels of all checks in advance."""

from __future__ import annotations

from urdfkin.compiled import preload
from urdfkin.verify.comparison import CHECKS, KERNELS


def load_kernels() -> None:
    """Compile each kernel or read it from disk, before worker processes start that would each compile it."""
    preload.load_kernels()
    for name in CHECKS:
        preload.load(name, KERNELS)
