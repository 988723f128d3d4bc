"""Define the commands about a path between two frames: `urdfkin chain`, `screws` and `structure`."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from urdfkin.cli.options import (
    NumberInRange,
    convention_of_input_option,
    digits_option,
    find_conversion,
    load_robot,
    lock_settings,
    locked_line,
    path_options,
    q_option,
    read_inputs,
    reject_unused_options,
    robot_argument,
    seed_option,
    verify_option,
)
from urdfkin.cli.output import TEXT_FORMATS, Answer, answer_command, format_pinocchio_check
from urdfkin.errors import InputError
from urdfkin.errors.display import Table, TextDocument, format_number
from urdfkin.errors.escape import csv_cell

if TYPE_CHECKING:
    from urdfkin.dh.structure import Structure, StructureKind
    from urdfkin.model.tree import FloatArray
    from urdfkin.robot import Robot


@click.command("chain", epilog="Example: urdfkin chain panda --base panda_link0 --tip panda_hand")
@robot_argument
@path_options
@q_option
@convention_of_input_option
@seed_option
@verify_option
@answer_command()
def chain_command(
    robot: str, base: str | None, tip: str | None, q: str, convention: str | None, seed: int, verify: bool
) -> Answer:
    """List the joints on the path between two frames (section 7.5), with their axes in one configuration.

    For each joint, the table has the axis z, the origin O, and the vector d to the origin of the next joint.
    All vectors are in the axes of the base; O and d are in metres. The last vector d leads to the tip.

    The mark "backwards" means that the path leads from a joint's child link to its parent link. The axis z of
    a backwards joint is reversed, so that its coordinate has the same sign as in the URDF. The table does not
    list fixed joints. The offset of a fixed joint is a part of a vector d. The option --q gives the
    configuration of the whole robot.

    Exit 0: verified. 1: a disagreement. 2: bad input. 3: not checked.
    """
    from urdfkin.verify.conversions import check_chain

    loaded = load_robot(robot, verify=verify)
    path = loaded.chain(tip, base)
    inputs = read_inputs(loaded, path.tip, seed, q, conversion=find_conversion(loaded, convention))
    if len(inputs.q) != 1:
        raise InputError("the chain needs exactly one configuration", where="--q", found=str(len(inputs.q)))
    path_q = path.coupling.select(loaded.tree, inputs.q)[0]
    origins = path.origins(path_q)
    joints = list(zip(path.joints, path.axes(path_q), origins, path.interorigin(path_q), strict=False))

    def document() -> TextDocument:
        names = ", ".join(path.joint_names) or "none: no joint moves"
        rows = [(joint.name, _kind_of_joint(joint), *map(_vector, vectors)) for joint, *vectors in joints]
        rows.append((path.tip, "tip", "", _vector(origins[-1]), ""))
        heads = ("joint", "kind", "axis z", "origin O [m]", "d to the next origin [m]")
        title = f"{path.robot}: {path.base} to {path.tip}, coordinates {names}"
        title += "" if convention is None else f", convention {convention}"
        return _with_locked_joints(TextDocument(title, [Table(heads, rows, left=5, names=(0,))]), loaded)

    def data() -> dict[str, Any]:
        converted = inputs.convert_to_given_convention()
        return {
            "robot": loaded.name,
            "source": loaded.source,
            "base": path.base,
            "tip": path.tip,
            "q": converted.q[0].tolist(),
            **converted.settings,
            "coordinates": list(path.joint_names),
            "path_q": path_q.tolist(),
            "joints": [
                {
                    "name": joint.name,
                    "kind": joint.kind.value,
                    "backwards": joint.backwards,
                    "follows": joint.mimic.mimicked_joint if joint.mimic else None,
                    "axis": z.tolist(),
                    "origin": origin.tolist(),
                    "interorigin": d.tolist(),
                }
                for joint, z, origin, d in joints
            ],
            "placement": path.placement(path_q).tolist(),
        }

    def csv_rows() -> Iterator[list[object]]:
        yield ["i", "joint", "kind", "backwards", *(f"{name}{axis}" for name in "zOd" for axis in "xyz")]
        for i, (joint, *vectors) in enumerate(joints, 1):
            numbers = [repr(x) for vector in vectors for x in vector.tolist()]
            yield [i, csv_cell(joint.name), joint.kind.value, int(joint.backwards), *numbers]

    check = check_chain(loaded.verifier, path, inputs.q) if verify else None
    return Answer(document, {"json": data, "csv": csv_rows}, *format_pinocchio_check(check))


def _kind_of_joint(joint: Any) -> str:
    mimics = f", mimics {joint.mimic.mimicked_joint}" if joint.mimic else ""
    return f"{joint.kind.value}{', backwards' if joint.backwards else ''}{mimics}"


def _vector(numbers: FloatArray) -> str:
    return " ".join(format_number(x) for x in numbers.tolist())


SCREW_FORMATS = ("terminal", "markdown", "html", "latex", "toml", "json", "numpy", "matlab")
_SCREW_SUFFIXES = {
    ".txt": ("terminal",), ".md": ("markdown",), ".html": ("html",), ".tex": ("latex",), ".toml": ("toml",),
    ".json": ("json",), ".py": ("numpy",), ".m": ("matlab",),
}  # fmt: skip


@click.command("screws", epilog="Example: urdfkin screws ur5 --tip tool0")
@robot_argument
@path_options
@digits_option
@verify_option
@answer_command(*SCREW_FORMATS, suffixes=_SCREW_SUFFIXES)
def screws_command(robot: str, base: str | None, tip: str | None, digits: int, verify: bool) -> Answer:
    """Derive the product of exponentials of a path in the notation of Lynch and Park.

    The result is the pose M in the zero configuration, and each joint's screw in space and body axes. A screw
    is a vector (w, v), with the angular velocity w first. In generated code, each screw is a column of the
    matrix Slist (space axes) or Blist (body axes). The result can be written as a TOML or JSON file. Commands
    that take a ROBOT can load this file. If you write such a file by hand, write the pose as `M`, and the
    screws as `space` or as `body`.

    Exit 0: verified. 1: a disagreement. 2: bad input. 3: not checked.
    """
    from urdfkin.dh.export.toolboxes import write_screws
    from urdfkin.dh.screws import screws_document
    from urdfkin.verify.conversions import check_screws

    loaded = load_robot(robot, verify=verify)
    screws = loaded.screws(tip, base, verify=False)
    check = check_screws(loaded.verifier, screws) if verify else None
    exact = (form for form in SCREW_FORMATS if form not in ("terminal", "markdown", "html"))
    data: dict[str, Callable[[], str]] = {form: partial(write_screws, screws, form, digits) for form in exact}
    mapping = {**screws.as_mapping(), **lock_settings(loaded)}
    data["json"] = lambda: json.dumps(mapping, indent=2) + "\n"
    return Answer(
        lambda: _with_locked_joints(screws_document(screws, digits), loaded),
        data,
        *format_pinocchio_check(check),
    )


@click.command("structure", epilog="Example: urdfkin structure ur5 --tip tool0")
@robot_argument
@path_options
@click.option(
    "--opw",
    type=NumberInRange(min=0),
    metavar="MM",
    help="Print the parameters of an OPW solver as YAML, instead of the structure. MM is the largest allowed"
    " error of the tip's coordinates in millimetres. For entries of the tip's rotation matrix, the limit is"
    " MM / 1000.",
)
@verify_option
@answer_command(*TEXT_FORMATS, "json")
def structure_command(
    robot: str, base: str | None, tip: str | None, opw: float | None, verify: bool
) -> Answer:
    """Find parallel and intersecting axes of an arm, its class (such as SCARA), and solvers for it.

    A property such as parallel axes is reported if the deviation is at most 0.02 rad or 5 mm. The tolerance
    is needed because the axes of a calibrated arm are never exactly parallel. The deviation is printed.
    Pinocchio checks the screws of the arm's joints. JSON is in metres and radians.

    Exit 0: verified. 1: a disagreement. 2: bad input. 3: not checked.
    """
    from urdfkin.dh.structure import find_opw, find_structure
    from urdfkin.system.documents import as_json_data
    from urdfkin.verify.conversions import check_opw, check_screws

    if opw is not None:
        context = click.get_current_context()
        reject_unused_options(context, ("format_",), "with --opw")
        if context.params["format_"] != "table":
            raise InputError(
                "--opw writes YAML", where=str(context.params["output"]), remedy="use the suffix .txt"
            )
    loaded = load_robot(robot, verify=verify)
    if opw is None:
        screws = loaded.screws(tip, base, verify=False)
        check = check_screws(loaded.verifier, screws) if verify else None
        found = find_structure(screws)
        data = {"json": lambda: as_json_data(found) | lock_settings(loaded)}
        return Answer(
            lambda: _with_locked_joints(_structure_document(found), loaded),
            data,
            *format_pinocchio_check(check),
        )
    path = loaded.chain(tip, base)
    parameters = find_opw(path, opw / 1e3)
    check = check_opw(loaded.verifier, path, parameters) if verify else None
    yaml = "".join(f"{key}: {json.dumps(value)}\n" for key, value in parameters.as_mapping().items())
    return Answer(lambda: TextDocument(""), {"table": lambda: yaml}, *format_pinocchio_check(check))


def _with_locked_joints(document: TextDocument, robot: Robot) -> TextDocument:
    line = locked_line(robot)
    return replace(document, parts=[line, *document.parts]) if line else document


def _structure_document(found: Structure) -> TextDocument:
    spare = len(found.joints) - found.freedoms
    degrees = f"{found.freedoms} degree{'s' * (found.freedoms != 1)} of freedom"
    title = (
        f"{found.robot}: {found.base_frame} to {found.tip_frame}, {found.joints or 'no joints'},"
        f" {degrees}{f', redundant by {spare}' if spare > 0 else ''}"
    )
    parts: list[str | Table] = []
    if found.pairs:
        rows = []
        for pair in found.pairs:
            angle = format_number(math.degrees(pair.angle), 1e-9)
            distance = format_number(pair.distance * 1e3, 1e-9)
            rows.append((f"{pair.first}, {pair.second}", angle, distance))
        parts += ["", Table(("axes", "angle [deg]", "distance [mm]"), rows)]
    parts += ["", *map(_kind_line, found.kinds)] if found.kinds else []
    point = ", ".join(format_number(x, 1e-12) for x in found.reach_from)
    bound = "" if math.isinf(found.reach) else f", at most {found.reach:.6g} m"
    parts += [
        f"reach: {found.sampled_reach:.6g} m on samples{bound}, measured from ({point}) m,"
        f" {found.reach_point}",
        *(f"closed form: {solver}" for solver in found.solvers),
        "",
    ]
    return TextDocument(title, parts)


def _kind_line(kind: StructureKind) -> str:
    deviation = f"{kind.radians:.3g} rad off" if kind.radians else f"{kind.metres * 1e3:.3g} mm off"
    line = f"{kind.name}: {', '.join(kind.joints)}, {'exactly' if kind.is_exact else deviation}"
    if kind.at is None:
        return line
    return f"{line}, centre ({', '.join(format_number(x, 1e-12) for x in kind.at)}) m at zero"
