"""Pinocchio in a process for each processor: each loops over its share, in memory that all of them see."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np

from scripts.benchmarking.contenders.pinocchio_loop import pinocchio_calls
from scripts.benchmarking.subject import QUANTITIES, Subject
from scripts.benchmarking.work import Work
from urdfkin.tree import FloatArray

LIBRARY = "pin"
WORKERS = len(os.sched_getaffinity(0))
PROCESSES = f"Pinocchio, {WORKERS} processes"

#: A worker's own: the loop of each quantity, and the arrays it reads and writes.
_here: dict[str, Any] = {}


def batches(subject: Subject, quantity: str) -> Iterator[Work]:
    """The whole batch, spread over processes that were started before and copy nothing."""
    if not subject.n:
        return
    spawn: Any = multiprocessing.get_context("spawn")
    buffers, arrays = [], []
    for x in (*subject.inputs(quantity, subject.n), np.zeros((subject.n, *subject.width(quantity)))):
        buffer = spawn.RawArray("d", x.size)
        buffers.append((buffer, x.shape))
        arrays.append(_array(buffer, x.shape))
        arrays[-1][...] = x
    pool = subject.stack.enter_context(
        ProcessPoolExecutor(WORKERS, spawn, _start, (subject.urdf, subject.frame, quantity, buffers))
    )
    edges = [subject.n * i // WORKERS for i in range(WORKERS + 1)]

    def compute() -> None:
        for done in [pool.submit(_share, *edges[i : i + 2]) for i in range(WORKERS)]:
            done.result()

    yield Work(PROCESSES, subject.n, compute, lambda: arrays[-1])


def _array(buffer: Any, shape: Sequence[int]) -> FloatArray:
    return np.frombuffer(buffer).reshape(shape)


def _start(urdf: str, frame: str, quantity: str, buffers: Sequence[tuple[Any, tuple[int, ...]]]) -> None:
    """In a worker: make a model and find the memory."""
    if quantity not in QUANTITIES:
        raise ValueError(quantity)
    _here["loop"] = pinocchio_calls(urdf, frame, quantity).loop()
    _here["arrays"] = [_array(*buffer) for buffer in buffers]


def _share(start: int, stop: int) -> None:
    """In a worker: a share of the batch."""
    *inputs, out = (x[start:stop] for x in _here["arrays"])
    _here["loop"](out, *inputs)
