"""A batch spread over threads.

No configuration depends on its neighbours: results are equal for any number of threads, to the last bit.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from functools import cache
from itertools import pairwise

from urdfkin.compiled.memory import LANES
from urdfkin.errors.validators import whole_number
from urdfkin.model.tree import FloatArray

#: A batch is spread over threads by itself only from here on: a thread costs some ten microseconds.
_WORTH_THREADS = 4096

#: As many rows are computed at a time where NumPy does it: what it keeps meanwhile fits a cache.
PART = 2048

#: Computes rows of inputs into rows of an output, (inputs, out); 0, or 1 where an input is not ordinary.
Compute = Callable[[Sequence[FloatArray], FloatArray], int]


def default_threads(n: int) -> int:
    """One thread for each processor this process may use, for batches that are worth it."""
    return _processors() if n >= _WORTH_THREADS else 1


def _processors() -> int:
    """How many this process may use: more threads would wait for each other."""
    return len(os.sched_getaffinity(0))


def in_blocks(compute: Compute, inputs: Sequence[FloatArray], out: FloatArray, threads: int | None) -> int:
    """Compute `out` (n, ...) from `inputs`, each (n, ...) or (1, ...) for all; whether any is not ordinary.

    Args:
        compute: Releases the interpreter's lock.
        inputs: C-contiguous.
        out: C-contiguous.
        threads: How many at most; None for `default_threads`.

    Raises:
        InputError: `threads` is no whole number from 1 on.
    """
    n = len(out)
    threads = default_threads(n) if threads is None else whole_number(threads, "threads", 1)
    if n == 0:
        return 0
    parts = _parts(n, min(threads, max(n // LANES, 1), _processors()))
    if len(parts) == 1:
        return compute(inputs, out)
    work = [_pool().submit(compute, _rows(inputs, n, *part), out[slice(*part)]) for part in parts]
    return max([future.result() for future in work])  # waits for all of them


def in_parts(compute: Callable[[slice], None], n: int, threads: int | None) -> None:
    """Have NumPy compute `n` rows part by part: what it needs meanwhile does not grow with `n`.

    Args:
        compute: Computes some rows. An empty batch is one empty part.
        n: How many rows.
        threads: As `in_blocks`.

    Raises:
        InputError: `threads` is no whole number from 1 on.
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
    wait(work)  # nobody writes any more when an error is told
    for future in work:
        future.result()
    return None


def _parts(n: int, threads: int) -> list[tuple[int, int]]:
    """Cut `n` rows between blocks, into at most `threads` runs of a block or more."""
    blocks = n // LANES
    edges = [*(LANES * (blocks * i // threads) for i in range(threads)), n]
    return [(a, b) for a, b in pairwise(edges) if a < b]


def _rows(inputs: Sequence[FloatArray], n: int, start: int, stop: int) -> list[FloatArray]:
    return [x[start:stop] if len(x) == n else x for x in inputs]


@cache
def _pool() -> ThreadPoolExecutor:
    """The threads, which a forked child does not have: it starts its own."""
    return ThreadPoolExecutor(_processors(), thread_name_prefix="urdfkin")


os.register_at_fork(after_in_child=_pool.cache_clear)
