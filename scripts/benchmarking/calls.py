"""A library that takes one configuration at a time: its calls as lines of Python, in a loop or by themselves.

The lines are put into a loop's body as they stand, with their names as local variables: no contender pays
for a function of the benchmark's around its calls.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from scripts.benchmarking.subject import Subject
from scripts.benchmarking.timing import TOLERANCE, Work
from urdfkin.model.tree import FloatArray


@dataclass(frozen=True)
class Calls:
    """How a library computes one quantity of one configuration.

    Attributes:
        who: The contender.
        names: What the lines use beside `q`, `v` and `a`.
        lines: The calls; the last line is an expression, the result.
        store: The lines for a batch, which write `out[k]`; None: the lines, with the last one's value
            stored.
        order: For each of the library's coordinates, which of urdfkin's it is; None: the same order.
        shape: Of the array that a batch is written to, for one configuration; None: urdfkin's shape.
        read: The batch's raw results in urdfkin's conventions.
        read_one: The last line's value as an array like a row of the raw results.
        remark: See `Work`.
    """

    who: str
    names: Mapping[str, Any]
    lines: tuple[str, ...]
    store: tuple[str, ...] | None = None
    order: list[int] | None = None
    shape: tuple[int, ...] | None = None
    read: Callable[[FloatArray], FloatArray] = field(default=lambda raw: raw)
    read_one: Callable[[Any], FloatArray] = field(default=np.array)
    remark: str = ""

    def batch(self, subject: Subject, quantity: str) -> Work:
        """The calls for one configuration after the other, results stored in a reused array."""
        inputs = [self._ordered(x) for x in subject.inputs(quantity, subject.loop)]
        out = np.empty((subject.loop, *(self.shape or subject.width(quantity))))
        loop = self.loop()
        return Work(
            self.who,
            subject.loop,
            lambda: loop(out, *inputs),
            lambda: self.read(out),
            remark=self.remark,
        )

    def loop(self) -> Callable[..., None]:
        """A function of `out` and of q, or of q, v and a, each a batch."""
        body = self.store or (*self.lines[:-1], f"out[k] = {self.lines[-1]}")
        return _function(self.names, "out, *inputs", "for k, (q, v, a) in enumerate(rows(inputs)):", body)

    def single(self, subject: Subject, quantity: str) -> Work:
        """The calls alone, results dropped; rows of the inputs are made beforehand."""
        inputs = [list(self._ordered(x)) for x in subject.inputs(quantity, subject.loop)]
        rows = list(_rows(inputs))
        repeat = _function(self.names, "rows_", "for q, v, a in rows_:", self.lines)
        last = (*self.lines[:-1], f"return {self.lines[-1]}")
        one = _function(self.names, "q, v, a", "if True:", last)

        def result() -> FloatArray:
            return self.read(np.stack([self.read_one(one(*row)) for row in rows[:20]]))

        return Work(self.who, len(rows), lambda: repeat(rows), result, TOLERANCE, self.remark)

    def _ordered(self, x: FloatArray) -> FloatArray:
        return x if self.order is None else np.ascontiguousarray(x[:, self.order])


def _rows(inputs: Any) -> Any:
    """(q, v, a) for each configuration; where only q is given it stands for all three."""
    return zip(*(inputs if len(inputs) == 3 else [inputs[0]] * 3), strict=True)


def _function(
    names: Mapping[str, Any], arguments: str, head: str, body: tuple[str, ...]
) -> Callable[..., Any]:
    """A function with `names` as local variables, whose body is `head` with `body` in it."""
    here = {"rows": _rows, **names}
    parameters = ", ".join((arguments, *(f"{name}={name}" for name in here)))
    source = "\n".join([f"def function({parameters}):", f"    {head}", *(f"        {line}" for line in body)])
    exec(compile(source, "<calls>", "exec"), here)
    function: Callable[..., Any] = here["function"]
    return function
