"""Which results of a call are checked: all of them, none, or a stated number."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import numpy as np

from urdfkin.compiled.plan import IntArray
from urdfkin.errors import InputError
from urdfkin.errors.demands import shown

#: Every result, no result, or those of `SAMPLE` configurations.
Verify = bool | Literal["sample"]

#: How many configurations of a call `verify="sample"` checks.
SAMPLE = 100

#: Numbers and configurations compared at a time: few enough for a cache and for memory not to grow with a
#: batch, many enough for array expressions to be worth their call.
_AT_A_TIME = 131_072
_MOST = 4096


def checked_choice(verify: object) -> Verify:
    """What was asked for.

    Raises:
        InputError: it is none of True, False and "sample".
    """
    if verify is True or verify is False:
        return verify
    if isinstance(verify, str) and verify == "sample":
        return "sample"
    raise InputError('verify is True, False or "sample"', found=shown(verify))


def parts(verify: Verify, n: int, numbers: int) -> Iterator[slice | IntArray]:
    """The configurations to check, of `n`, in parts of a good size.

    Args:
        verify: True or "sample".
        n: How many configurations there are.
        numbers: How many numbers the results of one have.

    Yields:
        Indices. A sample is drawn without regard to order, which a batch often has, and always the same.
    """
    step = min(_MOST, max(1, _AT_A_TIME // max(1, numbers)))
    if verify == "sample" and n > SAMPLE:
        drawn = np.sort(np.random.default_rng(0).choice(n, SAMPLE, replace=False))
        yield from (drawn[i : i + step] for i in range(0, SAMPLE, step))
    else:
        yield from (slice(i, min(i + step, n)) for i in range(0, n, step))
