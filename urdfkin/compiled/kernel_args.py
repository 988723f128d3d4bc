"""What a core is told, as one row of whole numbers: addresses, sizes, and what is wanted."""

from __future__ import annotations

from enum import IntEnum, auto

import numpy as np

from urdfkin.compiled.memory import LANES
from urdfkin.compiled.program import Program
from urdfkin.model.tree import FloatArray

#: Bytes of a cache line, over two of which no vector may reach: that halves the speed.
_LINE = 64


class KernelArgs(IntEnum):
    """Places in the row; the last ones are for who computes one configuration after the other (`single`)."""

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
    #: The base's state (rows of 24 numbers); 0 where it stands still at the world's origin.
    BASE = auto()
    #: From the numbers of one configuration to those of the next; 0 where they are the same for all.
    STRIDE_Q = auto()
    STRIDE_V = auto()
    STRIDE_A = auto()
    STRIDE_BASE = auto()
    OUT = auto()
    #: Numbers that one configuration puts there.
    WIDTH = auto()
    #: Where a block's results come together on their way there; 0 where they go there at once.
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
    """Memory for a walk to work in."""
    return lines(program.rows * LANES)


def lines(count: int) -> FloatArray:
    """Memory for so many numbers, whose address is a cache line's."""
    numbers = np.empty(count + _LINE // 8)
    first = -numbers.ctypes.data % _LINE // 8
    return numbers[first : first + count]
