"""Export the catalogue's leaf frames to C and NumPy, compile the C code, and run the test vectors.

    python scripts/check_exports.py --keep leaves.jsonl         # every leaf; continues a stopped run
    python scripts/check_exports.py --keep leaves.jsonl --tell  # print the stored results only
    python scripts/check_exports.py --tips       # only the leaf with the longest path of each robot
    python scripts/check_exports.py --sizes      # write the sizes of the code to docs/export.md

When a function is written, it is compared with Pinocchio. When it runs, it is compared with results at fifty
digits. The function runs with NumPy, and with GCC and Clang if they are installed, for one configuration and
in batches. Exit 1: a number is outside the derived bound, or a compiler prints a warning.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))  # import from this checkout without an installation

import urdfkin
from scripts.benchmarking.subject import chain_urdf
from scripts.pages import inserted
from urdfkin.export import QUANTITIES, write
from urdfkin.export.code import Code, code_of
from urdfkin.robot import Robot
from urdfkin.urdf.catalogue import examples

PAGE = Path(__file__).parents[1] / "docs" / "export.md"
_STRICT = ("-std=c99", "-O0", "-Wall", "-Wextra", "-pedantic", "-Wconversion", "-Wshadow", "-Werror")
_SHARE = re.compile(r"worst error (\S+) of the bound")


def code(robot: Robot, frame: str, quantities: Sequence[str] = QUANTITIES) -> Code:
    """Return the verified code of a frame."""
    return code_of(
        robot.verifier, robot.plan, frame, quantities, "local_world_aligned", name=None, verify=True
    )


def shares(written: Code, folder: Path) -> Iterator[tuple[str, float]]:
    """Yield, for each way to run the code, the largest error as a fraction of its bound."""
    source, name = folder / "robot.c", written.name.upper()
    source.write_text(write(written, "c"), encoding="utf-8")
    for compiler in filter(shutil.which, ("gcc", "clang")):
        program = folder / compiler
        command = [compiler, *_STRICT, f"-D{name}_MAIN", str(source), "-o", str(program), "-lm"]
        subprocess.run(command, check=True)
        done = subprocess.run([str(program)], capture_output=True, text=True, check=False)
        found = [float(share) for share in _SHARE.findall(done.stdout)]
        yield compiler, max(found) if len(found) == len(written.functions) else float("nan")
    scope: dict[str, Any] = {"__name__": "robot"}
    exec(compile(write(written, "numpy"), "robot.py", "exec"), scope)
    yield "numpy", max(scope["check"]().values())


def subjects(tips: bool) -> Iterator[tuple[str, Robot, str]]:
    """Yield robots and frames.

    The tips come first, so that a run which is stopped later has checked each robot at least once.
    """
    robots = {name: urdfkin.load(name) for name in examples()}
    for name, robot in robots.items():
        yield name, robot, robot.tip_frame
    for name, robot in robots.items() if not tips else ():
        for leaf in robot.tree.leaves():
            if (frame := robot.tree.frame_name(leaf)) != robot.tip_frame:
                yield name, robot, frame


def found_of(robot: Robot, frame: str) -> dict[str, Any]:
    """Return the result of a leaf frame.

    The result contains the largest errors as fractions of their bounds, and states whether all errors are
    within the bounds.
    """
    wanted = QUANTITIES if robot.nv else ("placement",)
    with tempfile.TemporaryDirectory() as folder:
        written = code(robot, frame, wanted)
        found = dict(shares(written, Path(folder)))
    good = all(share <= 1.0 for share in found.values()) and written.proof.certificate.verified
    return {"good": good, **found}


def check(tips: bool, keep: Path | None) -> int:
    """Check every leaf or tip that has no stored result."""
    stored = {(line["robot"], line["frame"]) for line in lines_of(keep)}
    here: list[dict[str, Any]] = []
    for name, robot, frame in subjects(tips):
        if (name, frame) in stored:
            continue
        here.append({"robot": name, "frame": frame, **found_of(robot, frame)})
        line = json.dumps(here[-1])
        print(line, flush=True)
        if keep:
            with keep.open("a", encoding="utf-8") as file:
                file.write(f"{line}\n")
    return tell(lines_of(keep) if keep else here)


def lines_of(keep: Path | None) -> list[dict[str, Any]]:
    """Return the stored results."""
    if keep is None or not keep.exists():
        return []
    return [json.loads(line) for line in keep.read_text(encoding="utf-8").splitlines()]


def tell(lines: Sequence[dict[str, Any]]) -> int:
    """Print a summary of the results; return 1 if there is an error."""
    wrong = [line for line in lines if not line["good"]]
    for line in wrong:
        print("WRONG", line)
    ways = sorted({way for line in lines for way, share in line.items() if isinstance(share, float)})
    worst = ", ".join(f"{way} {max(line.get(way, 0.0) for line in lines):.2g}" for way in ways)
    found = {(line["robot"], line["frame"]) for line in lines}
    trees = {name: urdfkin.load(name).tree for name in examples()}
    leaves = {(name, tree.frame_name(leaf)) for name, tree in trees.items() for leaf in tree.leaves()}
    tips = len(found - leaves)
    print(
        f"{len(found & leaves)} of {len(leaves)} leaves of {len(trees)} robots, {tips} tips that are not"
        " leaves;"
        f" {len(wrong)} outside the bound or unverified; worst error as a share of the bound: {worst}"
    )
    return bool(wrong)


def sizes() -> str:
    """Return the sizes of the code for three frames and each quantity, as a Markdown table."""
    rows = ["| robot, frame | quantity | operations | lines of C | kB |", "|---|---|---:|---:|---:|"]
    for robot, frame in (
        (urdfkin.load("panda"), "panda_hand"),
        (urdfkin.load("talos"), "gripper_left_base_link"),
        (urdfkin.load(chain_urdf(100)), "tip"),
    ):
        for quantity in QUANTITIES:
            written = code(robot, frame, (quantity,))
            (function,) = written.functions
            lines = write(written, "c").partition("#ifdef " + written.name.upper() + "_MAIN")[0]
            rows.append(
                f"| {robot.name}, {frame} | {quantity} | {function.operations:,} | {lines.count(chr(10)):,} |"
                f" {len(lines) / 1000:.0f} |"
            )
    return "\n".join(rows) + "\n"


def page(text: str) -> str:
    """Return the page with the current table of sizes."""
    return inserted(text, sizes=sizes())


def main(words: Sequence[str] | None = None) -> int:
    """Run the checks; return 1 for an error."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument(
        "--keep", type=Path, help="file for the results, one per line; an existing file is continued"
    )
    parser.add_argument("--tell", action="store_true", help="only print a summary of the stored results")
    parser.add_argument("--tips", action="store_true", help="check only one leaf link of each robot")
    parser.add_argument(
        "--sizes", action="store_true", help="write the sizes of the code of three robots into docs/export.md"
    )
    arguments = parser.parse_args(words)
    warnings.simplefilter("ignore", urdfkin.UrdfWarning)
    if arguments.tell:
        return tell(lines_of(arguments.keep))
    if arguments.sizes:
        PAGE.write_text(page(PAGE.read_text("utf-8")), "utf-8")
        print(PAGE)
        return 0
    return check(arguments.tips, arguments.keep)


if __name__ == "__main__":
    sys.exit(main())
