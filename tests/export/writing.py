"""Write exported code into files, and run these files."""

import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import urdfkin
from tests.reading import module_of
from urdfkin.export import LANGUAGES, write
from urdfkin.export.code import FrameCode, exportable_quantities, make_verified_code
from urdfkin.model.reference import Reference
from urdfkin.robot import Robot

ALL = tuple(row.method for row in exportable_quantities())
#: Program that compiles or runs a file, by language.
PROGRAMS = {"c": "cc", "cpp": "c++", "cuda": "c++", "matlab": "octave-cli"}
LIBRARIES = ("numba", "jax", "torch", "casadi", "sympy", "sympy-exact")


_ALIGNED = Reference.LOCAL_WORLD_ALIGNED


def code(
    robot: Robot, frame: str | None = None, quantities: tuple[str, ...] = ALL, reference: Reference = _ALIGNED
) -> FrameCode:
    frame = frame or robot.tip_frame
    return make_verified_code(
        robot.verifier, robot.plan, frame, quantities, reference, name=None, verify=None
    )


def file(written: FrameCode, to: str, folder: Path) -> Path:
    path = folder / f"{written.name}{LANGUAGES[to][1]}"
    path.write_text(write(written, to), encoding="utf-8")
    return path


def module(
    robot: Robot | str, to: str, folder: Path, *quantities: str, frame: str | None = None
) -> ModuleType:
    """Export the equations of a frame for a Python library, and import the file."""
    robot = urdfkin.load(robot) if isinstance(robot, str) else robot
    return module_of(file(code(robot, frame, quantities or ALL), to, folder))


def need(to: str) -> None:
    """Skip the test if the program or the library for a language is not installed."""
    if (program := PROGRAMS.get(to)) and shutil.which(program) is None:
        pytest.skip(f"no {program}")
    if to in LIBRARIES and importlib.util.find_spec(to.partition("-")[0]) is None:
        pytest.skip(f"no {to}")


def built(path: Path, compiler: str, *options: str) -> str:
    """Compile a file with warnings as errors, run the program, and return its output."""
    if shutil.which(compiler) is None:
        pytest.skip(f"no {compiler}")
    name = path.stem.upper()
    strict = ["-Wall", "-Wextra", "-pedantic", "-Wconversion", "-Wshadow", "-Werror"]
    program = path.with_suffix(".out")
    command = [compiler, *strict, f"-D{name}_MAIN", *options, str(path), "-o", str(program), "-lm"]
    subprocess.run(command, check=True)
    return subprocess.run([str(program)], capture_output=True, text=True, check=False).stdout


def ran(path: Path) -> subprocess.CompletedProcess[str]:
    """Run a Python file as a program."""
    how: dict[str, Any] = {"env": {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}, "text": True}
    return subprocess.run([sys.executable, str(path)], capture_output=True, check=False, **how)
