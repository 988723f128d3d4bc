"""The arguments of a kernel as one row of integers: addresses, sizes and options."""

from __future__ import annotations

from enum import IntEnum, auto

import numpy as np

from urdfkin.compiled.program import LANES, Program
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray

#: Bytes of a cache line. A vector across two lines would halve the speed.
_LINE = 64
#: The reference frames that the kernels support, each with its number in a kernel. Other frames raise a
#: KeyError.
REFERENCES = {
    known: int(known) for known in (Reference.LOCAL, Reference.WORLD, Reference.LOCAL_WORLD_ALIGNED)
}


class KernelArgs(IntEnum):
    """Indices of the arguments in the row; those from CORE on are for calls with one configuration."""

    @staticmethod
    def _generate_next_value_(name: str, start: int, count: int, last_values: list[int]) -> int:
        return count

    PROGRAM = auto()
    CONSTANTS = auto()
    SCRATCH = auto()
    REFERENCE = auto()
    N = auto()
    Q = auto()
    V = auto()
    A = auto()
    #: Address of the base's state (rows of 24 numbers); 0 for a fixed base at the world's origin.
    BASE = auto()
    #: Distance between the first numbers of two consecutive configurations; 0 if all configurations share
    #: them.
    STRIDE_Q = auto()
    STRIDE_V = auto()
    STRIDE_A = auto()
    STRIDE_BASE = auto()
    OUT = auto()
    #: Number of output numbers for one configuration.
    WIDTH = auto()
    #: Address of a buffer that collects a block's results before output; 0 for direct output.
    STAGE = auto()

    CORE = auto()
    NQ = auto()
    NV = auto()
    ORDERS = auto()
    AXES = auto()
    ROWS = auto()
    COLUMNS = auto()
    BUSY = auto()
    COUNT = auto()


def scratch(program: Program) -> FloatArray:
    """Return scratch memory for a run of a program."""
    return lines(program.rows * LANES)


def lines(count: int) -> FloatArray:
    """Return memory for `count` numbers, aligned to a cache line."""
    numbers = np.empty(count + _LINE // 8)
    first = -numbers.ctypes.data % _LINE // 8
    return numbers[first : first + count]
