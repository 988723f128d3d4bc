"""Convert robots of the catalogue to USD with urdf-usd-converter, and compare the result with the URDF.

The converter is Newton's urdf-usd-converter. It needs the library usd-exchange, whose modules have the names
of usd-core's, so it belongs in an environment of its own:

    python -m venv CONVERTER && CONVERTER/bin/pip install urdf-usd-converter
    python scripts/survey_usd.py CONVERTER/bin/python [ROBOT...] [--markdown TABLE.md]

Shapes are removed first: the converter would look for meshes. `urdfkin.same` compares the stage with the
URDF.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

sys.path.insert(0, str(Path(__file__).parents[1]))  # run from a checkout that is not installed

import urdfkin
from urdfkin.comparison.result import Verdict, length
from urdfkin.urdf.catalogue import catalogue

_CONVERT = """
import sys
import urdf_usd_converter
made = urdf_usd_converter.Converter(layer_structure=False, scene=False).convert(*sys.argv[1:])
print(made.path)
"""
#: Longest quotation of the converter's message, in characters.
_QUOTED = 120


def stage_of(python: str, urdf: str, folder: Path) -> Path | str:
    """Return the stage that the converter writes for a URDF text, or its message if it refuses the robot."""
    robot = ElementTree.fromstring(urdf)
    for link in robot.iterfind("link"):
        for shape in [*link.iterfind("visual"), *link.iterfind("collision")]:
            link.remove(shape)
    file = folder / "robot.urdf"
    file.write_bytes(ElementTree.tostring(robot))
    words = [python, "-I", "-c", _CONVERT, str(file), str(folder / "usd")]
    done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=300)
    if done.returncode:
        return (done.stderr.strip().splitlines() or ["no message"])[-1][:_QUOTED]
    return Path(done.stdout.strip().splitlines()[-1])


def row_of(python: str, name: str) -> tuple[str, str, str, str, str]:
    """Return the row of a robot: name, joints, verdict, and two distances.

    The first is the largest distance between the models, the second is the one that single precision can
    cause.
    """
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        robot = urdfkin.load(name)
        joints = str(sum(joint.kind.nq > 0 for joint in robot.tree.joints))
        stage = stage_of(python, robot.urdf, Path(folder))
        if isinstance(stage, str):
            return name, joints, f"the converter refuses it: {stage}", "", ""
        try:
            found = urdfkin.same(robot, _loaded(stage))
        except urdfkin.UrdfkinError as error:
            return name, joints, f"not compared: {error.what}", "", ""
    worst = found.worst
    off = length(0.0 if worst is None else worst.upper)
    if found.single is None:
        return name, joints, "the stage has no rounded number", off, ""
    single = length(found.single[0])
    if found:
        words = "same" if found.verdict is Verdict.SAME else "equivalent"
        return name, joints, words, off, single
    words = "differs within single precision" if found.up_to_single else found.differences[0].words
    return name, joints, words, off, single


def _loaded(stage: Path) -> urdfkin.Robot:
    """Return the robot of a stage. A root link without a mass becomes several articulations."""
    try:
        return urdfkin.load(stage)
    except urdfkin.UrdfkinError as error:
        if "articulations" not in error.what:
            raise
    return urdfkin.load(stage, articulation=f"/{stage.stem}")


def rows(python: str, names: list[str]) -> Iterator[tuple[str, str, str, str, str]]:
    """Yield the row of each robot."""
    for name in names:
        yield row_of(python, name)


def main() -> None:
    """Print the table; write it as Markdown if asked."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("python", help="the interpreter of the environment with urdf-usd-converter")
    parser.add_argument("robots", nargs="*", help="names of the catalogue (default: all)")
    parser.add_argument("--markdown", type=Path, help="also write the table to this file")
    given = parser.parse_args()
    heads = ("robot", "moving joints", "verdict", "at most apart", "single precision allows")
    table = [f"| {' | '.join(heads)} |", "|---|---|---|---|---|"]
    for row in rows(given.python, given.robots or list(catalogue())):
        table.append(f"| {' | '.join(row)} |")
        print(table[-1], flush=True)
    if given.markdown:
        given.markdown.write_text("\n".join(table) + "\n")


if __name__ == "__main__":
    main()
