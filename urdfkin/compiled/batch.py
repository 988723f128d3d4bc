"""Compute a batch with several threads.

Each configuration is computed independently of the others. The results therefore have the same bits for any
number of threads.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from functools import cache
from itertools import pairwise

from urdfkin.compiled.program import LANES
from urdfkin.errors.validators import whole_number
from urdfkin.model.tree import FloatArray

#: Smallest batch for several threads by default; starting a thread costs about ten microseconds.
_WORTH_THREADS = 4096

#: Number of configurations that NumPy computes at a time, so that the intermediate results fit into the
#: processor's cache.
PART = 2048

#: A function (inputs, out) that computes the rows of `out` from the rows of the inputs. The function returns
#: 1 if an input is nan, infinite or too large (see `ordinary` in `urdfkin.compiled.machine.memory`), else 0.
Compute = Callable[[Sequence[FloatArray], FloatArray], int]


def default_threads(n: int) -> int:
    """Return the default number of threads for n configurations.

    The number is 1 for a small batch, else the number of processors that this process may use.
    """
    return _processors() if n >= _WORTH_THREADS else 1


def _processors() -> int:
    """Return the number of processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1  # macOS


def in_blocks(compute: Compute, inputs: Sequence[FloatArray], out: FloatArray, threads: int | None) -> int:
    """Compute `out` (n, ...) with several threads; each array of `inputs` is (n, ...) or (1, ...).

    The result is 1 if an input is nan, infinite or too large, else 0.

    Args:
        compute: The computation, which must release Python's global interpreter lock.
        inputs: C-contiguous arrays.
        out: C-contiguous array.
        threads: Largest number of threads; None for the number from `default_threads`.

    Raises:
        InputError: `threads` is not an integer of at least 1.
    """
    n = len(out)
    threads = default_threads(n) if threads is None else whole_number(threads, "threads", 1)
    if n == 0:
        return 0
    parts = _parts(n, min(threads, max(n // LANES, 1), _processors()))
    if len(parts) == 1:
        return compute(inputs, out)
    work = [_pool().submit(compute, _rows(inputs, n, *part), out[slice(*part)]) for part in parts]
    return max([future.result() for future in work])  # this waits until all threads have finished


def in_parts(compute: Callable[[slice], None], n: int, threads: int | None) -> None:
    """Compute `n` rows with NumPy in parts, so that the memory for intermediate results does not grow with n.

    Args:
        compute: Computes the rows of a slice. For an empty batch it is called once, with an empty slice.
        n: Number of rows.
        threads: Largest number of threads, as in `in_blocks`.

    Raises:
        InputError: `threads` is not an integer of at least 1.
    """
    threads = default_threads(n) if threads is None else whole_number(threads, "threads", 1)
    parts = [slice(i, min(i + PART, n)) for i in range(0, max(n, 1), PART)]
    count = min(threads, len(parts), _processors())
    shares = [parts[k::count] for k in range(count)]

    def compute_all(share: Sequence[slice]) -> None:
        for part in share:
            compute(part)

    if len(shares) == 1:
        return compute_all(parts)
    work = [_pool().submit(compute_all, share) for share in shares]
    wait(work)  # an error is raised only after all threads have finished writing
    for future in work:
        future.result()
    return None


def _parts(n: int, threads: int) -> list[tuple[int, int]]:
    """Split `n` rows into at most `threads` parts of whole blocks; each part has at least one block."""
    blocks = n // LANES
    edges = [*(LANES * (blocks * i // threads) for i in range(threads)), n]
    return [(a, b) for a, b in pairwise(edges) if a < b]


def _rows(inputs: Sequence[FloatArray], n: int, start: int, stop: int) -> list[FloatArray]:
    return [x[start:stop] if len(x) == n else x for x in inputs]


@cache
def _pool() -> ThreadPoolExecutor:
    """Return the thread pool of this process; a forked child process starts a new thread pool."""
    return ThreadPoolExecutor(_processors(), thread_name_prefix="urdfkin")


os.register_at_fork(after_in_child=_pool.cache_clear)
