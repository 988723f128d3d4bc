"""`urdfkin structure`: classify an arm by its parallel and intersecting axes; list closed-form solvers."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import click

from urdfkin.cli.arguments import load_robot, path_options, robot_argument, verify_option
from urdfkin.cli.options import Number
from urdfkin.cli.output import end_of_path

if TYPE_CHECKING:
    from urdfkin.dh.structure import Kind, Structure
    from urdfkin.model.chain import FrameChain
    from urdfkin.robot import Robot


@click.command(epilog="Example: urdfkin structure ur5 --tip tool0")
@robot_argument
@path_options
@click.option(
    "--opw",
    type=Number(),
    metavar="MM",
    help="Print parameters for OPW solvers as YAML; an error if the tip deviates by more than MM (and mrad).",
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON, in metres and radians.")
@verify_option
@click.pass_context
def command(
    context: click.Context,
    robot: str,
    base: str | None,
    tip: str | None,
    opw: float | None,
    as_json: bool,
    verify: bool,
) -> None:
    """Classify an arm by its consecutive parallel and intersecting axes: wrist, SCARA, gantry, solvers.

    An arm counts as a kind within 0.02 rad or 5 mm. The deviation is printed, since a calibrated arm is never
    exactly of a kind. The screws are compared with Pinocchio.

    Exit 0: verified. 1: a disagreement. 2: bad input. 3: not checked.
    """
    import json  # noqa: PLC0415  keeps --help fast

    from urdfkin.cli.streams import say, say_file  # noqa: PLC0415
    from urdfkin.dh.structure import structure  # noqa: PLC0415
    from urdfkin.verify.chain_checks import check_screws  # noqa: PLC0415

    loaded = load_robot(robot, verify=verify)
    if opw is not None:
        context.exit(_opw(loaded, loaded.chain(tip, base), opw / 1e3, verify=verify))
    screws = loaded.screws(tip, base, verify=False)
    said = check_screws(loaded.verifier, screws) if verify else None
    found = structure(screws)
    line, code = end_of_path(said)
    if as_json:
        say_file(json.dumps(found.as_mapping(), indent=2).replace("Infinity", "null") + "\n")
        say(line, err=True)
    else:
        for text in [*_lines(found), "", line]:
            say(text)
    context.exit(code)


def _opw(robot: Robot, path: FrameChain, tolerance: float, *, verify: bool) -> int:
    import json  # noqa: PLC0415  keeps --help fast

    from urdfkin.cli.streams import say, say_file  # noqa: PLC0415
    from urdfkin.dh.structure import opw_of  # noqa: PLC0415
    from urdfkin.verify.chain_checks import check_opw  # noqa: PLC0415

    found = opw_of(path, tolerance)
    said = check_opw(robot.verifier, path, found) if verify else None
    say_file("".join(f"{key}: {json.dumps(value)}\n" for key, value in found.as_mapping().items()))
    line, code = end_of_path(said)
    say(line, err=True)
    return code


def _lines(found: Structure) -> list[str]:
    from urdfkin.dh.export.text import aligned  # noqa: PLC0415  keeps --help fast
    from urdfkin.errors.escape import printable  # noqa: PLC0415

    spare = len(found.joints) - found.freedoms
    lines = [
        f"{found.robot}: {found.base_frame} to {found.tip_frame}, {found.joints or 'no joints'},"
        f" {found.freedoms} freedoms{f', redundant by {spare}' if spare > 0 else ''}"
    ]
    if found.pairs:
        body = [["", "axes", "angle [deg]", "apart [mm]"]]
        for pair in found.pairs:
            degrees = math.degrees(pair.angle)
            angle = f"{degrees:.6g}" if degrees > 1e-9 else "0"
            apart = f"{pair.distance * 1e3:.6g}" if pair.distance > 1e-12 else "0"
            body.append(["", f"{pair.first}, {pair.second}", angle, apart])
        lines += ["", *aligned(body)]
    lines += ["", *(_kind(kind) for kind in found.kinds)] if found.kinds else []
    far = "" if math.isinf(found.reach) else f", at most {found.reach:.6g} m"
    lines += [
        f"reach: {found.reached:.4g} m on samples{far}, from the first axis where the second is nearest"
    ]
    lines += [f"closed form: {solver}" for solver in found.solvers]
    return list(map(printable, lines))


def _kind(kind: Kind) -> str:
    near = f"{kind.radians:.3g} rad off" if kind.radians else f"{kind.metres * 1e3:.3g} mm off"
    off = "exactly" if kind.is_exact else near
    at = (
        "" if kind.at is None else f", centre ({', '.join(f'{round(x, 12):.6g}' for x in kind.at)}) m at zero"
    )
    return f"{kind.name}: {', '.join(kind.joints)}, {off}{at}"
