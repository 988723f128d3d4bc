"""Compile the kinematics of one frame to machine code, the fastest way to compute in urdfkin.

The first call of a quantity compiles exported C code with the system's compiler, and compares the results
with Pinocchio. Without a C compiler, urdfkin uses the forward recursion, which Numba compiles.

A cache stores the machine code with checksums. The key consists of the C code, the compiler's version and
options, and the processor's features. On Linux, urdfkin loads the code from memory, so that no other program
can change the code after the test of the checksum. On other systems, urdfkin loads the code from a temporary
file.
"""

from __future__ import annotations

import ctypes
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cache, partial
from itertools import count
from pathlib import Path
from typing import Any, Protocol, TypeGuard

import numpy as np

from urdfkin.compiled.evaluate import check_finite, compute_in_threads, uses_buffer
from urdfkin.compiled.kernel_cache import compile_lock
from urdfkin.compiled.plan import LANES, CompiledTree, KernelArgs, address, aligned_empty
from urdfkin.compiled.prepared import FastFunction
from urdfkin.compiled.python_numbers import NO_OVERFLOW_BOUND
from urdfkin.errors import NotFiniteError
from urdfkin.export.c import InputLayout, advance_pointers, c_file, fill_template, min_configuration_count
from urdfkin.export.code import FrameCode, make_unverified_code
from urdfkin.export.proof import PROOF_SAMPLES
from urdfkin.model.configuration import draw_samples, warn_of_degrees
from urdfkin.model.configuration_like import ConfigurationLike
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray
from urdfkin.system.cache import make_cache_folder, read_cached_file, write_cached_file
from urdfkin.system.locks import import_lock, make_fork_safe_lock
from urdfkin.verify.call import Call
from urdfkin.verify.quantities import QUANTITIES, Quantity
from urdfkin.verify.verifier import Verifier

_FLAGS = ("-std=c99", "-O3", "-march=native", "-ffp-contract=fast", "-fno-math-errno", "-fPIC", "-shared")
#: By default, GCC uses only half the width of 512-bit vector registers on many processors.
_WHOLE_REGISTERS = {"x86_64": ("-mprefer-vector-width=512",)}
_TIME_LIMIT = 600.0
_load_counter = count()


class NoCompilerError(Exception):
    """No C compiler accepts the code."""


def load_library(code: FrameCode) -> ctypes.CDLL:
    """Compile one function, and load the library.

    The library contains a function `task`. Its argument is an array with the fields of `KernelArgs`. The
    function returns 1 if an input is not finite or too large, else 0.

    Raises:
        NoCompilerError: no C compiler is installed, or the compiler rejects the code.
    """
    if (compiler := shutil.which("cc")) is None:
        raise NoCompilerError("cc is not installed")
    text = c_file(code) + _entry_point(code)
    flags = (*_FLAGS, *_WHOLE_REGISTERS.get(platform.machine(), ()))
    folder = make_cache_folder(
        "library", [], text, *flags, _compiler_version(compiler), _processor_features()
    )
    data = read_cached_file(folder / "machine.code") if folder else None
    if data is None:
        data = _compile(text, [compiler, *flags])
        if folder:
            write_cached_file(folder / "machine.code", data)
    return _load_code(data)


def _entry_point(code: FrameCode) -> str:
    (function,) = code.functions
    widths, layout = code.widths(function), InputLayout(function)
    spread = (
        f"    for (int k = 0; k < LANES; ++k) in[{i} * LANES + k] = {x.op}[{x.operands[0]}];"
        for i, x in enumerate(layout.inputs)
    )
    lines = {
        "inputs": "    const double *{x} = (const double *)(uintptr_t)places[{index}];",
        "look": "        look({width}, {x}, bad);",
        "look_left": "    for (size_t i = 0; i < n * {width}; ++i) bad[0][0] += 0.0 * (GROWTH * {x}[i]);",
    }
    texts = {
        name: "\n".join(
            line.format(x=x, width=width, index=int(KernelArgs[x.upper()])) for x, width in widths.items()
        )
        for name, line in lines.items()
    }
    return fill_template(
        "library.c",
        growth=repr(sys.float_info.max / NO_OVERFLOW_BOUND),
        N=int(KernelArgs.N),
        OUT=int(KernelArgs.OUT),
        STAGE=int(KernelArgs.BUFFER),
        title=code.name,
        name=function.name,
        passed=", ".join(widths),
        inputs_of_one=", ".join(f"const double *{x}" for x in widths),
        size=layout.size,
        spread="\n".join([*(f"    (void){x};" for x in widths), *spread]),
        count=len(function.results),
        reserve=min_configuration_count(code, function),
        advance=advance_pointers(code, function),
        **texts,
    )


def _compile(text: str, command: list[str]) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        source, library = Path(folder, "robot.c"), Path(folder, "robot.so")
        source.write_text(text, encoding="utf-8")
        done = subprocess.run(
            [*command, str(source), "-o", str(library), "-lm"],
            capture_output=True,
            text=True,
            errors="replace",
            timeout=_TIME_LIMIT,
            check=False,
        )
        if done.returncode != 0:
            raise NoCompilerError(
                next(iter(done.stderr.splitlines()), f"{command[0]} ended with {done.returncode}")
            )
        return library.read_bytes()


def _load_code(data: bytes) -> ctypes.CDLL:
    if not hasattr(os, "memfd_create"):  # macOS cannot load a library from memory.
        with tempfile.TemporaryDirectory() as folder:
            library = Path(folder, f"robot{next(_load_counter)}.so")
            library.write_bytes(data)
            return ctypes.CDLL(str(library))
    descriptor = os.memfd_create("urdfkin", os.MFD_CLOEXEC)
    with os.fdopen(descriptor, "wb") as file:
        file.write(data)
        file.flush()
        # The loader identifies a library by the library's path, which contains the file descriptor. After
        # this file is closed, the next library can have the same file descriptor. Therefore, each path
        # contains a different number of "./".
        return ctypes.CDLL(f"/proc/self/fd/{'./' * next(_load_counter)}{descriptor}")


@cache
def _compiler_version(compiler: str) -> str:
    done = subprocess.run(
        [compiler, "--version"], capture_output=True, text=True, errors="replace", check=False
    )
    return done.stdout


@cache
def _processor_features() -> str:
    """Return the processor's features, on which the machine code of `-march=native` depends."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((line for line in lines if line.startswith(("flags", "Features"))), platform.machine())


#: Maximum number of results of a function. With this number of results, eight configurations need half a
#: megabyte of stack.
_MAX_RESULTS = 8192
# Plain integers are faster than members of an enumeration.
_N, _OUT, _STAGE, *_INPUTS = map(
    int, (KernelArgs.N, KernelArgs.OUT, KernelArgs.BUFFER, KernelArgs.Q, KernelArgs.V, KernelArgs.A)
)
_ArgumentArray = ctypes.c_int64 * len(KernelArgs)
_FLOAT64 = np.dtype(np.float64)
_machine_code_lock = make_fork_safe_lock()


def _is_plain(x: object, shape: tuple[int, ...]) -> bool:
    return (
        type(x) is np.ndarray
        and x.shape == shape
        and x.dtype is _FLOAT64
        and x.flags.c_contiguous
        and x.flags.aligned
    )


class _ExportedRobot(Protocol):
    verifier: Verifier

    @property
    def plan(self) -> Callable[[Sequence[int]], CompiledTree]: ...
    @property
    def compute(self) -> Callable[..., FloatArray]: ...
    @property
    def compile(self) -> Callable[..., CompiledFrame]: ...


class CompiledFrame:
    """Compiled functions for one robot frame: the result of `Robot.compile`.

    Results agree with the results of `Robot` within the error bound, but not to the last bit. A configuration
    has exactly the same result in a batch and in a single call. A wrong shape and a number that is not finite
    raise InputError. The machine code is compared with Pinocchio once, on more than a hundred configurations.
    After `load(verify=False)`, this comparison is omitted. `Robot.certificate` always counts the results of a
    `CompiledFrame` as unchecked.

    Attributes:
        frame: The frame's name.
        reference: The reference frame of velocities, Jacobians, Hessians and accelerations.

    >>> import urdfkin
    >>> robot = urdfkin.load("ur5")
    >>> fast, q = robot.compile("tool0"), robot.sample(1000)
    >>> fast.jacobian(q).shape
    (1000, 6, 6)
    """

    def __init__(self, robot: _ExportedRobot, frame: str, reference: Reference) -> None:
        self.frame, self.reference = frame, reference
        self._robot, self._tree = robot, robot.verifier.tree
        self._plan = robot.plan([self._tree.frame_link(frame)])
        self._machine_codes: dict[str, Callable[[int], int] | None] = {}
        # The first call of each function compiles the machine code, or reads the code from the cache.
        self._placement: FastFunction = partial(self._compute_first, "placement")
        self._velocity: FastFunction = partial(self._compute_first, "velocity")
        self._jacobian: FastFunction = partial(self._compute_first, "jacobian")
        self._jacobian_rate: FastFunction = partial(self._compute_first, "jacobian rate")
        self._hessian: FastFunction = partial(self._compute_first, "hessian")
        self._acceleration: FastFunction = partial(self._compute_first, "acceleration")

    def __reduce__(self) -> tuple[Callable[..., CompiledFrame], tuple[str, Reference]]:
        # Memory addresses are not valid in another process, so unpickling creates a new object.
        return self._robot.compile, (self.frame, self.reference)

    def placement(
        self, q: ConfigurationLike, out: FloatArray | None = None, *, threads: int | None = None
    ) -> FloatArray:
        """Return T_world_frame (..., 4, 4): eq. 7.77.

        Arguments and errors are the same as for `Robot.placement`.

        >>> import urdfkin
        >>> tip = urdfkin.load("planar_two_link").compile("tip")
        >>> tip.placement([0.0, 0.0])[:3, 3].tolist()
        [0.9, 0.0, 0.0]
        """
        if threads is None and (one := self._placement(q, out)) is not None:
            return one
        return self._compute_batch("placement", (q,), out, threads)

    def velocity(
        self,
        q: ConfigurationLike,
        v: ConfigurationLike,
        out: FloatArray | None = None,
        *,
        threads: int | None = None,
    ) -> FloatArray:
        """Return the velocity (..., 6), [linear; angular], m/s and rad/s: eq. 7.127, 7.128.

        >>> import urdfkin
        >>> tip = urdfkin.load("planar_two_link").compile("tip")
        >>> tip.velocity([0.0, 0.0], [1.0, 0.0]).tolist()
        [0.0, 0.9, 0.0, 0.0, 0.0, 1.0]
        """
        if threads is None and (one := self._velocity(q, v, out)) is not None:
            return one
        return self._compute_batch("velocity", (q, v), out, threads)

    def jacobian(
        self, q: ConfigurationLike, out: FloatArray | None = None, *, threads: int | None = None
    ) -> FloatArray:
        """Return the Jacobian (..., 6, nv): eq. 7.85.

        >>> import urdfkin
        >>> tip = urdfkin.load("planar_two_link").compile("tip")
        >>> tip.jacobian([0.0, 0.0])[1].tolist()
        [0.9, 0.4]
        """
        if threads is None and (one := self._jacobian(q, out)) is not None:
            return one
        return self._compute_batch("jacobian", (q,), out, threads)

    def jacobian_rate(
        self,
        q: ConfigurationLike,
        v: ConfigurationLike,
        out: FloatArray | None = None,
        *,
        threads: int | None = None,
    ) -> FloatArray:
        """Return the time derivative of the Jacobian (..., 6, nv): eq. 7.126.

        >>> import urdfkin
        >>> tip = urdfkin.load("planar_two_link").compile("tip")
        >>> tip.jacobian_rate([0.0, 0.0], [1.0, 0.0])[0].tolist()
        [-0.9, -0.4]
        """
        if threads is None and (one := self._jacobian_rate(q, v, out)) is not None:
            return one
        return self._compute_batch("jacobian rate", (q, v), out, threads)

    def hessian(
        self, q: ConfigurationLike, out: FloatArray | None = None, *, threads: int | None = None
    ) -> FloatArray:
        """Return the Hessian (..., 6, nv, nv).

        The Hessian is the derivative of the Jacobian with respect to each joint's motion. The product of the
        Hessian and v is the time derivative of the Jacobian (eq. 7.126).

        >>> import urdfkin
        >>> tip = urdfkin.load("planar_two_link").compile("tip")
        >>> tip.hessian([0.0, 0.0])[0].tolist()
        [[-0.9, -0.4], [-0.4, -0.4]]
        """
        if threads is None and (one := self._hessian(q, out)) is not None:
            return one
        return self._compute_batch("hessian", (q,), out, threads)

    def acceleration(
        self,
        q: ConfigurationLike,
        v: ConfigurationLike,
        a: ConfigurationLike,
        out: FloatArray | None = None,
        *,
        threads: int | None = None,
    ) -> FloatArray:
        """Return the classical acceleration (..., 6), [linear; angular], m/s^2, rad/s^2: eq. 7.129, 7.130.

        >>> import urdfkin
        >>> tip = urdfkin.load("planar_two_link").compile("tip")
        >>> tip.acceleration([0.0, 0.0], [1.0, 0.0], [0.0, 0.0])[0].item()
        -0.9
        """
        if threads is None and (one := self._acceleration(q, v, a, out)) is not None:
            return one
        return self._compute_batch("acceleration", (q, v, a), out, threads)

    def _compute_first(self, name: str, q: ConfigurationLike, *others: object) -> FloatArray | None:
        with compile_lock, import_lock:
            from urdfkin.compiled.machine.single import array_layout_is_known, wrap_c_function

        # The fast function checks neither the norm of a quaternion nor the range of the results.
        needs_checks = self._tree.floating_joints or self._plan.may_overflow
        if needs_checks or not (isinstance(q, np.ndarray) and q.ndim == 1 and array_layout_is_known()):
            return None
        row = QUANTITIES[name]
        if (core := self._machine_code(row)) is None:
            return None
        compute, task = wrap_c_function(core, len(row.inputs), row.result_shape(self._plan.nv), self._plan)
        self._robot.verifier.ledger.account(name).counters.append((task, KernelArgs.COUNT))
        setattr(self, f"_{row.method}", compute)
        if (found := compute(q, *others)) is not None:
            warn_of_degrees(self._tree, q)  # Later calls do not warn, because the check takes time.
        return found

    def _machine_code(self, row: Quantity) -> Any:
        with _machine_code_lock:
            if row.name not in self._machine_codes:
                self._machine_codes[row.name] = self._make_machine_code(row)
            return self._machine_codes[row.name]

    def _make_machine_code(self, row: Quantity) -> Any:
        verifier = self._robot.verifier
        code = make_unverified_code(verifier.tree, self._plan, self.frame, [row], self.reference, "robot")
        if not 0 < len(code.functions[0].results) <= _MAX_RESULTS:
            return None
        try:
            task = load_library(code).task
        except NoCompilerError:
            return None
        task.argtypes, task.restype = [ctypes.c_void_p], ctypes.c_int64
        if verifier.policy is False:
            return task
        samples = draw_samples(
            verifier.tree, PROOF_SAMPLES, np.random.default_rng(0), with_zero_and_limits=True
        )
        call = self._make_call((samples.q, samples.v, samples.a)[: len(row.inputs)])
        result = call.restore_shape(self._run_call(task, row, call, None, 1))
        verifier.check(row, call, result, True)
        return task

    def _make_call(self, inputs: Sequence[ConfigurationLike]) -> Call:
        return Call(self._tree, self._robot.plan, self.frame, self.reference, None, inputs)

    def _compute_batch(
        self, name: str, inputs: Sequence[ConfigurationLike], out: FloatArray | None, threads: int | None
    ) -> FloatArray:
        row = QUANTITIES[name]
        if (task := self._machine_code(row)) is None:
            return self._robot.compute(
                name, inputs, self.frame, self.reference, out=out, threads=threads, verify=False
            )
        if out is not None and self._are_plain(inputs, row, out):
            # After a NotFiniteError, the code below checks the inputs again, so that the error message names
            # the coordinate that is not finite.
            with suppress(NotFiniteError):
                self._run(task, row, inputs, out, threads)
                warn_of_degrees(self._tree, inputs[0])
                self._robot.verifier.ledger.count_unchecked(name, len(out))
                return out
        call = self._make_call(inputs)
        to = call.flatten_out(out, row.result_shape(self._tree.nv))
        result = call.run_and_locate_error(self._run_call, task, row, call, to, threads)
        self._robot.verifier.ledger.count_unchecked(name, call.result_count)
        return call.restore_shape(result) if out is None else out

    def _are_plain(
        self, inputs: Sequence[ConfigurationLike], row: Quantity, out: FloatArray
    ) -> TypeGuard[Sequence[FloatArray]]:
        """Return whether the machine code can use all arguments without conversion.

        In a large batch, the conversion of the arguments takes 10 % of the time.
        """
        n = len(out) if type(out) is np.ndarray and out.ndim else 0
        plain = not (self._tree.floating_joints or self._plan.may_overflow) and _is_plain(
            out, (n, *row.result_shape(self._tree.nv))
        )
        width = self._tree.nq
        for x in inputs:
            plain = plain and _is_plain(x, (n, width)) and not np.may_share_memory(out, x)
            width = self._tree.nv
        return plain and out.flags.writeable

    def _run_call(
        self, task: Any, row: Quantity, call: Call, out: FloatArray | None, threads: int | None
    ) -> FloatArray:
        inputs = [np.ascontiguousarray(x) for x in (call.q, *call.rates)]
        result = np.empty((call.n, 1, *row.result_shape(self._tree.nv))) if out is None else out
        self._run(task, row, inputs, result, threads)
        return result

    def _run(
        self, task: Any, row: Quantity, inputs: Sequence[FloatArray], out: FloatArray, threads: int | None
    ) -> None:
        def compute_block(block_inputs: Sequence[FloatArray], block_out: FloatArray) -> int:
            arguments = _ArgumentArray()
            arguments[_N], arguments[_OUT] = len(block_out), address(block_out)
            # The code writes eight numbers at once, so up to seven numbers can follow the last result. The
            # buffer `stage` has space for these numbers.
            stage = (
                aligned_empty(LANES * block_out[0].size + LANES)
                if row.has_columns and uses_buffer(out)
                else None
            )
            arguments[_STAGE] = 0 if stage is None else address(stage)
            for index, x in zip(_INPUTS, block_inputs, strict=False):
                arguments[index] = address(x)
            return int(task(arguments))

        if compute_in_threads(compute_block, inputs, out, threads) or self._plan.may_overflow:
            check_finite(inputs, out)
