"""Measure the CUDA code of a robot on a GPU: configurations per second for each batch size and precision.

    python scripts/benchmark_gpu.py panda --json gpu.jsonl      # needs nvcc, a C++ compiler and a GPU
    python scripts/benchmark_gpu.py panda --compile-only        # needs no GPU

The program first runs the file's test vectors on the GPU; a wrong number ends the run. Each time is the
median of several launches. The data rate is the number of bytes that are read and written per second.
The last column is the code's data rate, divided by the data rate of a copy within the GPU's memory.

If PyTorch with CUDA is installed, the program also measures the code exported for PyTorch, with and without
`torch.compile`. If PyTorch Kinematics is installed too, the program also measures the Jacobian of PyTorch
Kinematics. Before the time measurements, the program checks results of two contenders: the exported code
without `torch.compile`, and PyTorch Kinematics.

The program needs nvcc, which `make nvcc` installs into the checkout's environment.

The exit code is 1 if a number is outside its error bound. The exit code is 2 if there is no GPU or no nvcc,
or if the program does not compile.
"""

import argparse
import copy
import ctypes
import importlib.util
import json
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Callable, Iterable, Iterator
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

import urdfkin
from scripts.benchmarking.contenders import find_indices
from scripts.pages import table as markdown
from urdfkin.export import DEFAULT_QUANTITIES, write
from urdfkin.export.code import FrameCode
from urdfkin.export.forms import make_robot_code
from urdfkin.export.function import Function
from urdfkin.robot import Robot

#: Numbers of configurations in a batch.
SIZES = (1, 64, 1024, 4096, 65_536, 1_048_576)
#: Number of timed launches per measurement.
LAUNCHES = 21
_BYTES = {"double": 8, "float": 4}
#: Maximum allowed error of PyTorch Kinematics, which reads the angles of a URDF in single precision.
_MOST = {"double": 1e-6, "float": 1e-4}

_PROGRAM = Path(__file__).parent / "benchmarking" / "gpu.cu"
_MEASURED = r"""    std::printf("{\"by\": \"urdfkin\", \"quantity\": \"@name@\", \"real\": \"%s\", ", real);
    std::printf("\"n\": %zu, \"s\": %.6g}\n", n,
                seconds([&] { return @title@_kinematics::@name@_batch<T>(n, @given@, out); }));"""


def find_nvcc() -> str | None:
    packages = Path(sysconfig.get_path("purelib"), "nvidia").glob("cu*/bin/nvcc")
    made = Path(sys.prefix, "nvcc", "bin")
    return shutil.which("nvcc") or shutil.which("nvcc", path=made) or next(map(str, sorted(packages)), None)


def count_gpus() -> int:
    try:
        driver, count = ctypes.CDLL("libcuda.so.1"), ctypes.c_int(0)
    except OSError:
        return 0
    found = driver.cuInit(0) == 0 and driver.cuDeviceGetCount(ctypes.byref(count)) == 0
    return count.value if found else 0


def bytes_per_configuration(code: FrameCode, function: Function, real: str) -> int:
    return _BYTES[real] * (sum(code.widths(function).values()) + len(function.results))


def make_program(code: FrameCode) -> str:

    def fill(text: str, **values: object) -> str:
        for name, value in values.items():
            text = text.replace(f"@{name}@", str(value))
        return text

    measured = "\n".join(
        fill(_MEASURED, name=f.name, title=code.name, given=", ".join(f.inputs)) for f in code.functions
    )
    return fill(
        _PROGRAM.read_text("utf-8").partition("\n")[2],
        UP=code.name.upper(),
        file=f"{code.name}.cuh",
        launches=LAUNCHES,
        nq=code.nq,
        nv=code.nv,
        most=max(len(f.results) for f in code.functions),
        measured=measured,
        sizes=", ".join(map(str, SIZES)),
    )


def compile_programs(code: FrameCode, folder: Path, compiler: str) -> dict[str, Path]:
    header, source = folder / f"{code.name}.cuh", folder / "measure.cu"
    header.write_text(write(code, "cuda"), encoding="utf-8")
    source.write_text(make_program(code), encoding="utf-8")
    libraries = Path(compiler).resolve().parents[1] / "lib"
    arch = ["-arch=native"] if count_gpus() else []
    command = [compiler, "-O3", "-std=c++17", *arch, f"-I{folder}", f"-L{libraries}", "-x", "cu"]
    up, programs = code.name.upper(), {"measure": folder / "measure"}
    subprocess.run([*command, str(source), "-o", str(programs["measure"])], check=True)
    for real in _BYTES:
        programs[real] = folder / f"check_{real}"
        macros = [f"-D{up}_MAIN", f"-D{up}_REAL={real}"]
        subprocess.run([*command, *macros, str(header), "-o", str(programs[real])], check=True)
    return programs


def make_rows(code: FrameCode, lines: Iterable[str]) -> Iterator[dict[str, Any]]:
    records = [json.loads(line) for line in lines]
    if not records or "bandwidth" not in records[0]:
        raise ValueError("the compiled program did not print the bandwidth of the GPU's memory")
    functions = {f.name: f for f in code.functions}
    for row in records[1:]:
        a_second = row["n"] / row["s"]
        byte_count = bytes_per_configuration(code, functions[row["quantity"]], row["real"])
        yield {**row, "a_second": a_second, "share": a_second * byte_count / records[0]["bandwidth"]}


def make_table(measured: Iterable[dict[str, Any]]) -> str:
    heads = ("by", "quantity", "precision", "batch", "configurations/s", "share of bandwidth")
    rows = [
        (x["by"], x["quantity"], x["real"], f"{x['n']:,}", f"{x['a_second']:.3g}", f"{x['share']:.1%}")
        for x in measured
    ]
    return markdown(heads, rows, left=3)


def measure_torch(robot: Robot, frame: str, code: FrameCode, device: str = "cuda") -> Iterator[str]:
    try:
        import torch
        from torch.utils.benchmark import Timer
    except ModuleNotFoundError:
        return
    if device == "cuda" and not torch.cuda.is_available():
        return
    scope: dict[str, Any] = {"__name__": "measured"}
    exec(compile(write(code, "torch"), "<torch>", "exec"), scope)
    if not max(scope["check"](device).values()) <= 1.0:
        raise ValueError("a result of the code for PyTorch exceeds its error bound")
    for function in code.functions:
        call = scope[function.name]
        callables: dict[str, Callable[..., Any]] = {"PyTorch": call, "torch.compile": torch.compile(call)}
        if function.name == "jacobian" and importlib.util.find_spec("pytorch_kinematics"):
            callables["PyTorch Kinematics"] = _pytorch_kinematics_jacobian(robot, frame, device)
        for by, real, n in product(callables, _BYTES, SIZES):
            kind = {"dtype": getattr(torch, real), "device": device}
            names: dict[str, Any] = {
                "call": callables[by],
                "inputs": [torch.rand((n, width), **kind) for width in code.widths(function).values()],
            }
            seconds = Timer("call(*inputs)", globals=names).blocked_autorange().median
            yield json.dumps({"by": by, "quantity": function.name, "real": real, "n": n, "s": seconds})


def _pytorch_kinematics_jacobian(robot: Robot, frame: str, device: str) -> Callable[[Any], Any]:
    import pytorch_kinematics
    import torch

    chain = pytorch_kinematics.build_serial_chain_from_urdf(robot.urdf, frame)
    names = chain.get_joint_parameter_names()
    if not set(names) <= set(robot.joint_names):
        raise ValueError(f"PyTorch Kinematics has other joints: {', '.join(names)}")
    columns, chains, q = find_indices(robot.joint_names, names), {}, robot.sample(16, seed=0)
    for real, most in _MOST.items():
        kind = getattr(torch, real)
        chains[kind] = copy.deepcopy(chain).to(dtype=kind, device=device)
        J = chains[kind].jacobian(torch.tensor(q[:, columns], dtype=kind, device=device))
        if not np.abs(J.cpu().numpy() - robot.jacobian(q, frame)[..., columns]).max() <= most:
            raise ValueError(f"PyTorch Kinematics computes a wrong Jacobian in {real} precision")
    return lambda q: chains[q.dtype].jacobian(q[:, columns])


def main(words: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    option = parser.add_argument
    option("robot", nargs="?", default="panda", help="path or name of a robot")
    option("--frame", help="link or joint; the default is the robot's tip")
    option("--json", type=Path, help="file for the measurements, one per line")
    option("--compile-only", action="store_true", help="compile the programs, and run none")
    options = parser.parse_args(words)
    if (compiler := find_nvcc()) is None:
        return _report_failure("nvcc is not installed. Install CUDA, or run `make nvcc`.")
    if not options.compile_only and not count_gpus():
        return _report_failure(
            "CUDA's driver finds no GPU here. Use a machine with a GPU, or --compile-only."
        )
    robot = urdfkin.load(options.robot)
    frame = options.frame or robot.tip_frame
    code = make_robot_code(robot, frame, DEFAULT_QUANTITIES, "local_world_aligned")
    with tempfile.TemporaryDirectory() as folder:
        try:
            programs = compile_programs(code, Path(folder), compiler)
        except subprocess.CalledProcessError as error:
            return _report_failure(f"the program does not compile: {compiler} exits with {error.returncode}.")
        if options.compile_only:
            print(f"compiled, not run: {', '.join(programs)}")
            return 0
        for real in _BYTES:
            process = subprocess.run([str(programs[real])], capture_output=True, text=True, check=False)
            print(process.stdout, end="")
            if process.returncode or process.stdout.count(" on the GPU") != len(code.functions):
                return _report_failure(
                    f"the check in {real} precision failed on the GPU: {process.stderr}", 1
                )
        lines = subprocess.run([str(programs["measure"])], capture_output=True, text=True, check=True).stdout
    records, status = lines.splitlines(), 0
    try:
        records.extend(measure_torch(robot, frame, code))
    except ValueError as error:
        status = _report_failure(str(error), 1)
    measured = list(make_rows(code, records))
    print(make_table(measured))
    if options.json:
        options.json.write_text("".join(f"{json.dumps(row)}\n" for row in measured), encoding="utf-8")
    return status


def _report_failure(reason: str, status: int = 2) -> int:
    print(f"benchmark_gpu.py: {reason}", file=sys.stderr)
    return status


if __name__ == "__main__":
    sys.exit(main())
