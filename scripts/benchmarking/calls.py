"""Write Python lines that call a library to compute one quantity of one configuration.

The benchmark runs these lines in a loop over many configurations, or for a single configuration.

The lines become the body of a loop, and their names become local variables. Therefore, the measured time of a
library includes no function call of the benchmark.
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
    """The calls with which a library computes one quantity of one configuration.

    Attributes:
        who: Name of the contender.
        names: Variables that the lines use, besides `q`, `v` and `a`.
        lines: The calls; the last line is an expression whose value is the result.
        store: The lines for a batch, which write their result to `out[k]`. None: the batch runs `lines`, and
            stores the value of the last line in `out[k]`.
        order: For each coordinate of the library, its index among urdfkin's coordinates. None: the library
            and urdfkin have the same order.
        shape: Shape of one configuration's result in a batch; None: urdfkin's shape.
        read: Converts a batch's raw results to urdfkin's conventions.
        read_one: Converts the value of the last line to an array with the layout of one row of a batch.
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
        """Return the timed task for a batch: a loop over all configurations that fills a reused array."""
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
        """Return a function with the loop.

        The arguments of the function are `out` and the batch of q, or the batches of q, v and a.
        """
        body = self.store or (*self.lines[:-1], f"out[k] = {self.lines[-1]}")
        return _function(self.names, "out, *inputs", "for k, (q, v, a) in enumerate(rows(inputs)):", body)

    def single(self, subject: Subject, quantity: str) -> Work:
        """Return the timed task for single calls.

        The results of these calls are not stored, and the rows of the inputs are prepared beforehand.
        """
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
    """Yield (q, v, a) for each configuration. If q is the only input, yield (q, q, q) instead."""
    return zip(*(inputs if len(inputs) == 3 else [inputs[0]] * 3), strict=True)


def _function(
    names: Mapping[str, Any], arguments: str, head: str, body: tuple[str, ...]
) -> Callable[..., Any]:
    """Make a function whose code is the line `head` and, below it, the indented lines `body`.

    The code can use `names` as local variables.
    """
    here = {"rows": _rows, **names}
    parameters = ", ".join((arguments, *(f"{name}={name}" for name in here)))
    source = "\n".join([f"def function({parameters}):", f"    {head}", *(f"        {line}" for line in body)])
    exec(compile(source, "<calls>", "exec"), here)
    function: Callable[..., Any] = here["function"]
    return function
