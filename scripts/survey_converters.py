"""Convert robots of the catalogue with another tool, and compare the result with the URDF by `urdfkin.same`.

To MJCF, MuJoCo compiles the URDF and writes the model:

    python scripts/survey_converters.py mujoco [ROBOT...]

To USD, Newton's urdf-usd-converter writes a stage. It needs the library usd-exchange, whose modules have the
names of usd-core's, so it belongs in an environment of its own:

    python -m venv CONVERTER && CONVERTER/bin/pip install urdf-usd-converter
    python scripts/survey_converters.py CONVERTER/bin/python [ROBOT...]

Shapes are removed first: a converter would look for meshes. MuJoCo refuses a moving body without mass, so it
is told to give such a body a small one, and to correct impossible inertias.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path
from xml.etree import ElementTree

sys.path.insert(0, str(Path(__file__).parents[1]))  # run from a checkout that is not installed

import urdfkin
from scripts.pages import table
from urdfkin.comparison.result import Sameness, Verdict, angle, length
from urdfkin.urdf.catalogue import catalogue

_TO_USD = """
import sys
import urdf_usd_converter
made = urdf_usd_converter.Converter(layer_structure=False, scene=False).convert(*sys.argv[1:])
print(made.path)
"""
_TO_MJCF = """
import pathlib, sys
import mujoco
spec = mujoco.MjSpec.from_file(sys.argv[1])
spec.compile()
path = pathlib.Path(sys.argv[2]).with_suffix(".xml")
path.write_text(spec.to_xml())
print(path)
"""
#: Longest quotation of the converter's message, in characters.
_QUOTED = 120
#: Settings with which MuJoCo accepts bodies without mass, or with an impossible inertia.
_LENIENT = {"boundmass": "1e-3", "boundinertia": "1e-6", "balanceinertia": "true"}


def converted(tool: str, urdf: str, folder: Path) -> Path | str:
    """Return the file that a tool writes for a URDF text, or the tool's message if it refuses the robot."""
    robot = ElementTree.fromstring(urdf)
    for link in robot.iterfind("link"):
        for shape in [*link.iterfind("visual"), *link.iterfind("collision")]:
            link.remove(shape)
    script, python = _TO_USD, tool
    if tool == "mujoco":
        script, python = _TO_MJCF, sys.executable
        ElementTree.SubElement(ElementTree.SubElement(robot, "mujoco"), "compiler", _LENIENT)
    file = folder / "robot.urdf"
    file.write_bytes(ElementTree.tostring(robot))
    words = [python, "-I", "-c", script, str(file), str(folder / "converted")]
    done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=300, cwd=folder)
    if done.returncode:
        error = done.stderr.rpartition("Error: ")[2] or "no message"
        return " ".join(error.split())[:_QUOTED]
    return Path(done.stdout.strip().splitlines()[-1])


def row_of(tool: str, name: str) -> tuple[str, str, str, str, str]:
    """Return the row of a robot: name, joints, verdict, and two sizes.

    For MJCF the sizes are the largest distance and the largest angle between the models as they are written.
    For USD, `same` gives two distances: the largest distance between the models, and the largest distance
    that single precision can cause.
    """
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        robot = urdfkin.load(name)
        joints = str(sum(joint.kind.nq > 0 for joint in robot.tree.joints))
        file = converted(tool, robot.urdf, Path(folder))
        if isinstance(file, str):
            return name, joints, f"the converter refuses it: {file}", "", ""
        try:
            found = urdfkin.same(robot, _loaded(file))
        except urdfkin.UrdfkinError as error:
            return name, joints, f"not compared: {error.what}", "", ""
    if tool == "mujoco":
        return name, joints, _verdict(found), length(found.written[0]), angle(found.written[1])
    off = length(0.0 if found.worst is None else found.worst.upper)
    if found.single is None:
        return name, joints, "the stage has no rounded number", off, ""
    return name, joints, _verdict(found), off, length(found.single[0])


def _verdict(found: Sameness) -> str:
    if found:
        after = found.verdict is Verdict.SAME_AFTER
        return f"equivalent up to {', '.join(found.up_to)}" if after else found.verdict.value
    return str(found.unexplained[0]) if found.unexplained else found.differences[0].words


def _loaded(file: Path) -> urdfkin.Robot:
    """Return the robot of a file.

    If the root link has no mass, the converter writes several articulations into the stage.
    """
    try:
        return urdfkin.load(file)
    except urdfkin.UrdfkinError as error:
        if "articulations" not in error.what:
            raise
    return urdfkin.load(file, articulation=f"/{file.stem}")


def main() -> None:
    """Print the table in Markdown."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("tool", help="mujoco, or the interpreter of the environment with urdf-usd-converter")
    parser.add_argument("robots", nargs="*", help="names of the catalogue (default: all)")
    given = parser.parse_args()
    last = "angle" if given.tool == "mujoco" else "single precision allows"
    heads = ("robot", "moving joints", "verdict", "at most apart", last)
    print(table(heads, []))
    for name in given.robots or list(catalogue()):
        print(f"| {' | '.join(row_of(given.tool, name))} |", flush=True)


if __name__ == "__main__":
    main()
