"""The C of one function, made into machine code by the system's compiler and kept between runs, sealed.

What is kept is named by the text, the compiler and the processor it was made for. It is loaded from memory,
not from a file that somebody might change after it was looked at.
"""

from __future__ import annotations

import ctypes
import os
import platform
import shutil
import subprocess
import tempfile
from functools import cache
from itertools import count
from pathlib import Path

from urdfkin.compiled.task import Task
from urdfkin.export.c import Layout, advance, framed, spare, unit
from urdfkin.export.code import Code
from urdfkin.system.keeping import kept_folder
from urdfkin.system.sealed import keep, kept

_FLAGS = ("-std=c99", "-O3", "-march=native", "-ffp-contract=fast", "-fno-math-errno", "-fPIC", "-shared")
#: GCC takes half a register on many processors whose whole ones are as fast.
_WHOLE_REGISTERS = {"x86_64": ("-mprefer-vector-width=512",)}
_PATIENCE = 600.0
_names = count()


class NoCompilerError(Exception):
    """There is none, or it does not take the code; the message is its own."""


def library(code: Code) -> ctypes.CDLL:
    """What computes the code's only function: `task`, which takes a row of `compiled.task` and says whether.

    Raises:
        NoCompilerError: no C compiler, or it fails.
    """
    if (compiler := shutil.which("cc")) is None:
        raise NoCompilerError("cc is not installed")
    text = unit(code) + _entrance(code)
    flags = (*_FLAGS, *_WHOLE_REGISTERS.get(platform.machine(), ()))
    folder = kept_folder("library", [], text, *flags, _version(compiler), _processor())
    data = kept(folder / "machine.code") if folder else None
    if data is None:
        data = _compiled(text, [compiler, *flags])
        if folder:
            keep(folder / "machine.code", data)
    return _loaded(data)


def _entrance(code: Code) -> str:
    (function,) = code.functions
    widths, layout = code.widths(function), Layout(function)
    spread = (
        f"    for (int k = 0; k < LANES; ++k) in[{at} * LANES + k] = {x.op}[{x.of[0]}];"
        for at, x in enumerate(layout.inputs)
    )
    lines = {
        "inputs": "    const double *{x} = (const double *)(uintptr_t)places[{place}];",
        "look": "        look({width}, {x}, bad);",
        "look_left": "    for (size_t i = 0; i < n * {width}; ++i) bad[0][0] += 0.0 * {x}[i];",
    }
    parts = {
        part: "\n".join(
            line.format(x=x, width=width, place=int(Task[x.upper()])) for x, width in widths.items()
        )
        for part, line in lines.items()
    }
    return framed(
        "library.c",
        N=int(Task.N),
        OUT=int(Task.OUT),
        title=code.name,
        name=function.name,
        passed=", ".join(widths),
        given=", ".join(f"const double *{x}" for x in widths),
        room=layout.room,
        spread="\n".join([*(f"    (void){x};" for x in widths), *spread]),
        count=len(function.results),
        STAGE=int(Task.STAGE),
        spare=spare(code, function),
        advance=advance(code, function),
        **parts,
    )


def _compiled(text: str, command: list[str]) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        source, made = Path(folder, "robot.c"), Path(folder, "robot.so")
        source.write_text(text, encoding="utf-8")
        done = subprocess.run(
            [*command, str(source), "-o", str(made), "-lm"],
            capture_output=True,
            text=True,
            errors="replace",
            timeout=_PATIENCE,
            check=False,
        )
        if done.returncode != 0:
            raise NoCompilerError(
                next(iter(done.stderr.splitlines()), f"{command[0]} ended with {done.returncode}")
            )
        return made.read_bytes()


def _loaded(data: bytes) -> ctypes.CDLL:
    descriptor = os.memfd_create("urdfkin", os.MFD_CLOEXEC)
    with os.fdopen(descriptor, "wb") as file:
        file.write(data)
        file.flush()
        # The loader takes what has the same name for the same library: no two names are alike.
        return ctypes.CDLL(f"/proc/self/fd/{'./' * next(_names)}{descriptor}")


@cache
def _version(compiler: str) -> str:
    done = subprocess.run(
        [compiler, "--version"], capture_output=True, text=True, errors="replace", check=False
    )
    return done.stdout


@cache
def _processor() -> str:
    """What it can do, which `-march=native` asks."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((line for line in lines if line.startswith(("flags", "Features"))), platform.machine())
