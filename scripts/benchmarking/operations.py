"""Count the additions and multiplications that compute a result for one configuration.

The module calls urdfkin's functions with objects that record each operation. A fused multiply-add counts as
two operations, because manufacturers also count two for the peak performance of a processor. The negation -x
does not count. A product with the constant 0 or 1 does not count.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from types import FunctionType, SimpleNamespace
from typing import Any

import numpy as np

from urdfkin.compiled import outputs, recursion
from urdfkin.compiled.plan import (
    AXIS_ROWS,
    INSTRUCTION_WIDTH,
    CompiledTree,
    Op,
    ProgramHeader,
    compile_program,
)
from urdfkin.kinematics.arithmetic import bind_equations

#: Operations for sine and cosine of one angle (`compiled.python_numbers`). 10 operations reduce the angle to
#: r, and 8 operations compute z = r^2, 1 - z/2 and their rounding errors. 20 operations evaluate the two
#: polynomials, and 13 operations combine the values.
_SINE_COSINE = 51


@dataclass(frozen=True, eq=False)
class Number:
    """A number that records an operation instead of a value."""

    constant: int | None = None  # 0 or 1; None for any other number
    unused: bool = False  # True for a placeholder; operations with a placeholder do not count
    operands: tuple[Number, ...] = ()  # both operands of the operation; empty for an input or a constant

    def __add__(self, other: Number) -> Number:
        if self.unused or other.unused:
            return self if self.unused else other
        if self.constant == 0 or other.constant == 0:
            return other if self.constant == 0 else self
        return Number(operands=(self, other))

    __sub__ = __add__

    def __mul__(self, other: Number) -> Number:
        if self.unused or other.unused:
            return self if self.unused else other
        if self.constant is not None:
            return other if self.constant else self
        if other.constant is not None:
            return self if other.constant else other
        return Number(operands=(self, other))

    def __rmul__(self, other: int) -> Number:
        return self * Number()

    def __rsub__(self, other: int) -> Number:
        return self + Number()

    def __neg__(self) -> Number:
        return self


def count_shared(results: Any) -> int:
    """Count the operations; a shared operation counts once."""
    waiting, visited = [results], set[Number]()
    while waiting:
        value = waiting.pop()
        if isinstance(value, Number):
            if value.operands and value not in visited:
                visited.add(value)
                waiting += value.operands
        elif isinstance(value, tuple | list):
            waiting += value
    return len(visited)


@dataclass
class _RecordedRecursion:
    written: list[Any] = field(default_factory=list)

    def __post_init__(self) -> None:
        x, zero, one, unused = Number(), Number(0), Number(1), Number(unused=True)
        triple = (x, x, x)
        self.names: dict[str, Any] = {
            "eq": bind_equations(),
            **{
                name: lambda *_: x for name in ("load_number", "load_number_if", "load_constant", "broadcast")
            },
            **{name: lambda *_: triple for name in ("load_vector", "_constant_vector", "_load_vector_if")},
            **{
                name: lambda *words: self.written.append(words[-1])
                for name in ("store_number", "store_vector")
            },
            **{name: lambda *_: None for name in ("write_rows", "array_data")},
            "_joint_coordinate": lambda *_: x,
            "_joint_rate": lambda *_: x,
            "zero": lambda: zero,
            "one": lambda: one,
            "unused": lambda: unused,
        }
        for module in (recursion, outputs):
            for name, value in vars(module).items():
                if isinstance(value, FunctionType):
                    self.names.setdefault(name, FunctionType(value.__code__, self.names, name))
                elif isinstance(value, int | np.ndarray):
                    self.names.setdefault(name, value)
        self.call = SimpleNamespace(**self.names)
        self.state = (triple, triple, triple), triple, triple, triple, triple, triple


def count_operations(plan: CompiledTree, quantity: str) -> int:
    """Count the operations for one frame in LOCAL_WORLD_ALIGNED."""
    columns = quantity == "jacobian"
    program, run = compile_program(plan, orientations=False, columns=columns), _RecordedRecursion()
    words: list[int] = program.words.tolist()
    angles = (words[ProgramHeader.ANGLES_END] - words[ProgramHeader.ANGLES]) // 4
    output = {"jacobian": "placement"}.get(quantity, quantity)
    state = getattr(run.call, f"state_for_{output}")(run.state)
    total, position = angles * _SINE_COSINE, int(words[ProgramHeader.CODE])
    while words[position] != Op.END:
        total += _count_instruction(run, words[position : position + INSTRUCTION_WIDTH], quantity, state)
        position += INSTRUCTION_WIDTH
    return total


def _count_instruction(
    run: _RecordedRecursion, instruction: list[int], quantity: str, state: tuple[Any, ...]
) -> int:
    op, row, _, flags, c = instruction
    run.written.clear()
    world = run.call.select_world_axes
    if op <= Op.ROTATE:
        return count_shared(run.call._execute_transform(world, op, state, None, c))
    if op <= Op.FLOATING:
        return count_shared(run.call._execute_joint(world, op, state, None, row, 0, 0, flags, None, c))
    if op == Op.COLUMN:
        run.call.write_jacobian_column(None, row % AXIS_ROWS, 0, flags, None, c, 2, state)
    elif op == Op.WRITE and quantity != "jacobian":
        write = run.call.write_velocity if quantity == "velocity" else run.call.write_acceleration
        write(1, None, [1] * len(ProgramHeader), 0, 0, 0, 2, state, None)
    return count_shared(run.written)
