"""Export example-robot-data's leaf frames to C, NumPy and arrays, compile the C code, run the test vectors.

    python scripts/check_exports.py --keep leaves.jsonl         # every leaf; continues a stopped run
    python scripts/check_exports.py --languages array --keep array.jsonl  # every leaf, in some languages only
    python scripts/check_exports.py --languages sympy-exact --keep exact.jsonl  # in exact numbers
    python scripts/check_exports.py --tips       # only the leaf with the longest path of each robot
    python scripts/check_exports.py --sizes      # write the sizes of the code to docs/export.md
    python scripts/check_exports.py --library torch --environment /tmp/torch  # the tips, in PyTorch
    python scripts/check_exports.py --library jax --environment /tmp/jax --keep jax.jsonl  # in JAX; continues

`--library` creates a virtual environment and installs the library there by pip, unless it is there already;
`--package torch==2.13.0+cpu` chooses the version. `scripts/run_exported.py` describes the checks.

Each exported function is compared with Pinocchio before it is written. The results of the exported code are
compared with results at fifty digits. GCC and Clang compile the C code; a missing compiler is skipped. The
compiled programs compute single configurations and batches. NumPy runs the format `numpy` in double
precision, and the format `array` in double and single precision. GCC compiles CUDA's host functions. The leaf
links have a fixed random order, so that a stopped run has checked a random sample.

Exit 1: an error exceeds its bound, a function is not verified, or a compiler prints a warning.
"""

import argparse
import json
import math
import random
import re
import shutil
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Collection, Iterator, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import urdfkin
from scripts.benchmarking.workload import chain_urdf
from scripts.pages import DOCS, insert_parts, table
from urdfkin.export import DEFAULT_QUANTITIES, LANGUAGES, code_for_language, write
from urdfkin.export.code import FrameCode
from urdfkin.export.forms import make_robot_code
from urdfkin.robot import Robot
from urdfkin.urdf.catalogue import example_robot_data_names

PAGE = DOCS / "export.md"
_STRICT = ("-std=c99", "-O0", "-Wall", "-Wextra", "-pedantic", "-Wconversion", "-Wshadow", "-Werror")
#: Compiled languages, each with its suffix, compilers and options.
_COMPILED = (("c", ".c", ("gcc", "clang"), _STRICT), ("cuda", ".cpp", ("g++",), ("-std=c++11", *_STRICT[1:])))
_DEFAULT_LANGUAGES = ("c", "cuda", "numpy", "array")
#: Languages that are checked only if `--languages` names them.
_OTHER_LANGUAGES = ("sympy-exact",)
#: Maximum number of joint velocities of a robot for the slow check of its Hessian in the formats `torch` and
#: `jax`. With JAX, the format `array` is checked without a Hessian, because JAX would compile the Hessian for
#: minutes.
_MAX_HESSIAN = 16
_ERROR_RATIO = re.compile(r"worst error (\S+) of the bound")


def make_code(robot: Robot, frame: str, quantities: Sequence[str] = DEFAULT_QUANTITIES) -> FrameCode:
    return make_robot_code(robot, frame, quantities, "local_world_aligned", verify=True)


def error_ratios(code: FrameCode, folder: Path, languages: Collection[str]) -> Iterator[tuple[str, float]]:
    """Yield each program's name and largest ratio of an error to its bound."""
    for to, suffix, compilers, strict in _COMPILED:
        source, name = folder / f"robot{suffix}", code.name.upper()
        for compiler in filter(shutil.which, compilers if to in languages else ()):
            source.write_text(write(code, to), encoding="utf-8")
            for real in ("double", "float"):
                program = folder / f"{compiler}_{real}"
                macros = [f"-D{name}_MAIN", f"-D{name}_REAL={real}"]
                command = [compiler, *strict, *macros, str(source), "-o", str(program), "-lm"]
                subprocess.run(command, check=True)
                process = subprocess.run([str(program)], capture_output=True, text=True, check=False)
                ratios = [float(share) for share in _ERROR_RATIO.findall(process.stdout)]
                yield f"{compiler} {real}", _largest_ratio(ratios, len(code.functions))
    for to in sorted({"numpy", "array", "sympy-exact"} & set(languages)):
        scope: dict[str, Any] = {"__name__": "robot"}
        language_code = code_for_language(code, to)
        if not language_code.proof.certificate.verified:
            yield f"{to} unverified", float("nan")
        exec(compile(write(language_code, to), "robot.py", "exec"), scope)
        checked: dict[tuple[str, str], float] = scope["check"]()
        for kind in {kind for _, kind in checked}:
            ratios = [share for (_, of), share in checked.items() if of == kind]
            yield f"{to} {kind}", _largest_ratio(ratios, len(code.functions))


def _largest_ratio(found: Sequence[float], count: int) -> float:
    """Return the largest ratio; NaN if a ratio is NaN or missing."""
    return max(found) if len(found) == count and not any(map(math.isnan, found)) else float("nan")


def leaf_frames(tips: bool) -> Iterator[tuple[str, Robot, str]]:
    """Yield the tip frames, then the other leaves in random order."""
    robots = {name: urdfkin.load(name) for name in example_robot_data_names()}
    for name, robot in robots.items():
        yield name, robot, robot.tip_frame
    frames = [
        (name, robot, frame)
        for name, robot in (() if tips else robots.items())
        for frame in map(robot.tree.frame_name, robot.tree.leaves())
        if frame != robot.tip_frame
    ]
    random.Random(0).shuffle(frames)
    yield from frames


def check_frame(robot: Robot, frame: str, languages: Collection[str]) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as folder:
        code = make_code(robot, frame, DEFAULT_QUANTITIES if robot.nv else ("placement",))
        ratios = dict(error_ratios(code, Path(folder), languages))
    good = all(share <= 1.0 for share in ratios.values()) and code.proof.certificate.verified
    return {"good": good, **ratios}


def check_leaves(tips: bool, keep: Path | None, languages: Collection[str]) -> int:
    lines = read_lines(keep)
    stored = {(line["robot"], line["frame"]) for line in lines}
    for name, robot, frame in leaf_frames(tips):
        if (name, frame) not in stored:
            lines.append({"robot": name, "frame": frame, **check_frame(robot, frame, languages)})
            store(keep, json.dumps(lines[-1]))
    wrong = [line for line in lines if not line["good"]]
    for line in wrong:
        print("WRONG", line)
    checked_frames = {(line["robot"], line["frame"]) for line in lines}
    trees = {name: urdfkin.load(name).tree for name in example_robot_data_names()}
    leaves = {(name, tree.frame_name(leaf)) for name, tree in trees.items() for leaf in tree.leaves()}
    counts = f"{len(checked_frames & leaves)} of {len(leaves)} leaves of {len(trees)} robots"
    others = f"{len(checked_frames - leaves)} tips that are not leaves"
    print(f"{counts}, {others}; {len(wrong)} outside the bound or unverified")
    print_worst_errors(lines)
    return bool(wrong)


def check_library(library: str, environment: Path, package: str | None, keep: Path | None) -> int:
    python = environment / "bin" / "python"
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", str(environment)], check=True)
        packages = [package or library, *(["array-api-compat"] if library == "torch" else [])]
        subprocess.run([str(python), "-m", "pip", "install", "--quiet", "numpy", *packages], check=True)
    version = [str(python), "-c", f"import {library}; print('{library}', {library}.__version__)"]
    print(subprocess.run(version, capture_output=True, text=True, check=True).stdout.strip(), flush=True)
    stored = [line for line in read_lines(keep) if line["library"] == library]
    with tempfile.TemporaryDirectory() as folder:
        paths = list(_write_files(library, Path(folder)))
        left = [path for path in paths if path.stem not in {line["file"] for line in stored}]
        command = [str(python), str(Path(__file__).with_name("run_exported.py")), library, *map(str, left)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=folder) as process:
            for line in process.stdout or ():
                stored.append(json.loads(line))
                store(keep, line.rstrip())
    wrong = sum(not all(x <= 1.0 for x in line.values() if isinstance(x, float)) for line in stored)
    print(f"{len(stored)} of {len(paths)} files, {wrong} with an error outside the bound")
    print_worst_errors(stored)
    return int(wrong > 0 or len(stored) < len(paths) or process.returncode != 0)


def _write_files(library: str, folder: Path) -> Iterator[Path]:
    for number, (_, robot, frame) in enumerate(leaf_frames(tips=True)):
        quantities = ("placement", "jacobian", "velocity", "acceleration") if robot.nv else ("placement",)
        differentiable = robot.nv and all(joint.nv <= 1 for joint in robot.tree.joints)
        for to in (library, "array"):
            hessian = differentiable and (robot.nv <= _MAX_HESSIAN if to == library else library == "torch")
            code = make_code(robot, frame, (*quantities, "hessian") if hessian else quantities)
            path = folder / f"{code.name}_{number}{LANGUAGES[to][1]}"
            path.write_text(write(code, to), encoding="utf-8")
            yield path


def read_lines(keep: Path | None) -> list[dict[str, Any]]:
    if keep is None or not keep.exists():
        return []
    return [json.loads(line) for line in keep.read_text(encoding="utf-8").splitlines()]


def store(keep: Path | None, line: str) -> None:
    print(line, flush=True)
    if keep:
        with keep.open("a", encoding="utf-8") as file:
            print(line, file=file)


def print_worst_errors(lines: Sequence[dict[str, Any]]) -> None:
    ways = sorted({way for line in lines for way, share in line.items() if isinstance(share, float)})
    worst = ", ".join(f"{way} {max(line.get(way, 0.0) for line in lines):.2g}" for way in ways)
    print(f"worst error as a share of the bound: {worst}")


def make_page(text: str) -> str:
    rows = []
    frames = ("panda", "panda_hand"), ("talos", "gripper_left_base_link"), (chain_urdf(100), "tip")
    for (source, frame), quantity in product(frames, DEFAULT_QUANTITIES):
        robot = urdfkin.load(source)
        code = make_code(robot, frame, (quantity,))
        lines = write(code, "c").partition("#ifdef " + code.name.upper() + "_MAIN")[0]
        sizes = (
            f"{code.functions[0].operation_count:,}",
            f"{lines.count(chr(10)):,}",
            f"{len(lines) / 1000:.0f}",
        )
        rows.append((f"{robot.name}, {frame}", quantity, *sizes))
    heads = ("robot, frame", "quantity", "operations", "lines of C", "kB")
    return insert_parts(text, sizes=table(heads, rows, left=2))


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    option = parser.add_argument
    option(
        "--keep",
        type=Path,
        help="file for the results, one per line; checks in this file are not repeated",
    )
    option("--tips", action="store_true", help="check only one leaf link of each robot")
    option("--sizes", action="store_true", help="write the sizes of three robots' code into docs/export.md")
    option(
        "--languages",
        nargs="+",
        choices=(*_DEFAULT_LANGUAGES, *_OTHER_LANGUAGES),
        default=_DEFAULT_LANGUAGES,
        help="only these languages",
    )
    option("--library", choices=("torch", "jax"), help="check the tips in this library")
    option("--environment", type=Path, help="folder of the library's virtual environment")
    option("--package", help="what pip installs, for example torch==2.13.0+cpu")
    arguments = parser.parse_args(words)
    if arguments.library and not arguments.environment:
        parser.error("--library needs --environment")
    warnings.simplefilter("ignore", urdfkin.UrdfWarning)
    if arguments.library:
        return check_library(arguments.library, arguments.environment, arguments.package, arguments.keep)
    if arguments.sizes:
        PAGE.write_text(make_page(PAGE.read_text("utf-8")), "utf-8")
        print(PAGE)
        return 0
    return check_leaves(arguments.tips, arguments.keep, arguments.languages)


if __name__ == "__main__":
    sys.exit(main())
