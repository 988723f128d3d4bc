"""Convert robots of the catalogue with other tools, and compare each result with its source by `same`.

    python scripts/survey_converters.py TOOL[=PYTHON]... [--robots NAME...]

PYTHON is the interpreter of an environment with the tool (default: this interpreter). A tool that reads MJCF
gets the MJCF file that MuJoCo makes from the URDF. A tool that reads USD needs a second tool, which writes
the USD file. `TOOLS` names the second tool. Install each tool in its own environment, because usd-core and
usd-exchange contain modules with equal names:

    python -m venv CONVERTER && CONVERTER/bin/pip install urdf-usd-converter
    python scripts/survey_converters.py urdf-usd-converter=CONVERTER/bin/python

The script prints a table with one row for each robot. For one tool, a row shows the verdict of `same` and two
bounds (see `make_row`). For several tools, a row has one cell for each tool, with a short verdict and the
bound on the distance. The script then prints the full verdicts to standard error. For several tools, `same`
uses no branch and bound, so `same` is faster, but the bounds may be larger.

The script removes visuals and collisions, because a converter would search for the meshes. MuJoCo refuses a
moving body without mass. The script therefore sets options with which MuJoCo gives such bodies a small mass,
and corrects impossible inertias.
"""

import argparse
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import urdfkin
from scripts.pages import table
from urdfkin.comparison.bounds import MAX_BOXES
from urdfkin.comparison.result import Sameness, Verdict, angle, length
from urdfkin.urdf.catalogue import catalogue

_NEWTON = """import {0}
made = {0}.Converter(layer_structure=False, scene=False).convert(source, to)
print(made.path)
"""
_COMPILED = """
spec = mujoco.MjSpec.from_file(source)
spec.compile()
pathlib.Path(to + ".xml").write_text(spec.to_xml())
"""


class Tool(NamedTuple):
    reads: str  # the tool that writes the input file; empty if the URDF is the input file
    program: str  # Python code that converts the file `source`
    writes: str = ""  # end of the output file's path; empty if the program prints the path


TOOLS = {
    "mujoco": Tool("", f"import mujoco{_COMPILED}", ".xml"),
    "urdf2mjcf": Tool(
        "",
        "from urdf2mjcf.convert import convert_urdf_to_mjcf\n"
        "convert_urdf_to_mjcf(source, to + '.xml', copy_meshes=False)",
        ".xml",
    ),
    "urdf-to-mjcf": Tool(
        "",
        "sys.argv = ['urdf-to-mjcf', source, '-o', to + '/robot.xml']\n"
        "from urdf_to_mjcf.cli.convert import main\nmain()",
        "/robot.xml",
    ),
    "urdf-usd-converter": Tool("", _NEWTON.format("urdf_usd_converter")),
    "mujoco-usd-converter": Tool("mujoco", _NEWTON.format("mujoco_usd_converter")),
    "mujoco-usd": Tool(
        "mujoco",
        "import mujoco.usd\nfrom pxr import Sdf\nSdf.Layer.FindOrOpen(source).Export(to + '.usda')",
        ".usda",
    ),
    "mujoco-usd-back": Tool(
        "mujoco-usd-converter",
        f"import mujoco, mujoco.usd\nfrom mujoco.usd import MjcPhysics{_COMPILED}",
        ".xml",
    ),
    "mjcf-urdf-simple-converter": Tool(
        "mujoco", "from mjcf_urdf_simple_converter import convert\nconvert(source, to + '.urdf')", ".urdf"
    ),
    "nvidia-srl-usd-to-urdf": Tool(
        "urdf-usd-converter",
        "from nvidia.srl.from_usd.to_urdf import UsdToUrdf\n"
        "UsdToUrdf.init_from_file(source).save_to_file(to + '.urdf')",
        ".urdf",
    ),
}
#: Short forms of verdicts. The first key with which a verdict begins determines its short form.
_SHORT = {
    "same up to": "single precision",
    "same": "same",
    "equivalent": "equivalent",
    "not compared": "not readable",
}
_QUOTED = 120
#: Settings with which MuJoCo accepts bodies without mass or with impossible inertia.
_LENIENT = {"boundmass": "1e-3", "boundinertia": "1e-6", "balanceinertia": "true"}


class RefusalError(Exception):
    """A robot cannot be converted or compared."""


def convert(tool: str, pythons: Mapping[str, str], urdf: Path, folder: Path) -> tuple[Path, Path]:
    """Convert a URDF with a tool; return the file that the tool reads and the file that it writes."""
    reads, program, writes = TOOLS[tool]
    source = convert(reads, pythons, urdf, folder)[1] if reads else urdf
    to = folder / tool.replace(" ", "-")
    script = f"import pathlib, sys\nsource, to = sys.argv[1:]\n{program}"
    command = [pythons.get(tool, sys.executable), "-I", "-c", script, str(source), str(to)]
    try:
        process = subprocess.run(
            command, capture_output=True, text=True, check=False, timeout=300, cwd=folder
        )
    except subprocess.TimeoutExpired:
        raise RefusalError(f"{tool} does not finish within 300 s") from None
    if process.returncode:
        lines = [line for line in process.stderr.splitlines() if "Error: " in line] or ["no message"]
        error = " ".join(process.stderr[process.stderr.rindex(lines[-1]) :].split()).partition("Error: ")[2]
        raise RefusalError(f"{'the converter' if len(pythons) == 1 else tool} refuses it: {error[:_QUOTED]}")
    return source, Path(f"{to}{writes}" if writes else process.stdout.strip().splitlines()[-1])


def _compare(tool: str, pythons: Mapping[str, str], robot: urdfkin.Robot) -> Sameness:
    with tempfile.TemporaryDirectory() as folder:
        files = convert(tool, pythons, _write_without_shapes(robot.urdf, Path(folder)), Path(folder))
        try:
            source = _load(files[0]) if TOOLS[tool].reads else robot
            return urdfkin.same(source, _load(files[1]), boxes=0 if len(pythons) > 1 else MAX_BOXES)
        except urdfkin.UrdfkinError as error:
            raise RefusalError(f"not compared: {error.what}") from None


def _write_without_shapes(urdf: str, folder: Path) -> Path:
    """Write a URDF without visuals and collisions, with settings that only MuJoCo reads."""
    robot = ElementTree.fromstring(urdf)
    for link in robot.iterfind("link"):
        for shape in [*link.iterfind("visual"), *link.iterfind("collision")]:
            link.remove(shape)
    ElementTree.SubElement(ElementTree.SubElement(robot, "mujoco"), "compiler", _LENIENT)
    file = folder / "robot.urdf"
    file.write_bytes(ElementTree.tostring(robot))
    return file


def make_row(tool: str, pythons: Mapping[str, str], robot: urdfkin.Robot) -> tuple[str, str, str]:
    """Return the verdict and two bounds.

    | tool | second cell | third cell |
    |---|---|---|
    | `urdf-usd-converter` | distance of the aligned models | distance due to single precision |
    | another tool | distance as written | angle as written |
    """
    try:
        comparison = _compare(tool, pythons, robot)
    except RefusalError as refusal:
        return str(refusal), "", ""
    verdict = comparison.verdict.value
    if comparison.verdict is Verdict.SAME_AFTER:
        verdict = f"equivalent up to {', '.join(comparison.up_to)}"
    elif not comparison:
        verdict = (
            str(comparison.unexplained[0]) if comparison.unexplained else comparison.differences[0].words
        )
    if tool != "urdf-usd-converter":
        return verdict, length(comparison.bound_as_written[0]), angle(comparison.bound_as_written[1])
    distance = length(0.0 if comparison.worst is None else comparison.worst.upper)
    if comparison.single is None:
        return "the stage has no rounded number", distance, ""
    return verdict, distance, length(comparison.single[0])


def make_wide_row(tools: Mapping[str, str], name: str, robot: urdfkin.Robot) -> Iterator[str]:
    for tool in tools:
        verdict, far, _ = make_row(tool, tools, robot)
        print(f"{name}, {tool}: {verdict} {far}", file=sys.stderr, flush=True)
        short = [word for start, word in _SHORT.items() if verdict.startswith(start)]
        yield " ".join(filter(None, [*short[:1], "" if short or far else "refused", far]))


def _load(file: Path) -> urdfkin.Robot:
    """Load a file; several articulations become one robot."""
    try:
        return urdfkin.load(file)
    except urdfkin.UrdfkinError as error:
        if "articulations" not in error.what:
            raise
    return urdfkin.load(file, articulation="/")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("tools", nargs="+", metavar="TOOL[=PYTHON]", help=f"one of {', '.join(TOOLS)}")
    parser.add_argument("--robots", nargs="+", default=list(catalogue()), help="default: the whole catalogue")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    tools = {
        name: python or sys.executable for name, _, python in (t.partition("=") for t in arguments.tools)
    }
    [tool, *more] = tools
    last = "single precision allows" if tool == "urdf-usd-converter" else "angle"
    print(table(["robot", "moving joints", *(tools if more else ("verdict", "at most apart", last))], []))
    for name in arguments.robots:
        robot = urdfkin.load(name)
        row = make_wide_row(tools, name, robot) if more else make_row(tool, tools, robot)
        joints = sum(joint.kind.nq > 0 for joint in robot.tree.joints)
        print(f"| {name} | {joints} | {' | '.join(row)} |", flush=True)
