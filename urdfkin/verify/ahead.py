"""Load the compiled kernels of all checks in advance."""

from __future__ import annotations

from urdfkin.compiled import preload
from urdfkin.verify.comparison import CHECKS, KERNELS


def load_kernels() -> None:
    """Compile all kernels, or load them from disk, before worker processes start.

    Otherwise each worker process would compile all kernels itself.
    """
    preload.load_kernels()
    for name in CHECKS:
        preload.load(name, KERNELS)
