"""`urdfkin chain`: the axes, origins and interorigin vectors of the joints between two frames."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from urdfkin.cli.answer import Answer, path_command
from urdfkin.cli.arguments import q_option, read_inputs, seed_option
from urdfkin.cli.output import console
from urdfkin.errors import InputError
from urdfkin.errors.display import six_digits
from urdfkin.errors.escape import csv_cell, csv_text, json_text

if TYPE_CHECKING:
    from urdfkin.model.tree import FloatArray
    from urdfkin.robot import Robot

_EXAMPLE = "urdfkin chain panda --base panda_link0 --tip panda_hand"
_FORMS = "table", "json", "csv"
_ENDINGS = {".json": ("json",), ".csv": ("csv",)}


@path_command("chain", _EXAMPLE, _FORMS, q_option, seed_option, endings=_ENDINGS)
def command(robot: Robot, base: str | None, tip: str | None, q: str, seed: int, verify: bool) -> Answer:
    """List the joints between two frames (section 7.5), in one configuration and in the base's axes.

    Each joint has its axis z, its origin O and the interorigin vector d to the next origin, in metres. The
    last vector d leads to the tip. The path may run up the tree: such a joint is marked "backwards", and its
    axis is reversed so that its coordinate keeps the URDF's sign. Fixed joints are folded in. --q is the
    configuration of the whole robot.

    Exit 0: verified. 1: a disagreement. 2: bad input. 3: not checked.
    """
    from urdfkin.verify.chain_checks import check_chain  # noqa: PLC0415  keeps --help fast

    path = robot.chain(tip, base)
    at = read_inputs(robot, path.tip, seed, q).q
    if len(at) != 1:
        raise InputError("the chain needs exactly one configuration", where="--q", found=str(len(at)))
    own = path.coupling.select(robot.tree, at)[0]
    axes, origins, ways = path.axes(own), path.origins(own), path.interorigin(own)
    joints = list(zip(path.joints, axes, origins, ways, strict=False))

    def show() -> None:
        from urdfkin.report.listing import print_named  # noqa: PLC0415

        out = console()
        names = ", ".join(path.joint_names) or "none: nothing moves"
        out.print(f"{path.robot}: {path.base} to {path.tip}, coordinates {names}", style="bold")
        rows = [(joint.name, _kind(joint), *map(_vector, three)) for joint, *three in joints]
        rows.append((path.tip, "tip", "", _vector(origins[-1]), ""))
        heads = ("joint", "kind", "axis z", "origin O [m]", "to the next d [m]")
        print_named(out, heads, rows, left=range(5))

    def as_json(line: str | None) -> str:
        document = {
            "robot": robot.name,
            "source": robot.source,
            "base": path.base,
            "tip": path.tip,
            "q": at[0].tolist(),
            "coordinates": list(path.joint_names),
            "path_q": own.tolist(),
            "joints": [
                {
                    "name": joint.name,
                    "kind": joint.kind.value,
                    "backwards": joint.backwards,
                    "follows": joint.mimic.leader if joint.mimic else None,
                    "axis": z.tolist(),
                    "origin": origin.tolist(),
                    "interorigin": d.tolist(),
                }
                for joint, z, origin, d in joints
            ],
            "placement": path.placement(own).tolist(),
            "verified": line is not None,
            "check": line,
        }
        return json_text(document) + "\n"

    def as_csv(_: str | None) -> str:
        vectors = [f"{name}{axis}" for name in ("z", "O", "d") for axis in "xyz"]
        rows: list[list[object]] = [["i", "joint", "kind", "backwards", *vectors]]
        for i, (joint, *three) in enumerate(joints, 1):
            numbers = [repr(x) for vector in three for x in vector.tolist()]
            rows.append([i, csv_cell(joint.name), joint.kind.value, int(joint.backwards), *numbers])
        return csv_text(rows)

    check = check_chain(robot.verifier, path, at) if verify else None
    return Answer(show, {"json": as_json, "csv": as_csv}, check)


def _kind(joint: Any) -> str:
    follows = f", follows {joint.mimic.leader}" if joint.mimic else ""
    return f"{joint.kind.value}{', backwards' if joint.backwards else ''}{follows}"


def _vector(numbers: FloatArray) -> str:
    """Return the numbers with six digits; rounding errors of a metre appear as 0."""
    return " ".join(six_digits(x) for x in numbers.tolist())
