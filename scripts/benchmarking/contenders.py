"""The contenders: urdfkin, Pinocchio, code generated for one robot, and other installed libraries."""

from __future__ import annotations

import multiprocessing
import os
import shutil
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from importlib import metadata, util
from typing import Any

import numpy as np
import pinocchio as pin

from scripts.benchmarking import generated, peers
from scripts.benchmarking.calls import Calls
from scripts.benchmarking.subject import QUANTITIES, Subject
from scripts.benchmarking.timing import Work
from urdfkin.model.tree import FloatArray

ONE = "urdfkin, 1 thread"
FRESH = "urdfkin, 1 thread, no out="
FLOOR = "output written once (fill)"
PROCESSORS = len(os.sched_getaffinity(0))
COMPILED = "urdfkin, compiled for this robot, 1 thread"
SEVERAL = f"urdfkin, {PROCESSORS} threads"
LOOP = "Pinocchio, Python loop"
PROCESSES = f"Pinocchio, {PROCESSORS} processes"


@dataclass(frozen=True)
class Contender:
    """A library and its functions for a quantity.

    Attributes:
        library: Name of the distribution.
        module: Name of the module.
        calls: Returns the library's calls for one configuration.
        batches: Returns the library's computations of a batch; None: the calls run in a loop.
        program: Another program that the library needs.
    """

    library: str
    module: str
    calls: Callable[[Subject, str], Iterator[Calls]] | None = None
    batches: Callable[[Subject, str], Iterator[Work]] | None = None
    program: str | None = None

    @property
    def missing(self) -> str | None:
        """Return the reason why the library cannot run, or None if it can run."""
        if util.find_spec(self.module) is None:
            return "not installed"
        if self.program and shutil.which(self.program) is None:
            return f"left out, no {self.program}"
        return None

    @property
    def state(self) -> str:
        """Return the library's version, or the reason why the library cannot run."""
        try:
            return self.missing or metadata.version(self.library)
        except metadata.PackageNotFoundError:
            return "a checkout"

    def works(self, subject: Subject, quantity: str) -> list[Work]:
        """Return the library's computations of a whole batch."""
        if self.missing:
            return []
        if self.batches is not None:
            return list(self.batches(subject, quantity))
        return [one.batch(subject, quantity) for one in self.singles(subject, quantity)]

    def singles(self, subject: Subject, quantity: str) -> list[Calls]:
        """Return the library's calls for one configuration."""
        return [] if self.missing or self.calls is None else list(self.calls(subject, quantity))


# -- urdfkin ---------------------------------------------------------------------------------------------


def urdfkin_batches(subject: Subject, quantity: str) -> Iterator[Work]:
    """Yield the timed tasks for a batch, with different threads and memory; one only writes the output."""
    method = getattr(subject.robot, quantity)
    inputs = subject.inputs(quantity, subject.n)
    out = np.empty((subject.n, *subject.width(quantity)))
    last: list[FloatArray] = []

    def into(threads: int) -> Callable[[], object]:
        return lambda: method(*inputs, subject.frame, out=out, threads=threads, verify=False)

    def fresh() -> None:
        last[:] = [method(*inputs, subject.frame, threads=1, verify=False)]

    yield Work(ONE, subject.n, into(1), lambda: out)
    if PROCESSORS > 1:
        yield Work(SEVERAL, subject.n, into(PROCESSORS), lambda: out)
    yield Work(FRESH, subject.n, fresh, lambda: last[0])
    fast, own = getattr(subject.robot.compiled(subject.frame), quantity), np.empty_like(out)
    yield Work(COMPILED, subject.n, lambda: fast(*inputs, out=own, threads=1), lambda: own)
    floor = np.empty_like(out)
    yield Work(FLOOR, subject.n, lambda: floor.fill(1.0))


def urdfkin_calls(subject: Subject, quantity: str) -> Iterator[Calls]:
    """Yield the calls of the robot's method, and of a prepared frame with and without `out=`."""
    robot, arguments = subject.robot, "q" if quantity == "jacobian" else "q, v, a"
    names = {"fast": robot.prepare(subject.frame), "own": robot.compiled(subject.frame)}
    lines = (
        f"robot.{quantity}({arguments}, frame, verify=False)",
        f"fast.{quantity}({arguments})",
        f"fast.{quantity}({arguments}, out=out)",
        f"own.{quantity}({arguments}, out=out)",
    )
    yield from _urdfkin_lines(subject, quantity, names, lines)


def checked_calls(subject: Subject, quantity: str) -> Iterator[Calls]:
    """Yield two verified calls: the robot's method, and the same method of a prepared frame."""
    arguments = "q" if quantity == "jacobian" else "q, v, a"
    lines = f"robot.{quantity}({arguments}, frame, verify=True)", f"fast.{quantity}({arguments})"
    names = {"fast": subject.robot.prepare(subject.frame, verify=True)}
    yield from _urdfkin_lines(subject, quantity, names, lines)


def _urdfkin_lines(
    subject: Subject, quantity: str, more: dict[str, Any], lines: Sequence[str]
) -> Iterator[Calls]:
    out = np.empty(subject.width(quantity))
    names = {"robot": subject.robot, "frame": subject.frame, "out": out, **more}
    for line in lines:
        who, _, given = line.replace("fast", "prepared").replace("own", "compiled").partition("(")
        shown = [word for word in ("verify=False", "verify=True", "out=") if word in given]
        yield Calls(f"urdfkin, {who}({', '.join(shown)})", names, (line,))


# -- Pinocchio -------------------------------------------------------------------------------------------


def pinocchio_calls(urdf: str, frame: str, quantity: str) -> Calls:
    """Return Pinocchio's cheapest calls for a quantity.

    The calls are `computeFrameJacobian`, or a recursion and `getFrameClassicalAcceleration`.
    """
    model = pin.buildModelFromXML(urdf)
    names = {
        "model": model,
        "data": model.createData(),
        "frame": model.getFrameId(frame),
        "aligned": pin.LOCAL_WORLD_ALIGNED,
        "jacobian": pin.computeFrameJacobian,
        "forward": pin.forwardKinematics,
        "acceleration": pin.getFrameClassicalAcceleration,
    }
    if quantity == "jacobian":
        return Calls(LOOP, names, ("jacobian(model, data, q, frame, aligned)",))
    forward, get = "forward(model, data, q, v, a)", "acceleration(model, data, frame, aligned)"
    return Calls(
        LOOP,
        names,
        (forward, get),
        store=(forward, f"out[k] = {get}.vector"),
        read_one=lambda motion: np.array(motion.vector),
    )


def all_joints_calls(subject: Subject) -> Calls:
    """Return the calls for all joints: `computeJointJacobians` and `getFrameJacobian`."""
    usual = pinocchio_calls(subject.urdf, subject.frame, "jacobian")
    names = {**usual.names, "compute": pin.computeJointJacobians, "get": pin.getFrameJacobian}
    return Calls(LOOP, names, ("compute(model, data, q)", "get(model, data, frame, aligned)"))


def _pinocchio(subject: Subject, quantity: str) -> Iterator[Calls]:
    yield pinocchio_calls(subject.urdf, subject.frame, quantity)


def _pinocchio_batches(subject: Subject, quantity: str) -> Iterator[Work]:
    yield pinocchio_calls(subject.urdf, subject.frame, quantity).batch(subject, quantity)
    yield _in_processes(subject, quantity)


#: State of a worker process. For each quantity, it contains the loop and the arrays of this loop.
_here: dict[str, Any] = {}


def _in_processes(subject: Subject, quantity: str) -> Work:
    """Return the timed task in which several running processes with shared memory compute a batch."""
    spawn: Any = multiprocessing.get_context("spawn")
    buffers, arrays = [], []
    for x in (*subject.inputs(quantity, subject.n), np.zeros((subject.n, *subject.width(quantity)))):
        buffer = spawn.RawArray("d", x.size)
        buffers.append((buffer, x.shape))
        arrays.append(_array(buffer, x.shape))
        arrays[-1][...] = x
    pool = subject.stack.enter_context(
        ProcessPoolExecutor(PROCESSORS, spawn, _start, (subject.urdf, subject.frame, quantity, buffers))
    )
    edges = [subject.n * i // PROCESSORS for i in range(PROCESSORS + 1)]

    def compute() -> None:
        for done in [pool.submit(_share, *edges[i : i + 2]) for i in range(PROCESSORS)]:
            done.result()

    return Work(PROCESSES, subject.n, compute, lambda: arrays[-1])


def _array(buffer: Any, shape: Sequence[int]) -> FloatArray:
    return np.frombuffer(buffer).reshape(shape)


def _start(urdf: str, frame: str, quantity: str, buffers: Sequence[tuple[Any, tuple[int, ...]]]) -> None:
    """In a worker, make a model and open the shared memory."""
    if quantity not in QUANTITIES:
        raise ValueError(quantity)
    _here["loop"] = pinocchio_calls(urdf, frame, quantity).loop()
    _here["arrays"] = [_array(*buffer) for buffer in buffers]


def _share(start: int, stop: int) -> None:
    """In a worker, compute a part of the batch."""
    *inputs, out = (x[start:stop] for x in _here["arrays"])
    _here["loop"](out, *inputs)


# -- all contenders --------------------------------------------------------------------------------------

#: Contenders that must be installed.
ALWAYS = (
    Contender("urdfkin", "urdfkin", urdfkin_calls, urdfkin_batches),
    Contender("pin", "pinocchio", _pinocchio, _pinocchio_batches),
)
PEERS = (
    Contender("casadi", "casadi", batches=generated.batches, program=generated.COMPILER),
    Contender("dynibo", "dynibo", peers.dynibo),
    Contender("mujoco", "mujoco", peers.mujoco),
    Contender("drake", "pydrake", peers.drake),
    Contender("roboticstoolbox-python", "roboticstoolbox", peers.toolbox),
    Contender("pytorch-kinematics", "pytorch_kinematics", batches=peers.torch),
    Contender("jax", "jax", batches=peers.jax),
)
