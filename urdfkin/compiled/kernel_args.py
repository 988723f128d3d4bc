"""The arguments of a compiled kernel, stored as one row of integers: addresses, sizes and options."""

from __future__ import annotations

from enum import IntEnum, auto

import numpy as np

from urdfkin.compiled.program import LANES, Program
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray

#: Size of a cache line of the processor, bytes. Access to a vector that lies across two cache lines takes
#: twice as long.
_LINE = 64
#: The reference frames that the kernels support, each with its number in a kernel. Any other reference frame
#: raises a KeyError.
REFERENCES = {
    known: int(known) for known in (Reference.LOCAL, Reference.WORLD, Reference.LOCAL_WORLD_ALIGNED)
}


class KernelArgs(IntEnum):
    """Index of each argument in the row of integers.

    Arguments from CORE on are for calls with one configuration.
    """

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
    #: Distance in memory between the first numbers of two consecutive configurations; 0 if all configurations
    #: use the same numbers.
    STRIDE_Q = auto()
    STRIDE_V = auto()
    STRIDE_A = auto()
    STRIDE_BASE = auto()
    OUT = auto()
    #: Number of output numbers for one configuration.
    WIDTH = auto()
    #: Address of a buffer that collects the results of a block before they are written to the output; 0 if
    #: they are written directly.
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
    """Return memory for the intermediate results of one run of a program."""
    return lines(program.rows * LANES)


def lines(count: int) -> FloatArray:
    """Return memory for `count` numbers that begins at the start of a cache line."""
    numbers = np.empty(count + _LINE // 8)
    first = -numbers.ctypes.data % _LINE // 8
    return numbers[first : first + count]
